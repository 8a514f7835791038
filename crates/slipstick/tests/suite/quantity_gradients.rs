//! The derivatives of every quantity, through the whole path, compared with central differences of
//! order 4: for every enforcement method and multiplier shape, hexahedra and tetrahedra, symmetry
//! planes, several load cases, interpolated energies, and with respect to densities and parameters.
//! All responses of a problem are swept together.

use crate::common::quantities::every_quantity;
use crate::common::scene::{LAGRANGE, Scene, augmented, penalty};
use crate::common::{Random, designed, forward, norm, problem, problem_with, random_density, status_path};
use slipstick::build::Problem;
use slipstick::design::VectorMeasure;
use slipstick::design::quantity::{PlasticStrain, Reaction};
use slipstick::design::{Bound, Constraint, Curve, ElementValues, ObservedSteps, Reduction, Response, Term};
use slipstick::model::Parameter;
use slipstick::quantities::SpringForce;
use slipstick_mesh::{BoxShape, box_mesh};
use slipstick_path::Silent;
use std::sync::Arc;

/// The largest error, relative to the norm of the gradient. Most are below 1e-9.
const BOUND: f64 = 1e-6;

/// Every quantity, at different steps; then a maximum, a curve and a mixed sum.
pub(crate) fn responses(problem: &Problem, cases: &[f64]) -> Vec<Response> {
    let all = every_quantity(problem);
    let steps = [ObservedSteps::Last, ObservedSteps::All, ObservedSteps::Only(vec![2, 4])];
    let mut responses: Vec<Response> = all
        .iter()
        .enumerate()
        .map(|(i, quantity)| Response::of(quantity.clone(), steps[i % 3].clone(), 0.5 + i as f64))
        .collect();
    if problem.analysis.model().has_memory() {
        let elements = (0..problem.mesh.elements.len() as u32).collect();
        let strain = PlasticStrain::new("plastic strain", elements, 6.0).expect("right");
        responses.push(Response::of(Arc::new(strain), ObservedSteps::Last, 1.0));
    }
    let springs = problem.analysis.model().springs();
    for name in springs.names() {
        let force = SpringForce::new(format!("force of `{name}`"), springs.of(name).to_vec(), VectorMeasure::Norm);
        responses.push(Response::of(Arc::new(force), ObservedSteps::All, 1.0));
    }
    for bolt in problem.analysis.model().bolts().list() {
        let along = VectorMeasure::Along([1.0, 0.0, 0.0]);
        let force = Reaction::new(format!("force of `{}`", bolt.name), vec![bolt.unknown], along).expect("one unknown");
        responses.push(Response::of(Arc::new(force), ObservedSteps::All, 1.0));
    }
    let temporary = problem.analysis.model().prescribed().temporary();
    if !temporary.is_empty() {
        let unknowns = temporary.iter().map(|support| support.unknown).collect();
        let force = Reaction::new("force of temporary supports", unknowns, VectorMeasure::Norm).expect("unknowns");
        responses.push(Response::of(Arc::new(force), ObservedSteps::All, 1.0));
    }
    let term = |i: usize, weight| Term { quantity: all[i].clone(), steps: ObservedSteps::All, weight };
    responses.push(Response::new("largest", vec![term(1, 1.0), term(7, 0.7)], Reduction::Largest));
    responses.push(Response::new("sum", vec![term(17, 1.0), term(all.len() - 1, -2.0), term(3, 0.1)], Reduction::Sum));
    // the work of one load step: increments before it have no weight
    for (name, quantity) in [("work of a step", 18), ("friction of a step", 17)] {
        let work =
            |step, weight| Term { quantity: all[quantity].clone(), steps: ObservedSteps::Only(vec![step]), weight };
        responses.push(Response::new(name, vec![work(3, 1.0), work(2, -1.0)], Reduction::Sum));
    }
    let mut responses: Vec<Response> =
        responses.into_iter().map(|response| response.in_load_cases(cases.to_vec())).collect();
    if cases.len() == 1 {
        let curve = Curve::new(vec![(0.33, 1.0), (0.8, 10.0), (1.0, 3.0)]).expect("a curve");
        responses.push(Response::new("distance", vec![term(2, 1.0)], Reduction::Distance(curve)));
    }
    responses
}

