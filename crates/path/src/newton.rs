//! Semi-smooth Newton's method for one (sub-)step.

use crate::failure::{StateError, StepFailure, StepFailureKind};
use crate::linear::SolveTolerance;
use crate::problem::{Evaluated, Held, Iteration, Scales, StepProblem, Wanted};
use crate::solver::Solver;

/// A bound on a norm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tolerance {
    /// Bound on the norm itself, in its own unit, as in the paper.
    Absolute(f64),
    /// Dimensionless bound on the norm divided by the problem's [`Scales`].
    Relative(f64),
}

impl Tolerance {
    fn allows(self, norm: f64, scale: f64) -> bool {
        match self {
            Self::Absolute(bound) => norm <= bound,
            Self::Relative(bound) => norm <= bound * scale,
        }
    }

    /// The bound as a fraction of the scale.
    fn relative_to(self, scale: f64) -> f64 {
        match self {
            Self::Absolute(bound) => bound / scale,
            Self::Relative(bound) => bound,
        }
    }

    /// Whether an increment is within the bound: an absolute bound applies to the last increment,
    /// as in the paper, unless the expected next one is much smaller, and a relative bound to the
    /// expected next increment.
    fn allows_increment(self, last: f64, next: f64, scale: f64) -> bool {
        match self {
            Self::Absolute(bound) => last <= bound || next <= FAR_BELOW * bound,
            Self::Relative(bound) => next <= bound * scale,
        }
    }
}

/// The four bounds of the paper's section 5: ε_res, ε_disp, ε_con and ε_LMM.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerances {
    /// Norm of the force residual R over the free unknowns.
    pub residual: Tolerance,
    /// Norm of the displacement increment: a relative bound applies to the expected next increment,
    /// an absolute bound to the last, unless a thousandth of it bounds the next.
    pub displacement: Tolerance,
    /// Norm of the contact residual H.
    pub contact: Tolerance,
    /// Norm of the multiplier increment, treated in the same way.
    pub multiplier: Tolerance,
}

impl Default for Tolerances {
    fn default() -> Self {
        let all = Tolerance::Relative(1e-9);
        Self { residual: all, displacement: all, contact: all, multiplier: all }
    }
}

/// Settings of Newton's method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewtonOptions {
    /// Stopping criteria.
    pub tolerances: Tolerances,
    /// Maximum number of iterations of a (sub-)step; twice as many while the residual still falls.
    pub max_iterations: usize,
    /// Relative residual of the linear solves.
    pub linear_tolerance: f64,
}

impl Default for NewtonOptions {
    fn default() -> Self {
        Self { tolerances: Tolerances::default(), max_iterations: 25, linear_tolerance: 1e-10 }
    }
}

impl NewtonOptions {
    /// Relative residual of the next linear solve. It is proportional to the scaled residual `size`, so
    /// that convergence stays quadratic, until the tolerances are near.
    fn forcing(&self, size: f64, scales: &Scales) -> f64 {
        let Tolerances { residual, contact, .. } = self.tolerances;
        let enough = residual.relative_to(scales.force).min(contact.relative_to(scales.multiplier));
        let proportional = (FORCING * size).max(OVERSOLVED * enough / size);
        proportional.min(LOOSEST_SOLVE).max(self.linear_tolerance)
    }
}

/// Norms of one iteration, as absolute values.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct IterationRecord {
    /// Number of tangent solves so far in this Newton loop.
    pub iteration: usize,
    /// ‖R‖ over the free displacements, after the update. \[F\]
    pub residual: f64,
    /// ‖H‖. \[F/L²\]
    pub contact: f64,
    /// ‖Δd‖ of the update. \[L\]
    pub displacement: f64,
    /// ‖Δζ‖ of the update. \[F/L²\]
    pub multiplier: f64,
    /// Fraction of the Newton increment that was taken.
    pub step_length: f64,
    /// Numbers of contact nodes that are open, sticking, slipping.
    pub status: [usize; 3],
}

