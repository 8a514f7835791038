//! Multifrontal LU factorization.
//!
//! The matrix is equilibrated by powers of two and permuted by nested dissection (without METIS:
//! minimum degree) of the graph of its elimination groups: one vertex per node, or per slave node
//! with its multipliers. The elimination tree of the symmetrized pattern, divided into supernodes,
//! becomes a tree of dense *fronts*. Each front contains its fully summed rows and columns and
//! those that they couple to:
//!
//! ```text
//!   F = [ F11  F12 ]  fully summed    F11 = L11 U11,  L21 = F21 U11⁻¹,  U12 = L11⁻¹ F12,
//!       [ F21  F22 ]                  contribution to the parent:  F22 − L21 U12
//! ```
//!
//! Pivots are sought only in F11, but are accepted only if no multiplier in L21 exceeds
//! 1/[`PIVOT_THRESHOLD`]. Rejected rows and columns stay in the contribution and are fully summed
//! in the parent (delayed pivots); if any are left at a root, the matrix is singular.
//!
//! Matrices of contact problems are symmetric except in the contact zone. A front whose data are
//! symmetric, with round-off, is factorized by Cholesky's method, with half of the operations and of
//! the memory; if it is not positive definite, by LU. Row and column of a displacement share their
//! scaling, and a small contact zone is eliminated last, so that most fronts are symmetric.
//!
//! References: Duff and Reid, The multifrontal solution of unsymmetric sets of linear equations,
//! SIAM J. Sci. Stat. Comput. 5 (1984); Amestoy, Duff, L'Excellent and Koster, A fully asynchronous
//! multifrontal solver, SIAM J. Matrix Anal. Appl. 23 (2001) (pivoting); Karypis and Kumar, SIAM J.
//! Sci. Comput. 20 (1998) for the ordering.

mod buffers;
mod dense;
mod elimination;
mod front;
mod numeric;
mod ordering;
mod pivoting;
mod scalar;
mod solve;
mod sweep;
mod symbolic;
mod symmetric;
mod trapezoid;
mod tree;

use crate::csr::{CsrMatrix, CsrPattern};
use crate::scaling::Scaling;
use crate::solver::{
    Cost, FactorPart, Factorization, FactorizationError, LinearSolver, Pivot, Precision, check_columns,
};
use crate::symbolic::Symbolic;
pub use elimination::EliminationTree;
use front::Front;
use scalar::Scalar;
use std::sync::{Arc, Mutex, PoisonError};
use symbolic::{Ordering, Places, Structure};

/// Smallest accepted ratio of a pivot to the largest entry of its column in the front.
pub const PIVOT_THRESHOLD: f64 = 0.01;

/// The same with strict pivoting: at one, which is partial pivoting, round-off would delay many pivots.
const STRICT_THRESHOLD: f64 = 0.5;

/// Bounds within which factors are [safe](Factorization::is_safe): the smallest pivot of the scaled
/// matrix, in single and in double precision, and the growth. In double precision, round-off leaves up
/// to 1e-13 in place of the zero pivot of a singular matrix; in single precision, 5e8 times as much.
const SAFE_PIVOT: [f64; 2] = [1e-4, 1e-10];
const SAFE_GROWTH: f64 = 100.0;

const NAME: &str = "multifrontal LU";

/// Bytes that a core moves during a solve in the time of one floating-point operation of a
/// factorization in double precision; operations in single precision take half the time.
///
/// The ratio is 8 GB/s over 20 Gflop/s on a core of an AMD EPYC. It depends on instruction set and
/// matrix: with AVX-512, `cargo run --release -p slipstick-linalg --example factor` on one thread
/// gives 10 GB/s and 41 Gflop/s (66 in single precision). The march gives earlier factors only half
/// of the break-even number of iterations, so its speed is not sensitive to the ratio. Its results
/// are, within the tolerance of the solves: the ratio decides which factors it reuses.
pub(crate) const BYTES_PER_OPERATION: f64 = 0.4;

/// [`Cost::further`], measured by `cargo run --release -p slipstick-linalg --example factor`.
const FURTHER: f64 = 0.4;

/// Facts about a factorization, for reports and for judging its quality.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FactorStatistics {
    /// Fronts of the assembly tree.
    pub fronts: usize,
    /// Entries of L and U, including zeros inside the fronts.
    pub factor_entries: usize,
    /// Entries that a substitution reads: some of symmetric fronts are read twice.
    pub entries_read: usize,
    /// Floating-point operations.
    pub operations: f64,
    /// The part of them in symmetric fronts.
    pub symmetric_operations: f64,
    /// Pivots passed on to a parent, counted once per front.
    pub delayed_pivots: usize,
    /// Largest entry of U; the scaled matrix has entries of about one.
    pub growth: f64,
    /// Smallest pivot of the scaled matrix; infinite if there are no pivots.
    pub smallest_pivot: f64,
    /// Unknown of the smallest pivot: where the matrix is closest to singular.
    pub weakest_unknown: usize,
}

