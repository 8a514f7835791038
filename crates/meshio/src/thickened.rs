//! Solids behind the facets of a surface.

use std::collections::BTreeMap;

use crate::{CellKind, FileMesh};

/// Thickness of the solids, over the mean length of the edges, before it is halved where they would fold.
const THICKNESS: f64 = 1.0;
/// How often it is halved.
const HALVINGS: usize = 8;

type Vector = [f64; 3];

impl FileMesh {
    /// Adds a wedge behind each triangle and a hexahedron behind each quadrilateral of these cells, on the side away
    /// from their normals (`outward`) or towards which these point. The new nodes and cells come after all others and
    /// have greater numbers. Returns the new cells; `None` if a cell is not such a facet, or if the facets fold.
    pub fn thicken(&mut self, facets: &[u32], outward: bool) -> Option<Vec<u32>> {
        let corners: Vec<Vec<u32>> = facets.iter().map(|&cell| self.cells.nodes(cell as usize).to_vec()).collect();
        let flat = [CellKind::Triangle3, CellKind::Quad4];
        if facets.iter().any(|&cell| !flat.contains(&self.cells.kind(cell as usize))) {
            return None;
        }
        let point = |node: u32| self.points[node as usize];
        let (mut normals, mut length, mut edges) = (BTreeMap::<u32, Vector>::new(), 0.0, 0_usize);
        for nodes in &corners {
            for (at, &node) in nodes.iter().enumerate() {
                let [next, previous] = around(nodes, at).map(|other| sub(point(other), point(node)));
                let (normal, sum) = (unit(cross(next, previous))?, normals.entry(node).or_default());
                (0..3).for_each(|c| sum[c] += normal[c]);
                (length, edges) = (length + dot(next, next).sqrt(), edges + 1);
            }
        }
        let normals: BTreeMap<u32, Vector> =
            normals.into_iter().map(|(node, sum)| Some((node, unit(sum)?))).collect::<Option<_>>()?;
        let sign = if outward { -1.0 } else { 1.0 };
        let behind = |thickness: f64| -> BTreeMap<u32, Vector> {
            let moved = |(&node, normal): (&u32, &Vector)| {
                (node, std::array::from_fn(|c| point(node)[c] + sign * thickness * normal[c]))
            };
            normals.iter().map(moved).collect()
        };
        let sound = |back: &BTreeMap<u32, Vector>| {
            corners.iter().all(|nodes| {
                (0..nodes.len()).all(|at| {
                    let (node, others) = (nodes[at], around(nodes, at));
                    let through = sub(point(node), back[&node]).map(|x| -sign * x);
                    let front = others.map(|other| sub(point(other), point(node)));
                    let rear = others.map(|other| sub(back[&other], back[&node]));
                    [front, rear].iter().all(|[next, previous]| dot(cross(*next, *previous), through) > 0.0)
                })
            })
        };
        let mean = THICKNESS * length / edges.max(1) as f64;
        let back = (0..HALVINGS).map(|k| behind(mean * 0.5_f64.powi(k as i32))).find(sound)?;
        let mut number = self.point_numbers.iter().copied().max().unwrap_or(0);
        let mut new_node = BTreeMap::new();
        for (node, x) in back {
            number += 1;
            new_node.insert(node, self.points.len() as u32);
            self.points.push(x);
            self.point_numbers.push(number);
        }
        let mut number = self.cells.numbers.iter().copied().max().unwrap_or(0);
        let mut cells = Vec::with_capacity(corners.len());
        for front in corners {
            let rear: Vec<u32> = front.iter().map(|node| new_node[node]).collect();
            number += 1;
            cells.push(self.cells.kinds.len() as u32);
            self.cells.kinds.push(if front.len() == 3 { CellKind::Wedge6 } else { CellKind::Hex8 });
            self.cells.nodes.extend(if outward { [rear, front] } else { [front, rear] }.concat());
            self.cells.offsets.push(self.cells.nodes.len());
            self.cells.numbers.push(number);
        }
        Some(cells)
    }
}

/// The corners after and before one of a facet.
fn around(nodes: &[u32], at: usize) -> [u32; 2] {
    [nodes[(at + 1) % nodes.len()], nodes[(at + nodes.len() - 1) % nodes.len()]]
}

fn sub(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|c| a[c] - b[c])
}

fn dot(a: Vector, b: Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn cross(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|c| a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3])
}

fn unit(a: Vector) -> Option<Vector> {
    let length = dot(a, a).sqrt();
    (length > 0.0 && length.is_finite()).then(|| a.map(|x| x / length))
}