/// Multiple of the maximum number of iterations that are made while the residual [still
/// falls](still_falls).
const EXTENSION: usize = 2;

/// Number of iterations that [`still_falls`] considers.
const JUDGED: usize = 5;

/// Whether, over the last iterations, the force residual fell to less than half without an increase
/// of the contact residual; if so, more iterations would probably converge.
pub fn still_falls(iterations: &[IterationRecord]) -> bool {
    let [first, .., last] = &iterations[iterations.len().saturating_sub(JUDGED)..] else { return false };
    last.residual < 0.5 * first.residual && last.contact <= first.contact
}

/// How a (sub-)step converged.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StepReport {
    /// All Newton iterations, concatenated over all Uzawa iterations.
    pub iterations: Vec<IterationRecord>,
    /// Newton iterations of the attempts that failed between the previous state and this one.
    pub failed_iterations: usize,
    /// Uzawa iterations (0 for methods without them).
    pub uzawa: usize,
    /// Whether Newton's method failed, and [Uzawa's iteration over all
    /// multipliers](crate::Attempt::Rescue) or a [growing penalty](crate::Attempt::Penalty) led to the state: it may
    /// lie beyond a jump of the contact.
    pub rescued: bool,
    /// Whether the step [holds free motions](crate::HoldFreeMotions).
    pub holds: bool,
    /// The motions that are free at the state and so were held, in words.
    pub left_free: Vec<String>,
    /// Norm of the forces that hold them, relative to the forces in equilibrium.
    pub holding: f64,
    /// Work that these forces take in the step. \[F L\]
    pub holding_work: f64,
    /// If the last Newton iteration was limited by round-off of the positions, the remaining
    /// relative residual; `None` if it met the tolerances.
    pub rounded: Option<f64>,
}

/// An increment below this fraction of the positions is round-off, namely that of x = X + d
/// multiplied by the summation over a mortar row.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Largest relative residual that round-off of the positions may leave; a stiff penalty amplifies
/// it.
const ROUNDED: f64 = 1e-8;

/// Iterations without a new best residual after which increments are damped.
const STALLED: usize = 3;

/// A residual counts as a new best if it is below this fraction of the best so far.
const PROGRESS: f64 = 0.7;

/// Growth of the residual in one iteration after which increments are damped.
const OUTBURST: f64 = 3.0;

/// Fraction of the decrease predicted by the linear model that a damped increment must achieve
/// (Armijo).
const ARMIJO: f64 = 1e-2;

/// Scaled residual below which one more iteration is expected to converge.
const NEARLY: f64 = 1e-5;

/// Largest ratio of two increments for which the next one is predicted.
const CONTRACTION: f64 = 0.1;

/// Fraction of an absolute bound that the expected next increment may reach if the last one exceeds the
/// bound.
const FAR_BELOW: f64 = 1e-3;

/// Ratio of the relative residual of a linear solve to the scaled residual of the nonlinear
/// equations, and the upper bound on the former: the residual that the nonlinearity leaves is rarely
/// below a hundredth of the previous one while the active set changes.
const FORCING: f64 = 1e-2;
const LOOSEST_SOLVE: f64 = 1e-2;

/// Relative residual of the first solve with an iterative solver, whose iterations stop there, while
/// direct factors leave far less. The forces of the prescribed motion, which enter the first
/// right-hand side, are large if a body is nearly incompressible. If a hundredth of them remains, the
/// contact starts far from its state: a block with ν = 0.499 on a slab needs 45 instead of 18 Newton
/// iterations. Test: `nearly_incompressible_bodies_take_few_iterations` (crate slipstick).
const FIRST_ITERATIVE_SOLVE: f64 = 1e-4;

