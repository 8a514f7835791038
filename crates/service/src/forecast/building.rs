//! Predicts the memory that building a case needs, before anything is built.

use slipstick::case::{Body, Case, Shape};
use slipstick::mesh::{Element, Mesh};

/// Memory that building and [inspecting](slipstick::check::inspect) a case need for each element and for each
/// node: mesh, reference geometry, scatter map, matrix and its ordering. Measured on blocks and
/// plates of 64 000 to 216 000 elements, where the sum is accurate to within a tenth; rounded
/// down. \[bytes\]
const BYTES_TO_BUILD: [f64; 2] = [4500.0, 4000.0];

/// The same for each tetrahedron; a node there has about 15 neighbours instead of 27. Measured on
/// meshes of 73 000 to 570 000 tetrahedra from files, where tetrahedra and nodes together need a
/// sixth more. \[bytes\]
const BYTES_PER_TETRAHEDRON: f64 = 700.0;

/// The same for each tetrahedron of 10 and each hexahedron of 27 nodes, and for each of their nodes,
/// which have about 28 and 64 neighbours. \[bytes\]
const BYTES_PER_TET10: [f64; 2] = [3600.0, 4200.0];
const BYTES_PER_HEX27: [f64; 2] = [16_000.0, 9000.0];

/// Memory that building a case needs, estimated from its numbers of elements and nodes. \[bytes\]
pub fn bytes_to_build(case: &Case) -> f64 {
    let of_body = |body: &Body| match &body.shape {
        Shape::Mesh(file) => {
            let (mut counts, mut nodes) = (counts(&file.mesh), body.shape.node_count());
            if body.order == 2 && counts[2] + counts[3] == 0.0 {
                // a tetrahedron has about 1.4 nodes, a hexahedron 8
                nodes = 1.4 * counts[0] + 8.0 * counts[1];
                counts = [0.0, 0.0, counts[0], counts[1]];
            }
            bytes_of_building(counts, nodes)
        }
        shape => {
            let hexahedra = shape.element_count().map_or(f64::INFINITY, |count| count as f64);
            match body.order {
                2 => bytes_of_building([0.0, 0.0, 0.0, hexahedra], 8.0 * shape.node_count()),
                _ => bytes_of_building([0.0, hexahedra, 0.0, 0.0], shape.node_count()),
            }
        }
    };
    case.bodies.iter().map(of_body).sum()
}

/// Numbers of tetrahedra; of hexahedra and wedges together, since wedges are stored as hexahedra; of
/// tetrahedra of 10 and hexahedra of 27 nodes.
pub(super) fn counts(mesh: &Mesh) -> [f64; 4] {
    let mut counts = [0.0; 4];
    for element in &mesh.elements {
        counts[match element {
            Element::Tet4(_) => 0,
            Element::Wedge6(_) | Element::Hex8(_) => 1,
            Element::Tet10(_) => 2,
            Element::Wedge18(_) | Element::Hex27(_) => 3,
        }] += 1.0;
    }
    counts
}

pub(super) fn bytes_of_building([tetrahedra, hexahedra, tet10, hex27]: [f64; 4], nodes: f64) -> f64 {
    let [element, node] = BYTES_TO_BUILD;
    // the nodes are those of the elements with the most neighbours
    let node = match (hex27 > 0.0, tet10 > 0.0, hexahedra > 0.0) {
        (true, ..) => BYTES_PER_HEX27[1],
        (_, true, _) => BYTES_PER_TET10[1],
        (.., true) => node,
        _ => 0.5 * node,
    };
    let quadratic = BYTES_PER_TET10[0] * tet10 + BYTES_PER_HEX27[0] * hex27;
    BYTES_PER_TETRAHEDRON * tetrahedra + element * hexahedra + quadratic + node * nodes
}
