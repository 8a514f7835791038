//! Elements that are numbered inside out, or folded.

use slipstick_mesh::second_order::{hex27_jacobians, tet10_jacobians, wedge18_jacobians};
use slipstick_mesh::{Element, HEX_CORNERS, WEDGE_CORNERS, hex_jacobian, tet_volume, wedge_jacobian};

pub(super) const ANGLES: &str =
    "correct its nodes: they must be in the order of Gmsh and Abaqus, and all angles must be below 180°";

pub(super) const CURVED: &str = "correct its nodes: mid-side nodes must lie near the middle of their edges and faces; or use \
                      `first_order = true` in the body's `mesh`";

pub(super) enum Orientation {
    Sound,
    InsideOut,
    Folded,
}

/// Orientation from the Jacobian determinants at the corners (and other nodes): all positive, all negative, or of
/// mixed sign.
pub(super) fn orientation(element: &Element, points: &[[f64; 3]]) -> Orientation {
    let at = |node: u32| points[node as usize];
    let jacobians = match element {
        Element::Tet4(nodes) => vec![tet_volume(&nodes.map(at))],
        Element::Wedge6(nodes) => WEDGE_CORNERS.map(|xi| wedge_jacobian(&nodes.map(at), xi)).to_vec(),
        Element::Hex8(nodes) => HEX_CORNERS.map(|xi| hex_jacobian(&nodes.map(at), xi)).to_vec(),
        Element::Tet10(nodes) => tet10_jacobians(&nodes.map(at)),
        Element::Wedge18(nodes) => wedge18_jacobians(&nodes.map(at)),
        Element::Hex27(nodes) => hex27_jacobians(&nodes.map(at)),
    };
    if jacobians.iter().all(|&jacobian| jacobian > 0.0) {
        Orientation::Sound
    } else if jacobians.iter().all(|&jacobian| jacobian < 0.0) {
        Orientation::InsideOut
    } else {
        Orientation::Folded
    }
}

/// Turns an element that is inside out: swaps bottom and top, or two corners of a tetrahedron.
pub(super) fn turn(element: &mut Element) {
    match element {
        Element::Tet4(nodes) => nodes.swap(0, 1),
        Element::Wedge6(nodes) => nodes.rotate_left(3),
        Element::Hex8(nodes) => nodes.rotate_left(4),
        Element::Tet10(nodes) => [[0, 1], [5, 6], [7, 8]].into_iter().for_each(|[a, b]| nodes.swap(a, b)),
        Element::Wedge18(nodes) => {
            nodes[..6].rotate_left(3);
            nodes[6..12].rotate_left(3);
        }
        Element::Hex27(nodes) => {
            nodes[..8].rotate_left(4);
            nodes[8..16].rotate_left(4);
            nodes.swap(24, 25);
        }
    }
}