pub(crate) fn set(problem: &mut Problem, responses: Vec<Response>) {
    let constraint = |response| Constraint { response, bound: Bound::AtMost(1.0), corrected: true };
    problem.analysis.objective = None;
    problem.analysis.set_constraints(responses.into_iter().map(constraint).collect()).expect("right derivatives");
}

/// Largest error of every response along random directions in the design.
pub(crate) fn check(name: &str, problem: &mut Problem, seed: u64, cases: &[f64]) -> Vec<(String, f64)> {
    let density = random_density(problem, seed);
    set(problem, responses(problem, cases));
    let base = forward(problem, &density);
    let statuses = status_path(problem, &base);
    let gradients = problem.analysis.response_gradients(&base, false).expect("differentiable");
    let elements = designed(problem);
    let mut random = Random::new(seed + 100);
    let mut worst = vec![0.0_f64; gradients.len()];
    for _ in 0..2 {
        let direction = random.vector(elements.len(), 1.0);
        let mut best = vec![f64::INFINITY; gradients.len()];
        for h in [2e-3, 5e-4, 1e-4] {
            let mut same = true;
            let mut at = |shift: f64| {
                let mut moved: ElementValues = density.clone();
                elements.iter().zip(&direction).for_each(|(&e, v)| moved[e] += shift * v);
                let run = forward(problem, &moved);
                same &= status_path(problem, &run) == statuses;
                run.constraints
            };
            let (p1, m1, p2, m2) = (at(h), at(-h), at(2.0 * h), at(-2.0 * h));
            if !same {
                println!("statuses change at h = {h:e}");
                continue;
            }
            for (r, gradient) in gradients.iter().enumerate() {
                let difference = (8.0 * (p1[r] - m1[r]) - (p2[r] - m2[r])) / (12.0 * h);
                let along: f64 = elements.iter().zip(&direction).map(|(&e, v)| gradient.density[e] * v).sum();
                // lengths of the scene are about 1, and closed gaps are 0 up to round-off
                let round_off = 1e-13 * base.constraints[r].abs().max(1.0) / h;
                let error = (along - difference).abs();
                let size = norm(&gradient.density) * norm(&direction);
                let known = if error <= round_off && size <= 1e3 * round_off { 0.0 } else { error / size };
                best[r] = best[r].min(known);
            }
        }
        worst.iter_mut().zip(best).for_each(|(worst, best)| *worst = worst.max(best));
    }
    let names = problem.analysis.constraints.iter().map(|constraint| constraint.response.name().to_owned());
    let errors: Vec<(String, f64)> = names.zip(worst).collect();
    for (quantity, error) in &errors {
        println!("{name}: {quantity}: {error:.1e}");
        assert!(*error < BOUND, "{name}: {quantity} is off by {error:e}; statuses {statuses:?}");
    }
    let rows: Vec<String> = errors.iter().map(|(quantity, error)| format!("| {quantity} | {error:.1e} |")).collect();
    crate::table::publish(&format!("quantity_{}", name.replace(' ', "_")), &(rows.join("\n") + "\n"));
    errors
}

fn scene() -> Scene {
    Scene {
        slab: [3, 1, 1],
        block: [1, 1, 1],
        friction: 0.35,
        motion: "[{ t = 0.4, u = [0, -0.1, 0] }, { t = 1.0, u = [0.1, -0.12, 0.03], angle = 3 }]".into(),
        drive: "rotation = { point = [1.0, 1.8, 0.5], direction = [0.2, 0, 1] }".into(),
        steps: 5,
        more: "[[load]]\nsurface = 'slab_xmax'\ntraction = [5.0, 4.0, -2.0]\n".into(),
        ..Scene::default()
    }
}

