//! Checks of a case before it runs: sizes, supports, initial gaps.

mod adjusted;
mod closing;
mod connection;
mod design;
mod distance;
mod facets;
mod held;
mod normals;
mod recognised;
mod surfaces;
mod volume;

use std::ops::Range;

use crate::build::Problem;
use crate::build::symmetry::mirrored;
use crate::case::{Case, Contact, Enforcement, LoadCase};
use nalgebra::DMatrix;
use serde::Serialize;
use slipstick_contact::friction::Status;
use slipstick_contact::kinematics::NodeKinematics;
use slipstick_mesh::Mesh;
use slipstick_model::model::{NodalContact, course};
use slipstick_model::overlaps::overlaps_at;
use slipstick_model::words::{counted, quantity};
use slipstick_path::StateError;

pub use adjusted::Adjustment;
pub use recognised::{SurfaceKind, SurfacePart};
pub use surfaces::SurfaceSummary;
pub use volume::start_volume;

/// The subject of a notice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NoticeKind {
    /// Supports leave some rigid motions of a body free.
    LooseBody,
    /// Parts of a body share no nodes, or coincident nodes are not merged.
    Disconnected,
    /// Quadrilaterals meet triangles within a body, and their displacements do not conform.
    Divided,
    /// The bodies of a contact pair penetrate each other at the start.
    PenetratingStart,
    /// A node lies below the other surface at the start, while the mean gap there is open.
    OpenOverlap,
    /// Tied surfaces are apart, or only partly opposite each other.
    TiedApart,
    /// The surfaces of a contact pair are out of each other's search range.
    NothingOpposite,
    /// No prescribed motion closes a contact pair.
    NeverCloses,
    /// Averaged normals of a slave surface differ strongly from the normals of its facets.
    AveragedNormals,
    /// The slave facets of a contact pair are much coarser than the master facets.
    CoarseSlave,
    /// A surface of a rigid body is the slave of a pair with multipliers.
    RigidSlave,
    /// Supports on one plane hold both sides of a contact pair.
    HeldTwice,
    /// A load acts only on prescribed displacements.
    IdleLoad,
    /// The initial design exceeds the volume bound.
    InitialVolume,
    /// A passive region contains no element.
    EmptyPassiveRegion,
    /// The filter radius reaches no neighbouring element.
    IdleFilter,
    /// The void of a designed body is stiffer than a body that touches it.
    StiffVoid,
}

/// A finding that does not prevent the run, but is probably a mistake.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Notice {
    /// Its subject.
    pub kind: NoticeKind,
    /// Dotted path in the case file.
    pub path: String,
    /// The finding.
    pub message: String,
    /// The remedy.
    pub help: String,
}

/// Figures about a body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BodySummary {
    /// Name.
    pub name: String,
    /// Elements.
    pub elements: usize,
    /// Nodes.
    pub nodes: usize,
    /// Volume. \[L³\]
    pub volume: f64,
    /// Worst scaled Jacobian of its elements: 1 for a brick, a right prism on an equilateral
    /// triangle or a regular tetrahedron, 0 for a degenerate element.
    pub quality: f64,
    /// Rigid motions (of 6) that supports and prescribed motions leave free.
    pub free_motions: usize,
}

/// A contact pair in its reference configuration.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ContactSummary {
    /// Slave surface.
    pub slave: String,
    /// Master surface.
    pub master: String,
    /// Slave facets and nodes, master facets.
    pub facets: [usize; 2],
    /// Slave nodes.
    pub slave_nodes: usize,
    /// Slave nodes on edges that are sharper than the feature angle.
    pub sharp_nodes: usize,
    /// Slave nodes that face the master within the search radius.
    pub covered: usize,
    /// Smallest nodal gap (weighted gap over tributary area), negative: penetration; `None` if no
    /// slave node faces the master. \[L\]
    pub smallest_gap: Option<f64>,
    /// Node of the smallest gap.
    pub at_node: Option<u32>,
    /// The same for each load case, if the bodies start elsewhere in any.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub load_cases: Vec<StartGap>,
    /// Search distance along the slave normal. \[L\]
    pub reach: f64,
    /// What `adjust` has removed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adjusted: Option<Adjustment>,
    /// The surfaces for which the facets of slave and master stand; none for tied pairs.
    pub surfaces: [Vec<SurfacePart>; 2],
}

