//! Several load cases: each gives the same result as alone, and the objective and its gradient are
//! their weighted sums.

use crate::common::quantities::every_quantity;
use crate::common::scene::*;
use crate::common::*;
use slipstick::analysis::Gradients;
use slipstick::build::{Problem, build, optimization};
use slipstick::case::{CaseCode, Severity, parse_case};
use slipstick::design::{ElementValues, ObservedSteps, Reduction, Response, Term};
use slipstick_path::Silent;
use std::sync::Arc;

/// The block's motion in each of the two cases.
const MOTIONS: [&str; 2] = [
    "[{ t = 0.5, u = [0, -0.1, 0] }, { t = 1.0, u = [0.1, -0.1, 0.03] }]",
    "[{ t = 0.5, u = [0, -0.08, 0] }, { t = 1.0, u = [-0.06, -0.12, 0.1] }]",
];

/// The load in each case.
const LOADS: [&str; 2] = ["pressure = 20.0", "traction = [0.0, -9.0, 4.0]"];

const WEIGHTS: [f64; 2] = [0.7, 0.2];

fn scene(enforcement: &str) -> Scene {
    Scene { enforcement: enforcement.into(), observed: "\"all\"", steps: 6, ..Scene::default() }
}

/// Only one of the cases.
fn alone(enforcement: &str, case: usize) -> String {
    let more = format!("[[load]]\nsurface = 'slab_xmax'\n{}\n", LOADS[case]);
    Scene { motion: MOTIONS[case].into(), more, ..scene(enforcement) }.text()
}

/// Both cases.
fn both(enforcement: &str) -> String {
    let mut more = format!("[[dirichlet]]\nset = 'block_ymax'\nload_case = 'second'\nmotion = {}\n", MOTIONS[1]);
    for (name, (weight, load)) in ["first", "second"].iter().zip(WEIGHTS.iter().zip(LOADS)) {
        more += &format!("[[load_case]]\nname = '{name}'\nweight = {weight:?}\n");
        more += &format!("[[load]]\nsurface = 'slab_xmax'\nload_case = '{name}'\n{load}\n");
    }
    Scene { motion: MOTIONS[0].into(), drive: "load_case = 'first'".into(), more, ..scene(enforcement) }.text()
}

fn solve(text: &str) -> (slipstick::analysis::Forward, Gradients) {
    let mut problem = problem(text);
    let density = random_density(&problem, 4);
    let forward = forward(&mut problem, &density);
    let gradients = problem.analysis.gradients(&forward).expect("differentiable");
    (forward, gradients)
}

#[test]
fn objective_and_gradient_are_weighted_sums() {
    for (enforcement, within) in [(LAGRANGE.to_string(), 1e-9), (penalty(2e4), 1e-9), (augmented(1e4, 1e-12), 1e-8)] {
        let (whole, gradients) = solve(&both(&enforcement));
        let parts = [0, 1].map(|case| solve(&alone(&enforcement, case)));
        let sum: f64 = parts.iter().zip(WEIGHTS).map(|((part, _), weight)| weight * part.value).sum();
        assert!((whole.value / sum - 1.0).abs() < within, "{enforcement}: {} instead of {sum}", whole.value);
        for (step, value) in whole.step_values.iter().enumerate() {
            let expected = WEIGHTS[step / 6] * parts[step / 6].0.step_values[step % 6];
            assert!(
                (value - expected).abs() < within * sum.abs(),
                "{enforcement}: step {step}: {value}, not {expected}"
            );
        }
        let largest = gradients.density.iter().fold(0.0, |m: f64, g| m.max(g.abs()));
        for (e, found) in gradients.density.iter().enumerate() {
            let expected: f64 = parts.iter().zip(WEIGHTS).map(|((_, part), weight)| weight * part.density[e]).sum();
            assert!((found - expected).abs() < within * largest, "{enforcement}: element {e}: {found}, not {expected}");
        }
        // μ and both moduli, then the slab's support, the block's motion in each case, and the load
        // of each
        let values: Vec<f64> = gradients.parameters.iter().map(|p| p.1).collect();
        let of = |case: usize, k: usize| WEIGHTS[case] * parts[case].1.parameters[k].1;
        let expected = [
            of(0, 0) + of(1, 0),
            of(0, 1) + of(1, 1),
            of(0, 2) + of(1, 2),
            0.0,
            of(0, 4),
            of(1, 4),
            of(0, 5),
            of(1, 5),
        ];
        assert_eq!(values.len(), expected.len());
        for (k, (found, expected)) in values.iter().zip(expected).enumerate() {
            let scale = expected.abs().max(1e-6 * sum.abs());
            assert!(
                (found - expected).abs() < 100.0 * within * scale,
                "{enforcement}: parameter {k}: {found}, {expected}"
            );
        }
    }
}

