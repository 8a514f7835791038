//! Mortar integrals of one slave facet with one master facet.
//!
//! In the auxiliary plane of the slave facet both facets are triangles or bilinear quadrilaterals
//! in two coordinates, and the map of a point back to a facet along the plane's normal is the
//! inverse of the linear or bilinear map. The integrals therefore depend on the pair's geometry
//! through at most 16 plane coordinates; [`super::coupling`] differentiates the plane itself.
//!
//! ```text
//! D_jk = Σ_cells Σ_g w_g A_cell N¹_j(ξ¹_g) N¹_k(ξ¹_g),   M_jl = Σ_cells Σ_g w_g A_cell N¹_j(ξ¹_g) N²_l(ξ²_g)      (15)
//! ```
//!
//! A cell is the triangle formed by an edge of the overlap and the overlap's area centroid.

use super::cell_rule::CellPoint;
use super::clip::{PLANE_COORDINATES, Point, Vertex, clip};
use super::height::FacetHeight;
pub use super::inverse_map::Unmappable;
use super::inverse_map::{Image, map_back};

/// D and M of one facet pair with the standard shape Φ = N¹, and their gradients in the plane
/// coordinates.
///
/// Entries and plane coordinates of a triangle's fourth corner have no meaning.
#[derive(Debug, Clone, PartialEq)]
pub struct PairIntegrals {
    /// `values[4 j + k]` = D_jk for k < 4 slave corners, `values[16 + 4 j + l]` = M_jl for l < 4
    /// master corners. \[L²\]
    pub values: [f64; 32],
    /// ∂values / ∂(plane coordinates): 8 for the slave corners, then 8 for the master
    /// corners. \[L\]
    pub gradient: [[f64; PLANE_COORDINATES]; 32],
    /// `heights[4 k + j]` = ∫ N¹_j f_k with f = h¹, h² and the products of h² with its slopes along
    /// the master facet's two coordinates; zero if there are no heights. \[L³\] or \[L⁴\]
    pub heights: [f64; 16],
    /// ∂heights / ∂(plane coordinates). \[L²\] or \[L³\]
    pub heights_gradient: [[f64; PLANE_COORDINATES]; 16],
}

impl Default for PairIntegrals {
    fn default() -> Self {
        Self {
            values: [0.0; 32],
            gradient: [[0.0; PLANE_COORDINATES]; 32],
            heights: [0.0; 16],
            heights_gradient: [[0.0; PLANE_COORDINATES]; 16],
        }
    }
}

/// The heights of the true surfaces above a slave and a master facet, where there are any.
pub type PairHeights<'a> = [Option<&'a FacetHeight>; 2];

/// Centroid C of a convex polygon's area, and `slope[i][c][d]` = ∂C_c/∂(coordinate d of vertex i).
///
/// Unlike the mean of the vertices, it does not jump when the polygon gains a vertex, and neither
/// do integrals for which the rule is inexact.
fn centroid(vertices: &[Vertex]) -> (Point, [[[f64; 2]; 2]; 8]) {
    let (count, origin) = (vertices.len(), vertices[0].position);
    let arm = |i: usize| {
        let p = vertices[i % count].position;
        [p[0] - origin[0], p[1] - origin[1]]
    };
    // twice the area, and six times its first moment about the origin
    let (mut area, mut moment) = (0.0, [0.0; 2]);
    let mut area_slope = [[0.0; 2]; 8];
    let mut slope = [[[0.0; 2]; 2]; 8];
    for i in 0..count {
        let (p, q, next) = (arm(i), arm(i + 1), (i + 1) % count);
        let cross = p[0] * q[1] - p[1] * q[0];
        area += cross;
        for d in 0..2 {
            let (by_p, by_q) = ([q[1], -q[0]][d], [-p[1], p[0]][d]);
            area_slope[i][d] += by_p;
            area_slope[next][d] += by_q;
            moment[d] += cross * (p[d] + q[d]);
            for c in 0..2 {
                let diagonal = if c == d { cross } else { 0.0 };
                slope[i][c][d] += by_p * (p[c] + q[c]) + diagonal;
                slope[next][c][d] += by_q * (p[c] + q[c]) + diagonal;
            }
        }
    }
    let centre = moment.map(|m| m / (3.0 * area));
    for i in 0..count {
        for c in 0..2 {
            for d in 0..2 {
                slope[i][c][d] = (slope[i][c][d] / 3.0 - centre[c] * area_slope[i][d]) / area;
            }
        }
    }
    ([origin[0] + centre[0], origin[1] + centre[1]], slope)
}

