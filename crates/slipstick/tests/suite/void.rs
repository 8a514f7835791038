//! Void elements with interpolated energy: the whole gradient, a path that fails without it, and
//! one that does not.

use crate::common::scene::*;
use crate::common::*;
use slipstick::analysis::AnalysisError;
use slipstick::build::Problem;
use slipstick::design::ElementValues;
use slipstick_path::{Silent, StateError, StepFailureKind};

/// A frictional path with densities in the range where γ rises from 0 to 1, below and above it:
/// adjoint compared with central differences of the whole analysis.
#[test]
fn gradient_with_interpolated_energy() {
    for (method, enforcement) in
        [("Lagrange", LAGRANGE.to_string()), ("penalty", penalty(2e3)), ("augmented", augmented(1e3, 1e-11))]
    {
        let scene = Scene {
            enforcement,
            design: "energy_interpolation = {}".into(),
            motion: "[{ t = 0.5, u = [0, -0.1, 0] }, { t = 1.0, u = [0.2, -0.1, 0.05] }]".into(),
            ..Scene::default()
        };
        let mut problem = problem(&scene.text());
        let density = [0.21, 0.24, 0.22, 0.6, 0.25].into();
        let shares: Vec<f64> = {
            problem.analysis.set_density(&density);
            problem.analysis.design.scalings().iter().map(|s| s.gamma).collect()
        };
        assert!(shares.iter().filter(|g| (0.2..0.999).contains(*g)).count() >= 4, "{shares:?}");
        let checked = check_gradient(&mut problem, &density);
        println!("{method}: error {:.1e}, {:?}", checked.error, checked.statuses);
        assert!(checked.error < 1e-7, "{method}: {:e}", checked.error);
        assert!(checked.statuses.last().unwrap().contains('l'));
    }
}

/// A block on a bridge over a void of stiffness 1e-9, pressed down by `depth` and simultaneously
/// dragged along it by `side`.
fn bridge(depth: f64, side: f64, energy: &str) -> (Problem, ElementValues) {
    let scene = Scene {
        slab: [12, 6, 1],
        block: [2, 1, 1],
        corner: [1.6, 1.0, 0.1],
        friction: 0.1,
        steps: 5,
        motion: format!("[{{ t = 1.0, u = [{side:?}, -{depth:?}, 0.0] }}]"),
        load_path: "max_cutbacks = 2".into(),
        design: format!("passive_void = [{{ min = [0.4, 0, 0], max = [3.6, 0.8, 1] }}]\n{energy}"),
        ..Scene::default()
    };
    let problem = problem(&scene.text().replace("min = 1e-3", "min = 1e-9"));
    let density: ElementValues = problem.initial_density().iter().map(|&x| if x > 0.0 { 1.0 } else { 0.0 }).collect();
    assert_eq!(density.iter().filter(|&&x| x == 0.0).count(), 50, "10 × 5 elements are void");
    (problem, density)
}

const INTERPOLATED: &str = "energy_interpolation = {}";

/// If the void inverts during the path, only the path with interpolation reaches its end.
#[test]
fn a_void_that_inverts_is_marched_through() {
    let (mut plain, density) = bridge(0.5, 1.0, "");
    let Err(AnalysisError::March(failure)) = plain.analysis.forward(&density, &mut Silent) else {
        panic!("the void does not invert");
    };
    let inverted = failure.attempts.iter().find_map(|(_, kind)| match kind {
        StepFailureKind::State(StateError::InvertedElements { elements }) => Some(elements.clone()),
        _ => None,
    });
    let inverted = inverted.expect("some attempt met inverted elements");
    println!("{failure}: {inverted:?}");
    assert!(inverted.iter().all(|&e| density[e as usize] == 0.0), "{inverted:?}");
    let (mut stabilised, _) = bridge(0.5, 1.0, INTERPOLATED);
    let run = forward(&mut stabilised, &density);
    assert_eq!(run.path.steps, 5);
    let d = &run.path.states.last().unwrap().state.unknowns[..3 * stabilised.mesh.nodes.len()];
    let smallest = stabilised.analysis.model().solid().smallest_determinants(d);
    let of = |kind: f64| smallest.iter().zip(&density).filter(move |(_, x)| **x == kind).map(|(j, _)| *j);
    assert!(of(0.0).any(|j| j < 0.0) && of(1.0).all(|j| j > 0.0), "{smallest:?}");
}

/// If both paths reach their end, the force is that of the bridge: a void with 1e-9 of its
/// stiffness does not contribute.
#[test]
fn interpolation_leaves_the_solid_as_it_is() {
    let value = |energy| {
        let (mut problem, density) = bridge(0.6, 0.0, energy);
        forward(&mut problem, &density).value
    };
    let (plain, interpolated) = (value(""), value(INTERPOLATED));
    println!("{plain} {interpolated}");
    assert!((interpolated / plain - 1.0).abs() < 1e-5, "{plain} {interpolated}");
}

/// A nearly incompressible block with an enclosed hole is pressed down in plane strain. The force without material in
/// the hole is that with 1e-7 of the stiffness there. Void elements with the solid's Poisson's ratio resist like a
/// liquid; with one of their own, they hardly count. `cargo test --release -p slipstick --test suite
/// void::an_enclosed -- --nocapture` prints the deviations.
#[test]
fn an_enclosed_void_can_be_compressed() {
    let force = |design: &str| {
        let text = format!(
            "[[body]]\nname = 'b'\nbox = {{ min = [0, 0, 0], max = [10, 10, 0.5], elements = [20, 20, 1] }}\n\
             element = 'f_bar'\nmaterial = {{ neo_hooke = {{ youngs_modulus = 6.0, poisson_ratio = 0.499 }} }}\n\
             [[dirichlet]]\nset = 'b_ymin'\n[[dirichlet]]\nset = 'b_zmin'\ncomponents = ['z']\n\
             [[dirichlet]]\nset = 'b_zmax'\ncomponents = ['z']\n\
             [[dirichlet]]\nset = 'b_ymax'\nmotion = [{{ t = 1, u = [0, -1, 0] }}]\n\
             [load_path]\nsteps = 4\n\
             [design]\nbodies = ['b']\ninitial = 1.0\nenergy_interpolation = {{}}\n{design}\n\
             passive_void = [{{ min = [2, 2, -1], max = [8, 8, 1] }}]\n\
             [[quantity]]\nname = 'push'\nreaction = {{ set = 'b_ymax', component = [0, -1, 0] }}\n\
             [objective]\nmaximise = {{ quantity = 'push' }}\n"
        );
        let mut problem = problem(&text);
        let density: ElementValues = problem.initial_density().clone();
        forward(&mut problem, &density).value
    };
    let empty = force("simp = { p = 3, min = 1e-7 }\nvoid_poisson_ratio = 0.0");
    let [liquid, own] = ["", "void_poisson_ratio = 0.3"].map(|design| force(design) / empty - 1.0);
    println!("deviation of the force: {:.2} % and {:.2} %", 100.0 * liquid, 100.0 * own);
    assert!(liquid > 0.01 && own.abs() < 0.002, "{liquid} {own}");
}
