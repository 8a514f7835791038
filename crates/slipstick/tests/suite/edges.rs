//! Contact at edges: pressure on partly covered facets, bodies that slide over an edge, and edges
//! of the slave surface. `docs/edges.md` explains the purpose of the tests; the tables of
//! `docs/measurements/edges.md` are written by
//!
//!     docs/measure/edges/measure.sh

mod ends;
mod fields;
mod gradients;
mod kinks;
mod nose;
mod overhang;
mod reached;
mod search;
mod sliding;
mod soft;
mod ssnp503;
mod study;
mod warnings;

use crate::common::problem_with;
use crate::solved::Solved;
use slipstick::model::ContactResults;
use slipstick_mesh::{BoxShape, Mesh, box_mesh};
use slipstick_path::Silent;

/// A box with nodes at these coordinates along x, y and z.
fn grid(name: &str, ticks: [&[f64]; 3]) -> Mesh {
    let elements = ticks.map(|along| along.len() - 1);
    let shape = BoxShape { min: [0.0; 3], max: elements.map(|n| n as f64), elements, grading: [1.0; 3] };
    let mut mesh = box_mesh(name, &shape).expect("a box");
    for node in &mut mesh.nodes {
        *node = std::array::from_fn(|c| ticks[c][node[c].round() as usize]);
    }
    mesh
}

/// Coordinates from `from` to `to` for `count` elements of equal size.
fn even(from: f64, to: f64, count: usize) -> Vec<f64> {
    (0..=count).map(|i| from + (to - from) * i as f64 / count as f64).collect()
}

/// Solves a case with meshes given by name.
fn solve(text: &str, meshes: &[(&str, Mesh)]) -> Solved {
    let mut problem = problem_with(text, meshes);
    let density = problem.initial_density().clone();
    let forward = problem.analysis.forward(&density, &mut Silent).unwrap_or_else(|e| panic!("{e}\n{text}"));
    Solved { problem, forward }
}

/// Contact results after a load step.
fn results(solved: &mut Solved, step: usize) -> ContactResults {
    let states = &solved.forward.path.states;
    let at = states.iter().position(|s| s.completes == Some(step)).expect("the path came to its end");
    let (previous, state, time) = (states[at - 1].state.clone(), states[at].state.clone(), states[at].time);
    solved.problem.analysis.design.contact_results(&previous, &state, time).expect("a converged state")
}

/// A neo-Hookean body from a mesh of this name.
fn body(name: &str, modulus: f64) -> String {
    format!("[[body]]\nname = '{name}'\nmesh = {{ file = '{name}' }}\n{}\n", crate::solved::neo_hooke(modulus, 0.3))
}
