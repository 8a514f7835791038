//! Limits and outcomes of verified solves.

use thiserror::Error;

/// Number of iterations before the convergence is predicted, and how much faster than so far the
/// residual is expected to fall later: GMRES becomes faster once it has found the few directions in
/// which the factors are wrong.
const LEAST_SEEN: usize = 3;

const HOPE: f64 = 2.0;

/// Outcome of a verified solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveReport {
    /// ‖b − A x‖₂ / ‖b‖₂ of the returned solution, computed with the matrix in double precision.
    pub relative_residual: f64,
    /// ‖b − A x‖∞ / (‖A‖∞ ‖x‖∞ + ‖b‖∞): the relative change of A and b for which x is exact.
    pub backward_error: f64,
    /// ‖b − A x‖₂ / ‖b‖₂ of the start: 1 if none is given.
    pub initial_residual: f64,
    /// Solves with the factors after the first one, or all of them if a start is given.
    pub iterations: usize,
}

impl SolveReport {
    /// All solves with the factors.
    pub fn solves(&self) -> usize {
        self.iterations + usize::from(self.initial_residual == 1.0)
    }
}

/// Limits of a verified solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveOptions {
    /// Relative residual ‖b − A x‖₂ / ‖b‖₂ to reach.
    pub tolerance: f64,
    /// Maximum number of solves with the factors after the first one.
    pub max_iterations: usize,
    /// Iterations before a restart. Each keeps two vectors for every right-hand side.
    pub restart: usize,
    /// Stops as soon as the rest is expected to take more iterations than this way.
    pub alternative: Option<Alternative>,
}

/// What another way to the solution costs, such as new factors, in iterations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alternative {
    /// Before it starts.
    pub preparation: f64,
    /// For each decimal digit of the residual.
    pub per_digit: f64,
}

impl Alternative {
    /// For this number of decimal digits.
    pub fn cost(&self, digits: f64) -> f64 {
        self.preparation + self.per_digit * digits
    }

    /// Whether it costs less than to go on, after `taken` iterations since the residual was `start`.
    pub(super) fn beats(&self, taken: usize, [start, now, wanted]: [f64; 3]) -> bool {
        let (found, left) = ((start / now).log10().max(0.0), (now / wanted).log10());
        taken >= LEAST_SEEN && left * taken as f64 > HOPE * found * self.cost(left)
    }
}

impl SolveOptions {
    /// The given tolerance, at most 100 iterations, a restart after 50, without an alternative.
    pub fn new(tolerance: f64) -> Self {
        Self { tolerance, max_iterations: 100, restart: 50, alternative: None }
    }
}

/// Why a verified solve failed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SolveError {
    /// Lengths do not match. With several ranks, they refer to the unknowns of this rank.
    #[error(
        "the matrix has {n} unknowns, but the factors, right-hand side and solution have \
         {factors}, {rhs} and {solution}"
    )]
    Dimension {
        /// Unknowns of the matrix.
        n: usize,
        /// Unknowns of the factorization.
        factors: usize,
        /// Length of the right-hand side.
        rhs: usize,
        /// Length of the solution.
        solution: usize,
    },
    /// The right-hand side has an entry that is NaN or infinite.
    #[error(
        "{} of the right-hand side is not finite; check the loads and the residual",
        .index.map_or("an entry".into(), |index| format!("entry {index}"))
    )]
    NonFiniteRightHandSide {
        /// The first such entry, on a single rank.
        index: Option<usize>,
    },
    /// The factors or the matrix produced a number that is not finite.
    #[error("the solve produced a number that is not finite; the matrix or its factors are unusable")]
    NonFinite,
    /// The residual stayed above the tolerance.
    #[error(
        "the linear solve stopped at a relative residual of {:e} after {} iterations, above the \
         tolerance {tolerance:e}; factorize the current matrix, in double precision if it was single",
        .report.relative_residual, .report.iterations
    )]
    NotConverged {
        /// The result reached; the solution vector holds the best iterate.
        report: SolveReport,
        /// The required tolerance.
        tolerance: f64,
    },
}
#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: after four iterations that found two of seven digits, five digits are left. At twice
    /// that pace they take five iterations, less than an alternative with a preparation of 6 or with
    /// 1.1 per digit, but not of 4 or with 0.9. Nothing is decided before the third iteration, and
    /// without any progress every alternative is better.
    #[test]
    fn an_alternative_is_compared_with_what_is_left() {
        let course = [1.0, 1e-2, 1e-7];
        let beats = |preparation, per_digit| Alternative { preparation, per_digit }.beats(4, course);
        assert!(!beats(6.0, 0.0) && !beats(0.0, 1.1) && beats(4.0, 0.0) && beats(0.0, 0.9));
        let costly = Alternative { preparation: 1e3, per_digit: 0.0 };
        assert!(!costly.beats(2, [1.0, 1.0, 1e-7]) && costly.beats(3, [1.0, 1.0, 1e-7]));
    }
}
