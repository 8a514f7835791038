//! The serendipity shape of hexahedra of second order: the 20 nodes at their corners and edges determine the
//! other seven.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use crate::{Element, HEX_EDGES, HEX_FACE_CENTRES, HEX_FACES, Mesh};

/// A node at the centre of a face or of a hexahedron, x = Σ wᵢ xᵢ.
#[derive(Debug, Clone, PartialEq)]
pub struct SerendipityCentre {
    /// The node.
    pub node: u32,
    /// The nodes on which it depends, with their weights wᵢ, which add up to 1.
    pub terms: Vec<(u32, f64)>,
}

/// The edges of a hexahedron between some of its corners.
fn edges_between(corners: &[usize]) -> impl Iterator<Item = usize> + '_ {
    (0..12).filter(|&edge| HEX_EDGES[edge].iter().all(|corner| corners.contains(corner)))
}

/// The weights of the local nodes 0 … 19 with which the serendipity shape has its value at the centre of a
/// face, in the order of [`HEX_FACES`]: −1/4 at corners, 1/2 at edges.
pub fn serendipity_face(face: usize) -> Vec<(usize, f64)> {
    let corners = HEX_FACES[face].map(|corner| (corner, -0.25));
    corners.into_iter().chain(edges_between(&HEX_FACES[face]).map(|edge| (8 + edge, 0.5))).collect()
}

/// The same at the centre of the element: −1/4 at corners, 1/4 at edges.
pub fn serendipity_middle() -> Vec<(usize, f64)> {
    (0..8).map(|corner| (corner, -0.25)).chain((8..20).map(|edge| (edge, 0.25))).collect()
}

impl Mesh {
    /// The centres of the hexahedra of 27 nodes among some elements and of their faces, ascending, as
    /// combinations of other nodes. The centres of faces in `free` are their own; then
    ///
    /// ```text
    /// x_f = −1/4 Σ corners + 1/2 Σ edges                                                   of other faces
    /// x_e = −1/4 Σ corners + 1/4 Σ edges + 1/2 Σ_free (x_f + 1/4 Σ corners − 1/2 Σ edges)     of the element
    /// ```
    ///
    /// A free centre adds the function (1 − ξ²)(1 − η²)(1 + ζ)/2 to the 20 of the serendipity shape.
    pub fn serendipity_centres(&self, elements: Range<usize>, free: &BTreeSet<u32>) -> Vec<SerendipityCentre> {
        let mut centres: BTreeMap<u32, Vec<(u32, f64)>> = BTreeMap::new();
        for element in &self.elements[elements] {
            let Element::Hex27(nodes) = element else { continue };
            let mut middle = [0.0; 26];
            serendipity_middle().into_iter().for_each(|(local, weight)| middle[local] = weight);
            for (face, centre) in HEX_FACE_CENTRES.into_iter().enumerate() {
                let weights = serendipity_face(face);
                if free.contains(&nodes[centre]) {
                    middle[centre] = 0.5;
                    weights.iter().for_each(|(local, weight)| middle[*local] -= 0.5 * weight);
                    continue;
                }
                let terms = || weights.iter().map(|&(local, weight)| (nodes[local], weight)).collect();
                centres.entry(nodes[centre]).or_insert_with(terms);
            }
            let terms = middle.iter().zip(nodes).filter(|(weight, _)| **weight != 0.0);
            centres.insert(nodes[26], terms.map(|(&weight, &node)| (node, weight)).collect());
        }
        centres.into_iter().map(|(node, terms)| SerendipityCentre { node, terms }).collect()
    }

    /// Moves nodes to the positions that others give them.
    pub fn place_centres(&mut self, centres: &[SerendipityCentre]) {
        for SerendipityCentre { node, terms } in centres {
            let sum = |c: usize| terms.iter().map(|&(other, weight)| weight * self.nodes[other as usize][c]).sum();
            self.nodes[*node as usize] = std::array::from_fn(sum);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::second_order::{HEX27_NODES, hex27_shapes};
    use crate::{BoxShape, box_mesh};

    /// The 20 serendipity functions as in textbooks (Zienkiewicz and Taylor, The Finite Element Method, vol. 1).
    fn textbook(node: usize, [x, y, z]: [f64; 3]) -> f64 {
        let [a, b, c] = HEX27_NODES[node];
        if node < 8 {
            return (1.0 + a * x) * (1.0 + b * y) * (1.0 + c * z) * (a * x + b * y + c * z - 2.0) / 8.0;
        }
        let factor = |at: f64, x: f64| if at == 0.0 { 1.0 - x * x } else { 1.0 + at * x };
        factor(a, x) * factor(b, y) * factor(c, z) / 4.0
    }

    /// The functions of the 20 nodes of a hexahedron whose centres depend on them, at a point.
    fn condensed(free: &[usize], at: [f64; 3]) -> [f64; 27] {
        let mut mesh = box_mesh("b", &BoxShape { min: [-1.0; 3], max: [1.0; 3], elements: [1; 3], grading: [1.0; 3] })
            .and_then(|mesh| {
                mesh.second_order(|of| std::array::from_fn(|c| of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64))
            })
            .unwrap();
        mesh.elements[0] = Element::Hex27(std::array::from_fn(|i| i as u32));
        mesh.nodes = HEX27_NODES.to_vec();
        let free: BTreeSet<u32> = free.iter().map(|&local| local as u32).collect();
        let (values, _) = hex27_shapes(at);
        let mut out = values;
        for centre in mesh.serendipity_centres(0..1, &free) {
            centre.terms.iter().for_each(|(node, weight)| out[*node as usize] += weight * values[centre.node as usize]);
            out[centre.node as usize] = 0.0;
        }
        out
    }

    #[test]
    fn dependent_centres_give_the_functions_of_20_nodes() {
        for i in 0..50 {
            let at = [0.7, 1.3, 2.9].map(|k| (k * (1.0 + f64::from(i))).sin());
            let found = condensed(&[], at);
            assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-13);
            for (node, value) in found[..20].iter().enumerate() {
                assert!((value - textbook(node, at)).abs() < 1e-14, "node {node}: {value}");
            }
            // a free centre at ζ = 1
            let [x, y, z] = at;
            let bubble = (1.0 - x * x) * (1.0 - y * y) * (1.0 + z) / 2.0;
            let found = condensed(&[HEX_FACE_CENTRES[1]], at);
            assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-13);
            assert!((found[HEX_FACE_CENTRES[1]] - bubble).abs() < 1e-14);
        }
    }
}