/// How far apart the surfaces of a contact pair are at the start of a load case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StartGap {
    /// The load case.
    pub load_case: String,
    /// As [`ContactSummary::smallest_gap`].
    pub smallest_gap: Option<f64>,
    /// Node of the smallest gap.
    pub at_node: Option<u32>,
}

/// The result of a check.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Inspection {
    /// Bodies.
    pub bodies: Vec<BodySummary>,
    /// Contact pairs.
    pub contacts: Vec<ContactSummary>,
    /// Named node sets and surfaces with their number of nodes.
    pub sets: Vec<(String, usize)>,
    /// Surfaces.
    pub surfaces: Vec<SurfaceSummary>,
    /// Designed elements.
    pub designed: usize,
    /// Design variables; fewer than designed elements if these share variables.
    pub variables: usize,
    /// Load steps.
    pub steps: usize,
    /// Warnings.
    pub notices: Vec<Notice>,
}

/// Penetrations above this fraction of the facet size cause a warning.
const PENETRATION: f64 = 1e-6;

/// Inspects a built problem in its reference configuration.
///
/// # Errors
/// If the reference configuration itself cannot be evaluated.
pub fn inspect(case: &Case, problem: &mut Problem) -> Result<Inspection, StateError> {
    let mut notices = Vec::new();
    let bodies = bodies(&problem.mesh, problem.analysis.model().prescribed().fixed());
    let held_by_ties = held_by_ties(case, &problem.mesh, &bodies, problem.analysis.model().prescribed().fixed());
    for (b, body) in bodies.iter().enumerate() {
        if body.free_motions > 0 && !held_by_ties[b] {
            notices.push(Notice {
                kind: NoticeKind::LooseBody,
                path: format!("body[{b}]"),
                message: format!(
                    "body `{}` is free in {} of its 6 rigid motions; only contact could hold it",
                    body.name, body.free_motions
                ),
                help:
                    "if contact is to hold it, a load or another body must press it there; otherwise prescribe more of \
                       its displacements in a [[dirichlet]] table"
                        .into(),
            });
        }
    }
    notices.extend(connection::notices(case, &problem.mesh, problem.analysis.model().prescribed().fixed()));
    notices.extend(problem.analysis.model().idle_loads().into_iter().map(|load| Notice {
        kind: NoticeKind::IdleLoad,
        path: format!("load[{load}].surface"),
        message: format!("the load on `{}` has no effect: it acts only on prescribed displacements", case.loads[load].surface),
        help: "load another surface, or prescribe fewer components there; displacements normal to a symmetry plane are \
               prescribed too".into(),
    }));
    notices.extend(design::notices(case, problem));
    let contacts = contacts(case, problem, &mut notices)?;
    let touching = |n: &&Notice| matches!(n.kind, NoticeKind::PenetratingStart | NoticeKind::OpenOverlap);
    let penetrating: Vec<String> = notices.iter().filter(touching).map(|n| n.path.clone()).collect();
    let open = closing::never_closed(case, problem).into_iter();
    for open in open.filter(|open| !penetrating.contains(&format!("contact[{}]", open.pair))) {
        // it is more specific than the notice that nothing lies opposite at the start
        let path = format!("contact[{}]", open.pair);
        notices.retain(|notice| notice.kind != NoticeKind::NothingOpposite || notice.path != path);
        notices.push(open.notice(case));
    }
    let sets = problem
        .mesh
        .names()
        .iter()
        .map(|name| (name.to_string(), problem.mesh.set_nodes(name).map_or(0, |n| n.len())))
        .collect();
    Ok(Inspection {
        bodies,
        contacts,
        sets,
        surfaces: surfaces::surfaces(&problem.mesh),
        designed: problem.variables().map_or(0, |variables| variables.designed().len()),
        variables: problem.variables().map_or(0, slipstick_design::DesignVariables::count),
        steps: case.steps(),
        notices,
    })
}

