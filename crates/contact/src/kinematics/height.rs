//! The height of the true surface above a facet.
//!
//! A facet stands for a patch of a curved surface. On a facet with the shape functions N_i, the
//! patch lies at x(ξ) = Σ_i N_i(ξ) x_i + σ h(ξ) n, with n the facet's normal, h a polynomial of the
//! reference configuration, and σ the stretch of the facet. The patch is attached to the material and
//! moves with it, and turns within the facet by the same angle: a ring that grows keeps its shape. The
//! weighted gap then measures the distance between the patches instead of that between the facets:
//!
//! ```text
//! g̃_j = −n_j · (w_j + v_j),      v_j = Σ_slave facets  n₀ ∫ Φ_j (σ¹ h¹ + t²) dA
//! t² = σ² h²/c + Σ_a δ_a σ² h² σ² h²_,a/c²,      c = d · n²,  δ_a = g^a · d,  d = −n₀
//! ```
//!
//! Both distances are measured along the normal n₀ of the slave facet, along which the facets are
//! projected. The master's surface is met there at the distance t² from its facet: σ² h² is a height
//! along the master facet's own normal n², and on the way the ray moves by δ_a t² in the facet's
//! coordinates (g^a: its dual basis at the centre), which changes the height by its slope. The slip
//! does not contain the heights, since w_j already is the relative position of material points.

use nalgebra::{Matrix2, Matrix3, Vector3};
use slipstick_mesh::{FacetHeights, QuadraticFacet};

/// Heights of the true surface above a facet at its control points, outward positive, and how they
/// grow with the facet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FacetHeight {
    /// Heights in the reference configuration. \[L\]
    values: FacetHeights,
    /// The stretch is σ = Σ_k w_k l_k with the lengths l_k of the edges; the first edge follows the
    /// first corner. \[1/L\]
    weights: [f64; 4],
}

/// Number of control points along an edge.
const ALONG: usize = 5;

/// Position of a control point on an edge, −1 … 1.
const NODES: [f64; ALONG] = [-1.0, -0.5, 0.0, 0.5, 1.0];

/// 1 / (x_i − x_j) of the control points along an edge, for j ≠ i.
const SLOPES: [[f64; ALONG - 1]; ALONG] = {
    let mut slopes = [[0.0; ALONG - 1]; ALONG];
    let mut i = 0;
    while i < ALONG {
        let mut j = 0;
        while j < ALONG - 1 {
            slopes[i][j] = 1.0 / (NODES[i] - NODES[other(i, j)]);
            j += 1;
        }
        i += 1;
    }
    slopes
};

/// The j-th of the numbers other than i.
const fn other(i: usize, j: usize) -> usize {
    if j < i { j } else { j + 1 }
}

/// Values of the five Lagrange polynomials of fourth degree, and their first and second derivatives.
#[inline(always)]
fn quartic(x: f64) -> [[f64; ALONG]; 3] {
    let mut out = [[0.0; ALONG]; 3];
    for i in 0..ALONG {
        // the product of the factors so far, and its derivatives
        let (mut value, mut first, mut second) = (1.0, 0.0, 0.0);
        for j in 0..ALONG - 1 {
            let slope = SLOPES[i][j];
            let factor = (x - NODES[other(i, j)]) * slope;
            second = second * factor + 2.0 * first * slope;
            first = first * factor + value * slope;
            value *= factor;
        }
        for (row, value) in out.iter_mut().zip([value, first, second]) {
            row[i] = value;
        }
    }
    out
}

/// Π_{s < m} (4 l − s)/(s + 1) of an area coordinate l, and its first and second derivatives, for m =
/// 0 … 4.
fn rising(l: f64) -> [[f64; ALONG]; 3] {
    let mut out = [[0.0; ALONG]; 3];
    out[0][0] = 1.0;
    for m in 1..ALONG {
        let slope = 4.0 / m as f64;
        let factor = (4.0 * l - (m - 1) as f64) / m as f64;
        out[2][m] = out[2][m - 1] * factor + 2.0 * out[1][m - 1] * slope;
        out[1][m] = out[1][m - 1] * factor + out[0][m - 1] * slope;
        out[0][m] = out[0][m - 1] * factor;
    }
    out
}

/// Corner signs of the bilinear shape functions.
const CORNER: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

/// A function on a facet at a point: its value, and its derivative in the auxiliary plane.
pub(super) type AtPoint = (f64, [f64; 2]);

/// Rises of an edge's middle above its ends below this fraction of the largest height are round-off.
const ROUND_OFF: f64 = 1e-9;

