//! The adjoint sweep, written once for all methods.

use crate::failure::{StateError, StepFailureKind};
use crate::inputs::Inputs;
use crate::problem::{Adjoint, Evaluated, Iteration, StepProblem, Wanted};
use crate::reuse::{InUse, KeptFactors};
use crate::solver::Solver;
use crate::store::{Path, PathState};
use crate::time::{LoadTime, Span};
use crate::timings::Phase;
use crate::unknowns::{Held, StepState, Unknowns};
use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;

/// Responses of a path in the form that the sweep uses: functions of its states, with explicit
/// partial derivatives.
pub trait PathResponses<P: StepProblem> {
    /// Number of responses.
    fn count(&self) -> usize;

    /// Whether a response depends explicitly on the state with this index in the path, or on the
    /// increment that leads to it. The state at rest, index 0, is never requested.
    fn observes(&self, response: usize, index: usize) -> bool;

    /// Adds the partial derivatives of an observed response at a state.
    ///
    /// # Errors
    /// If the state cannot be evaluated.
    fn add_derivative(
        &mut self,
        response: usize,
        problem: &P,
        at: &Observed<'_, P>,
        to: &mut Explicit<'_>,
    ) -> Result<(), StateError>;
}

/// A state of a path and the increment that leads to it.
pub struct Observed<'a, P: StepProblem> {
    /// Index of the state in the path.
    pub index: usize,
    /// When the state is reached.
    pub time: LoadTime,
    /// The state before it.
    pub previous: &'a StepState,
    /// The state.
    pub state: &'a StepState,
    /// The step from the previous state to this one.
    pub step: &'a P::Step,
    /// The step's equations at the state, with derivatives.
    pub evaluated: &'a Evaluated<P>,
}

/// Explicit partial derivatives of a response at a state. Implementations add to the existing
/// values.
#[derive(Debug)]
pub struct Explicit<'a> {
    /// ∂θ/∂y_n.
    pub unknowns: &'a mut [f64],
    /// ∂θ/∂F_n, for responses that observe the residual, such as the reactions at prescribed
    /// unknowns.
    pub residual: &'a mut [f64],
    /// ∂θ/∂h_n.
    pub history: &'a mut [f64],
    /// ∂θ/∂y_{n−1}, ∂θ/∂h_{n−1}, ∂θ/∂φ and, if they are requested, ∂θ/∂p and ∂θ/∂X.
    pub inputs: &'a mut Inputs,
}

/// Total derivatives of a response of a path.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PathGradient {
    /// dθ/dφ.
    pub design: Vec<f64>,
    /// dθ/dp with respect to the problem's other parameters.
    pub parameters: Vec<f64>,
    /// dθ/dX with respect to the reference positions of the nodes, three each; empty unless requested.
    pub positions: Vec<f64>,
}

/// Settings of the sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweepOptions {
    /// Relative residual of the transposed solves.
    pub linear_tolerance: f64,
    /// Whether derivatives with respect to parameters other than the design are requested;
    /// otherwise they remain 0.
    pub parameters: bool,
    /// Whether derivatives with respect to reference positions are requested.
    pub positions: bool,
}

impl Default for SweepOptions {
    fn default() -> Self {
        Self { linear_tolerance: 1e-10, parameters: false, positions: false }
    }
}

/// Why a sweep failed; this is rare, since a sweep visits only converged states.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("adjoint at t = {time}: {kind}")]
pub struct SweepError {
    /// When the state is reached.
    pub time: LoadTime,
    /// The reason.
    pub kind: StepFailureKind,
}

/// dθ/dφ and dθ/dp of every response by the time-discrete adjoint, through all accepted sub-steps.
///
/// The responses share evaluations, tangents and factors. Responses whose right-hand side vanishes
/// at a step need no solve there: without friction, these are all steps that the response does not
/// observe. A response of the residual F has the right-hand side Kᵀ ∂θ/∂F, and ∂θ/∂F is added to λ,
/// which is otherwise zero at prescribed unknowns. Paper: (59)–(61), (69), (70). Tests:
/// `tests/suite/gradient.rs` (crate slipstick), `the_gradient_of_a_spring_matches_differences`.
///
/// # Errors
/// [`SweepError`] if a state cannot be evaluated or a transposed solve misses its tolerance, or if
/// the sweep is [interrupted](crate::LinearSystem::set_interrupt).
pub fn sweep<P: StepProblem>(
    solver: &mut Solver<'_, P>,
    path: &Path,
    responses: &mut dyn PathResponses<P>,
    options: &SweepOptions,
) -> Result<Vec<PathGradient>, SweepError> {
    sweep_states(solver, path, 0..path.states.len(), responses, options)
}