/// Fraction of the tolerances below which a linear solve need not bring the residual of the nonlinear
/// equations: more digits would not be used (Kelley, Iterative Methods for Linear and Nonlinear
/// Equations, SIAM 1995, 6.3).
const OVERSOLVED: f64 = 1e-3;

/// Largest growth of the residual, relative to its value after the first solve, that does not count
/// as divergence.
const DIVERGED: f64 = 1e8;

/// Initial unknowns of Newton's method.
pub(crate) struct Start<P: StepProblem> {
    /// y. Its prescribed entries may still hold the last step's values.
    pub unknowns: Vec<f64>,
    /// Geometry at these displacements, if known.
    pub geometry: Option<P::Geometry>,
    /// Whether the step begins here.
    pub at_start: bool,
}

impl<P: StepProblem> Clone for Start<P> {
    fn clone(&self) -> Self {
        let Self { unknowns, geometry, at_start } = self;
        Self { unknowns: unknowns.clone(), geometry: geometry.clone(), at_start: *at_start }
    }
}

impl<P: StepProblem> From<Evaluated<P>> for Start<P> {
    fn from(at: Evaluated<P>) -> Self {
        Self { unknowns: at.unknowns, geometry: Some(at.geometry), at_start: false }
    }
}

/// Solves F(y) = 0 with the prescribed values of `target`, starting from `start`. The first solve
/// applies the Dirichlet increment through the tangent: K_ff Δy_f = −F_f − K_fp Δy_p.
///
/// If round-off of the positions keeps the residual above the tolerances, the iteration ends there:
/// the increment is a few units in the last place of the positions, and the residual no longer
/// falls. If the residual stalls, increments are damped by a line search.
///
/// Paper: (28)–(30), (36), (45). Test: `newton_converges_quadratically` (crate slipstick).
pub(crate) fn solve<P: StepProblem>(
    solver: &mut Solver<'_, P>,
    step: &P::Step,
    start: Start<P>,
    target: &[f64],
    options: &NewtonOptions,
    iteration: Iteration,
    report: &mut StepReport,
) -> Result<Evaluated<P>, StepFailure> {
    let (y, progress, records) = (start.unknowns.clone(), Progress::default(), Vec::new());
    let mut run = Run { solver, step, target, options, iteration, y, progress, records };
    let result = run.iterate(&start);
    let Run { y: iterate, records, .. } = run;
    let at_start = start.at_start && records.is_empty();
    report.iterations.extend(records);
    match result {
        Ok((at, rounded)) => {
            report.rounded = rounded;
            Ok(at)
        }
        Err(kind) => Err(StepFailure { kind, iterations: std::mem::take(&mut report.iterations), iterate, at_start }),
    }
}

/// A run of Newton's method.
struct Run<'r, 's, P: StepProblem> {
    solver: &'r mut Solver<'s, P>,
    step: &'r P::Step,
    target: &'r [f64],
    options: &'r NewtonOptions,
    iteration: Iteration,
    /// The latest trial, at which the equations may be undefined.
    y: Vec<f64>,
    progress: Progress,
    records: Vec<IterationRecord>,
}

