//! Displacements of points between the nodes of a body.

use std::collections::HashMap;

use nalgebra::{Matrix4, Matrix4x3, Vector4};
use slipstick_mesh::{Body, Mesh};

/// Nodes whose displacements count for a point.
const NEIGHBOURS: usize = 16;

/// Displaces points of a body as its nodes are displaced, 3 entries per node of the mesh, times a factor: by moving
/// least squares (Lancaster and Salkauskas, 1981) of an affine field, so that rigid motions and homogeneous
/// deformations are exact. Nodes on the other side of a slit count too, so that the rim of a slit that opens is drawn
/// rounder than it is. \[L\]
pub(super) fn displaced(
    mesh: &Mesh,
    body: &Body,
    displacement: &[f64],
    factor: f64,
    points: &mut [[f64; 3]],
    chosen: &[u32],
) {
    let grid = Grid::of(mesh, body);
    for &point in chosen {
        let x = points[point as usize];
        let near = grid.nearest(mesh, x);
        let by = fitted(mesh, &near, displacement, x);
        points[point as usize] = std::array::from_fn(|c| x[c] + factor * by[c]);
    }
}

/// The nodes of a body in cells of equal size.
struct Grid {
    size: f64,
    /// Number of nodes.
    count: usize,
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl Grid {
    fn of(mesh: &Mesh, body: &Body) -> Self {
        let nodes = &mesh.nodes[body.nodes.clone()];
        let side = |c: usize| {
            let [low, high] =
                nodes.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| [l.min(x[c]), h.max(x[c])]);
            high - low
        };
        let sides: [f64; 3] = std::array::from_fn(side);
        let largest = sides.into_iter().fold(f64::MIN_POSITIVE, f64::max);
        let volume: f64 = sides.iter().map(|side| side.max(1e-3 * largest)).product();
        let size = 2.0 * (volume / nodes.len().max(1) as f64).cbrt();
        let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        for node in body.nodes.clone() {
            cells.entry(place(mesh.nodes[node], size)).or_default().push(node as u32);
        }
        Self { size, count: nodes.len(), cells }
    }

    /// The nodes that are nearest to a position, of those in the cells around it.
    fn nearest(&self, mesh: &Mesh, x: [f64; 3]) -> Vec<u32> {
        let [i, j, k] = place(x, self.size);
        let mut found: Vec<u32> = Vec::new();
        for reach in 1..64 {
            found.clear();
            for (a, b, c) in cube(reach) {
                found.extend(self.cells.get(&[i + a, j + b, k + c]).into_iter().flatten());
            }
            if found.len() >= NEIGHBOURS.min(self.count) {
                break;
            }
        }
        let distance = |&node: &u32| square(minus(mesh.nodes[node as usize], x));
        found.sort_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.cmp(b)));
        found.truncate(NEIGHBOURS);
        found
    }
}

fn place(x: [f64; 3], size: f64) -> [i64; 3] {
    x.map(|x| (x / size).floor() as i64)
}

fn cube(reach: i64) -> impl Iterator<Item = (i64, i64, i64)> {
    (-reach..=reach).flat_map(move |a| (-reach..=reach).flat_map(move |b| (-reach..=reach).map(move |c| (a, b, c))))
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| a[c] - b[c])
}

fn square(a: [f64; 3]) -> f64 {
    a.iter().map(|v| v * v).sum()
}

/// The displacement at a position, from those of nodes near it.
fn fitted(mesh: &Mesh, near: &[u32], displacement: &[f64], x: [f64; 3]) -> [f64; 3] {
    let apart: Vec<[f64; 3]> = near.iter().map(|&node| minus(mesh.nodes[node as usize], x)).collect();
    // of the farthest, which has no weight
    let reach = apart.iter().map(|d| square(*d)).fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let (mut matrix, mut right) = (Matrix4::<f64>::zeros(), Matrix4x3::<f64>::zeros());
    for (&node, d) in near.iter().zip(&apart) {
        let part = square(*d) / reach;
        let weight = (1.0 - part).powi(2) / (part + 1e-4);
        let [a, b, c] = d.map(|d| d / reach.sqrt());
        let basis = Vector4::new(1.0, a, b, c);
        let u = nalgebra::RowVector3::from_fn(|_, c| displacement[3 * node as usize + c]);
        matrix += weight * basis * basis.transpose();
        right += weight * basis * u;
    }
    // nodes in a plane do not determine the slope across it, which then vanishes
    let least = 1e-10 * matrix.trace();
    (1..4).for_each(|k| matrix[(k, k)] += least);
    let solved = matrix.cholesky().map(|factors| factors.solve(&right));
    solved.map_or([0.0; 3], |fit| std::array::from_fn(|c| fit[(0, c)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_mesh::{BoxShape, box_mesh};

    /// A homogeneous deformation moves points between nodes exactly; a curved one, nearly.
    #[test]
    fn points_follow_the_nodes() {
        let mesh =
            box_mesh("b", &BoxShape { min: [0.0; 3], max: [4.0, 1.0, 1.0], elements: [16, 4, 4], grading: [1.0; 3] })
                .expect("a box");
        let field = |of: &dyn Fn([f64; 3]) -> [f64; 3]| mesh.nodes.iter().flat_map(|&x| of(x)).collect::<Vec<f64>>();
        let start = [[0.1, 0.33, 0.5], [2.2, 1.0, 0.77], [3.99, 0.01, 0.02]];
        let moved = |displacement: &[f64]| {
            let mut points = start.to_vec();
            displaced(&mesh, &mesh.bodies[0], displacement, 2.0, &mut points, &[0, 1, 2]);
            points
        };
        let sheared = |x: [f64; 3]| [0.2 * x[1] + 0.1, -0.3 * x[0], 0.5 * x[2] - 0.1 * x[0]];
        for (x, found) in start.iter().zip(moved(&field(&sheared))) {
            let error = (0..3).map(|c| (found[c] - x[c] - 2.0 * sheared(*x)[c]).abs()).fold(0.0, f64::max);
            assert!(error < 1e-9, "{error}");
        }
        let bent = |x: [f64; 3]| [0.0, 0.05 * x[0] * x[0], 0.0];
        for (x, found) in start.iter().zip(moved(&field(&bent))) {
            assert!((found[1] - x[1] - 2.0 * bent(*x)[1]).abs() < 0.005, "{found:?}");
        }
    }
}