fn bodies(mesh: &Mesh, fixed: &[bool]) -> Vec<BodySummary> {
    let (volumes, qualities) = (mesh.element_volumes(), mesh.element_qualities());
    mesh.bodies
        .iter()
        .enumerate()
        .map(|(b, body)| BodySummary {
            name: body.name.clone(),
            elements: body.elements.len(),
            nodes: body.nodes.len(),
            volume: volumes[body.elements.clone()].iter().sum(),
            quality: qualities[body.elements.clone()].iter().copied().fold(f64::INFINITY, f64::min),
            free_motions: match mesh.rigid.iter().find(|rigid| rigid.body == b) {
                Some(rigid) => fixed[3 * rigid.reference as usize..][..6].iter().filter(|fixed| !**fixed).count(),
                None => 6 - held_motions(mesh, body.nodes.clone(), fixed),
            },
        })
        .collect()
}

/// For each body, whether bodies to which it is tied during the whole path hold it: one of them has no
/// free rigid motion, or the supports of the deformable ones together leave none.
fn held_by_ties(case: &Case, mesh: &Mesh, bodies: &[BodySummary], fixed: &[bool]) -> Vec<bool> {
    // a surface may be the union of surfaces of several bodies
    let on = |surface: &String| {
        let facets = mesh.surfaces.get(surface).map_or(&[][..], |surface| &surface.facets);
        let has = |elements: &Range<usize>| facets.iter().any(|facet| elements.contains(&(facet.element as usize)));
        (0..bodies.len()).filter(|&b| has(&mesh.bodies[b].elements)).collect::<Vec<_>>()
    };
    let ties = case.contacts.iter().filter(|pair| pair.tied && pair.active == Contact::ALWAYS);
    let mut group: Vec<usize> = (0..bodies.len()).collect();
    for pair in ties {
        let (slaves, masters) = (on(&pair.slave), on(&pair.master));
        for (a, b) in slaves.iter().flat_map(|&a| masters.iter().map(move |&b| (a, b))) {
            let (from, to) = (group[a], group[b]);
            group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
        }
    }
    let held = |b: usize| {
        let members: Vec<usize> = (0..bodies.len()).filter(|&other| group[other] == group[b]).collect();
        // the nodes of rigid bodies count as prescribed, even if the body is free
        let deformable = members.iter().filter(|&&member| mesh.rigid.iter().all(|rigid| rigid.body != member));
        let nodes = deformable.flat_map(|&member| mesh.bodies[member].nodes.clone()).collect::<Vec<_>>();
        members.len() > 1
            && (members.iter().any(|&member| bodies[member].free_motions == 0)
                || held_motions(mesh, nodes.into_iter(), fixed) == 6)
    };
    (0..bodies.len()).map(held).collect()
}

/// Number of the six rigid motions of a body, or a part of it, that prescribed displacements
/// suppress.
fn held_motions(mesh: &Mesh, nodes: impl Iterator<Item = usize> + Clone, fixed: &[bool]) -> usize {
    let gram = rigid_motions(mesh, nodes, fixed);
    let largest = gram.diagonal().max();
    if largest == 0.0 {
        return 0;
    }
    gram.symmetric_eigenvalues().iter().filter(|&&e| e > HELD * largest).count()
}

/// Fraction of the largest eigenvalue below which a rigid motion counts as free.
const HELD: f64 = 1e-10;