/// Later designs take their initial guesses from the path of the previous design, separately for
/// each case.
#[test]
fn designs_for_two_load_cases() {
    let text = both(LAGRANGE).replace("initial = 0.5", "initial = 0.5\nvolume_fraction = 0.5")
        + "[optimizer]\niterations = 3\n";
    let case = parse_case(&text, "case.toml").unwrap().case;
    let mut optimization = optimization(&case, build(&case).unwrap()).unwrap();
    let mut counts = Vec::new();
    while !optimization.finished() {
        let forward = optimization.advance(&mut Silent).unwrap();
        assert_eq!(forward.path.steps, 12);
        let rests: Vec<f64> = forward.path.states.iter().filter(|s| s.rest).map(|s| s.time.on_axis()).collect();
        assert_eq!(rests, [0.0, 2.0]);
        counts.push(forward.path.newton_iterations());
    }
    let history: Vec<f64> = optimization.state.history.iter().map(|record| record.objective).collect();
    assert!(history.windows(2).all(|w| w[1] < w[0]), "{history:?}");
    // the last design, marched without the path of the previous one
    let alone = |density: &ElementValues, problem: &mut Problem| {
        problem.analysis.guide = None;
        problem.analysis.forward(density, &mut Silent).unwrap().path.newton_iterations()
    };
    let last = optimization.density();
    let unled = alone(&last, &mut optimization.problem);
    assert!(counts[3] < unled, "the path of the previous design does not help: {counts:?}, alone {unled}");
}

/// A failure in the second case is reported as such: there, the block is pushed through the slab.
#[test]
fn failures_name_the_load_case() {
    let text = both(LAGRANGE)
        .replace("u = [-0.06, -0.12, 0.1]", "u = [0, -2.5, 0]")
        .replace("tolerance =", "max_cutbacks = 1\ntolerance =");
    let mut problem = problem(&text);
    let density = random_density(&problem, 4);
    let error = problem.analysis.forward(&density, &mut Silent).expect_err("too far");
    let report = slipstick::run::FailureReport::new(&error, &problem);
    assert_eq!(report.load_case, Some(2));
    assert!(report.to_string().contains(", in load case 2, failed"), "{report}");
}

#[test]
fn wrong_load_cases() {
    let text = both(LAGRANGE);
    let errors = |text: &str| {
        let errors = parse_case(text, "case.toml").map(|_| ()).expect_err("an error");
        errors.diagnostics().iter().map(|d| (d.code(), d.to_string(), d.help().to_owned())).collect::<Vec<_>>()
    };
    for (from, to, code, says) in [
        ("load_case = 'first'", "load_case = 'frist'", CaseCode::UnknownSet, "first"),
        ("name = 'second'", "name = 'first'", CaseCode::DuplicateName, "a different name"),
        ("weight = 0.2", "weight = 0.0", CaseCode::OutOfRange, ""),
        ("load_case = 'second'\nmotion", "load_case = 'first'\nmotion", CaseCode::ConflictingDirichlet, "merge"),
    ] {
        assert!(text.contains(from));
        let found = errors(&text.replacen(from, to, 1));
        assert!(found.iter().any(|(c, _, help)| *c == code && help.contains(says)), "{to}: {found:?}");
    }
    let idle = text + "[[load_case]]\nname = 'third'\n";
    let warnings = parse_case(&idle, "case.toml").unwrap().warnings;
    assert!(
        warnings.iter().any(|w| w.severity() == Severity::Warning && w.to_string().contains("`third`")),
        "{warnings:?}"
    );
}

/// Weights for single steps of single load cases give the gradient of the sum of these values as a
/// response, which finite differences confirm in `quantity_gradients.rs`.
#[test]
fn weighted_values_are_pulled_back() {
    let mut problem = problem(&both(LAGRANGE));
    let density = random_density(&problem, 4);
    let quantities = every_quantity(&problem);
    // the drive's reaction, the normal force and the friction work, which accumulates
    let chosen = [(2, 3, 1.5), (7, 6, -0.4), (17, 2, 0.8)];
    let terms = chosen.map(|(q, step, weight)| {
        let (quantity, steps) = (Arc::clone(&quantities[q]), ObservedSteps::Only(vec![step]));
        Term { quantity, steps, weight }
    });
    let everywhere = terms.clone().map(|term| Term { steps: ObservedSteps::All, weight: 1.0, ..term });
    let sum = Response::new("sum", terms.into(), Reduction::Sum).in_load_cases(WEIGHTS.into());
    problem.analysis.set_objective(sum).expect("right");
    let base = forward(&mut problem, &density);
    let expected = problem.analysis.gradients(&base).expect("differentiable");
    let all = Response::new("all", everywhere.into(), Reduction::Sum).in_load_cases(vec![1.0; 2]);
    problem.analysis.set_objective(all).expect("right");
    let base = forward(&mut problem, &density);
    let mut weights = vec![vec![0.0; 12]; 3];
    for (row, (_, step, weight)) in weights.iter_mut().zip(chosen) {
        WEIGHTS.iter().enumerate().for_each(|(case, of_case)| row[6 * case + step - 1] = of_case * weight);
    }
    let found = problem.analysis.pull_back(&base, weights, true).expect("differentiable");
    assert!(deviation(&found.density, &expected.density) < 1e-9);
    let values = |gradients: &Gradients| gradients.parameters.iter().map(|p| p.1).collect::<Vec<f64>>();
    assert!(deviation(&values(&found), &values(&expected)) < 1e-9);
    let nothing = problem.analysis.pull_back(&base, vec![vec![0.0; 12]; 3], false).expect("differentiable");
    assert!(nothing.density.iter().all(|&derivative| derivative == 0.0));
}
