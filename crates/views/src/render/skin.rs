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

/// Cosine of the angle between faces from which their common edge is sharp.
fn sharp() -> f64 {
    40f64.to_radians().cos()
}

/// The normal at every corner of every face, with which a body of few faces looks smooth: the mean over the faces
/// around the node that are not beyond a sharp edge, by their areas.
pub(super) fn corner_normals(skin: &[SkinFace], points: &[Vector]) -> Vec<[Vector; 4]> {
    let areas: Vec<Vector> = skin.iter().map(|face| facet_area_vector(&face.nodes.corners(points))).collect();
    let normals: Vec<Vector> = areas.iter().map(|area| unit(*area)).collect();
    let mut around: Vec<(u32, u32)> =
        (0u32..).zip(skin).flat_map(|(f, face)| face.nodes.iter().map(move |&node| (node, f))).collect();
    around.sort_unstable();
    let smooth = |face: usize, node: u32| {
        let first = around.partition_point(|entry| entry.0 < node);
        let others = around[first..].iter().take_while(|entry| entry.0 == node).map(|entry| entry.1 as usize);
        let near = others.filter(|&other| dot(normals[face], normals[other]) > sharp());
        let sum = near.fold([0.0; 3], |sum: Vector, other| std::array::from_fn(|c| sum[c] + areas[other][c]));
        if dot(sum, sum) > 0.0 { unit(sum) } else { normals[face] }
    };
    let of = |(f, face): (usize, &SkinFace)| {
        let count = face.nodes.len();
        std::array::from_fn(|k| smooth(f, face.nodes[k.min(count - 1)]))
    };
    skin.iter().enumerate().map(of).collect()
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
    let sharp = sharp();
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
