//! Derivatives with respect to friction, moduli and amplitudes of motion, compared with central
//! differences (order 4) of whole forward analyses, each of a problem built from modified text.

use crate::common::scene::*;
use crate::common::*;
use slipstick::model::Parameter;
use slipstick_path::Silent;

/// Relative error.
const BOUND: f64 = 1e-7;

/// Factors on the parameters of the derivatives.
#[derive(Clone, Copy)]
struct Factors {
    friction: f64,
    modulus: [f64; 2],
    amplitude: f64,
}

const ONE: Factors = Factors { friction: 1.0, modulus: [1.0, 1.0], amplitude: 1.0 };

fn text(base: &Scene, factors: Factors) -> String {
    let a = factors.amplitude;
    let (press, slide) = ([0.0, -0.1 * a, 0.0], [0.15 * a, -0.12 * a, 0.04 * a]);
    let scene = Scene {
        friction: 0.5 * factors.friction,
        motion: format!("[{{ t = 0.4, u = {press:?} }}, {{ t = 1.0, u = {slide:?}, angle = {:?} }}]", 6.0 * a),
        drive: "rotation = { point = [1.0, 0, 0.5], direction = [0, 1, 0] }".into(),
        observed: "\"all\"",
        ..base.clone()
    };
    let text = scene.text();
    let pieces: Vec<&str> = text.split("youngs_modulus = 1000.0").collect();
    assert_eq!(pieces.len(), 3);
    let [slab, block] = factors.modulus.map(|factor| 1000.0 * factor);
    format!("{}youngs_modulus = {slab:?}{}youngs_modulus = {block:?}{}", pieces[0], pieces[1], pieces[2])
}

fn objective(base: &Scene, factors: Factors, seed: u64) -> f64 {
    let mut problem = problem(&text(base, factors));
    let density = random_density(&problem, seed);
    problem.analysis.forward(&density, &mut Silent).expect("converges").value
}

/// Relative derivatives p dθ/dp by differences, in the order of the parameters.
fn differences(base: &Scene, seed: u64) -> Vec<f64> {
    let vary: [fn(&mut Factors) -> &mut f64; 4] =
        [|f| &mut f.friction, |f| &mut f.modulus[0], |f| &mut f.modulus[1], |f| &mut f.amplitude];
    let h = 1e-5;
    let along = |vary: fn(&mut Factors) -> &mut f64| {
        let at = |steps: f64| {
            let mut factors = ONE;
            *vary(&mut factors) += steps * h;
            objective(base, factors, seed)
        };
        (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * h)
    };
    vary.map(along).to_vec()
}

fn check(name: &str, base: &Scene, seed: u64) {
    let mut problem = problem(&text(base, ONE));
    let density = random_density(&problem, seed);
    let forward = problem.analysis.forward(&density, &mut Silent).expect("converges");
    let gradients = problem.analysis.gradients(&forward).expect("differentiable");
    let found: Vec<(Parameter, f64)> = gradients
        .parameters
        .iter()
        .map(|&(parameter, derivative)| match parameter {
            Parameter::Friction { .. } => (parameter, 0.5 * derivative),
            Parameter::YoungsModulus { .. } => (parameter, 1000.0 * derivative),
            _ => (parameter, derivative),
        })
        .collect();
    let names: Vec<Parameter> = found.iter().map(|(parameter, _)| *parameter).collect();
    assert_eq!(
        names,
        [
            Parameter::Friction { interface: 0 },
            Parameter::YoungsModulus { body: 0 },
            Parameter::YoungsModulus { body: 1 },
            Parameter::Amplitude { motion: 0 },
            Parameter::Amplitude { motion: 1 },
        ]
    );
    assert_eq!(found[3].1, 0.0, "{name}: the first motion holds the slab, however large its amplitude");
    let found = [found[0].1, found[1].1, found[2].1, found[4].1];
    let expected = differences(base, seed);
    println!("{name}: {found:?}");
    for (k, (found, expected)) in found.iter().zip(&expected).enumerate() {
        let error = (found - expected).abs() / expected.abs();
        assert!(expected.abs() > 1e-3 * forward.value.abs(), "{name}: parameter {k} does not matter: {expected:e}");
        assert!(error < BOUND, "{name}: parameter {k}: {found:e} instead of {expected:e}");
    }
}

