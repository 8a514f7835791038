//! Loads on surfaces: the resulting contact forces, and derivatives of whole paths under loads.

use crate::common::scene::*;
use crate::common::*;
use slipstick::build::Problem;
use slipstick::design::ElementValues;
use slipstick::model::Parameter;

/// Two boxes on top of each other between frictionless walls, with non-matching meshes, the upper
/// one pressed by `load`.
fn stack(load: &str, shape: &str, order: usize) -> Problem {
    problem(&stack_text(load, shape, order))
}

fn stack_text(load: &str, shape: &str, order: usize) -> String {
    let mut text = String::new();
    for (name, y, elements, modulus) in [("lower", 0, [2, 2, 2], 1000.0), ("upper", 1, [3, 1, 3], 300.0)] {
        text += &format!(
            "[[body]]\nname = '{name}'\norder = {order}\nbox = {{ min = [0, {y}, 0], max = [1, {}, 1], elements = {elements:?} }}\n\
             material = {{ neo_hooke = {{ youngs_modulus = {modulus:?}, poisson_ratio = 0.3 }} }}\n",
            y + 1
        );
    }
    text += &format!(
        "[[contact]]\nslave = 'upper_ymin'\nmaster = 'lower_ymax'\nfriction = 0.0\nmultiplier_shape = '{shape}'\n\
         [[dirichlet]]\nset = 'lower_ymin'\ncomponents = ['y']\n"
    );
    for body in ["lower", "upper"] {
        for (component, faces) in [("x", ["xmin", "xmax"]), ("z", ["zmin", "zmax"])] {
            for face in faces {
                text += &format!("[[dirichlet]]\nset = '{body}_{face}'\ncomponents = ['{component}']\n");
            }
        }
    }
    text += &format!(
        "[[load]]\nsurface = 'upper_ymax'\n{load}\n[load_path]\nsteps = 2\ntolerance = {{ relative = 1e-13 }}\n"
    );
    text + "[design]\nbodies = ['lower']\ninitial = 1.0\n[objective]\ncontact_force = { steps = 'last' }\n"
}

/// Pressure, traction and force of the same size have the same effect between walls, where no area
/// changes: the contact pressure is the load, and both boxes are strained by the stretch λ of
/// P = 2c (λ − λ^(−2β−1)), c = E/(4(1+ν)), β = ν/(1−2ν), (100).
#[test]
fn a_load_arrives_at_the_contact() {
    let size = 150.0;
    for load in
        [format!("pressure = {size}"), format!("traction = [0, {}, 0]", -size), format!("force = [0, {}, 0]", -size)]
    {
        for (shape, order) in [("standard", 1), ("dual", 1), ("standard", 2), ("dual", 2)] {
            let mut problem = stack(&load, shape, order);
            let density = problem.initial_density().clone();
            let forward = forward(&mut problem, &density);
            for contact in contact_path(&mut problem, &forward).pop().unwrap() {
                assert!(
                    (contact.multiplier[0] / size - 1.0).abs() < 1e-11,
                    "{load}, {shape}: {}",
                    contact.multiplier[0]
                );
            }
            assert!((forward.value / -size - 1.0).abs() < 1e-11, "{load}, {shape}: {}", forward.value);
            let d = &forward.path.states.last().unwrap().state.unknowns;
            let mut highest = 0.0;
            for (modulus, surface) in [(1000.0, "lower_ymax"), (300.0, "upper_ymax")] {
                let node = problem.mesh.surfaces[surface].nodes()[0] as usize;
                let stretch = 1.0 + d[3 * node + 1] - highest;
                highest = d[3 * node + 1];
                let (c, beta) = (modulus / (4.0 * 1.3), 0.3 / 0.4);
                let stress = 2.0 * c * (stretch - f64::powf(stretch, -2.0 * beta - 1.0));
                assert!((stress / -size - 1.0).abs() < 1e-10, "{load}, {shape}, {surface}: {stress} at {stretch}");
            }
        }
    }
}

/// The support carries the forces on all 16 nodes of the top.
#[test]
fn forces_on_nodes_add_up() {
    let support = "[[quantity]]\nname = 'support'\nreaction = { set = 'lower_ymin', component = 'y' }\n\
                   [objective]\nminimise = { quantity = 'support' }\n";
    let text = stack_text("nodal_force = [0, -5, 0]", "standard", 1);
    let mut problem = problem(&text.replace("[objective]\ncontact_force = { steps = 'last' }\n", support));
    let density = problem.initial_density().clone();
    let value = forward(&mut problem, &density).value;
    assert!((value / 80.0 - 1.0).abs() < 1e-11, "{value}");
}

/// All kinds of loads, rising and falling, on a scene with a sliding block.
const MORE: &str = "
[[load]]
surface = 'slab_xmax'
traction = [25.0, 4.0, -12.0]
[[load]]
surface = 'block_xmin'
pressure = 40.0
amplitude = [{ t = 0.4, factor = 1.0 }, { t = 0.9, factor = -0.5 }]
[[load]]
surface = 'block_ymin'
pressure = -6.0
[[load]]
surface = 'block_zmax'
force = [3.0, -9.0, -5.0]
amplitude = [{ t = 1.0, factor = 2.0 }]
[[load]]
surface = 'slab_zmax'
nodal_force = [0.02, -0.03, 0.01]
amplitude = [{ t = 0.5, factor = 1.0 }]
";

