//! Checks of a case before it runs: sizes, supports, initial gaps.

mod adjusted;
mod bodies;
mod closing;
mod connection;
mod contacts;
mod design;
mod distance;
mod facets;
mod held;
mod normals;
mod recognised;
mod sections;
mod surfaces;
mod volume;

use crate::construct::Problem;
use crate::file::Case;
use serde::Serialize;
use slipstick_model::words::quantity;
use slipstick_path::{LoadTime, StateError};

use bodies::{bodies, held_by_ties, poor_elements, straight_middles};
use contacts::contacts;

pub use adjusted::Adjustment;
pub use bodies::free_motions;
pub use recognised::{SurfaceKind, SurfacePart};
pub use sections::{SectionSummary, sections};
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
    /// Elements of a body are almost degenerate.
    PoorElements,
    /// Mid-side nodes of a body do not lie on the smooth surface of its faces.
    StraightMiddles,
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
    /// Supports on one plane hold both sides of a tie.
    HeldTwice,
    /// Supports hold slave nodes, and the objective leaves out the contact forces there.
    HeldInObjective,
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
    /// The work of the loads is an objective, and temperatures move the loads as well.
    HeatedCompliance,
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
    /// The regions of bodies with several materials.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sections: Vec<SectionSummary>,
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

/// Notices of bodies that supports hold at first, `at_first`, and not after a support has ended.
fn let_go(case: &Case, problem: &Problem, at_first: &[BodySummary]) -> Vec<Notice> {
    let prescribed = problem.analysis.model().prescribed();
    let ends = case.dirichlet.iter().enumerate().filter_map(|(i, of)| Some((i, of.until?)));
    let states = ends.map(|(i, until)| {
        let fixed = prescribed.linear().truly_fixed(&prescribed.supported(until.released));
        (i, until.t, bodies(&problem.mesh, &fixed))
    });
    let states: Vec<(usize, f64, Vec<BodySummary>)> = states.collect();
    let of = |(b, first): (usize, &BodySummary)| {
        let (i, t, then) = states.iter().find(|(_, _, then)| then[b].free_motions > 0)?;
        Some(Notice {
            kind: NoticeKind::LooseBody,
            path: format!("dirichlet[{i}].until"),
            message: format!(
                "after t = {}, body `{}` is free in {} of its 6 rigid motions; only contact could hold it",
                quantity(*t),
                first.name,
                then[b].free_motions
            ),
            help: "make sure that contact holds it when a support ends (`until`), or keep a support that prevents these motions"
                .into(),
        })
    };
    at_first.iter().enumerate().filter(|(_, first)| first.free_motions == 0).filter_map(of).collect()
}

/// Inspects a built problem in its reference configuration.
///
/// # Errors
/// If the reference configuration itself cannot be evaluated.
pub fn inspect(case: &Case, problem: &mut Problem) -> Result<Inspection, StateError> {
    let mut notices = Vec::new();
    let prescribed = problem.analysis.model().prescribed();
    let fixed = prescribed.linear().truly_fixed(&prescribed.supported(0.0));
    let bodies = bodies(&problem.mesh, &fixed);
    let held_by_ties = held_by_ties(case, &problem.mesh, &bodies, &fixed);
    let model = problem.analysis.model();
    let further = !(model.springs().is_empty() && model.prescribed().linear().is_empty());
    let rest = model.rest().unknowns;
    let held = |name: &str| further && model.is_held_without_contact(name, &rest, LoadTime::default());
    for (b, body) in bodies.iter().enumerate() {
        if body.free_motions > 0 && !held_by_ties[b] && !held(&body.name) {
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
    if !further {
        notices.extend(let_go(case, problem, &bodies));
    }
    notices.extend(poor_elements(&problem.mesh));
    notices.extend(straight_middles(case, &problem.mesh));
    notices.extend(connection::notices(case, &problem.mesh, &fixed));
    notices.extend(problem.analysis.model().idle_loads().into_iter().map(|load| Notice {
        kind: NoticeKind::IdleLoad,
        path: if case.loads[load].acts_on_mass() { format!("load[{load}]") } else { format!("load[{load}].surface") },
        message: format!("the load on `{}` has no effect: it acts only on prescribed displacements", case.loads[load].target()),
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
        sections: sections(case, &problem.mesh),
        contacts,
        sets,
        surfaces: surfaces::surfaces(&problem.mesh),
        designed: problem.variables().map_or(0, |variables| variables.designed().len()),
        variables: problem.variables().map_or(0, slipstick_design::DesignVariables::count),
        steps: case.steps(),
        notices,
    })
}