/// The axes along which a body, or a part of it, can still move despite the prescribed
/// displacements, and the axes about whose directions it can rotate.
pub fn free_motions(mesh: &Mesh, nodes: impl Iterator<Item = usize> + Clone, fixed: &[bool]) -> ([bool; 3], [bool; 3]) {
    let gram = rigid_motions(mesh, nodes, fixed);
    let largest = gram.diagonal().max();
    let eigen = gram.symmetric_eigen();
    let free: Vec<usize> = (0..6).filter(|&i| eigen.eigenvalues[i] <= HELD * largest).collect();
    if free.is_empty() {
        return ([false; 3], [false; 3]);
    }
    let motions = DMatrix::from_fn(6, free.len(), |c, i| eigen.eigenvectors[(c, free[i])]);
    // unit translations in the span of the free motions; unit rotations, about any point, in the
    // span of their rotations
    let translation = |c: usize| motions.row(c).norm_squared() > 1.0 - FREE;
    let turns = motions.rows(3, 3).into_owned().svd(true, false);
    let basis = turns.u.unwrap_or_default();
    let strong = (0..turns.singular_values.len()).filter(|&i| turns.singular_values[i] > FREE);
    let strong: Vec<usize> = strong.collect();
    let rotation = |c: usize| strong.iter().map(|&i| basis[(c, i)].powi(2)).sum::<f64>() > 1.0 - FREE;
    (std::array::from_fn(translation), std::array::from_fn(rotation))
}

/// Tolerance on the squared length of the projection of a unit vector onto a subspace that contains
/// it.
const FREE: f64 = 1e-6;

/// Gram matrix of the six rigid motions of a body, three translations and three rotations about its
/// centre with arms relative to its size, summed over its prescribed displacements.
fn rigid_motions(mesh: &Mesh, nodes: impl Iterator<Item = usize> + Clone, fixed: &[bool]) -> DMatrix<f64> {
    let count = nodes.clone().count() as f64;
    let mut centre = [0.0; 3];
    for n in nodes.clone() {
        (0..3).for_each(|c| centre[c] += mesh.nodes[n][c] / count);
    }
    let mut size = 0.0;
    let mut gram = DMatrix::<f64>::zeros(6, 6);
    let arms: Vec<[f64; 3]> = nodes.clone().map(|n| std::array::from_fn(|c| mesh.nodes[n][c] - centre[c])).collect();
    for arm in &arms {
        size = f64::max(size, arm.iter().map(|a| a * a).sum::<f64>().sqrt());
    }
    for (n, arm) in nodes.zip(&arms) {
        let arm = arm.map(|a| a / size.max(f64::MIN_POSITIVE));
        for c in (0..3).filter(|&c| fixed[3 * n + c]) {
            // displacement component c of a translation and of a rotation about each axis:
            // (ω × arm)_c
            let (c1, c2) = ((c + 1) % 3, (c + 2) % 3);
            let mut row = [0.0; 6];
            row[c] = 1.0;
            row[3 + c1] = arm[c2];
            row[3 + c2] = -arm[c1];
            for i in 0..6 {
                for j in 0..6 {
                    gram[(i, j)] += row[i] * row[j];
                }
            }
        }
    }
    gram
}

