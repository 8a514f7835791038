//! Multifrontal LU factorization.
//!
//! The matrix is equilibrated by powers of two and permuted by nested dissection (without METIS: minimum degree) of the graph of its
//! elimination groups: one vertex per node, or per slave node with its multipliers. The
//! elimination tree of the symmetrised pattern, cut into supernodes, becomes a tree of dense
//! *fronts*. Each front holds its fully summed rows and columns and those they touch:
//!
//! ```text
//!   F = [ F11  F12 ]  fully summed    F11 = L11 U11,  L21 = F21 U11⁻¹,  U12 = L11⁻¹ F12,
//!       [ F21  F22 ]                  contribution to the parent:  F22 − L21 U12
//! ```
//!
//! Pivots are sought in F11 only, but are accepted only if no multiplier in L21 exceeds
//! 1/[`PIVOT_THRESHOLD`]. Rejected rows and columns stay in the contribution and are fully summed in
//! the parent (delayed pivots); what is left at a root is singular.
//!
//! References: Duff and Reid, The multifrontal solution of unsymmetric sets of linear equations,
//! SIAM J. Sci. Stat. Comput. 5 (1984); Amestoy, Duff, L'Excellent and Koster, A fully asynchronous
//! multifrontal solver, SIAM J. Matrix Anal. Appl. 23 (2001) for the pivoting; Karypis and Kumar,
//! SIAM J. Sci. Comput. 20 (1998) for the ordering.

mod buffers;
mod dense;
mod front;
mod kernels;
mod numeric;
mod ordering;
mod pivoting;
mod scalar;
mod solve;
mod sweep;
mod symbolic;

use crate::csr::{CsrMatrix, CsrPattern};
use crate::scaling::Scaling;
use crate::solver::{Factorization, FactorizationError, LinearSolver, Precision, check_columns, check_matrix};
use front::Front;
use scalar::Scalar;
use std::sync::Arc;
use symbolic::{Ordering, Symbolic};

/// Smallest accepted ratio of a pivot to the largest entry of its column in the front.
pub const PIVOT_THRESHOLD: f64 = 0.01;

const NAME: &str = "multifrontal LU";

/// Facts about a factorization, for reports and for judging its quality.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FactorStatistics {
    /// Fronts of the assembly tree.
    pub fronts: usize,
    /// Entries of L and U, zeros inside the fronts included.
    pub factor_entries: usize,
    /// Floating-point operations foreseen by the analysis, without delayed pivots.
    pub operations: f64,
    /// Pivots passed on to a parent, counted once per front.
    pub delayed_pivots: usize,
    /// Largest entry of U; the scaled matrix has entries of about one.
    pub growth: f64,
    /// Smallest pivot of the scaled matrix; infinite without any.
    pub smallest_pivot: f64,
    /// Unknown of the smallest pivot: where the matrix is closest to singular.
    pub weakest_unknown: usize,
}

/// Multifrontal LU solver. The analysis is kept while the pattern is the same allocation, and the elimination order for
/// other patterns of the same unknowns, and the scaling while it fits, until [`forget`](Self::forget).
#[derive(Debug)]
pub struct MultifrontalSolver {
    precision: Precision,
    analysis: Option<(Arc<CsrPattern>, Arc<Symbolic>)>,
    ordering: Option<Ordering>,
    scaling: Option<Scaling>,
}

impl MultifrontalSolver {
    /// A solver with factors of the given precision, without an analysis yet.
    pub fn new(precision: Precision) -> Self {
        Self { precision, analysis: None, ordering: None, scaling: None }
    }

    /// Changes the precision of the factorizations to come; the analysis is kept.
    pub fn set_precision(&mut self, precision: Precision) {
        self.precision = precision;
    }

    /// Drops what is kept, so that what follows does not depend on earlier matrices.
    pub fn forget(&mut self) {
        self.analysis = None;
        self.ordering = None;
        self.scaling = None;
    }

    /// Computes ordering and structure for `pattern`, unless done already. Otherwise the first
    /// factorization does it.
    ///
    /// # Errors
    /// If the pattern is inconsistent or too large for the ordering.
    pub fn analyse(&mut self, pattern: &Arc<CsrPattern>) -> Result<(), FactorizationError> {
        self.symbolic(pattern).map(|_| ())
    }

    /// Entries of L and U and floating-point operations that a factorization of `pattern` will need, from the analysis
    /// alone; `None` if the pattern cannot be analysed.
    pub fn predict(pattern: &CsrPattern) -> Option<(f64, f64)> {
        let symbolic = Symbolic::analyse(pattern, None).ok()?.0;
        let entries = symbolic.supernodes.iter().map(|s| s.pivots as f64 * (s.pivots + 2 * s.rows.len()) as f64).sum();
        Some((entries, symbolic.operations))
    }

    fn knows(&self, pattern: &Arc<CsrPattern>) -> bool {
        self.analysis.as_ref().is_some_and(|(known, _)| Arc::ptr_eq(known, pattern))
    }

    fn symbolic(&mut self, pattern: &Arc<CsrPattern>) -> Result<Arc<Symbolic>, FactorizationError> {
        if let Some((known, symbolic)) = &self.analysis
            && Arc::ptr_eq(known, pattern)
        {
            return Ok(Arc::clone(symbolic));
        }
        if !pattern.is_consistent() {
            return Err(FactorizationError::Pattern { n: pattern.n });
        }
        let result = Symbolic::analyse(pattern, self.ordering.take());
        let (symbolic, ordering) =
            result.map_err(|reason| FactorizationError::Backend { solver: NAME, n: pattern.n, reason })?;
        self.ordering = Some(ordering);
        let symbolic = Arc::new(symbolic);
        self.analysis = Some((Arc::clone(pattern), Arc::clone(&symbolic)));
        Ok(symbolic)
    }

