//! Reduced linear systems of Newton's method and of the adjoint, every solve verified by its residual.
//!
//! Factors serve more than once: while the active set is the same, the factors of an earlier tangent precondition GMRES
//! on the present one, as long as that is foreseen to cost less than new factors. The decision rests on counts of
//! operations, not on a clock, so that a run can be repeated bit for bit.

use crate::failure::StepFailureKind;
use slipstick_linalg::{
    BlockMatrix, BlockPattern, CsrMatrix, CsrPattern, Factorization, LinearSolver, Precision, Reduction, RobustSolver,
    SolveOptions, SolverChoice, solve_verified, solve_with,
};
use std::sync::Arc;

/// Removes prescribed unknowns, factorizes and solves; keeps the symbolic work while pattern and fixed set stay.
pub struct LinearSystem {
    solver: RobustSolver,
    cached: Option<Cached>,
    lagged: Option<Lagged>,
    counts: SolveCounts,
}

/// What was solved how, since the system was made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SolveCounts {
    /// Factorizations.
    pub factorizations: usize,
    /// Solves with the factors of an earlier tangent.
    pub lagged: usize,
    /// Iterations of these.
    pub lagged_iterations: usize,
    /// Attempts with earlier factors that were given up.
    pub given_up: usize,
}

struct Cached {
    pattern: Arc<BlockPattern>,
    fixed: Vec<bool>,
    reduction: Arc<Reduction>,
}

/// Factors of an earlier tangent.
struct Lagged {
    pattern: Arc<CsrPattern>,
    factors: Arc<dyn Factorization>,
    active_set: Vec<u8>,
}

/// A factorized tangent with the map back to all unknowns.
pub struct Factored {
    matrix: CsrMatrix,
    factors: Arc<dyn Factorization>,
    reduction: Arc<Reduction>,
}

/// Floating-point operations per second of a factorization, and bytes per second of a solve, on one core. Only their
/// ratio matters; measured in `docs/performance.md`.
const FACTOR_RATE: f64 = 2e10;
const MEMORY_RATE: f64 = 8e9;

/// Part of the break-even number of iterations that earlier factors are given.
const PATIENCE: f64 = 0.5;

/// Fewer iterations than this are not worth an attempt.
const LEAST_BUDGET: usize = 3;

impl LinearSystem {
    /// With the given direct solver.
    pub fn new(choice: SolverChoice) -> Self {
        Self { solver: RobustSolver::new(choice), cached: None, lagged: None, counts: SolveCounts::default() }
    }

    /// What was solved how.
    pub fn counts(&self) -> SolveCounts {
        self.counts
    }

    /// Drops factors of earlier tangents, so that what follows does not depend on what was solved before.
    pub fn forget(&mut self) {
        self.lagged = None;
    }

    /// The free part of `matrix`.
    fn reduce(&mut self, matrix: &BlockMatrix, fixed: &[bool], groups: &[u32]) -> (CsrMatrix, Arc<Reduction>) {
        let fits = self.cached.as_ref().is_some_and(|c| Arc::ptr_eq(&c.pattern, matrix.pattern()) && c.fixed == fixed);
        if !fits {
            let reduction = Arc::new(Reduction::new(matrix.pattern(), fixed, groups));
            self.cached = Some(Cached { pattern: matrix.pattern().clone(), fixed: fixed.to_vec(), reduction });
        }
        let reduction = self.cached.as_ref().expect("set above").reduction.clone();
        (reduction.reduce(matrix), reduction)
    }

    /// Factorizes the free part of `matrix`.
    ///
    /// # Errors
    /// [`StepFailureKind::Linear`] with the solver's message.
    pub fn factorize(
        &mut self,
        matrix: &BlockMatrix,
        fixed: &[bool],
        groups: &[u32],
    ) -> Result<Factored, StepFailureKind> {
        let (matrix, reduction) = self.reduce(matrix, fixed, groups);
        self.counts.factorizations += 1;
        let factors = self.solver.factorize(&matrix).map_err(|e| StepFailureKind::Linear(e.to_string()))?;
        Ok(Factored { matrix, factors: factors.into(), reduction })
    }

