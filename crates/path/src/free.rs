//! Steps in which bodies move freely until contact holds them.
//!
//! A step whose tangent is singular because nothing restrains a rigid motion is solved again with free
//! motions [held](HoldFreeMotions), and loaded bodies are first moved up to their first
//! contact. If a body that has arrived pushes another free one, the bodies move on together.

use crate::attempt::{Accepted, solve_increment};
use crate::failure::{StateError, StepFailure, StepFailureKind};
use crate::newton::{NewtonOptions, Start};
use crate::problem::{Attempt, HeldMotions, HoldFreeMotions, Iteration, StepProblem, Wanted};
use crate::solver::Solver;
use crate::store::PathState;
use crate::time::LoadTime;
use crate::unknowns::StepState;

/// Most times that bodies are moved on in a step.
const MOVES: usize = 8;

/// How the attempts at an increment treat free motions.
#[derive(Default)]
pub(crate) struct FreeSteps {
    /// Whether all attempts hold free motions: there are some at the start, or some that the last step held
    /// are still nearly free.
    holds: Option<bool>,
    /// Whether a motion is free, not only nearly.
    certain: bool,
    /// The failure of the first attempt that held them.
    first: Option<StepFailure>,
}

impl FreeSteps {
    /// Before an attempt: if motions are free at the start, the result of an attempt that holds them.
    pub fn begin<P: StepProblem>(
        &mut self,
        solver: &mut Solver<'_, P>,
        step: &mut P::Step,
        last: &PathState,
        geometry: &P::Geometry,
        to: (LoadTime, Attempt),
        options: &NewtonOptions,
    ) -> Option<Result<Accepted<P>, StepFailure>> {
        let problem = solver.problem;
        let motions = problem.free_motions()?;
        let holds = *self.holds.get_or_insert_with(|| {
            let iteration = Iteration { at_start: true, ..Iteration::default() };
            let y = &last.state.unknowns;
            motions.hold(step, &last.state, false);
            let at = problem.evaluate(step, y, Some(geometry), iteration, Wanted::Residual, solver.workspace);
            let Ok(at) = at else { return false };
            self.certain = motions.are_free(step, &at, false);
            self.certain || last.report.holds && motions.are_free(step, &at, true)
        });
        if !holds {
            return None;
        }
        let result = solve(solver, motions, step, last, geometry, to, options)?;
        if !self.certain && matches!(&result, Err(failure) if failure.is_unheld()) {
            // what is nearly free may yet find an equilibrium
            self.holds = Some(false);
            motions.hold(step, &last.state, false);
            return None;
        }
        Some(result.map_err(|failure| self.first_of(failure)))
    }

    /// After an attempt that did not hold free motions: if it failed because a motion is undetermined, or
    /// its state has one, the result of an attempt that holds them.
    #[allow(clippy::too_many_arguments)]
    pub fn end<P: StepProblem>(
        &mut self,
        solver: &mut Solver<'_, P>,
        step: &mut P::Step,
        last: &PathState,
        geometry: &P::Geometry,
        to: (LoadTime, Attempt),
        options: &NewtonOptions,
        result: Result<Accepted<P>, StepFailure>,
    ) -> Result<Accepted<P>, StepFailure> {
        let Some(motions) = solver.problem.free_motions() else { return result };
        let undetermined = match &result {
            Ok((.., at)) => motions.are_free(step, at, false),
            Err(failure) => matches!(failure.kind, StepFailureKind::Singular { .. }),
        };
        if undetermined {
            match solve(solver, motions, step, last, geometry, to, options) {
                Some(Ok(done)) => return Ok(done),
                Some(Err(failure)) if result.is_err() && failure.is_final() => return Err(failure),
                _ => {}
            }
            motions.hold(step, &last.state, false);
        }
        result
    }

    /// The failure of an attempt that holds free motions. That nothing holds a body is the verdict of the
    /// first attempt only; a later one may have left a contact that the first had found.
    fn first_of(&mut self, failure: StepFailure) -> StepFailure {
        let first = self.first.get_or_insert_with(|| failure.clone());
        if failure.is_unheld() { first.clone() } else { failure }
    }
}

impl StepFailure {
    /// Whether nothing holds a loaded body.
    pub(crate) fn is_unheld(&self) -> bool {
        matches!(self.kind, StepFailureKind::State(StateError::Unheld { .. }))
    }

    /// Whether no other attempt can succeed, also at a smaller increment unless something was in contact
    /// before the step.
    pub(crate) fn is_final(&self) -> bool {
        match &self.kind {
            StepFailureKind::State(state) => state.is_prescribed(),
            kind => *kind == StepFailureKind::Interrupted,
        }
    }
}

/// Solves the step to `time` with free motions held; `None` if bodies had to be moved too often.
fn solve<P: StepProblem>(
    solver: &mut Solver<'_, P>,
    motions: &dyn HoldFreeMotions<P>,
    step: &mut P::Step,
    last: &PathState,
    geometry: &P::Geometry,
    (time, attempt): (LoadTime, Attempt),
    options: &NewtonOptions,
) -> Option<Result<Accepted<P>, StepFailure>> {
    let (problem, previous) = (solver.problem, &last.state);
    motions.hold(step, previous, true);
    let mut from = previous.unknowns.clone();
    let mut unheld = None;
    for moves in 0..MOVES {
        let moved = match motions.approach(step, &from, solver.workspace) {
            Ok(moved) => moved,
            Err(error) => return Some(Err(failure(error, from))),
        };
        let start = match moved {
            Some(unknowns) => Start::guess(unknowns),
            None if moves == 0 => Start::of(previous, geometry),
            None => break,
        };
        let mut before = Vec::new();
        let start = if moves == 0 {
            start
        } else {
            // held where it touches, the body does not return to where it was while contact settles
            let touching = StepState { unknowns: start.unknowns.clone(), ..previous.clone() };
            motions.hold(step, &touching, true);
            let solved = solve_increment(solver, step, start, time, attempt, options);
            motions.hold(step, previous, true);
            match solved {
                Ok((_, report, at)) => {
                    before = report.iterations;
                    Start::guess(at.unknowns)
                }
                Err(failure) => return Some(Err(failure)),
            }
        };
        let (unknowns, mut report, at) = match solve_increment(solver, step, start, time, attempt, options) {
            Ok(solved) => solved,
            Err(failure) => return Some(Err(failure)),
        };
        report.iterations.splice(0..0, before);
        match problem.finish(step, &at) {
            Ok(history) => {
                report.holds = true;
                let HeldMotions { free, share, work } = motions.left_free(step, &at);
                (report.left_free, report.holding, report.holding_work) = (free, share, work);
                return Some(Ok((StepState { unknowns, history }, report, at)));
            }
            Err(error @ StateError::Unheld { .. }) => {
                from.clone_from(&unknowns);
                unheld = Some(StepFailure { iterations: report.iterations, ..failure(error, unknowns) });
            }
            Err(error) => return Some(Err(StepFailure { iterations: report.iterations, ..failure(error, unknowns) })),
        }
    }
    unheld.map(Err)
}

fn failure(error: StateError, iterate: Vec<f64>) -> StepFailure {
    StepFailure { kind: error.into(), iterations: Vec::new(), iterate, at_start: false }
}