fn scene(enforcement: &str) -> Scene {
    Scene { enforcement: enforcement.into(), observed: "\"all\"", more: MORE.into(), ..Scene::default() }
}

/// The block's top is free: only contact and friction hold it, under a load that presses and drags
/// it.
fn held_by_contact(enforcement: &str) -> String {
    let scene = Scene { enforcement: enforcement.into(), observed: "\"all\"", ..Scene::default() };
    let motion = format!("[[dirichlet]]\nset = \"block_ymax\"\nmotion = {}\n", scene.motion);
    let load = "[[load]]\nsurface = 'block_ymax'\npressure = 60.0\namplitude = [{ t = 0.3, factor = 1.0 }]\n\
                [[load]]\nsurface = 'block_xmin'\ntraction = [9.0, 0.0, 3.0]\n";
    let text = scene.text();
    assert!(text.contains(&motion));
    text.replace(&motion, load)
}

/// dθ/dφ along a direction and dθ/da of every load against central differences (order 4) of whole
/// analyses.
fn check(name: &str, text: &str) {
    let mut base = problem(text);
    let density = random_density(&base, 5);
    let at_base = forward(&mut base, &density);
    let gradients = base.analysis.gradients(&at_base).expect("differentiable");
    let mut random = Random::new(11);
    let designed = designed(&base);
    let direction: Vec<f64> =
        (0..density.len()).map(|e| if designed.contains(&e) { random.within(-1.0, 1.0) } else { 0.0 }).collect();
    let fourth =
        |at: &mut dyn FnMut(f64) -> f64, h: f64| (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
    let along = |h: f64| -> ElementValues { density.iter().zip(&direction).map(|(d, v)| d + h * v).collect() };
    let expected = fourth(&mut |h| forward(&mut base, &along(h)).value, 1e-4);
    let found: f64 = gradients.density.iter().zip(&direction).map(|(g, v)| g * v).sum();
    assert!((found / expected - 1.0).abs() < 1e-7, "{name}: {found:e} instead of {expected:e} by density");
    let loads: Vec<(usize, f64)> = gradients
        .parameters
        .iter()
        .filter_map(|(p, d)| if let Parameter::Load { load } = p { Some((*load, *d)) } else { None })
        .collect();
    assert_eq!(loads.len(), text.matches("[[load]]").count());
    for (load, found) in loads {
        let mut at = |h: f64| {
            let mut scaled = parse(text);
            scaled.loads[load].amplitude.iter_mut().for_each(|point| point.factor *= 1.0 + h);
            let mut problem = slipstick::build::build(&scaled).unwrap();
            forward(&mut problem, &density).value
        };
        let expected = fourth(&mut at, 1e-4);
        assert!(expected.abs() > 1e-4 * at_base.value.abs(), "{name}: load {load} does not matter: {expected:e}");
        assert!((found / expected - 1.0).abs() < 1e-7, "{name}: {found:e} instead of {expected:e} by load {load}");
    }
}

fn parse(text: &str) -> slipstick::case::Case {
    slipstick::case::parse_case(text, "loads.toml").unwrap().case
}

#[test]
fn derivatives_under_loads_match_finite_differences() {
    for (method, enforcement) in
        [("Lagrange", LAGRANGE.to_string()), ("penalty", penalty(2e4)), ("augmented", augmented(1e4, 1e-11))]
    {
        check(method, &scene(&enforcement).text());
        check(&format!("{method}, held by contact"), &held_by_contact(&enforcement));
        let compliance = scene(&enforcement).text().replace("contact_force = {", "compliance = {");
        check(&format!("{method}, compliance"), &compliance);
    }
}

/// The same with quadratic elements, whose loads are integrated with their own shape functions.
#[test]
fn derivatives_under_loads_of_quadratic_elements_match_finite_differences() {
    for text in [scene(LAGRANGE).text(), held_by_contact(LAGRANGE)] {
        let text = text.replace("elements = [4, 1, 1]", "elements = [2, 1, 1]");
        check("quadratic", &text.replace("[[body]]", "[[body]]\norder = 2"));
    }
}

/// Waypoints of a load: linear from 0 and between them, constant after the last.
#[test]
fn a_load_follows_its_amplitude() {
    let case = parse(&scene(LAGRANGE).text());
    let factors: Vec<f64> = [0.0, 0.2, 0.4, 0.65, 0.9, 1.0].map(|t| case.loads[1].factor(t)).to_vec();
    let expected = [0.0, 0.5, 1.0, 0.25, -0.5, -0.5];
    assert!(factors.iter().zip(expected).all(|(f, e)| (f - e).abs() < 1e-15), "{factors:?}");
    assert_eq!(case.loads[0].factor(0.25), 0.25);
}