impl FacetHeight {
    /// Heights above a facet with these corners in the reference configuration.
    ///
    /// The stretch is the mean over the edges, weighted by how far the surface rises above each: around
    /// a cylinder, stretch along its axis does not count.
    pub fn new(values: FacetHeights, corners: &[Vector3<f64>]) -> Self {
        let count = corners.len();
        // positions of the corners and of the middles of the edges among the control points
        let (ends, middles) = match count {
            3 => ([0, 4, 14, 0], [2, 11, 9, 0]),
            _ => ([0, 4, 24, 20], [2, 14, 22, 10]),
        };
        let rise = |k: usize| (values[middles[k]] - 0.5 * (values[ends[k]] + values[ends[(k + 1) % count]])).abs();
        let largest = values.iter().fold(0.0, |largest: f64, h| largest.max(h.abs()));
        let rises: Vec<f64> =
            (0..count).map(rise).map(|rise| if rise > ROUND_OFF * largest { rise } else { 0.0 }).collect();
        let rises = if rises.iter().all(|rise| *rise == 0.0) { vec![1.0; count] } else { rises };
        let length = |k: usize| (corners[(k + 1) % count] - corners[k]).norm();
        let total: f64 = rises.iter().enumerate().map(|(k, rise)| rise * length(k)).sum();
        let weights = std::array::from_fn(|k| rises.get(k).map_or(0.0, |rise| rise / total));
        Self { values, weights }
    }

    /// The stretch σ of a facet with these corners, and ∂σ/∂x_i.
    ///
    /// Test: `coupling_gradient_matches_finite_differences`.
    pub(super) fn stretch<const N: usize>(&self, corners: &[Vector3<f64>; N]) -> (f64, [Vector3<f64>; N]) {
        let mut out = (0.0, [Vector3::zeros(); N]);
        for (k, weight) in self.weights.iter().enumerate().take(N) {
            let next = (k + 1) % N;
            let edge = corners[next] - corners[k];
            let length = edge.norm();
            out.0 += weight * length;
            if length > 0.0 {
                let along = edge * (weight / length);
                out.1[next] += along;
                out.1[k] -= along;
            }
        }
        out
    }

    /// √(1 + |∇h|²) at the control points, for a facet with these corners in the reference configuration:
    /// the distance along the facet's normal between this surface and one at unit distance.
    pub(crate) fn slant(&self, corners: &[Vector3<f64>]) -> Self {
        let mut values: FacetHeights = [0.0; 25];
        let count = corners.len();
        for (value, shape) in values.iter_mut().zip(slipstick_mesh::control_points(count)) {
            let by = self.in_facet(count, &shape).1;
            let tangent: [Vector3<f64>; 2] = std::array::from_fn(|d| match count {
                3 => corners[d + 1] - corners[0],
                _ => {
                    // ∂N/∂ξ = ± (1 ± η)/4, and 1 ± η is twice a sum of two shape functions
                    let along = [[[0, 1], [3, 2]], [[0, 3], [1, 2]]][d];
                    let edge = |[a, b]: [usize; 2]| (corners[b] - corners[a]) * (0.5 * (shape[a] + shape[b]));
                    edge(along[0]) + edge(along[1])
                }
            });
            let metric = Matrix2::from_fn(|a, b| tangent[a].dot(&tangent[b]));
            let steep = metric.try_inverse().map_or(0.0, |inverse| {
                (0..2).flat_map(|a| (0..2).map(move |b| (a, b))).map(|(a, b)| by[a] * inverse[(a, b)] * by[b]).sum()
            });
            *value = (1.0_f64 + steep).sqrt();
        }
        Self::new(values, corners)
    }

    /// At a point of a facet with `corners` corners, the height h and the products h h_,a with its
    /// slopes along the facet's two coordinates, each with its derivative in the plane in which
    /// `slope` are the gradients of the shape functions `shape`.
    ///
    /// Test: `heights_interpolate_and_have_exact_slopes`.
    #[inline(always)]
    pub(super) fn at(&self, corners: usize, shape: &[f64; 4], slope: &[[f64; 2]; 4]) -> [AtPoint; 3] {
        let (value, first, second) = self.in_facet(corners, shape);
        // the facet's coordinates in the plane
        let along: [[f64; 2]; 2] = match corners {
            3 => [slope[1], slope[2]],
            _ => std::array::from_fn(|d| {
                std::array::from_fn(|c| CORNER.iter().zip(slope).map(|(sign, slope)| sign[d] * slope[c]).sum())
            }),
        };
        let in_plane = |by: [f64; 2]| std::array::from_fn(|c| by[0] * along[0][c] + by[1] * along[1][c]);
        let product = |a: usize| {
            (value * first[a], in_plane(std::array::from_fn(|b| first[a] * first[b] + value * second[a][b])))
        };
        [(value, in_plane(first)), product(0), product(1)]
    }

