//! Contact that jumps, and cycles of multipliers, are followed.

use super::newton::*;
use crate::common::scene::*;
use crate::common::*;
use slipstick::analysis::Forward;
use slipstick::design::ElementValues;
use slipstick::verify::{Verdict, VerifyOptions, verify_gradient};
use slipstick_path::Silent;

/// The cube of [`a_contact_that_jumps_is_followed`], with so many elements, load steps and this
/// friction.
fn dragged(elements: [usize; 3], steps: usize, friction: f64, enforcement: &str) -> String {
    format!(
        "[[body]]\nname = \"cube\"\nbox = {{ min = [-2.5, 0, -0.5], max = [-1.5, 1, 0.5], elements = {elements:?} }}\n\
         material = {{ neo_hooke = {{ youngs_modulus = 1, poisson_ratio = 0 }} }}\n\
         [[body]]\nname = \"plate\"\nbox = {{ min = [-3, -0.1, -1], max = [3, 0, 1], elements = [1, 1, 1] }}\n\
         material = {{ neo_hooke = {{ youngs_modulus = 1, poisson_ratio = 0 }} }}\n\
         [[contact]]\nslave = \"cube_ymin\"\nmaster = \"plate_ymax\"\nfriction = {friction:?}\n\
         enforcement = {enforcement}\n\
         [[dirichlet]]\nset = \"cube_ymax\"\n\
         motion = [{{ t = 0.2, u = [0, -0.4, 0] }}, {{ t = 1, u = [3, -0.4, 0] }}]\n\
         [[dirichlet]]\nset = \"plate_ymax\"\n[[dirichlet]]\nset = \"plate_ymin\"\n\
         [load_path]\nsteps = {steps}\n[design]\nbodies = [\"cube\"]\ninitial = 0.9\n\
         simp = {{ p = 3, min = 1e-3 }}\n[objective]\ncontact_force = {{ steps = \"all\" }}\n"
    )
}

/// A cube is pressed by 40 % of its height and dragged over a plate. At t = 0.315 the row of nodes
/// behind its leading edge loses contact: the equilibrium ends at a limit point, and the cube jumps
/// to another one, in which it continues to slide. Newton's method no longer finds a solution
/// nearby and alternates between stick, slip and open, however small the increment. Expected: the
/// state found with the augmented Lagrangian, which has the same equations and a different
/// iteration.
#[test]
fn a_contact_that_jumps_is_followed() {
    let run = |enforcement: &str| {
        let mut problem = problem(&dragged([5, 5, 5], 50, 0.2, enforcement));
        problem.analysis.times.truncate(18);
        let density = vec![1.0; problem.initial_density().len()].into();
        let mut watch = Watch::default();
        let run = problem.analysis.forward(&density, &mut watch).expect("the jump is followed");
        (run, watch, problem)
    };
    let (lagrange, watch, mut problem) = run(LAGRANGE);
    let (augmented, ..) = run("{ augmented = {} }");
    let rescued: Vec<f64> =
        lagrange.path.states.iter().filter(|state| state.report.rescued).map(|state| state.time.t).collect();
    assert_eq!(rescued, [0.32], "two halvings before it is tried");
    assert!(watch.cut_backs.len() <= 2, "{:?}", watch.cut_backs);
    // failed iterations are counted at the next state of the path: some attempts of 25 iterations
    // each
    let failed: Vec<usize> = lagrange.path.states.iter().map(|state| state.report.failed_iterations).collect();
    assert!(failed.iter().sum::<usize>() >= 25 && failed[..16].iter().all(|count| *count == 0), "{failed:?}");
    assert!(lagrange.path.newton_iterations() < 100, "{} Newton iterations", lagrange.path.newton_iterations());
    let forces = |run: &Forward| run.step_values.iter().filter(|value| **value != 0.0).copied().collect::<Vec<_>>();
    assert_eq!(augmented.path.steps, 18);
    let (lagrange_end, augmented_end) = (*forces(&lagrange).last().unwrap(), *forces(&augmented).last().unwrap());
    assert!((lagrange_end - augmented_end).abs() < 1e-7 * augmented_end.abs(), "{lagrange_end}, {augmented_end}");
    // The gradient is that of the states found: central differences of order 4 take the same jump.
    let density = ElementValues::from(vec![0.9; problem.initial_density().len()]);
    let designed = designed(&problem);
    let direction = Random::new(5).vector(designed.len(), 1.0);
    let base = problem.analysis.forward(&density, &mut Silent).expect("converges");
    let gradient = problem.analysis.gradient(&base).expect("a gradient");
    let adjoint: f64 = designed.iter().zip(&direction).map(|(&e, d)| gradient[e] * d).sum();
    let mut at = |h: f64| {
        let mut moved = density.clone();
        designed.iter().zip(&direction).for_each(|(&e, d)| moved[e] += h * d);
        let run = problem.analysis.forward(&moved, &mut Silent).expect("converges");
        assert!(run.path.states.iter().any(|state| state.report.rescued));
        run.value
    };
    let h = 5e-4;
    let difference = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
    let error = (adjoint - difference).abs() / difference.abs();
    println!("adjoint {adjoint:.10e}, differences {difference:.10e}, relative error {error:.1e}");
    assert!(error < 1e-7);
}

