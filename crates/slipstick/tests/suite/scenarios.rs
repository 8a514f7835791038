//! Load cases with their own friction, moduli, motions, loads and positions, and how their
//! objectives become one.

use crate::common::scene::*;
use crate::common::*;
use rayon::prelude::*;
use slipstick::analysis::{Forward, Gradients};
use slipstick::build::Problem;
use slipstick::path::Silent;

/// A load case, and the same differences in a case without load cases: replacements in its text.
struct Scenario {
    load_case: &'static str,
    alone: &'static [(&'static str, &'static str)],
}

const LOAD: &str = "[[load]]\nsurface = 'slab_xmax'\ntraction = [0.0, -9.0, 4.0]\n";

const SCENARIOS: [Scenario; 7] = [
    Scenario { load_case: "", alone: &[] },
    Scenario { load_case: "friction = 0.15", alone: &[("friction = 0.4", "friction = 0.15")] },
    Scenario {
        load_case: "friction = 9.0\npairs = [{ slave = 'block_ymin', friction = 0.1 }]",
        alone: &[("friction = 0.4", "friction = 0.1")],
    },
    Scenario {
        load_case: "modulus_factor = 1.3\nbodies = [{ body = 'slab', modulus_factor = 0.8 }]",
        alone: &[
            ("1000.0", "800.0"),
            ("800.0, poisson_ratio = 0.3 } }\n[[contact", "1300.0, poisson_ratio = 0.3 } }\n[[contact"),
        ],
    },
    Scenario {
        load_case: "motion_factor = 0.9",
        alone: &[("u = [0, -0.1, 0]", "u = [0, -0.09, 0]"), ("[0.1, -0.1, 0.03]", "[0.09, -0.09, 0.027]")],
    },
    Scenario { load_case: "loads = [{ surface = 'slab_xmax', factor = -0.5 }]", alone: &[("-9.0, 4.0", "4.5, -2.0")] },
    Scenario {
        load_case: "bodies = [{ body = 'block', offset = [0.15, -0.01, 0.05], \
                    rotation = { point = [1, 1, 0.5], direction = [0, 1, 0], angle = 12 } }]",
        // rotated about an axis through the origin, then moved so that [1, 1, 0.5] stays; then
        // offset: [1, 0.5] − R [1, 0.5] in x and z
        alone: &[(
            "place = {}\nmaterial = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }\n[[contact",
            "place = { rotate = { axis = [0, 1, 0], degrees = 12 }, translate = [0.06789655385, -0.01, 0.26883789178] }\n\
             material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }\n[[contact",
        )],
    },
];

fn scene(enforcement: &str) -> Scene {
    Scene { enforcement: enforcement.into(), observed: "\"all\"", steps: 4, more: LOAD.into(), ..Scene::default() }
}

/// All load cases of `scenarios`, with `over` in the objective.
fn together(enforcement: &str, scenarios: &[&Scenario], over: &str) -> String {
    let mut text = scene(enforcement).text();
    text =
        text.replace("contact_force = { steps = \"all\" }", &format!("contact_force = {{ steps = \"all\" }}\n{over}"));
    for (number, scenario) in scenarios.iter().enumerate() {
        let weight = [1.0, 0.5, 2.0][number % 3];
        text += &format!("[[load_case]]\nname = 'case_{number}'\nweight = {weight:?}\n{}\n", scenario.load_case);
    }
    text
}

fn alone(enforcement: &str, scenario: &Scenario) -> String {
    scenario.alone.iter().fold(scene(enforcement).text(), |text, (from, to)| {
        assert!(text.contains(from), "{from}\n{text}");
        text.replace(from, to)
    })
}

fn solve(text: &str) -> (Problem, Forward, Gradients) {
    let mut problem = problem(text);
    let density = random_density(&problem, 4);
    let forward = forward(&mut problem, &density);
    let gradients = problem.analysis.gradients(&forward).expect("differentiable");
    (problem, forward, gradients)
}

