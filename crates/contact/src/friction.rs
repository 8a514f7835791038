//! Coulomb's law at a slave node as a return map, with its derivatives.

use nalgebra::{Matrix2, Vector2};

/// State of a slave node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub enum Status {
    /// Open: no traction.
    #[default]
    Inactive,
    /// In contact, tangential traction inside the friction cone.
    Stick,
    /// In contact, tangential traction on the friction cone.
    Slip,
}

/// Tangential traction after the return map, with its partial derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Returned {
    /// Stick or slip (never inactive).
    pub status: Status,
    /// Tangential components ζ_τ of the multiplier. \[F/L²\]
    pub traction: Vector2<f64>,
    /// ∂ζ_τ/∂trial.
    pub by_trial: Matrix2<f64>,
    /// ∂ζ_τ/∂ζ_n.
    pub by_pressure: Vector2<f64>,
    /// ∂ζ_τ/∂μ. \[F/L²\]
    pub by_friction: Vector2<f64>,
}

/// Coulomb return map: a `trial` inside the cone `‖·‖ ≤ μ p` is kept (stick), one outside is scaled
/// back (slip).
///
/// `pressure` p ≥ 0 and `trial` in F/L². With s = trial/‖trial‖ the slip branch has
/// `∂ζ_τ/∂trial = (μ p/‖trial‖)(I − s sᵀ)`, `∂ζ_τ/∂p = μ s` and `∂ζ_τ/∂μ = p s`; s sᵀ is a dyad,
/// although the paper prints squares.
///
/// Paper: (41), (50), linearised (75)–(77), (82)–(84).
/// Test: `return_map_matches_finite_differences`.
pub fn return_map(pressure: f64, trial: Vector2<f64>, friction: f64) -> Returned {
    if friction == 0.0 {
        return Returned {
            status: Status::Slip,
            traction: Vector2::zeros(),
            by_trial: Matrix2::zeros(),
            by_pressure: Vector2::zeros(),
            by_friction: Vector2::zeros(),
        };
    }
    let (limit, size) = (friction * pressure, trial.norm());
    if size <= limit {
        return Returned {
            status: Status::Stick,
            traction: trial,
            by_trial: Matrix2::identity(),
            by_pressure: Vector2::zeros(),
            by_friction: Vector2::zeros(),
        };
    }
    let direction = trial / size;
    Returned {
        status: Status::Slip,
        traction: direction * limit,
        by_trial: (Matrix2::identity() - direction * direction.transpose()) * (limit / size),
        by_pressure: direction * friction,
        by_friction: direction * pressure,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn return_map_matches_finite_differences() {
        for (pressure, trial) in
            [(2.0, Vector2::new(0.3, -0.2)), (2.0, Vector2::new(1.3, -0.9)), (0.1, Vector2::new(-4.0, 3.0))]
        {
            let base = return_map(pressure, trial, 0.4);
            assert!(base.traction.norm() <= 0.4 * pressure * (1.0 + 1e-15));
            let h = 1e-6;
            for c in 0..2 {
                let mut step = Vector2::zeros();
                step[c] = h;
                let fd = (return_map(pressure, trial + step, 0.4).traction
                    - return_map(pressure, trial - step, 0.4).traction)
                    / (2.0 * h);
                assert!((fd - base.by_trial.column(c)).norm() < 1e-9);
            }
            let fd = (return_map(pressure + h, trial, 0.4).traction - return_map(pressure - h, trial, 0.4).traction)
                / (2.0 * h);
            assert!((fd - base.by_pressure).norm() < 1e-9);
            let at = |friction: f64| return_map(pressure, trial, friction).traction;
            assert!(((at(0.4 + h) - at(0.4 - h)) / (2.0 * h) - base.by_friction).norm() < 1e-9);
        }
    }

    #[test]
    fn without_friction_there_is_no_tangential_traction() {
        let returned = return_map(3.0, Vector2::new(1.0, 2.0), 0.0);
        assert_eq!((returned.status, returned.traction), (Status::Slip, Vector2::zeros()));
    }
}
