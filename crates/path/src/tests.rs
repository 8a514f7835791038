//! March and sweep of a [`Spring`]: results by hand, and the gradient against differences.

use crate::spring::Spring;
use crate::{
    Explicit, Guide, LinearSystem, LoadPath, LoadTime, MarchEvent, MarchFailure, MarchObserver, MarchOptions, Observed,
    Path, PathGradient, PathResponses, PathState, Remedy, Silent, Solver, StartValues, StateError, StepFailureKind,
    StepProblem, SweepOptions, Tolerance, Tolerances, march, sweep,
};
use slipstick_linalg::{Alone, SolverChoice};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

fn linear() -> LinearSystem {
    LinearSystem::new(SolverChoice::Auto)
}

fn options() -> MarchOptions {
    let all = Tolerance::Relative(1e-13);
    let mut options = MarchOptions { max_cutbacks: 2, ..MarchOptions::default() };
    options.newton.tolerances = Tolerances { residual: all, displacement: all, contact: all, multiplier: all };
    options.newton.linear_tolerance = 1e-13;
    options
}

fn path(spring: &Spring, times: &[f64], options: &MarchOptions) -> Path {
    follow(spring, &mut linear(), &LoadPath::new(Spring::rest(), times), options, &mut Silent).unwrap()
}

fn follow(
    spring: &Spring,
    linear: &mut LinearSystem,
    load_path: &LoadPath<'_>,
    options: &MarchOptions,
    observer: &mut dyn MarchObserver,
) -> Result<Path, Box<MarchFailure>> {
    let mut solver = Solver { problem: spring, linear, workspace: &mut Spring::workspace() };
    march(&mut solver, load_path, options, observer)
}

/// θ = Σ over the steps n of n w · y_n, except for those that it does not observe, and for each
/// accepted sub-step half the square of its increment of y, times a factor.
#[derive(Clone, Copy)]
struct Weights {
    unseen: usize,
    increments: f64,
}

const W: [f64; 6] = [0.4, -1.1, 0.3, 0.9, 1.7, -0.6];

impl Weights {
    fn value(&self, path: &Path) -> f64 {
        let seen = path.completed().filter(|(step, _)| *step != self.unseen);
        let weighted = |at: &PathState| W.iter().zip(&at.state.unknowns).map(|(w, y)| w * y).sum::<f64>();
        let square = |pair: &[PathState]| {
            let both = pair[1].state.unknowns.iter().zip(&pair[0].state.unknowns);
            both.map(|(now, before)| 0.5 * (now - before) * (now - before)).sum::<f64>()
        };
        seen.map(|(step, at)| step as f64 * weighted(at)).sum::<f64>()
            + self.increments * path.states.windows(2).map(square).sum::<f64>()
    }
}

/// Objectives on a path whose states complete these steps.
struct Responses<'a> {
    objectives: &'a [Weights],
    completes: Vec<Option<usize>>,
}

impl<'a> Responses<'a> {
    fn of(objectives: &'a [Weights], path: &Path) -> Self {
        Self { objectives, completes: path.states.iter().map(|state| state.completes).collect() }
    }
}

impl PathResponses<Spring> for Responses<'_> {
    fn count(&self) -> usize {
        self.objectives.len()
    }

    fn observes(&self, response: usize, index: usize) -> bool {
        let Weights { unseen, increments } = self.objectives[response];
        increments != 0.0 || self.completes[index].is_some_and(|step| step != unseen)
    }

    fn add_derivative(
        &mut self,
        response: usize,
        _: &Spring,
        at: &Observed<'_, Spring>,
        to: &mut Explicit<'_>,
    ) -> Result<(), StateError> {
        let Weights { unseen, increments } = self.objectives[response];
        if let Some(step) = self.completes[at.index].filter(|&step| step != unseen) {
            to.unknowns.iter_mut().zip(W).for_each(|(b, w)| *b += step as f64 * w);
        }
        for (i, (now, before)) in at.state.unknowns.iter().zip(&at.previous.unknowns).enumerate() {
            to.unknowns[i] += increments * (now - before);
            to.inputs.previous[i] -= increments * (now - before);
        }
        Ok(())
    }
}

