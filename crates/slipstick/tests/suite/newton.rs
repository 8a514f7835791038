//! Newton's method and step control: quadratic convergence, first contact with friction, sub-steps,
//! typed failures, tolerances.

use crate::common::scene::*;
use crate::common::*;
use slipstick::analysis::AnalysisError;
use slipstick::design::ElementValues;
use slipstick_linalg::Alone;
use slipstick_path::{
    Guide, IterationRecord, LoadTime, MarchEvent, MarchFailure, MarchObserver, Path, Remedy, Silent, Span, StateError,
    StepFailureKind,
};

/// Uzawa's iteration without acceleration and with one pass: only its inner Newton iteration.
pub const INNER: &str = "{ augmented = { stiffness = 1e4, tolerance = 1e30, max_uzawa = 1, acceleration = 0 } }";

/// With a tight tolerance and its own stiffness.
pub const AUGMENTED: &str = "{ augmented = { tolerance = 1e-11 } }";

/// Order of convergence from three successive increments.
pub fn order(increments: &[f64]) -> f64 {
    (increments[2] / increments[1]).ln() / (increments[1] / increments[0]).ln()
}

/// Once an increment e = ‖Δd‖/‖d‖ + ‖Δζ‖/‖ζ‖ is below 1e-3, the next one is below K e² (linear
/// convergence with factor q would give q/e, without bound) until it meets rounding, and the last
/// three have order 2 in the median over the steps.
#[test]
fn newton_converges_quadratically() {
    for (method, enforcement) in [("Lagrange", LAGRANGE), ("penalty", &penalty(5e3)), ("augmented, held", INNER)] {
        for shape in ["standard", "dual"] {
            let load_path = "tolerance = { relative = 1e-12 }\nstart_values = \"last_state\"".into();
            let scene = Scene { enforcement: enforcement.into(), shape, load_path, ..Scene::default() };
            let mut problem = problem(&scene.text());
            let density = random_density(&problem, 3);
            let run = forward(&mut problem, &density);
            let (mut orders, mut largest) = (Vec::new(), 0.0f64);
            for (step, state) in run.path.completed() {
                let (d, zeta) = state.state.unknowns.split_at(3 * problem.mesh.nodes.len());
                let (d, zeta) = (norm(d), norm(zeta).max(f64::MIN_POSITIVE));
                let relative = |r: &IterationRecord| r.displacement / d + r.multiplier / zeta;
                let increments: Vec<f64> = state.report.iterations.iter().map(relative).collect();
                assert!(increments.len() >= 3, "{method} {shape} step {step}: {increments:?}");
                let last = increments.windows(3).rev().take(3).map(order).fold(0.0, f64::max);
                orders.push(last);
                for pair in increments.windows(2).filter(|pair| pair[0] < 1e-3 && pair[1] > 1e-12) {
                    let constant = pair[1] / (pair[0] * pair[0]);
                    assert!(constant < 1000.0, "{method} {shape} step {step}: K = {constant} in {increments:?}");
                    largest = largest.max(constant);
                }
            }
            orders.sort_by(f64::total_cmp);
            println!("{method} {shape}: orders {orders:.2?}, K up to {largest:.1}");
            assert!(orders[orders.len() / 2] > 1.8, "{method} {shape}: {orders:?}");
        }
    }
}

#[derive(Default)]
pub struct Watch {
    pub cut_backs: Vec<StepFailureKind>,
    retries: usize,
}

impl MarchObserver for Watch {
    fn on_event(&mut self, event: &MarchEvent<'_>) {
        if let MarchEvent::Retry { failed, remedy, .. } = event {
            if *remedy == Remedy::CutBack {
                self.cut_backs.push(failed.kind.clone());
            } else {
                self.retries += 1;
            }
        }
    }
}

pub fn march(scene: &Scene) -> (Result<Path, Box<MarchFailure>>, Watch) {
    let mut problem = problem(&scene.text());
    let density = random_density(&problem, 7);
    let mut watch = Watch::default();
    let result = match problem.analysis.forward(&density, &mut watch) {
        Ok(run) => Ok(run.path),
        Err(AnalysisError::March(failure)) => Err(failure),
        Err(other) => panic!("{other}"),
    };
    (result, watch)
}

