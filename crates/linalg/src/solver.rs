//! The interface of linear solvers.

use crate::csr::{CsrMatrix, CsrPattern};
use crate::layout::Layout;
use crate::symbolic::Symbolic;
use slipstick_ranks::{Alone, Ranks};
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

/// A linear solver. It analyses a pattern once and factorizes any number of matrices on it; the
/// caller keeps the analysis.
///
/// ```
/// # use slipstick_linalg::{CsrMatrix, CsrPattern, LinearSolver, MultifrontalSolver, Precision};
/// # use std::sync::Arc;
/// let pattern = Arc::new(CsrPattern::new(vec![0, 1, 2], vec![0, 1], vec![0, 1], vec![])?);
/// let mut solver = MultifrontalSolver::new(Precision::F64);
/// let symbolic = solver.analyse(&pattern)?;
/// for values in [[2.0, 4.0], [8.0, 16.0]] {
///     let a = CsrMatrix { pattern: pattern.clone(), values: values.to_vec() };
///     let mut x = [16.0, 16.0];
///     solver.factorize(&symbolic, &a)?.solve(&mut x);
///     assert!((0..2).all(|i| (x[i] - 16.0 / values[i]).abs() < 1e-14));
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait LinearSolver: Send {
    /// Short name for reports.
    fn name(&self) -> &'static str;

    /// Analyses `pattern`, with the help of `earlier` analyses, the most useful first.
    ///
    /// An earlier analysis of `pattern` by this solver is returned as it is. From those of other
    /// patterns, the solver may reuse suitable data, for instance the elimination order. It ignores
    /// analyses of other solvers. A solver for several ranks is called on all of them together,
    /// each with its own pattern and analyses, and reuses only data that are suitable on all ranks.
    ///
    /// # Errors
    /// If the pattern is too large for the solver.
    fn analyse_after(&self, pattern: &Arc<CsrPattern>, earlier: &[Symbolic]) -> Result<Symbolic, FactorizationError>;

    /// Analyses `pattern` without earlier analyses.
    ///
    /// # Errors
    /// As [`LinearSolver::analyse_after`].
    fn analyse(&self, pattern: &Arc<CsrPattern>) -> Result<Symbolic, FactorizationError> {
        self.analyse_after(pattern, &[])
    }

    /// Factorizes `a` with the analysis of its pattern. A solver for several ranks is called on all
    /// of them together.
    ///
    /// # Errors
    /// A [`FactorizationError`] that names the unknown where the matrix is singular or not finite;
    /// [`FactorizationError::Analysis`] if `symbolic` belongs to another pattern or another solver.
    fn factorize(&mut self, symbolic: &Symbolic, a: &CsrMatrix) -> Result<Box<dyn Factorization>, FactorizationError>;

    /// Analyses the pattern of `a` and factorizes `a`: for a single matrix on its pattern.
    ///
    /// # Errors
    /// As [`LinearSolver::analyse`] and [`LinearSolver::factorize`].
    fn analyse_and_factorize(&mut self, a: &CsrMatrix) -> Result<Box<dyn Factorization>, FactorizationError> {
        let symbolic = self.analyse(&a.pattern)?;
        self.factorize(&symbolic, a)
    }

    /// Number format of the next factors. A matrix that is singular in single precision may be
    /// regular in double precision.
    fn precision(&self) -> Precision {
        Precision::F64
    }

    /// Whether factors are only a preconditioner, with which a solve takes many iterations.
    fn is_iterative(&self) -> bool {
        false
    }

    /// From now on, uses only direct solvers; returns whether that changes anything.
    fn insist_on_direct(&mut self) -> bool {
        false
    }

    /// From now on, computes factors only in double precision; returns whether that changes
    /// anything.
    fn insist_on_double(&mut self) -> bool {
        false
    }
}

/// Creates solvers, and defines which ranks share their matrices.
///
/// With several ranks, each passes its part to [`LinearSolver::factorize`]: the matrix is their
/// sum. Right-hand sides and solutions are distributed by the [`Layout`] of its pattern: each rank
/// has the entries of its own unknowns. The default implementations of `ranks` and `layout` are for
/// a single rank.
pub trait Backend: Send + Sync + Debug {
    /// A new solver.
    fn solver(&self) -> Box<dyn LinearSolver>;

    /// The ranks whose parts are summed.
    fn ranks(&self) -> &dyn Ranks {
        &Alone
    }

    /// The distribution of vectors that belong to matrices on a pattern. All ranks call it
    /// together.
    fn layout(&self, pattern: &CsrPattern) -> Layout {
        Layout::whole(pattern.n())
    }
}

