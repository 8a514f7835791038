//! The height of the true surface above a facet.
//!
//! A facet stands for a patch of a curved surface. On a facet with the shape functions N_i, the
//! patch lies at x(ξ) = Σ_i N_i(ξ) x_i + h(ξ) n, with n the facet's normal and h a polynomial that
//! is fixed in the reference configuration: it is attached to the material and moves with it. The
//! weighted gap then measures the distance between the patches instead of that between the facets:
//!
//! ```text
//! g̃_j = −n_j · (w_j + v_j),      v_j = Σ_slave facets  n₀ ∫ Φ_j (h¹ + t²) dA
//! t² = h²/c + Σ_a δ_a h² h²_,a/c²,      c = d · n²,  δ_a = g^a · d,  d = −n₀
//! ```
//!
//! Both distances are measured along the normal n₀ of the slave facet, along which the facets are
//! projected. The master's surface is met there at the distance t² from its facet: h² is a height
//! along the master facet's own normal n², and on the way the ray moves by δ_a t² in the facet's
//! coordinates (g^a: its dual basis at the centre), which changes h² by its slope h²_,a. The slip does
//! not contain the heights, since w_j already is the relative position of material points.

use nalgebra::{Matrix2, Matrix3, Vector3};

/// Heights of the true surface above a facet at its control points, outward positive. \[L\]
///
/// A quadrilateral has nine control points: its corners, the middles of its edges (the first one
/// follows the first corner) and its centre; the height is biquadratic. A triangle has six, corners
/// and middles; the height is quadratic, and the last three values are zero.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FacetHeight(pub [f64; 9]);

/// Values of the three quadratic Lagrange polynomials on −1, 0, 1, and their first and second
/// derivatives.
fn quadratic(x: f64) -> [[f64; 3]; 3] {
    [[0.5 * x * (x - 1.0), 1.0 - x * x, 0.5 * x * (x + 1.0)], [x - 0.5, -2.0 * x, x + 0.5], [1.0, -2.0, 1.0]]
}

/// Position of the nine control points of a quadrilateral in the 3 × 3 grid of the polynomials.
const GRID: [[usize; 2]; 9] = [[0, 0], [2, 0], [2, 2], [0, 2], [1, 0], [2, 1], [1, 2], [0, 1], [1, 1]];

/// Corner signs of the bilinear shape functions.
const CORNER: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

/// A function on a facet at a point: its value, and its derivative in the auxiliary plane.
pub(super) type AtPoint = (f64, [f64; 2]);

impl FacetHeight {
    /// At a point of a facet with `corners` corners, the height h and the products h h_,a with its
    /// slopes along the facet's two coordinates, each with its derivative in the plane in which
    /// `slope` are the gradients of the shape functions `shape`.
    ///
    /// Test: `heights_interpolate_and_have_exact_slopes`.
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
    pub(crate) fn value(&self, corners: usize, shape: &[f64; 4]) -> f64 {
        self.in_facet(corners, shape).0
    }

    /// Height, first and second derivatives in the facet's coordinates: ξ and η of a quadrilateral,
    /// the second and third area coordinate of a triangle.
    fn in_facet(&self, corners: usize, shape: &[f64; 4]) -> (f64, [f64; 2], [[f64; 2]; 2]) {
        let h = &self.0;
        let (mut value, mut first, mut second) = (0.0, [0.0; 2], [[0.0; 2]; 2]);
        if corners == 3 {
            const BY: [[f64; 2]; 3] = [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]];
            for i in 0..3 {
                let (a, b) = (i, (i + 1) % 3);
                let (la, lb) = (shape[a], shape[b]);
                value += h[a] * la * (2.0 * la - 1.0) + 4.0 * h[3 + i] * la * lb;
                for c in 0..2 {
                    first[c] += h[a] * (4.0 * la - 1.0) * BY[a][c] + 4.0 * h[3 + i] * (la * BY[b][c] + lb * BY[a][c]);
                    for d in 0..2 {
                        let mixed = BY[a][c] * BY[b][d] + BY[a][d] * BY[b][c];
                        second[c][d] += 4.0 * (h[a] * BY[a][c] * BY[a][d] + h[3 + i] * mixed);
                    }
                }
            }
            return (value, first, second);
        }
        let point: [f64; 2] =
            std::array::from_fn(|d| CORNER.iter().zip(shape).map(|(sign, shape)| sign[d] * shape).sum());
        let ([x, dx, ddx], [y, dy, ddy]) = (quadratic(point[0]), quadratic(point[1]));
        for (h, [i, j]) in h.iter().zip(GRID) {
            value += h * x[i] * y[j];
            first[0] += h * dx[i] * y[j];
            first[1] += h * x[i] * dy[j];
            second[0][0] += h * ddx[i] * y[j];
            second[0][1] += h * dx[i] * dy[j];
            second[1][1] += h * x[i] * ddy[j];
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
}

impl From<slipstick_mesh::FacetNodes> for CurvedFacet<'_> {
    fn from(nodes: slipstick_mesh::FacetNodes) -> Self {
        Self { nodes, height: None }
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
    /// central differences, which are exact for polynomials of fourth degree.
    #[test]
    fn heights_interpolate_and_have_exact_slopes() {
        let height = FacetHeight([0.3, -0.2, 0.5, 0.1, 0.7, -0.4, 0.25, 0.6, -0.9]);
        for corners in [3, 4] {
            let corner = |i: usize| -> [f64; 4] { std::array::from_fn(|k| f64::from(u8::from(k == i % corners))) };
            let between = |i: usize| std::array::from_fn(|k| 0.5 * (corner(i)[k] + corner(i + 1)[k]));
            let points = (0..corners).map(corner).chain((0..corners).map(between));
            for (at, expected) in points.chain((corners == 4).then_some([0.25; 4])).zip(height.0) {
                assert!((height.in_facet(corners, &at).0 - expected).abs() < 1e-15);
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
                let difference = (8.0 * (moved(0.01) - moved(-0.01)) - (moved(0.02) - moved(-0.02))) / 0.12;
                assert!((difference - value(point)[k].1[c]).abs() < 1e-12, "{corners} corners, function {k}");
            }
        }
    }
}
