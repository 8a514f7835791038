//! The linear solver: scaling, elimination order, and factors on a device.

use crate::device::Device;
use crate::dissection::Dissection;
use crate::error::CudssError;
use crate::factors::{Factors, Number, Places};
use rayon::prelude::*;
use slipstick_linalg::{
    Backend, Cost, CsrMatrix, CsrPattern, EliminationTree, FactorPart, Factorization, FactorizationError, LinearSolver,
    Link, MultifrontalSolver, Precision, RobustSolver, Scaling, Symbolic,
};
use std::sync::{Arc, Mutex, PoisonError};

/// Unknowns above which the processor is not tried if the device fails: it would take too long.
const LARGEST_FALLBACK: usize = 120_000;

/// Bytes that a core of the processor moves while the device does one operation of a factorization,
/// while an entry of the matrix is scaled and copied there, and while a solve reads one byte of the
/// factors. Fitted to the times of docs/measurements/gpu.md with 101,000 and 303,000 unknowns, for a core that moves
/// 8 GB/s. The ratios decide how long factors are reused.
const BYTES_PER_OPERATION: f64 = 3e-4;
const BYTES_PER_ENTRY: f64 = 64.0;
const BYTES_PER_BYTE: f64 = 0.01;

/// Sets of factors that are kept for the next matrix: the latest, and the one that it replaced, which
/// may still be in use while the latest is computed.
const MOST_KEPT: usize = 2;

/// Solvers on a device: in single precision, then in double. If both fail on a matrix of moderate
/// size, the multifrontal solver of the processor follows, which can name the unknown at which a
/// matrix is singular.
#[derive(Debug, Clone)]
pub struct CudssBackend {
    device: Arc<Device>,
}

impl CudssBackend {
    /// On `device`.
    pub fn new(device: Arc<Device>) -> Self {
        Self { device }
    }
}

impl Backend for CudssBackend {
    fn solver(&self) -> Box<dyn LinearSolver> {
        let single = CudssSolver::new(&self.device, Precision::F32);
        let double = single.in_precision(Precision::F64);
        Box::new(RobustSolver::of(vec![
            Link::new(single),
            Link::new(double),
            Link::new(MultifrontalSolver::new(Precision::F64)).up_to(LARGEST_FALLBACK),
        ]))
    }
}

/// Computes factors on a device.
///
/// The elimination order is that of [`MultifrontalSolver`], in which a multiplier follows its
/// node, so that its pivot is not zero.
#[derive(Debug)]
pub struct CudssSolver {
    device: Arc<Device>,
    precision: Precision,
    /// The scaling of the latest matrix.
    scaling: Option<Scaling>,
    /// Recent factors, the newest last, of this solver and of those
    /// [in another precision](Self::in_precision). Those that nothing else uses are overwritten, or
    /// freed for another pattern or precision.
    kept: Arc<Mutex<Vec<Arc<Factors>>>>,
}

/// The analysis of a pattern: for this one, or for an earlier one whose dissection suits it. The
/// number of operations is then that of the earlier one.
#[derive(Debug)]
struct Analysis {
    tree: Arc<EliminationTree>,
    dissection: Arc<Dissection>,
}

impl CudssSolver {
    /// A solver with factors of the given precision.
    pub fn new(device: &Arc<Device>, precision: Precision) -> Self {
        Self { device: device.clone(), precision, scaling: None, kept: Arc::default() }
    }

    /// A solver for the same matrices in another precision, which frees the factors of this one
    /// that nothing else uses.
    pub fn in_precision(&self, precision: Precision) -> Self {
        Self { precision, kept: self.kept.clone(), ..Self::new(&self.device, precision) }
    }

    fn fail(n: usize, error: impl ToString) -> FactorizationError {
        FactorizationError::Backend { solver: "cuDSS", n, reason: error.to_string() }
    }

    /// Factors that can be overwritten, or new ones.
    fn factors<T: Number>(&self, pattern: &CsrPattern, dissection: &Dissection) -> Result<Arc<Factors>, CudssError> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.retain(|factors| factors.places.id == pattern.id() && factors.precision == T::PRECISION);
        if let Some(unused) = kept.iter().position(|factors| Arc::strong_count(factors) == 1) {
            return Ok(kept.remove(unused));
        }
        let places = match kept.first() {
            Some(factors) => factors.places.clone(),
            None => Arc::new(Places::new(&self.device, pattern)?),
        };
        Ok(Arc::new(Factors::new::<T>(&self.device, &places, dissection)?))
    }

    fn factorize_scaled<T: Number>(
        &mut self,
        analysis: &Analysis,
        a: &CsrMatrix,
        convert: impl Fn(f64) -> T + Sync,
    ) -> Result<CudssFactorization, CudssError> {
        let scaling = Scaling::follow(self.scaling.take(), a);
        let factors = self.factors::<T>(&a.pattern, &analysis.dissection)?;
        factors.renew(&scaling.apply(a, convert))?;
        let (entries, bytes) = (a.values.len(), factors.bytes()?);
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.len() == MOST_KEPT {
            kept.remove(0);
        }
        kept.push(factors.clone());
        self.scaling = Some(scaling.clone());
        Ok(CudssFactorization { factors, scaling, entries, bytes, operations: analysis.tree.size().1 })
    }
}

