//! The quadratic shape of the facets of second-order elements.

use crate::element::{FaceNodes, FacetNodes};
use crate::{Element, Mesh};
use std::collections::HashMap;

/// A facet of a face of a second-order element, with the shape functions of the whole face.
///
/// They belong to the points x̂ = T x of the contact surfaces ([`crate::ContactMap`]), Σ_s N̂_s x̂_s = Σ_s N_s x_s:
/// N̂ = N T⁻¹ on the face, with
///
/// ```text
/// x = 3/4 x̂ + 1/8 (x̂_a + x̂_b)                            middle of the edge from a to b
/// x = 9/16 x̂ + 3/32 Σ x̂_middle + 1/64 Σ x̂_corner          centre of a face with nine nodes
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct QuadraticFacet {
    /// The nodes of the face.
    pub nodes: FaceNodes,
    /// Number of corners of the facet.
    corners: usize,
    /// `values[i][s]` = N̂_s at point i of the facet: its corners, the middles of its edges from each corner to the
    /// next and, if it is a quadrilateral, its centre. The functions are quadratic in between.
    values: [[f64; 9]; 9],
}

/// For the nodes of a face, in its order, the gap to another surface, where there is one. \[L\]
pub type NodeGaps = [Option<f64>; 9];

/// The functions of a face at a point, and their derivatives in a plane.
pub type FaceFunctions = ([f64; 9], [[f64; 2]; 9]);

/// Coordinates of the nodes of a face with nine nodes, −1 … 1.
const NINE: [[f64; 2]; 9] =
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, 0.0]];

/// Second and third area coordinate of the nodes of a face with six nodes.
const SIX: [[f64; 2]; 6] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]];

/// The shape functions N of a face at a point.
fn shapes(count: usize, [x, y]: [f64; 2]) -> [f64; 9] {
    let mut out = [0.0; 9];
    if count == 6 {
        let l = [1.0 - x - y, x, y];
        for i in 0..3 {
            out[i] = l[i] * (2.0 * l[i] - 1.0);
            out[3 + i] = 4.0 * l[i] * l[(i + 1) % 3];
        }
        return out;
    }
    let along = |x: f64, node: f64| if node == 0.0 { 1.0 - x * x } else { 0.5 * x * (x + node) };
    for (value, [a, b]) in out.iter_mut().zip(NINE) {
        *value = along(x, a) * along(y, b);
    }
    out
}

/// Replaces the functions of the nodes by those of the points x̂: N T⁻¹.
fn to_points(count: usize, of_nodes: [f64; 9]) -> [f64; 9] {
    let corners = if count == 6 { 3 } else { 4 };
    let mut out = [0.0; 9];
    out[..corners].copy_from_slice(&of_nodes[..corners]);
    for i in 0..corners {
        let middle = of_nodes[corners + i];
        out[corners + i] += 0.75 * middle;
        out[i] += 0.125 * middle;
        out[(i + 1) % corners] += 0.125 * middle;
    }
    if count == 9 {
        out[8] = of_nodes[8] * 9.0 / 16.0;
        (0..4).for_each(|i| out[i] += of_nodes[8] / 64.0);
        (4..8).for_each(|i| out[i] += of_nodes[8] * 3.0 / 32.0);
    }
    out
}

impl QuadraticFacet {
    /// The facet of a face whose corners are these nodes of the face.
    fn new(nodes: FaceNodes, corners: &[usize]) -> Self {
        let count = nodes.len();
        let at = |local: usize| if count == 6 { SIX[local] } else { NINE[local] };
        let middle = |a: [f64; 2], b: [f64; 2]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        let mut points: Vec<[f64; 2]> = corners.iter().map(|&local| at(local)).collect();
        for i in 0..corners.len() {
            points.push(middle(points[i], points[(i + 1) % corners.len()]));
        }
        if corners.len() == 4 {
            points.push(middle(points[0], points[2]));
        }
        let mut values = [[0.0; 9]; 9];
        for (values, point) in values.iter_mut().zip(points) {
            *values = to_points(count, shapes(count, point));
        }
        Self { nodes, corners: corners.len(), values }
    }

    /// The weights of the points x̂ of the face in the position of one of its nodes, x = T⁻¹ x̂.
    pub fn place_of_node(&self, node: usize) -> [f64; 9] {
        to_points(self.nodes.len(), std::array::from_fn(|s| f64::from(u8::from(s == node))))
    }