/// At first contact the regularized problem is homogeneous, so a smaller load increment changes
/// nothing; without damping, the iteration jumps between directions of slip indefinitely.
#[test]
fn friction_from_first_contact_on_needs_no_sub_steps() {
    let mut damped = 0;
    for friction in [0.1, 0.3, 0.5] {
        for shape in ["standard", "dual"] {
            for stiffness in [5e3, 2e4] {
                let motion = "[{ t = 0.4, u = [0, -0.1, 0] }, { t = 1.0, u = [0.15, -0.12, 0.04] }]".into();
                let scene = Scene { enforcement: penalty(stiffness), friction, shape, motion, ..Scene::default() };
                let (path, watch) = march(&scene);
                let path = path.unwrap_or_else(|e| panic!("mu {friction} {shape} {stiffness}: {e}"));
                assert!(watch.cut_backs.is_empty(), "mu {friction} {shape} {stiffness}: {:?}", watch.cut_backs);
                damped += path.states.iter().flat_map(|s| &s.report.iterations).filter(|r| r.step_length < 1.0).count();
            }
        }
    }
    assert!(damped > 0, "no increment was damped");
}

/// One step that crushes, shears and rotates the bodies; uses the first depth that is too large for
/// one increment.
#[test]
fn a_step_that_is_too_large_is_reached_in_sub_steps() {
    for (method, enforcement) in [("Lagrange", LAGRANGE), ("penalty", &penalty(5e3))] {
        let crush = |depth: f64| Scene {
            enforcement: enforcement.into(),
            steps: 1,
            friction: 0.2,
            motion: format!("[{{ t = 1.0, u = [0.6, -{depth:?}, 0.3], angle = 40 }}]"),
            drive: "rotation = { point = [1.0, 0, 0.5], direction = [0, 1, 0] }".into(),
            ..Scene::default()
        };
        let runs = (0..20).map(|k| march(&crush(0.5 + 0.05 * k as f64)));
        let reached = |(path, watch): (Result<Path, _>, Watch)| {
            path.ok().filter(|path: &Path| path.states.len() > 2).map(|path| (path, watch))
        };
        let (path, watch) = runs.into_iter().find_map(reached).expect("some depth is too much");
        let times: Vec<f64> = path.states.iter().map(|s| s.time.t).collect();
        println!("{method}: {times:?} after {:?}", watch.cut_backs);
        assert!(!watch.cut_backs.is_empty());
        assert!(times.is_sorted_by(|a, b| a < b) && *times.last().unwrap() == 1.0);
        assert_eq!((path.steps, path.completed().map(|(n, _)| n).collect::<Vec<_>>()), (1, vec![1]));
        assert!(path.states[1..times.len() - 1].iter().all(|s| s.completes.is_none()));
    }
}

/// A path that follows another one's sub-steps has the same sub-steps, and wastes no attempt.
#[test]
fn sub_steps_of_a_guide_are_taken() {
    let scene = Scene {
        enforcement: LAGRANGE.into(),
        steps: 2,
        friction: 0.2,
        motion: "[{ t = 1.0, u = [0.6, -0.3, 0.3], angle = 40 }]".into(),
        drive: "rotation = { point = [1.0, 0, 0.5], direction = [0, 1, 0] }".into(),
        ..Scene::default()
    };
    let mut problem = problem(&scene.text());
    let density = random_density(&problem, 7);
    let coarse = problem.analysis.forward(&density, &mut Silent).expect("converges");
    let times = problem.analysis.times.clone();
    problem.analysis.times = [0.125, 0.25, 0.5, 1.0].map(LoadTime::from).to_vec();
    let fine = problem.analysis.forward(&density, &mut Silent).expect("converges");
    problem.analysis.times = times;
    let of = |path: &Path| path.states.iter().map(|s| (s.time.t, s.completes)).collect::<Vec<_>>();
    assert_eq!(of(&coarse.path), [(0.0, None), (0.5, Some(1)), (1.0, Some(2))]);
    for guide in [Guide::steps_of(&fine.path), Guide::of(&fine.path, &Alone).holding_steps()] {
        problem.analysis.guide = Some(guide);
        let mut watch = Watch::default();
        let led = problem.analysis.forward(&density, &mut watch).expect("converges");
        assert_eq!(of(&led.path), [(0.0, None), (0.125, None), (0.25, None), (0.5, Some(1)), (1.0, Some(2))]);
        assert!(watch.cut_backs.is_empty());
        assert!((led.value - fine.step_values[2] - fine.step_values[3]).abs() < 1e-7 * led.value.abs());
        assert!((led.value - coarse.value).abs() > 1e-4 * led.value.abs(), "friction does not depend on sub-steps");
    }
    problem.analysis.guide = Some(Guide::of(&fine.path, &Alone));
    let led = problem.analysis.forward(&density, &mut Silent).expect("converges");
    assert_eq!(of(&led.path), of(&coarse.path));
}