/// The corners of a clockwise facet in counter-clockwise order, that is, in reverse order.
pub fn reversed<const N: usize>() -> [usize; N] {
    std::array::from_fn(|i| (N - i) % N)
}

/// Integrates one pair. `slave` and `master` are the corners in the auxiliary plane in facet order;
/// the master facet faces the slave, so it is clockwise there.
///
/// Returns `Ok(false)`, with `out` untouched, if the facets do not overlap or the master facet does
/// not face the slave. The gradient is computed only if `with_gradient`.
///
/// # Errors
/// [`Unmappable`] if a point of the overlap has no preimage on one of the facets.
///
/// Paper: (12), (15). Tests: `reference_mortar_matrices` (tests/reference.rs),
/// `gradient_matches_finite_differences`.
pub fn integrate_pair<const S: usize, const M: usize>(
    slave: &[Point; S],
    master: &[Point; M],
    heights: PairHeights<'_>,
    rule: &[CellPoint],
    with_gradient: bool,
    out: &mut PairIntegrals,
) -> Result<bool, Unmappable> {
    let order = reversed::<M>();
    let Some(overlap) = clip(slave, &order.map(|i| master[i]), &order) else { return Ok(false) };
    let vertices = overlap.vertices();
    let count = vertices.len();
    let (centre, centre_slope) = centroid(vertices);
    // the master in counter-clockwise order for the inverse map; its results are restored to facet
    // order
    let turned = order.map(|i| master[i]);

    let mut values = [0.0; 32];
    // gradient with respect to the polygon's vertices (8) and its centre (last)
    let mut by_vertex = [[[0.0; 2]; 9]; 32];
    let mut by_corner = [[0.0; PLANE_COORDINATES]; 32];
    let curved = heights != [None, None];
    out.heights = [0.0; 16];
    out.heights_gradient = [[0.0; PLANE_COORDINATES]; 16];
    let mut heights_by_vertex = [[[0.0; 2]; 9]; 16];
    for i in 0..count {
        let cell = [centre, vertices[i].position, vertices[(i + 1) % count].position];
        let slots = [8, i, (i + 1) % count];
        let (u, v) =
            ([cell[1][0] - cell[0][0], cell[1][1] - cell[0][1]], [cell[2][0] - cell[0][0], cell[2][1] - cell[0][1]]);
        let area = 0.5 * (u[0] * v[1] - u[1] * v[0]);
        // ∂A/∂vertex
        let area_slope =
            [[0.5 * (u[1] - v[1]), 0.5 * (v[0] - u[0])], [0.5 * v[1], -0.5 * v[0]], [-0.5 * u[1], 0.5 * u[0]]];
        for point in rule {
            let l = point.barycentric;
            let y = [
                l[0] * cell[0][0] + l[1] * cell[1][0] + l[2] * cell[2][0],
                l[0] * cell[0][1] + l[1] * cell[1][1] + l[2] * cell[2][1],
            ];
            let (first, turned_image) = (map_back(slave, y)?, map_back(&turned, y)?);
            let mut second = Image { shape: [0.0; 4], slope: [[0.0; 2]; 4] };
            for (position, &own) in order.iter().enumerate() {
                second.shape[own] = turned_image.shape[position];
                second.slope[own] = turned_image.slope[position];
            }
            let weight = point.weight * area;
            let on_slave = heights[0].map(|height| height.at(S, &first.shape, &first.slope)[0]);
            let on_master = heights[1].map(|height| height.at(M, &second.shape, &second.slope));
            let functions = on_slave
                .into_iter()
                .map(|f| (0, f))
                .chain(on_master.into_iter().flatten().zip(1..).map(|(f, k)| (k, f)));
            for (k, (f, by_point)) in functions {
                let (image, column) = if k == 0 { (&first, 0) } else { (&second, 8) };
                for j in 0..S {
                    let entry = 4 * k + j;
                    out.heights[entry] += weight * first.shape[j] * f;
                    if !with_gradient {
                        continue;
                    }
                    // through the slave's shape function, and through the function
                    let slope_n = first.slope[j].map(|slope| weight * slope * f);
                    let slope_f = by_point.map(|slope| weight * first.shape[j] * slope);
                    for (corner, &slot) in slots.iter().enumerate() {
                        for c in 0..2 {
                            heights_by_vertex[entry][slot][c] +=
                                point.weight * area_slope[corner][c] * first.shape[j] * f
                                    + l[corner] * (slope_n[c] + slope_f[c]);
                        }
                    }
                    let row = &mut out.heights_gradient[entry];
                    for i in 0..4 {
                        for c in 0..2 {
                            row[2 * i + c] -= first.shape[i] * slope_n[c];
                            row[column + 2 * i + c] -= image.shape[i] * slope_f[c];
                        }
                    }
                }
            }
            for j in 0..S {
                for k in 0..S {
                    values[4 * j + k] += weight * first.shape[j] * first.shape[k];
                }
                for k in 0..M {
                    values[16 + 4 * j + k] += weight * first.shape[j] * second.shape[k];
                }
            }
            if !with_gradient {
                continue;
            }
            // the fourth corner of a triangle has no shape function: its results vanish
            for j in 0..S {
                for k in 0..const { if S > M { S } else { M } } {
                    let both = first.shape[j] * first.shape[k];
                    let slope_d = [
                        weight * (first.slope[j][0] * first.shape[k] + first.shape[j] * first.slope[k][0]),
                        weight * (first.slope[j][1] * first.shape[k] + first.shape[j] * first.slope[k][1]),
                    ];
                    let mixed = first.shape[j] * second.shape[k];
                    // through the slave's and the master's inverse map
                    let slope_s =
                        [weight * first.slope[j][0] * second.shape[k], weight * first.slope[j][1] * second.shape[k]];
                    let slope_m =
                        [weight * first.shape[j] * second.slope[k][0], weight * first.shape[j] * second.slope[k][1]];
                    let (d, m) = (4 * j + k, 16 + 4 * j + k);
                    for (corner, &slot) in slots.iter().enumerate() {
                        for c in 0..2 {
                            let through_area = point.weight * area_slope[corner][c];
                            by_vertex[d][slot][c] += through_area * both + l[corner] * slope_d[c];
                            by_vertex[m][slot][c] += through_area * mixed + l[corner] * (slope_s[c] + slope_m[c]);
                        }
                    }
                    // moving a corner p_i by δ shifts the image like moving y by −N_i δ
                    for i in 0..4 {
                        for c in 0..2 {
                            by_corner[d][2 * i + c] -= first.shape[i] * slope_d[c];
                            by_corner[m][2 * i + c] -= first.shape[i] * slope_s[c];
                            by_corner[m][8 + 2 * i + c] -= second.shape[i] * slope_m[c];
                        }
                    }
                }
            }
        }
    }
    out.values = values;
    if with_gradient {
        let add_through_vertices = |row: &mut [f64; PLANE_COORDINATES], by_vertex: &[[f64; 2]; 9]| {
            let by_centre = by_vertex[8];
            for (i, vertex) in vertices.iter().enumerate() {
                let through: Point = std::array::from_fn(|d| {
                    by_vertex[i][d] + by_centre[0] * centre_slope[i][0][d] + by_centre[1] * centre_slope[i][1][d]
                });
                for q in 0..PLANE_COORDINATES {
                    row[q] += through[0] * vertex.gradient[0][q] + through[1] * vertex.gradient[1][q];
                }
            }
        };
        out.gradient = by_corner;
        out.gradient.iter_mut().zip(&by_vertex).for_each(|(row, by_vertex)| add_through_vertices(row, by_vertex));
        if curved {
            let rows = out.heights_gradient.iter_mut().zip(&heights_by_vertex);
            rows.for_each(|(row, by_vertex)| add_through_vertices(row, by_vertex));
        }
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::CellRule;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    const SLAVE: [Point; 4] = [[0.0, 0.0], [1.0, 0.1], [1.1, 0.9], [-0.1, 1.0]];

    /// For a slave square that the master covers, D is the consistent mass matrix: A/36 (4, 2, 1,
    /// 2; …).
    #[test]
    fn covered_square_gives_the_mass_matrix() {
        let slave = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let master = [[-1.0, -1.0], [-1.0, 2.0], [2.0, 2.0], [2.0, -1.0]];
        let mut pair = PairIntegrals::default();
        assert_eq!(integrate_pair(&slave, &master, [None; 2], &CellRule::Seven.points(), false, &mut pair), Ok(true));
        for (entry, exact) in [(0, 4.0), (1, 2.0), (2, 1.0), (3, 2.0), (5, 4.0)] {
            assert!((pair.values[entry] - exact / 36.0).abs() < 1e-15);
        }
    }

    #[test]
    fn a_master_that_looks_away_is_skipped() {
        let mut pair = PairIntegrals::default();
        assert_eq!(integrate_pair(&SLAVE, &SLAVE, [None; 2], &CellRule::Seven.points(), false, &mut pair), Ok(false));
    }

    /// For a slave triangle that the master covers, D is its mass matrix: A/12 (2, 1, 1; …); for
    /// two coincident triangles, M is the same.
    #[test]
    fn covered_triangle_gives_the_mass_matrix() {
        let slave = [[0.0, 0.0], [2.0, 0.0], [0.5, 1.5]];
        let mut pair = PairIntegrals::default();
        let rule = CellRule::Seven.points();
        let cover = [[-1.0, -1.0], [-1.0, 2.0], [3.0, 2.0], [3.0, -1.0]];
        assert_eq!(integrate_pair(&slave, &cover, [None; 2], &rule, false, &mut pair), Ok(true));
        let mass = |j: usize, k: usize| 1.5 / 12.0 * (1.0 + f64::from(j == k));
        for j in 0..3 {
            for k in 0..3 {
                assert!((pair.values[4 * j + k] - mass(j, k)).abs() < 1e-15);
            }
        }
        let same = [slave[0], slave[2], slave[1]];
        assert_eq!(integrate_pair(&slave, &same, [None; 2], &rule, false, &mut pair), Ok(true));
        for j in 0..3 {
            for (l, k) in [(0, 0), (2, 1), (1, 2)] {
                assert!((pair.values[16 + 4 * j + l] - mass(j, k)).abs() < 1e-15);
            }
        }
    }

    fn perturbed(q: &[f64; 16]) -> ([Point; 4], [Point; 4]) {
        (std::array::from_fn(|i| [q[2 * i], q[2 * i + 1]]), std::array::from_fn(|i| [q[8 + 2 * i], q[9 + 2 * i]]))
    }

    proptest! {
        /// Richardson-extrapolated central differences of all 48 integrals in all 16 coordinates,
        /// and Σ_k D = Σ_l M.
        #[test]
        fn gradient_matches_finite_differences(jitter in prop::array::uniform16(-0.1f64..0.1), x in -0.7f64..0.7, y in -0.7f64..0.7, turn in -0.7f64..0.7) {
            let master: [Point; 4] = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]]
                .map(|p: Point| [x + turn.cos() * p[0] - turn.sin() * p[1], y + turn.sin() * p[0] + turn.cos() * p[1]]);
            let mut q = [0.0; 16];
            for i in 0..4 { for c in 0..2 {
                q[2 * i + c] = SLAVE[i][c] + jitter[2 * i + c];
                q[8 + 2 * i + c] = master[i][c] + jitter[8 + 2 * i + c];
            } }
            check_gradient::<4, 4>(&q)?;
            check_gradient::<3, 4>(&q)?;
            check_gradient::<4, 3>(&q)?;
            check_gradient::<3, 3>(&q)?;
        }
    }

    /// Heights that vary over the facets.
    fn heights() -> [FacetHeight; 2] {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| Vector3::new(x, y, 0.0));
        [0.9, 0.4].map(|step| FacetHeight::new(std::array::from_fn(|i| 0.5 * (step * i as f64).sin()), &corners))
    }

    /// D, M and the integrals of the heights in one array.
    fn all(values: &[f64; 32], heights: &[f64; 16]) -> [f64; 48] {
        std::array::from_fn(|e| if e < 32 { values[e] } else { heights[e - 32] })
    }

    /// The pair of facets with the first S and M of four corners.
    fn check_gradient<const S: usize, const M: usize>(q: &[f64; 16]) -> Result<(), TestCaseError> {
        let rule = CellRule::Seven.points();
        let heights = heights();
        let both = [Some(&heights[0]), Some(&heights[1])];
        let corners = |q: &[f64; 16]| {
            let (s, m) = perturbed(q);
            (*s.first_chunk::<S>().unwrap(), *m.first_chunk::<M>().unwrap())
        };
        let value = |q: &[f64; 16]| {
            let (s, m) = corners(q);
            let mut pair = PairIntegrals::default();
            integrate_pair(&s, &m, both, &rule, false, &mut pair).unwrap();
            all(&pair.values, &pair.heights)
        };
        let (s, m) = corners(q);
        let mut pair = PairIntegrals::default();
        if !integrate_pair(&s, &m, both, &rule, true, &mut pair).unwrap() {
            return Ok(());
        }
        for j in 0..S {
            let d: f64 = (0..S).map(|k| pair.values[4 * j + k]).sum();
            let m: f64 = (0..M).map(|k| pair.values[16 + 4 * j + k]).sum();
            prop_assert!((d - m).abs() < 1e-14);
        }
        // the lines on which each vertex lies, that is, the coordinates on which it depends
        let lines = |q: &[f64; 16]| {
            let (s, m) = corners(q);
            let order = reversed::<M>();
            clip(&s, &order.map(|i| m[i]), &order).map_or_else(Vec::new, |overlap| {
                let of = |v: &Vertex| v.gradient.map(|row| row.map(|g| g != 0.0));
                overlap.vertices().iter().map(of).collect()
            })
        };
        for i in (0..2 * S).chain(8..8 + 2 * M) {
            let moved = |h: f64| {
                let mut q = *q;
                q[i] += h;
                q
            };
            let difference = |h: f64| {
                let (a, b) = (value(&moved(h)), value(&moved(-h)));
                std::array::from_fn::<f64, 48, _>(|e| (a[e] - b[e]) / (2.0 * h))
            };
            // Where the polygon gains or loses a vertex, second derivatives jump; nearby, higher
            // derivatives are large, especially if the edges are almost parallel. Only steps within
            // which the polygon keeps its vertices are used, and one of them must be small enough.
            let keeps = |h: &f64| [-2.0, -1.0, 1.0, 2.0].iter().all(|k| lines(&moved(k * h)) == lines(q));
            let entries =
                (0..S).flat_map(|j| (0..S).map(move |k| 4 * j + k).chain((0..M).map(move |l| 16 + 4 * j + l)));
            let entries: Vec<usize> = entries.chain((0..4 * S).map(|e| 32 + e / S * 4 + e % S)).collect();
            let gradient = all(&pair.gradient.map(|row| row[i]), &pair.heights_gradient.map(|row| row[i]));
            let mut worst = None;
            for step in [1e-4, 1e-5, 1e-6].into_iter().filter(keeps) {
                let (coarse, fine) = (difference(2.0 * step), difference(step));
                let apart = |&e: &usize| ((4.0 * fine[e] - coarse[e]) / 3.0 - gradient[e]).abs();
                let largest = entries.iter().map(apart).fold(0.0, f64::max);
                worst = Some(largest);
                if largest < 2e-6 {
                    break;
                }
            }
            prop_assert!(worst.is_none_or(|w| w < 2e-6), "{S} and {M}, coordinate {i}: {worst:?} apart");
        }
        Ok(())
    }
}
