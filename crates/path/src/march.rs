//! The march along the load path: steps, retries, cut-backs, and the store of states.

use crate::continuation;
use crate::divided::on_first;
use crate::failure::{MarchFailure, StateError, StepFailure, StepFailureKind};
use crate::free::FreeSteps;
use crate::history::{Histories, HistoryUpdate, Thinning};
use crate::ladder::{self, FailedAttempt, Progress, Rung, iterations_of};
use crate::newton::{self, NewtonOptions, Start, StepReport};
use crate::problem::{Attempt, Evaluated, Held, Iteration, Method, StepProblem, StepState, Wanted};
use crate::reuse::KeptFactors;
use crate::solver::Solver;
use crate::start::{self, Guide, StartValues};
use crate::uzawa;
use slipstick_linalg::{Ranks, own_range};
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

/// Settings of the march.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarchOptions {
    /// Newton's method.
    pub newton: NewtonOptions,
    /// Maximum number of times that the increment of a failing step is halved.
    pub max_cutbacks: u32,
    /// How to choose the initial guess of a step that has no guide.
    pub start: StartValues,
    /// Memory for factors that are kept for the sweep. \[bytes\] Each step keeps the factors that
    /// its Newton iteration used last, as long as they fit; the sweep factorizes again if a step
    /// has none or if they no longer work well. The gradient is the same in both cases, to the
    /// tolerance of its linear solves.
    pub factor_memory: usize,
    /// Memory for the histories of a path whose [`LoadPath::histories`] can compute them again, but at
    /// least that of eight. \[bytes\] The results are the same, bit for bit.
    pub history_memory: usize,
}

impl Default for MarchOptions {
    fn default() -> Self {
        Self {
            newton: NewtonOptions::default(),
            max_cutbacks: 0,
            start: StartValues::default(),
            factor_memory: 0,
            history_memory: usize::MAX,
        }
    }
}

/// An accepted state.
#[derive(Clone)]
pub struct PathState {
    /// Pseudo-time.
    pub time: f64,
    /// Unknowns and history; with several ranks, each may hold only [its part](Path::state), and the
    /// history may be empty because it can be computed again.
    pub state: StepState,
    /// The user's step (1-based) that this state completes; `None` within a step that was cut back.
    pub completes: Option<usize>,
    /// How it converged.
    pub report: StepReport,
    /// Status of every contact node at this state (0 open, 1 stick, 2 slip).
    pub active_set: Vec<u8>,
    /// Whether this is the state at rest from which the path, or a new load case, starts; such a
    /// state does not depend on earlier ones.
    pub rest: bool,
    /// Whether each rank holds only its part of the unknowns and history.
    pub(crate) divided: bool,
    /// Where the history comes from, unless it is kept.
    pub(crate) histories: Option<Arc<Histories>>,
    pub(crate) factors: Option<Arc<KeptFactors>>,
}

impl std::fmt::Debug for PathState {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PathState")
            .field("time", &self.time)
            .field("completes", &self.completes)
            .field("unknowns", &self.state.unknowns.len())
            .field("keeps_factors", &self.factors.is_some())
            .finish()
    }
}

/// All accepted states; the first is the start. A path with several load cases starts again at rest
/// for each of them.
#[derive(Debug, Clone, Default)]
pub struct Path {
    /// In chronological order.
    pub states: Vec<PathState>,
    /// Number of the user's steps that are complete.
    pub steps: usize,
    /// Memory of the factors that are kept for the sweep. \[bytes\]
    pub factor_bytes: usize,
}

impl Path {
    /// Appends the path of the next load case.
    pub fn append(&mut self, next: Self) {
        self.states.extend(next.states);
        self.steps = next.steps;
        self.factor_bytes += next.factor_bytes;
    }

    /// The states of each load case, in order. Each load case begins at rest, except possibly the
    /// first if the path is only a part of a longer one.
    pub fn load_cases(&self) -> Vec<Range<usize>> {
        let begins = |&index: &usize| index == 0 || self.states[index].rest;
        let starts: Vec<usize> = (0..self.states.len()).filter(begins).collect();
        let ends = starts.iter().skip(1).copied().chain([self.states.len()]);
        starts.iter().copied().zip(ends).map(|(start, end)| start..end).collect()
    }

    /// Number of accepted (sub-)steps.
    pub fn increments(&self) -> usize {
        self.states.iter().filter(|state| !state.rest).count()
    }