    /// The height at a point where the facet's shape functions, or weights of its corners that give the same
    /// coordinates, have these values. \[L\]
    pub fn value(&self, corners: usize, shape: &[f64; 4]) -> f64 {
        self.in_facet(corners, shape).0
    }

    /// Height, first and second derivatives in the facet's coordinates: ξ and η of a quadrilateral,
    /// the second and third area coordinate of a triangle.
    #[inline(always)]
    fn in_facet(&self, corners: usize, shape: &[f64; 4]) -> (f64, [f64; 2], [[f64; 2]; 2]) {
        let h = &self.values;
        let (mut value, mut first, mut second) = (0.0, [0.0; 2], [[0.0; 2]; 2]);
        if corners == 3 {
            let along: [_; 3] = std::array::from_fn(|i| rising(shape[i]));
            // ∂/∂l_i, of which the coordinates ξ = l_1 and η = l_2 leave ∂_{i+1} − ∂_0
            let mut by = [0.0; 3];
            let mut both = [[0.0; 3]; 3];
            let mut at = h.iter();
            for j in 0..ALONG {
                for i in 0..ALONG - j {
                    let (h, power) = (at.next().copied().unwrap_or_default(), [ALONG - 1 - i - j, i, j]);
                    let of = |orders: [usize; 3]| (0..3).map(|l| along[l][orders[l]][power[l]]).product::<f64>();
                    value += h * of([0; 3]);
                    for a in 0..3 {
                        by[a] += h * of(std::array::from_fn(|l| usize::from(l == a)));
                        for b in 0..3 {
                            both[a][b] += h * of(std::array::from_fn(|l| usize::from(l == a) + usize::from(l == b)));
                        }
                    }
                }
            }
            for c in 0..2 {
                first[c] = by[c + 1] - by[0];
                for d in 0..2 {
                    second[c][d] = both[c + 1][d + 1] - both[c + 1][0] - both[0][d + 1] + both[0][0];
                }
            }
            return (value, first, second);
        }
        let point: [f64; 2] =
            std::array::from_fn(|d| CORNER.iter().zip(shape).map(|(sign, shape)| sign[d] * shape).sum());
        let ([x, dx, ddx], [y, dy, ddy]) = (quartic(point[0]), quartic(point[1]));
        for (j, row) in h.as_chunks::<ALONG>().0.iter().enumerate() {
            // along ξ first
            let (mut r, mut dr, mut ddr) = (0.0, 0.0, 0.0);
            for i in 0..ALONG {
                r += row[i] * x[i];
                dr += row[i] * dx[i];
                ddr += row[i] * ddx[i];
            }
            value += r * y[j];
            first[0] += dr * y[j];
            first[1] += r * dy[j];
            second[0][0] += ddr * y[j];
            second[0][1] += dr * dy[j];
            second[1][1] += r * ddy[j];
        }
        second[1][0] = second[0][1];
        (value, first, second)
    }
}

/// A facet with its height, which is absent where the facet is the surface itself.
#[derive(Debug, Clone, Copy)]
pub struct CurvedFacet<'a> {
    /// Global node numbers.
    pub nodes: slipstick_mesh::FacetNodes,
    /// Height of the true surface above it.
    pub height: Option<&'a FacetHeight>,
    /// The quadratic face that a pressure at the points acts on; it has no height then.
    pub face: Option<&'a QuadraticFacet>,
}

impl CurvedFacet<'_> {
    /// The nodes of its face, or its own.
    pub(crate) fn face_nodes(&self) -> &[u32] {
        self.face.map_or(&self.nodes[..], |face| &face.nodes[..])
    }
}

impl From<slipstick_mesh::FacetNodes> for CurvedFacet<'_> {
    fn from(nodes: slipstick_mesh::FacetNodes) -> Self {
        Self { nodes, height: None, face: None }
    }
}

/// How the height above a master facet and its products with its slopes combine to the distance t²
/// along a direction d: `factors` = 1/c, δ_0/c² and δ_1/c².
pub(super) struct AlongRay<const M: usize> {
    pub factors: [f64; 3],
    /// `by_direction[k]` = ∂factors_k/∂d.
    pub by_direction: [Vector3<f64>; 3],
    /// `by_corner[k][i]` = ∂factors_k/∂x_i for the facet's corners i.
    pub by_corner: [[Vector3<f64>; M]; 3],
}