/// The bodies together are 1.8 high and are to be pressed to −0.2: elements must invert, in the
/// step that reaches this.
#[test]
fn a_hopeless_step_fails_with_its_place_and_the_inverted_elements() {
    let scene = Scene {
        motion: "[{ t = 0.2, u = [0, -0.1, 0] }, { t = 1.0, u = [0, -2.0, 0] }]".into(),
        steps: 5,
        load_path: "max_cutbacks = 3".into(),
        ..Scene::default()
    };
    let (result, _) = march(&scene);
    let failure = result.expect_err("no state exists there");
    println!("{failure}");
    assert!((2..=5).contains(&failure.step));
    assert_eq!(failure.path.steps, failure.step - 1, "what converged before is kept");
    assert!(failure.path.states.iter().all(|s| s.state.unknowns.iter().all(|u| u.is_finite())));
    let Span { from, to, .. } = failure.increment;
    let step = 0.2;
    assert!((failure.step - 1) as f64 * step <= from && from < to && to <= failure.step as f64 * step + 1e-12);
    assert!(to - from < 0.25 * step, "the increment was halved three times before giving up");
    let inverted = failure.attempts.iter().find_map(|(_, kind)| match kind {
        StepFailureKind::State(StateError::InvertedElements { elements }) => Some(elements.clone()),
        _ => None,
    });
    let inverted = inverted.expect("some attempt met inverted elements");
    assert!(!inverted.is_empty() && inverted.iter().all(|&e| e < 5) && inverted.is_sorted());
    assert!(failure.to_string().contains(&format!("load step {}", failure.step)));
    assert_eq!(failure.iterate.len(), failure.path.states[0].state.unknowns.len());
}

/// Every norm of the last iteration lies below its own bound, or the state differs by less than a
/// thousandth of the bound on the increment from the state of a run to round-off; and no earlier
/// iteration was within the bounds.
#[test]
fn absolute_tolerances_are_honoured() {
    let run = |tolerance: &str| {
        let load_path = format!("tolerance = {{ {tolerance} }}");
        march(&Scene { load_path, ..Scene::default() }).0.unwrap()
    };
    let exact = run("relative = 1e-14");
    let bounds = [(1e-2, 1e-3, 1e-1, 1.0), (1e-6, 1e-3, 1e2, 1e2), (1e2, 1e2, 1e2, 1e-4), (1e-9, 1e-9, 1e-9, 1e-9)];
    let mut beyond = 0;
    for (residual, displacement, contact, multiplier) in bounds {
        let path = run(&format!(
            "residual = {residual:e}, displacement = {displacement:e}, contact = {contact:e}, multiplier = {multiplier:e}"
        ));
        let in_balance = |r: &IterationRecord| r.residual <= residual && r.contact <= contact;
        let within =
            |r: &IterationRecord| in_balance(r) && r.displacement <= displacement && r.multiplier <= multiplier;
        assert_eq!(path.states.len(), exact.states.len());
        for (state, exact) in path.states.iter().zip(&exact.states).skip(1) {
            let (last, before) = state.report.iterations.split_last().unwrap();
            assert!(in_balance(last), "{last:?}");
            if !within(last) {
                let error: Vec<f64> =
                    state.state.unknowns.iter().zip(&exact.state.unknowns).map(|(y, exact)| y - exact).collect();
                let (d, zeta) = error.split_at(error.len() - 3 * last.status.iter().sum::<usize>());
                let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
                assert!(norm(d) <= 1e-3 * displacement && norm(zeta) <= 1e-3 * multiplier, "{last:?}");
                beyond += 1;
            }
            assert!(!before.iter().any(within), "{before:?}");
        }
    }
    assert!(beyond > 0, "no state was accepted for its expected next increment");
}

/// A tolerance below round-off ends the iteration at round-off, with increments of a few units in
/// the last place of the positions, instead of a failure.
#[test]
fn a_tolerance_below_rounding_ends_at_rounding() {
    for (method, enforcement) in [("Lagrange", LAGRANGE), ("penalty", &penalty(1e5))] {
        let load_path = "tolerance = { relative = 1e-16 }".to_string();
        let scene = Scene { enforcement: enforcement.into(), load_path, ..Scene::default() };
        let mut problem = problem(&scene.text());
        let density = random_density(&problem, 7);
        let run = problem.analysis.forward(&density, &mut Silent).unwrap_or_else(|e| panic!("{method}: {e}"));
        assert_eq!(run.path.states.len(), 11, "{method}: no sub-steps");
        let size = norm(&problem.mesh.nodes.iter().flatten().copied().collect::<Vec<_>>());
        for state in run.path.states.iter().skip(1) {
            let last = state.report.iterations.last().unwrap();
            assert!(last.displacement < 1e-14 * size, "{method}: {last:?}");
            // and this is reported, with the remaining residual
            assert!(
                state.report.rounded.is_some_and(|left| 1e-16 < left && left < 1e-10),
                "{:?}",
                state.report.rounded
            );
        }
    }
}

