//! The paper's example 5.1 compared with an independent implementation (dual numbers, no shared
//! source): θ and dθ/dφ for the three methods at two coefficients of friction, and the whole
//! forward path of the Lagrange method.

use serde_json::Value;
use slipstick::build::{Problem, build};
use slipstick::case::parse_case;
use slipstick_contact::ContactStatus;
use slipstick_path::Silent;

fn case_text(friction: f64, enforcement: &str) -> String {
    format!(
        r#"
[[body]]
name = "cuboid"
box = {{ min = [0, 0, 0], max = [4, 1, 1], elements = [4, 1, 1] }}
material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}
[[body]]
name = "cube"
box = {{ min = [0.6, 1, 0.1], max = [1.4, 1.8, 0.9], elements = [1, 1, 1] }}
material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}
[[contact]]
slave = "cube_ymin"
master = "cuboid_ymax"
friction = {friction}
enforcement = {enforcement}
[[dirichlet]]
set = "cuboid_ymin"
[[dirichlet]]
set = "cube_ymax"
motion = [{{ t = 0.5, u = [0, -0.1, 0] }}, {{ t = 1.0, u = [0.1, -0.1, 0.03] }}]
[load_path]
steps = 10
tolerance = {{ relative = 1e-12 }}
start_values = "last_state"
[design]
bodies = ["cuboid", "cube"]
initial = 0.5
simp = {{ p = 3, min = 0 }}
[objective]
contact_force = {{ steps = "last" }}
"#
    )
}

fn reference() -> Value {
    serde_json::from_str(include_str!("data/cube_on_cuboid.json")).unwrap()
}

fn run(friction: f64, enforcement: &str) -> (Problem, f64, Vec<f64>, slipstick::analysis::Forward) {
    let resolved = parse_case(&case_text(friction, enforcement), "cube.toml").unwrap();
    let mut problem = build(&resolved.case).unwrap();
    let density = problem.initial_density().clone();
    let forward = problem.analysis.forward(&density, &mut Silent).unwrap();
    let gradient = problem.analysis.gradient(&forward).unwrap();
    (problem, forward.value, gradient.into(), forward)
}

fn deviation(found: &[f64], expected: &Value) -> f64 {
    let expected: Vec<f64> = expected.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|x| x * x).sum::<f64>().sqrt();
    norm(&mut found.iter().zip(&expected).map(|(a, b)| a - b)) / norm(&mut expected.iter().copied())
}

fn compare(friction: f64, method: &str, enforcement: &str, theta_bound: f64, gradient_bound: f64) {
    let reference = reference();
    let expected = &reference[format!("mu{friction}")][method];
    let (_, theta, gradient, _) = run(friction, enforcement);
    let theta_error = (theta / expected["theta"].as_f64().unwrap() - 1.0).abs();
    let gradient_error = deviation(&gradient, &expected["gradient"]);
    println!("mu {friction} {method}: theta {theta:.10} error {theta_error:.1e}, gradient error {gradient_error:.1e}");
    assert!(theta_error < theta_bound, "mu {friction} {method}: theta {theta} is off by {theta_error:e}");
    assert!(gradient_error < gradient_bound, "mu {friction} {method}: gradient is off by {gradient_error:e}");
}

#[test]
fn lagrange_matches_the_independent_implementation() {
    for friction in [0.5, 0.2] {
        compare(friction, "LMM", "{ lagrange = {} }", 1e-9, 1e-7);
    }
}

#[test]
fn penalty_matches_the_independent_implementation() {
    for friction in [0.5, 0.2] {
        for epsilon in [100, 200, 500, 1000, 2000] {
            let enforcement = format!("{{ penalty = {{ stiffness = {epsilon}, scaling = \"weighted\" }} }}");
            compare(friction, &format!("PM{epsilon}"), &enforcement, 1e-9, 1e-7);
        }
    }
}

/// The reference stopped Uzawa's iteration at max |t − z|/ε < 1e-6; the same iterations give the
/// same θ, and the adjoint at a state that satisfies the contact conditions only to 1e-6 differs
/// only by the formulation of the saddle point.
#[test]
fn augmented_lagrangian_matches_the_independent_implementation() {
    let enforcement = "{ augmented = { stiffness = 1000, scaling = \"weighted\", tolerance = 1e-6, tolerance_scaling = \"absolute\", max_uzawa = 500, acceleration = 0 } }";
    for friction in [0.5, 0.2] {
        compare(friction, "ALM1000", enforcement, 1e-9, 1e-5);
        // accelerated and tight, the iteration ends at the Lagrange multiplier solution
        let tight = enforcement.replace("acceleration = 0", "acceleration = 8").replace("1e-6", "1e-10");
        compare(friction, "LMM", &tight, 1e-8, 1e-7);
    }
}
/// Every step of the Lagrange path: status, gap, slip and displacement of the four slave nodes. The
/// reference orders them (x−z−), (x+z−), (x+z+), (x−z+).
#[test]
fn lagrange_path_matches_step_by_step() {
    let reference = reference();
    for friction in [0.5, 0.2] {
        let (problem, _, _, forward) = run(friction, "{ lagrange = {} }");
        let steps = reference[format!("mu{friction}")]["LMM"]["steps"].as_array().unwrap();
        let states: Vec<_> = forward.path.states.iter().map(|s| s.state.clone()).collect();
        assert_eq!(states.len(), steps.len() + 1, "no step was cut back");
        for (n, expected) in steps.iter().enumerate() {
            let found = problem.analysis.design.contact_results(&states[n], &states[n + 1], 1.0.into()).unwrap().nodes;
            for (j, offset) in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].iter().enumerate() {
                let at = [0.6 + 0.8 * offset[0], 1.0, 0.1 + 0.8 * offset[1]];
                let node = problem.mesh.nearest_node(at, Some(&problem.mesh.set_nodes("cube_ymin").unwrap())).unwrap();
                let contact = found.iter().find(|c| c.node == node).unwrap();
                let status = match expected["status"][j].as_str().unwrap() {
                    "St" => ContactStatus::Stick,
                    "Sl" => ContactStatus::Slip,
                    _ => ContactStatus::Inactive,
                };
                assert_eq!(contact.status, status, "mu {friction} step {} node {j}", n + 1);
                let number = |key: &str| expected[key][j].as_f64().unwrap();
                assert!((contact.weighted_gap - number("gap")).abs() < 1e-10);
                let slip = contact.weighted_slip[0].hypot(contact.weighted_slip[1]);
                if status == ContactStatus::Slip {
                    assert!((slip - number("slip")).abs() < 1e-10, "{slip} {}", number("slip"));
                }
                for c in 0..3 {
                    let d = states[n + 1].unknowns[3 * node as usize + c];
                    assert!((d - expected["d_slave"][j][c].as_f64().unwrap()).abs() < 1e-10);
                    assert!((contact.global_multiplier[c] - expected["z"][j][c].as_f64().unwrap()).abs() < 1e-7);
                }
            }
        }
    }
}