/// The dragged cube with other meshes, load steps and friction: how many paths reach their end, and
/// at what cost.
#[test]
#[ignore = "writes tables of docs/measurements/robustness.md: docs/measure/robustness/measure.sh hard"]
fn table_of_jumps() {
    let mut table = String::from(
        "| elements of the cube | enforcement | completed paths, of 9 | of these, with held multipliers | Newton iterations of completed \
         paths | in failed attempts |\n|---|---|---|---|---|---|\n",
    );
    for elements in [[5, 5, 5], [6, 5, 4], [10, 8, 4], [7, 6, 4], [4, 4, 3]] {
        for (name, enforcement) in [("Lagrange", LAGRANGE), ("augmented", "{ augmented = {} }")] {
            let (mut ended, mut rescued, mut newton, mut failed) = (0, 0, 0, 0);
            for steps in [41, 50, 70] {
                for friction in [0.15, 0.2, 0.3] {
                    let mut problem = problem(&dragged(elements, steps, friction, enforcement));
                    let density = ElementValues::from(vec![0.9; problem.initial_density().len()]);
                    let Ok(run) = problem.analysis.forward(&density, &mut Silent) else { continue };
                    ended += 1;
                    rescued += usize::from(run.path.states.iter().any(|state| state.report.rescued));
                    newton += run.path.newton_iterations();
                    failed += run.path.failed_iterations();
                }
            }
            let [x, y, z] = elements;
            table += &format!("| {x} × {y} × {z} | {name} | {ended} | {rescued} | {newton} | {failed} |\n");
        }
    }
    crate::table::publish("jumps", &table);
}

/// A half-ball is pressed into a plate and then slid over it; sliding begins in step 6. The
/// solution does not depend on c.
#[test]
#[ignore = "writes tables of docs/measurements/robustness.md: docs/measure/robustness/measure.sh hard"]
fn table_of_the_onset_of_sliding() {
    let text = |c: &str| {
        format!(
            "[[body]]\nname = \"ball\"\nhalf_ball = {{ radius = 1.5, elements = [12, 6, 5] }}\n\
             place = {{ translate = [-1.5, 1.5, -0.75] }}\n\
             material = {{ neo_hooke = {{ youngs_modulus = 1000, poisson_ratio = 0.3 }} }}\n\
             [[body]]\nname = \"plate\"\n\
             box = {{ min = [-4.5, -3, -4.5], max = [4.5, 0, 4.5], elements = [27, 9, 27] }}\n\
             material = {{ neo_hooke = {{ youngs_modulus = 1000, poisson_ratio = 0.3 }} }}\n\
             [[contact]]\nslave = \"ball_dome\"\nmaster = \"plate_ymax\"\nfriction = 0.3\n\
             enforcement = {{ lagrange = {{ {c} }} }}\n[[dirichlet]]\nset = \"plate_ymin\"\n\
             [[dirichlet]]\nset = \"ball_flat\"\n\
             motion = [{{ t = 0.5, u = [0, -0.5, 0] }}, {{ t = 1, u = [1.5, -0.5, 0.75] }}]\n[load_path]\nsteps = 10\n"
        )
    };
    let mut table = String::from("| c | Newton iterations by step | sum | in failed attempts |\n|---|---|---|---|\n");
    for (name, c) in [
        ("default, f = 2", ""),
        ("f = 5", "complementarity_parameter = 5"),
        ("f = 1", "complementarity_parameter = 1"),
        ("c_n = c_t = 4000 N/cm³", "stiffness = 4000"),
        ("c_n = c_t = 10000 N/cm³", "stiffness = 10000"),
    ] {
        let mut problem = problem(&text(c));
        let density = vec![1.0; problem.initial_density().len()].into();
        let path = problem.analysis.forward(&density, &mut Silent).expect("converges").path;
        let steps: Vec<String> = (1..=10)
            .map(|step| {
                let of = |time: f64| (10.0 * time - 1e-9).ceil() as usize == step;
                let states = path.states.iter().filter(|state| !state.rest && of(state.time.t));
                states.map(|state| state.report.iterations.len()).sum::<usize>().to_string()
            })
            .collect();
        let (sum, failed) = (path.newton_iterations(), path.failed_iterations());
        table += &format!("| {name} | {} | {sum} | {failed} |\n", steps.join(" "));
    }
    crate::table::publish("onset", &table);
}

