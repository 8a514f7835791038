//! The slip increment of a slave node over a load step, with its derivatives.
//!
//! ```text
//! c = (1 − m) (w − Σ_s b_js,n−1 x_s)  −  m (w − R Σ_s b_js x_s,n−1),        ũ_a = −τ_a · c
//! ```
//!
//! The first part is the paper's: how far the material points have moved apart that lay opposite to
//! each other before the step. It needs the row of the state before. The second part measures the
//! same from the other end, and needs only the current row: how far those points were apart before
//! that now lie opposite to each other. R turns the node's material frame before the step into the
//! current one. Both parts are proportional to the same relative motion of the surfaces; m is 0 where
//! the master covered the node before the step, and 1 where it did not ([`missing_share`]).

use super::rows::{NodeKinematics, position};
use nalgebra::{Matrix3, Vector2, Vector3};

/// What the slip increment of a node needs of the state before the step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PreviousRow {
    /// Global node numbers.
    pub support: Vec<u32>,
    /// b_js before the step. \[L²\]
    pub coefficient: Vec<f64>,
    /// m, the part of the slip that the current row measures, and its derivative with respect to
    /// the row's tributary area. \[–, 1/L²\]
    pub missing: (f64, f64),
    /// The node's material frame: that of the slave's own facets.
    pub basis: Matrix3<f64>,
}

impl PreviousRow {
    /// That of a node with this area in the reference configuration.
    pub fn of(now: &NodeKinematics, reference_area: f64) -> Self {
        Self {
            support: now.support.clone(),
            coefficient: now.coefficient.clone(),
            missing: missing_share(now.area, reference_area),
            basis: now.material_frame().basis,
        }
    }
}

/// Fraction of the reference area that must have been covered before the step for the previous row
/// alone to measure the slip.
const EDGE: f64 = 0.05;

/// The part m of a node's slip that the current row measures, and its derivative with respect to the
/// tributary area of the node's row before the step. \[–, 1/L²\]
///
/// The slip that the previous row measures is proportional to its area. For a node that the other
/// surface did not cover, it vanishes for every motion: the node would have no friction, and stick
/// would impose no condition. m falls continuously from 1 there to 0 at 1/20 of the reference area:
/// (1 − A/(χ A_ref))².
///
/// Test: `missing_share_matches_finite_differences`.
pub fn missing_share(previous_area: f64, reference_area: f64) -> (f64, f64) {
    let limit = EDGE * reference_area;
    if previous_area >= limit {
        return (0.0, 0.0);
    }
    let missing = (1.0 - previous_area / limit).min(1.0);
    (missing * missing, -2.0 * missing / limit)
}

/// Slip increment of a node over the step and its gradient.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SlipIncrement {
    /// ũ_τ in the node's tangent basis. \[L³\]
    pub value: Vector2<f64>,
    /// `gradient[a * 3 |support| + t]` = ∂ũ_a/∂x_t over the current support. \[L²\]
    pub gradient: Vec<f64>,
    /// `previous_gradient[a * 3 |previous support| + t]`: the part of ∂ũ_a/∂x_t over the previous
    /// row's support, to be added to the former. \[L²\]
    pub previous_gradient: Vec<f64>,
}

/// Both parts of c.
struct Parts {
    /// w − Σ_s b_js,n−1 x_s. \[L³\]
    ahead: Vector3<f64>,
    /// Σ_s b_js x_s,n−1; zero if m is. \[L³\]
    apart: Vector3<f64>,
    /// R.
    turn: Matrix3<f64>,
    /// w − R Σ_s b_js x_s,n−1; zero if m is. \[L³\]
    back: Vector3<f64>,
}

impl NodeKinematics {
    /// The frame of the slave's own facets, a material frame.
    pub fn material_frame(&self) -> &super::frame::NodalFrame {
        self.own_frame.as_ref().unwrap_or(&self.frame)
    }

    fn parts(&self, previous: &PreviousRow, x: &[f64], x_before: &[f64]) -> Parts {
        // rows sum to zero only up to round-off; the node's own position absorbs the remainder
        let sum = |support: &[u32], coefficient: &[f64], x: &[f64]| {
            let own = position(x, self.node);
            let arms = support.iter().zip(coefficient).map(|(&node, b)| (position(x, node) - own) * *b);
            arms.fold(Vector3::zeros(), |sum, arm| sum + arm)
        };
        let ahead = self.relative - sum(&previous.support, &previous.coefficient, x);
        if previous.missing.0 == 0.0 {
            return Parts { ahead, apart: Vector3::zeros(), turn: Matrix3::identity(), back: Vector3::zeros() };
        }
        let apart = sum(&self.support, &self.coefficient, x_before);
        let turn = self.material_frame().basis.tr_mul(&previous.basis);
        Parts { ahead, apart, turn, back: self.relative - turn * apart }
    }

