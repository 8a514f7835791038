//! The march along the load path: steps, retries and cut-backs.

use crate::attempt::{Accepted, solve_increment};
use crate::failure::{StateError, StepFailure, StepFailureKind};
use crate::free::FreeSteps;
use crate::history::HistoryUpdate;
use crate::iterations::{IterationRecord, StepReport};
use crate::ladder::{FailedAttempt, Progress, Rung, is_exhausted, iterations_of, next_attempt};
use crate::newton::{NewtonOptions, Start};
use crate::problem::{Attempt, StepProblem, Wanted};
use crate::solver::Solver;
use crate::start::{self, Ahead, Guide, StartValues};
use crate::store::{Path, PathState};
use crate::thinning::Thinning;
use crate::time::{LoadTime, Span};
use crate::unknowns::{Held, StepState};
use std::any::Any;
use std::collections::VecDeque;
use std::sync::Arc;

/// Settings of the march.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarchOptions {
    /// Newton's method.
    pub newton: NewtonOptions,
    /// Maximum number of times that the increment of a failing step is halved, at most [`MOST_CUTBACKS`].
    pub max_cutbacks: u32,
    /// Whether a step is given up, although its increment may still be halved, once failed attempts have
    /// cost more than it is worth.
    pub bounds_cost: bool,
    /// How to choose the initial guess of a step that has no guide.
    pub start: StartValues,
    /// Memory for what a path could compute again. \[bytes\] Histories come first, if
    /// [`LoadPath::histories`] can compute them; at least eight are kept, and the results are the same, bit
    /// for bit. Factors get the rest.
    pub memory: usize,
    /// Whether each step keeps the factors that its Newton iteration used last for the sweep, as long as
    /// they fit. The sweep factorizes again if a step has none or if they no longer work well; the
    /// gradient is the same in both cases, to the tolerance of its linear solves.
    pub keeps_factors: bool,
}

impl Default for MarchOptions {
    fn default() -> Self {
        Self {
            newton: NewtonOptions::default(),
            max_cutbacks: 0,
            bounds_cost: true,
            start: StartValues::default(),
            memory: usize::MAX,
            keeps_factors: false,
        }
    }
}

/// Halvings beyond which an increment would be lost in the rounding of pseudo-time.
pub const MOST_CUTBACKS: u32 = 30;

/// Events of the march.
#[derive(Debug)]
pub enum MarchEvent<'a> {
    /// A (sub-)step was accepted.
    Accepted {
        /// Its state.
        state: &'a PathState,
        /// The [`Evaluated`](crate::Evaluated) of the march's problem at this state, so that nobody has to
        /// evaluate it again; `None` if it is no longer at hand.
        evaluated: Option<&'a dyn Any>,
    },
    /// A (sub-)step failed and is tried again: from another initial guess, with another setting of
    /// the iteration, or with a smaller increment.
    Retry {
        /// The user's step.
        step: usize,
        /// The failed attempt: its target, why it failed, what it cost.
        failed: &'a FailedAttempt,
        /// The next attempt.
        remedy: Remedy,
    },
}

/// The attempt after a failed (sub-)step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Remedy {
    /// Another initial guess, or another setting of the iteration.
    OtherSetting,
    /// Uzawa's iteration over all multipliers.
    HeldMultipliers,
    /// Half the increment.
    CutBack,
}

/// Numbers of halvings after which Uzawa's iteration over all multipliers is tried; it is also
/// tried after the last halving.
const RESCUED: [i32; 2] = [0, 2];

/// Watches the march; the only connection of the march to clocks, files and the terminal.
pub trait MarchObserver {
    /// Called at each event.
    fn on_event(&mut self, event: &MarchEvent<'_>) {
        let _ = event;
    }

    /// Asked before each attempt; `true` stops the march and keeps the states reached so far.
    fn cancelled(&self) -> bool {
        false
    }
}

/// An observer that does nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl MarchObserver for Silent {}

/// The march failed beyond retry and cut-back. The computed states are in `path`.
#[derive(Debug, Clone)]
pub struct MarchFailure {
    /// The user's step (1-based) in which it failed.
    pub step: usize,
    /// Start and end of the smallest increment tried.
    pub increment: Span,
    /// Every increment that failed in that step: its end, and the reason for which the method itself
    /// failed.
    pub attempts: Vec<(LoadTime, StepFailureKind)>,
    /// Every attempt in that step, each with its rung and its cost.
    pub tried: Vec<FailedAttempt>,
    /// Whether smaller increments were left untried, because the attempts had cost too much.
    pub exhausted: bool,
    /// The last failing iterate, for a picture of it.
    pub iterate: Vec<f64>,
    /// Whether it is the state at which the step starts.
    pub at_start: bool,
    /// The iterations that led to it.
    pub iterations: Vec<IterationRecord>,
    /// Newton iterations of all failed attempts, including those of steps that eventually
    /// converged.
    pub failed_iterations: usize,
    /// All states that converged before the failure.
    pub path: Path,
}