    /// Returns a state. A state that is distributed over the ranks is gathered, and a history that is not
    /// kept is computed again, so all ranks must call this in the same order. The last two states of a load
    /// case, from which steps start, are complete on every rank.
    pub fn state(&self, index: usize, ranks: &dyn Ranks) -> Cow<'_, StepState> {
        let joined = |index: usize| {
            let PathState { state, divided, .. } = &self.states[index];
            match divided {
                false => Cow::Borrowed(state),
                true => {
                    let [unknowns, history] = [&state.unknowns, &state.history].map(|part| ranks.join(part));
                    Cow::Owned(StepState { unknowns, history })
                }
            }
        };
        let state = joined(index);
        let Some(histories) = &self.states[index].histories else { return state };
        let before = |is: &dyn Fn(&PathState) -> bool| (0..index).rev().find(|&before| is(&self.states[before]));
        let first = before(&|state| state.rest).unwrap_or(0);
        let kept = before(&|state| state.histories.is_none()).unwrap_or(first);
        let of = |n: usize| (&self.states[first + n], joined(first + n).into_owned());
        let history = histories.get(index - first, kept - first, &of);
        Cow::Owned(StepState { history, ..state.into_owned() })
    }

    /// An accepted state with its [whole](Self::state) unknowns and history.
    pub fn accepted(&self, index: usize, ranks: &dyn Ranks) -> Cow<'_, PathState> {
        let at = &self.states[index];
        match self.state(index, ranks) {
            Cow::Borrowed(_) => Cow::Borrowed(at),
            Cow::Owned(state) => Cow::Owned(PathState { state, divided: false, histories: None, ..at.clone() }),
        }
    }

    /// Runs a task on the first rank, such as writing files, which requests states by number. All
    /// ranks must call this; the other ranks send their parts meanwhile and get `None`.
    pub fn with_states<'a, R>(
        &'a self,
        ranks: &dyn Ranks,
        work: impl FnOnce(&mut dyn FnMut(usize) -> Cow<'a, StepState>) -> R,
    ) -> Option<R> {
        on_first(ranks, |index| self.state(index, ranks), work)
    }

    /// Keeps only this rank's part of each state, unless a later step may start from it.
    fn divide(&mut self, ranks: &dyn Ranks) {
        let Some(index) = self.states.len().checked_sub(3).filter(|_| ranks.size() > 1) else { return };
        let older = &mut self.states[..=index];
        for PathState { state, divided, .. } in older.iter_mut().rev().take_while(|state| !state.divided) {
            *divided = true;
            for values in [&mut state.unknowns, &mut state.history] {
                *values = values[own_range(values.len(), ranks)].to_vec();
            }
        }
    }

    /// The states that complete a user's step, with the step's number; with several ranks, each may
    /// hold only its part.
    pub fn completed(&self) -> impl Iterator<Item = (usize, &PathState)> {
        self.states.iter().filter_map(|s| s.completes.map(|n| (n, s)))
    }

    /// Returns the factors to keep with the next state, if they can be reused and fit; factors shared
    /// with the previous state need no extra memory.
    fn keep(&mut self, latest: Option<&Arc<KeptFactors>>, memory: usize) -> Option<Arc<KeptFactors>> {
        let latest = latest.filter(|latest| latest.factors.cost().is_some())?;
        let shared = self.states.last().and_then(|s| s.factors.as_ref()).is_some_and(|f| Arc::ptr_eq(f, latest));
        let bytes = self.factor_bytes + if shared { 0 } else { latest.bytes() };
        if bytes > memory {
            return None;
        }
        self.factor_bytes = bytes;
        Some(latest.clone())
    }

    /// Number of states that have factors for the sweep.
    pub fn states_with_factors(&self) -> usize {
        self.states.iter().filter(|s| s.factors.is_some()).count()
    }

    /// Number of states that keep a history; those of the others are [computed again](LoadPath::histories).
    pub fn states_with_histories(&self) -> usize {
        self.states.iter().filter(|s| s.histories.is_none() && !s.state.history.is_empty()).count()
    }

    /// Drops the factors, which are no longer needed after the sweep.
    pub fn forget_factors(&mut self) {
        self.states.iter_mut().for_each(|s| s.factors = None);
        self.factor_bytes = 0;
    }

    /// Newton iterations of all failed attempts along the path.
    pub fn failed_iterations(&self) -> usize {
        self.states.iter().map(|s| s.report.failed_iterations).sum()
    }

    /// Newton iterations that led to the states of the path.
    pub fn newton_iterations(&self) -> usize {
        self.states.iter().map(|s| s.report.iterations.len()).sum()
    }
}

/// Events of the march.
#[derive(Debug)]
pub enum MarchEvent<'a> {
    /// A (sub-)step was accepted.
    Accepted(&'a PathState),
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

/// The load path to follow.
#[derive(Debug, Clone)]
pub struct LoadPath<'a> {
    /// Pseudo-time of the start.
    pub begin: f64,
    /// The state there, at rest.
    pub start: StepState,
    /// Ends of the user's steps, ascending, > `begin`.
    pub times: &'a [f64],
    /// Number of the user's steps in earlier load cases; step numbers continue from there.
    pub steps_before: usize,
    /// A path that provides initial guesses.
    pub guide: Option<&'a Guide>,
    /// Computes histories again that are not kept; without it, all are kept.
    pub histories: Option<Arc<dyn HistoryUpdate>>,
}