/// Central differences of the whole path, for several responses at once: with observed steps and an
/// unobserved last one, with dependence on increments, with history, sub-steps, and with factors
/// that are kept and reused.
#[test]
fn the_gradient_of_a_spring_matches_differences() {
    for (unseen, longest_step, keeps_factors) in [(0, f64::INFINITY, false), (3, 0.12, false), (2, 0.12, true)] {
        let times = [0.7, 1.0, 1.9];
        let options = MarchOptions { keeps_factors, max_cutbacks: 5, ..options() };
        let spring = |design: usize, h: f64| {
            let (load, position): (fn(f64) -> f64, _) = (|time| 0.3 * time * time, [0.4, -0.2, 0.1]);
            let mut spring = Spring { longest_step, load, position, ..Spring::default() };
            match design {
                0..3 => spring.stiffness[design] += h,
                3 => spring.amplitude += h,
                _ => spring.position[design - 4] += h,
            }
            spring
        };
        let objectives = [(unseen, 0.0), (9, 0.0), (unseen, 0.7)];
        let objectives = objectives.map(|(unseen, increments)| Weights { unseen, increments });
        let base = spring(0, 0.0);
        let mut linear = linear();
        if keeps_factors {
            linear.set_budget(Some(30));
        }
        let (rest, mut workspace) = (Spring::rest(), Spring::workspace());
        let mut solver = Solver { problem: &base, linear: &mut linear, workspace: &mut workspace };
        let marched = march(&mut solver, &LoadPath::new(rest, &times), &options, &mut Silent).unwrap();
        let cut = marched.states.len() > 4;
        assert_eq!((marched.steps, cut), (3, longest_step < 1.0));
        assert_eq!(marched.states_with_factors() > 0, keeps_factors);
        let options_of_sweep = SweepOptions { linear_tolerance: 1e-13, parameters: true, positions: true };
        let found = sweep(&mut solver, &marched, &mut Responses::of(&objectives, &marched), &options_of_sweep).unwrap();
        for (objective, PathGradient { design, parameters, positions }) in objectives.iter().zip(&found) {
            assert_eq!(positions.len(), 3);
            for (i, found) in design.iter().chain(parameters).chain(positions).enumerate() {
                let at = |h: f64| {
                    let other = path(&spring(i, h), &times, &options);
                    assert_eq!(other.states.len(), marched.states.len());
                    objective.value(&other)
                };
                let h = 1e-3;
                let difference = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
                assert!((found - difference).abs() < 1e-9, "{i}: {found} instead of {difference}");
            }
        }
    }
}

/// By hand: the linear spring follows by φ/(φ + 1), and another load case begins at rest again.
#[test]
fn a_linear_spring_follows() {
    let spring = Spring::linear();
    let first = LoadPath::new(Spring::rest(), &[0.5]);
    let second = LoadPath { begin: 1.0.into(), steps_before: 1, ..LoadPath::new(Spring::rest(), &[2.0]) };
    let follow = |load_path| follow(&spring, &mut linear(), load_path, &options(), &mut Silent).unwrap();
    let mut path = follow(&first);
    path.append(follow(&second));
    assert_eq!((path.steps, path.load_cases()), (2, vec![0..2, 2..4]));
    let states: Vec<_> = path.states.iter().map(|s| (s.time.t, s.completes, s.rest)).collect();
    assert_eq!(states, [(0.0, None, true), (0.5, Some(1), false), (1.0, None, true), (2.0, Some(2), false)]);
    for at in &path.states {
        let mut driven = vec![0.0; 6];
        spring.prescribe(if at.rest { LoadTime::default() } else { at.time }, &mut driven);
        for c in 0..3 {
            let share = spring.stiffness[c] / (spring.stiffness[c] + 1.0);
            assert!((at.state.unknowns[c] - driven[c]).abs() < 1e-15);
            assert!((at.state.unknowns[3 + c] - share * driven[c]).abs() < 1e-13);
        }
    }
}

/// The attempts: the target of each accepted step, and of each retried one.
#[derive(Default)]
struct Tried {
    accepted: Vec<f64>,
    again: Vec<(f64, bool)>,
}

impl MarchObserver for Tried {
    fn on_event(&mut self, event: &MarchEvent<'_>) {
        match event {
            MarchEvent::Accepted { state, .. } => self.accepted.push(state.time.t),
            MarchEvent::Retry { failed, remedy, .. } => self.again.push((failed.time.t, *remedy == Remedy::CutBack)),
        }
    }
}

