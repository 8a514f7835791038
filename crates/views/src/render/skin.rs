//! The visible part of a set of elements: faces without a neighbour, and their sharp edges.

use slipstick_mesh::{Element, FacetNodes, facet_area_vector};

use super::space::{Vector, dot, unit};

/// A face that only one of the cells has, counter-clockwise seen from outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SkinFace {
    pub nodes: FacetNodes,
    pub cell: u32,
}

impl SkinFace {
    /// The outward unit normal of the mean plane; zero for a face without area.
    pub fn normal(&self, points: &[Vector]) -> Vector {
        unit(facet_area_vector(&self.nodes.corners(points)))
    }
}

/// The skin of some cells, in an order that depends only on node numbers.
pub(super) fn skin(elements: &[Element], cells: &[u32]) -> Vec<SkinFace> {
    let mut all = Vec::with_capacity(6 * cells.len());
    for &cell in cells {
        let element = &elements[cell as usize];
        for nodes in (0..element.sides()).map(|side| element.side(side)) {
            all.push((nodes.sorted(), SkinFace { nodes, cell }));
        }
    }
    all.sort_unstable_by_key(|(key, face)| (*key, face.cell));
    all.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1).map(|same| same[0].1).collect()
}

/// All edges of the skin, each once, with the one or two faces at each edge (or more if corners
/// touch).
fn edges(skin: &[SkinFace]) -> Vec<([u32; 2], u32)> {
    let mut all = Vec::with_capacity(4 * skin.len());
    for (f, face) in skin.iter().enumerate() {
        let count = face.nodes.len();
        for k in 0..count {
            let (a, b) = (face.nodes[k], face.nodes[(k + 1) % count]);
            all.push(([a.min(b), a.max(b)], f as u32));
        }
    }
    all.sort_unstable();
    all
}

/// The edges of the faces that point towards the eye.
pub(super) fn wire(skin: &[SkinFace], points: &[Vector], eye: Vector) -> Vec<[u32; 2]> {
    let front: Vec<bool> = skin.iter().map(|face| dot(face.normal(points), eye) >= 0.0).collect();
    let sorted = edges(skin);
    let groups = sorted.chunk_by(|a, b| a.0 == b.0);
    groups.filter(|g| g.iter().any(|e| front[e.1 as usize])).map(|g| g[0].0).collect()
}

/// Edges where the skin bends by more than 40°, and contours, where it faces away from the eye.
pub(super) fn outline(skin: &[SkinFace], points: &[Vector], eye: Vector) -> Vec<[u32; 2]> {
    let sharp = 40f64.to_radians().cos();
    let normals: Vec<Vector> = skin.iter().map(|face| face.normal(points)).collect();
    let shows = |group: &[([u32; 2], u32)]| match group {
        [a, b] => {
            let (a, b) = (normals[a.1 as usize], normals[b.1 as usize]);
            dot(a, b) < sharp || (dot(a, eye) > 0.0) != (dot(b, eye) > 0.0)
        }
        _ => true,
    };
    let sorted = edges(skin);
    sorted.chunk_by(|a, b| a.0 == b.0).filter(|g| shows(g)).map(|g| g[0].0).collect()
}
