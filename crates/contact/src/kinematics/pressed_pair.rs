//! Integrals over the overlap of a facet pair in which the pressure depends on the gap at each point.
//!
//! ```text
//! D^p_jk = Σ w A p(g) N¹_j N̂¹_k,      M^p_jl = Σ w A p(g) N¹_j N̂²_l
//! g = Σ_l N̂²_l H_l − Σ_k N̂¹_k h_k − Σ_j N¹_j o_j − Σ_m φ_m f_m
//! ```
//!
//! with the shape functions N̂ of the facet, or of the whole face of a quadratic element, the heights h and H of the
//! nodes of slave and master above the auxiliary plane, the offsets o of the slave's corners, and the functions f of
//! [`super::height`], of which the factors φ make the heights of the true surfaces above the facets. The integrals
//! depend on the geometry through the 16 plane coordinates of the facets' corners, the heights and the 4 factors.

use super::cell_rule::CellPoint;
use super::clip::{PLANE_COORDINATES, Point, clip};
use super::facet_pair::{PairHeights, Slopes, centroid, reversed, twice};
use super::inverse_map::{POINTS, Unmappable, map_back};
use crate::enforcement::soft::Weight;
use slipstick_mesh::{FaceFunctions, QuadraticFacet};
use std::ops::Range;

/// Largest number of nodes of a face.
pub(super) const FACE: usize = 9;

/// Number of entries for each corner of the slave: the slave's functions, and from [`FACE`] on the master's.
pub(super) const ENTRIES: usize = 2 * FACE;

/// Number of heights and factors.
pub(super) const BESIDE: usize = ENTRIES + 4;

/// What the gap at a point depends on beside the places of the corners in the auxiliary plane.
pub(super) struct PairGap<'a> {
    /// The quadratic faces of slave and master; `None`: linear facets.
    pub faces: [Option<&'a QuadraticFacet>; 2],
    /// Heights above the auxiliary plane: of the slave's nodes, and from [`FACE`] on of the master's. \[L\]
    pub nodes: [f64; ENTRIES],
    /// Offsets of the slave's corners, by which the surfaces touch before their meshes do. \[L\]
    pub offsets: [f64; 4],
    /// Heights of the true surfaces above the facets.
    pub heights: PairHeights<'a>,
    /// The factors φ of h¹, h² and the products of h² with its slopes.
    pub factors: [f64; 4],
}

/// The integrals of one pair.
pub(super) struct PressedIntegrals {
    /// `values[j][k]` = D^p_jk, `values[j][FACE + l]` = M^p_jl. \[F\]
    pub values: [[f64; ENTRIES]; 4],
    /// ∂values / ∂(plane coordinates). \[F/L\]
    pub gradient: [[[f64; PLANE_COORDINATES]; ENTRIES]; 4],
    /// ∂values / ∂(heights of the nodes, factors).
    pub beside: [[[f64; BESIDE]; ENTRIES]; 4],
}

impl Default for PressedIntegrals {
    fn default() -> Self {
        Self {
            values: [[0.0; ENTRIES]; 4],
            gradient: [[[0.0; PLANE_COORDINATES]; ENTRIES]; 4],
            beside: [[[0.0; BESIDE]; ENTRIES]; 4],
        }
    }
}

/// The functions of a facet, in the order of the nodes of its face, with slopes in the plane.
pub(super) fn functions(face: Option<&QuadraticFacet>, shape: &[f64; 4], slope: &[[f64; 2]; 4]) -> FaceFunctions {
    face.map_or_else(
        || {
            let mut out = ([0.0; FACE], [[0.0; 2]; FACE]);
            out.0[..4].copy_from_slice(shape);
            out.1[..4].copy_from_slice(slope);
            out
        },
        |face| face.at(shape, slope),
    )
}

/// A point of an overlap: the shape functions of both facets, the functions of their faces and the gap, with slopes
/// in the plane.
struct GapPoint {
    shapes: [[f64; 4]; 2],
    /// Slopes of the slave's shape functions.
    slopes: [[f64; 2]; 4],
    functions: [FaceFunctions; 2],
    gap: f64,
    /// Slopes of the gap through the inverse maps of slave and master.
    gap_slopes: [[f64; 2]; 2],
    /// ∂gap / ∂(heights of the nodes, factors).
    beside: [f64; BESIDE],
}