/// By hand: u₁ follows with t, and 0.3 is the longest step. Increments are halved twice, and
/// doubled after each success.
#[test]
fn increments_are_halved_and_grow_again() {
    let spring = || {
        let mut spring = Spring { longest_step: 0.3, ..Spring::linear() };
        spring.amplitude = (spring.stiffness[0] + 1.0) / spring.stiffness[0];
        spring
    };
    let mut tried = Tried::default();
    let previous = MarchOptions { start: StartValues::Previous, ..options() };
    let follow = |guide: Option<&Guide>, options: &MarchOptions, tried: &mut Tried| {
        let load_path = LoadPath { guide, ..LoadPath::new(Spring::rest(), &[1.0]) };
        follow(&spring(), &mut linear(), &load_path, options, tried)
    };
    let path = follow(None, &previous, &mut tried).unwrap();
    // each of the four rejected states took an iteration
    assert!(path.failed_iterations() >= 4);
    assert_eq!(tried.accepted, [0.25, 0.5, 0.75, 1.0]);
    assert_eq!(tried.again, [1.0, 0.5, 0.75, 1.0].map(|time| (time, true)));
    assert_eq!(path.states.iter().map(|s| s.completes).collect::<Vec<_>>(), [None, None, None, None, Some(1)]);
    // with a guide that holds them, the sub-steps are taken at once
    for guide in [Guide::steps_of(&path), Guide::of(&path, &Alone).holding_steps()] {
        let mut led = Tried::default();
        follow(Some(&guide), &previous, &mut led).unwrap();
        assert_eq!((led.accepted, led.again), (vec![0.25, 0.5, 0.75, 1.0], vec![]));
    }
    // one halving is not enough: the last failure is that of the step to 0.5
    let failure = follow(None, &MarchOptions { max_cutbacks: 1, ..previous }, &mut Tried::default()).unwrap_err();
    assert_eq!((failure.step, failure.increment), (1, [0.0, 0.5].into()));
    assert_eq!(failure.attempts.iter().map(|(time, _)| time.t).collect::<Vec<_>>(), [1.0, 0.5]);
    // halvings end before the increment is lost in the rounding of time
    let rigid = Spring { longest_step: 0.0, ..spring() };
    let load_path = LoadPath::new(Spring::rest(), &[1.0]);
    let most = MarchOptions { max_cutbacks: 80, bounds_cost: false, ..previous };
    let failure = self::follow(&rigid, &mut linear(), &load_path, &most, &mut Tried::default()).unwrap_err();
    assert_eq!(failure.attempts.len(), crate::MOST_CUTBACKS as usize + 1);
}

/// A guide provides the solution as the initial guess, so that its path takes one iteration per
/// step; its unknowns are those of the path in single precision.
#[test]
fn a_guide_leads_to_its_own_path() {
    let times = [0.4, 1.0];
    let options = MarchOptions { start: StartValues::Previous, ..MarchOptions::default() };
    let alone = path(&Spring::default(), &times, &options);
    let guide = Guide::of(&alone, &Alone);
    assert_eq!((guide.times(), guide.length()), ([0.0, 0.4, 1.0].as_slice(), 6));
    let single = |index: usize| alone.states[index].state.unknowns.iter().map(|&v| v as f32).collect::<Vec<_>>();
    let told = guide.with_unknowns(&Alone, |get| [0, 1, 2].map(get)).unwrap();
    assert_eq!(told, [0, 1, 2].map(single));
    let parts = Guide::from_parts(guide.times().to_vec(), told.to_vec(), 6, &Alone);
    assert_eq!(parts.as_ref(), Ok(&guide));
    let load_path = LoadPath { guide: Some(&guide), ..LoadPath::new(Spring::rest(), &times) };
    let led = follow(&Spring::default(), &mut linear(), &load_path, &options, &mut Silent).unwrap();
    for (led, alone) in led.states.iter().zip(&alone.states).skip(1) {
        let iterations = |at: &PathState| at.report.iterations.len();
        assert!(
            iterations(led) <= 2 && iterations(led) < iterations(alone),
            "{} {}",
            iterations(led),
            iterations(alone)
        );
        for (a, b) in led.state.unknowns.iter().zip(&alone.state.unknowns) {
            assert!((a - b).abs() < 1e-9);
        }
    }
}

/// Factors are kept for each set of prescribed unknowns: of six alternating solves, only the first
/// two factorize. After `forget`, they are computed again.
#[test]
fn earlier_factors_serve_again() {
    let mut workspace = Spring::workspace();
    let matrix = Spring::default().tangent_at([0.1, -0.2, 0.3, 0.2, 0.1, 0.0], &mut workspace);
    let mut linear = linear();
    linear.set_budget(Some(10));
    let sets = [[true, true, true, false, false, false], [true, true, true, false, true, false]];
    let rhs = [0.0, 0.0, 0.0, 1.0, -2.0, 0.5];
    let solve = |linear: &mut LinearSystem, fixed: &[bool; 6]| {
        let x = linear.solve(matrix, fixed, &[0, 1], &[], &rhs, 1e-12).unwrap();
        let mut product = vec![0.0; 6];
        matrix.mul(&x, &mut product);
        for i in 0..6 {
            assert!(if fixed[i] { x[i] == 0.0 } else { (product[i] - rhs[i]).abs() < 1e-11 });
        }
    };
    for fixed in [sets[0], sets[1], sets[0], sets[0], sets[1], sets[1]] {
        solve(&mut linear, &fixed);
    }
    let counts = linear.counts();
    assert_eq!((counts.factorizations, counts.lagged, counts.given_up), (2, 4, 0));
    linear.forget();
    solve(&mut linear, &sets[0]);
    assert_eq!(linear.counts().factorizations, 3);
}