impl<P: StepProblem> Run<'_, '_, P> {
    fn iterate(&mut self, start: &Start<P>) -> Result<(Evaluated<P>, Option<f64>), StepFailureKind> {
        let problem = self.solver.problem;
        let (n, displacements) = (problem.unknowns().count(), problem.unknowns().displacements);
        let fixed = problem.unknowns().fixed(self.iteration.held);
        let begin = Iteration { at_start: start.at_start, ..self.iteration };
        let mut wanted = Wanted::Both;
        let geometry = start.geometry.as_ref();
        let mut at = problem.evaluate(self.step, &self.y, geometry, begin, wanted, self.solver.workspace)?;
        let mut sets = ActiveSets::default();
        let mut reference = f64::INFINITY;
        let least = |tolerance: f64| tolerance.max(self.options.linear_tolerance);
        let mut forcing = SolveTolerance { direct: least(LOOSEST_SOLVE), iterative: least(FIRST_ITERATIVE_SOLVE) };
        let mut last_size = f64::INFINITY;
        for iteration in 1..=EXTENSION * self.options.max_iterations {
            let more = || self.records.len() >= JUDGED && still_falls(&self.records);
            if iteration > self.options.max_iterations && !more() {
                break;
            }
            if !wanted.derivatives() {
                at = self.with_derivatives(at)?;
            }
            let mut rhs: Vec<f64> = at.residual.iter().map(|r| -r).collect();
            let Solver { linear, workspace, .. } = &mut *self.solver;
            let matrix = problem.tangent(self.step, &at, workspace)?;
            if iteration == 1 {
                let (mut prescribed, mut carried) = (vec![0.0; n], vec![0.0; n]);
                for i in (0..displacements).filter(|&i| fixed[i]) {
                    prescribed[i] = self.target[i] - self.y[i];
                }
                linear.product(matrix, &prescribed, &mut carried);
                rhs.iter_mut().zip(&carried).for_each(|(r, c)| *r -= c);
            }
            let groups = &problem.unknowns().groups;
            let mut increment = linear.solve(matrix, fixed, groups, &at.active_set, &rhs, forcing)?;
            if iteration == 1 {
                for i in (0..displacements).filter(|&i| fixed[i]) {
                    increment[i] = self.target[i] - self.y[i];
                }
            }
            finite(&increment, "the Newton increment")?;
            wanted = if last_size > NEARLY { Wanted::Both } else { Wanted::Residual };
            // the first increment contains the prescribed motion, so it is taken in full
            let base = Base::from(at);
            let (next, step_length) = match iteration {
                1 => (self.try_length(&base, &increment, 1.0, wanted)?, 1.0),
                _ => self.advance(&base, &increment, fixed, wanted)?,
            };
            let record = record(iteration, displacements, &next, &increment, fixed, step_length);
            let settled = base.active_set == next.active_set;
            at = next;
            let scales = &at.scales;
            let size = record.residual / scales.force + record.contact / scales.multiplier;
            let foreseen = foreseen(self.records.last().filter(|_| settled), &record, size / last_size);
            self.records.push(record);
            if converged(&record, foreseen, scales, &self.options.tolerances) {
                return Ok((at, None));
            }
            let progress = &mut self.progress;
            // without stress, the scale of forces says nothing about the round-off of the residual
            let rounded = size <= ROUNDED || record.residual <= f64::EPSILON * scales.rigidity;
            if rounded && record.displacement <= ROUNDING * scales.position && !progress.falls_to(size) {
                return Ok((at, Some(size)));
            }
            progress.add(size);
            last_size = size;
            forcing = self.options.forcing(size, scales).into();
            if iteration == 1 {
                reference = size.max(1.0);
            } else if !(size < DIVERGED * reference) {
                return Err(StepFailureKind::Diverged);
            }
            // with damping, the residual falls in each iteration, so no active set can recur
            let cycle = sets.cycling(&at.active_set);
            if let (Some(nodes), false, false) = (cycle, progress.damped, progress.since == 0) {
                return Err(StepFailureKind::Cycling { nodes });
            }
        }
        let changing = sets.changing(&at.active_set);
        Err(StepFailureKind::TooManyIterations { iterations: self.records.len(), changing })
    }

    /// The same evaluation with its derivatives.
    fn with_derivatives(&mut self, at: Evaluated<P>) -> Result<Evaluated<P>, StateError> {
        let (problem, wanted) = (self.solver.problem, Wanted::Derivatives);
        let Evaluated { unknowns, residual, scales, geometry, .. } = at;
        let workspace = &mut *self.solver.workspace;
        let again = problem.evaluate(self.step, &unknowns, Some(&geometry), self.iteration, wanted, workspace)?;
        Ok(Evaluated { residual, scales, ..again })
    }

