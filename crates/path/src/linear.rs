//! Reduced linear systems of Newton's method and of the adjoint, with every solve verified by its
//! residual.
//!
//! Factors are reused: while the active set is almost the same, the factors of an earlier tangent
//! precondition GMRES on the current one, until new factors cost less (`reuse.rs`). Factors that the
//! march kept for the adjoint are used in the same way.

mod reduced;
mod tolerance;

use crate::failure::StepFailureKind;
use crate::reuse::{InUse, KeptFactors, LEAST_BUDGET, MOST_CHANGED};
use crate::timings::{Phase, Timings};
use reduced::Cached;
pub(crate) use reduced::Reduced;
use slipstick_linalg::{
    Alternative, Backend, BlockMatrix, Factorization, FactorizationError, LinearSolver, Precision, Ranks, Reduction,
    SolveError, SolveOptions, SolveReport, Symbolic, Transposed, best_in_spans, solve_many_from,
};
use slipstick_status::ContactStatus;
use std::sync::Arc;
pub use tolerance::SolveTolerance;
use tolerance::is_iterative;

/// Removes prescribed unknowns, factorizes and solves; keeps the symbolic work while pattern and
/// fixed set do not change.
///
/// Uzawa's iteration alternates between two systems, with multipliers held and free: each has its
/// own order and factors.
pub struct LinearSystem {
    backend: Arc<dyn Backend>,
    /// Data of the system that was used last.
    current: SystemData,
    /// Data of the system that was used before.
    previous: SystemData,
    /// Number of iterations allowed with earlier factors, instead of the number that follows from
    /// their cost.
    budget: Option<usize>,
    counts: SolveCounts,
    timings: Timings,
    interrupt: Option<Interrupt>,
}

/// Whether to stop, asked from outside; see [`LinearSystem::set_interrupt`].
pub type Interrupt = Arc<dyn Fn() -> bool + Send + Sync>;

/// The data kept for systems with one set of prescribed unknowns.
struct SystemData {
    solver: Box<dyn LinearSolver>,
    cached: Option<Cached>,
    /// The latest analysis, of the pattern of `cached` or of an earlier one.
    symbolic: Option<Symbolic>,
    lagged: Option<InUse>,
}

impl SystemData {
    fn new(backend: &dyn Backend) -> Self {
        Self { solver: backend.solver(), cached: None, symbolic: None, lagged: None }
    }

    fn is_of(&self, fixed: &[bool]) -> bool {
        self.cached.as_ref().is_some_and(|c| c.fixed == fixed)
    }
}

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

/// Maximum number of iterations with the factors of an iterative solver, and maximum number of
/// iterations before a restart: each keeps two vectors.
const MOST_ITERATIONS: usize = 200;
const RESTART: usize = 100;

impl LinearSystem {
    /// With solvers of the given kind, like a [`SolverChoice`](slipstick_linalg::SolverChoice).
    pub fn new(backend: impl Backend + 'static) -> Self {
        let backend: Arc<dyn Backend> = Arc::new(backend);
        let (current, previous) = (SystemData::new(&*backend), SystemData::new(&*backend));
        let (counts, timings) = (SolveCounts::default(), Timings::default());
        Self { backend, current, previous, budget: None, counts, timings, interrupt: None }
    }

    /// A system with the same solvers and settings, for another thread; nothing is counted or
    /// measured yet.
    pub fn another(&self) -> Self {
        let backend = self.backend.clone();
        let (current, previous) = (SystemData::new(&*backend), SystemData::new(&*backend));
        let (counts, timings) = (SolveCounts::default(), self.timings.restarted());
        Self { backend, current, previous, budget: self.budget, counts, timings, interrupt: self.interrupt.clone() }
    }

    /// Adds what another system has counted and measured, which then starts from zero.
    pub fn absorb(&mut self, other: &mut Self) {
        let SolveCounts { factorizations, lagged, lagged_iterations, given_up, fallbacks, factor_bytes, operations } =
            std::mem::take(&mut other.counts);
        self.counts.factorizations += factorizations;
        self.counts.lagged += lagged;
        self.counts.lagged_iterations += lagged_iterations;
        self.counts.given_up += given_up;
        self.counts.fallbacks += fallbacks;
        self.counts.factor_bytes = self.counts.factor_bytes.max(factor_bytes);
        self.counts.operations += operations;
        self.timings = self.timings + other.timings;
        other.timings = other.timings.restarted();
    }