impl std::fmt::Display for MarchFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Span { from, to, .. } = self.increment;
        let last = self.attempts.last().map(|a| a.1.to_string()).unwrap_or_default();
        write!(
            f,
            "load step {} failed: {last}; {} increments tried, down to t = {from:.6} … {to:.6}; t = {:.6} was reached",
            self.step,
            self.attempts.len(),
            self.path.states.last().map_or(0.0, |s| s.time.t),
        )
    }
}

impl std::error::Error for MarchFailure {}

/// The load path to follow.
#[derive(Debug, Clone)]
pub struct LoadPath<'a> {
    /// When it starts.
    pub begin: LoadTime,
    /// The state there, at rest.
    pub start: StepState,
    /// Ends of the user's steps in pseudo-time of the same load case, ascending, after `begin`.
    pub times: &'a [f64],
    /// Number of the user's steps in earlier load cases; step numbers continue from there.
    pub steps_before: usize,
    /// A path that provides initial guesses.
    pub guide: Option<&'a Guide>,
    /// Computes histories again that are not kept; without it, all are kept.
    pub histories: Option<Arc<dyn HistoryUpdate>>,
}

impl<'a> LoadPath<'a> {
    /// A path from `start` at time 0 to each of the `times` of the first load case, without a guide.
    pub fn new(start: StepState, times: &'a [f64]) -> Self {
        Self { begin: LoadTime::default(), start, times, steps_before: 0, guide: None, histories: None }
    }
}

