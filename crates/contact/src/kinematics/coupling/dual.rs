//! Dual multiplier shapes of a facet, and their mean with the standard ones.

use super::FacetCoupling;
use crate::kinematics::clip::{PLANE_COORDINATES, Point};
use crate::kinematics::plane::Plane;
use nalgebra::{SMatrix, SVector, Vector3};

impl FacetCoupling {
    /// Dual shapes Φ = A N with A = diag(r) m̂⁻¹, m̂ = m + diag(l), r = m̂ 1: m_jk = ∫ N_j N_k over
    /// the covered part of the facet, l_j = ∫ N_j over the rest.
    ///
    /// Then D ← A m and M ← A M. On a covered facet l = 0 and D = diag(r). As the covered part
    /// shrinks, Φ tends to N: without the uncovered part as a lumped mass, the gap on a sliver
    /// would be extrapolated to the facet's far corners. Σ_j Φ_j = 1 in either case. With a `share` s of the dual
    /// shapes below 1, A becomes s A + (1 − s) I.
    ///
    /// Tests: `coupling_gradient_matches_finite_differences`, `the_mean_gap_of_mean_shapes_is_that_at_the_node`.
    pub(super) fn make_dual<const S: usize>(
        &mut self,
        plane: &Plane<S>,
        corners: &[Vector3<f64>; S],
        share: f64,
        with_gradient: bool,
    ) {
        let n = self.nodes.len();
        let whole = corner_integrals(&corners.map(|p| plane.project(&p)));
        let mass = SMatrix::<f64, S, S>::from_fn(|j, k| self.coefficient[j * n + k]);
        let rest: [f64; S] = std::array::from_fn(|j| {
            let rest = whole.value[j] - mass.row(j).sum();
            // negative where masters overlap each other
            if rest > COVERED * whole.value[j] { rest } else { 0.0 }
        });
        let completed = mass + SMatrix::from_diagonal(&SVector::from(rest));
        let Some(inverse) = completed.try_inverse() else { return };
        let sums: [f64; S] = std::array::from_fn(|j| completed.row(j).sum());
        let dual = SMatrix::<f64, S, S>::from_fn(|j, k| sums[j] * inverse[(j, k)]);
        let transform = dual * share + SMatrix::<f64, S, S>::identity() * (1.0 - share);
        let standard: Vec<f64> = self.coefficient.clone();
        for j in 0..S {
            for s in 0..n {
                self.coefficient[j * n + s] = (0..S).map(|i| transform[(j, i)] * standard[i * n + s]).sum();
            }
        }
        let heights = self.height.clone();
        if !heights.is_empty() {
            for (j, c) in (0..S).flat_map(|j| (0..3).map(move |c| (j, c))) {
                self.height[3 * j + c] = (0..S).map(|i| transform[(j, i)] * heights[3 * i + c]).sum();
            }
        }
        let facing = if share < 1.0 { self.facing.clone() } else { Vec::new() };
        if !facing.is_empty() {
            for (j, c) in (0..S).flat_map(|j| (0..3).map(move |c| (j, c))) {
                self.facing[3 * j + c] = (0..S).map(|i| transform[(j, i)] * facing[3 * i + c]).sum();
            }
        }
        if !with_gradient {
            return;
        }
        let columns = 3 * n;
        let mut whole_slope = [[0.0; 12]; S];
        for (row, slope) in whole_slope.iter_mut().zip(&whole.slope) {
            plane.chain(slope, corners, &[], |i, c, value| row[3 * i + c] += value);
        }
        let mut slopes = vec![0.0; S * n];
        for t in 0..columns {
            let slope_of = |j: usize, s: usize| self.gradient[(j * n + s) * columns + t];
            let d_mass = SMatrix::<f64, S, S>::from_fn(slope_of);
            let d_rest: [f64; S] = std::array::from_fn(|j| match rest[j] > 0.0 {
                true => whole_slope[j].get(t).unwrap_or(&0.0) - d_mass.row(j).sum(),
                false => 0.0,
            });
            let d_completed = d_mass + SMatrix::from_diagonal(&SVector::from(d_rest));
            let d_sums: [f64; S] = std::array::from_fn(|j| d_completed.row(j).sum());
            let d_transform = (SMatrix::from_diagonal(&SVector::from(d_sums)) - dual * d_completed) * inverse * share;
            for j in 0..S {
                for s in 0..n {
                    let product =
                        |i: usize| d_transform[(j, i)] * standard[i * n + s] + transform[(j, i)] * slope_of(i, s);
                    slopes[j * n + s] = (0..S).map(product).sum();
                }
            }
            for at in 0..S * n {
                self.gradient[at * columns + t] = slopes[at];
            }
            if !heights.is_empty() {
                let slopes: [f64; 12] = std::array::from_fn(|row| {
                    let (j, c) = (row / 3, row % 3);
                    let by = |i: usize| self.height_gradient[(3 * i + c) * columns + t];
                    let product = |i: usize| d_transform[(j, i)] * heights[3 * i + c] + transform[(j, i)] * by(i);
                    if j < S { (0..S).map(product).sum() } else { 0.0 }
                });
                (0..3 * S).for_each(|row| self.height_gradient[row * columns + t] = slopes[row]);
            }
            if !facing.is_empty() && !self.facing_gradient.is_empty() {
                let slopes: [f64; 12] = std::array::from_fn(|row| {
                    let (j, c) = (row / 3, row % 3);
                    let by = |i: usize| self.facing_gradient[(3 * i + c) * columns + t];
                    let product = |i: usize| d_transform[(j, i)] * facing[3 * i + c] + transform[(j, i)] * by(i);
                    if j < S { (0..S).map(product).sum() } else { 0.0 }
                });
                (0..3 * S).for_each(|row| self.facing_gradient[row * columns + t] = slopes[row]);
            }
        }
    }
}

