//! The library's examples run, and their derivatives are those that finite differences give.

#[path = "../../examples/own_objective.rs"]
mod own_objective;
#[path = "../../examples/own_problem.rs"]
mod own_problem;
#[path = "../../examples/sensitivities.rs"]
mod sensitivities;

use sensitivities::{NUMBERS, Numbers, Watch};
use slipstick::analysis::{Analysis, ResponseRefused};
use slipstick::build::build;
use slipstick::model::Parameter;
use slipstick_design::quantity::{ContactForce, Dimension, Quantity, StateDerivative, StateView};
use slipstick_design::{ObservedSteps, Response};
use slipstick_path::{Silent, Tolerance, Tolerances};
use std::sync::Arc;

#[test]
fn examples_run() {
    own_objective::main().expect("runs");
    own_problem::main().expect("runs");
    sensitivities::main().expect("runs");
}

/// The tutorial quotes the slider's equations and what the example prints; `UPDATE_PAGES=1` writes the
/// quotations. The derivatives that it prints agree.
#[test]
fn the_tutorial_of_ones_own_problem_quotes_its_example() {
    let source = include_str!("../../../path/src/slider.rs");
    let equations = &source[source.find("impl Equations for Slider").expect("there")..];
    let equations = &equations[..equations.find("\n}\n").expect("it ends") + 3];
    quotes("slider", &format!("```rust\n{equations}```"));
    let printed = own_problem::printed().expect("runs");
    quotes("own_problem", &format!("```text\n{printed}```"));
    let values: Vec<f64> = printed
        .lines()
        .last()
        .into_iter()
        .flat_map(|line| line.split([' ', ',']))
        .filter_map(|word| word.parse().ok())
        .collect();
    assert!(values.len() == 2 && (values[0] - values[1]).abs() < 2e-7, "{values:?}");
}

/// Asserts that the tutorial has this text between the marks of this name.
fn quotes(mark: &str, quotation: &str) {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/developers/own_problem.md");
    let text = std::fs::read_to_string(page).expect("there");
    let begin = format!("<!-- {mark} -->\n");
    let (before, rest) = text.split_once(&begin).expect("marked");
    let (_, after) = rest.split_once("<!-- end -->").expect("marked");
    let expected = format!("{before}{begin}{quotation}\n<!-- end -->{after}");
    if std::env::var_os("UPDATE_PAGES").is_some() {
        std::fs::write(page, &expected).expect("written");
    }
    assert_eq!(std::fs::read_to_string(page).expect("there"), expected);
}

fn tighten(analysis: &mut Analysis) {
    let bound = Tolerance::Relative(1e-12);
    analysis.march.newton.tolerances =
        Tolerances { residual: bound, displacement: bound, contact: bound, multiplier: bound };
}

/// Central difference of order 4.
fn difference(h: f64, mut value: impl FnMut(f64) -> f64) -> f64 {
    (8.0 * (value(h) - value(-h)) - (value(2.0 * h) - value(-2.0 * h))) / (12.0 * h)
}

/// The gradient of an objective that the library does not know, by single densities.
#[test]
fn an_objective_of_ones_own_has_an_exact_gradient() {
    let mut problem = own_objective::problem().expect("builds");
    tighten(&mut problem.analysis);
    let density = problem.initial_density().clone();
    let forward = problem.analysis.forward(&density, &mut Silent).expect("converges");
    let gradient = problem.analysis.gradient(&forward).expect("differentiable");
    let norm = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
    for element in [3, 10, 37, 50] {
        let expected = difference(1e-3, |shift| {
            let mut moved = density.clone();
            moved[element] += shift;
            problem.analysis.forward(&moved, &mut Silent).expect("converges").value
        });
        let error = (gradient[element] - expected).abs() / norm;
        assert!(error < 1e-8, "element {element}: {:e} instead of {expected:e}", gradient[element]);
    }
}

#[test]
fn derivatives_by_numbers_of_the_model_match_finite_differences() {
    let value = |numbers: Numbers| {
        let mut problem = build(&sensitivities::case(numbers).expect("right")).expect("builds");
        tighten(&mut problem.analysis);
        let density = problem.initial_density().clone();
        problem.analysis.forward(&density, &mut Watch::default()).expect("converges").value
    };
    let mut problem = build(&sensitivities::case(NUMBERS).expect("right")).expect("builds");
    tighten(&mut problem.analysis);
    let density = problem.initial_density().clone();
    let forward = problem.analysis.forward(&density, &mut Silent).expect("converges");
    let gradients = problem.analysis.gradients(&forward).expect("differentiable");
    let found = |wanted: Parameter| gradients.parameters.iter().find(|(p, _)| *p == wanted).expect("there").1;
    let h = 1e-4;
    let Numbers { friction, modulus, amplitude } = NUMBERS;
    let cases = [
        (
            Parameter::Friction { interface: 0 },
            difference(h * friction, |x| value(Numbers { friction: friction + x, ..NUMBERS })),
        ),
        (
            Parameter::YoungsModulus { body: 1 },
            difference(h * modulus, |x| value(Numbers { modulus: modulus + x, ..NUMBERS })),
        ),
        (Parameter::Amplitude { motion: 1 }, difference(h, |x| value(Numbers { amplitude: amplitude + x, ..NUMBERS }))),
    ];
    for (parameter, expected) in cases {
        let found = found(parameter);
        assert!((found - expected).abs() < 1e-7 * expected.abs(), "{parameter:?}: {found:e} instead of {expected:e}");
    }
}

/// Σ u² over all nodes, with a derivative that is wrong by a factor.
struct Wrong {
    factor: f64,
}

impl Quantity for Wrong {
    fn name(&self) -> &str {
        "wrong"
    }

    fn dimension(&self) -> Dimension {
        Dimension::AREA
    }

    fn value(&self, state: &StateView) -> f64 {
        state.displacement.iter().map(|u| u * u).sum()
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        for (to, u) in to.displacement.iter_mut().zip(state.displacement) {
            *to += weight * 2.0 * self.factor * u;
        }
    }
}

/// A wrong derivative, and an objective without steps, are rejected with a remedy; debug builds
/// check automatically.
#[test]
fn wrong_objectives_are_refused() {
    let mut problem = own_objective::problem().expect("builds");
    let analysis = &mut problem.analysis;
    let wrong = |factor, step| Response::of(Arc::new(Wrong { factor }), ObservedSteps::Only(vec![step]), 1.0);
    let found = analysis.check_quantity(&Wrong { factor: 0.5 }).expect_err("wrong").to_string();
    assert!(found.contains("quantity `wrong` at step 1: its derivative with respect to the displacements"), "{found}");
    let refused = analysis.set_objective(wrong(0.5, 2));
    assert_eq!(refused.is_err(), cfg!(debug_assertions));
    let refused = analysis.set_objective(wrong(1.0, 5));
    assert!(matches!(refused, Err(ResponseRefused::NoSteps { steps: 4, .. })), "{refused:?}");
    // those of the library pass, by the slave nodes' forces
    let nodes = analysis.model().slave_nodes();
    let contact = ContactForce::new(nodes, problem.mesh.nodes.len(), 0.0).expect("right");
    analysis.check_quantity(&contact).expect("right");
}
