//! Integrals over the overlap of a facet pair in which the pressure depends on the gap at each point.
//!
//! ```text
//! D^p_jk = Σ w A p(g) N¹_j N¹_k,      M^p_jl = Σ w A p(g) N¹_j N²_l
//! g = Σ_l N²_l H_l − Σ_k N¹_k (h_k + o_k) − Σ_m φ_m f_m
//! ```
//!
//! with the heights h and H of the corners of slave and master above the auxiliary plane, the offsets o
//! of the slave's corners, and the functions f of [`super::height`], of which the factors φ make the
//! heights of the true surfaces above the facets. The integrals depend on the geometry through the 16
//! plane coordinates of the pair, the 8 heights and the 4 factors.

use super::cell_rule::CellPoint;
use super::clip::{PLANE_COORDINATES, Point, clip};
use super::facet_pair::{PairHeights, Slopes, centroid, reversed, twice};
use super::inverse_map::{POINTS, Unmappable, map_back};
use crate::enforcement::soft::PressureLaw;

/// Number of heights and factors.
pub(super) const BESIDE: usize = 12;

/// What the gap at a point depends on beside the places of the corners in the auxiliary plane.
pub(super) struct PairGap<'a> {
    /// Heights above the auxiliary plane: of the slave's corners, and from 4 on of the master's. \[L\]
    pub corners: [f64; 8],
    /// Offsets of the slave's corners, by which the surfaces touch before their meshes do. \[L\]
    pub offsets: [f64; 4],
    /// Heights of the true surfaces above the facets.
    pub heights: PairHeights<'a>,
    /// The factors φ of h¹, h² and the products of h² with its slopes.
    pub factors: [f64; 4],
}

/// The integrals of one pair.
pub(super) struct PressedIntegrals {
    /// `values[4 j + k]` = D^p_jk, `values[16 + 4 j + l]` = M^p_jl. \[F\]
    pub values: [f64; 32],
    /// ∂values / ∂(plane coordinates). \[F/L\]
    pub gradient: [[f64; PLANE_COORDINATES]; 32],
    /// ∂values / ∂(heights of the corners, factors).
    pub beside: [[f64; BESIDE]; 32],
}

impl Default for PressedIntegrals {
    fn default() -> Self {
        Self { values: [0.0; 32], gradient: [[0.0; PLANE_COORDINATES]; 32], beside: [[0.0; BESIDE]; 32] }
    }
}

/// A point of an overlap: its weight, the shape functions of both facets and the gap, with slopes in the
/// plane.
struct GapPoint {
    shapes: [[f64; 4]; 2],
    slopes: [[[f64; 2]; 4]; 2],
    gap: f64,
    /// Slopes of the gap through the inverse maps of slave and master.
    gap_slopes: [[f64; 2]; 2],
    /// ∂gap / ∂(heights of the corners, factors).
    beside: [f64; BESIDE],
}

impl GapPoint {
    fn new<const S: usize, const M: usize>(
        gap: &PairGap<'_>,
        shapes: [[f64; 4]; 2],
        slopes: [[[f64; 2]; 4]; 2],
    ) -> Self {
        let mut out = Self { shapes, slopes, gap: 0.0, gap_slopes: [[0.0; 2]; 2], beside: [0.0; BESIDE] };
        for i in 0..4 {
            let (own, other) = (gap.corners[i] + gap.offsets[i], gap.corners[4 + i]);
            out.gap += shapes[1][i] * other - shapes[0][i] * own;
            for c in 0..2 {
                out.gap_slopes[0][c] -= slopes[0][i][c] * own;
                out.gap_slopes[1][c] += slopes[1][i][c] * other;
            }
            (out.beside[i], out.beside[4 + i]) = (-shapes[0][i], shapes[1][i]);
        }
        let mut subtract = |k: usize, (f, by_point): (f64, [f64; 2])| {
            out.gap -= gap.factors[k] * f;
            out.beside[8 + k] = -f;
            (0..2).for_each(|c| out.gap_slopes[usize::from(k > 0)][c] -= gap.factors[k] * by_point[c]);
        };
        if let Some(height) = gap.heights[0] {
            subtract(0, height.at(S, &shapes[0], &slopes[0])[0]);
        }
        if let Some(height) = gap.heights[1] {
            let functions = height.at(M, &shapes[1], &slopes[1]);
            (0..3).for_each(|k| subtract(k + 1, functions[k]));
        }
        out
    }
}

/// The derivatives of the integrals, as they are summed up.
struct Sums {
    values: [f64; 32],
    slopes: [Slopes; 32],
    beside: [[f64; BESIDE]; 32],
}

