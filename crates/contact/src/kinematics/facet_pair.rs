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
use super::clip::{Overlap, PLANE_COORDINATES, Point, Vertex, clip};
use super::height::{AtPoint, FacetHeight};
pub use super::inverse_map::Unmappable;
use super::inverse_map::{POINTS, map_back};

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
pub(super) fn centroid(vertices: &[Vertex]) -> (Point, [[[f64; 2]; 2]; 8]) {
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
    integrate(&overlap, slave, master, (heights, rule, with_gradient), out)?;
    Ok(true)
}

/// The derivatives of an integral with respect to four points, or to the three corners of a cell.
pub(super) type Row = [f64; 8];

/// The derivatives of an integral, as it is summed up.
#[derive(Clone, Copy)]
pub(super) struct Slopes {
    /// Through the inverse maps of slave and master.
    by_corner: [Row; 2],
    /// With respect to the corners of a cell.
    by_cell: Row,
    /// With respect to the vertices of the polygon, and its centre.
    by_vertex: [[f64; 2]; 9],
}

impl Slopes {
    pub const NONE: Self = Self { by_corner: [[0.0; 8]; 2], by_cell: [0.0; 8], by_vertex: [[0.0; 2]; 9] };

    /// Adds a point's contribution: through its weight, of which an integrand of `value` has the derivatives
    /// `weights`, and through its position, by which the integrand has the derivative `by_position`.
    #[inline(always)]
    pub fn add_point(&mut self, value: f64, weights: &Row, shares: &Row, by_position: [f64; 2]) {
        for q in 0..8 {
            self.by_cell[q] += weights[q] * value + shares[q] * by_position[q % 2];
        }
    }

    /// Moving a corner p_i by δ shifts the image like moving the point by −N_i δ.
    #[inline(always)]
    pub fn shift(&mut self, side: usize, shape: &Row, by_position: [f64; 2]) {
        for q in 0..8 {
            self.by_corner[side][q] -= shape[q] * by_position[q % 2];
        }
    }

    /// Hands the derivatives with respect to a cell's corners over to the vertices.
    #[inline(always)]
    pub fn end_cell(&mut self, slots: [usize; 3]) {
        for (corner, slot) in slots.into_iter().enumerate() {
            for c in 0..2 {
                self.by_vertex[slot][c] += self.by_cell[2 * corner + c];
            }
        }
        self.by_cell = [0.0; 8];
    }

    /// The derivatives with respect to all plane coordinates.
    #[inline(always)]
    pub fn end(&self, vertices: &[Vertex], centre_slope: &[[[f64; 2]; 2]; 8]) -> [f64; PLANE_COORDINATES] {
        let mut row = [0.0; PLANE_COORDINATES];
        row[..8].copy_from_slice(&self.by_corner[0]);
        row[8..].copy_from_slice(&self.by_corner[1]);
        let by_centre = self.by_vertex[8];
        for (i, vertex) in vertices.iter().enumerate() {
            let through: Point = std::array::from_fn(|d| {
                self.by_vertex[i][d] + by_centre[0] * centre_slope[i][0][d] + by_centre[1] * centre_slope[i][1][d]
            });
            for q in 0..PLANE_COORDINATES {
                row[q] += through[0] * vertex.gradient[0][q] + through[1] * vertex.gradient[1][q];
            }
        }
        row
    }
}

/// Each of four numbers twice.
#[inline(always)]
pub(super) fn twice(shape: &[f64; 4]) -> Row {
    std::array::from_fn(|q| shape[q / 2])
}

