//! Coulomb's law at a slave node as a return map, with its derivatives.

use crate::ContactStatus;
use nalgebra::{Matrix2, Vector2};

/// Coulomb's law with an upper bound on the shear stress: ‖ζ_τ‖ ≤ min(μ p, τ_max).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Friction {
    /// Coefficient of friction μ ≥ 0.
    pub coefficient: f64,
    /// Largest shear stress τ_max > 0 that friction transmits; infinite if there is no bound.
    /// \[F/L²\]
    pub shear_limit: f64,
}

impl Friction {
    /// Coulomb's law without a bound.
    pub fn coulomb(coefficient: f64) -> Self {
        Self { coefficient, shear_limit: f64::INFINITY }
    }

    /// Whether no tangential traction acts at any pressure.
    pub fn is_frictionless(&self) -> bool {
        self.coefficient == 0.0
    }

    /// The bound on ‖ζ_τ‖ at pressure p ≥ 0.
    pub(crate) fn bound(&self, pressure: f64) -> Bound {
        let coulomb = self.coefficient * pressure;
        if coulomb <= self.shear_limit {
            Bound { value: coulomb, by_pressure: self.coefficient, by_friction: pressure, by_shear_limit: 0.0 }
        } else {
            Bound { value: self.shear_limit, by_pressure: 0.0, by_friction: 0.0, by_shear_limit: 1.0 }
        }
    }
}

/// The largest ‖ζ_τ‖ with its partial derivatives.
pub(crate) struct Bound {
    /// min(μ p, τ_max). \[F/L²\]
    pub value: f64,
    /// Its derivative with respect to p.
    pub by_pressure: f64,
    /// Its derivative with respect to μ. \[F/L²\]
    pub by_friction: f64,
    /// Its derivative with respect to τ_max.
    pub by_shear_limit: f64,
}

/// Tangential traction after the return map, with its partial derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Returned {
    /// Stick or slip (never inactive).
    pub status: ContactStatus,
    /// Tangential components ζ_τ of the multiplier. \[F/L²\]
    pub traction: Vector2<f64>,
    /// ∂ζ_τ/∂trial.
    pub by_trial: Matrix2<f64>,
    /// ∂ζ_τ/∂ζ_n.
    pub by_pressure: Vector2<f64>,
    /// ∂ζ_τ/∂μ. \[F/L²\]
    pub by_friction: Vector2<f64>,
    /// ∂ζ_τ/∂τ_max.
    pub by_shear_limit: Vector2<f64>,
}

/// Return map: a `trial` whose norm is at most b = min(μ p, τ_max) is kept (stick), any other is
/// scaled back to b (slip).
///
/// `pressure` p ≥ 0 and `trial` are in F/L². With s = trial/‖trial‖, the slip branch has
/// `∂ζ_τ/∂trial = (b/‖trial‖)(I − s sᵀ)`. Where Coulomb's cone is the bound, `∂ζ_τ/∂p = μ s` and
/// `∂ζ_τ/∂μ = p s`. s sᵀ is a dyad, although the paper prints squares.
///
/// Paper: (41), (50), linearized (75)–(77), (82)–(84).
/// Test: `return_map_matches_finite_differences`.
pub fn return_map(pressure: f64, trial: Vector2<f64>, friction: Friction) -> Returned {
    let zero = Vector2::zeros();
    let free = Returned {
        status: ContactStatus::Slip,
        traction: zero,
        by_trial: Matrix2::zeros(),
        by_pressure: zero,
        by_friction: zero,
        by_shear_limit: zero,
    };
    if friction.is_frictionless() {
        return free;
    }
    let (bound, size) = (friction.bound(pressure), trial.norm());
    if size <= bound.value {
        return Returned { status: ContactStatus::Stick, traction: trial, by_trial: Matrix2::identity(), ..free };
    }
    let direction = trial / size;
    Returned {
        status: ContactStatus::Slip,
        traction: direction * bound.value,
        by_trial: (Matrix2::identity() - direction * direction.transpose()) * (bound.value / size),
        by_pressure: direction * bound.by_pressure,
        by_friction: direction * bound.by_friction,
        by_shear_limit: direction * bound.by_shear_limit,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In stick, on Coulomb's cone, and at the largest shear stress.
    #[test]
    fn return_map_matches_finite_differences() {
        let coulomb = Friction::coulomb(0.4);
        let limited = Friction { shear_limit: 0.5, ..coulomb };
        for (pressure, trial, law, bound) in [
            (2.0, Vector2::new(0.3, -0.2), coulomb, 0.8),
            (2.0, Vector2::new(1.3, -0.9), coulomb, 0.8),
            (0.1, Vector2::new(-4.0, 3.0), coulomb, 0.04),
            (2.0, Vector2::new(0.3, -0.2), limited, 0.5),
            (2.0, Vector2::new(0.5, -0.4), limited, 0.5),
            (1.0, Vector2::new(1.3, -0.9), limited, 0.4),
        ] {
            let base = return_map(pressure, trial, law);
            assert!(base.traction.norm() <= bound * (1.0 + 1e-15));
            assert_eq!(base.status, if trial.norm() > bound { ContactStatus::Slip } else { ContactStatus::Stick });
            let h = 1e-6;
            let check = |at: &dyn Fn(f64) -> Returned, exact: Vector2<f64>| {
                let difference = (at(h).traction - at(-h).traction) / (2.0 * h);
                assert!((difference - exact).norm() < 1e-9, "{law:?} {trial:?}");
            };
            for c in 0..2 {
                let mut step = Vector2::zeros();
                step[c] = 1.0;
                check(&|h| return_map(pressure, trial + h * step, law), base.by_trial.column(c).into());
            }
            check(&|h| return_map(pressure + h, trial, law), base.by_pressure);
            let turned = |h: f64| Friction { coefficient: law.coefficient + h, ..law };
            check(&|h| return_map(pressure, trial, turned(h)), base.by_friction);
            let raised = |h: f64| Friction { shear_limit: law.shear_limit + h, ..law };
            check(&|h| return_map(pressure, trial, raised(h)), base.by_shear_limit);
        }
    }

    #[test]
    fn without_friction_there_is_no_tangential_traction() {
        for law in [Friction::coulomb(0.0), Friction { coefficient: 0.0, shear_limit: 0.2 }] {
            let returned = return_map(3.0, Vector2::new(1.0, 2.0), law);
            assert_eq!((returned.status, returned.traction), (ContactStatus::Slip, Vector2::zeros()));
        }
    }
}