    /// Returns the evaluation at the first of the fractions α = 1, 1/2, … 1/16 of the increment for
    /// which the residual exists and is small enough, together with α. If none is small enough, it
    /// returns the best.
    ///
    /// A full increment may increase the residual, as often happens on the way to the right active
    /// set. After a stall or an outburst, increments are damped: the residual must fall as the
    /// linear model predicts. Newton's increment is a descent direction for the norm of the
    /// residual wherever the equations are differentiable. Damping therefore also ends cycles
    /// between branches of the friction law, which a smaller load increment would not end (at first
    /// contact, the problem is homogeneous). Scales are frozen at the start of the line search.
    fn advance(
        &mut self,
        start: &Base,
        increment: &[f64],
        fixed: &[bool],
        wanted: Wanted,
    ) -> Result<(Evaluated<P>, f64), StateError> {
        let (split, scales) = (self.solver.problem.unknowns().displacements, start.scales);
        let size = |residual: &[f64]| {
            free_norm(&residual[..split], &fixed[..split]) / scales.force
                + free_norm(&residual[split..], &fixed[split..]) / scales.multiplier
        };
        let before = size(&start.residual);
        let mut best: Option<(Evaluated<P>, f64, f64)> = None;
        let mut failure = None;
        for halvings in 0..5 {
            let length = 0.5f64.powi(halvings);
            match self.try_length(start, increment, length, wanted) {
                Ok(there) => {
                    let after = size(&there.residual);
                    self.progress.damped |= after > OUTBURST * before.max(ROUNDED);
                    if !self.progress.damped || after <= (1.0 - ARMIJO * length) * before {
                        return Ok((there, length));
                    }
                    if best.as_ref().is_none_or(|(.., least)| after < *least) {
                        best = Some((there, length, after));
                    }
                }
                Err(error) => failure = Some(error),
            }
        }
        match (best, failure) {
            (Some((there, length, _)), _) => {
                self.y.clone_from(&there.unknowns);
                Ok((there, length))
            }
            (None, error) => Err(error.expect("every length failed")),
        }
    }

    /// The equations at y = start + α Δ.
    fn try_length(
        &mut self,
        start: &Base,
        increment: &[f64],
        length: f64,
        wanted: Wanted,
    ) -> Result<Evaluated<P>, StateError> {
        for (y, (start, increment)) in self.y.iter_mut().zip(start.unknowns.iter().zip(increment)) {
            *y = start + length * increment;
        }
        if self.records.is_empty() {
            // the sum above has round-off
            let fixed = self.solver.problem.unknowns().fixed(Held::None);
            let split = self.solver.problem.unknowns().displacements;
            (0..split).filter(|&i| fixed[i]).for_each(|i| self.y[i] = self.target[i]);
        }
        let workspace = &mut *self.solver.workspace;
        let at = self.solver.problem.evaluate(self.step, &self.y, None, self.iteration, wanted, workspace)?;
        finite(&at.residual, "the residual")?;
        Ok(at)
    }
}

/// The data of an iteration's initial state that are still needed once the increment is known. The
/// state's geometry and laws are dropped before the next state is evaluated, so that it can reuse
/// their memory.
struct Base {
    unknowns: Vec<f64>,
    residual: Vec<f64>,
    scales: Scales,
    active_set: Vec<u8>,
}

impl<P: StepProblem> From<Evaluated<P>> for Base {
    fn from(at: Evaluated<P>) -> Self {
        let Evaluated { unknowns, residual, scales, active_set, .. } = at;
        Self { unknowns, residual, scales, active_set }
    }
}

/// Tracks the decrease of the residual.
#[derive(Default)]
struct Progress {
    best: Option<f64>,
    since: usize,
    /// Set at the first stall or outburst.
    damped: bool,
}

