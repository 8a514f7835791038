//! The interface of direct solvers.

use crate::csr::{CsrMatrix, CsrPattern};
use crate::layout::Layout;
use crate::ranks::Ranks;
use std::fmt::Debug;
use std::sync::Arc;
use thiserror::Error;

/// Number format of the factors. Solutions are always in double precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Precision {
    /// Double precision.
    #[default]
    F64,
    /// Single precision: half the memory and about half the time; solutions need the correction
    /// by [`solve_verified`](crate::solve_verified).
    F32,
}

/// A direct solver. It keeps its symbolic analysis while matrices share the same pattern
/// allocation (`Arc::ptr_eq`).
pub trait LinearSolver: Send {
    /// Short name for reports.
    fn name(&self) -> &'static str;

    /// Factorizes `a`.
    ///
    /// # Errors
    /// A [`FactorizationError`] that names the unknown where the matrix is singular or not finite.
    fn factorize(&mut self, a: &CsrMatrix) -> Result<Box<dyn Factorization>, FactorizationError>;

    /// Prepares for matrices on `pattern`; otherwise the first factorization does.
    ///
    /// # Errors
    /// If the pattern is inconsistent or too large for the solver.
    fn analyse(&mut self, pattern: &Arc<CsrPattern>) -> Result<(), FactorizationError> {
        let _ = pattern;
        Ok(())
    }

    /// Makes factors of double precision only from now on; whether that changes anything.
    fn insist_on_double(&mut self) -> bool {
        false
    }
}

/// Makes solvers, and says which ranks share the matrices that they are given.
///
/// With several ranks, each hands its part to [`LinearSolver::factorize`]: the matrix is their sum. Right-hand sides and
/// solutions are divided by the [`Layout`] of its pattern: each rank has the entries of its own unknowns.
pub trait Backend: Send + Sync + Debug {
    /// A new solver, without an analysis yet.
    fn solver(&self) -> Box<dyn LinearSolver>;

    /// The ranks whose parts are summed.
    fn ranks(&self) -> &dyn Ranks;

    /// How vectors are divided that belong to matrices on a pattern. All ranks call it together.
    fn layout(&self, pattern: &CsrPattern) -> Layout;
}

/// What a rank has of the factors of a matrix.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FactorPart {
    /// Memory. \[bytes\]
    pub bytes: usize,
    /// Floating-point operations of this rank for the factors; zero if unknown.
    pub operations: f64,
}

/// A factorized matrix, for solves with the matrix and with its transpose.
///
/// The raw solves do not check anything; [`solve_verified`](crate::solve_verified) does.
pub trait Factorization: Send + Sync {
    /// Overwrites `rhs` by A⁻¹ `rhs`.
    ///
    /// # Panics
    /// If the length differs from the number of unknowns.
    fn solve(&self, rhs: &mut [f64]);

    /// Overwrites `rhs` by A⁻ᵀ `rhs`.
    ///
    /// # Panics
    /// If the length differs from the number of unknowns.
    fn solve_transpose(&self, rhs: &mut [f64]);

    /// Number of unknowns of this rank.
    fn n(&self) -> usize;

    /// Memory of the factors in bytes.
    fn bytes(&self) -> usize;

    /// Number format of the factors.
    fn precision(&self) -> Precision;

    /// Floating-point operations that the factorization took, to weigh a new one against more iterations with this one;
    /// zero if unknown.
    fn operations(&self) -> f64 {
        0.0
    }

    /// What this rank has of the factors and did for them; all of it on one rank.
    fn part(&self) -> FactorPart {
        FactorPart { bytes: self.bytes(), operations: self.operations() }
    }

    /// Solves with several right-hand sides, one after the other in `rhs`, on one rank.
    ///
    /// # Panics
    /// If the length is no multiple of the number of unknowns.
    fn solve_many(&self, rhs: &mut [f64]) {
        check_columns(self.n(), rhs.len());
        rhs.chunks_exact_mut(self.n().max(1)).for_each(|column| self.solve(column));
    }

