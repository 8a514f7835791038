//! Joints: friction with a largest shear stress, offsets, pairs that act during a part of the load
//! path, and tied surfaces; and viscosity, which like friction depends on the previous state. Gradients are compared with central differences (order 4) of the whole
//! forward analysis; expected forces are computed by hand.

use crate::common::scene::*;
use crate::common::*;
use slipstick::build::Problem;
use slipstick::model::Parameter;

/// The bound of all comparisons.
const BOUND: f64 = 1e-7;

/// A scene whose pair has further keys.
fn joined(scene: &Scene, keys: &str) -> String {
    let text = scene.text();
    let friction = format!("friction = {:?}\n", scene.friction);
    assert!(text.contains(&friction));
    text.replace(&friction, &if keys.contains("tied") { keys.to_owned() } else { format!("{friction}{keys}") })
}

fn methods() -> [(&'static str, String); 3] {
    [("Lagrange", LAGRANGE.into()), ("penalty", penalty(2e4)), ("augmented", augmented(1e4, 1e-11))]
}

fn check(name: &str, mut problem: Problem) -> Vec<String> {
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

/// Tied blocks are pulled, sheared and turned.
#[test]
fn gradient_of_tied_blocks() {
    for shape in ["standard", "dual"] {
        for (slab, block) in [([4, 1, 1], [1, 1, 1]), ([3, 1, 2], [2, 1, 2])] {
            let scene = Scene {
                slab,
                block,
                shape,
                motion: "[{ t = 1.0, u = [0.1, 0.15, 0.05], angle = 20 }]".into(),
                drive: "rotation = { point = [1, 1, 0.5], direction = [0.2, 1, 0.1] }".into(),
                ..Scene::default()
            };
            let statuses = check(shape, problem(&joined(&scene, "tied = true\n")));
            assert!(statuses.iter().all(|s| s.chars().all(|s| s == 't')), "{statuses:?}");
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

/// Tied blocks with non-matching meshes under uniaxial strain, pulled apart: the displacement is
/// linear and the stress that of the law, P = 2c (λ − J^(−2β)/λ) with J = λ, up to round-off.
#[test]
fn a_uniform_stress_passes_through_a_tie() {
    // the second mesh of the upper block almost matches that of the lower one: slivers of facets overlap
    let meshes = ["elements = [3, 1, 3]", "elements = [2, 1, 2], grading = [2.000001, 1, 1.000001]"];
    for ((shape, slave, master), upper) in [
        ("standard", "upper_ymin", "lower_ymax"),
        ("dual", "upper_ymin", "lower_ymax"),
        ("standard", "lower_ymax", "upper_ymin"),
    ]
    .into_iter()
    .flat_map(|sides| meshes.map(|mesh| (sides, mesh)))
    {
        let wall = |component: &str, face: &str| {
            let of = |body: &str| format!("[[dirichlet]]\nset = '{body}_{face}'\ncomponents = ['{component}']\n");
            of("lower") + &of("upper")
        };
        let walls =
            [("x", "xmin"), ("x", "xmax"), ("z", "zmin"), ("z", "zmax")].map(|(c, face)| wall(c, face)).concat();
        let material = "material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";
        let text = format!(
            "[[body]]\nname = 'lower'\nbox = {{ min = [0, 0, 0], max = [1, 1, 1], elements = [2, 2, 2], grading = [2, 1, 1] }}\n\
             {material}\n\
             [[body]]\nname = 'upper'\nbox = {{ min = [0, 1, 0], max = [1, 2, 1], {upper} }}\n{material}\n\
             [[contact]]\nslave = '{slave}'\nmaster = '{master}'\ntied = true\nmultiplier_shape = '{shape}'\n\
             [[dirichlet]]\nset = 'lower_ymin'\ncomponents = ['y']\n\
             [[dirichlet]]\nset = 'upper_ymax'\ncomponents = ['y']\nmotion = [{{ t = 1.0, u = [0, 0.6, 0] }}]\n{walls}\
             [load_path]\nsteps = 2\ntolerance = {{ relative = 1e-13 }}\n"
        );
        let mut problem = problem(&text);
        let density = problem.initial_density().clone();
        let run = forward(&mut problem, &density);
        let stretch: f64 = 1.3;
        let d = &run.path.states.last().unwrap().state.unknowns;
        for (n, x) in problem.mesh.nodes.iter().enumerate() {
            let expected = [0.0, (stretch - 1.0) * x[1], 0.0];
            (0..3).for_each(|c| assert!((d[3 * n + c] - expected[c]).abs() < 1e-11, "{shape}: node {n}"));
        }
        let (c, beta): (f64, f64) = (1000.0 / 5.2, 0.3 / 0.4);
        let stress = 2.0 * c * (stretch - stretch.powf(-2.0 * beta) / stretch);
        for node in contact_path(&mut problem, &run).pop().unwrap() {
            // the traction acts on the area, which does not change; tension is negative
            assert!((node.multiplier[0] + stress).abs() < 1e-9 * stress, "{shape}: {} {stress}", node.multiplier[0]);
        }
    }
}

/// A block of 4 × 4 facets pressed by 10 on a slab of the same size, tied to it and moved along x, so that
/// the slab ends `overlap` behind a row of the block's nodes.
fn overhanging(overlap: f64, shape: &str) -> String {
    let (start, end) = (0.5 - overlap, 2.5 - overlap);
    let material = "material = { linear_elastic = { youngs_modulus = 1000.0, poisson_ratio = 0.0 } }";
    format!(
        "[[body]]\nname = 'slab'\nbox = {{ min = [0, 0, 0], max = [2, 1, 2], elements = [4, 2, 4] }}\n{material}\n\
         [[body]]\nname = 'block'\nbox = {{ min = [{start}, 1, 0], max = [{end}, 2, 2], elements = [4, 2, 4] }}\n{material}\n\
         [[contact]]\nslave = 'block_ymin'\nmaster = 'slab_ymax'\ntied = true\nmultiplier_shape = '{shape}'\n\
         [[dirichlet]]\nset = 'slab_ymin'\n[[load]]\nsurface = 'block_ymax'\npressure = 10.0\n\
         [load_path]\nsteps = 1\ntolerance = {{ relative = 1e-11 }}\n\
         [design]\nbodies = ['slab', 'block']\ninitial = 1.0\n[objective]\ncompliance = {{}}\n"
    )
}

/// A row of nodes whose facets overlap the master by a sliver takes hardly any force, and its multipliers
/// are of the size of the stress at the edge, not 1e5 (a sliver of 1 % of a facet) to 1e11 (1e-4) as they
/// were when bonds over slivers were rigid. The solution depends continuously on the sliver, which is
/// there or not. Gradients with respect to densities and moduli are exact.
#[test]
fn ties_over_slivers() {
    for shape in ["standard", "dual"] {
        let run = |overlap: f64| {
            let mut problem = problem(&overhanging(overlap, shape));
            let density = slipstick::design::ElementValues::from(vec![1.0; problem.initial_density().len()]);
            let run = forward(&mut problem, &density);
            let last = contact_path(&mut problem, &run).pop().unwrap();
            let largest = last.iter().flat_map(|node| node.multiplier).map(f64::abs).fold(0.0, f64::max);
            (run.value, largest)
        };
        let (none, without) = run(-1e-9);
        for (overlap, bound) in [(5e-3, 1e-2), (5e-4, 1e-3), (5e-5, 1e-4)] {
            let (value, largest) = run(overlap);
            assert!(largest < 1.2 * without, "{shape}, {overlap}: {largest} instead of {without}");
            assert!((value / none - 1.0).abs() < bound, "{shape}, {overlap}: {value} instead of {none}");
        }
        check(&format!("{shape}, a sliver"), problem(&overhanging(0.05, shape)));
        // the stiffness of partly covered nodes follows both moduli
        let text = |modulus: f64| {
            let slab = format!("youngs_modulus = {modulus:?}");
            overhanging(0.05, shape).replacen("youngs_modulus = 1000.0", &slab, 1)
        };
        let mut base = problem(&text(1000.0));
        let density = random_density(&base, 7);
        let path = forward(&mut base, &density);
        let gradient = base.analysis.response_gradients(&path, true).expect("a gradient").remove(0);
        let name = Parameter::YoungsModulus { body: 0 };
        let found = gradient.parameters.iter().find(|(other, _)| *other == name).expect("a parameter").1;
        let h = 1e-3;
        let at = |steps: f64| forward(&mut problem(&text(1000.0 * (1.0 + steps * h))), &density).value;
        let expected = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * h * 1000.0);
        assert!((found / expected - 1.0).abs() < 1e-7, "{shape}: {found} instead of {expected}");
    }
}

/// What is tied neither separates nor slides, under forces along and across the surface.
#[test]
fn a_tied_block_does_not_move_on_the_slab() {
    let scene = Scene { motion: "[{ t = 1.0, u = [0.1, 0.1, 0.05] }]".into(), ..Scene::default() };
    let mut problem = problem(&joined(&scene, "tied = true\n"));
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    for node in contact_path(&mut problem, &run).pop().unwrap() {
        assert!(node.gap.unwrap().abs() < 1e-12 && node.slip.iter().all(|s| s.abs() < 1e-12), "{node:?}");
    }
}

/// A disc tied to a block beyond whose end it reaches: nodes with little of the block opposite move, because their
/// condition is compliant, but a tie dissipates nothing.
#[test]
fn ties_do_no_friction_work() {
    let material = "material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";
    let text = format!(
        "[[body]]\nname = 'block'\nbox = {{ min = [0, 0, 0], max = [4, 1, 2], elements = [8, 2, 4] }}\n{material}\n\
         [[body]]\nname = 'disc'\ncone = {{ height = 0.5, bottom_radius = 0.7, top_radius = 0.9, elements = [3, 2, 2] }}\n\
         place = {{ translate = [1.6, 1, 1.7] }}\n{material}\n\
         [[contact]]\nslave = 'disc_bottom'\nmaster = 'block_ymax'\ntied = true\n\
         [[dirichlet]]\nset = 'block_xmin'\n[[dirichlet]]\nset = 'disc_top'\nmotion = [{{ t = 1, u = [0.1, -0.5, 0.2] }}]\n\
         [load_path]\nsteps = 3\n"
    );
    let mut problem = problem(&text);
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let slips = contact_path(&mut problem, &run).pop().unwrap();
    assert!(slips.iter().any(|node| node.slip[0].abs() > 1e-6), "nothing seems to slip");
    let found = slipstick::quantities::quantities(&problem, &run.path);
    assert_eq!(found.get("friction_work"), Some(vec![0.0; 4]));
    assert_eq!(found.imbalance, None);
}

/// Bodies that `check` reports as loose, in a scene of a slab and a block on it: a tie during the whole
/// path joins their rigid motions, so that the supports of both count together.
#[test]
fn ties_hold_bodies() {
    let loose = |block: &str, pair: &str, supports: &str| {
        let text = format!(
            "[[body]]\nname = 'slab'\nbox = {{ min = [0, 0, 0], max = [2, 1, 2], elements = [2, 1, 2] }}\n\
             material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}\n\
             [[body]]\nname = 'block'\nbox = {{ min = [0, 1, 0], max = [2, 2, 2], elements = [1, 1, 1] }}\n{block}\n\
             [[contact]]\nslave = 'slab_ymax'\nmaster = 'block_ymin'\n{pair}\n{supports}\
             [load_path]\nsteps = 2\n"
        );
        let case = slipstick::case::parse_case(&text, "ties.toml").unwrap_or_else(|e| panic!("{e}\n{text}")).case;
        let mut problem = slipstick::build::build(&case).unwrap_or_else(|e| panic!("{e}\n{text}"));
        let notices = slipstick::check::inspect(&case, &mut problem).expect("the state at rest").notices;
        let notices = notices.into_iter().filter(|notice| notice.kind == slipstick::check::NoticeKind::LooseBody);
        notices.map(|notice| notice.path).collect::<Vec<_>>()
    };
    let solid = "material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";
    let held = "[[dirichlet]]\nset = 'slab_ymin'\n";
    let along_y = "[[dirichlet]]\nset = 'slab_ymin'\ncomponents = ['y']\n";
    let across = "[[dirichlet]]\nset = 'block_ymax'\ncomponents = ['x', 'z']\n";
    let [slab, block] = ["body[0]", "body[1]"];
    assert!(loose(solid, "tied = true", held).is_empty());
    assert!(loose("rigid = {}", "tied = true", held).is_empty());
    assert!(loose(solid, "tied = true", &format!("{along_y}{across}")).is_empty());
    assert_eq!(loose(solid, "tied = true", along_y), [slab, block]);
    assert_eq!(loose("rigid = {}", "tied = true", along_y), [slab, block]);
    assert_eq!(loose(solid, "tied = true\nactive = [0, 0.5]", held), [block]);
    assert_eq!(loose(solid, "friction = 0.3", held), [block]);
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

/// Tied rings with different numbers of elements, turned by 90 degrees at the inner face: a rigid
/// rotation stores no energy, although the facets of the two polygons do not lie on each other.
#[test]
fn tied_rings_turn_without_stress() {
    for (order, shape) in [(1, "standard"), (2, "standard"), (1, "dual")] {
        let ring = |name: &str, inner: f64, outer: f64, around: usize| {
            format!(
                "[[body]]\nname = '{name}'\norder = {order}\n\
                 hollow_cylinder = {{ inner_radius = {inner:?}, outer_radius = {outer:?}, height = 1.0, elements = [1, {around}, 1] }}\n\
                 material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}\n"
            )
        };
        let text = ring("hub", 1.0, 2.0, 12)
            + &ring("rim", 2.0, 3.0, 16)
            + &format!(
                "[[contact]]\nslave = 'rim_inner'\nmaster = 'hub_outer'\ntied = true\nmultiplier_shape = '{shape}'\n\
                 [[dirichlet]]\nset = 'hub_inner'\nrotation = {{ point = [0, 0, 0], direction = [0, 1, 0] }}\n\
                 motion = [{{ t = 1, angle = 90 }}]\n[load_path]\nsteps = 6\n"
            );
        let mut problem = problem(&text);
        let density = problem.initial_density().clone();
        let run = forward(&mut problem, &density);
        let found = slipstick::quantities::quantities(&problem, &run.path);
        let energy = *found.get("strain_energy").unwrap().last().unwrap();
        // the volume is about 25, so a strain of 1e-3 would store 1e-2
        assert!(energy.abs() < 1e-9, "order {order}, {shape}: {energy}");
    }
}

/// A coating that is thin compared with the gap between the two polygons keeps its thickness, and
/// `check` warns that the gap remains; a wide gap that is closed is reported, too. Expected volume:
/// that of the ring of trapezia, n/2 sin(2π/n) (R² − r²) h.
#[test]
fn a_tie_does_not_change_thin_bodies() {
    let text = |inner: f64, outer: f64, around: usize| {
        let ring = |name: &str, inner: f64, outer: f64, around: usize| {
            format!(
                "[[body]]\nname = '{name}'\n\
                 hollow_cylinder = {{ inner_radius = {inner:?}, outer_radius = {outer:?}, height = 1.0, elements = [1, {around}, 1] }}\n\
                 material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}\n"
            )
        };
        ring("hub", 1.0, 2.0, 12)
            + &ring("rim", inner, outer, around)
            + "[[contact]]\nslave = 'rim_inner'\nmaster = 'hub_outer'\ntied = true\n\
               [[dirichlet]]\nset = 'hub_inner'\n[load_path]\nsteps = 1\n"
    };
    let notices = |text: &str| {
        let case = slipstick::case::parse_case(text, "case.toml").expect("a case").case;
        let mut problem = slipstick::build::build(&case).expect("a problem");
        let volume: f64 = problem.mesh.element_volumes()[problem.mesh.bodies[1].elements.clone()].iter().sum();
        let found = slipstick::check::inspect(&case, &mut problem).expect("an inspection").notices;
        (volume, found.into_iter().map(|notice| notice.message).collect::<Vec<_>>().join("\n"))
    };
    let (volume, messages) = notices(&text(2.0, 2.02, 16));
    let expected = 8.0 * (std::f64::consts::TAU / 16.0).sin() * (2.02_f64.powi(2) - 4.0);
    assert!((volume / expected - 1.0).abs() < 1e-9, "{volume} for {expected}");
    assert!(messages.contains("apart"), "{messages}");
    let (_, messages) = notices(&text(2.0, 3.0, 16));
    assert!(!messages.contains("apart") && !messages.contains("moved"), "{messages}");
    let (_, messages) = notices(&text(2.06, 3.0, 12));
    assert!(messages.contains("are moved by up to 0.058"), "{messages}");
}

/// Two surfaces that are tied for the first half of the path and slide in the second, with their roles
/// swapped: friction is μ times the normal force. Spans that overlap are an error, and so is the
/// same slave in both pairs.
#[test]
fn a_tie_is_followed_by_friction() {
    let text = |slave: &str, master: &str, from: f64| {
        let body = |name: &str, min: [f64; 3], max: [f64; 3], elements: [usize; 3]| {
            format!(
                "[[body]]\nname = '{name}'\nbox = {{ min = {min:?}, max = {max:?}, elements = {elements:?} }}\n\
                 material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}\n"
            )
        };
        body("slab", [0.0; 3], [2.0, 1.0, 1.0], [4, 2, 2])
            + &body("block", [0.5, 1.0, 0.0], [1.5, 2.0, 1.0], [3, 2, 3])
            + &format!(
                "[[contact]]\nslave = 'block_ymin'\nmaster = 'slab_ymax'\ntied = true\nactive = [0, 0.5]\n\
                 [[contact]]\nslave = '{slave}'\nmaster = '{master}'\nfriction = 0.2\nactive = [{from:?}, 1]\n\
                 [[dirichlet]]\nset = 'slab_ymin'\n[[dirichlet]]\nset = 'block_ymax'\n\
                 motion = [{{ t = 0.5, u = [0, -0.05, 0] }}, {{ t = 1, u = [0.3, -0.05, 0] }}]\n\
                 [load_path]\nsteps = 8\n"
            )
    };
    let mut problem = problem(&text("slab_ymax", "block_ymin", 0.5));
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let found = slipstick::quantities::quantities(&problem, &run.path);
    let last = |name: &str| *found.get(name).unwrap().last().unwrap();
    let (normal, friction) = (last("slab_ymax_normal_force"), last("slab_ymax_friction_force"));
    assert!(normal > 10.0 && (friction / normal - 0.2).abs() < 1e-9, "{friction} for {normal}");
    assert_eq!(last("block_ymin_normal_force"), 0.0);
    for (slave, master, from, cure) in [
        ("slab_ymax", "block_ymin", 0.4, "contact would be counted twice"),
        ("block_ymin", "slab_ymax", 0.5, "exchange slave and master of one of them"),
    ] {
        let errors = slipstick::case::parse_case(&text(slave, master, from), "case.toml").expect_err("twice");
        assert!(format!("{errors:?}").contains(cure), "{errors:?}");
    }
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