/// Multifrontal LU solver. It keeps the scaling of the latest matrix as long as it is suitable. An
/// analysis uses the elimination order of an earlier analysis of the same unknowns if the factors
/// cost at most 15 % more than for the pattern for which the order was computed.
#[derive(Debug)]
pub struct MultifrontalSolver {
    precision: Precision,
    packed: bool,
    threshold: f64,
    /// The scaling of the latest matrix of this solver and of those
    /// [in another precision](Self::in_precision).
    scaling: Arc<Mutex<Option<Scaling>>>,
}

/// The analysis of a pattern.
#[derive(Debug)]
struct Analysis {
    structure: Arc<Structure>,
    places: Places,
    ordering: Arc<Ordering>,
}

impl MultifrontalSolver {
    /// A solver with factors of the given precision.
    pub fn new(precision: Precision) -> Self {
        Self { precision, packed: false, threshold: PIVOT_THRESHOLD, scaling: Arc::default() }
    }

    /// A solver whose factors are computed in single precision and stored with 16 bits: a preconditioner
    /// that needs half the memory.
    pub(crate) fn packed() -> Self {
        Self { packed: true, ..Self::new(Precision::F32) }
    }

    /// A solver in double precision that accepts only multipliers up to two and passes all other pivots
    /// on to the parents: slower, with more fill, but as stable as partial pivoting.
    pub fn strict() -> Self {
        Self { threshold: STRICT_THRESHOLD, ..Self::new(Precision::F64) }
    }

    /// A solver for the same matrices in another precision. The two share the scaling of the latest
    /// matrix.
    pub fn in_precision(&self, precision: Precision) -> Self {
        Self { precision, scaling: Arc::clone(&self.scaling), ..*self }
    }

    /// Entries of L and U and floating-point operations that a factorization of `pattern` will
    /// need, only from the analysis; `None` if the pattern cannot be analysed.
    pub fn predict(pattern: &CsrPattern) -> Option<(f64, f64)> {
        Some(Structure::without_entries(pattern, None, true).ok()?.0.size())
    }

    /// The same from an analysis; `None` if it is that of another solver.
    pub fn size(symbolic: &Symbolic) -> Option<(f64, f64)> {
        Some(symbolic.content::<Analysis>()?.structure.size())
    }

    /// As [`LinearSolver::factorize`], with the concrete type.
    ///
    /// # Errors
    /// As [`LinearSolver::factorize`].
    pub fn factorize_matrix(
        &mut self,
        symbolic: &Symbolic,
        a: &CsrMatrix,
    ) -> Result<MultifrontalFactorization, FactorizationError> {
        let analysis = symbolic.content_for::<Analysis>(a)?;
        // the lock is not held during parallel work; a panic between taking the scaling and storing
        // the new one leaves none, which is harmless
        let kept = || self.scaling.lock().unwrap_or_else(PoisonError::into_inner);
        let earlier = kept().take();
        let scaling = Scaling::follow(earlier, a);
        *kept() = Some(scaling.clone());
        let factors = match self.precision {
            Precision::F64 => Factors::Double(Numeric::factorize(analysis, scaling, a, (self.packed, self.threshold))?),
            Precision::F32 => Factors::Single(Numeric::factorize(analysis, scaling, a, (self.packed, self.threshold))?),
        };
        Ok(MultifrontalFactorization { factors })
    }
}

impl LinearSolver for MultifrontalSolver {
    fn name(&self) -> &'static str {
        match self.precision {
            _ if self.threshold > PIVOT_THRESHOLD => "multifrontal LU with strict pivoting",
            Precision::F64 => "multifrontal LU in double precision",
            Precision::F32 => "multifrontal LU in single precision",
        }
    }

    fn analyse_after(&self, pattern: &Arc<CsrPattern>, earlier: &[Symbolic]) -> Result<Symbolic, FactorizationError> {
        let own = || earlier.iter().filter_map(|symbolic| Some((symbolic, symbolic.content::<Analysis>()?)));
        if let Some((symbolic, _)) = own().find(|(symbolic, _)| symbolic.is_of(pattern)) {
            return Ok(symbolic.clone());
        }
        let known = own().next().map(|(_, analysis)| &analysis.ordering);
        let failed = |reason| FactorizationError::Backend { solver: NAME, n: pattern.n(), reason };
        let (structure, places, ordering) = Structure::analyse(pattern, known).map_err(failed)?;
        Ok(Symbolic::new(pattern, Analysis { structure: Arc::new(structure), places, ordering }))
    }

    fn factorize(&mut self, symbolic: &Symbolic, a: &CsrMatrix) -> Result<Box<dyn Factorization>, FactorizationError> {
        Ok(Box::new(self.factorize_matrix(symbolic, a)?))
    }

    fn precision(&self) -> Precision {
        self.precision
    }

    fn insist_on_double(&mut self) -> bool {
        std::mem::replace(&mut self.precision, Precision::F64) == Precision::F32
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
    structure: Arc<Structure>,
    scaling: Scaling,
    fronts: Vec<Front<T>>,
    plan: sweep::Plan,
    statistics: FactorStatistics,
}