impl Progress {
    fn add(&mut self, size: f64) {
        if self.best.is_none_or(|best| size < PROGRESS * best) {
            self.best = Some(size);
            self.since = 0;
        } else {
            self.since += 1;
            self.damped |= self.since >= STALLED;
        }
    }

    /// Whether `size` is still well below the best so far.
    fn falls_to(&self, size: f64) -> bool {
        self.best.is_none_or(|best| size < 0.1 * best)
    }
}

fn finite(values: &[f64], quantity: &'static str) -> Result<(), StateError> {
    match values.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(StateError::NotFinite { quantity: quantity.into(), index }),
        None => Ok(()),
    }
}

fn record<P: StepProblem>(
    iteration: usize,
    displacements: usize,
    at: &Evaluated<P>,
    increment: &[f64],
    fixed: &[bool],
    step_length: f64,
) -> IterationRecord {
    let norm = |values: &[f64]| {
        let (d, zeta) = values.split_at(displacements);
        (free_norm(d, &fixed[..displacements]), free_norm(zeta, &fixed[displacements..]))
    };
    let ((residual, contact), (displacement, multiplier)) = (norm(&at.residual), norm(increment));
    let mut status = [0; 3];
    for &s in &at.active_set {
        status[s as usize] += 1;
    }
    IterationRecord {
        iteration,
        residual,
        contact,
        displacement: step_length * displacement,
        multiplier: step_length * multiplier,
        step_length,
        status,
    }
}

fn free_norm(values: &[f64], fixed: &[bool]) -> f64 {
    values.iter().zip(fixed).filter(|(_, fixed)| !**fixed).map(|(v, _)| v * v).sum::<f64>().sqrt()
}

/// Estimates the norms of the next increments (displacements, multipliers). If full increments of the
/// displacements contract fast and the active set does not change, these are the last norms times a
/// factor: the square of that contraction, as Newton's method is expected to repeat it, but at least
/// the `fall` of the scaled residual, to which the next increments are proportional and in which the
/// error of the linear solve shows. (Deuflhard, Newton Methods for Nonlinear Problems, 2.1.)
fn foreseen(before: Option<&IterationRecord>, last: &IterationRecord, fall: f64) -> (f64, f64) {
    let full = |b: &&IterationRecord| b.step_length == 1.0 && last.step_length == 1.0;
    let factor = before.filter(full).map_or(1.0, |before| {
        let contraction = last.displacement / before.displacement;
        if contraction < CONTRACTION { fall.max(contraction * contraction) } else { 1.0 }
    });
    (factor * last.displacement, factor * last.multiplier)
}

/// Whether all bounds hold, with the predicted norms of the `next` increments.
fn converged(record: &IterationRecord, next: (f64, f64), scales: &Scales, tolerances: &Tolerances) -> bool {
    tolerances.residual.allows(record.residual, scales.force)
        && tolerances.displacement.allows_increment(record.displacement, next.0, scales.displacement)
        && tolerances.contact.allows(record.contact, scales.multiplier)
        && tolerances.multiplier.allows_increment(record.multiplier, next.1, scales.multiplier)
}

/// Number of recent iterations in which changes of status are reported.
const RECENT: usize = 8;

/// Detects an active set that recurs.
#[derive(Default)]
struct ActiveSets {
    history: Vec<Vec<u8>>,
}

impl ActiveSets {
    /// Adds the set of this iteration. Returns the positions that change if this set was entered at
    /// least three times before.
    fn cycling(&mut self, now: &[u8]) -> Option<Vec<u32>> {
        let changed = self.history.last().is_some_and(|last| last != now);
        let entered = |i: usize| self.history[i] == now && (i == 0 || self.history[i - 1] != now);
        let cycle = changed && (0..self.history.len()).filter(|&i| entered(i)).count() >= 3;
        let nodes = cycle.then(|| self.changing(now));
        self.history.push(now.to_vec());
        nodes
    }