/// Each load case gives the values and the gradients of a case of its own, for all three methods.
#[test]
fn load_cases_are_as_if_alone() {
    for (enforcement, within) in [(LAGRANGE.to_string(), 1e-8), (penalty(2e4), 1e-8), (augmented(1e4, 1e-12), 1e-7)] {
        for scenario in &SCENARIOS {
            // the second case is the one that differs
            let (_, whole, gradients) = solve(&together(&enforcement, &[&SCENARIOS[0], scenario], ""));
            let first = solve(&alone(&enforcement, &SCENARIOS[0]));
            let second = solve(&alone(&enforcement, scenario));
            let what = scenario.load_case;
            for (step, value) in whole.step_values.iter().enumerate() {
                let expected = if step < 4 { first.1.step_values[step] } else { 0.5 * second.1.step_values[step - 4] };
                assert!((value / expected - 1.0).abs() < within, "{what}: step {step}: {value}, not {expected}");
            }
            let expected: Vec<f64> = first.2.density.iter().zip(&second.2.density).map(|(a, b)| a + 0.5 * b).collect();
            let error = deviation(&gradients.density, &expected);
            assert!(error < within, "{what}: gradient off by {error:e}");
        }
    }
}

/// The largest, the mean, and the mean plus deviations of the load cases: values by hand from those
/// of the single cases, gradients by differences.
#[test]
fn objectives_of_load_cases_become_one() {
    let scenarios = [&SCENARIOS[1], &SCENARIOS[3], &SCENARIOS[6]];
    let values = scenarios.map(|scenario| solve(&alone(LAGRANGE, scenario)).1.value);
    let weights = [1.0, 0.5, 2.0];
    let all: f64 = weights.iter().sum();
    let mean = values.iter().zip(weights).map(|(value, weight)| weight * value).sum::<f64>() / all;
    let variance = values.iter().zip(weights).map(|(value, weight)| weight * (value - mean).powi(2)).sum::<f64>() / all;
    let worst = values.iter().zip(weights).map(|(value, weight)| weight * value).fold(f64::NEG_INFINITY, f64::max);
    for (over, expected) in [
        ("load_cases = 'sum'", all * mean),
        ("load_cases = 'mean'", mean),
        ("load_cases = { mean_plus_deviations = 1.5 }", mean + 1.5 * variance.sqrt()),
        ("load_cases = 'worst'", worst),
    ] {
        let mut problem = problem(&together(LAGRANGE, &scenarios, over));
        let density = random_density(&problem, 4);
        let check = check_gradient(&mut problem, &density);
        assert!((check.value / expected - 1.0).abs() < 1e-8, "{over}: {} instead of {expected}", check.value);
        assert!(check.error < 1e-7, "{over}: gradient off by {:e}", check.error);
    }
}

/// Friction that a load case sets does not depend on the pair's own; moduli and amplitudes are
/// multiplied. Differences of the parameters in the text.
#[test]
fn parameters_of_varied_load_cases() {
    let text = together(LAGRANGE, &[&SCENARIOS[1], &SCENARIOS[3], &SCENARIOS[4], &SCENARIOS[5]], "");
    let (_, _, gradients) = solve(&text);
    let of = |number: usize| gradients.parameters[number].1;
    let difference = |from: &str, to: &dyn Fn(f64) -> String, at: f64| {
        assert!(text.contains(from));
        let value = |x: f64| solve(&text.replacen(from, &to(x), 1)).1.value;
        let h = 1e-4 * at;
        (8.0 * (value(at + h) - value(at - h)) - (value(at + 2.0 * h) - value(at - 2.0 * h))) / (12.0 * h)
    };
    let friction = difference("\nfriction = 0.4", &|mu| format!("\nfriction = {mu:?}"), 0.4);
    assert!((of(0) / friction - 1.0).abs() < 1e-6, "{} instead of {friction}", of(0));
    let modulus = difference("youngs_modulus = 1000.0", &|e| format!("youngs_modulus = {e:?}"), 1000.0);
    assert!((of(1) / modulus - 1.0).abs() < 1e-6, "{} instead of {modulus}", of(1));
    let load =
        difference("traction = [0.0, -9.0, 4.0]", &|a| format!("traction = [0.0, {:?}, {:?}]", -9.0 * a, 4.0 * a), 1.0);
    assert!((of(5) / load - 1.0).abs() < 1e-6, "{} instead of {load}", of(5));
}