impl GapPoint {
    fn new<const S: usize, const M: usize>(
        gap: &PairGap<'_>,
        shapes: [[f64; 4]; 2],
        slopes: [[[f64; 2]; 4]; 2],
    ) -> Self {
        let functions = [0, 1].map(|side| functions(gap.faces[side], &shapes[side], &slopes[side]));
        let mut out =
            Self { shapes, slopes: slopes[0], functions, gap: 0.0, gap_slopes: [[0.0; 2]; 2], beside: [0.0; BESIDE] };
        for i in 0..4 {
            out.gap -= shapes[0][i] * gap.offsets[i];
            (0..2).for_each(|c| out.gap_slopes[0][c] -= slopes[0][i][c] * gap.offsets[i]);
        }
        for (side, sign) in [-1.0, 1.0].into_iter().enumerate() {
            let (value, slope) = &functions[side];
            for i in 0..FACE {
                let (at, height) = (side * FACE + i, sign * gap.nodes[side * FACE + i]);
                out.gap += value[i] * height;
                out.beside[at] = sign * value[i];
                (0..2).for_each(|c| out.gap_slopes[side][c] += slope[i][c] * height);
            }
        }
        let mut subtract = |k: usize, (f, by_point): (f64, [f64; 2])| {
            out.gap -= gap.factors[k] * f;
            out.beside[ENTRIES + k] = -f;
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
    values: [[f64; ENTRIES]; 4],
    slopes: [[Slopes; ENTRIES]; 4],
    beside: [[[f64; BESIDE]; ENTRIES]; 4],
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
    weight: Weight<'_>,
    (rule, with_gradient): (&[CellPoint], bool),
    out: &mut PressedIntegrals,
) -> Result<bool, Unmappable> {
    let order = reversed::<M>();
    let turned = order.map(|i| master[i]);
    let Some(overlap) = clip(slave, &turned, &order) else { return Ok(false) };
    let vertices = overlap.vertices();
    let count = vertices.len();
    let (centre, centre_slope) = centroid(vertices);
    let mut sums = Sums {
        values: [[0.0; ENTRIES]; 4],
        slopes: [[Slopes::NONE; ENTRIES]; 4],
        beside: [[[0.0; BESIDE]; ENTRIES]; 4],
    };
    let count_of = |side: usize, corners: usize| gap.faces[side].map_or(corners, |face| face.nodes.len());
    let entries = [0..count_of(0, S), FACE..FACE + count_of(1, M)];
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
                let (pressure, stiffness) = weight.at(at.gap);
                if pressure == 0.0 && stiffness == 0.0 {
                    continue;
                }
                sums.add_point::<S>(&at, &entries, [pressure, stiffness], (point, area, &area_slope), with_gradient);
            }
        }
        if with_gradient {
            for slopes in &mut sums.slopes[..S] {
                entries.iter().cloned().flatten().for_each(|entry| slopes[entry].end_cell([8, i, (i + 1) % count]));
            }
        }
    }
    (out.values, out.beside) = (sums.values, sums.beside);
    if with_gradient {
        for (rows, slopes) in out.gradient.iter_mut().zip(&sums.slopes).take(S) {
            let all = entries.iter().cloned().flatten();
            all.for_each(|entry| rows[entry] = slopes[entry].end(vertices, &centre_slope));
        }
    }
    Ok(true)
}

impl Sums {
    fn add_point<const S: usize>(
        &mut self,
        at: &GapPoint,
        entries: &[Range<usize>; 2],
        [pressure, stiffness]: [f64; 2],
        (point, area, area_slope): (&CellPoint, f64, &[f64; 8]),
        with_gradient: bool,
    ) {
        let weight = point.weight * area;
        let shapes = [twice(&at.shapes[0]), twice(&at.shapes[1])];
        let [l0, l1, l2] = point.barycentric;
        let shares = twice(&[l0, l1, l2, 0.0]);
        let weights = area_slope.map(|slope| point.weight * slope);
        for (j, side) in (0..S).flat_map(|j| [(j, 0), (j, 1)]) {
            let (n, n_slope) = (at.shapes[0][j], at.slopes[j]);
            for entry in entries[side].clone() {
                let (f, f_slope) =
                    (at.functions[side].0[entry - FACE * side], at.functions[side].1[entry - FACE * side]);
                let product = n * f;
                self.values[j][entry] += weight * pressure * product;
                if !with_gradient {
                    continue;
                }
                // through the inverse maps of slave and master: by the shape functions, and by the gap
                let mut by = at.gap_slopes.map(|slope| slope.map(|slope| stiffness * product * slope));
                for c in 0..2 {
                    by[0][c] += pressure * n_slope[c] * f;
                    by[side][c] += pressure * n * f_slope[c];
                }
                let by = by.map(|by| by.map(|by| weight * by));
                let slopes = &mut self.slopes[j][entry];
                slopes.add_point(pressure * product, &weights, &shares, [by[0][0] + by[1][0], by[0][1] + by[1][1]]);
                (0..2).for_each(|side| slopes.shift(side, &shapes[side], by[side]));
                let by_gap = weight * stiffness * product;
                self.beside[j][entry].iter_mut().zip(&at.beside).for_each(|(sum, by)| *sum += by_gap * by);
            }
        }
    }
}