    /// Solves with the transpose for several right-hand sides, one after the other in `rhs`, on one rank.
    ///
    /// # Panics
    /// If the length is no multiple of the number of unknowns.
    fn solve_transpose_many(&self, rhs: &mut [f64]) {
        check_columns(self.n(), rhs.len());
        rhs.chunks_exact_mut(self.n().max(1)).for_each(|column| self.solve_transpose(column));
    }
}

/// The factorization of Aᵀ that one of A is.
pub struct Transposed<'a>(pub &'a dyn Factorization);

impl Factorization for Transposed<'_> {
    fn solve(&self, rhs: &mut [f64]) {
        self.0.solve_transpose(rhs);
    }

    fn solve_transpose(&self, rhs: &mut [f64]) {
        self.0.solve(rhs);
    }

    fn n(&self) -> usize {
        self.0.n()
    }

    fn bytes(&self) -> usize {
        self.0.bytes()
    }

    fn precision(&self) -> Precision {
        self.0.precision()
    }

    fn operations(&self) -> f64 {
        self.0.operations()
    }

    fn part(&self) -> FactorPart {
        self.0.part()
    }
}

/// Panics unless `length` holds whole columns of `n` entries.
pub(crate) fn check_columns(n: usize, length: usize) {
    assert!(
        if n == 0 { length == 0 } else { length.is_multiple_of(n) },
        "{length} entries are no whole number of right-hand sides of {n} unknowns"
    );
}

/// Why a matrix could not be factorized.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum FactorizationError {
    /// The pattern contradicts itself.
    #[error(
        "the sparsity pattern is inconsistent: offsets, ascending columns, groups and values must \
         match its {n} rows"
    )]
    Pattern {
        /// Rows stated by the pattern.
        n: usize,
    },
    /// An entry is NaN or infinite.
    #[error(
        "matrix entry in row {row}, column {column} is not finite; an element may have inverted \
         or the load step may be too large"
    )]
    NonFinite {
        /// Row among the free unknowns.
        row: usize,
        /// Column among the free unknowns.
        column: usize,
    },
    /// No acceptable pivot for an unknown.
    #[error(
        "the matrix is singular at unknown {unknown} (pivot {pivot:e} relative to its scaled row); \
         a body may be free to move, or a contact constraint may repeat a prescribed displacement"
    )]
    Singular {
        /// Unknown among the free ones; [`Reduction::origin`](crate::Reduction::origin) tells its node.
        unknown: usize,
        /// Best pivot left, after scaling all rows and columns to about one.
        pivot: f64,
    },
    /// The factors do not solve the system accurately.
    #[error(
        "the {solver} factors left a relative residual of {residual:e} on a test vector; the matrix \
         may be singular to working precision"
    )]
    Inaccurate {
        /// Name of the solver.
        solver: &'static str,
        /// ‖b − A x‖ / ‖b‖ reached, NaN if the solution was not finite.
        residual: f64,
    },
    /// The solver itself failed, for lack of memory or index range.
    #[error("the {solver} solver failed on {n} unknowns: {reason}")]
    Backend {
        /// Name of the solver.
        solver: &'static str,
        /// Number of unknowns.
        n: usize,
        /// What happened.
        reason: String,
    },
}

/// Refuses patterns and values that would make a solver go astray.
///
/// # Errors
/// [`FactorizationError::Pattern`], unless the pattern is known; [`FactorizationError::NonFinite`].
pub fn check_matrix(a: &CsrMatrix, known_pattern: bool) -> Result<(), FactorizationError> {
    let consistent = known_pattern || a.pattern.is_consistent();
    if !consistent || a.values.len() != a.pattern.columns.len() {
        return Err(FactorizationError::Pattern { n: a.pattern.n });
    }
    match a.first_non_finite() {
        Some((row, column)) => Err(FactorizationError::NonFinite { row, column }),
        None => Ok(()),
    }
}