/// Paths and gradients are the same bits on one, two and three threads, and so are the events that
/// an observer sees.
#[test]
fn threads_do_not_matter() {
    let scenarios: Vec<&Scenario> = SCENARIOS.iter().collect();
    let text = together(LAGRANGE, &scenarios, "load_cases = { mean_plus_deviations = 1.0 }");
    let results = [1, 2, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut problem = problem(&text);
            let density = random_density(&problem, 4);
            let mut seen = Seen::default();
            let forward = problem.analysis.forward(&density, &mut seen).unwrap();
            let gradient = problem.analysis.gradient(&forward).unwrap();
            let states: Vec<Vec<f64>> = forward.path.states.iter().map(|at| at.state.unknowns.clone()).collect();
            (seen.0, states, gradient)
        })
    });
    assert_eq!(results[0].0.len(), 7 * 4);
    assert!(results[0].0.is_sorted());
    assert_eq!(results[0], results[1]);
    assert_eq!(results[0], results[2]);
}

/// More analyses at a time than the pool has threads, each with several load cases on threads of
/// their own: none waits for ever.
#[test]
fn load_cases_in_a_busy_pool() {
    let text = together(LAGRANGE, &[&SCENARIOS[1], &SCENARIOS[4], &SCENARIOS[5]], "");
    let expected = solve(&text).1.value;
    let values: Vec<f64> = (0..6).into_par_iter().map(|_| solve(&text).1.value).collect();
    assert_eq!(values, [expected; 6]);
}

/// The times of accepted steps.
#[derive(Default)]
struct Seen(Vec<f64>);

impl slipstick::path::MarchObserver for Seen {
    fn on_event(&mut self, event: &slipstick::path::MarchEvent<'_>) {
        if let slipstick::path::MarchEvent::Accepted { state, .. } = event {
            self.0.push(state.time.on_axis());
        }
    }
}

/// A failure in the second case keeps the path of the first, on one thread and on two; the third
/// case, which is marched at the same time, is dropped.
#[test]
fn failures_keep_earlier_load_cases() {
    let far = Scenario { load_case: "motion_factor = 25.0", alone: &[] };
    let text = together(LAGRANGE, &[&SCENARIOS[0], &far, &SCENARIOS[1]], "")
        .replace("tolerance =", "max_cutbacks = 1\ntolerance =");
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let error = pool.install(|| {
            let mut problem = problem(&text);
            let density = random_density(&problem, 4);
            problem.analysis.forward(&density, &mut Silent).unwrap_err()
        });
        let slipstick::analysis::AnalysisError::March(failure) = error else { panic!("{error}") };
        assert!((5..=8).contains(&failure.step), "{}", failure.step);
        assert_eq!(failure.path.steps + 1, failure.step);
        assert_eq!(failure.path.load_cases().len(), 2);
    }
}

#[test]
fn wrong_differences() {
    let wrong = |load_case: &str, replaced: (&str, &str)| {
        let scenario = Scenario { load_case: Box::leak(load_case.to_owned().into_boxed_str()), alone: &[] };
        let text = together(LAGRANGE, &[&scenario], "").replace(replaced.0, replaced.1);
        match slipstick::case::parse_case(&text, "case.toml") {
            Ok(read) => slipstick::build::build(&read.case).map(|_| ()).expect_err("an error").to_string(),
            Err(errors) => errors.to_string(),
        }
    };
    let none = ("", "");
    for (load_case, replaced, says) in [
        ("friction = -0.1", none, "must not be negative"),
        ("modulus_factor = 0.0", none, "must be greater than zero"),
        ("pairs = [{ slave = 'slab_ymax', friction = 0.1 }]", none, "not the slave of a contact pair"),
        ("bodies = [{ body = 'blok', offset = [0, 1, 0] }]", none, "there is no body called `blok`"),
        ("bodies = [{ body = 'block' }]", none, "the body does not differ"),
        ("motions = [{ set = 'slab_ymin', factor = 2 }]", none, "nothing moves `slab_ymin`"),
        ("loads = [{ surface = 'slab_xmin', factor = 2 }]", none, "nothing loads `slab_xmin`"),
        (
            "bodies = [{ body = 'block', rotation = { point = [0, 0, 0], direction = [0, 1, 0], angle = 5 } }]",
            ("neo_hooke", "linear_elastic"),
            "would strain it",
        ),
    ] {
        let found = wrong(load_case, replaced);
        assert!(found.contains(says), "{load_case}: {found}");
    }
}