/// Hubs that only their interference fit holds: nodes change between stick, slip and opening in every
/// iteration with Lagrange multipliers. Which rung ends the cycle depends on round-off, so there are three
/// fits, and at least one needs a growing penalty. It leads to the solutions that 256 instead of 8 steps find,
/// two of them without it: the normal forces. The gradient agrees with central differences of paths that took
/// the same rung.
#[test]
fn a_growing_penalty_ends_a_cycle_of_the_multipliers() {
    let text = |radius: f64, interference: f64| {
        let material = |modulus: f64, ratio: f64| {
            format!("material = {{ neo_hooke = {{ youngs_modulus = {modulus:?}, poisson_ratio = {ratio:?} }} }}")
        };
        format!(
            r#"
[[body]]
name = "shaft"
hollow_cylinder = {{ inner_radius = 0.4, outer_radius = 1.0, height = 1.0, elements = [2, 16, 3] }}
{}
[[body]]
name = "hub"
hollow_cylinder = {{ inner_radius = 1.0, outer_radius = {radius:?}, height = 0.7, elements = [2, 16, 2] }}
{}
place = {{ translate = [0.0, 0.1, 0.0] }}
[[contact]]
slave = "hub_inner"
master = "shaft_outer"
friction = 0.1
offset = [{{ t = 0.5, offset = {interference:?} }}]
[[dirichlet]]
set = "shaft_bottom"
[load_path]
steps = 8
[design]
bodies = ["hub"]
initial = 1.0
[objective]
minimise = {{ quantity = "stored", steps = "last" }}
[[quantity]]
name = "stored"
strain_energy = {{ body = "hub" }}
"#,
            material(1e4, 0.087),
            material(2e4, 0.05)
        )
    };
    let mut is_needed = false;
    for (radius, interference, normal_force) in
        [(1.6845741410288944, 0.009, 245.683118), (1.6845741410288944, 0.00744, 203.158821), (1.75, 0.007, 198.937983)]
    {
        let mut problem = problem(&text(radius, interference));
        let density = problem.initial_density().clone();
        let forward = problem.analysis.forward(&density, &mut Silent).expect("it converges");
        let found = slipstick::quantities::quantities(&problem, &forward.path);
        let force = *found.get("hub_inner_normal_force").expect("a pair").last().expect("a step");
        assert!(forward.path.failed_iterations() < 100, "{}", forward.path.failed_iterations());
        assert!((force / normal_force - 1.0).abs() < 1e-7, "{force}");
        is_needed |= forward.path.states[1].report.rescued;
    }
    assert!(is_needed, "no fit needs the rung");
    let mut problem = problem(&text(1.75, 0.007));
    let density = problem.initial_density().clone();
    let options = VerifyOptions {
        directions: 1,
        elements: 0,
        step: 1e-3,
        halvings: 2,
        forward_tolerance: 1e-11,
        tolerance: 1e-6,
    };
    let designed: Vec<u32> = problem.mesh.bodies[1].elements.clone().map(|e| e as u32).collect();
    let check = verify_gradient(&mut problem.analysis, &density, &designed, &options, &mut Silent).expect("it runs");
    assert_eq!(check.count(Verdict::Right), 1, "{check:#?}");
}