/// Marches along a load path.
///
/// If there is a guide, a step starts from the state that the guide predicts and uses the guide's
/// sub-steps, if any. A failed step is retried from the last state, then with the problem's other
/// settings and a [growing penalty](Attempt::Penalty), then with half the increment, with at most
/// `max_cutbacks` halvings. [Held multipliers](Attempt::Rescue) are also tried: for the whole step, after two
/// halvings, and after the last halving. A step whose attempts have cost far more than its neighbours is
/// tried no further. Accepted sub-steps are states of the path like any other.
///
/// # Errors
/// [`MarchFailure`] with everything that converged before. Cancelling the march is not an error;
/// the path is then shorter.
pub fn march<P: StepProblem>(
    solver: &mut Solver<'_, P>,
    load_path: &LoadPath<'_>,
    options: &MarchOptions,
    observer: &mut dyn MarchObserver,
) -> Result<Path, Box<MarchFailure>> {
    let &LoadPath { begin, ref start, times, steps_before, guide, ref histories } = load_path;
    let rest = PathState {
        time: begin,
        state: start.clone(),
        completes: None,
        report: StepReport::default(),
        active_set: Vec::new(),
        rest: true,
        divided: false,
        histories: None,
        factors: None,
    };
    let length = start.history.len();
    let thinned = histories.as_ref().filter(|_| length > 0);
    let mut thinning = thinned.map(|update| Thinning::new(update.clone(), length, options.memory));
    let of_histories = if thinning.is_some() { 8 * length * (times.len() + 1) } else { 0 };
    let for_factors = if options.keeps_factors { options.memory.saturating_sub(of_histories) } else { 0 };
    let mut path = Path { states: vec![rest], steps: steps_before, factor_bytes: 0 };
    solver.linear.forget();
    // geometry of the last state
    let mut geometry: Option<P::Geometry> = None;
    for (index, &end) in times.iter().enumerate() {
        let step = steps_before + index + 1;
        let LoadTime { case, t: begin } = path.states.last().expect("holds the start").time;
        let whole = end - begin;
        let smallest = whole * 0.5f64.powi(options.max_cutbacks.min(MOST_CUTBACKS) as i32) * 0.999;
        let mut increment = whole;
        let mut failed = false;
        let mut attempts = Vec::new();
        // failed attempts at the step, and how many of them the accepted states count
        let (mut tried, mut counted): (Vec<FailedAttempt>, usize) = (Vec::new(), 0);
        loop {
            if observer.cancelled() {
                return Ok(path);
            }
            let now = path.states.last().expect("holds the start").time.t;
            let led = guide.and_then(|g| g.next_step(LoadTime { case, t: now + 1e-9 * whole }));
            let led = led.filter(|&t| t < end && !failed);
            let last = led.is_none() && end - now <= increment * (1.0 + 1e-9);
            let to = led.unwrap_or(if last { end } else { now + increment });
            let span = Span { case, from: now, to: LoadTime { case, t: to }.rounded().t };
            debug_assert!(span.to > span.from, "an increment of no length");
            let target = span.end();
            let halvings = (whole / span.duration()).log2().round() as i32;
            let rescue = RESCUED.contains(&halvings) || 0.5 * span.duration() < smallest;
            let neighbour = path.states.last().map_or(0, |last| last.report.iterations.len());
            let progress = Progress { done: (now - begin) / whole, before: counted, neighbour };
            let increment_to = Increment { path: &path, time: target, step, rescue, progress, options, guide };
            match increment_to.attempt(solver, &mut geometry, &mut tried, observer) {
                Ok((state, mut report, at)) => {
                    report.failed_iterations = iterations_of(&tried[counted..]);
                    counted = tried.len();
                    let fixed = solver.problem.unknowns().fixed(Held::None);
                    let factors = path.keep(solver.linear.latest(fixed), for_factors);
                    let completes = last.then_some(step);
                    let (rest, divided, active_set) = (false, false, at.active_set.clone());
                    let (time, histories) = (target, None);
                    let next =
                        PathState { time, state, completes, report, active_set, rest, divided, histories, factors };
                    path.states.push(next);
                    path.divide(solver.linear.ranks());
                    if let Some(thinning) = &mut thinning {
                        thinning.thin(&mut path.states);
                    }
                    let state = path.states.last().expect("pushed");
                    let evaluated = (at.unknowns == state.state.unknowns).then_some(&at as &dyn Any);
                    observer.on_event(&MarchEvent::Accepted { state, evaluated });
                    geometry = Some(at.geometry);
                    if last {
                        path.steps = step;
                        break;
                    }
                    increment = (2.0 * increment).min(whole);
                    failed = false;
                }
                Err(failure) if failure.kind == StepFailureKind::Interrupted => return Ok(path),
                Err(failure) => {
                    attempts.push((target, failure.kind.clone()));
                    if tried.last().is_none_or(|last| last.time != target) {
                        // the step could not begin
                        let (kind, iterations) = (failure.kind.clone(), failure.iterations.len());
                        tried.push(FailedAttempt { time: target, rung: Rung::LastState, kind, iterations });
                    }
                    failed = true;
                    increment = 0.5 * span.duration();
                    // a body may lose the contact that has held it within a step
                    let touched = path.states.last().is_some_and(|last| last.active_set.iter().any(|s| s.is_closed()));
                    let prescribed = failure.is_final() && !(failure.is_unheld() && touched);
                    let exhausted =
                        options.bounds_cost && is_exhausted(&tried, progress, options.newton.max_iterations);
                    if increment < smallest || prescribed || exhausted {
                        return Err(Box::new(MarchFailure {
                            step,
                            increment: span,
                            attempts,
                            iterate: failure.iterate,
                            at_start: failure.at_start,
                            iterations: failure.iterations,
                            failed_iterations: iterations_of(&tried[counted..]) + path.failed_iterations(),
                            tried,
                            exhausted: exhausted && increment >= smallest,
                            path,
                        }));
                    }
                    // the reason is that of the method itself, not that of held multipliers
                    let last = tried.last().expect("a failure");
                    let failed = FailedAttempt { kind: failure.kind, ..last.clone() };
                    observer.on_event(&MarchEvent::Retry { step, failed: &failed, remedy: Remedy::CutBack });
                }
            }
        }
    }
    Ok(path)
}

/// An increment from the last state of a path.
struct Increment<'a> {
    path: &'a Path,
    time: LoadTime,
    /// The user's step.
    step: usize,
    /// Whether held multipliers are tried.
    rescue: bool,
    progress: Progress,
    options: &'a MarchOptions,
    guide: Option<&'a Guide>,
}