#[test]
fn derivatives_by_parameters_match_finite_differences() {
    let methods = [("Lagrange", LAGRANGE.to_string()), ("penalty", penalty(2e4)), ("augmented", augmented(1e4, 1e-11))];
    for (method, enforcement) in methods {
        for shape in ["standard", "dual"] {
            let scene = Scene { enforcement: enforcement.clone(), shape, ..Scene::default() };
            check(&format!("{method} {shape}"), &scene, 7);
        }
    }
}

/// Elements with interpolated energy are also linear in the modulus.
#[test]
fn moduli_of_interpolated_elements_match_finite_differences() {
    let design = "energy_interpolation = { threshold = 0.1, sharpness = 20 }".into();
    check("interpolated", &Scene { design, ..Scene::default() }, 3);
}

/// The contact stiffness of slivers, and that of the penalty method by default, follow the moduli:
/// at the edge of the slab, with equal and with different moduli of the bodies.
#[test]
fn stiffnesses_that_follow_the_moduli_are_differentiated() {
    let methods = [("Lagrange", LAGRANGE.to_string()), ("penalty", "{ penalty = {} }".into())];
    for (method, enforcement) in methods {
        let scene = Scene { enforcement, corner: [-0.55, 1.0, 0.1], block: [2, 1, 2], ..Scene::default() };
        check(&format!("{method} over the edge"), &scene, 7);
    }
}

/// Two pairs, each with its own method, and three bodies.
#[test]
fn derivatives_with_a_method_for_each_pair_match_finite_differences() {
    let (friction, moduli) = ([0.25, 0.18], [1000.0, 700.0, 1500.0]);
    let numbers: Vec<f64> = friction.into_iter().chain(moduli).collect();
    let keys = ["friction", "friction", "youngs_modulus", "youngs_modulus", "youngs_modulus"];
    for (below, above) in [(LAGRANGE.to_string(), penalty(2e4)), ("{ penalty = {} }".into(), augmented(1e4, 1e-11))] {
        // so little friction above that nodes slip there, too
        let text = three_bodies(&below, &above).replace("friction = 0.6", "friction = 0.18");
        let at = |factors: &[f64; 5]| {
            let mut text = text.clone();
            for (k, key) in keys.iter().enumerate() {
                let old = format!("{key} = {:?}", numbers[k]);
                assert_eq!(text.matches(&old).count(), 1);
                text = text.replace(&old, &format!("{key} = {:?}", numbers[k] * factors[k]));
            }
            problem(&text)
        };
        let mut base = at(&[1.0; 5]);
        let density = random_density(&base, 2);
        let forward = base.analysis.forward(&density, &mut Silent).expect("converges");
        let gradients = base.analysis.gradients(&forward).expect("differentiable");
        for k in 0..5 {
            let h = 1e-5;
            let value = |steps: f64| {
                let mut factors = [1.0; 5];
                factors[k] += steps * h;
                at(&factors).analysis.forward(&density, &mut Silent).expect("converges").value
            };
            let expected = (8.0 * (value(1.0) - value(-1.0)) - (value(2.0) - value(-2.0))) / (12.0 * h);
            let found = numbers[k] * gradients.parameters[k].1;
            let error = (found - expected).abs() / expected.abs();
            println!("{below}, {above}: parameter {k}: {found:e}, error {error:.1e}");
            assert!(expected.abs() > 1e-3 * forward.value.abs(), "parameter {k} does not matter: {expected:e}");
            assert!(error < BOUND, "{below}, {above}: parameter {k}: {found:e} instead of {expected:e}");
        }
    }
}

/// A frictionless contact has no derivative with respect to its coefficient of friction, which
/// cannot become negative.
#[test]
fn a_coefficient_of_zero_has_no_derivative() {
    let mut problem = problem(&Scene { friction: 0.0, ..Scene::default() }.text());
    let density = random_density(&problem, 7);
    let forward = problem.analysis.forward(&density, &mut Silent).expect("converges");
    let gradients = problem.analysis.gradients(&forward).expect("differentiable");
    let friction = |p: &Parameter| matches!(p, Parameter::Friction { .. });
    assert!(!gradients.parameters.iter().any(|(parameter, _)| friction(parameter)));
    assert_eq!(gradients.parameters.len(), 4);
}
