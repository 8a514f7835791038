//! Joints: friction with a largest shear stress, offsets, pairs that act during a part of the load
//! path; and viscosity, which like friction depends on the previous state. Gradients are compared
//! with central differences (order 4) of the whole forward analysis; expected forces are computed by
//! hand.

use crate::common::scene::*;
use crate::common::*;
use slipstick::build::Problem;

/// The bound of all comparisons.
const BOUND: f64 = 1e-7;

/// A scene whose pair has further keys.
pub fn joined(scene: &Scene, keys: &str) -> String {
    let text = scene.text();
    let friction = format!("friction = {:?}\n", scene.friction);
    assert!(text.contains(&friction));
    text.replace(&friction, &if keys.contains("tied") { keys.to_owned() } else { format!("{friction}{keys}") })
}

fn methods() -> [(&'static str, String); 3] {
    [("Lagrange", LAGRANGE.into()), ("penalty", penalty(2e4)), ("augmented", augmented(1e4, 1e-11))]
}

pub fn check(name: &str, mut problem: Problem) -> Vec<String> {
    let density = random_density(&problem, 7);
    let check = check_gradient(&mut problem, &density);
    println!("{name}: error {:.1e}, {:?}", check.error, check.statuses);
    assert!(check.error < BOUND, "{name}: the gradient is off by {:e}; statuses {:?}", check.error, check.statuses);
    check.statuses
}

/// Nodes stick, slip on Coulomb's cone, and slip at the largest shear stress, one after the other.
#[test]
fn gradient_with_a_largest_shear_stress() {
    for (method, enforcement) in methods() {
        for shape in ["standard", "dual"] {
            let motion = "[{ t = 0.4, u = [0, -0.1, 0] }, { t = 1.0, u = [0.15, -0.12, 0.04] }]".into();
            let scene = Scene { friction: 0.5, motion, enforcement: enforcement.clone(), shape, ..Scene::default() };
            let limited = check(&format!("{method} {shape}"), problem(&joined(&scene, "shear_limit = 25.0\n")));
            let free = check(&format!("{method} {shape}, Coulomb"), problem(&scene.text()));
            assert!(limited.iter().any(|s| s.contains('t') && s.contains('l')), "{limited:?}");
            assert_ne!(limited, free);
        }
    }
}

/// Waypoints of the coefficient of friction.
const PATH: &str =
    "friction_path = [{ t = 0.3, factor = 0.2 }, { t = 0.6, factor = 1.5 }, { t = 0.9, factor = 0.4 }]\n";

/// The coefficient of friction rises and falls while the block slides, with nodes that stick and slip.
#[test]
fn gradient_with_friction_that_changes() {
    for (method, enforcement) in methods() {
        for shape in ["standard", "dual"] {
            let motion = "[{ t = 0.2, u = [0, -0.1, 0] }, { t = 1.0, u = [0.15, -0.12, 0.04] }]".into();
            let scene = Scene { friction: 0.4, motion, enforcement: enforcement.clone(), shape, ..Scene::default() };
            let changing = check(&format!("{method} {shape}"), problem(&joined(&scene, PATH)));
            let constant = check(&format!("{method} {shape}, constant"), problem(&scene.text()));
            assert!(changing.iter().any(|s| s.contains('t') && s.contains('l')), "{changing:?}");
            assert_ne!(changing, constant);
            // its work takes the mean of the bounds at both ends of a step
            let of_work = joined(&scene, PATH).replace("[objective]\ncontact_force = { steps = \"last\" }", WORK);
            assert!(of_work.contains(WORK), "{of_work}");
            check(&format!("{method} {shape}, work"), problem(&of_work));
        }
    }
}

/// The friction work as the objective.
const WORK: &str = "[[quantity]]\nname = \"work\"\nfriction_work = { slave = \"block_ymin\" }\n[objective]\nmaximise = { quantity = \"work\" }";

/// The derivative with respect to the coefficient of friction, which the factors of its path multiply.
#[test]
fn derivative_by_a_coefficient_that_changes() {
    for (method, enforcement) in methods() {
        let motion: String = "[{ t = 0.2, u = [0, -0.1, 0] }, { t = 1.0, u = [0.15, -0.12, 0.04] }]".into();
        let at = |friction: f64| {
            let scene =
                Scene { friction, motion: motion.clone(), enforcement: enforcement.clone(), ..Scene::default() };
            let mut problem = problem(&joined(&scene, PATH));
            let density = random_density(&problem, 7);
            let run = forward(&mut problem, &density);
            let gradients = problem.analysis.gradients(&run).expect("differentiable");
            let (_, slope) = gradients.parameters[0];
            (run.value, slope)
        };
        let h = 1e-3;
        let value = |k: f64| at(0.4 + k * h).0;
        let expected = (8.0 * (value(1.0) - value(-1.0)) - (value(2.0) - value(-2.0))) / (12.0 * h);
        let (value, found) = at(0.4);
        assert!(expected.abs() > 1e-3 * value.abs(), "{method}: it does not matter: {expected:e}");
        assert!((found - expected).abs() < BOUND * expected.abs(), "{method}: {found:e} instead of {expected:e}");
    }
}

/// The offset grows while the block is held, presses the surfaces together, and decreases again
/// while they slide.
#[test]
fn gradient_with_an_offset() {
    let offset = "offset = [{ t = 0, offset = -0.025 }, { t = 0.5, offset = 0.08 }, { t = 1, offset = 0.05 }]\n";
    for (method, enforcement) in methods() {
        for shape in ["standard", "dual"] {
            let motion = "[{ t = 0.5, u = [0, 0, 0] }, { t = 1.0, u = [0.1, 0, 0.03] }]".into();
            let scene = Scene { motion, enforcement: enforcement.clone(), shape, ..Scene::default() };
            let statuses = check(&format!("{method} {shape}"), problem(&joined(&scene, offset)));
            assert_eq!(statuses[0], "oooo");
            assert!(statuses[5].chars().all(|s| s != 'o') && statuses[9].contains('l'), "{statuses:?}");
        }
    }
}

/// Viscous forces carry over from one step to the next.
#[test]
fn gradient_with_viscosity() {
    for (method, enforcement) in methods() {
        let scene = Scene {
            enforcement,
            load_path: "tolerance = { relative = 1e-12 }\nviscosity = 200.0".into(),
            observed: "\"all\"",
            ..Scene::default()
        };
        let viscous = problem(&scene.text());
        let force = |mut problem: Problem| {
            let density = problem.initial_density().clone();
            forward(&mut problem, &density).value
        };
        let plain =
            force(problem(&Scene { load_path: "tolerance = { relative = 1e-12 }".into(), ..scene.clone() }.text()));
        let change = force(problem(&scene.text())) / plain - 1.0;
        assert!(change.abs() > 1e-3, "{method}: viscosity changes the force by {change}");
        check(method, viscous);
    }
}

/// The pair acts from t = 0.2 to t = 0.7, over a motion that presses and slides throughout.
#[test]
fn gradient_of_a_pair_that_acts_during_a_part_of_the_path() {
    for (method, enforcement) in methods() {
        let motion = "[{ t = 1.0, u = [0.2, -0.1, 0.03] }]".into();
        let scene = Scene { motion, enforcement: enforcement.clone(), observed: "\"all\"", ..Scene::default() };
        let statuses = check(method, problem(&joined(&scene, "active = [0.2, 0.7]\n")));
        for (step, status) in (1..).zip(&statuses) {
            assert_eq!(status == "oooo", step <= 2 || step > 7, "{statuses:?}");
        }
    }
}

/// Two blocks with ν = 0 and non-matching meshes; the upper one is pressed by 0.004 and drawn across
/// the lower one. Without Poisson's effect and with a driven face, the pressure is nearly uniform.
fn drawn(keys: &str) -> (f64, f64) {
    let text = Scene {
        slab: [8, 1, 2],
        block: [2, 1, 3],
        friction: 1.0,
        motion: "[{ t = 0.2, u = [0, -0.004, 0] }, { t = 1.0, u = [0.2, -0.004, 0] }]".into(),
        ..Scene::default()
    }
    .text()
    .replace("poisson_ratio = 0.3", "poisson_ratio = 0.0");
    let mut problem = problem(&text.replace("friction = 1.0\n", &format!("friction = 1.0\n{keys}")));
    let density = slipstick::design::ElementValues::from(vec![1.0; problem.initial_density().len()]);
    let run = forward(&mut problem, &density);
    let last = contact_path(&mut problem, &run).pop().unwrap();
    let force = |c: usize| last.iter().map(|node| node.covered_area * node.global_multiplier[c]).sum::<f64>();
    (force(0).abs(), last.iter().map(|node| node.covered_area).sum())
}

/// Where all nodes slip at the largest shear stress, the force is that stress times the area of
/// contact, whatever the pressure. (The slab is hardly deformed, so normals are vertical.)
#[test]
fn the_largest_shear_stress_times_the_area_is_the_force() {
    let (force, area) = drawn("shear_limit = 0.2\n");
    assert!((area - 0.64).abs() < 0.01, "{area}");
    assert!((force / (0.2 * area) - 1.0).abs() < 1e-2, "{force} on {area}");
    // Coulomb's law alone would transmit much more
    assert!(drawn("").0 > 2.0 * force);
}

/// A growing offset does the work that is stored in the bodies: a block between a slab and a held
/// face is compressed by a growing offset, in many small steps and without friction.
#[test]
fn the_work_of_an_offset_is_stored() {
    let keys = "offset = [{ t = 1, offset = 0.05 }]\n";
    let held = "[{ t = 1.0, u = [0, 0, 0] }]".to_owned();
    let scene = Scene { friction: 0.0, motion: held, steps: 40, ..Scene::default() };
    let mut problem = problem(&joined(&scene, keys));
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let found = slipstick::quantities::quantities(&problem, &run.path);
    let last = |name: &str| *found.get(name).unwrap().last().unwrap();
    assert!(last("strain_energy") > 0.0 && last("external_work") == 0.0);
    // the trapezoidal rule over 40 steps of a nearly quadratic function
    assert!((last("offset_work") / last("strain_energy") - 1.0).abs() < 1e-3, "{}", last("energy_balance"));
}

/// A bar whose end is driven: the viscous forces of a nearly uniform strain rate, by hand. With a
/// small viscosity, node i at height x moves by v x/L, and the work is Σ c V_i (v x_i/L)² over the
/// free nodes.
#[test]
fn viscous_work_by_hand() {
    let text = "[[body]]\nname = 'bar'\nbox = { min = [0, 0, 0], max = [1, 4, 1], elements = [1, 4, 1] }\n\
                material = { linear_elastic = { youngs_modulus = 1000.0, poisson_ratio = 0.0 } }\n\
                [[dirichlet]]\nset = 'bar_ymin'\n\
                [[dirichlet]]\nset = 'bar_ymax'\nmotion = [{ t = 1.0, u = [0, 0.4, 0] }]\n\
                [load_path]\nsteps = 4\ntolerance = { relative = 1e-12 }\nviscosity = 1e-3\n";
    let mut problem = problem(text);
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let found = slipstick::quantities::quantities(&problem, &run.path);
    let last = |name: &str| *found.get(name).unwrap().last().unwrap();
    // free nodes at heights 1, 2, 3, each layer with the volume 1, over a path of length 1
    let expected: f64 = [1.0, 2.0, 3.0].iter().map(|x: &f64| 1e-3 * (0.1 * x).powi(2)).sum();
    assert!((last("viscous_work") / expected - 1.0).abs() < 1e-4, "{} {expected}", last("viscous_work"));
    // of the viscous reaction Σ c V_i v x_i/L · x_i/L, which is there from the first step on, the
    // trapezoidal rule misses half a step
    let missed: f64 = [1.0, 2.0, 3.0].iter().map(|x| 0.5 * 0.1 * 1e-3 * (0.1 * x) * (x / 4.0)).sum();
    assert!((last("energy_balance") + missed).abs() < 1e-3 * missed, "{}", last("energy_balance"));
}

/// A half ring whose ends are pushed together from outside, and a little past each other, until its
/// inner surface touches itself. `legs`: two parts of that surface as a pair, instead of the whole
/// surface with itself. The gap is that between the facets: the circle around them would touch only
/// after the end of the path.
fn squeezed(enforcement: &str, legs: bool, around: usize) -> String {
    let end = |name: &str, sign: f64| {
        let (a, b) = (1.2 * sign, 2.0 * sign);
        format!(
            "[[set]]\nname = '{name}'\nwithin = 'ring_outer'\n\
             boxes = [{{ min = [{:?}, -0.3, -1], max = [{:?}, 1, 1] }}]\n\
             [[dirichlet]]\nset = '{name}'\ncomponents = ['x', 'z']\n\
             motion = [{{ t = 1.0, u = [{:?}, 0, {:?}] }}]\n",
            a.min(b),
            a.max(b),
            -1.01 * sign,
            0.03 * sign
        )
    };
    let leg = |name: &str, min: f64, max: f64| {
        format!(
            "[[surface]]\nname = '{name}'\nbody = 'ring'\nwithin = 'ring_inner'\n\
             boxes = [{{ min = [{min:?}, -0.75, -1], max = [{max:?}, 1, 1] }}]\n"
        )
    };
    let (surfaces, pair) = match legs {
        true => (leg("left", -2.0, 0.0) + &leg("right", 0.0, 2.0), ["left", "right"]),
        false => (String::new(), ["ring_inner"; 2]),
    };
    format!(
        "[[body]]\nname = 'ring'\nhalf_ring = {{ inner_radius = 1.0, outer_radius = 1.3, width = 0.5, elements = [{around}, 2, 1] }}\n\
         material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}\n\
         [[set]]\nname = 'bottom'\nwithin = 'ring_outer'\nboxes = [{{ min = [-0.05, -2, -1], max = [0.05, -1, 1] }}]\n\
         [[dirichlet]]\nset = 'bottom'\n{}{}{surfaces}\
         [[contact]]\nslave = '{}'\nmaster = '{}'\nfriction = 0.3\nsearch_radius = 0.6\nsurfaces = 'faceted'\nenforcement = {enforcement}\n\
         [load_path]\nsteps = 12\ntolerance = {{ relative = 1e-12 }}\n\
         [design]\nbodies = ['ring']\ninitial = 0.8\n[objective]\ncontact_force = {{ steps = 'all' }}\n",
        end("left_end", -1.0),
        end("right_end", 1.0),
        pair[0],
        pair[1],
    )
}

/// A surface that touches itself, and two parts of a surface as a pair of one body.
#[test]
fn gradient_of_a_body_in_contact_with_itself() {
    for (name, text) in [
        ("itself", squeezed("{ penalty = { stiffness = 8e3 } }", false, 16)),
        ("parts", squeezed("{ lagrange = {} }", true, 16)),
    ] {
        let statuses = check(name, problem(&text));
        assert!(statuses[0].chars().all(|s| s == 'o') && statuses[11].contains('l'), "{name}: {statuses:?}");
    }
}

/// Both sides of a surface that touches itself carry a stiffness ε, so its force is that of a pair
/// with 2 ε where ε is so large that it hardly matters which side the gap is measured on; and pressures
/// add up to it.
#[test]
fn both_sides_of_a_surface_that_touches_itself_carry_the_force() {
    let last = |text: &str| {
        let mut problem = problem(text);
        let density = problem.initial_density().clone();
        let run = forward(&mut problem, &density);
        let found = slipstick::quantities::quantities(&problem, &run.path);
        let [.., before, end] = &run.path.states[..] else { panic!("a path") };
        let results = problem.analysis.design.contact_results(&before.state, &end.state, end.time).unwrap();
        let name = if text.contains("slave = 'left'") { "left" } else { "ring_inner" };
        let last = |quantity: &str| *found.get(&format!("{name}_{quantity}")).unwrap().last().unwrap();
        // the resultant of both sides is zero
        assert_eq!(last("force_y") == 0.0, name == "ring_inner");
        (last("normal_force"), results)
    };
    let (itself, results) = last(&squeezed("{ penalty = { stiffness = 4e5 } }", false, 64));
    // a surface that touches itself has averaged normals
    let averaged = "{ penalty = { stiffness = 8e5 } }\nnormals = 'averaged'";
    let (pair, other) = last(&squeezed(averaged, true, 64));
    assert!((itself / pair - 1.0).abs() < 0.02, "{itself} {pair}");
    let balance = |c: usize| results.force.iter().skip(c).step_by(3).sum::<f64>();
    (0..3).for_each(|c| assert!(balance(c).abs() < 1e-9 * itself));
    let peak = |results: &slipstick::model::ContactResults| results.pressure.iter().copied().fold(0.0, f64::max);
    assert!((peak(&results) / peak(&other) - 1.0).abs() < 0.1, "{} {}", peak(&results), peak(&other));
}

/// A block stands on two slabs side by side, which are one surface for it: by symmetry, each carries
/// half of the force; and while the block slides, its nodes move from one to the other.
#[test]
fn a_block_on_two_slabs() {
    let text = |u: f64| {
        let body = |name: &str, min: [f64; 3], max: [f64; 3], elements: [usize; 3]| {
            format!(
                "[[body]]\nname = '{name}'\nbox = {{ min = {min:?}, max = {max:?}, elements = {elements:?} }}\n\
                 material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}\n"
            )
        };
        body("left", [0.0; 3], [1.0; 3], [2, 1, 1])
            + &body("right", [1.0, 0.0, 0.0], [2.0, 1.0, 1.0], [2, 1, 1])
            + &body("block", [0.55, 1.0, 0.1], [1.45, 1.8, 0.9], [3, 1, 1])
            + &format!(
                "[[surface]]\nname = 'floor'\nof = ['left_ymax', 'right_ymax']\n\
                 [[contact]]\nslave = 'block_ymin'\nmaster = 'floor'\nfriction = 0.3\n\
                 [[dirichlet]]\nset = 'left_ymin'\n[[dirichlet]]\nset = 'right_ymin'\n\
                 [[dirichlet]]\nset = 'block_ymax'\n\
                 motion = [{{ t = 0.5, u = [0, -0.05, 0] }}, {{ t = 1.0, u = [{u:?}, -0.05, 0.02] }}]\n\
                 [load_path]\nsteps = 8\ntolerance = {{ relative = 1e-12 }}\n\
                 [design]\nbodies = ['left', 'right', 'block']\ninitial = 0.8\n\
                 [objective]\ncontact_force = {{ steps = 'all' }}\n"
            )
    };
    let mut pressed = problem(&text(0.0));
    let density = pressed.initial_density().clone();
    let run = forward(&mut pressed, &density);
    let found = slipstick::quantities::quantities(&pressed, &run.path);
    let force = |set: &str| found.get(&format!("reaction_{set}_ymin_y")).unwrap()[4];
    assert!(force("left") > 0.0 && (force("left") / force("right") - 1.0).abs() < 1e-9);
    let statuses = check("two slabs", problem(&text(0.25)));
    assert!(statuses[7].contains('l'), "{statuses:?}");
}
