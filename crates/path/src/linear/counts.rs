//! What linear solves have cost.

/// Counts of factorizations and solves since the system was created.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SolveCounts {
    /// Factorizations.
    pub factorizations: usize,
    /// Solves with the factors of an earlier tangent.
    pub lagged: usize,
    /// Iterations of these solves.
    pub lagged_iterations: usize,
    /// Attempts with earlier factors that were abandoned.
    pub given_up: usize,
    /// Systems that the iterative solver did not solve, so that direct solvers took over.
    pub fallbacks: usize,
    /// Maximum memory of factors on this rank. \[bytes\]
    pub factor_bytes: usize,
    /// Floating-point operations of this rank for factors; zero if the solver does not count them.
    pub operations: f64,
}

impl SolveCounts {
    /// Adds those of another system.
    pub(super) fn add(&mut self, other: Self) {
        let Self { factorizations, lagged, lagged_iterations, given_up, fallbacks, factor_bytes, operations } = other;
        self.factorizations += factorizations;
        self.lagged += lagged;
        self.lagged_iterations += lagged_iterations;
        self.given_up += given_up;
        self.fallbacks += fallbacks;
        self.factor_bytes = self.factor_bytes.max(factor_bytes);
        self.operations += operations;
    }
}