    /// Objective nodal slip increment ũ_τ over the step, in the node's tangent basis. \[L³\], 2
    /// components. `x` are the current positions, `x_before` those before the step.
    ///
    /// Positive along the slave's sliding; zero along tangents normal to a symmetry plane, where
    /// the other half cancels it.
    /// Paper: (24) with the full row of D, where the node was covered before the step;
    /// previous-step linearization (66) in [`Self::add_previous_slip_gradient`]. Tests:
    /// `gap_and_slip_gradients`, `slip_increment_is_objective`,
    /// `slip_of_a_node_that_becomes_covered_is_that_of_the_bodies`.
    pub fn slip(
        &self,
        previous: &PreviousRow,
        x: &[f64],
        x_before: &[f64],
        with_gradient: bool,
        out: &mut SlipIncrement,
    ) {
        let (missing, parts) = (previous.missing.0, self.parts(previous, x, x_before));
        let change = if missing == 0.0 { parts.ahead } else { parts.ahead * (1.0 - missing) - parts.back * missing };
        let across = self.frame.across;
        let along = |a: usize| if across[a] { 0.0 } else { -self.frame.vector(1 + a).dot(&change) };
        out.value = Vector2::new(along(0), along(1));
        out.gradient.clear();
        out.previous_gradient.clear();
        if !with_gradient {
            return;
        }
        let mut row = Vec::new();
        for a in 0..2 {
            self.project_gradient(1 + a, 1.0 - 2.0 * missing, &change, &mut row);
            let mut tangent = self.frame.vector(1 + a);
            if across[a] {
                row.fill(0.0);
                tangent = Vector3::zeros();
            }
            if missing != 0.0 {
                self.add_back_gradient(&parts, previous, x_before, &(tangent * -missing), &mut row);
            }
            out.gradient.extend_from_slice(&row);
            for b in &previous.coefficient {
                out.previous_gradient.extend(tangent.iter().map(|c| c * b * (1.0 - missing)));
            }
        }
    }

    /// Adds `weight` · ∂(R Σ_s b_js x_s,n−1)/∂x_t over the current support.
    fn add_back_gradient(
        &self,
        parts: &Parts,
        previous: &PreviousRow,
        x_before: &[f64],
        weight: &Vector3<f64>,
        row: &mut [f64],
    ) {
        let (columns, own) = (row.len(), position(x_before, self.node));
        let turned = parts.turn.tr_mul(weight);
        for (s, &node) in self.support.iter().enumerate() {
            let factor = turned.dot(&(position(x_before, node) - own));
            let slope = &self.gradient[s * columns..][..columns];
            row.iter_mut().zip(slope).for_each(|(to, slope)| *to += factor * slope);
        }
        let (frame, components) = (self.material_frame(), previous.basis * parts.apart);
        for (t, to) in row.iter_mut().enumerate().take(frame.columns()) {
            for b in 0..3 {
                let along: f64 = (0..3).map(|c| weight[c] * frame.slope(b, c, t)).sum();
                *to += along * components[b];
            }
        }
    }

    /// ∂ũ_a/∂d_{n−1} for the weights `a_ξ`, `a_η` of the two components, added to `out` (3 per node
    /// of the mesh).
    ///
    /// `before` is the kinematics **before** the step, with gradients, and `previous` what
    /// [`slip`](Self::slip) has used of it; `x` are the current positions, `x_before` those before.
    /// Where m = 0, `∂ũ_a = τ_a · Σ_s ∂b_js,n−1 x_s`. Paper: (66) with full rows.
    /// Test: `gap_and_slip_gradients`.
    pub fn add_previous_slip_gradient(
        &self,
        before: &Self,
        previous: &PreviousRow,
        [x, x_before]: [&[f64]; 2],
        weight: Vector2<f64>,
        out: &mut [f64],
    ) {
        let along = |a: usize| if self.frame.across[a] { 0.0 } else { weight[a] };
        let direction = self.frame.vector(1) * along(0) + self.frame.vector(2) * along(1);
        let (missing, slope) = previous.missing;
        let columns = 3 * before.support.len();
        let own = position(x, before.node);
        for (s, &node) in before.support.iter().enumerate() {
            let factor = (1.0 - missing) * direction.dot(&(position(x, node) - own));
            let slope = &before.gradient[s * columns..][..columns];
            for (t, &target) in before.support.iter().enumerate() {
                for c in 0..3 {
                    out[3 * target as usize + c] += factor * slope[3 * t + c];
                }
            }
        }
        if missing == 0.0 {
            return;
        }
        let parts = self.parts(previous, x, x_before);
        before.add_area_gradient(slope * direction.dot(&(parts.ahead + parts.back)), out);
        let turned = parts.turn.tr_mul(&direction) * -missing;
        for (&node, b) in self.support.iter().zip(&self.coefficient) {
            (0..3).for_each(|c| out[3 * node as usize + c] += b * turned[c]);
        }
        let (frame, components) = (before.material_frame(), self.material_frame().basis * direction * -missing);
        for t in 0..frame.columns() {
            let target = &mut out[3 * before.support[t / 3] as usize + t % 3];
            for b in 0..3 {
                let along: f64 = (0..3).map(|c| frame.slope(b, c, t) * parts.apart[c]).sum();
                *target += components[b] * along;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Continuously differentiable, 1 without an area, 0 from a twentieth on; computed by hand: ¼ in
    /// the middle.
    #[test]
    fn missing_share_matches_finite_differences() {
        let share = |area: f64| missing_share(area, 2.0).0;
        for area in [1e-3, 0.01, 0.05, 0.0999, 0.1, 0.1001, 1.0] {
            let h = 1e-7 * area;
            let expected = (share(area + h) - share(area - h)) / (2.0 * h);
            assert!((missing_share(area, 2.0).1 - expected).abs() < 1e-5, "{area}");
        }
        assert_eq!((share(0.0), share(0.05), share(0.1)), (1.0, 0.25, 0.0));
    }
}
