//! The adjoint sweep, written once for all methods.

use crate::failure::{StateError, StepFailureKind};
use crate::linear::KeptFactors;
use crate::march::{Path, PathState};
use crate::problem::{Adjoint, Held, Iteration, PreviousPullBack, StepProblem, StepState, Wanted};
use crate::solver::Solver;
use crate::timings::Phase;
use std::collections::VecDeque;
use std::sync::Arc;

/// An objective on a problem `P` as used by the sweep: explicit partial derivatives at the states that complete a
/// user's step.
pub trait PathObjective<P> {
    /// Adds ∂θ/∂y_n, ∂θ/∂φ and ∂θ/∂p of user step `step` (1-based) at its state.
    ///
    /// # Errors
    /// If the state cannot be evaluated.
    fn add_derivative(
        &mut self,
        problem: &P,
        step: usize,
        time: f64,
        state: &StepState,
        by_unknowns: &mut [f64],
        to: &mut PathGradient,
    ) -> Result<(), StateError>;
}

/// Derivatives of an objective over a path.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PathGradient {
    /// dθ/dφ.
    pub design: Vec<f64>,
    /// dθ/dp with respect to the problem's other parameters.
    pub parameters: Vec<f64>,
}

/// Settings of the sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweepOptions {
    /// Relative residual of the transposed solves.
    pub linear_tolerance: f64,
    /// Whether derivatives with respect to parameters other than the design are requested; otherwise they remain 0.
    pub parameters: bool,
}

impl Default for SweepOptions {
    fn default() -> Self {
        Self { linear_tolerance: 1e-10, parameters: false }
    }
}

/// Why a sweep failed; this is rare, since a sweep visits only converged states.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("adjoint at t = {time}: {kind}")]
pub struct SweepError {
    /// Pseudo-time of the state.
    pub time: f64,
    /// The reason.
    pub kind: StepFailureKind,
}

/// dθ/dφ and dθ/dp by the time-discrete adjoint, through all accepted sub-steps.
///
/// Steps whose right-hand side vanishes need no solve: without friction these are all steps that the objective does not
/// observe. Paper: (59)–(61), (69), (70). Tests: `tests/gradient.rs` (crate slipstick).
///
/// # Errors
/// [`SweepError`] if a state cannot be evaluated or a transposed solve misses its tolerance.
pub fn sweep<P: StepProblem>(
    solver: &mut Solver<'_, P>,
    path: &Path,
    objective: &mut dyn PathObjective<P>,
    options: &SweepOptions,
) -> Result<PathGradient, SweepError> {
    // so the gradient does not depend on earlier solves
    solver.linear.forget_factors();
    let unknowns = solver.problem.unknowns();
    let mut run = Run {
        solver,
        path,
        objective,
        options,
        gradient: PathGradient { design: vec![0.0; unknowns.designs], parameters: vec![0.0; unknowns.parameters] },
        carry: PreviousPullBack { unknowns: vec![0.0; unknowns.count()], history: vec![0.0; unknowns.history] },
        geometry: None,
        earlier: Earlier::default(),
    };
    let mut fetched = None;
    for index in (1..path.states.len()).rev() {
        let here = &path.states[index];
        if here.rest {
            // later states do not depend on anything before this one
            run.carry.unknowns.fill(0.0);
            run.carry.history.fill(0.0);
            (run.geometry, fetched) = (None, None);
            continue;
        }
        let state = fetched.take().unwrap_or_else(|| path.state(index, run.solver.linear.ranks()));
        let previous = path.state(index - 1, run.solver.linear.ranks());
        run.step_back(index, &previous, &state).map_err(|kind| SweepError { time: here.time, kind })?;
        fetched = Some(previous);
    }
    let Run { gradient, solver, .. } = run;
    // later solves cannot use factors of the sweep
    solver.linear.forget_factors();
    if let Some(index) = gradient.design.iter().chain(&gradient.parameters).position(|g| !g.is_finite()) {
        let kind = StateError::NotFinite { quantity: "the gradient".into(), index }.into();
        return Err(SweepError { time: 0.0, kind });
    }
    Ok(gradient)
}

/// Number of previous solutions λ in the sweep that span the next initial guess.
const RECENT: usize = 4;

/// Data that earlier steps of the sweep leave for the next.
#[derive(Default)]
struct Earlier {
    /// The latest solutions, the last one first.
    solutions: VecDeque<Vec<f64>>,
    /// Factors of a later state of the path, with its index.
    factors: Option<(usize, Arc<KeptFactors>)>,
}

impl Earlier {
    /// The factors to solve with at the state `index`: the march's or those of a later state, whichever is nearer.
    fn nearest(&self, path: &Path, index: usize) -> Option<Arc<KeptFactors>> {
        let here = &path.states[index];
        let kept = here.factors.as_ref().map(|f| (index - made_at(path, index, f), f));
        let later = self.factors.as_ref().map(|(made, f)| (made - index, f));
        let far = |(steps, factors): &(usize, &Arc<KeptFactors>)| {
            factors.changed_nodes(&here.active_set).saturating_add(*steps)
        };
        [kept, later].into_iter().flatten().min_by_key(far).map(|(_, f)| f.clone())
    }