/// The initial guess of a step affects the number of iterations, not the result: from the last
/// state, from a prediction, or from the path of a nearby design.
#[test]
fn start_values_change_no_result() {
    for (method, enforcement) in [("Lagrange", LAGRANGE), ("penalty", &penalty(5e3)), ("augmented", AUGMENTED)] {
        let run = |start: &str, lead: bool| {
            let load_path = format!("tolerance = {{ relative = 1e-12 }}\nstart_values = \"{start}\"");
            let scene = Scene { enforcement: enforcement.into(), load_path, ..Scene::default() };
            let mut problem = problem(&scene.text());
            let density = random_density(&problem, 7);
            if lead {
                let nearby: ElementValues = density.iter().map(|d| 0.99 * d).collect();
                problem.analysis.guide = Some(Guide::of(&forward(&mut problem, &nearby).path, &Alone));
            }
            forward(&mut problem, &density)
        };
        let expected = run("last_state", false);
        let iterations = expected.path.newton_iterations();
        for (start, lead) in [("extrapolated", false), ("previous_design", true)] {
            let found = run(start, lead);
            let fewer = found.path.newton_iterations();
            println!("{method}: {iterations} iterations from the last state, {fewer} {start}");
            assert!(fewer < iterations, "{method}, {start}: {fewer} of {iterations} iterations");
            assert_eq!(found.path.states.len(), expected.path.states.len());
            for (found, expected) in found.path.states.iter().zip(&expected.path.states) {
                let (found, expected) = (&found.state.unknowns, &expected.state.unknowns);
                let difference: Vec<f64> = found.iter().zip(expected).map(|(a, b)| a - b).collect();
                assert!(norm(&difference) <= 1e-9 * norm(expected), "{method}, {start}");
            }
            assert!((found.value / expected.value - 1.0).abs() < 1e-9, "{method}, {start}");
        }
    }
}

/// The augmented Lagrangian method costs about what the Lagrange multiplier method does, however
/// small ε is; if its second-order updates cannot converge, Uzawa's iteration ends at the same
/// state.
#[test]
fn multiplier_updates_of_second_order_make_epsilon_a_matter_of_taste() {
    let run = |enforcement: &str, more: &str| {
        let load_path = format!("tolerance = {{ relative = 1e-10 }}\n{more}");
        let scene = Scene { enforcement: enforcement.into(), load_path, ..Scene::default() };
        march(&scene).0.unwrap_or_else(|failure| panic!("{enforcement}: {failure}"))
    };
    let augmented = |stiffness: f64, acceleration: usize| {
        format!(
            "{{ augmented = {{ stiffness = {stiffness}, tolerance = 1e-9, max_uzawa = 1000, acceleration = {acceleration} }} }}"
        )
    };
    let lagrange = run(LAGRANGE, "");
    let end = |path: &Path| path.states.last().unwrap().state.unknowns.clone();
    let expected = end(&lagrange);
    let check = |path: &Path, what: &str| {
        let difference: Vec<f64> = end(path).iter().zip(&expected).map(|(a, b)| a - b).collect();
        assert!(norm(&difference) < 1e-7 * norm(&expected), "{what}: {:e}", norm(&difference) / norm(&expected));
    };
    for stiffness in [1e1, 1e3, 1e5] {
        let path = run(&augmented(stiffness, 8), "");
        check(&path, "second order");
        let (found, bound) = (path.newton_iterations(), 2 * lagrange.newton_iterations());
        assert!(found <= bound, "stiffness {stiffness}: {found} iterations");
    }
    let plain = run(&augmented(1e4, 0), "");
    check(&plain, "plain");
    assert!(plain.newton_iterations() > 3 * lagrange.newton_iterations());
    // few iterations are allowed, so that some updates fail, but enough that no step is cut back,
    // which would be a different path
    let strained = (3..8)
        .map(|most| run(&augmented(1e4, 8), &format!("max_newton_iterations = {most}\nstart_values = \"last_state\"")));
    let updates = |path: &Path| path.states.iter().map(|s| s.report.uzawa).max().unwrap();
    let mut some_failed = strained.filter(|path| path.states.len() == lagrange.states.len() && updates(path) > 1);
    check(&some_failed.next().expect("a path on which an update failed"), "with failing updates");
}
