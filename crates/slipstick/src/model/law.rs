//! The contact law of one slave node in a step: which traction acts, what its rows of C are, by the method of its pair.

use super::enforcement::UPDATE_STIFFNESS;
use super::node::{self, NodeTraction};
use super::{ContactModel, Method};
use nalgebra::{Matrix3x2, Vector2, Vector3};
use slipstick_contact::enforcement::lagrange::{Complementarity, complementarity};
use slipstick_contact::enforcement::regularised::{Traction, traction};
use slipstick_contact::enforcement::{NodeMeasures, Stiffness, friction_share};
use slipstick_contact::friction::Status;
use slipstick_path::Held;

/// Part of the facet size by which gap and slip are moved off the branch point where a step starts.
const NUDGE: f64 = 1e-9;

/// Derivatives of λᵀF + ηᵀG through the law of one node.
pub(super) struct LawWeights {
    /// By the slip increment ũ_τ.
    pub by_slip: Vector2<f64>,
    /// By the coefficient of friction that acts.
    pub by_friction: f64,
    /// By the logarithm of the stiffness that belongs to the model: of a partly covered node, or the penalty method's.
    pub by_stiffness: f64,
    /// By the tangential history, where the method has one.
    pub by_history: Option<Vector2<f64>>,
}

impl ContactModel {
    /// The measures that decide about branches of the contact law for a node with the given tangential traction.
    ///
    /// Where a step starts, they are ambiguous: a node that slid before lies exactly on the friction cone, a touching one
    /// has no gap, and rounding would choose the branch of Newton's first tangent. They are taken a little inside of
    /// touching and of sliding on, which is what most nodes do, so that the iteration depends on no rounding; in a retry
    /// inside of sticking, which suits a reversal.
    fn deciding_measures(&self, j: usize, tangential: Vector2<f64>) -> NodeMeasures {
        let mut at = self.measures(j);
        if self.starting {
            let nudge = NUDGE * self.slaves[j].size * at.area;
            at.gap -= nudge;
            let size = tangential.norm();
            if size > 0.0 {
                at.slip += tangential * (self.onward * nudge / size);
            }
        }
        at
    }

    /// Coefficient of friction that acts at node j, and its slope in the tributary area of the node's previous row.
    pub(super) fn friction(&self, j: usize) -> (f64, f64) {
        let slave = &self.slaves[j];
        let (share, slope) = friction_share(self.previous_kinematics[j].area, slave.area);
        let friction = self.interfaces[slave.interface as usize].friction;
        (friction * share, friction * slope)
    }

    /// C of node j for multiplier ζ. The augmented Lagrangian needs it where its multipliers are free, in the second-order
    /// update and in the adjoint; its ε, which may be anything, would be a poor c there.
    pub(super) fn complementarity_of(&self, j: usize, zeta: Vector3<f64>) -> Complementarity {
        let at = self.deciding_measures(j, zeta.fixed_rows::<2>(1).into());
        let c = match self.method_of(j) {
            Method::Lagrange if self.rescue.is_some() => self.augmentation(j),
            Method::Augmented => self.own_stiffness(j, UPDATE_STIFFNESS),
            Method::Lagrange | Method::Penalty => self.stiffness[j].times(self.variation),
        };
        complementarity(zeta, &at, self.friction(j).0, &c)
    }

    /// Regularised traction of node j around the multiplier ẑ.
    pub(super) fn regularised_of(&self, j: usize, around: Vector3<f64>) -> Traction {
        let at = self.deciding_measures(j, around.fixed_rows::<2>(1).into());
        traction(around, &at, self.friction(j).0, &self.augmentation(j))
    }

    /// ε of the traction of node j around its multiplier. The Lagrange method has one while a step is rescued.
    pub(super) fn augmentation(&self, j: usize) -> Stiffness {
        match self.method_of(j) {
            Method::Lagrange => self.own_stiffness(j, self.rescue.unwrap_or(UPDATE_STIFFNESS)),
            Method::Penalty | Method::Augmented => self.stiffness[j],
        }
    }

    /// Whether the multiplier of node j is held fixed, for Uzawa's iteration to update it.
    pub(super) fn is_held(&self, j: usize) -> bool {
        match (self.held, self.method_of(j)) {
            (Held::None, _) | (_, Method::Penalty) | (Held::Augmented, Method::Lagrange) => false,
            (Held::Augmented | Held::All, _) => true,
        }
    }

    /// Traction that acts in R at node j, with its dependence on the displacements.
    pub(super) fn acting(&self, y: &[f64], j: usize) -> NodeTraction {
        let around = match self.method_of(j) {
            Method::Penalty => self.previous_traction(j),
            Method::Lagrange | Method::Augmented if self.is_held(j) => self.multiplier(y, j),
            Method::Lagrange | Method::Augmented => {
                let zeta = self.multiplier(y, j);
                return NodeTraction {
                    status: self.complementarity_of(j, zeta).status,
                    value: zeta,
                    by_gap: Vector3::zeros(),
                    by_slip: Matrix3x2::zeros(),
                    by_area: Vector3::zeros(),
                    by_direction: Matrix3x2::zeros(),
                };
            }
        };
        let t = self.regularised_of(j, around);
        NodeTraction {
            status: t.status,
            value: t.value,
            by_gap: t.by_gap,
            by_slip: t.by_slip,
            by_area: t.by_area,
            by_direction: t.by_direction,
        }
    }

    /// Whether node j has a part in the tangent. An open node without multiplier has none: its C = ζ = 0 stays, its force
    /// stays zero, and its adjoint multiplies nothing.
    pub(super) fn contributes(&self, y: &[f64], j: usize) -> bool {
        let acting = self.acting(y, j);
        acting.status != Status::Inactive || acting.value != Vector3::zeros()
    }

    /// Tangential traction of node j at the end of the previous step, of the penalty method.
    pub(super) fn previous_traction(&self, j: usize) -> Vector3<f64> {
        Vector3::new(0.0, self.previous_history[2 * j], self.previous_history[2 * j + 1])
    }

    /// How λᵀF + ηᵀG depends on slip, friction and history of node j, whose state is evaluated.
    pub(super) fn law_weights(&self, j: usize, y: &[f64], lambda: &[f64], eta: &[f64]) -> LawWeights {
        if self.method_of(j).has_multipliers() {
            let at = self.displacement_count() + 3 * j;
            let mu = Vector3::new(lambda[at], lambda[at + 1], lambda[at + 2]);
            let c = self.complementarity_of(j, self.multiplier(y, j));
            let by_slip = c.by_slip.tr_mul(&mu);
            let by_stiffness = c.by_edge_stiffness.dot(&mu);
            return LawWeights { by_slip, by_friction: c.by_friction.dot(&mu), by_stiffness, by_history: None };
        }
        let t = self.regularised_of(j, self.previous_traction(j));
        let mut weight = node::relative_adjoint(&self.kinematics[j], lambda);
        weight[1] += eta[2 * j];
        weight[2] += eta[2 * j + 1];
        let by_history = t.by_multiplier.tr_mul(&weight).fixed_rows::<2>(1).into();
        LawWeights {
            by_slip: t.by_slip.tr_mul(&weight),
            by_friction: t.by_friction.dot(&weight),
            by_stiffness: t.by_stiffness.dot(&weight),
            by_history: Some(by_history),
        }
    }

    /// Whether C of node j is part of F: not for the penalty method, and not while its multiplier is held.
    pub(super) fn has_complementarity(&self, j: usize) -> bool {
        self.method_of(j).has_multipliers() && !self.is_held(j)
    }
}