impl Increment<'_> {
    /// Tries all initial guesses and all settings that the problem offers, and finally held
    /// multipliers; returns the first success or the last failure of the method itself. `geometry`
    /// is that of the last state, if known.
    fn attempt<P: StepProblem>(
        &self,
        solver: &mut Solver<'_, P>,
        geometry: &mut Option<P::Geometry>,
        tried: &mut Vec<FailedAttempt>,
        observer: &mut dyn MarchObserver,
    ) -> Result<Accepted<P>, StepFailure> {
        let &Self { path, time, step, options, guide, .. } = self;
        let problem = solver.problem;
        let last = path.states.last().expect("holds the start");
        let (previous, span) = (&last.state, Span::new(last.time, time.t));
        let as_failure = |e: StateError| StepFailure {
            kind: e.into(),
            iterations: vec![],
            iterate: previous.unknowns.clone(),
            at_start: true,
        };
        let ahead = start::ahead(problem, path, time, options.start, guide, solver.linear.ranks());
        let prediction = ahead.map(|ahead| match ahead {
            Ahead::Guided(unknowns) => Start::guess(unknowns),
            Ahead::Extrapolated(unknowns) => Start::extrapolation(problem, unknowns, &previous.unknowns),
        });
        // first attempts: from the prediction, if there is one, and from the last state
        let mut starts: VecDeque<Option<Start<P>>> = prediction.into_iter().map(Some).chain([None]).collect();
        let mut from_last = None;
        let mut attempt = Attempt::Setting(0);
        let mut before_rescue = None;
        let mut free = FreeSteps::default();
        loop {
            let from = match geometry.take() {
                Some(geometry) => geometry,
                None => {
                    let of = problem.geometry(&previous.unknowns, Wanted::Residual, solver.workspace);
                    of.map_err(as_failure)?
                }
            };
            let from = geometry.insert(from);
            let mut begun = problem.begin(previous, from, span, solver.workspace).map_err(as_failure)?;
            let (rung, accepted) = match free.begin(solver, &mut begun, last, from, (time, attempt), &options.newton) {
                Some(result) => {
                    starts.clear();
                    (Rung::of(attempt, false), result)
                }
                None => {
                    let (rung, start) = match starts.pop_front().flatten() {
                        Some(start) => (Rung::of(attempt, true), start),
                        None => (Rung::of(attempt, false), Start::of(previous, from)),
                    };
                    let solved = solve_increment(solver, &begun, start, time, attempt, &options.newton);
                    let accepted = solved.and_then(|(unknowns, report, at)| match problem.finish(&begun, &at) {
                        Ok(history) => Ok((StepState { unknowns, history }, report, at)),
                        Err(error) => {
                            let (kind, iterations) = (error.into(), report.iterations);
                            Err(StepFailure { kind, iterations, iterate: unknowns, at_start: false })
                        }
                    });
                    (rung, free.end(solver, &mut begun, last, from, (time, attempt), &options.newton, accepted))
                }
            };
            let failure = match accepted {
                Ok(done) => return Ok(done),
                Err(failure) if failure.is_unheld() => {
                    let (kind, iterations) = (failure.kind.clone(), failure.iterations.len());
                    tried.push(FailedAttempt { time, rung, kind, iterations });
                    return Err(failure);
                }
                Err(failure) => failure,
            };
            if failure.kind == StepFailureKind::Interrupted {
                return Err(failure);
            }
            if failure.kind == StepFailureKind::Mispredicted {
                // the last state comes first
                starts.push_back(Some(Start::guess(failure.iterate)));
                continue;
            }
            let (kind, iterations) = (failure.kind.clone(), failure.iterations.len());
            tried.push(FailedAttempt { time, rung, kind, iterations });
            let failure = from_last.take().unwrap_or(failure);
            if starts.is_empty() {
                let own = before_rescue.as_ref().unwrap_or(&failure);
                let next = next_attempt(problem, attempt, &failure, own, self.rescue);
                let exhausted =
                    options.bounds_cost && is_exhausted(tried, self.progress, options.newton.max_iterations);
                match next.filter(|_| !exhausted) {
                    Some(next) => attempt = next,
                    None => return Err(before_rescue.unwrap_or(failure)),
                }
            }
            let rescuing = matches!(attempt, Attempt::Rescue(_));
            let remedy = if rescuing { Remedy::HeldMultipliers } else { Remedy::OtherSetting };
            let failed = tried.last().expect("pushed");
            observer.on_event(&MarchEvent::Retry { step, failed, remedy });
            if rescuing {
                before_rescue.get_or_insert(failure);
            } else if rung == Rung::LastState && !starts.is_empty() {
                from_last = Some(failure);
            }
        }
    }
}