fn contacts(case: &Case, problem: &mut Problem, notices: &mut Vec<Notice>) -> Result<Vec<ContactSummary>, StateError> {
    let rest = problem.analysis.model().rest();
    let found = problem.analysis.design.contact_results(&rest, &rest, 0.0)?.nodes;
    let open: Vec<bool> = found.iter().map(|at| at.status == Status::Inactive).collect();
    let overlaps = overlaps_at(&problem.mesh, problem.analysis.model(), &rest.unknowns, 0.0, &open);
    notices.extend(overlaps.iter().map(|overlap| Notice {
        kind: NoticeKind::OpenOverlap,
        path: format!("contact[{}]", overlap.pair),
        message: overlap.to_string(),
        help: overlap.help(),
    }));
    let mut start = 0;
    let mut summaries = Vec::new();
    let by_case = gaps_of_load_cases(case, problem)?;
    let moves = crate::build::ties::moves(case).unwrap_or_default();
    let mirrored = mirrored(case, &problem.mesh).unwrap_or_else(|_| vec![[false; 3]; problem.mesh.nodes.len()]);
    for (i, (contact, model)) in case.contacts.iter().zip(problem.analysis.model().interfaces()).enumerate() {
        let interface = &model.interface;
        let count = interface.slave_nodes().len();
        let nodes = &found[start..start + count];
        start += count;
        let closest = closest_of(nodes);
        let start_gap = |(name, found): &(String, Vec<NodalContact>)| {
            let closest = closest_of(&found[start - count..start]);
            StartGap { load_case: name.clone(), smallest_gap: closest.map(|c| c.0), at_node: closest.map(|c| c.1) }
        };
        let load_cases = by_case.iter().map(start_gap).collect();
        let size = interface
            .slave_facets()
            .iter()
            .map(|f| slipstick_mesh::facet_area(&f.corners(&problem.mesh.nodes)).sqrt())
            .fold(f64::INFINITY, f64::min);
        notices.extend(model.bond.as_ref().and_then(|bond| apart(bond, i, contact, size)));
        notices.extend(moves.get(i).copied().flatten().and_then(|moved| shifted(moved, i, contact, size)));
        if let Some((gap, node)) = closest.filter(|c| c.0 < -PENETRATION * size) {
            notices.push(Notice {
                kind: NoticeKind::PenetratingStart,
                path: format!("contact[{i}]"),
                message: format!(
                    "`{}` and `{}` penetrate each other by {:.3e} at node {node} at the start",
                    contact.slave, contact.master, -gap
                ),
                help: match contact.slave == contact.master {
                    true => {
                        "if the surface covers both sides of a wall, give a `search_radius` that is less than the \
                             thickness of the wall minus half the diagonal of a facet"
                    }
                    false => {
                        "move a body away with its `place.translate`; otherwise the first load step has to \
                              remove the penetration, or `adjust` removes it without stress"
                    }
                }
                .into(),
            });
        }
        if closest.is_none() && contact.active[0] == 0.0 {
            notices.push(Notice {
                kind: NoticeKind::NothingOpposite,
                path: format!("contact[{i}]"),
                message: format!(
                    "no part of `{}` lies opposite `{}` within the search distance {:.3e}",
                    contact.master,
                    contact.slave,
                    interface.reach()
                ),
                help:
                    "no action is needed if they meet later; otherwise check the placement and the choice of surfaces"
                        .into(),
            });
        }
        if !contact.tied {
            let far = normals::averaged(interface, &problem.mesh);
            notices.extend(far.map(|far| far.notice(i, contact, &problem.mesh)));
        }
        let of_rigid = interface.slave_nodes().first().and_then(|slave| problem.mesh.rigid_body_of(&[slave.node]));
        if let (Some(rigid), true) = (of_rigid, !matches!(contact.enforcement, Enforcement::Penalty { .. })) {
            notices.push(Notice {
                kind: NoticeKind::RigidSlave,
                path: format!("contact[{i}].slave"),
                message: format!(
                    "the slave surface `{}` belongs to the rigid body `{}`: its multipliers may outnumber the \
                     displacements that they determine, and the tangent is then singular",
                    contact.slave, problem.mesh.bodies[rigid.body].name
                ),
                help: "exchange slave and master, or use the penalty method".into(),
            });
        }
        notices.extend(facets::coarse_slave(interface, i, contact, &problem.mesh));
        notices.extend(held::on_both_sides(interface, i, case, contact, &problem.mesh));
        let slaves = interface.slave_nodes();
        summaries.push(ContactSummary {
            slave: contact.slave.clone(),
            master: contact.master.clone(),
            facets: [interface.slave_facets().len(), interface.master_facets().len()],
            slave_nodes: distinct(slaves.iter().map(|slave| slave.node)),
            sharp_nodes: distinct(slaves.iter().filter(|slave| slave.sharp).map(|slave| slave.node)),
            covered: match &model.bond {
                Some(bond) => distinct(bond.iter().filter(|row| faces_master(row)).map(|row| row.node)),
                None => distinct(nodes.iter().filter(|n| n.gap.is_some()).map(|n| n.node)),
            },
            smallest_gap: closest.map(|c| c.0),
            at_node: closest.map(|c| c.1),
            load_cases,
            reach: interface.reach(),
            adjusted: adjusted::adjustment(contact, model, nodes),
            surfaces: recognised::parts(case, contact, interface, &problem.mesh, &mirrored),
        });
    }
    Ok(summaries)
}

