//! One attempt at a (sub-)step, with the method that the problem chooses for it.

use crate::continuation;
use crate::failure::StepFailure;
use crate::iterations::StepReport;
use crate::newton::{self, NewtonOptions, Start};
use crate::problem::{Attempt, Evaluated, Iteration, Method, StepProblem};
use crate::solver::Solver;
use crate::time::LoadTime;
use crate::unknowns::StepState;
use crate::uzawa;

/// Result of an accepted increment: the state, how it converged, and the last evaluation.
pub(crate) type Accepted<P> = (StepState, StepReport, Evaluated<P>);

/// Solves for the state at `time`, from `start`. Returns its unknowns, how they were found, and the last
/// evaluation, which may be elsewhere.
pub(crate) fn solve_increment<P: StepProblem>(
    solver: &mut Solver<'_, P>,
    step: &P::Step,
    start: Start<P>,
    time: LoadTime,
    attempt: Attempt,
    options: &NewtonOptions,
) -> Result<(Vec<f64>, StepReport, Evaluated<P>), StepFailure> {
    let mut target = start.unknowns.clone();
    solver.problem.prescribe(time, &mut target);
    let mut report = StepReport::default();
    let (y, at) = match solver.problem.method(attempt) {
        Some(Method::Uzawa(outer)) => {
            uzawa::solve(solver, step, start, &target, options, (attempt, &outer), &mut report)?
        }
        Some(Method::Newton) if matches!(attempt, Attempt::Penalty(_)) => {
            let at = continuation::solve(solver, step, start, &target, options, &mut report)?;
            (at.unknowns.clone(), at)
        }
        _ => {
            let iteration = Iteration { attempt, ..Iteration::default() };
            let at = newton::solve(solver, step, start, &target, options, iteration, &mut report)?;
            (at.unknowns.clone(), at)
        }
    };
    Ok((y, report, at))
}
