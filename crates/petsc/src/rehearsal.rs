//! Solves a small system with a user's options before anything depends on them.

use crate::contact_zone::ContactZone;
use crate::error::PetscError;
use crate::session::Session;
use crate::solver::PetscBackend;
use slipstick_linalg::{Backend, CsrMatrix, CsrPattern, Ranks, Summed, solve_verified};
use std::sync::Arc;

/// Number of nodes across the lattice; along it, there are at least four, and at least two per
/// rank.
const ACROSS: usize = 3;

/// Number of nodes in a layer of the lattice.
const LAYER: usize = ACROSS * ACROSS;

/// Relative residual of the solutions, which `solve_verified` corrects as often as necessary.
const TOLERANCE: f64 = 1e-8;

/// Tries options on a lattice of springs, forward and transposed; with `contact_zone`, it uses that
/// preconditioner.
///
/// # Errors
/// [`PetscError::Rehearsal`] if they do not solve it, [`PetscError::Unused`] if no solver uses some
/// of them.
pub(crate) fn rehearse(session: &Session, options: &str, contact_zone: bool) -> Result<(), PetscError> {
    let along = (2 * session.size()).max(4);
    let nodes = LAYER * along;
    let owners: Vec<u32> = (0..nodes).map(|node| (node * session.size() / nodes) as u32).collect();
    let mut backend = PetscBackend::new(session.clone(), owners);
    if contact_zone {
        let places: Vec<[f64; 3]> = (0..nodes).map(|node| place(node).map(|c| c as f64)).collect();
        let slaves: Vec<u32> = (nodes - LAYER..nodes).map(|node| node as u32).collect();
        backend = backend.with_contact_zone(ContactZone::new(places, slaves));
    }
    let failed = |reason: String| PetscError::Rehearsal { reason };
    let part = lattice(nodes, session.rank() == 0);
    let factors = backend.solver().analyse_and_factorize(&part).map_err(|error| failed(error.to_string()))?;
    let layout = backend.layout(&part.pattern);
    let matrix = Summed { part: &part, layout: &layout, ranks: session };
    let rhs: Vec<f64> = (0..layout.own()).map(|i| (layout.unknown(i) as f64).sin()).collect();
    for transpose in [false, true] {
        let mut x = vec![0.0; rhs.len()];
        solve_verified(&matrix, factors.as_ref(), transpose, &rhs, &mut x, TOLERANCE)
            .map_err(|error| failed(error.to_string()))?;
    }
    let mut unused = session.unused(options)?;
    // such a small system hardly has a coarse grid
    unused.retain(|name| !name.contains("mg_levels_"));
    if unused.is_empty() { Ok(()) } else { Err(PetscError::Unused { options: unused.join(" ") }) }
}

fn place(node: usize) -> [usize; 3] {
    [node % ACROSS, node / ACROSS % ACROSS, node / LAYER]
}

/// Springs between adjacent nodes and to the ground, the same in all directions, if `whole`;
/// otherwise an empty matrix.
fn lattice(nodes: usize, whole: bool) -> CsrMatrix {
    let (mut row_offsets, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for i in 0..3 * nodes {
        let (node, [x, y, _]) = (i / 3, place(i / 3));
        let near = [
            (node >= LAYER, node.wrapping_sub(LAYER), -1.0),
            (y > 0, node.wrapping_sub(ACROSS), -1.0),
            (x > 0, node.wrapping_sub(1), -1.0),
            (true, node, 7.0),
            (x + 1 < ACROSS, node + 1, -1.0),
            (y + 1 < ACROSS, node + ACROSS, -1.0),
            (node + LAYER < nodes, node + LAYER, -1.0),
        ];
        for (_, other, stiffness) in near.into_iter().filter(|(is, ..)| whole && *is) {
            columns.push((3 * other + i % 3) as u32);
            values.push(stiffness);
        }
        row_offsets.push(values.len());
    }
    let unknowns = 0..3 * nodes as u32;
    let pattern = CsrPattern::new(row_offsets, columns, unknowns.clone().map(|i| i / 3).collect(), unknowns.collect())
        .expect("adjacent nodes are listed in ascending order");
    CsrMatrix { pattern: Arc::new(pattern), values }
}
