//! Reduced linear systems of Newton's method and of the adjoint, every solve verified by its residual.

use crate::failure::StepFailureKind;
use slipstick_linalg::{
    BlockMatrix, BlockPattern, CsrMatrix, Factorization, LinearSolver, Reduction, RobustSolver, SolverChoice,
    solve_verified,
};
use std::sync::Arc;

/// Removes prescribed unknowns, factorizes and solves; keeps the symbolic work while pattern and fixed set stay.
pub struct LinearSystem {
    solver: RobustSolver,
    cached: Option<Cached>,
}

struct Cached {
    pattern: Arc<BlockPattern>,
    fixed: Vec<bool>,
    reduction: Arc<Reduction>,
}

/// A factorized tangent with the map back to all unknowns.
pub struct Factored {
    matrix: CsrMatrix,
    factors: Box<dyn Factorization>,
    reduction: Arc<Reduction>,
}

impl LinearSystem {
    /// With the given direct solver.
    pub fn new(choice: SolverChoice) -> Self {
        Self { solver: RobustSolver::new(choice), cached: None }
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
        let fits = self.cached.as_ref().is_some_and(|c| Arc::ptr_eq(&c.pattern, matrix.pattern()) && c.fixed == fixed);
        if !fits {
            let reduction = Arc::new(Reduction::new(matrix.pattern(), fixed, groups));
            self.cached = Some(Cached { pattern: matrix.pattern().clone(), fixed: fixed.to_vec(), reduction });
        }
        let reduction = self.cached.as_ref().expect("set above").reduction.clone();
        let matrix = reduction.reduce(matrix);
        let factors = self.solver.factorize(&matrix).map_err(|e| StepFailureKind::Linear(e.to_string()))?;
        Ok(Factored { matrix, factors, reduction })
    }
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