/// The smallest gap of some slave nodes, and its node.
fn closest_of(nodes: &[NodalContact]) -> Option<(f64, u32)> {
    nodes.iter().filter_map(|n| n.gap.map(|gap| (gap, n.node))).min_by(|a, b| a.0.total_cmp(&b.0))
}

/// The contact nodes at the start of each load case, if bodies start elsewhere in any.
fn gaps_of_load_cases(case: &Case, problem: &Problem) -> Result<Vec<(String, Vec<NodalContact>)>, StateError> {
    let moved = |of: &LoadCase| of.bodies.iter().any(|body| body.offset.is_some() || body.rotation.is_some());
    if !case.load_cases.iter().any(moved) {
        return Ok(Vec::new());
    }
    let of = |(number, load_case): (usize, &LoadCase)| {
        let time = course::start(number);
        let design = problem.analysis.design_at(time);
        let rest = design.model().rest();
        Ok((load_case.name.clone(), design.contact_results(&rest, &rest, time)?.nodes))
    };
    case.load_cases.iter().enumerate().map(of).collect()
}

/// Whether a part of the master lies opposite a slave node of a tie.
fn faces_master(row: &NodeKinematics) -> bool {
    row.area > 0.0 || row.support.len() > row.ring
}

/// A notice if tied surfaces do not lie on each other, or only partly.
fn apart(bond: &[NodeKinematics], pair: usize, contact: &Contact, size: f64) -> Option<Notice> {
    let free: Vec<_> = bond.iter().filter(|row| !faces_master(row)).collect();
    // cross points of ties have no row of their own
    let tied = bond.iter().filter(|row| row.area > 0.0);
    let (distance, node) = tied
        .map(|row| ((row.gap() / row.area).abs(), row.node))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(distance, _)| *distance > APART * size)
        .unwrap_or_default();
    let message = match (distance > 0.0, free.is_empty()) {
        (true, _) => format!(
            "the tied surfaces `{}` and `{}` are up to {} apart, at node {node}",
            contact.slave,
            contact.master,
            quantity(distance)
        ),
        (false, false) => format!(
            "{} of `{}` have no part of `{}` opposite and stay free",
            counted(free.len(), "node"),
            contact.slave,
            contact.master
        ),
        (false, true) => return None,
    };
    let help = "only gaps of up to 10 % of the size and thickness of the slave's elements are closed: the others remain, no \
                moment acts across them, and rotations cause stress. Let the surfaces lie on each other; where one \
                of them is smaller, make it the slave";
    Some(Notice { kind: NoticeKind::TiedApart, path: format!("contact[{pair}]"), message, help: help.into() })
}

/// A notice if slave nodes of a tie are moved so far that the shape of the body changes noticeably.
fn shifted((distance, node): (f64, u32), pair: usize, contact: &Contact, size: f64) -> Option<Notice> {
    (distance > SHIFTED * size).then(|| Notice {
        kind: NoticeKind::TiedApart,
        path: format!("contact[{pair}]"),
        message: format!(
            "the nodes of `{}` are moved by up to {} onto the tied surface `{}`, at node {node}",
            contact.slave,
            quantity(distance),
            contact.master
        ),
        help: "let the surfaces lie on each other, or use facets of similar size on a curved surface".into(),
    })
}

/// Tied surfaces that remain further apart than this fraction of the facet size cause a warning.
const APART: f64 = 1e-3;

/// Slave nodes of a tie that move further than this fraction of the facet size cause a warning.
const SHIFTED: f64 = 0.05;

/// Number of distinct nodes in an ascending list: a node on a sharp edge appears once for each
/// patch.
fn distinct(nodes: impl Iterator<Item = u32>) -> usize {
    let mut nodes: Vec<u32> = nodes.collect();
    nodes.dedup();
    nodes.len()
}
