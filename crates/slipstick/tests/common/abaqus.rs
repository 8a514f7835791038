//! Meshes as the text of an Abaqus file.

use slipstick::mesh::{Element, Mesh};
use std::fmt::Write;

/// A mesh of one body as an Abaqus file.
pub fn abaqus(mesh: &Mesh) -> String {
    let mut text = String::from("*NODE\n");
    for (n, [x, y, z]) in mesh.nodes.iter().enumerate() {
        let _ = writeln!(text, "{}, {x:?}, {y:?}, {z:?}", n + 1);
    }
    for (e, element) in mesh.elements.iter().enumerate() {
        let name = match element {
            Element::Tet4(_) => "C3D4",
            Element::Wedge6(_) => "C3D6",
            Element::Hex8(_) => "C3D8",
            Element::Tet10(_) => "C3D10",
            Element::Wedge18(_) => "C3D15V",
            Element::Hex27(_) => "C3D27",
        };
        let _ = write!(text, "*ELEMENT, TYPE={name}, ELSET=body\n{}", e + 1);
        element.nodes().iter().for_each(|n| {
            let _ = write!(text, ", {}", n + 1);
        });
        text += "\n";
    }
    for (name, surface) in &mesh.surfaces {
        let _ = writeln!(text, "*SURFACE, NAME={name}, TYPE=ELEMENT");
        for facet in &surface.facets {
            let element = &mesh.elements[facet.element as usize];
            let mut sides = 0..element.sides();
            let face = sides.find(|&side| element.side(side).sorted() == facet.nodes.sorted()).expect("a face");
            let first = |face: &usize| face * element.sides() / element.faces();
            let face = (0..element.faces()).rev().find(|at| first(at) <= face).expect("a face");
            let line = format!("{}, S{}\n", facet.element + 1, face + 1);
            if !text.ends_with(&line) {
                text += &line;
            }
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