/// Integrates one pair; arguments and result as in [`super::facet_pair::integrate_pair`].
///
/// # Errors
/// [`Unmappable`] if a point of the overlap has no preimage on one of the facets.
///
/// Test: `pressed_coupling_matches_finite_differences`.
pub(super) fn integrate_pressure<const S: usize, const M: usize>(
    slave: &[Point; S],
    master: &[Point; M],
    gap: &PairGap<'_>,
    law: &PressureLaw,
    (rule, with_gradient): (&[CellPoint], bool),
    out: &mut PressedIntegrals,
) -> Result<bool, Unmappable> {
    let order = reversed::<M>();
    let turned = order.map(|i| master[i]);
    let Some(overlap) = clip(slave, &turned, &order) else { return Ok(false) };
    let vertices = overlap.vertices();
    let count = vertices.len();
    let (centre, centre_slope) = centroid(vertices);
    let mut sums = Sums { values: [0.0; 32], slopes: [Slopes::NONE; 32], beside: [[0.0; BESIDE]; 32] };
    for i in 0..count {
        let cell = [centre, vertices[i].position, vertices[(i + 1) % count].position];
        let (u, v) =
            ([cell[1][0] - cell[0][0], cell[1][1] - cell[0][1]], [cell[2][0] - cell[0][0], cell[2][1] - cell[0][1]]);
        let area = 0.5 * (u[0] * v[1] - u[1] * v[0]);
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
                let (n, n_slope) = on_slave.at(p);
                let (turned_shape, turned_slope) = on_master.at(p);
                let (mut m, mut m_slope) = ([0.0; 4], [[0.0; 2]; 4]);
                for (position, &own) in order.iter().enumerate() {
                    (m[own], m_slope[own]) = (turned_shape[position], turned_slope[position]);
                }
                let at = GapPoint::new::<S, M>(gap, [n, m], [n_slope, m_slope]);
                let (pressure, stiffness) = law.at(at.gap);
                if pressure == 0.0 && stiffness == 0.0 {
                    continue;
                }
                sums.add_point::<S, M>(&at, [pressure, stiffness], (point, area, &area_slope), with_gradient);
            }
        }
        if with_gradient {
            sums.slopes.iter_mut().for_each(|slopes| slopes.end_cell([8, i, (i + 1) % count]));
        }
    }
    (out.values, out.beside) = (sums.values, sums.beside);
    if with_gradient {
        let rows = out.gradient.iter_mut().zip(&sums.slopes);
        rows.for_each(|(row, slopes)| *row = slopes.end(vertices, &centre_slope));
    }
    Ok(true)
}

impl Sums {
    fn add_point<const S: usize, const M: usize>(
        &mut self,
        at: &GapPoint,
        [pressure, stiffness]: [f64; 2],
        (point, area, area_slope): (&CellPoint, f64, &[f64; 8]),
        with_gradient: bool,
    ) {
        let ([n, m], [n_slope, m_slope]) = (at.shapes, at.slopes);
        let weight = point.weight * area;
        let shapes = [twice(&n), twice(&m)];
        let [l0, l1, l2] = point.barycentric;
        let shares = twice(&[l0, l1, l2, 0.0]);
        let weights = area_slope.map(|slope| point.weight * slope);
        let mut add = |entry: usize, product: f64, by_shape: [[f64; 2]; 2]| {
            self.values[entry] += weight * pressure * product;
            if !with_gradient {
                return;
            }
            // through the inverse maps of slave and master: by the shape functions, and by the gap
            let by: [[f64; 2]; 2] = std::array::from_fn(|side| {
                std::array::from_fn(|c| {
                    weight * (pressure * by_shape[side][c] + stiffness * product * at.gap_slopes[side][c])
                })
            });
            let slopes = &mut self.slopes[entry];
            slopes.add_point(pressure * product, &weights, &shares, [by[0][0] + by[1][0], by[0][1] + by[1][1]]);
            (0..2).for_each(|side| slopes.shift(side, &shapes[side], by[side]));
            let by_gap = weight * stiffness * product;
            self.beside[entry].iter_mut().zip(&at.beside).for_each(|(sum, by)| *sum += by_gap * by);
        };
        for j in 0..S {
            for k in 0..S {
                let by_slave = [0, 1].map(|c| n_slope[j][c] * n[k] + n[j] * n_slope[k][c]);
                add(4 * j + k, n[j] * n[k], [by_slave, [0.0; 2]]);
            }
            for l in 0..M {
                let (by_slave, by_master) =
                    ([0, 1].map(|c| n_slope[j][c] * m[l]), [0, 1].map(|c| n[j] * m_slope[l][c]));
                add(16 + 4 * j + l, n[j] * m[l], [by_slave, by_master]);
            }
        }
    }
}
