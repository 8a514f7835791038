//! The serendipity shape of hexahedra and wedges of second order: the 20 or 15 nodes at their corners and edges
//! determine the others.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use crate::{Element, HEX_EDGES, HEX_FACE_CENTRES, HEX_FACES, Mesh, WEDGE_EDGES, WEDGE_QUADRILATERALS};

/// A node at the centre of a face or of a hexahedron, x = Σ wᵢ xᵢ.
#[derive(Debug, Clone, PartialEq)]
pub struct SerendipityCentre {
    /// The node.
    pub node: u32,
    /// The nodes on which it depends, with their weights wᵢ, which add up to 1.
    pub terms: Vec<(u32, f64)>,
}

/// The edges between some corners of an element.
fn edges_between<'a>(edges: &'a [[usize; 2]], corners: &'a [usize]) -> impl Iterator<Item = usize> + 'a {
    (0..edges.len()).filter(|&edge| edges[edge].iter().all(|corner| corners.contains(corner)))
}

impl Element {
    /// The local nodes of a hexahedron or wedge at the centres of its quadrilaterals, with the local nodes from
    /// which the serendipity shape has its value there: −1/4 of each corner, 1/2 of each edge. Empty for others.
    pub fn serendipity_faces(&self) -> Vec<(usize, Vec<(usize, f64)>)> {
        let of = |edges: &[[usize; 2]], corners: &[usize; 4], centre: usize, first: usize| {
            let middles = edges_between(edges, corners).map(|edge| (first + edge, 0.5)).collect::<Vec<_>>();
            (centre, corners.map(|corner| (corner, -0.25)).into_iter().chain(middles).collect())
        };
        match self {
            Self::Hex27(_) => {
                HEX_FACES.iter().zip(HEX_FACE_CENTRES).map(|(face, centre)| of(&HEX_EDGES, face, centre, 8)).collect()
            }
            Self::Wedge18(_) => {
                WEDGE_QUADRILATERALS.iter().zip(15..).map(|(face, centre)| of(&WEDGE_EDGES, face, centre, 6)).collect()
            }
            _ => Vec::new(),
        }
    }
}