impl<const M: usize> AlongRay<M> {
    /// For a facet with these corners and this normal, whose derivative with respect to
    /// corner i is `slope[i]`. `None` for a collapsed facet.
    ///
    /// Test: `coupling_gradient_matches_finite_differences`.
    pub fn new(
        d: &Vector3<f64>,
        corners: &[Vector3<f64>; M],
        normal: &Vector3<f64>,
        slope: &[Matrix3<f64>; M],
    ) -> Option<Self> {
        // tangents at the centre, Σ_i tangent[a][i] x_i
        let tangent: [[f64; M]; 2] = std::array::from_fn(|a| {
            std::array::from_fn(|i| match (M, i) {
                (3, 0) => -1.0,
                (3, _) => f64::from(u8::from(i == a + 1)),
                _ => 0.25 * CORNER[i][a],
            })
        });
        let basis = tangent.map(|weights| corners.iter().zip(weights).map(|(x, w)| x * w).sum::<Vector3<f64>>());
        let metric = Matrix2::from_fn(|a, b| basis[a].dot(&basis[b])).try_inverse()?;
        let dual: [Vector3<f64>; 2] = std::array::from_fn(|a| basis[0] * metric[(a, 0)] + basis[1] * metric[(a, 1)]);
        let c = d.dot(normal);
        let along = dual.map(|g| g.dot(d));
        let across = d - basis[0] * along[0] - basis[1] * along[1];
        let by_c = [-1.0 / (c * c), -2.0 * along[0] / (c * c * c), -2.0 * along[1] / (c * c * c)];
        let square = 1.0 / (c * c);
        let mut out = Self {
            factors: [1.0 / c, along[0] * square, along[1] * square],
            by_direction: std::array::from_fn(|k| {
                normal * by_c[k] + if k > 0 { dual[k - 1] * square } else { Vector3::zeros() }
            }),
            by_corner: [[Vector3::zeros(); M]; 3],
        };
        for i in 0..M {
            let of_normal = slope[i].tr_mul(d);
            for k in 0..3 {
                out.by_corner[k][i] = of_normal * by_c[k];
                if k == 0 {
                    continue;
                }
                // δ(g^a · d) = −g^a · δg_b δ_b + g^ab δg_b · (d − δ_b g_b)
                for b in 0..2 {
                    let weight = tangent[b][i] * square;
                    out.by_corner[k][i] += (across * metric[(k - 1, b)] - dual[k - 1] * along[b]) * weight;
                }
            }
        }
        Some(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At the control points the height has the given values; elsewhere its slope agrees with
    /// central differences.
    #[test]
    fn heights_interpolate_and_have_exact_slopes() {
        let values = std::array::from_fn(|i| (1.3 * i as f64).sin());
        let unit = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| Vector3::new(x, y, 0.0));
        for corners in [3, 4] {
            let height = FacetHeight::new(values, &unit[..corners]);
            assert!((height.stretch(&unit).0 - 1.0).abs() < 1e-15 || corners == 3);
            let points = slipstick_mesh::control_points(corners);
            assert_eq!(points.len(), if corners == 3 { 15 } else { 25 });
            for (at, expected) in points.into_iter().zip(values) {
                assert!((height.in_facet(corners, &at).0 - expected).abs() < 1e-13);
            }
            let shapes = |[x, y]: [f64; 2]| -> ([f64; 4], [[f64; 2]; 4]) {
                if corners == 3 {
                    return ([1.0 - x - y, x, y, 0.0], [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]);
                }
                (
                    CORNER.map(|[a, b]| 0.25 * (1.0 + a * x) * (1.0 + b * y)),
                    CORNER.map(|[a, b]| [0.25 * a * (1.0 + b * y), 0.25 * b * (1.0 + a * x)]),
                )
            };
            let value = |point| {
                let (shape, slope) = shapes(point);
                height.at(corners, &shape, &slope)
            };
            let point = [0.31, 0.22];
            let slopes = height.in_facet(corners, &shapes(point).0).1;
            let [(h, _), (p, _), (q, _)] = value(point);
            assert!((p - h * slopes[0]).abs() < 1e-15 && (q - h * slopes[1]).abs() < 1e-15);
            for (c, k) in (0..2).flat_map(|c| (0..3).map(move |k| (c, k))) {
                let moved = |h: f64| {
                    let mut point = point;
                    point[c] += h;
                    value(point)[k].0
                };
                let difference = (8.0 * (moved(2e-4) - moved(-2e-4)) - (moved(4e-4) - moved(-4e-4))) / 0.0024;
                assert!((difference - value(point)[k].1[c]).abs() < 1e-8, "{corners} corners, function {k}");
            }
        }
    }
}