/// Like [`sweep()`], but only through the states of one load case, the first of which is at rest.
/// The result is the contribution of this load case to the derivatives.
///
/// # Errors
/// As [`sweep()`].
pub fn sweep_states<P: StepProblem>(
    solver: &mut Solver<'_, P>,
    path: &Path,
    states: Range<usize>,
    responses: &mut dyn PathResponses<P>,
    options: &SweepOptions,
) -> Result<Vec<PathGradient>, SweepError> {
    // they would have to serve a tangent that may be far away
    solver.linear.forget_factors();
    let unknowns = solver.problem.unknowns();
    let one = ResponseAdjoint::at_rest(unknowns, options);
    let adjoints = vec![one; responses.count()];
    let mut run = Run { solver, path, responses, options, adjoints, geometry: None, factors: None };
    let mut fetched = None;
    for index in (states.start + 1..states.end).rev() {
        let here = &path.states[index];
        let state = fetched.take().unwrap_or_else(|| path.state(index, run.solver.linear.ranks()));
        let previous = path.state(index - 1, run.solver.linear.ranks());
        run.step_back(index, &previous, &state).map_err(|kind| SweepError { time: here.time, kind })?;
        fetched = Some(previous);
    }
    let Run { adjoints, solver, .. } = run;
    // later solves cannot use factors of the sweep
    solver.linear.forget_factors();
    let gradient = |ResponseAdjoint { inputs: Inputs { density, mut parameters, position, .. }, .. }| {
        parameters.resize(unknowns.parameters, 0.0);
        PathGradient { design: density, parameters, positions: position }
    };
    let gradients: Vec<PathGradient> = adjoints.into_iter().map(gradient).collect();
    let lists = gradients.iter().flat_map(|of| [&of.design, &of.parameters, &of.positions]);
    let not_finite = lists.flatten().position(|g| !g.is_finite());
    if let Some(index) = not_finite {
        let kind = StateError::NotFinite { quantity: "the gradient".into(), index }.into();
        return Err(SweepError { time: LoadTime::default(), kind });
    }
    Ok(gradients)
}

/// Number of previous solutions λ of the sweep that span the next initial guess.
const RECENT: usize = 4;

/// The adjoint of one response.
#[derive(Debug, Clone, Default)]
struct ResponseAdjoint {
    /// dθ/dφ, dθ/dp and dθ/dX so far, and the pull-back from the next step of the path to the state treated next.
    inputs: Inputs,
    /// The latest solutions, most recent first.
    solutions: VecDeque<Vec<f64>>,
}

impl ResponseAdjoint {
    fn at_rest(unknowns: &Unknowns, options: &SweepOptions) -> Self {
        let mut inputs = Inputs { unknowns: Vec::new(), ..Inputs::zero(unknowns) };
        if !options.parameters {
            inputs.parameters = Vec::new();
        }
        if !options.positions {
            inputs.position = Vec::new();
        }
        Self { inputs, solutions: VecDeque::new() }
    }

    /// Whether nothing comes from later steps.
    fn rests(&self) -> bool {
        self.inputs.previous.iter().chain(&self.inputs.history).all(|&value| value == 0.0)
    }

