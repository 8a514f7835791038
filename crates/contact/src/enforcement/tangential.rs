//! The tangential traction around a multiplier, with Coulomb's return map and prescribed slip.
//!
//! ```text
//! ζ_τ = return map of P (ẑ_τ + k ũ_τ)                 P = I − a aᵀ if slip along a is prescribed as zero, otherwise I
//! ζ_τ = b ũ_τ/‖ũ_τ‖,  b = min(μ p, τ_max)             if a prescribed slip is not zero
//! ```

use super::{Freedom, NodeMeasures};
use crate::ContactStatus;
use crate::friction::{Friction, return_map};
use nalgebra::{Matrix2, Vector2};

/// ζ_τ and its partial derivatives.
pub(super) struct Tangential {
    /// Stick or slip.
    pub status: ContactStatus,
    /// ζ_τ. \[F/L²\]
    pub traction: Vector2<f64>,
    /// ∂ζ_τ/∂p.
    pub by_pressure: Vector2<f64>,
    /// ∂ζ_τ/∂μ.
    pub by_friction: Vector2<f64>,
    /// ∂ζ_τ/∂τ_max.
    pub by_shear_limit: Vector2<f64>,
    /// ∂ζ_τ/∂ẑ_τ.
    pub by_multiplier: Matrix2<f64>,
    /// ∂ζ_τ/∂ũ_τ.
    pub by_slip: Matrix2<f64>,
    /// ∂ζ_τ/∂k.
    pub by_stiffness: Vector2<f64>,
    /// ∂ζ_τ/∂a; zero except for [`Freedom::SlipAcross`].
    pub by_direction: Matrix2<f64>,
}

/// The tangential traction around the multiplier ẑ_τ at pressure p ≥ 0, with stiffness k per slip
/// increment.
pub(super) fn tangential(
    pressure: f64,
    around: Vector2<f64>,
    at: &NodeMeasures,
    friction: Friction,
    stiffness: f64,
) -> Tangential {
    let driven = matches!(at.freedom, Freedom::SlipAcross { driven: true, .. } | Freedom::Gap { driven: true });
    let size = at.slip.norm();
    if driven && !friction.is_frictionless() && size > 0.0 {
        // it slips along ũ, regardless of the multiplier
        let direction = at.slip / size;
        let bound = friction.bound(pressure);
        return Tangential {
            status: ContactStatus::Slip,
            traction: direction * bound.value,
            by_pressure: direction * bound.by_pressure,
            by_friction: direction * bound.by_friction,
            by_shear_limit: direction * bound.by_shear_limit,
            by_multiplier: Matrix2::zeros(),
            by_slip: (Matrix2::identity() - direction * direction.transpose()) * (bound.value / size),
            by_stiffness: Vector2::zeros(),
            by_direction: Matrix2::zeros(),
        };
    }
    let trial = around + at.slip * stiffness;
    let projector = match at.freedom {
        Freedom::Full => Matrix2::identity(),
        Freedom::SlipAcross { direction, .. } => Matrix2::identity() - direction * direction.transpose(),
        Freedom::Gap { .. } | Freedom::None => Matrix2::zeros(),
    };
    let returned = return_map(pressure, projector * trial, friction);
    let by_trial = returned.by_trial * projector;
    let by_direction = match at.freedom {
        // δ(P t) = −(δa (a·t) + a (δa·t))
        Freedom::SlipAcross { direction, .. } => {
            -returned.by_trial * (Matrix2::identity() * direction.dot(&trial) + direction * trial.transpose())
        }
        _ => Matrix2::zeros(),
    };
    Tangential {
        status: returned.status,
        traction: returned.traction,
        by_pressure: returned.by_pressure,
        by_friction: returned.by_friction,
        by_shear_limit: returned.by_shear_limit,
        by_multiplier: by_trial,
        by_slip: by_trial * stiffness,
        by_stiffness: by_trial * at.slip,
        by_direction,
    }
}