impl LinearSolver for CudssSolver {
    fn name(&self) -> &'static str {
        match self.precision {
            Precision::F64 => "cuDSS in double precision",
            Precision::F32 => "cuDSS in single precision",
        }
    }

    fn analyse_after(&self, pattern: &Arc<CsrPattern>, earlier: &[Symbolic]) -> Result<Symbolic, FactorizationError> {
        let own = || earlier.iter().filter_map(|symbolic| Some((symbolic, symbolic.content::<Analysis>()?)));
        if let Some((symbolic, _)) = own().find(|(symbolic, _)| symbolic.is_of(pattern)) {
            return Ok(symbolic.clone());
        }
        if i32::try_from(pattern.entries()).is_err() {
            return Err(Self::fail(pattern.n(), "the matrix has 2^31 entries or more"));
        }
        let earlier = own().next().map(|(_, analysis)| analysis);
        let suits = |earlier: &&Analysis| earlier.tree.has_unknowns_of(pattern) && earlier.dissection.suits(pattern);
        if let Some(Analysis { tree, dissection }) = earlier.filter(suits) {
            return Ok(Symbolic::new(pattern, Analysis { tree: tree.clone(), dissection: dissection.clone() }));
        }
        let tree = EliminationTree::new(pattern, earlier.map(|analysis| analysis.tree.as_ref()));
        let tree = tree.map_err(|reason| Self::fail(pattern.n(), reason))?;
        let dissection = Arc::new(Dissection::of(&tree));
        Ok(Symbolic::new(pattern, Analysis { tree: Arc::new(tree), dissection }))
    }

    fn factorize(&mut self, symbolic: &Symbolic, a: &CsrMatrix) -> Result<Box<dyn Factorization>, FactorizationError> {
        let analysis = symbolic.content_for::<Analysis>(a)?;
        if a.n() == 0 {
            return Err(Self::fail(0, "the matrix is empty"));
        }
        let made = match self.precision {
            Precision::F32 => self.factorize_scaled(analysis, a, |value| value as f32),
            Precision::F64 => self.factorize_scaled(analysis, a, |value| value),
        };
        match made {
            Ok(factors) => Ok(Box::new(factors)),
            Err(error) => {
                // what the device still holds may be unusable, or fill its memory
                self.kept.lock().unwrap_or_else(PoisonError::into_inner).clear();
                Err(Self::fail(a.n(), error))
            }
        }
    }

    fn precision(&self) -> Precision {
        self.precision
    }

    fn insist_on_double(&mut self) -> bool {
        std::mem::replace(&mut self.precision, Precision::F64) == Precision::F32
    }
}

/// Factors on a device.
#[derive(Debug)]
struct CudssFactorization {
    factors: Arc<Factors>,
    scaling: Scaling,
    /// Entries of the matrix.
    entries: usize,
    /// Memory on the device. \[bytes\]
    bytes: usize,
    /// Floating-point operations of a factorization.
    operations: f64,
}

impl CudssFactorization {
    /// A failed solve leaves NaN, which no verified solve accepts as a solution.
    fn apply(&self, transpose: bool, rhs: &mut [f64]) {
        assert_eq!(rhs.len(), self.n(), "the right-hand side needs one entry per unknown");
        let (before, after) = match transpose {
            false => (&self.scaling.rows, &self.scaling.columns),
            true => (&self.scaling.columns, &self.scaling.rows),
        };
        scale(rhs, before);
        let solved = match self.factors.precision {
            Precision::F32 => self.apply_in_single(transpose, rhs),
            Precision::F64 => self.factors.solve(transpose, rhs),
        };
        if solved.is_err() {
            rhs.fill(f64::NAN);
        }
        scale(rhs, after);
    }

    /// Divides by the largest entry, because single precision has a smaller range.
    fn apply_in_single(&self, transpose: bool, rhs: &mut [f64]) -> Result<(), CudssError> {
        let largest = rhs.iter().fold(0.0f64, |largest, b| largest.max(b.abs()));
        let size = if largest > 0.0 { largest } else { 1.0 };
        let mut single: Vec<f32> = rhs.iter().map(|b| (b / size) as f32).collect();
        self.factors.solve(transpose, &mut single)?;
        rhs.iter_mut().zip(single).for_each(|(b, x)| *b = size * f64::from(x));
        Ok(())
    }
}

/// Multiplies each entry by its factor.
fn scale(vector: &mut [f64], factors: &[f64]) {
    vector.par_iter_mut().zip(factors).with_min_len(16_384).for_each(|(v, factor)| *v *= factor);
}

impl Factorization for CudssFactorization {
    fn solve(&self, rhs: &mut [f64]) {
        self.apply(false, rhs);
    }

    fn solve_transpose(&self, rhs: &mut [f64]) {
        self.apply(true, rhs);
    }

    fn n(&self) -> usize {
        self.scaling.rows.len()
    }

    /// On the device.
    fn bytes(&self) -> usize {
        self.bytes
    }

    fn precision(&self) -> Precision {
        self.factors.precision
    }

    fn cost(&self) -> Option<Cost> {
        let factorization = BYTES_PER_OPERATION * self.operations + BYTES_PER_ENTRY * self.entries as f64;
        let substitution = BYTES_PER_BYTE * self.bytes as f64 + (self.n() * 24) as f64;
        Some(Cost { factorization, substitution, solves_per_digit: 0.0, further: 1.0 })
    }

    fn part(&self) -> FactorPart {
        FactorPart { bytes: self.bytes, operations: self.operations }
    }

    fn row_scaling(&self) -> Option<&[f64]> {
        Some(&self.scaling.rows)
    }
}