    fn keep(&mut self, lambda: Vec<f64>) {
        self.solutions.truncate(RECENT.max(1) - 1);
        self.solutions.push_front(lambda);
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
    responses: &'r mut dyn PathResponses<P>,
    options: &'r SweepOptions,
    adjoints: Vec<ResponseAdjoint>,
    /// Geometry of the next state to treat, if the step after that state has evaluated it.
    geometry: Option<P::Geometry>,
    /// The factors that were used last, with the index of the state that they belong to.
    factors: Option<(usize, InUse)>,
}

/// The right-hand side of a response at a state, before the sign change.
struct RightHandSide {
    response: usize,
    unknowns: Vec<f64>,
    /// η_n: ∂θ/∂h_n plus the contributions of later steps.
    eta: Vec<f64>,
    /// Explicit derivatives with respect to the residual: λ at prescribed unknowns.
    residual: Vec<f64>,
}

impl<P: StepProblem> Run<'_, '_, P> {
    fn step_back(&mut self, index: usize, previous: &StepState, state: &StepState) -> Result<(), StepFailureKind> {
        let here = &self.path.states[index];
        let span = Span::new(self.path.states[index - 1].time, here.time.t);
        let problem = self.solver.problem;
        self.solver.linear.check_interrupt()?;
        let geometry = self.geometry.take();
        let concerns = |r: &usize| self.responses.observes(*r, index) || !self.adjoints[*r].rests();
        let concerned: Vec<usize> = (0..self.adjoints.len()).filter(concerns).collect();
        if concerned.is_empty() {
            return Ok(());
        }
        let Solver { workspace, .. } = &mut *self.solver;
        let from = problem.geometry(&previous.unknowns, Wanted::Derivatives, workspace)?;
        let mut step = problem.begin(previous, &from, span, workspace)?;
        if let Some(motions) = problem.free_motions().filter(|_| here.report.holds) {
            motions.hold(&mut step, previous, true);
        }
        let (iteration, wanted) = (Iteration::default(), Wanted::Derivatives);
        let at = problem.evaluate(&step, &state.unknowns, geometry.as_ref(), iteration, wanted, workspace)?;
        self.geometry = Some(from);
        let observed = Observed { index, time: here.time, previous, state, step: &step, evaluated: &at };
        let mut right_hand_sides = Vec::with_capacity(concerned.len());
        for response in concerned {
            right_hand_sides.extend(self.right_hand_side(response, &observed)?);
        }
        if right_hand_sides.is_empty() {
            return Ok(());
        }
        let Solver { linear, workspace, .. } = &mut *self.solver;
        let (fixed, groups) = (problem.unknowns().fixed(Held::None), &problem.unknowns().groups);
        let matrix = problem.tangent(&step, &at, workspace)?;
        let system = linear.reduce(matrix, true, fixed, groups, &here.active_set);
        let tolerance = self.options.linear_tolerance;
        for RightHandSide { unknowns: rhs, residual, .. } in &mut right_hand_sides {
            if residual.iter().any(|&weight| weight != 0.0) {
                let mut of_residual = vec![0.0; rhs.len()];
                linear.product_transpose(matrix, residual, &mut of_residual);
                rhs.iter_mut().zip(of_residual).for_each(|(r, of_residual)| *r += of_residual);
            }
            rhs.iter_mut().for_each(|r| *r = -*r);
        }
        let all: Vec<&[f64]> = right_hand_sides.iter().map(|side| side.unknowns.as_slice()).collect();
        let similar = right_hand_sides.iter().map(|side| &self.adjoints[side.response].solutions);
        let (made, mut at_hand) = nearest(self.path, index, self.factors.take()).unzip();
        let (lambdas, are_new) = linear.solve_similar(&system, &mut at_hand, similar, &all, tolerance)?;
        self.factors = if are_new { Some(index) } else { made }.zip(at_hand);
        for (side, lambda) in right_hand_sides.iter().zip(lambdas) {
            let RightHandSide { response, unknowns: rhs, eta, residual } = side;
            let own = &mut self.adjoints[*response];
            let begin = linear.timings().begin();
            // dθ/dŷ at the prescribed unknowns, whose rows were left out of the solve
            let mut mu = Vec::new();
            if self.options.parameters || self.options.positions {
                mu.resize(lambda.len(), 0.0);
                linear.product_transpose(matrix, &lambda, &mut mu);
                mu.iter_mut().zip(rhs).for_each(|(m, r)| *m -= r);
            }
            own.keep(lambda.clone());
            let mut lambda = lambda;
            lambda.iter_mut().zip(residual).for_each(|(l, r)| *l += r);
            if let Some(dependent) = problem.dependent() {
                dependent.spread(&at.unknowns, &mut lambda);
            }
            problem.pull_back(&step, &at, &Adjoint { lambda: &lambda, eta, mu: &mu }, &mut own.inputs)?;
            linear.end(Phase::PullBack, begin);
        }
        Ok(())
    }

    /// ∂θ/∂y_n plus the contributions of later steps; `None` if it vanishes. Takes the latter.
    fn right_hand_side(
        &mut self,
        response: usize,
        observed: &Observed<'_, P>,
    ) -> Result<Option<RightHandSide>, StepFailureKind> {
        let inputs = &mut self.adjoints[response].inputs;
        let take = |from: &mut Vec<f64>| std::mem::replace(from, vec![0.0; from.len()]);
        let (mut rhs, mut eta) = (take(&mut inputs.previous), take(&mut inputs.history));
        let mut residual = vec![0.0; rhs.len()];
        if self.responses.observes(response, observed.index) {
            let mut to = Explicit { unknowns: &mut rhs, residual: &mut residual, history: &mut eta, inputs };
            self.responses.add_derivative(response, self.solver.problem, observed, &mut to)?;
        }
        let vanishes = |values: &[f64]| values.iter().all(|&value| value == 0.0);
        let no_history = vanishes(&eta);
        if no_history && vanishes(&rhs) && vanishes(&residual) {
            return Ok(None);
        }
        let problem = self.solver.problem;
        if !no_history {
            let mut into = Inputs { unknowns: rhs, ..Inputs::default() };
            let adjoint = Adjoint { eta: &eta, ..Adjoint::default() };
            problem.pull_back(observed.step, observed.evaluated, &adjoint, &mut into)?;
            rhs = into.unknowns;
        }
        if let Some(dependent) = problem.dependent() {
            dependent.gather(&observed.evaluated.unknowns, &mut rhs);
        }
        Ok(Some(RightHandSide { response, unknowns: rhs, eta, residual }))
    }
}

/// The factors for the solve at the state `index`, with the index of the state that they belong to:
/// those used last, unless they are outdated, or those of the march, whichever is nearer. Those of the march
/// count as new at each state, even if they are the same: back to the state where they were made, they
/// get better.
fn nearest(path: &Path, index: usize, last: Option<(usize, InUse)>) -> Option<(usize, InUse)> {
    let here = &path.states[index];
    let kept = here.factors.as_ref().map(|f| (made_at(path, index, f), InUse::new(f.clone())));
    let last = last.filter(|(_, in_use)| !in_use.outdated);
    let far = |(made, in_use): &(usize, InUse)| {
        in_use.factors.changed_nodes(&here.active_set).saturating_add(made.abs_diff(index))
    };
    [last, kept].into_iter().flatten().min_by_key(far)
}
