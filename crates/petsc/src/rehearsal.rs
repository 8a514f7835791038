//! A small system that is solved with a user's options before anything depends on them.

use crate::contact_zone::ContactZone;
use crate::error::PetscError;
use crate::session::Session;
use crate::solver::PetscBackend;
use slipstick_linalg::{Backend, CsrMatrix, CsrPattern, Ranks, Summed, solve_verified};
use std::sync::Arc;

/// Nodes of the lattice across; along, there are at least four, and two for each rank.
const ACROSS: usize = 3;

/// Relative residual of the solutions, which `solve_verified` corrects as often as it takes.
const TOLERANCE: f64 = 1e-8;

/// Tries options on a lattice of springs, forward and transposed; with `contact_zone` by that preconditioner.
///
/// # Errors
/// [`PetscError::Rehearsal`] where they do not solve it, [`PetscError::Unused`] where some of them are none of the solvers
/// that they could be for.
pub(crate) fn rehearse(session: &Session, options: &str, contact_zone: bool) -> Result<(), PetscError> {
    let along = (2 * session.size()).max(4);
    let nodes = ACROSS * ACROSS * along;
    let owners: Vec<u32> = (0..nodes).map(|node| (node * session.size() / nodes) as u32).collect();
    let mut backend = PetscBackend::new(session.clone(), owners);
    if contact_zone {
        let places: Vec<[f64; 3]> = (0..nodes).map(|node| place(node).map(|c| c as f64)).collect();
        let slaves: Vec<u32> = (nodes - ACROSS * ACROSS..nodes).map(|node| node as u32).collect();
        backend = backend.with_contact_zone(ContactZone::new(places, slaves));
    }
    let failed = |reason: String| PetscError::Rehearsal { reason };
    let part = lattice(nodes, session.rank() == 0);
    let factors = backend.solver().factorize(&part).map_err(|error| failed(error.to_string()))?;
    let matrix = Summed { part: &part, ranks: session };
    let rhs: Vec<f64> = (0..part.n()).map(|i| (i as f64).sin()).collect();
    for transpose in [false, true] {
        let mut x = vec![0.0; part.n()];
        solve_verified(&matrix, factors.as_ref(), transpose, &rhs, &mut x, TOLERANCE)
            .map_err(|error| failed(error.to_string()))?;
    }
    let unused = session.unused(options)?;
    if unused.is_empty() { Ok(()) } else { Err(PetscError::Unused { options: unused.join(" ") }) }
}

fn place(node: usize) -> [usize; 3] {
    [node % ACROSS, node / ACROSS % ACROSS, node / (ACROSS * ACROSS)]
}

/// Springs between next nodes and to the ground, the same in all directions; or, on the other ranks, nothing.
fn lattice(nodes: usize, whole: bool) -> CsrMatrix {
    let mut pattern = CsrPattern {
        n: 3 * nodes,
        row_offsets: vec![0],
        columns: Vec::new(),
        groups: (0..3 * nodes).map(|i| i as u32 / 3).collect(),
        origins: (0..3 * nodes as u32).collect(),
    };
    let mut values = Vec::new();
    for i in 0..3 * nodes {
        for j in 0..if whole { nodes } else { 0 } {
            let apart: usize = place(i / 3).into_iter().zip(place(j)).map(|(a, b)| a.abs_diff(b)).sum();
            if apart <= 1 {
                pattern.columns.push((3 * j + i % 3) as u32);
                values.push(if apart == 0 { 7.0 } else { -1.0 });
            }
        }
        pattern.row_offsets.push(values.len());
    }
    CsrMatrix { pattern: Arc::new(pattern), values }
}