/// An uncovered fraction of a facet below this is attributed to the error of the triangle rule on a
/// warped facet.
const COVERED: f64 = 1e-9;

/// ∫ N_j over a projected facet and its gradient in the facet's plane coordinates.
struct CornerIntegrals<const N: usize> {
    value: [f64; N],
    slope: [[f64; PLANE_COORDINATES]; N],
}

/// The area element is bilinear as well, J = Σ_i N_i J_i with J_i = ¼
/// (p_{i+1} − p_i) × (p_{i−1} − p_i), so that ∫ N_j = Σ_i m_ji J_i with the mass matrix m of the
/// parent square. On a triangle each integral is a third of the area: for the single corner i,
/// m_ji = 1/3 and J_i is half the cross product.
fn corner_integrals<const N: usize>(p: &[Point; N]) -> CornerIntegrals<N> {
    const PARENT: [f64; 4] = [4.0 / 9.0, 2.0 / 9.0, 1.0 / 9.0, 2.0 / 9.0];
    let mut out = CornerIntegrals { value: [0.0; N], slope: [[0.0; PLANE_COORDINATES]; N] };
    let (products, share) = if N == 3 { (1, 0.5) } else { (N, 0.25) };
    for i in 0..products {
        let (next, previous) = ((i + 1) % N, (i + N - 1) % N);
        let u = [p[next][0] - p[i][0], p[next][1] - p[i][1]];
        let v = [p[previous][0] - p[i][0], p[previous][1] - p[i][1]];
        let element = share * (u[0] * v[1] - u[1] * v[0]);
        let (by_next, by_previous) = ([share * v[1], -share * v[0]], [-share * u[1], share * u[0]]);
        for j in 0..N {
            let mass = if N == 3 { 1.0 / 3.0 } else { PARENT[(i + N - j) % N] };
            out.value[j] += mass * element;
            for c in 0..2 {
                out.slope[j][2 * next + c] += mass * by_next[c];
                out.slope[j][2 * previous + c] += mass * by_previous[c];
                out.slope[j][2 * i + c] -= mass * (by_next[c] + by_previous[c]);
            }
        }
    }
    out
}
