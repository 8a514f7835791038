//! Meshes that no generator produces: those of generators with moved nodes, as the text of a mesh
//! file.

use crate::abaqus::abaqus;
use slipstick_mesh::{BoxShape, box_mesh};

/// The box 0 … 1 in all directions with the given number of elements, its nodes moved by `map`, as
/// an Abaqus file. Surfaces are those of the box: `{name}_xmin` …
pub fn mapped_box(name: &str, elements: [usize; 3], map: impl Fn([f64; 3]) -> [f64; 3]) -> String {
    let shape = BoxShape { min: [0.0; 3], max: [1.0; 3], elements, grading: [1.0; 3] };
    let mut mesh = box_mesh(name, &shape).expect("a box");
    for node in &mut mesh.nodes {
        *node = map(*node);
    }
    abaqus(&mesh)
}