    /// T v on the face, for values v of its nodes: with them, the functions N̂ give what N gives with v.
    pub fn at_points(&self, v: &[f64; 9]) -> [f64; 9] {
        let count = self.nodes.len();
        let corners = if count == 6 { 3 } else { 4 };
        let mut out = [0.0; 9];
        out[..corners].copy_from_slice(&v[..corners]);
        for i in 0..corners {
            out[corners + i] = 4.0 / 3.0 * v[corners + i] - (v[i] + v[(i + 1) % corners]) / 6.0;
        }
        if count == 9 {
            let [of_corners, of_middles] = [0..4, 4..8].map(|range| v[range].iter().sum::<f64>());
            out[8] = 16.0 / 9.0 * v[8] - 2.0 / 9.0 * of_middles + of_corners / 36.0;
        }
        out
    }

    /// The functions N̂ of the face where the facet's own linear shape functions have the values `shape`, with the
    /// gradients `slope` in some plane.
    ///
    /// Test: `functions_of_a_face_reproduce_its_shape`.
    pub fn at(&self, shape: &[f64; 4], slope: &[[f64; 2]; 4]) -> FaceFunctions {
        let (between, by) = if self.corners == 3 { triangle(shape, slope) } else { quadrilateral(shape, slope) };
        let mut out = ([0.0; 9], [[0.0; 2]; 9]);
        let points = if self.corners == 3 { 6 } else { 9 };
        for (i, values) in self.values.iter().enumerate().take(points) {
            for (s, value) in values.iter().enumerate().take(self.nodes.len()) {
                out.0[s] += between[i] * value;
                (0..2).for_each(|c| out.1[s][c] += by[i][c] * value);
            }
        }
        out
    }
}

/// The quadratic functions of the six points of a triangle.
fn triangle(l: &[f64; 4], slope: &[[f64; 2]; 4]) -> FaceFunctions {
    let mut out = ([0.0; 9], [[0.0; 2]; 9]);
    for i in 0..3 {
        let next = (i + 1) % 3;
        out.0[i] = l[i] * (2.0 * l[i] - 1.0);
        out.0[3 + i] = 4.0 * l[i] * l[next];
        for c in 0..2 {
            out.1[i][c] = (4.0 * l[i] - 1.0) * slope[i][c];
            out.1[3 + i][c] = 4.0 * (l[i] * slope[next][c] + l[next] * slope[i][c]);
        }
    }
    out
}

/// The biquadratic functions of the nine points of a quadrilateral.
fn quadrilateral(n: &[f64; 4], slope: &[[f64; 2]; 4]) -> FaceFunctions {
    // coordinates 0 … 1, from the sums of shape functions along an edge
    let coordinates = [[1, 2], [2, 3]].map(|[a, b]| (n[a] + n[b], [0, 1].map(|c| slope[a][c] + slope[b][c])));
    // at 0, ½ and 1
    let along = coordinates.map(|(x, by)| {
        let values = [(1.0 - x) * (1.0 - 2.0 * x), 4.0 * x * (1.0 - x), x * (2.0 * x - 1.0)];
        let slopes = [4.0 * x - 3.0, 4.0 - 8.0 * x, 4.0 * x - 1.0];
        (values, slopes.map(|slope| by.map(|by| slope * by)))
    });
    const PLACES: [[usize; 2]; 9] = [[0, 0], [2, 0], [2, 2], [0, 2], [1, 0], [2, 1], [1, 2], [0, 1], [1, 1]];
    let [(x, dx), (y, dy)] = along;
    let mut out = ([0.0; 9], [[0.0; 2]; 9]);
    for (i, [a, b]) in PLACES.into_iter().enumerate() {
        out.0[i] = x[a] * y[b];
        out.1[i] = [0, 1].map(|c| dx[a][c] * y[b] + x[a] * dy[b][c]);
    }
    out
}