    fn add(&mut self, path: &Path, index: usize, lambda: Vec<f64>, new: Option<Arc<KeptFactors>>) {
        self.solutions.truncate(RECENT.max(1) - 1);
        self.solutions.push_front(lambda);
        let kept = path.states[index].factors.as_ref().filter(|f| made_at(path, index, f) == index);
        if let Some(factors) = new.or(kept.cloned()) {
            self.factors = Some((index, factors));
        }
    }
}

/// Index of the first state that kept these factors.
fn made_at(path: &Path, mut index: usize, factors: &Arc<KeptFactors>) -> usize {
    let keeps = |state: &PathState| state.factors.as_ref().is_some_and(|f| Arc::ptr_eq(f, factors));
    while index > 0 && keeps(&path.states[index - 1]) {
        index -= 1;
    }
    index
}

/// A sweep in progress.
struct Run<'r, 's, P: StepProblem> {
    solver: &'r mut Solver<'s, P>,
    path: &'r Path,
    objective: &'r mut dyn PathObjective<P>,
    options: &'r SweepOptions,
    gradient: PathGradient,
    /// The pull-back from the next step of the path.
    carry: PreviousPullBack,
    /// Geometry of the state to be treated next, if the step after it has evaluated it.
    geometry: Option<P::Geometry>,
    earlier: Earlier,
}

impl<P: StepProblem> Run<'_, '_, P> {
    fn step_back(&mut self, index: usize, previous: &StepState, state: &StepState) -> Result<(), StepFailureKind> {
        let here = &self.path.states[index];
        let problem = self.solver.problem;
        let geometry = self.geometry.take();
        // objectives do not depend directly on the history, so η_n comes only from step n + 1
        let PreviousPullBack { unknowns: mut rhs, history: eta } = std::mem::take(&mut self.carry);
        if let Some(step) = here.completes {
            self.objective.add_derivative(problem, step, here.time, state, &mut rhs, &mut self.gradient)?;
        }
        let (quiet_unknowns, quiet_history) = (rhs.iter().all(|&r| r == 0.0), eta.iter().all(|&e| e == 0.0));
        if quiet_unknowns && quiet_history {
            self.carry = PreviousPullBack { unknowns: rhs, history: eta };
            return Ok(());
        }
        let Solver { linear, workspace, .. } = &mut *self.solver;
        let from = problem.geometry(&previous.unknowns, Wanted::Derivatives, workspace)?;
        let step = problem.begin(previous, &from, here.time, workspace)?;
        let (iteration, wanted) = (Iteration::default(), Wanted::Derivatives);
        let at = problem.evaluate(&step, &state.unknowns, geometry.as_ref(), iteration, wanted, workspace)?;
        self.geometry = Some(from);
        if !quiet_history {
            problem.pull_back_current(&step, &at, &eta, &mut rhs)?;
        }
        rhs.iter_mut().for_each(|r| *r = -*r);
        let (fixed, groups) = (problem.unknowns().fixed(Held::None), &problem.unknowns().groups);
        let matrix = problem.tangent(&step, &at, workspace)?;
        let system = linear.reduce(matrix, true, fixed, groups);
        let (earlier, tolerance) = (&mut self.earlier, self.options.linear_tolerance);
        let at_hand = earlier.nearest(self.path, index);
        let (lambda, new) = match linear.solve_similar(&system, fixed, at_hand, &earlier.solutions, &rhs, tolerance) {
            Some(lambda) => (lambda, None),
            None => {
                // drop the old factors before the new ones are computed
                earlier.factors = None;
                let (lambda, new) = linear.solve_anew(&system, fixed, &here.active_set, &rhs, tolerance)?;
                (lambda, Some(new))
            }
        };
        let begin = linear.timings().begin();
        if self.options.parameters {
            // dθ/dŷ at the prescribed unknowns, whose rows were left out of the solve
            let mut by_prescribed = vec![0.0; lambda.len()];
            linear.product_transpose(matrix, &lambda, &mut by_prescribed);
            by_prescribed.iter_mut().zip(&rhs).for_each(|(b, r)| *b -= r);
            let adjoint = Adjoint { lambda: &lambda, eta: &eta, by_prescribed: &by_prescribed, time: here.time };
            problem.pull_back_parameters(&step, &at, &adjoint, &mut self.gradient.parameters)?;
        }
        problem.pull_back_design(&at, &lambda, &mut self.gradient.design)?;
        self.carry = problem.pull_back_previous(&step, &at, &lambda, &eta);
        linear.end(Phase::PullBack, begin);
        earlier.add(self.path, index, lambda, new);
        Ok(())
    }
}