/// The sums of [`integrate_pair`]. Compiled for AVX2, they take longer.
fn integrate<const S: usize, const M: usize>(
    overlap: &Overlap,
    slave: &[Point; S],
    master: &[Point; M],
    (heights, rule, with_gradient): (PairHeights<'_>, &[CellPoint], bool),
    out: &mut PairIntegrals,
) -> Result<(), Unmappable> {
    // the master in counter-clockwise order for the inverse map; its results are restored to facet
    // order
    let order = reversed::<M>();
    let turned = order.map(|i| master[i]);
    let vertices = overlap.vertices();
    let count = vertices.len();
    let (centre, centre_slope) = centroid(vertices);
    let curved = heights != [None, None];
    let mut values = [0.0; 32];
    let mut of_heights = [0.0; 16];
    let mut slopes = [Slopes::NONE; 32];
    let mut heights_slopes = [Slopes::NONE; 16];
    for i in 0..count {
        let cell = [centre, vertices[i].position, vertices[(i + 1) % count].position];
        let (u, v) =
            ([cell[1][0] - cell[0][0], cell[1][1] - cell[0][1]], [cell[2][0] - cell[0][0], cell[2][1] - cell[0][1]]);
        let area = 0.5 * (u[0] * v[1] - u[1] * v[0]);
        // ∂A/∂vertex
        let area_slope =
            [0.5 * (u[1] - v[1]), 0.5 * (v[0] - u[0]), 0.5 * v[1], -0.5 * v[0], -0.5 * u[1], 0.5 * u[0], 0.0, 0.0];
        for points in rule.chunks(POINTS) {
            let y: [_; 2] = std::array::from_fn(|c| {
                std::array::from_fn(|p| {
                    let l = points.get(p).unwrap_or(&points[0]).barycentric;
                    l[0] * cell[0][c] + l[1] * cell[1][c] + l[2] * cell[2][c]
                })
            });
            let (on_slave, on_master) = (map_back(slave, &y)?, map_back(&turned, &y)?);
            for (p, point) in points.iter().enumerate() {
                let weight = point.weight * area;
                let (n, n_slope) = on_slave.at(p);
                let (turned_shape, turned_slope) = on_master.at(p);
                let (mut m, mut m_slope) = ([0.0; 4], [[0.0; 2]; 4]);
                for (position, &own) in order.iter().enumerate() {
                    (m[own], m_slope[own]) = (turned_shape[position], turned_slope[position]);
                }
                let shapes = [twice(&n), twice(&m)];
                let [l0, l1, l2] = point.barycentric;
                let shares = twice(&[l0, l1, l2, 0.0]);
                let weights = area_slope.map(|slope| point.weight * slope);
                for j in 0..S {
                    // D is symmetric
                    for k in 0..j + 1 {
                        let d = 4 * j + k;
                        values[d] += weight * n[j] * n[k];
                        if with_gradient {
                            let slope = [0, 1].map(|c| weight * (n_slope[j][c] * n[k] + n[j] * n_slope[k][c]));
                            slopes[d].add_point(n[j] * n[k], &weights, &shares, slope);
                            slopes[d].shift(0, &shapes[0], slope);
                        }
                    }
                    for k in 0..M {
                        let e = 16 + 4 * j + k;
                        values[e] += weight * n[j] * m[k];
                        if with_gradient {
                            // through the slave's and the master's inverse map
                            let by_slave = [0, 1].map(|c| weight * n_slope[j][c] * m[k]);
                            let by_master = [0, 1].map(|c| weight * n[j] * m_slope[k][c]);
                            let slope = [by_slave[0] + by_master[0], by_slave[1] + by_master[1]];
                            slopes[e].add_point(n[j] * m[k], &weights, &shares, slope);
                            slopes[e].shift(0, &shapes[0], by_slave);
                            slopes[e].shift(1, &shapes[1], by_master);
                        }
                    }
                }
                if !curved {
                    continue;
                }
                let mut add = |k: usize, (f, by_point): AtPoint| {
                    let side = usize::from(k > 0);
                    for j in 0..S {
                        let entry = 4 * k + j;
                        of_heights[entry] += weight * n[j] * f;
                        if with_gradient {
                            // through the slave's shape function, and through the function
                            let by_shape = [0, 1].map(|c| weight * n_slope[j][c] * f);
                            let by_function = by_point.map(|slope| weight * n[j] * slope);
                            let slope = [by_shape[0] + by_function[0], by_shape[1] + by_function[1]];
                            heights_slopes[entry].add_point(n[j] * f, &weights, &shares, slope);
                            heights_slopes[entry].shift(0, &shapes[0], by_shape);
                            heights_slopes[entry].shift(side, &shapes[side], by_function);
                        }
                    }
                };
                if let Some(height) = heights[0] {
                    add(0, height.at(S, &n, &n_slope)[0]);
                }
                if let Some(height) = heights[1] {
                    let functions = height.at(M, &m, &m_slope);
                    (0..3).for_each(|k| add(k + 1, functions[k]));
                }
            }
        }
        if with_gradient {
            let slots = [8, i, (i + 1) % count];
            slopes.iter_mut().for_each(|slopes| slopes.end_cell(slots));
            if curved {
                heights_slopes.iter_mut().for_each(|slopes| slopes.end_cell(slots));
            }
        }
    }
    if with_gradient {
        out.gradient.iter_mut().zip(&slopes).for_each(|(row, slopes)| *row = slopes.end(vertices, &centre_slope));
        if curved {
            let rows = out.heights_gradient.iter_mut().zip(&heights_slopes);
            rows.for_each(|(row, slopes)| *row = slopes.end(vertices, &centre_slope));
        }
    }
    for (j, k) in (0..S).flat_map(|j| (j + 1..S).map(move |k| (j, k))) {
        values[4 * j + k] = values[4 * k + j];
        if with_gradient {
            out.gradient[4 * j + k] = out.gradient[4 * k + j];
        }
    }
    (out.values, out.heights) = (values, of_heights);
    Ok(())
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
