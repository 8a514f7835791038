//! Penalty continuation: a rung of the [ladder](crate::ladder) for steps at which stick, slip and opening
//! exclude each other in every iterate.
//!
//! The multipliers are held at those of the last state, and the contact has the compliance of a penalty
//! around them, which grows from stage to stage. Displacements and status follow each other, and the
//! traction of the last stage is close to the multipliers that are sought. Newton's method for the step's own
//! equations ends the continuation, so neither the state nor its adjoint depends on it.
//!
//! References: Wriggers, Computational Contact Mechanics, 2006, 5.3; Nocedal and Wright, Numerical
//! Optimization, 2006, 17.1.

use crate::failure::StepFailure;
use crate::iterations::StepReport;
use crate::newton::{self, NewtonOptions, Start};
use crate::problem::{Attempt, Evaluated, Iteration, StepProblem};
use crate::solver::Solver;
use crate::unknowns::Held;
use crate::uzawa::loosened;

/// Relative tolerance of the stages before the last: their states only are initial guesses.
const LOOSE: f64 = 1e-3;

/// Solves a step by [`Attempt::Penalty`].
pub(crate) fn solve<P: StepProblem>(
    solver: &mut Solver<'_, P>,
    step: &P::Step,
    mut start: Start<P>,
    target: &[f64],
    newton: &NewtonOptions,
    report: &mut StepReport,
) -> Result<Evaluated<P>, StepFailure> {
    let (problem, loose) = (solver.problem, loosened(newton, LOOSE));
    let split = problem.unknowns().displacements;
    let multipliers = start.unknowns[split..].to_vec();
    let attempts = (0..).map(Attempt::Penalty).take_while(|attempt| problem.method(*attempt).is_some());
    for attempt in attempts {
        let iteration = Iteration { attempt, held: Held::All, at_start: false };
        start.unknowns[split..].copy_from_slice(&multipliers);
        let at = newton::solve(solver, step, start, target, &loose, iteration, report)?;
        // the traction of the penalty is the initial guess of the multipliers
        let (unknowns, _) = problem.update_multipliers(step, &at).map_err(|error| StepFailure {
            kind: error.into(),
            iterations: std::mem::take(&mut report.iterations),
            iterate: at.unknowns.clone(),
            at_start: false,
        })?;
        start = Start::with_geometry(unknowns, at.geometry);
    }
    report.rescued = true;
    newton::solve(solver, step, start, target, newton, Iteration::default(), report)
}