impl Mesh {
    /// The centres of the hexahedra of 27 nodes among some elements, and of the faces of these and of wedges of 18
    /// nodes, ascending, as combinations of other nodes. The centres of faces in `free` are their own; then
    ///
    /// ```text
    /// x_f = −1/4 Σ corners + 1/2 Σ edges                                                   of other faces
    /// x_e = −1/4 Σ corners + 1/4 Σ edges + 1/2 Σ_free (x_f + 1/4 Σ corners − 1/2 Σ edges)     of the element
    /// ```
    ///
    /// A free centre adds the function (1 − ξ²)(1 − η²)(1 + ζ)/2 to the 20 of the serendipity shape, and
    /// 4 L₁ L₂ (1 − ζ²) to the 15 of a wedge.
    pub fn serendipity_centres(&self, elements: Range<usize>, free: &BTreeSet<u32>) -> Vec<SerendipityCentre> {
        let mut centres: BTreeMap<u32, Vec<(u32, f64)>> = BTreeMap::new();
        for element in &self.elements[elements] {
            let nodes = element.nodes();
            let mut middle = [0.0; 26];
            (0..8).for_each(|corner| middle[corner] = -0.25);
            (8..20).for_each(|edge| middle[edge] = 0.25);
            for (centre, weights) in element.serendipity_faces() {
                if free.contains(&nodes[centre]) {
                    middle[centre] = 0.5;
                    weights.iter().for_each(|(local, weight)| middle[*local] -= 0.5 * weight);
                    continue;
                }
                let terms = || weights.iter().map(|&(local, weight)| (nodes[local], weight)).collect();
                centres.entry(nodes[centre]).or_insert_with(terms);
            }
            if let Element::Hex27(nodes) = element {
                let terms = middle.iter().zip(nodes).filter(|(weight, _)| **weight != 0.0);
                centres.insert(nodes[26], terms.map(|(&weight, &node)| (node, weight)).collect());
            }
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
    use crate::second_order::{HEX27_NODES, WEDGE18_NODES, hex27_shapes, wedge18_shapes};

    /// The 20 serendipity functions as in textbooks (Zienkiewicz and Taylor, The Finite Element Method, vol. 1).
    fn textbook(node: usize, [x, y, z]: [f64; 3]) -> f64 {
        let [a, b, c] = HEX27_NODES[node];
        if node < 8 {
            return (1.0 + a * x) * (1.0 + b * y) * (1.0 + c * z) * (a * x + b * y + c * z - 2.0) / 8.0;
        }
        let factor = |at: f64, x: f64| if at == 0.0 { 1.0 - x * x } else { 1.0 + at * x };
        factor(a, x) * factor(b, y) * factor(c, z) / 4.0
    }

    /// The 15 serendipity functions of a wedge (CalculiX 2.21, `shape15w.f`).
    fn textbook_wedge(node: usize, [r, s, z]: [f64; 3]) -> f64 {
        let l = [1.0 - r - s, r, s];
        match node {
            0..6 => {
                let (l, side) = (l[node % 3], if node < 3 { -z } else { z });
                0.5 * l * ((2.0 * l - 1.0) * (1.0 + side) - (1.0 - z * z))
            }
            6..12 => 2.0 * l[node % 3] * l[(node + 1) % 3] * (1.0 + if node < 9 { -z } else { z }),
            _ => l[node % 3] * (1.0 - z * z),
        }
    }

    /// The functions of the nodes of an element whose centres depend on them, from those of all nodes.
    fn condensed(element: Element, free: &[usize], values: &[f64]) -> Vec<f64> {
        let mesh = Mesh { elements: vec![element], ..Mesh::default() };
        let free: BTreeSet<u32> = free.iter().map(|&local| local as u32).collect();
        let mut out = values.to_vec();
        for centre in mesh.serendipity_centres(0..1, &free) {
            centre.terms.iter().for_each(|(node, weight)| out[*node as usize] += weight * values[centre.node as usize]);
            out[centre.node as usize] = 0.0;
        }
        out
    }

    #[test]
    fn dependent_centres_give_the_functions_of_20_nodes() {
        let hexahedron = Element::Hex27(std::array::from_fn(|i| i as u32));
        for i in 0..50 {
            let at = [0.7, 1.3, 2.9].map(|k| (k * (1.0 + f64::from(i))).sin());
            let found = condensed(hexahedron, &[], &hex27_shapes(at).0);
            assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-13);
            for (node, value) in found[..20].iter().enumerate() {
                assert!((value - textbook(node, at)).abs() < 1e-14, "node {node}: {value}");
            }
            // a free centre at ζ = 1
            let [x, y, z] = at;
            let bubble = (1.0 - x * x) * (1.0 - y * y) * (1.0 + z) / 2.0;
            let found = condensed(hexahedron, &[HEX_FACE_CENTRES[1]], &hex27_shapes(at).0);
            assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-13);
            assert!((found[HEX_FACE_CENTRES[1]] - bubble).abs() < 1e-14);
        }
    }

    #[test]
    fn dependent_centres_give_the_functions_of_15_nodes() {
        let wedge = Element::Wedge18(std::array::from_fn(|i| i as u32));
        for i in 0..50 {
            let at = [0.7, 1.3, 2.9].map(|k| (k * (1.0 + f64::from(i))).sin());
            let found = condensed(wedge, &[], &wedge18_shapes(at).0);
            assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-13);
            for (node, value) in found[..15].iter().enumerate() {
                assert!((value - textbook_wedge(node, at)).abs() < 1e-13, "node {node}: {value}");
            }
            let [r, s, z] = at;
            let bubble = 4.0 * r * s * (1.0 - z * z);
            let found = condensed(wedge, &[16], &wedge18_shapes(at).0);
            assert!((found[16] - bubble).abs() < 1e-13 && found[15] == 0.0 && found[17] == 0.0);
        }
    }

    /// Each function is 1 at its node and 0 at the others; slopes against central differences.
    #[test]
    fn functions_of_18_nodes() {
        for (node, place) in WEDGE18_NODES.into_iter().enumerate() {
            let (values, slopes) = wedge18_shapes(place);
            for (other, value) in values.into_iter().enumerate() {
                assert!((value - f64::from(u8::from(node == other))).abs() < 1e-15);
            }
            for c in 0..3 {
                let moved = |h: f64| {
                    let mut at = place;
                    at[c] += h;
                    wedge18_shapes(at).0
                };
                let (plus, minus) = (moved(1e-4), moved(-1e-4));
                for (other, slope) in slopes.iter().enumerate() {
                    assert!(((plus[other] - minus[other]) / 2e-4 - slope[c]).abs() < 1e-11);
                }
            }
        }
    }
}
