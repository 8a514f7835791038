//! Meshes that no generator produces: those of generators with moved nodes, as the text of a mesh
//! file.

use crate::common::abaqus::abaqus;
use slipstick_mesh::{BoxShape, box_mesh};

/// The box 0 … 1 in all directions with the given number of elements, its nodes moved by `map`, as
/// an Abaqus file. Surfaces are those of the box: `{name}_xmin` …
pub fn mapped_box(name: &str, elements: [usize; 3], map: impl Fn([f64; 3]) -> [f64; 3]) -> String {
    mapped_box_of_order(1, name, elements, map)
}

/// The same with elements of first or second order; `map` moves mid-side nodes too.
pub fn mapped_box_of_order(order: u8, name: &str, elements: [usize; 3], map: impl Fn([f64; 3]) -> [f64; 3]) -> String {
    let shape = BoxShape { min: [0.0; 3], max: [1.0; 3], elements, grading: [1.0; 3] };
    let mut mesh = box_mesh(name, &shape).expect("a box");
    if order == 2 {
        let mean = |of: &[[f64; 3]]| [0, 1, 2].map(|k| of.iter().map(|x| x[k]).sum::<f64>() / of.len() as f64);
        mesh = mesh.second_order(mean).expect("hexahedra");
    }
    for node in &mut mesh.nodes {
        *node = map(*node);
    }
    abaqus(&mesh)
}