    /// Solves K x = `rhs` on the free unknowns, with factors of an earlier tangent if they are of the same active set
    /// and good enough, else with new ones. The others are left at zero.
    ///
    /// # Errors
    /// [`StepFailureKind::Linear`] if the system cannot be solved to the relative residual `tolerance`.
    pub fn solve(
        &mut self,
        matrix: &BlockMatrix,
        fixed: &[bool],
        groups: &[u32],
        active_set: &[u8],
        rhs: &[f64],
        tolerance: f64,
    ) -> Result<Vec<f64>, StepFailureKind> {
        let (matrix, reduction) = self.reduce(matrix, fixed, groups);
        if let Some(x) = self.solve_lagged(&matrix, &reduction, active_set, rhs, tolerance) {
            return Ok(x);
        }
        self.counts.factorizations += 1;
        let factors: Arc<dyn Factorization> =
            self.solver.factorize(&matrix).map_err(|e| StepFailureKind::Linear(e.to_string()))?.into();
        let pattern = matrix.pattern.clone();
        self.lagged = Some(Lagged { pattern, factors: factors.clone(), active_set: active_set.to_vec() });
        Factored { matrix, factors, reduction }.solve(rhs, false, tolerance)
    }

    fn solve_lagged(
        &mut self,
        matrix: &CsrMatrix,
        reduction: &Reduction,
        active_set: &[u8],
        rhs: &[f64],
        tolerance: f64,
    ) -> Option<Vec<f64>> {
        let lagged = self.lagged.as_ref()?;
        if !Arc::ptr_eq(&lagged.pattern, &matrix.pattern) || lagged.active_set != active_set {
            return None;
        }
        let budget = budget(matrix, lagged.factors.as_ref());
        if budget < LEAST_BUDGET {
            return None;
        }
        let rhs_free = reduction.restrict(rhs);
        let mut x = vec![0.0; rhs_free.len()];
        let options = SolveOptions { tolerance, max_iterations: budget, restart: budget };
        match solve_with(matrix, lagged.factors.as_ref(), false, &rhs_free, &mut x, &options) {
            Ok(report) => {
                self.counts.lagged += 1;
                self.counts.lagged_iterations += report.iterations;
                let mut full = vec![0.0; rhs.len()];
                reduction.prolong(&x, &mut full);
                Some(full)
            }
            Err(_) => {
                self.counts.given_up += 1;
                self.lagged = None;
                None
            }
        }
    }
}

/// How many iterations with given factors are cheaper than new factors.
fn budget(matrix: &CsrMatrix, factors: &dyn Factorization) -> usize {
    let single = factors.precision() == Precision::F32;
    let factor_time = factors.operations() / if single { 2.0 * FACTOR_RATE } else { FACTOR_RATE };
    // one pass over both factors and over the matrix
    let iteration_time = (factors.bytes() as f64 + 12.0 * matrix.values.len() as f64) / MEMORY_RATE;
    (PATIENCE * factor_time / iteration_time).min(60.0) as usize
}

impl Factored {
    /// Solves K x = `rhs` (or Kᵀ x = `rhs`) on the free unknowns; the others are left at zero.
    ///
    /// # Errors
    /// [`StepFailureKind::Linear`] if the true relative residual stays above `tolerance`.
    pub fn solve(&self, rhs: &[f64], transpose: bool, tolerance: f64) -> Result<Vec<f64>, StepFailureKind> {
        let rhs_free = self.reduction.restrict(rhs);
        let mut x = vec![0.0; rhs_free.len()];
        if rhs_free.iter().any(|&r| r != 0.0) {
            solve_verified(&self.matrix, self.factors.as_ref(), transpose, &rhs_free, &mut x, tolerance)
                .map_err(|e| StepFailureKind::Linear(e.to_string()))?;
        }
        let mut full = vec![0.0; rhs.len()];
        self.reduction.prolong(&x, &mut full);
        Ok(full)
    }

    /// Memory of the factors in bytes.
    pub fn bytes(&self) -> usize {
        self.factors.bytes()
    }
}