    /// From now on, asks `interrupt` before each solve of Newton's method and of the sweep whether
    /// to stop: `true` ends a march as [`MarchObserver::cancelled`](crate::MarchObserver) does, but
    /// within an attempt, and a sweep with [`StepFailureKind::Interrupted`]. It must give the same
    /// answer on all ranks, and keep it. Test: `interrupted_between_newton_iterations`.
    pub fn set_interrupt(&mut self, interrupt: Option<Interrupt>) {
        self.interrupt = interrupt;
    }

    /// From now on, asks what `other` asks.
    pub fn interrupt_with(&mut self, other: &Self) {
        self.interrupt.clone_from(&other.interrupt);
    }

    /// [`StepFailureKind::Interrupted`] if the caller wants to stop.
    pub(crate) fn check_interrupt(&self) -> Result<(), StepFailureKind> {
        match &self.interrupt {
            Some(interrupt) if interrupt() => Err(StepFailureKind::Interrupted),
            _ => Ok(()),
        }
    }

    /// Sets the number of iterations allowed with earlier factors, whether or not they are expected
    /// to pay off; `None` uses the expected costs. Results agree to the tolerance of the solves.
    pub fn set_budget(&mut self, iterations: Option<usize>) {
        self.budget = iterations;
    }

    /// The ranks that solve together.
    pub fn ranks(&self) -> &dyn Ranks {
        self.backend.ranks()
    }

    /// Counts of factorizations and solves.
    pub fn counts(&self) -> SolveCounts {
        self.counts
    }

    /// Time spent, if it is measured.
    pub fn timings(&self) -> Timings {
        self.timings
    }

    /// Counts the time since `begin` as spent in `phase`.
    pub(crate) fn end(&mut self, phase: Phase, begin: Option<f64>) {
        self.timings.end(phase, begin);
    }

    /// Sets the time measurement, starting from zero; without a clock, none is made.
    pub fn set_timings(&mut self, timings: Timings) {
        self.timings = timings;
    }

    /// Drops all data of earlier systems, so that later results do not depend on them.
    pub fn forget(&mut self) {
        self.current = SystemData::new(&*self.backend);
        self.previous = SystemData::new(&*self.backend);
    }

    /// Drops factors of earlier tangents. Solvers keep their elimination order, scaling, and data for
    /// similar matrices.
    pub(crate) fn forget_factors(&mut self) {
        self.current.lagged = None;
        self.previous.lagged = None;
    }

    /// `y = A x` with the whole matrix, of which `part` belongs to this rank.
    pub(crate) fn product(&self, part: &BlockMatrix, x: &[f64], y: &mut [f64]) {
        part.mul(x, y);
        self.backend.ranks().sum(y);
    }

    /// `y = Aᵀ x`, in the same way.
    pub(crate) fn product_transpose(&self, part: &BlockMatrix, x: &[f64], y: &mut [f64]) {
        part.mul_transpose(x, y);
        self.backend.ranks().sum(y);
    }

    /// Selects the data kept for systems with these prescribed unknowns.
    fn select(&mut self, fixed: &[bool]) {
        if !self.current.is_of(fixed) && (self.previous.is_of(fixed) || self.current.cached.is_some()) {
            std::mem::swap(&mut self.current, &mut self.previous);
        }
    }

    /// The latest factors, if they are of a system with these prescribed unknowns.
    pub(crate) fn latest(&self, fixed: &[bool]) -> Option<&Arc<KeptFactors>> {
        let all = [&self.current, &self.previous].into_iter().filter_map(|system| system.lagged.as_ref());
        all.map(|in_use| &in_use.factors).find(|f| f.fixed == fixed)
    }