impl<'a> LoadPath<'a> {
    /// A path from `start` at time 0 to each of the `times`, without earlier load cases and without
    /// a guide.
    pub fn new(start: StepState, times: &'a [f64]) -> Self {
        Self { begin: 0.0, start, times, steps_before: 0, guide: None, histories: None }
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
    let mut thinning = thinned.map(|update| Thinning::new(update.clone(), length, options.history_memory));
    let mut path = Path { states: vec![rest], steps: steps_before, factor_bytes: 0 };
    solver.linear.forget();
    // geometry of the last state
    let mut geometry: Option<P::Geometry> = None;
    for (index, &end) in times.iter().enumerate() {
        let step = steps_before + index + 1;
        let begin = path.states.last().expect("holds the start").time;
        let whole = end - begin;
        let smallest = whole * 0.5f64.powi(options.max_cutbacks as i32) * 0.999;
        let mut increment = whole;
        let mut failed = false;
        let mut attempts = Vec::new();
        // failed attempts at the step, and how many of them the accepted states count
        let (mut tried, mut counted): (Vec<FailedAttempt>, usize) = (Vec::new(), 0);
        loop {
            if observer.cancelled() {
                return Ok(path);
            }
            let now = path.states.last().expect("holds the start").time;
            let led = guide.and_then(|g| g.next_step(now + 1e-9 * whole)).filter(|&t| t < end && !failed);
            let last = led.is_none() && end - now <= increment * (1.0 + 1e-9);
            let target = led.unwrap_or(if last { end } else { now + increment });
            let halvings = (whole / (target - now)).log2().round() as i32;
            let rescue = RESCUED.contains(&halvings) || 0.5 * (target - now) < smallest;
            let neighbour = path.states.last().map_or(0, |last| last.report.iterations.len());
            let progress = Progress { done: (now - begin) / whole, before: counted, neighbour };
            let increment_to = Increment { path: &path, time: target, step, rescue, progress, options, guide };
            match increment_to.attempt(solver, &mut geometry, &mut tried, observer) {
                Ok((state, mut report, at)) => {
                    report.failed_iterations = iterations_of(&tried[counted..]);
                    counted = tried.len();
                    let fixed = solver.problem.unknowns().fixed(Held::None);
                    let factors = path.keep(solver.linear.latest(fixed), options.factor_memory);
                    let completes = last.then_some(step);
                    let (rest, divided, active_set) = (false, false, at.active_set);
                    let (time, histories) = (target, None);
                    let next =
                        PathState { time, state, completes, report, active_set, rest, divided, histories, factors };
                    path.states.push(next);
                    path.divide(solver.linear.ranks());
                    if let Some(thinning) = &mut thinning {
                        thinning.thin(&mut path.states);
                    }
                    geometry = Some(at.geometry);
                    observer.on_event(&MarchEvent::Accepted(path.states.last().expect("pushed")));
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
                        let kind = failure.kind.clone();
                        tried.push(FailedAttempt { time: target, rung: Rung::LastState, kind, iterations: 0 });
                    }
                    failed = true;
                    increment = 0.5 * (target - now);
                    let prescribed = matches!(&failure.kind, StepFailureKind::State(state) if state.is_prescribed());
                    let exhausted = ladder::is_exhausted(&tried, progress, options.newton.max_iterations);
                    if increment < smallest || prescribed || exhausted {
                        return Err(Box::new(MarchFailure {
                            step,
                            increment: (now, target),
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

/// Result of an accepted increment: the state, how it converged, and the last evaluation.
pub(crate) type Accepted<P> = (StepState, StepReport, Evaluated<P>);

/// An increment from the last state of a path.
struct Increment<'a> {
    path: &'a Path,
    time: f64,
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
        let (previous, span) = (&last.state, [last.time, time]);
        let as_failure = |e: StateError| StepFailure {
            kind: e.into(),
            iterations: vec![],
            iterate: previous.unknowns.clone(),
            at_start: true,
        };
        let starts = start::candidates(problem, path, time, options.start, guide, solver.linear.ranks());
        let mut starts = starts.into_iter().peekable();
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
                    while starts.next().is_some() {}
                    (Rung::of(attempt, false), result)
                }
                None => {
                    let (rung, start) = match starts.next() {
                        Some(unknowns) if starts.peek().is_some() => {
                            (Rung::of(attempt, true), Start { unknowns, geometry: None, at_start: false })
                        }
                        _ => (
                            Rung::of(attempt, false),
                            Start { unknowns: previous.unknowns.clone(), geometry: Some(from.clone()), at_start: true },
                        ),
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
                Err(failure) if failure.is_unheld() => return Err(failure),
                Err(failure) => failure,
            };
            if failure.kind == StepFailureKind::Interrupted {
                return Err(failure);
            }
            let (kind, iterations) = (failure.kind.clone(), failure.iterations.len());
            tried.push(FailedAttempt { time, rung, kind, iterations });
            if starts.peek().is_none() {
                let own = before_rescue.as_ref().unwrap_or(&failure);
                let next = ladder::next_attempt(problem, attempt, &failure, own, self.rescue);
                let exhausted = ladder::is_exhausted(tried, self.progress, options.newton.max_iterations);
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
            }
        }
    }
}

pub(crate) fn solve_increment<P: StepProblem>(
    solver: &mut Solver<'_, P>,
    step: &P::Step,
    start: Start<P>,
    time: f64,
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
