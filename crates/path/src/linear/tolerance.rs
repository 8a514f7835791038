//! How accurately a system is solved.

use slipstick_linalg::Factorization;

/// Relative residual to which a system is solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveTolerance {
    /// With the factors of a direct solver, of this tangent or an earlier one.
    pub direct: f64,
    /// With the preconditioner of an iterative solver.
    pub iterative: f64,
}

impl From<f64> for SolveTolerance {
    fn from(tolerance: f64) -> Self {
        Self { direct: tolerance, iterative: tolerance }
    }
}

impl SolveTolerance {
    /// The tolerance for these factors.
    pub(super) fn with(self, factors: &dyn Factorization) -> f64 {
        if is_iterative(factors) { self.iterative } else { self.direct }
    }
}

/// Whether factors only precondition an iteration.
pub(super) fn is_iterative(factors: &dyn Factorization) -> bool {
    factors.cost().is_some_and(|cost| cost.solves_per_digit > 0.0)
}