fn methods() -> [(&'static str, String); 3] {
    [("Lagrange", LAGRANGE.into()), ("penalty", penalty(2e4)), ("augmented", augmented(1e4, 1e-11))]
}

/// All methods and shapes.
#[test]
fn quantities_match_finite_differences() {
    for (method, enforcement) in methods() {
        for shape in ["standard", "dual"] {
            let scene = Scene { enforcement: enforcement.clone(), shape, ..scene() };
            check(&format!("{method} {shape}"), &mut problem(&scene.text()), 3, &[1.0]);
        }
    }
}

/// Interpolated energies, with densities at which the interpolation changes.
#[test]
fn with_interpolated_energies() {
    let design = "energy_interpolation = { threshold = 0.2, sharpness = 3 }".into();
    check("interpolated", &mut problem(&Scene { design, ..scene() }.text()), 5, &[1.0]);
}

/// A slab in which every second hexahedron is divided into tetrahedra, under a block of tetrahedra.
#[test]
fn with_tetrahedra() {
    let divided = |name: &str, min: [f64; 3], max: [f64; 3], elements: [usize; 3], every: usize| {
        let shape = BoxShape { min, max, elements, grading: [1.0; 3] };
        box_mesh(name, &shape).expect("a mesh").divided(|element| element % every == 0)
    };
    let slab = divided("slab", [0.0; 3], [4.0, 1.0, 1.0], [3, 1, 1], 2);
    let block = divided("block", [0.6, 1.0, 0.1], [1.4, 1.8, 0.9], [1; 3], 1);
    let mut text = scene().text();
    for name in ["slab", "block"] {
        let start = text.find("box = ").expect("a box");
        let end = start + text[start..].find('\n').expect("a line");
        text.replace_range(start..end, &format!("mesh = {{ file = '{name}' }}"));
    }
    let mut problem = problem_with(&text, &[("slab", slab), ("block", block)]);
    check("tetrahedra", &mut problem, 4, &[1.0]);
}

/// Two load cases, the second of which begins at rest.
#[test]
fn over_load_cases() {
    let drive = "load_case = 'press'".to_owned();
    let more = "[[load]]\nsurface = 'slab_xmax'\ntraction = [5.0, 4.0, -2.0]\nload_case = 'pull'\n\
                [[load_case]]\nname = 'pull'\nweight = 1.5\n[[load_case]]\nname = 'press'\nweight = 0.5\n";
    let more = format!(
        "{more}[[dirichlet]]\nset = 'block_ymax'\nload_case = 'pull'\nmotion = [{{ t = 1.0, u = [0, -0.08, 0.02] }}]\n"
    );
    let motion = "[{ t = 0.4, u = [0, -0.1, 0] }, { t = 1.0, u = [0.1, -0.12, 0.03] }]".to_owned();
    check("load cases", &mut problem(&Scene { motion, drive, more, ..scene() }.text()), 6, &[1.5, 0.5]);
}

/// A half of a scene, cut by a symmetry plane.
#[test]
fn with_a_symmetry_plane() {
    let scene = Scene {
        corner: [0.6, 1.0, 0.0],
        motion: "[{ t = 0.4, u = [0, -0.1, 0] }, { t = 1.0, u = [0.1, -0.12, 0] }]".into(),
        drive: "components = ['x', 'y']".into(),
        more: "[[symmetry]]\nnormal = 'z'\n".into(),
        ..scene()
    };
    check("symmetry", &mut problem(&scene.text()), 8, &[1.0]);
}

/// Derivatives with respect to friction, moduli, motions, also of a support that begins within the path, and loads,
/// for every quantity and method.
#[test]
fn derivatives_by_parameters_match_differences() {
    let text = |enforcement: &str, [friction, modulus, motion, side, load]: [f64; 5]| {
        let scene = Scene {
            enforcement: enforcement.into(),
            friction: 0.35 * friction,
            motion: format!(
                "[{{ t = 0.4, u = [0, {}, 0] }}, {{ t = 1.0, u = [{}, {}, {}] }}]",
                -0.1 * motion,
                0.1 * motion,
                -0.12 * motion,
                0.03 * motion
            ),
            drive: String::new(),
            more: format!(
                "[[load]]\nsurface = 'slab_xmax'\ntraction = [{}, {}, {}]\n\
                 [[set]]\nname = 'front'\nwithin = 'slab_zmax'\nboxes = [{{ min = [0, 0.5, 0], max = [9, 1, 9] }}]\n\
                 [[dirichlet]]\nset = 'front'\ncomponents = ['z']\nfrom = 0.2\nuntil = 0.8\n\
                 motion = [{{ t = 0.6, u = [0, 0, {}] }}, {{ t = 0.8, u = [0, 0, {}] }}]\n",
                5.0 * load,
                4.0 * load,
                -2.0 * load,
                0.02 * side,
                0.03 * side
            ),
            ..scene()
        };
        // the first material is the slab's
        scene.text().replacen("youngs_modulus = 1000.0", &format!("youngs_modulus = {:?}", 1000.0 * modulus), 1)
    };
    let parameters = [
        Parameter::Friction { interface: 0 },
        Parameter::YoungsModulus { body: 0 },
        Parameter::Amplitude { motion: 1 },
        Parameter::Amplitude { motion: 2 },
        Parameter::Load { load: 0 },
    ];
    let units = [0.35, 1000.0, 1.0, 1.0, 1.0];
    for (method, enforcement) in methods() {
        let prepared = |factors: [f64; 5]| {
            let mut problem = problem(&text(&enforcement, factors));
            let all = responses(&problem, &[1.0]);
            set(&mut problem, all);
            let density = random_density(&problem, 2);
            let forward = forward(&mut problem, &density);
            (problem, forward)
        };
        let (mut problem, base) = prepared([1.0; 5]);
        let statuses = status_path(&mut problem, &base);
        let gradients = problem.analysis.response_gradients(&base, true).expect("differentiable");
        for (i, (parameter, unit)) in parameters.iter().zip(units).enumerate() {
            // with half of it, round-off is 3e-6 of the smallest derivative
            let h = 1e-3;
            let at = |shift: f64| {
                let mut factors = [1.0; 5];
                factors[i] += shift;
                let (mut problem, forward) = prepared(factors);
                assert_eq!(status_path(&mut problem, &forward), statuses, "{parameter:?}");
                forward.constraints
            };
            let (p1, m1, p2, m2) = (at(h), at(-h), at(2.0 * h), at(-2.0 * h));
            for (r, of) in gradients.iter().enumerate() {
                let name = problem.analysis.constraints[r].response.name();
                let difference = (8.0 * (p1[r] - m1[r]) - (p2[r] - m2[r])) / (12.0 * h);
                let found = unit * of.parameters.iter().find(|(known, _)| known == parameter).expect("there").1;
                // derivatives that vanish have the round-off of the values
                let scale = difference.abs().max(1e-4 * base.constraints[r].abs());
                let error = (found - difference).abs() / scale.max(f64::MIN_POSITIVE);
                println!("{method}: {name} by {parameter:?}: {found:.6e}, off by {error:.1e}");
                assert!(error < 1e-6, "{method}: {name} by {parameter:?}: {found:e} instead of {difference:e}");
            }
        }
    }
}

/// Swept alone, a response has the derivatives that it has among others, up to the tolerance of the
/// linear solves.
#[test]
fn responses_do_not_affect_each_other() {
    /// Relative residual of the linear solves.
    const SOLVES: f64 = 1e-10;
    let mut problem = problem(&scene().text());
    let density = random_density(&problem, 3);
    let all = responses(&problem, &[1.0]);
    set(&mut problem, all.clone());
    let base = forward(&mut problem, &density);
    let together = problem.analysis.response_gradients(&base, false).expect("differentiable");
    let displacement = all.iter().position(|response| response.name() == "displacement").expect("there");
    let of_displacement = norm(&together[displacement].density);
    for (r, response) in all.into_iter().enumerate() {
        problem.analysis.constraints.clear();
        problem.analysis.set_objective(response).expect("right");
        let base = problem.analysis.forward(&density, &mut Silent).expect("converges");
        let alone = problem.analysis.gradient(&base).expect("differentiable");
        let apart: Vec<f64> = alone.iter().zip(&*together[r].density).map(|(a, b)| a - b).collect();
        // a closed gap is the difference of displacements; its derivatives cancel to the tolerance of
        // the solves
        let bound = (1e-8 * norm(&alone)).max(SOLVES * of_displacement);
        assert!(norm(&apart) <= bound, "{r}: {:e} of {:e}", norm(&apart), norm(&alone));
    }
}