/// Factors are kept as long as there is memory, counted once where states share them, and dropped
/// on request.
#[test]
fn kept_factors_are_counted_and_dropped() {
    let times = [0.5, 1.0, 1.5];
    let mut kept = path(&Spring::default(), &times, &MarchOptions { keeps_factors: true, ..options() });
    assert_eq!(kept.states_with_factors(), 3);
    let one = kept.factor_bytes / 3;
    assert!(one > 0);
    let room = MarchOptions { memory: 2 * one, keeps_factors: true, ..options() };
    let part = path(&Spring::default(), &times, &room);
    assert_eq!((part.states_with_factors(), part.factor_bytes), (2, 2 * one));
    kept.forget_factors();
    assert_eq!((kept.states_with_factors(), kept.factor_bytes), (0, 0));
}

/// Before every solve, the march and the sweep ask whether to stop. The march then ends with what
/// is complete, without another attempt; the sweep has no gradient.
#[test]
fn interrupted_between_newton_iterations() {
    let (spring, times) = (Spring::default(), [0.7, 1.0, 1.9]);
    let whole = path(&spring, &times, &options());
    let (solves, last) = (whole.newton_iterations(), whole.states[3].report.iterations.len());
    assert!(last > 1, "there is no place between two iterations");
    let asked = Arc::new(AtomicUsize::new(0));
    let interrupting = |after: usize| {
        asked.store(0, Ordering::Relaxed);
        let asked = Arc::clone(&asked);
        let mut linear = linear();
        linear.set_interrupt(Some(Arc::new(move || asked.fetch_add(1, Ordering::Relaxed) >= after)));
        linear
    };
    let load_path = LoadPath::new(Spring::rest(), &times);
    let mut stopped = interrupting(solves - 1);
    let part = follow(&spring, &mut stopped, &load_path, &options(), &mut Silent).unwrap();
    assert_eq!((part.steps, part.states.len(), asked.load(Ordering::Relaxed)), (2, 3, solves));
    assert_eq!(part.states[2].state.unknowns, whole.states[2].state.unknowns);
    // asking does not change any result
    let mut linear = interrupting(solves);
    let path = follow(&spring, &mut linear, &load_path, &options(), &mut Silent).unwrap();
    assert_eq!(path.states[3].state.unknowns, whole.states[3].state.unknowns);
    let objectives = [Weights { unseen: 0, increments: 0.0 }];
    let mut solver = Solver { problem: &spring, linear: &mut linear, workspace: &mut Spring::workspace() };
    let error = sweep(&mut solver, &path, &mut Responses::of(&objectives, &path), &SweepOptions::default());
    assert_eq!(error.unwrap_err().kind, StepFailureKind::Interrupted);
}

/// By hand: with a linear spring, φ (u − v) + u + m (h − 0.2 u₁) = 0 in the second step. Its increment from the
/// extrapolation, 2 u₁, is longer than the way to it from the first state, u₁, if the memory m is large. The step then
/// starts at the first state. Bound: the first solution of a linear system has single precision.
#[test]
fn an_extrapolation_is_given_up_if_the_last_state_is_nearer() {
    for (memory, given_up) in [(0.0, false), (4.0, false), (40.0, true), (-40.0, true)] {
        let spring = Spring { memory, ..Spring::linear() };
        let found = path(&spring, &[1.0, 2.0], &options());
        let [_, first, second] = &found.states[..] else { panic!("two steps") };
        let from = if given_up { 1.0 } else { 2.0 };
        let increment = |c: usize| {
            let (u, history) = (first.state.unknowns[3 + c], first.state.history[c]);
            let (stiffness, v) = (spring.stiffness[c], second.state.unknowns[c]);
            (stiffness * v - memory * (history - 0.2 * u)) / (stiffness + 1.0) - from * u
        };
        let expected = (0..3).map(|c| increment(c).powi(2)).sum::<f64>().sqrt();
        let report = &second.report;
        let apart = (report.iterations[0].displacement - expected).abs();
        assert!(apart < 1e-6 * expected.max(1e-3) && report.failed_iterations == 0, "{memory}: {expected} {report:?}");
    }
}