impl Mesh {
    /// For each facet, its quadratic shape; `None` for those of linear elements. Empty if all are linear.
    pub fn quadratic_facets(&self, facets: &[FacetNodes]) -> Vec<Option<QuadraticFacet>> {
        if !self.has_second_order() {
            return Vec::new();
        }
        let linear = facets.iter().map(|facet| (facet.sorted(), FaceNodes::from(*facet)));
        let mut faces: HashMap<FacetNodes, FaceNodes> = linear.collect();
        for element in self.elements.iter().filter(|element| Element::is_second_order(element)) {
            for face in (0..element.faces()).map(|face| element.face(face)) {
                for facet in face.facets() {
                    faces.entry(facet.sorted()).and_modify(|known| *known = face);
                }
            }
        }
        let of = |facet: &FacetNodes| {
            let face = faces.get(&facet.sorted()).filter(|face| face.len() > 4)?;
            let local: Option<Vec<usize>> =
                facet.iter().map(|node| face.iter().position(|other| other == node)).collect();
            Some(QuadraticFacet::new(*face, &local?))
        };
        facets.iter().map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ContactMap;

    /// On all facets of a hex27 and a tet10 with moved nodes, Σ N̂_s x̂_s is Σ N_s x_s at the same point, and its
    /// derivative that of central differences.
    #[test]
    fn functions_of_a_face_reproduce_its_shape() {
        for count in [10u32, 27] {
            let place = |i: f64| [(7.3 * i).sin(), (3.1 * i + 0.4).cos(), (5.7 * i).sin() - 0.2 * i];
            let nodes: Vec<[f64; 3]> = (0..count).map(|i| place(f64::from(i))).collect();
            let numbers: Vec<u32> = (0..count).collect();
            let element = match count {
                10 => Element::Tet10(numbers.try_into().unwrap()),
                _ => Element::Hex27(numbers.try_into().unwrap()),
            };
            let mesh = Mesh { nodes: nodes.clone(), elements: vec![element], ..Mesh::default() };
            let points = ContactMap::new(&mesh).points(&nodes);
            for face in (0..element.faces()).map(|face| element.face(face)) {
                let mut facets = face.facets();
                // other first corners
                facets.iter_mut().enumerate().for_each(|(k, facet)| {
                    let turned: Vec<u32> = (0..facet.len()).map(|i| facet[(i + k) % facet.len()]).collect();
                    *facet = FacetNodes::new(&turned).unwrap();
                });
                for (facet, quadratic) in facets.iter().zip(mesh.quadratic_facets(&facets)) {
                    let quadratic = quadratic.expect("of second order");
                    let place = |node: &u32| {
                        let local = face.iter().position(|other| other == node).unwrap();
                        if face.len() == 6 { SIX[local] } else { NINE[local] }
                    };
                    // T⁻¹ T = 1
                    for (s, k) in (0..face.len()).flat_map(|s| (0..face.len()).map(move |k| (s, k))) {
                        let unit = |k: usize| std::array::from_fn(|s| f64::from(u8::from(s == k)));
                        let product = quadratic.place_of_node(s).into_iter().zip(quadratic.at_points(&unit(k)));
                        let found: f64 = product.map(|(weight, value)| weight * value).sum();
                        assert!((found - f64::from(u8::from(k == s))).abs() < 1e-14);
                    }
                    for [x, y] in [[0.3, 0.2], [0.1, 0.7], [0.0, 1.0], [0.5, 0.5]] {
                        let linear = |x: f64, y: f64| match facet.len() {
                            3 => [1.0 - x - y, x, y, 0.0],
                            _ => [(1.0 - x) * (1.0 - y), x * (1.0 - y), x * y, (1.0 - x) * y],
                        };
                        let slope = match facet.len() {
                            3 => [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0], [0.0; 2]],
                            _ => [[y - 1.0, x - 1.0], [1.0 - y, -x], [y, x], [-y, 1.0 - x]],
                        };
                        let (functions, by) = quadratic.at(&linear(x, y), &slope);
                        let sum = |weights: &[f64; 9], of: &[[f64; 3]], c: usize| -> f64 {
                            quadratic.nodes.iter().zip(weights).map(|(&s, w)| w * of[s as usize][c]).sum()
                        };
                        let at = [0, 1].map(|c| -> f64 {
                            facet.iter().zip(linear(x, y)).map(|(node, w)| w * place(node)[c]).sum()
                        });
                        let exact = shapes(face.len(), at);
                        let h = 1e-5;
                        for c in 0..3 {
                            assert!((sum(&functions, &points, c) - sum(&exact, &nodes, c)).abs() < 1e-13);
                            for d in 0..2 {
                                let moved = |h: f64| quadratic.at(&linear(x + [h, 0.0][d], y + [0.0, h][d]), &slope).0;
                                let difference = (sum(&moved(h), &points, c) - sum(&moved(-h), &points, c)) / (2.0 * h);
                                let slope: [f64; 9] = by.map(|by| by[d]);
                                assert!((sum(&slope, &points, c) - difference).abs() < 1e-8);
                            }
                        }
                    }
                }
            }
        }
    }
}
