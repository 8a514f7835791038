//! Meshes that no generator makes: those of generators, moved node by node, as the text of a mesh file.

use slipstick_mesh::{BoxShape, HEX_FACES, Mesh, box_mesh};
use std::fmt::Write;

/// The box 0 … 1 in all directions with these elements, its nodes moved by `map`, as an Abaqus file. Surfaces are those of
/// the box: `{name}_xmin` …
pub fn mapped_box(name: &str, elements: [usize; 3], map: impl Fn([f64; 3]) -> [f64; 3]) -> String {
    let shape = BoxShape { min: [0.0; 3], max: [1.0; 3], elements, grading: [1.0; 3] };
    let mut mesh = box_mesh(name, &shape).expect("a box");
    for node in &mut mesh.nodes {
        *node = map(*node);
    }
    abaqus(&mesh)
}

/// A mesh of one body as an Abaqus file.
pub fn abaqus(mesh: &Mesh) -> String {
    let mut text = String::from("*NODE\n");
    for (n, [x, y, z]) in mesh.nodes.iter().enumerate() {
        let _ = writeln!(text, "{}, {x:?}, {y:?}, {z:?}", n + 1);
    }
    text += "*ELEMENT, TYPE=C3D8, ELSET=body\n";
    for (e, hex) in mesh.hexes.iter().enumerate() {
        let _ = write!(text, "{}", e + 1);
        hex.iter().for_each(|n| {
            let _ = write!(text, ", {}", n + 1);
        });
        text += "\n";
    }
    for (name, surface) in &mesh.surfaces {
        let _ = writeln!(text, "*SURFACE, NAME={name}, TYPE=ELEMENT");
        for facet in &surface.facets {
            let hex = mesh.hexes[facet.element as usize];
            let face = HEX_FACES
                .iter()
                .position(|face| face.iter().all(|&corner| facet.nodes.contains(&hex[corner])))
                .expect("a face of its element");
            let _ = writeln!(text, "{}, S{}", facet.element + 1, face + 1);
        }
    }
    for (name, nodes) in &mesh.node_sets {
        let _ = writeln!(text, "*NSET, NSET={name}");
        nodes.iter().for_each(|n| {
            let _ = writeln!(text, "{}", n + 1);
        });
    }
    text
}