impl<T: Scalar> Numeric<T> {
    fn factorize(
        analysis: &Analysis,
        scaling: Scaling,
        a: &CsrMatrix,
        (packed, threshold): (bool, f64),
    ) -> Result<Self, FactorizationError> {
        let values: Vec<T> = scaling.apply(a, T::from_f64);
        let structure = analysis.structure.clone();
        let fronts = numeric::factorize(&structure, &analysis.places, &values, (packed, threshold))?;
        let growth = fronts.iter().fold(0.0, |m: f64, f| m.max(f.growth));
        if !growth.is_finite() {
            return Err(FactorizationError::Inaccurate { solver: NAME, residual: f64::NAN });
        }
        let (smallest_pivot, weakest) = fronts
            .iter()
            .filter_map(|front| front.smallest_pivot)
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap_or((f64::INFINITY, 0));
        let symmetric = fronts.iter().filter(|front| front.is_symmetric());
        let statistics = FactorStatistics {
            fronts: fronts.len(),
            factor_entries: fronts.iter().map(Front::entries).sum(),
            entries_read: fronts.iter().map(Front::entries_read).sum(),
            operations: fronts.iter().map(Front::operations).sum(),
            symmetric_operations: symmetric.map(Front::operations).sum(),
            delayed_pivots: fronts.iter().map(|f| f.delayed_rows.len()).sum(),
            growth,
            smallest_pivot,
            weakest_unknown: structure.permutation.get(weakest as usize).map_or(0, |&i| i as usize),
        };
        let plan = sweep::Plan::new(&structure, &fronts);
        Ok(Self { structure, scaling, fronts, plan, statistics })
    }
}

impl MultifrontalFactorization {
    /// Analyses and factorizes `a`.
    ///
    /// # Errors
    /// As [`LinearSolver::analyse_and_factorize`].
    pub fn of(a: &CsrMatrix, precision: Precision) -> Result<Self, FactorizationError> {
        let mut solver = MultifrontalSolver::new(precision);
        let symbolic = solver.analyse(&a.pattern)?;
        solver.factorize_matrix(&symbolic, a)
    }

    /// Size and quality of the factors.
    pub fn statistics(&self) -> FactorStatistics {
        match &self.factors {
            Factors::Double(numeric) => numeric.statistics,
            Factors::Single(numeric) => numeric.statistics,
        }
    }

    /// Memory of the entries of the factors. \[bytes\]
    fn entry_bytes(&self) -> usize {
        match &self.factors {
            Factors::Double(numeric) => numeric.fronts.iter().map(Front::bytes).sum(),
            Factors::Single(numeric) => numeric.fronts.iter().map(Front::bytes).sum(),
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
        assert_eq!(rhs.len(), self.n(), "the right-hand side needs one entry per unknown");
        self.run(false, rhs);
    }

    fn solve_transpose(&self, rhs: &mut [f64]) {
        assert_eq!(rhs.len(), self.n(), "the right-hand side needs one entry per unknown");
        self.run(true, rhs);
    }

    fn n(&self) -> usize {
        match &self.factors {
            Factors::Double(numeric) => numeric.structure.n,
            Factors::Single(numeric) => numeric.structure.n,
        }
    }

    fn bytes(&self) -> usize {
        self.entry_bytes() + self.n() * 24
    }

    fn cost(&self) -> Option<Cost> {
        let bytes_per_operation = match self.precision() {
            Precision::F64 => BYTES_PER_OPERATION,
            Precision::F32 => 0.5 * BYTES_PER_OPERATION,
        };
        let factorization = bytes_per_operation * self.statistics().operations;
        let facts = self.statistics();
        let passes = facts.entries_read as f64 / facts.factor_entries.max(1) as f64;
        let substitution = passes * self.entry_bytes() as f64 + (self.n() * 24) as f64;
        Some(Cost { factorization, substitution, solves_per_digit: 0.0, further: FURTHER })
    }

    fn part(&self) -> FactorPart {
        FactorPart { bytes: self.bytes(), operations: self.statistics().operations }
    }

    /// The powers of two by which rows were scaled.
    fn row_scaling(&self) -> Option<&[f64]> {
        Some(match &self.factors {
            Factors::Double(numeric) => &numeric.scaling.rows,
            Factors::Single(numeric) => &numeric.scaling.rows,
        })
    }

    fn weakest_pivot(&self) -> Option<Pivot> {
        let facts = self.statistics();
        Some(Pivot { unknown: facts.weakest_unknown, size: facts.smallest_pivot })
    }

    fn is_safe(&self) -> bool {
        let [single, double] = SAFE_PIVOT;
        let pivot = if self.precision() == Precision::F32 { single } else { double };
        self.statistics().smallest_pivot > pivot && self.statistics().growth < SAFE_GROWTH
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
