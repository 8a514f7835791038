//! Bodies that overlap although their contact pair transmits no force there.

use crate::analysis::steps_of;
use crate::equations::{ContactModel, ModelInterface};
use crate::problem::Problem;
use crate::words::quantity;
use serde::Serialize;
use slipstick_contact::Overlap;
use slipstick_mesh::{FacetNodes, Mesh};
use slipstick_path::{LoadTime, Path};
use std::fmt;

/// Depths that differ by less than this fraction are equal; the first one is reported.
const SAME: f64 = 1e-9;

/// The deepest overlap of a contact pair where it transmits no force.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OpenOverlap {
    /// Number of the pair.
    pub pair: usize,
    /// Names of slave and master.
    pub surfaces: [String; 2],
    /// The load step, counted through all load cases; 0: at the start.
    pub step: usize,
    /// Node that lies below the other surface.
    pub node: u32,
    /// Its position at that step. \[L\]
    pub position: [f64; 3],
    /// Whether it is a node of the slave.
    pub on_slave: bool,
    /// Distance to the other surface. \[L\]
    pub depth: f64,
    /// Size of the larger facet there. \[L\]
    pub facet_size: f64,
}

impl fmt::Display for OpenOverlap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [slave, master] = &self.surfaces;
        let [of, other] = if self.on_slave { [slave, master] } else { [master, slave] };
        let when = if self.step == 0 { "at the start".into() } else { format!("in load step {}", self.step) };
        let [x, y, z] = self.position.map(quantity);
        write!(
            f,
            "{when}, `{of}` lies up to {} below `{other}` at node {}, [{x}, {y}, {z}], and contact transmits no force \
             there: facets of size {} are coarse against the curvature, or a corner points into a facet, so that the \
             mean gap over the facets around the node is still open",
            quantity(self.depth),
            self.node,
            quantity(self.facet_size)
        )
    }
}

impl OpenOverlap {
    /// The remedy.
    pub fn help(&self) -> String {
        let [_, master] = &self.surfaces;
        let slave = if self.on_slave {
            String::new()
        } else {
            format!("; let the pointed or finer side, `{master}`, be the slave")
        };
        format!(
            "refine both surfaces there, to facets of about the size of the overlap{slave}; on curved bodies, use \
             quadratic elements (`order = 2`)"
        )
    }
}

/// For each contact pair, its deepest overlap over the completed load steps where it transmits no
/// force, if it exceeds [a fraction](slipstick_contact::COUNTED_OVERLAP) of the facet size. All
/// ranks call it; all but the first receive none.
///
/// Ties and pairs of surfaces of the same body are left out: a node of one side of a wall lies below
/// the facets of the other side. Test: `corner_and_ball_overlap_without_force`
/// (tests/suite/overlaps.rs).
pub fn overlaps(problem: &Problem, path: &Path) -> Vec<OpenOverlap> {
    let model = problem.analysis.model();
    let steps = steps_of(path);
    let found = path.with_states(&**model.share().ranks(), |state| {
        let mut deepest: Vec<Option<OpenOverlap>> = vec![None; model.interfaces().len()];
        for (index, at) in path.states.iter().enumerate().filter(|(_, at)| at.completes.is_some()) {
            let open: Vec<bool> = at.active_set.iter().map(|status| !status.is_closed()).collect();
            let found = overlaps_at(&problem.mesh, model, &state(index).unknowns, at.time, &open);
            for overlap in found.into_iter().map(|overlap| OpenOverlap { step: steps[index], ..overlap }) {
                let best = &mut deepest[overlap.pair];
                if best.as_ref().is_none_or(|best| overlap.depth > (1.0 + SAME) * best.depth) {
                    *best = Some(overlap);
                }
            }
        }
        deepest.into_iter().flatten().collect()
    });
    found.unwrap_or_default()
}

/// The deepest overlap of each pair that is active at a time, at unknowns `y`; `open` says for the
/// slave nodes of all pairs whether they transmit no force.
pub fn overlaps_at(mesh: &Mesh, model: &ContactModel, y: &[f64], time: LoadTime, open: &[bool]) -> Vec<OpenOverlap> {
    let (nodes, x) = (model.positions(y), model.contact_positions(y));
    let of = |(pair, (at, open)): (usize, (&ModelInterface, &[bool]))| {
        let interface = &at.interface;
        let complete = open.len() == interface.slave_nodes().len();
        let body = |facets: &[FacetNodes]| {
            let node = *facets.first()?.first()? as usize;
            mesh.bodies.iter().position(|body| body.nodes.contains(&node))
        };
        let one_body = body(interface.slave_facets()) == body(interface.master_facets());
        if at.is_bonded() || one_body || !complete || !at.is_active(time) {
            return None;
        }
        let deepest = at.adjusted.iter().fold(0.0, |deepest: f64, gap| deepest.min(*gap));
        let allowed = (-at.offset_at(time) - deepest).max(0.0);
        let Overlap { node, on_slave, depth, facet_size } = interface.deepest_overlap(&x, open, allowed)?;
        let position = std::array::from_fn(|c| nodes[3 * node as usize + c]);
        let surfaces = at.surfaces.clone();
        Some(OpenOverlap { pair, surfaces, step: 0, node, position, on_slave, depth, facet_size })
    };
    model.interfaces().iter().zip(model.by_pair(open)).enumerate().filter_map(of).collect()
}