    /// Positions whose status was different in the last iterations.
    fn changing(&self, now: &[u8]) -> Vec<u32> {
        let changes = |&i: &u32| self.history.iter().rev().take(RECENT).any(|set| set[i as usize] != now[i as usize]);
        (0..now.len() as u32).filter(changes).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LinearSystem;
    use crate::spring::Spring;
    use slipstick_linalg::SolverChoice;

    /// By definition: an absolute bound applies to the norm and to the last increment, unless the next
    /// one is a thousand times smaller, and a relative bound to the fraction of the scale and to the next
    /// increment.
    #[test]
    fn bounds_are_on_norms_or_on_parts_of_scales() {
        let (absolute, relative) = (Tolerance::Absolute(0.1), Tolerance::Relative(0.1));
        let verdicts = |norm: f64| [absolute.allows(norm, 50.0), relative.allows(norm, 50.0)];
        assert_eq!(
            [0.05, 0.1, 0.2, 5.0, 6.0].map(verdicts),
            [[true, true], [true, true], [false, true], [false, true], [false, false]]
        );
        assert!(absolute.allows_increment(0.05, 7.0, 50.0) && !absolute.allows_increment(7.0, 0.05, 50.0));
        assert!(absolute.allows_increment(7.0, 9e-5, 50.0) && !absolute.allows_increment(7.0, 2e-4, 50.0));
        assert!(relative.allows_increment(7.0, 0.05, 50.0) && !relative.allows_increment(0.05, 7.0, 50.0));
    }

    /// By hand: a hundredth of the residual, between 1e-2 and the solver's own tolerance; near the
    /// tolerances, a thousandth of the stricter one.
    #[test]
    fn linear_solves_are_as_accurate_as_needed() {
        let scales = Scales { force: 10.0, multiplier: 2.0, displacement: 1.0, position: 1.0, rigidity: 0.0 };
        let mut options = NewtonOptions::default();
        let close = |found: f64, exact: f64| assert!((found / exact - 1.0).abs() < 1e-12, "{found} instead of {exact}");
        close(options.forcing(1.0, &scales), 1e-2);
        close(options.forcing(1e-3, &scales), 1e-5);
        close(options.forcing(1e-7, &scales), 1e-5);
        close(options.forcing(1e-10, &scales), 1e-2);
        options.tolerances.contact = Tolerance::Absolute(2e-12);
        close(options.forcing(1e-8, &scales), 1e-7);
        options.linear_tolerance = 1e-6;
        close(options.forcing(1e-8, &scales), 1e-6);
    }

    /// By hand: after a contraction by a factor of 100, one by 100² is expected, or by the fall of the
    /// residual if that is less; after a damped increment, or a contraction by less than 10, none is
    /// expected.
    #[test]
    fn increments_are_foreseen_by_their_contraction() {
        let record = |displacement: f64, step_length: f64| IterationRecord {
            displacement,
            multiplier: 3e-2,
            step_length,
            ..IterationRecord::default()
        };
        let close = |found: (f64, f64), factor: f64| {
            let apart = |a: f64, b: f64| (a - b).abs() <= 1e-14 * b;
            assert!(apart(found.0, factor * 1e-4) && apart(found.1, factor * 3e-2), "{found:?} instead of {factor}");
        };
        let last = record(1e-4, 1.0);
        close(foreseen(None, &last, 1e-5), 1.0);
        close(foreseen(Some(&record(1e-2, 1.0)), &last, 1e-5), 1e-4);
        close(foreseen(Some(&record(1e-2, 1.0)), &last, 0.02), 0.02);
        close(foreseen(Some(&record(9e-4, 1.0)), &last, 1e-5), 1.0);
        close(foreseen(Some(&record(1e-2, 0.5)), &last, 1e-5), 1.0);
    }

    /// By counting: three iterations without a residual below 0.7 of the best are a stall, and the
    /// stall is remembered.
    #[test]
    fn a_stall_is_three_iterations_without_progress() {
        let damped = |sizes: &[f64]| {
            let mut progress = Progress::default();
            sizes.iter().map(|&size| (progress.add(size), progress.damped).1).collect::<Vec<_>>()
        };
        assert_eq!(damped(&[1.0, 0.8, 0.75, 0.71, 0.1]), [false, false, false, true, true]);
        assert_eq!(damped(&[1.0, 0.8, 0.75, 0.6, 0.5, 0.5, 0.5]), [false, false, false, false, false, false, true]);
        let mut progress = Progress::default();
        assert!(progress.falls_to(3.0));
        progress.add(1.0);
        assert!(progress.falls_to(0.09) && !progress.falls_to(0.11));
    }

    /// By hand: a linear spring's residual after α times `factor` of Newton's increment is |1 − α
    /// factor| times the previous one. Full increments are accepted up to a growth by a factor of 3.
    /// Beyond that, the first of 1, 1/2 … 1/16 for which the residual falls is accepted, or the
    /// best.
    #[test]
    fn increments_are_damped_after_an_outburst() {
        let fixed = [true, true, true, false, false, false];
        for (factor, length, damped) in
            [(1.0, 1.0, false), (3.9, 1.0, false), (4.1, 0.25, true), (10.0, 0.125, true), (-5.0, 0.0625, true)]
        {
            let spring = Spring { stiffness: [1.5, 0.5, 3.0], ..Spring::linear() };
            let (mut linear, mut workspace) = (LinearSystem::new(SolverChoice::Auto), Spring::workspace());
            let (y, iteration) = (vec![0.2, 0.4, -0.1, 0.0, 0.0, 0.0], Iteration::default());
            let step = spring.begin(&Spring::rest(), &(), [0.0, 1.0], &mut workspace).unwrap();
            let start = Base::from(spring.evaluate(&step, &y, None, iteration, Wanted::Both, &mut workspace).unwrap());
            // K is φ + 1
            let increment: Vec<f64> = (0..6)
                .map(|i| if i < 3 { 0.0 } else { -factor * start.residual[i] / (spring.stiffness[i - 3] + 1.0) })
                .collect();
            let mut run = Run {
                solver: &mut Solver { problem: &spring, linear: &mut linear, workspace: &mut workspace },
                step: &step,
                target: &y,
                options: &NewtonOptions::default(),
                iteration,
                y: y.clone(),
                progress: Progress::default(),
                records: vec![IterationRecord::default()],
            };
            let (found, taken) = run.advance(&start, &increment, &fixed, Wanted::Residual).unwrap();
            assert_eq!((taken, run.progress.damped), (length, damped), "{factor}");
            let left = free_norm(&found.residual, &fixed) / free_norm(&start.residual, &fixed);
            assert!((left - (1.0 - length * factor).abs()).abs() < 1e-14, "{factor}: {left}");
            let y = found.unknowns;
            assert!((0..6).all(|i| i < 3 || y[i] == length * increment[i]));
        }
    }

    /// By hand: the norm over the unknowns that are not prescribed.
    #[test]
    fn norms_are_over_free_unknowns() {
        assert_eq!(free_norm(&[3.0, 100.0, -4.0], &[false, true, false]), 5.0);
    }

    #[test]
    fn an_alternating_active_set_is_recognised_and_a_settled_one_is_not() {
        let mut sets = ActiveSets::default();
        let verdicts: Vec<_> = (0..8).map(|k| sets.cycling(&[1, (k % 2) as u8])).collect();
        assert_eq!(verdicts.iter().position(Option::is_some), Some(6));
        assert_eq!(verdicts[6], Some(vec![1]));
        let mut sets = ActiveSets::default();
        assert!((0..20).all(|_| sets.cycling(&[1, 2]).is_none()));
        // one excursion from a set that persisted for long is not a cycle
        assert!([[1, 1], [1, 2]].iter().all(|set| sets.cycling(set).is_none()));
    }
}
