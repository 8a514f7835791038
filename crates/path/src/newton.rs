//! Semi-smooth Newton's method for one (sub-)step.

mod convergence;
mod settings;

use crate::failure::{StateError, StepFailure, StepFailureKind};
use crate::iterations::{IterationRecord, JUDGED, StepReport, still_falls};
use crate::problem::{Evaluated, Iteration, Scales, StepProblem, Wanted};
use crate::solver::Solver;
use crate::unknowns::{Held, StepState};
use convergence::{ActiveSets, Progress, converged, foreseen};
pub use settings::{NewtonOptions, Tolerance, Tolerances};
use slipstick_status::ContactStatus;

/// Multiple of the maximum number of iterations that are made while the residual [still
/// falls](still_falls).
const EXTENSION: usize = 2;

/// An increment below this fraction of the positions is round-off, namely that of x = X + d
/// multiplied by the summation over a mortar row.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Largest relative residual that round-off of the positions may leave; a stiff penalty amplifies
/// it.
const ROUNDED: f64 = 1e-8;

/// Growth of the residual in one iteration after which increments are damped.
const OUTBURST: f64 = 3.0;

/// Fraction of the decrease predicted by the linear model that a damped increment must achieve
/// (Armijo).
const ARMIJO: f64 = 1e-2;

/// Scaled residual below which one more iteration is expected to converge.
const NEARLY: f64 = 1e-5;

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
    /// How far an extrapolation lies from the last state: the norm over free displacements. The iteration
    /// [gives it up](StepFailureKind::Mispredicted) if its first increment is longer.
    pub reach: Option<f64>,
}

impl<P: StepProblem> Start<P> {
    /// A guess whose geometry is not known.
    pub fn guess(unknowns: Vec<f64>) -> Self {
        Self { unknowns, geometry: None, at_start: false, reach: None }
    }

    /// An extrapolation beyond the unknowns of the last state.
    pub fn extrapolation(problem: &P, unknowns: Vec<f64>, last: &[f64]) -> Self {
        let fixed = &problem.unknowns().fixed(Held::None)[..problem.unknowns().displacements];
        let ahead: Vec<f64> = (0..fixed.len()).map(|i| unknowns[i] - last[i]).collect();
        Self { reach: Some(free_norm(&ahead, fixed)), ..Self::guess(unknowns) }
    }

    /// Guessed unknowns, whose displacements have this geometry.
    pub fn with_geometry(unknowns: Vec<f64>, geometry: P::Geometry) -> Self {
        Self { geometry: Some(geometry), ..Self::guess(unknowns) }
    }

    /// The state at which the step begins.
    pub fn of(previous: &StepState, geometry: &P::Geometry) -> Self {
        Self { at_start: true, ..Self::with_geometry(previous.unknowns.clone(), geometry.clone()) }
    }
}

impl<P: StepProblem> Clone for Start<P> {
    fn clone(&self) -> Self {
        Self { unknowns: self.unknowns.clone(), geometry: self.geometry.clone(), ..*self }
    }
}

impl<P: StepProblem> From<Evaluated<P>> for Start<P> {
    fn from(at: Evaluated<P>) -> Self {
        Self::with_geometry(at.unknowns, at.geometry)
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
        let mut forcing = self.options.first_forcing();
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
            let length = || free_norm(&increment[..displacements], &fixed[..displacements]);
            if iteration == 1 && start.reach.is_some_and(|reach| length() > reach) {
                return Err(StepFailureKind::Mispredicted);
            }
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
    active_set: Vec<ContactStatus>,
}

impl<P: StepProblem> From<Evaluated<P>> for Base {
    fn from(at: Evaluated<P>) -> Self {
        let Evaluated { unknowns, residual, scales, active_set, .. } = at;
        Self { unknowns, residual, scales, active_set }
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
    let status = ContactStatus::counts(at.active_set.iter().copied());
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LinearSystem;
    use crate::spring::Spring;
    use slipstick_linalg::SolverChoice;

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
            let step = spring.begin(&Spring::rest(), &(), [0.0, 1.0].into(), &mut workspace).unwrap();
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
}