/// Modelled cost of factors.
///
/// The unit is the time that a core takes to move one byte between memory and its registers: a pass
/// over b bytes costs b. Each solver converts its floating-point operations into this unit. Costs
/// follow from counts, never from a clock. They are therefore the same in every run and on all
/// ranks, and decisions based on them are reproducible bit for bit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Cost of another factorization like this one, without the analysis. \[bytes moved\]
    pub factorization: f64,
    /// Cost of one solve. \[bytes moved\]
    pub substitution: f64,
    /// Number of solves that reduce a residual of the factorized matrix to a tenth; 0 for factors
    /// whose first solve is accurate, those of direct solvers.
    pub solves_per_digit: f64,
    /// Cost of an iteration for one more right-hand side, relative to that for one alone: 1 if each is
    /// solved separately, less if the factors are read once for all.
    pub further: f64,
}

/// A pivot and its unknown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pivot {
    /// The unknown.
    pub unknown: usize,
    /// Absolute value in the matrix whose rows and columns are scaled to about one.
    pub size: f64,
}

/// This rank's part of the factors of a matrix.
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
    /// Overwrites `rhs` with A⁻¹ `rhs`.
    ///
    /// # Panics
    /// If the length differs from the number of unknowns.
    fn solve(&self, rhs: &mut [f64]);

    /// Overwrites `rhs` with A⁻ᵀ `rhs`.
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

    /// Costs of new factors and of a solve with these, equal on all ranks: they decide how long
    /// factors are reused for other matrices. `None` if the solver cannot estimate them; its
    /// factors are then not reused.
    fn cost(&self) -> Option<Cost> {
        None
    }

    /// This rank's part of the factors and of the work for them; on one rank, all of it.
    fn part(&self) -> FactorPart {
        FactorPart { bytes: self.bytes(), operations: 0.0 }
    }

    /// Factors that scale the rows of the matrix to about one, one entry per unknown, if the solver
    /// has computed them.
    fn row_scaling(&self) -> Option<&[f64]> {
        None
    }

    /// The smallest pivot, if the solver knows it: there, the matrix is closest to singular.
    fn weakest_pivot(&self) -> Option<Pivot> {
        None
    }

    /// Whether pivots and their growth show that the matrix is far from singular and the factors are
    /// accurate, so that a test solve would be wasted.
    fn is_safe(&self) -> bool {
        false
    }

    /// Solves with several right-hand sides, one after the other in `rhs`. All ranks call it
    /// together.
    ///
    /// # Panics
    /// If the length is not a multiple of the number of unknowns.
    fn solve_many(&self, rhs: &mut [f64]) {
        check_columns(self.n(), rhs.len());
        rhs.chunks_exact_mut(self.n().max(1)).for_each(|column| self.solve(column));
    }

    /// Solves with the transpose for several right-hand sides, one after the other in `rhs`. All
    /// ranks call it together.
    ///
    /// # Panics
    /// If the length is not a multiple of the number of unknowns.
    fn solve_transpose_many(&self, rhs: &mut [f64]) {
        check_columns(self.n(), rhs.len());
        rhs.chunks_exact_mut(self.n().max(1)).for_each(|column| self.solve_transpose(column));
    }
}

/// The factorization of Aᵀ, from a factorization of A.
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

    fn cost(&self) -> Option<Cost> {
        self.0.cost()
    }

    fn part(&self) -> FactorPart {
        self.0.part()
    }

    fn weakest_pivot(&self) -> Option<Pivot> {
        self.0.weakest_pivot()
    }

    fn is_safe(&self) -> bool {
        self.0.is_safe()
    }

    fn solve_many(&self, rhs: &mut [f64]) {
        self.0.solve_transpose_many(rhs);
    }

    fn solve_transpose_many(&self, rhs: &mut [f64]) {
        self.0.solve_many(rhs);
    }
}

/// Panics unless `length` holds whole columns of `n` entries.
pub(crate) fn check_columns(n: usize, length: usize) {
    assert!(
        if n == 0 { length == 0 } else { length.is_multiple_of(n) },
        "{length} entries are not a whole number of right-hand sides of {n} unknowns"
    );
}

/// Why a matrix could not be factorized.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum FactorizationError {
    /// The number of values differs from the number of entries.
    #[error("the matrix has {values} values, but its sparsity pattern has {entries} entries")]
    Values {
        /// Number of values.
        values: usize,
        /// Number of entries of the pattern.
        entries: usize,
    },
    /// The analysis belongs to another pattern or another solver.
    #[error(
        "the symbolic analysis does not belong to this solver and the pattern of this matrix of {n} unknowns; analyse \
         the pattern before the factorization"
    )]
    Analysis {
        /// Number of unknowns of the matrix.
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
        /// Unknown among the free ones; [`Reduction::origin`](crate::Reduction::origin) returns its
        /// node.
        unknown: usize,
        /// Best remaining pivot, after scaling all rows and columns to about one.
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
        /// The ‖b − A x‖ / ‖b‖ reached; NaN if the solution was not finite.
        residual: f64,
    },
    /// The solver itself failed, for lack of memory or index range.
    #[error("the {solver} solver failed on {n} unknowns: {reason}")]
    Backend {
        /// Name of the solver.
        solver: &'static str,
        /// Number of unknowns.
        n: usize,
        /// The reason.
        reason: String,
    },
}