    /// As [`LinearSolver::factorize`], with the concrete type.
    ///
    /// # Errors
    /// As [`LinearSolver::factorize`].
    pub fn factorize_matrix(&mut self, a: &CsrMatrix) -> Result<MultifrontalFactorization, FactorizationError> {
        check_matrix(a, self.knows(&a.pattern))?;
        let symbolic = self.symbolic(&a.pattern)?;
        let scaling = Scaling::follow(self.scaling.take(), a);
        self.scaling = Some(scaling.clone());
        let factors = match self.precision {
            Precision::F64 => Factors::Double(Numeric::factorize(symbolic, scaling, a)?),
            Precision::F32 => Factors::Single(Numeric::factorize(symbolic, scaling, a)?),
        };
        Ok(MultifrontalFactorization { factors })
    }
}

impl LinearSolver for MultifrontalSolver {
    fn name(&self) -> &'static str {
        NAME
    }

    fn factorize(&mut self, a: &CsrMatrix) -> Result<Box<dyn Factorization>, FactorizationError> {
        Ok(Box::new(self.factorize_matrix(a)?))
    }
}

/// Factors of a [`MultifrontalSolver`].
#[derive(Debug)]
pub struct MultifrontalFactorization {
    factors: Factors,
}

#[derive(Debug)]
enum Factors {
    Double(Numeric<f64>),
    Single(Numeric<f32>),
}

/// Numeric factors in one precision.
#[derive(Debug)]
struct Numeric<T> {
    symbolic: Arc<Symbolic>,
    scaling: Scaling,
    fronts: Vec<Front<T>>,
    plan: sweep::Plan,
    statistics: FactorStatistics,
}

impl<T: Scalar> Numeric<T> {
    fn factorize(symbolic: Arc<Symbolic>, scaling: Scaling, a: &CsrMatrix) -> Result<Self, FactorizationError> {
        let values: Vec<T> = scaling.apply(a, T::from_f64);
        let fronts = numeric::factorize(&symbolic, &values)?;
        let growth = fronts.iter().fold(0.0, |m: f64, f| m.max(f.growth));
        if !growth.is_finite() {
            return Err(FactorizationError::Inaccurate { solver: NAME, residual: f64::NAN });
        }
        let (smallest_pivot, weakest) = fronts
            .iter()
            .filter_map(Front::smallest_pivot)
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap_or((f64::INFINITY, 0));
        let statistics = FactorStatistics {
            fronts: fronts.len(),
            factor_entries: fronts.iter().map(Front::entries).sum(),
            operations: symbolic.operations,
            delayed_pivots: fronts.iter().map(|f| f.delayed_rows.len()).sum(),
            growth,
            smallest_pivot,
            weakest_unknown: symbolic.permutation.get(weakest as usize).map_or(0, |&i| i as usize),
        };
        let plan = sweep::Plan::new(&symbolic, &fronts);
        Ok(Self { symbolic, scaling, fronts, plan, statistics })
    }
}

impl MultifrontalFactorization {
    /// Powers of two that brought the matrix's rows to one size.
    pub(crate) fn row_scaling(&self) -> &[f64] {
        match &self.factors {
            Factors::Double(numeric) => &numeric.scaling.rows,
            Factors::Single(numeric) => &numeric.scaling.rows,
        }
    }

    /// Size and quality of the factors.
    pub fn statistics(&self) -> FactorStatistics {
        match &self.factors {
            Factors::Double(numeric) => numeric.statistics,
            Factors::Single(numeric) => numeric.statistics,
        }
    }

    fn run(&self, transpose: bool, rhs: &mut [f64]) {
        check_columns(self.n(), rhs.len());
        match &self.factors {
            Factors::Double(numeric) => numeric.solve(transpose, rhs),
            Factors::Single(numeric) => numeric.solve(transpose, rhs),
        }
    }
}

impl Factorization for MultifrontalFactorization {
    fn solve(&self, rhs: &mut [f64]) {
        assert_eq!(rhs.len(), self.n(), "the right-hand side needs an entry per unknown");
        self.run(false, rhs);
    }

    fn solve_transpose(&self, rhs: &mut [f64]) {
        assert_eq!(rhs.len(), self.n(), "the right-hand side needs an entry per unknown");
        self.run(true, rhs);
    }

    fn n(&self) -> usize {
        match &self.factors {
            Factors::Double(numeric) => numeric.symbolic.n,
            Factors::Single(numeric) => numeric.symbolic.n,
        }
    }

    fn bytes(&self) -> usize {
        let entry = match self.precision() {
            Precision::F64 => 8,
            Precision::F32 => 4,
        };
        self.statistics().factor_entries * entry + self.n() * 24
    }

    fn operations(&self) -> f64 {
        self.statistics().operations
    }

    fn precision(&self) -> Precision {
        match self.factors {
            Factors::Double(_) => Precision::F64,
            Factors::Single(_) => Precision::F32,
        }
    }

    fn solve_many(&self, rhs: &mut [f64]) {
        self.run(false, rhs);
    }

    fn solve_transpose_many(&self, rhs: &mut [f64]) {
        self.run(true, rhs);
    }
}