    /// The free part of `matrix`, or of its transpose; prepares the data of its pattern.
    pub(crate) fn reduce<'a>(
        &mut self,
        matrix: &BlockMatrix,
        transposed: bool,
        fixed: &'a [bool],
        groups: &[u32],
        active_set: &'a [ContactStatus],
    ) -> Reduced<'a> {
        self.select(fixed);
        let fits = self.current.cached.as_ref().is_some_and(|c| c.pattern == matrix.pattern().id() && c.fixed == fixed);
        // a pattern may be new on one rank only, but all ranks create a layout together
        if self.backend.ranks().any(!fits) {
            let begin = self.timings.begin();
            let alone = self.backend.ranks().size() == 1;
            let new = || match alone {
                true => Reduction::new(matrix.pattern(), fixed, groups),
                false => Reduction::of_part(matrix.pattern(), fixed, groups),
            };
            let kept = self.current.cached.take().filter(|_| fits);
            let reduction = kept.map_or_else(|| Arc::new(new()), |cached| cached.reduction);
            let layout = Arc::new(self.backend.layout(reduction.pattern()));
            let (pattern, fixed) = (matrix.pattern().id(), fixed.to_vec());
            // the block row of a node is the first of its group; that of a multiplier is in the
            // group of its slave node
            let multipliers = groups.iter().enumerate().map(|(row, &group)| group as usize != row).collect();
            self.current.cached = Some(Cached { pattern, fixed, reduction, multipliers, layout });
            self.timings.end(Phase::Analysis, begin);
        }
        let cached = self.current.cached.as_ref().expect("set above");
        let (reduction, layout) = (cached.reduction.clone(), cached.layout.clone());
        let multipliers = cached.multipliers.clone();
        let begin = self.timings.begin();
        let free = if transposed { reduction.reduce_transposed(matrix) } else { reduction.reduce(matrix) };
        let system = Reduced { matrix: free, transposed, fixed, active_set, reduction, multipliers, layout };
        self.timings.end(Phase::Solve, begin);
        system
    }

    /// Computes new factors.
    fn factorize(&mut self, system: &Reduced<'_>) -> Result<Arc<KeptFactors>, StepFailureKind> {
        let fail = |e: FactorizationError| system.failure(e);
        let begin = self.timings.begin();
        let pattern = &system.matrix.pattern;
        let symbolic = self.current.solver.analyse_after(pattern, self.current.symbolic.as_slice()).map_err(fail)?;
        let symbolic = &*self.current.symbolic.insert(symbolic);
        self.timings.end(Phase::Analysis, begin);
        self.counts.factorizations += 1;
        let begin = self.timings.begin();
        let mut singular = None;
        let factors = match self.current.solver.factorize(symbolic, &system.matrix) {
            Err(error @ FactorizationError::Singular { .. }) => {
                let factors = self.current.solver.factorize(symbolic, &system.regularised());
                singular = Some(system.failure(error.clone()));
                factors.map_err(|_| error)
            }
            result => result,
        };
        self.timings.end(Phase::Factor, begin);
        let factors: Arc<dyn Factorization> = factors.map_err(fail)?.into();
        self.counts.fallbacks += usize::from(self.current.solver.is_iterative() && !is_iterative(&*factors));
        let part = factors.part();
        self.counts.factor_bytes = self.counts.factor_bytes.max(part.bytes);
        self.counts.operations += part.operations;
        let (fixed, active_set) = (system.fixed.to_vec(), system.active_set.to_vec());
        Ok(Arc::new(KeptFactors { factors, transposed: system.transposed, fixed, active_set, singular }))
    }

    /// Solves K x = `rhs` on the free unknowns. Uses factors of an earlier tangent if their active
    /// set is almost the same and they are good enough, otherwise new ones. The other unknowns are
    /// set to zero.
    ///
    /// # Errors
    /// [`StepFailureKind::Linear`] if the system cannot be solved to the relative residual
    /// `tolerance`; [`StepFailureKind::Interrupted`].
    pub fn solve(
        &mut self,
        matrix: &BlockMatrix,
        fixed: &[bool],
        groups: &[u32],
        active_set: &[ContactStatus],
        rhs: &[f64],
        tolerance: impl Into<SolveTolerance>,
    ) -> Result<Vec<f64>, StepFailureKind> {
        self.check_interrupt()?;
        let system = self.reduce(matrix, false, fixed, groups, active_set);
        let rhs = [system.restrict(rhs)];
        let mut at_hand = self.current.lagged.take().filter(|f| f.factors.changed_nodes(active_set) <= MOST_CHANGED);
        let start = vec![vec![0.0; rhs[0].len()]];
        let x = self.solve_reduced(&system, &mut at_hand, start, &rhs, tolerance.into())?.0;
        self.current.lagged = at_hand;
        Ok(system.prolong(&x[0], self.ranks()))
    }

    /// Solves a reduced system for several right-hand sides together, with the factors `at_hand` of
    /// a nearby tangent if this costs less than with new factors, which otherwise replace them. Each
    /// iteration starts in the span of `similar` solutions; all vectors have one entry per unknown.
    /// Also returns whether the factors are new.
    ///
    /// # Errors
    /// [`StepFailureKind::Linear`] if the system cannot be solved to the relative residual
    /// `tolerance`.
    pub(crate) fn solve_similar<'a, S: IntoIterator<Item = &'a Vec<f64>>>(
        &mut self,
        system: &Reduced<'_>,
        at_hand: &mut Option<InUse>,
        similar: impl IntoIterator<Item = S>,
        rhs: &[&[f64]],
        tolerance: f64,
    ) -> Result<(Vec<Vec<f64>>, bool), StepFailureKind> {
        let begin = self.timings.begin();
        let rhs: Vec<Vec<f64>> = rhs.iter().map(|rhs| system.restrict(rhs)).collect();
        let matrix = system.on(self.backend.ranks());
        let similar = similar.into_iter().map(|all| all.into_iter().map(|x| system.restrict(x)).collect());
        let starts = best_in_spans(&matrix, &rhs, similar.collect());
        self.timings.end(Phase::Solve, begin);
        let (x, are_new) = self.solve_reduced(system, at_hand, starts, &rhs, tolerance.into())?;
        Ok((x.iter().map(|x| system.prolong(x, self.ranks())).collect(), are_new))
    }

    /// The solutions, found from `x` with the factors at hand or with new ones, which then replace
    /// these, and whether the factors are new.
    fn solve_reduced(
        &mut self,
        system: &Reduced<'_>,
        at_hand: &mut Option<InUse>,
        mut x: Vec<Vec<f64>>,
        rhs: &[Vec<f64>],
        tolerance: SolveTolerance,
    ) -> Result<(Vec<Vec<f64>>, bool), StepFailureKind> {
        let mut unsolved = vec![true; rhs.len()];
        if let Some(in_use) = at_hand.as_mut().filter(|f| f.factors.fixed == system.fixed && !f.outdated) {
            let tolerance = tolerance.with(&*in_use.factors.factors);
            unsolved = self.solve_nearby(system, in_use, &mut x, rhs, tolerance);
        }
        let places: Vec<usize> = (0..rhs.len()).filter(|&k| unsolved[k]).collect();
        if places.is_empty() {
            return Ok((x, false));
        }
        // drop the old factors before the new ones are computed: memory is scarce
        *at_hand = None;
        let starts: Vec<Vec<f64>> = places.iter().map(|&k| std::mem::take(&mut x[k])).collect();
        let rest: Vec<&[f64]> = places.iter().map(|&k| rhs[k].as_slice()).collect();
        let (found, made) = self.solve_with_new_factors(system, &starts, &rest, tolerance)?;
        places.into_iter().zip(found).for_each(|(k, found)| x[k] = found);
        *at_hand = Some(made);
        Ok((x, true))
    }

    /// The solutions with new factors, and these factors. If those of an iterative solver do not lead
    /// to a solution, direct solvers are used from then on; if those in single precision do not,
    /// double precision.
    fn solve_with_new_factors(
        &mut self,
        system: &Reduced<'_>,
        starts: &[Vec<f64>],
        rhs: &[&[f64]],
        tolerance: SolveTolerance,
    ) -> Result<(Vec<Vec<f64>>, InUse), StepFailureKind> {
        let factors = self.factorize(system)?;
        let wanted = tolerance.with(&*factors.factors);
        let result = self.solve_exact(system, &factors, starts, rhs, wanted);
        let failed = match result {
            Ok((x, reports)) => {
                let mut made = InUse::new(factors);
                made.count(&system.on(self.backend.ranks()), &reports, wanted);
                return Ok((x, made));
            }
            Err(failed) => failed,
        };
        let precision = factors.factors.precision();
        let iterative = is_iterative(&*factors.factors);
        drop(factors);
        let replaced = iterative && self.current.solver.insist_on_direct();
        self.counts.fallbacks += usize::from(replaced);
        if replaced || precision == Precision::F32 && self.current.solver.insist_on_double() {
            return self.solve_with_new_factors(system, starts, rhs, tolerance);
        }
        Err(failed)
    }

    /// The solutions, found from `starts` with the factors of the system itself.
    fn solve_exact(
        &mut self,
        system: &Reduced<'_>,
        factors: &KeptFactors,
        starts: &[Vec<f64>],
        rhs: &[&[f64]],
        tolerance: f64,
    ) -> Result<(Vec<Vec<f64>>, Vec<SolveReport>), StepFailureKind> {
        let mut x = starts.to_vec();
        if factors.singular.is_some() {
            // only from zero does the iteration find the smallest multipliers
            x.iter_mut().for_each(|x| x.fill(0.0));
        }
        let begin = self.timings.begin();
        let matrix = system.on(self.backend.ranks());
        let options = match is_iterative(&*factors.factors) {
            true => SolveOptions { max_iterations: MOST_ITERATIONS, restart: RESTART, ..SolveOptions::new(tolerance) },
            false => SolveOptions::new(tolerance),
        };
        let results = solve_many_from(&matrix, factors.factors.as_ref(), false, rhs, &mut x, &options);
        self.timings.end(Phase::Solve, begin);
        // without a solution, the conditions are contradictory rather than redundant, or something
        // is free to move
        let failure =
            |e: SolveError| factors.singular.clone().unwrap_or_else(|| StepFailureKind::Linear(e.to_string()));
        let reports: Result<Vec<SolveReport>, SolveError> = results.into_iter().collect();
        reports.map(|reports| (x, reports)).map_err(failure)
    }

    /// Solves from `x` with factors of a nearby tangent, unless new ones are expected to cost less.
    /// Returns which right-hand sides are left without a solution; another attempt starts at their `x`.
    fn solve_nearby(
        &mut self,
        system: &Reduced<'_>,
        in_use: &mut InUse,
        x: &mut [Vec<f64>],
        rhs: &[Vec<f64>],
        tolerance: f64,
    ) -> Vec<bool> {
        let matrix = &system.on(self.backend.ranks());
        let factors = in_use.factors.factors.clone();
        let alternative = match self.budget {
            Some(budget) => Some(Alternative { preparation: budget as f64, per_digit: 0.0 }),
            None => in_use.alternative(matrix, system.transposed, rhs.len()),
        };
        let budget = alternative.map_or(0.0, |alternative| alternative.cost(-tolerance.log10().min(0.0))) as usize;
        if budget < LEAST_BUDGET {
            return vec![true; rhs.len()];
        }
        if in_use.factors.singular.is_some() {
            // only from zero does the iteration find the smallest multipliers
            x.iter_mut().for_each(|x| x.fill(0.0));
        }
        // the prediction decides; this only bounds it
        let max_iterations = self.budget.unwrap_or(2 * budget);
        let options = SolveOptions { tolerance, max_iterations, restart: max_iterations.min(RESTART), alternative };
        let begin = self.timings.begin();
        let rhs: Vec<&[f64]> = rhs.iter().map(Vec::as_slice).collect();
        let results = if in_use.factors.transposed == system.transposed {
            solve_many_from(matrix, factors.as_ref(), false, &rhs, x, &options)
        } else {
            solve_many_from(matrix, &Transposed(factors.as_ref()), false, &rhs, x, &options)
        };
        self.timings.end(Phase::Solve, begin);
        let mut reports = Vec::new();
        let mut unsolved = Vec::new();
        for (x, result) in x.iter_mut().zip(results) {
            unsolved.push(result.is_err());
            match result {
                Ok(report) => {
                    self.counts.lagged += 1;
                    self.counts.lagged_iterations += report.iterations;
                    reports.push(report);
                }
                Err(error) => {
                    self.counts.given_up += 1;
                    let useful = |report: SolveReport| report.relative_residual < 1.0;
                    if !matches!(error, SolveError::NotConverged { report, .. } if useful(report)) {
                        x.fill(0.0);
                    }
                }
            }
        }
        if self.budget.is_none() {
            in_use.count(matrix, &reports, tolerance);
        }
        unsolved
    }
}
