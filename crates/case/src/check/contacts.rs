//! Contact pairs at the start: gaps, penetrations, and what lies opposite.

use slipstick_contact::ContactStatus;
use slipstick_contact::kinematics::NodeKinematics;
use slipstick_mesh::{ContactMap, Mesh};
use slipstick_model::model::{LoadTime, NodalContact};
use slipstick_model::overlaps::overlaps_at;
use slipstick_model::words::{counted, quantity};
use slipstick_path::StateError;

use super::{ContactSummary, Notice, NoticeKind, StartGap, adjusted, facets, held, normals, recognised};
use crate::construct::Problem;
use crate::construct::symmetry::mirrored;
use crate::file::{Case, Contact, Enforcement, LoadCase, Quantity};
use crate::quantity::{PressureWord, QuantityKind};

/// Penetrations above this fraction of the facet size cause a warning.
const PENETRATION: f64 = 1e-6;

/// Figures about every contact pair at the start; adds notices about them.
pub(super) fn contacts(
    case: &Case,
    problem: &mut Problem,
    notices: &mut Vec<Notice>,
) -> Result<Vec<ContactSummary>, StateError> {
    let rest = problem.analysis.model().rest();
    let found = problem.analysis.design.contact_results(&rest, &rest, LoadTime::default())?.nodes;
    let open: Vec<bool> = found.iter().map(|at| at.status == ContactStatus::Inactive).collect();
    let overlaps = overlaps_at(&problem.mesh, problem.analysis.model(), &rest.unknowns, LoadTime::default(), &open);
    notices.extend(overlaps.iter().map(|overlap| Notice {
        kind: NoticeKind::OpenOverlap,
        path: format!("contact[{}]", overlap.pair),
        message: overlap.to_string(),
        help: overlap.help(),
    }));
    let mut start = 0;
    let mut summaries = Vec::new();
    let by_case = gaps_of_load_cases(case, problem)?;
    let points = ContactMap::new(&problem.mesh).points(&problem.mesh.nodes);
    let moves = crate::construct::ties::moves(case).unwrap_or_default();
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
        // the case may prescribe an interference
        let wanted = contact.adjust.as_ref().map_or(0.0, |adjust| adjust.gap().min(0.0));
        if let Some((gap, node)) = closest.filter(|c| c.0 < wanted - PENETRATION * size) {
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
        if closest.is_some() {
            notices.extend(not_faced(case, contact, nodes, &problem.mesh));
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
        let sides = crate::construct::sides::of(case, contact, &problem.mesh, &points, &mirrored);
        let at_rim =
            |sides| crate::construct::sides::at_rim(case, contact, i, sides, &problem.mesh, &points, &mirrored);
        notices.extend(sides.and_then(|sides| facets::coarse_slave(i, contact, sides, at_rim(sides))));
        notices.extend(held::on_both_sides(interface, i, case, contact, &problem.mesh));
        let facing = nodes.iter().filter(|n| n.gap.is_some()).map(|n| n.node).collect();
        notices.extend(held::in_objective(case, contact, &facing, &problem.mesh));
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
            adjusted: adjusted::adjustment(contact, model, nodes, (&problem.mesh, &points)),
            surfaces: recognised::parts(case, contact, interface, &problem.mesh, &mirrored),
        });
    }
    Ok(summaries)
}

/// A notice for each smallest pressure of the case that leaves out slave nodes opposite nothing.
fn not_faced(case: &Case, contact: &Contact, nodes: &[NodalContact], mesh: &Mesh) -> Vec<Notice> {
    let notice = |(number, of): (usize, &Quantity)| {
        let QuantityKind::ContactPressure(pressure) = &of.kind else { return None };
        if pressure.slave != contact.slave || pressure.measure != PressureWord::Minimum {
            return None;
        }
        let within = pressure.within.as_ref().and_then(|within| mesh.set_nodes(within));
        let counts = |at: &&NodalContact| within.as_ref().is_none_or(|nodes| nodes.contains(&at.node));
        let alone: Vec<u32> = nodes.iter().filter(counts).filter(|at| at.gap.is_none()).map(|at| at.node).collect();
        let alone = distinct(alone.iter().copied());
        (alone > 0).then(|| Notice {
            kind: NoticeKind::NothingOpposite,
            path: format!("quantity[{number}].contact_pressure"),
            message: format!(
                "nothing lies opposite {} of `{}` at the start: as long as that is so, the smallest pressure `{}` and its \
                 extreme leave them out, although they carry no pressure",
                counted(alone, "node"),
                contact.slave,
                of.name
            ),
            help: "no action is needed if a part of the surface is meant to stay free: `within` names the rest; otherwise \
                   extend the master"
                .into(),
        })
    };
    case.quantities.iter().enumerate().filter_map(notice).collect()
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
        let time = LoadTime::start(number);
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
