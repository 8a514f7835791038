//! Rigid bodies: motions, forces and moments against numbers computed by hand, and derivatives with
//! respect to parameters against central differences (order 4) of whole analyses. Gradients with
//! respect to densities are compared in `random_gradients`.

use crate::common::*;
use nalgebra::{Rotation3, Unit, Vector3};
use slipstick::analysis::Forward;
use slipstick::build::Problem;
use slipstick::case::parse_case;
use slipstick::model::Parameter;

const HOOKE: &str = "{ linear_elastic = { youngs_modulus = 1000.0, poisson_ratio = 0.0 } }";
const NEO_HOOKE: &str = "{ neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";

fn body(name: &str, min: [f64; 3], max: [f64; 3], elements: [usize; 3], rest: &str) -> String {
    format!("[[body]]\nname = '{name}'\nbox = {{ min = {min:?}, max = {max:?}, elements = {elements:?} }}\n{rest}\n")
}

struct Run {
    problem: Problem,
    forward: Forward,
}

impl Run {
    fn of(text: &str) -> Self {
        let mut problem = problem(text);
        let density = problem.initial_density().clone();
        let forward = forward(&mut problem, &density);
        Self { problem, forward }
    }

    /// A quantity at the end of the path.
    fn last(&self, name: &str) -> f64 {
        let found = slipstick::quantities::quantities(&self.problem, &self.forward.path);
        *found.get(name).unwrap_or_else(|| panic!("no {name}")).last().unwrap()
    }

    fn displacement(&self, node: usize) -> Vector3<f64> {
        let state = &self.forward.path.states.last().unwrap().state;
        Vector3::from_column_slice(&state.unknowns[3 * node..][..3])
    }
}

/// A rigid plate compresses a block with ν = 0: F = E A u/h, and the moment about the reference point,
/// which lies beside the block.
#[test]
fn a_plate_compresses_a_block_uniformly() {
    let text = [
        body("block", [0.0; 3], [1.0, 2.0, 0.5], [3, 2, 2], &format!("material = {HOOKE}")),
        body("plate", [-0.5, 2.0, -0.5], [1.5, 2.3, 1.0], [2, 1, 2], "rigid = { reference = [2.0, 2.5, 0.5] }"),
        "[[dirichlet]]\nset = 'block_ymin'\n\
         [[dirichlet]]\nset = 'plate'\nmotion = [{ t = 1.0, u = [0, -0.01, 0] }]\n\
         [[contact]]\nslave = 'block_ymax'\nmaster = 'plate_ymin'\nfriction = 0\n[load_path]\nsteps = 2\n"
            .into(),
    ]
    .concat();
    let run = Run::of(&text);
    let force = 1000.0 * 0.5 * 0.01 / 2.0;
    // the force of the drive is −F at (1/2, 2, 1/4), so at the arm (−3/2, ·, −1/4): −1/4 e_z × −F e_y …
    for (name, expected) in [
        ("reaction_plate_x", 0.0),
        ("reaction_plate_y", -force),
        ("moment_plate_x", -0.25 * force),
        ("moment_plate_y", 0.0),
        ("moment_plate_z", 1.5 * force),
        ("displacement_plate_y", -0.01),
        ("strain_energy", 0.5 * force * 0.01),
    ] {
        let found = run.last(name);
        assert!((found - expected).abs() < 1e-10 * force, "{name}: {found} for {expected}");
    }
}

/// A force on a rigid plate compresses a block with ν = 0 by u = F h/(E A); its work ½ F u is stored.
/// The force has no reaction, and its component along the free motion counts for the set of the
/// plate, whose other motions are prescribed. A traction on a face of the plate does the same work,
/// on that face.
#[test]
fn the_work_of_a_force_on_a_rigid_body_counts_once() {
    let case = |load: &str, set: &str| {
        let quantities = ["all = ", &format!("loaded = set = '{set}'"), "plate = set = 'plate'"].map(|quantity| {
            let (name, set) = quantity.split_once(" = ").expect("a name");
            format!("[[quantity]]\nname = 'of_{name}'\nexternal_work = {{ {set} }}\n")
        });
        [
            body("block", [0.0; 3], [1.0, 2.0, 0.5], [3, 2, 2], &format!("material = {HOOKE}")),
            body("plate", [-0.5, 2.0, -0.5], [1.5, 2.3, 1.0], [2, 1, 2], "rigid = { reference = [2.0, 2.5, 0.5] }"),
            format!(
                "[[dirichlet]]\nset = 'block_ymin'\n\
                 [[dirichlet]]\nset = 'plate'\ncomponents = ['x', 'z', 'rx', 'ry', 'rz']\n\
                 [[load]]\n{load}\n\
                 [[contact]]\nslave = 'block_ymax'\nmaster = 'plate_ymin'\nfriction = 0\n[load_path]\nsteps = 2\n"
            ),
        ]
        .into_iter()
        .chain(quantities)
        .collect::<String>()
    };
    let (force, area): (f64, f64) = (5.0, 3.0);
    let expected = 0.5 * force * force * 2.0 / (1000.0 * 0.5);
    let traction = format!("surface = 'plate_ymax'\ntraction = [0, {:?}, 0]", -force / area);
    for (load, set) in [("surface = 'plate'\nforce = [0, -5, 0]", "plate"), (&traction, "plate_ymax")] {
        let run = Run::of(&case(load, set));
        for name in ["external_work", "strain_energy", "of_all", "of_loaded", "of_plate"] {
            let found = run.last(name);
            assert!((found - expected).abs() < 1e-9 * expected, "{load}: {name} is {found} for {expected}");
        }
        assert!(run.last("energy_balance").abs() < 1e-9 * expected);
    }
}

/// A moment turns a rigid plate that rests on a block and is held otherwise: its work is stored.
#[test]
fn the_work_of_a_moment_counts_once() {
    let text = [
        body("block", [0.0; 3], [1.0, 1.0, 0.5], [2, 1, 1], &format!("material = {HOOKE}")),
        body("plate", [0.0, 1.0, 0.0], [1.0, 1.2, 0.5], [1, 1, 1], "rigid = { reference = [0.5, 1.0, 0.25] }"),
        "[[dirichlet]]\nset = 'block_ymin'\n\
         [[dirichlet]]\nset = 'plate'\ncomponents = ['x', 'y', 'z', 'rx', 'ry']\n\
         [[load]]\nsurface = 'plate'\nmoment = [0, 0, 0.1]\n\
         [[contact]]\nslave = 'plate_ymin'\nmaster = 'block_ymax'\ntied = true\n[load_path]\nsteps = 20\n"
            .into(),
    ]
    .concat();
    let run = Run::of(&text);
    let (work, stored) = (run.last("external_work"), run.last("strain_energy"));
    // by the trapezoidal rule, so up to the square of a step
    assert!(work > 1e-6 && (work - stored).abs() < 1e-4 * stored, "{work} for {stored}");
}

/// A turning disc takes a rigid plate along by friction, whose only free motion is the rotation. No
/// moment resists, so the plate turns exactly as far as the disc. Half a turn away, all nodes slip
/// around the axis, and their moments also cancel: a step of 10 degrees must not end there.
#[test]
fn friction_takes_a_rigid_body_along() {
    for enforcement in ["augmented", "lagrange"] {
        let text = format!(
            "[[body]]\nname = 'disc'\n\
             cone = {{ height = 0.5, bottom_radius = 0.7, top_radius = 0.7, elements = [2, 2, 1] }}\n\
             material = {NEO_HOOKE}\n\
             [[body]]\nname = 'plate'\n\
             cone = {{ height = 0.5, bottom_radius = 0.8, top_radius = 0.8, elements = [2, 1, 1] }}\n\
             place = {{ translate = [0, 0.5, 0] }}\nrigid = {{ reference = [0, 0.5, 0] }}\n\
             [[contact]]\nslave = 'disc_top'\nmaster = 'plate_bottom'\nfriction = 0.3\n\
             enforcement = {{ {enforcement} = {{}} }}\n\
             [[dirichlet]]\nset = 'disc_bottom'\n\
             rotation = {{ point = [0, 0, 0], direction = [0, 1, 0] }}\n\
             motion = [{{ t = 0.05, angle = 0 }}, {{ t = 1, angle = 190 }}]\n\
             [[dirichlet]]\nset = 'plate'\ncomponents = ['x', 'y', 'z', 'rx', 'rz']\n\
             motion = [{{ t = 0.05, u = [0, -0.02, 0] }}]\n\
             [load_path]\nsteps = 20\n"
        );
        let found = Run::of(&text).last("rotation_plate_y");
        let expected = 190_f64.to_radians();
        assert!((found - expected).abs() < 1e-6, "{enforcement}: {found} for {expected}");
    }
}

/// A pressure on a face of a rigid body that is free to turn. The stiffness of the load against some
/// rotations is only round-off, which must not count as a stiffness in the factorization. For small
/// rotations, a traction on the same face does the same work.
#[test]
fn a_pressure_on_a_rigid_body_that_may_turn() {
    let case = |load: &str| {
        [
            body("block", [0.0; 3], [1.0; 3], [2, 2, 2], &format!("material = {NEO_HOOKE}")),
            body("cap", [0.0, 1.0, 0.0], [1.0, 1.5, 1.0], [1, 1, 1], "rigid = {}"),
            format!(
                "[[dirichlet]]\nset = 'block_ymin'\n[[load]]\nsurface = 'cap_xmax'\n{load}\n\
                 [[contact]]\nslave = 'block_ymax'\nmaster = 'cap_ymin'\ntied = true\n[load_path]\nsteps = 2\n"
            ),
        ]
        .concat()
    };
    let energy = |load| Run::of(&case(load)).last("strain_energy");
    let (pressed, pulled) = (energy("pressure = 0.5"), energy("traction = [-0.5, 0, 0]"));
    assert!(pulled > 1e-6 && (pressed / pulled - 1.0).abs() < 0.01, "{pressed} for {pulled}");
}

/// A beam on two blocks of different height, with ν = 0: the lever rule gives the forces, from which
/// the compressions and the rotation follow.
#[test]
fn a_loaded_beam_tilts_on_two_blocks() {
    let (load, place) = (1e-4, 1.2);
    let text = [
        body("left", [0.0; 3], [0.05, 1.0, 1.0], [1, 16, 1], &format!("material = {HOOKE}")),
        body("right", [2.0, 0.9, 0.0], [2.05, 1.0, 1.0], [1, 4, 1], &format!("material = {HOOKE}")),
        body(
            "beam",
            [-0.1, 1.0, -0.1],
            [2.3, 1.1, 1.1],
            [1; 3],
            &format!("rigid = {{ reference = [{place}, 1, 0.5] }}"),
        ),
        format!(
            "[[dirichlet]]\nset = 'left_ymin'\n[[dirichlet]]\nset = 'right_ymin'\n\
             [[dirichlet]]\nset = 'beam'\ncomponents = ['x', 'z', 'rx', 'ry']\n\
             [[load]]\nsurface = 'beam'\nforce = [0, {:?}, 0]\n\
             [[contact]]\nslave = 'left_ymax'\nmaster = 'beam_ymin'\nfriction = 0\n\
             [[contact]]\nslave = 'right_ymax'\nmaster = 'beam_ymin'\nfriction = 0\n[load_path]\nsteps = 1\n",
            -load
        ),
    ]
    .concat();
    let run = Run::of(&text);
    let force = [load * (2.025 - place) / 2.0, load * (place - 0.025) / 2.0];
    let down = [force[0] * 1.0 / (1000.0 * 0.05), force[1] * 0.1 / (1000.0 * 0.05)];
    let angle = (down[0] - down[1]) / 2.0;
    let at_reference = down[0] - angle * (place - 0.025);
    // the thin blocks resist the rotation a little; the lever rule has no such term
    for (name, expected, bound) in [
        ("rotation_beam_z", angle, 2e-3),
        ("displacement_beam_y", -at_reference, 1e-3),
        ("left_ymax_normal_force", force[0], 1e-3),
        ("right_ymax_normal_force", force[1], 1e-3),
    ] {
        let found = run.last(name);
        assert!((found / expected - 1.0).abs() < bound, "{name}: {found:e} for {expected:e}");
    }
    let moment = run.last("moment_beam_z");
    assert!(moment.abs() < 1e-9 * load, "nothing holds the rotation: {moment:e}");
}

/// A rigid body that turns by 150° about an oblique axis and moves: its nodes are where the rotation
/// takes them.
#[test]
fn nodes_follow_a_large_rotation() {
    let text = [
        body("block", [0.0; 3], [1.0; 3], [1; 3], &format!("material = {NEO_HOOKE}")),
        body("tool", [4.0, 0.0, 0.0], [5.0, 2.0, 1.0], [2, 2, 1], "rigid = { reference = [4.5, 3.0, 0.5] }"),
        "[[dirichlet]]\nset = 'block_ymin'\n\
         [[dirichlet]]\nset = 'tool'\nrotation = { point = [5, 1, 2], direction = [1, -2, 2] }\n\
         motion = [{ t = 1.0, u = [1, 0.5, -0.3], angle = 150 }]\n[load_path]\nsteps = 3\n"
            .into(),
    ]
    .concat();
    let run = Run::of(&text);
    let axis = Unit::new_normalize(Vector3::new(1.0, -2.0, 2.0));
    let rotation = Rotation3::from_axis_angle(&axis, 150f64.to_radians());
    let tool = run.problem.mesh.bodies[1].nodes.clone();
    assert_eq!(tool.len(), 18);
    for node in tool {
        let arm = Vector3::from(run.problem.mesh.nodes[node]) - Vector3::new(5.0, 1.0, 2.0);
        let expected = rotation * arm - arm + Vector3::new(1.0, 0.5, -0.3);
        assert!((run.displacement(node) - expected).norm() < 1e-13, "node {node}");
    }
}

/// A block that rocks on a slab, pressed and dragged by forces on its faces. `reference`: its
/// reference point.
fn rocking(reference: [f64; 3], enforcement: &str, rigid: bool) -> String {
    let kind = if rigid {
        format!("rigid = {{ reference = {reference:?} }}")
    } else {
        "material = { neo_hooke = { youngs_modulus = 1e6, poisson_ratio = 0.3 } }".into()
    };
    [
        body("slab", [0.0; 3], [4.0, 1.0, 4.0], [4, 2, 4], &format!("material = {NEO_HOOKE}")),
        body("block", [1.0, 1.0, 1.2], [2.6, 1.8, 2.9], [3, 2, 3], &kind),
        format!(
            "[[dirichlet]]\nset = 'slab_ymin'\n\
             [[load]]\nsurface = 'block_ymax'\nforce = [0, -120, 6]\namplitude = [{{ t = 0.5, factor = 1 }}]\n\
             [[load]]\nsurface = 'block_xmin'\npressure = 8.0\n\
             [[contact]]\nslave = 'slab_ymax'\nmaster = 'block_ymin'\nfriction = 0.3\nenforcement = {enforcement}\n\
             [load_path]\nsteps = 4\ntolerance = {{ relative = 1e-11 }}\n\
             [design]\nbodies = ['slab']\ninitial = 0.7\n\
             [[quantity]]\nname = 'sink'\ndisplacement = {{ set = 'block_xmax', component = 'y' }}\n\
             [objective]\nminimise = {{ quantity = 'sink' }}\n"
        ),
    ]
    .concat()
}

/// The reference point is a choice of unknowns, so it does not change the motion.
#[test]
fn the_motion_does_not_depend_on_the_reference_point() {
    let runs =
        [[1.8, 1.4, 2.05], [-3.0, 5.0, 1.0]].map(|reference| Run::of(&rocking(reference, "{ lagrange = {} }", true)));
    let nodes = runs[0].problem.mesh.bodies[1].nodes.clone();
    let size = nodes.clone().map(|node| runs[0].displacement(node).norm()).fold(0.0, f64::max);
    for node in nodes {
        let [a, b] = [&runs[0], &runs[1]].map(|run| run.displacement(node));
        assert!((a - b).norm() < 1e-8 * size, "node {node}: {a} {b}");
    }
    let down = runs[0].last("reaction_slab_ymin_y");
    let tilt = runs[0].last("rotation_block_z");
    assert!((down - 120.0).abs() < 1.0 && tilt.abs() > 1e-3, "{down} {tilt}");
}

/// A block of a thousand times the stiffness moves nearly alike.
#[test]
fn a_stiff_body_moves_like_a_rigid_one() {
    let [rigid, stiff] = [true, false].map(|rigid| Run::of(&rocking([1.8, 1.4, 2.05], "{ lagrange = {} }", rigid)));
    let [a, b] = [&rigid, &stiff].map(|run| run.last("sink"));
    assert!((a / b - 1.0).abs() < 5e-3, "{a} {b}");
}

/// dθ/da of loads, motion and friction, for all methods: a drive that translates and turns the block
/// about an oblique axis, and a free block under loads.
#[test]
fn derivatives_with_respect_to_parameters_match_finite_differences() {
    let methods = ["{ lagrange = {} }", "{ penalty = { stiffness = 20000.0 } }"];
    for enforcement in methods {
        let free = rocking([1.7, 1.5, 2.0], enforcement, true);
        let drive = "[[dirichlet]]\nset = 'block'\nrotation = { point = [1, 1, 1.5], direction = [0.2, 1, -0.1] }\n\
                     motion = [{ t = 0.5, u = [0, -0.08, 0] }, { t = 1, u = [0.1, -0.07, 0.05], angle = 9 }]\n";
        let loads = free.find("[[load]]").unwrap()..free.find("[[contact]]").unwrap();
        let mut driven = free.clone();
        driven.replace_range(loads, drive);
        let objective = "[[quantity]]\nname = 'twist'\nmoment = { set = 'block', point = [1, 1, 2], direction = [0, 1, 0] }\n\
                         [objective]\nminimise = { quantity = 'twist' }";
        let start = driven.find("[[quantity]]").unwrap();
        driven.replace_range(start.., objective);
        for text in [free, driven] {
            compare(&text);
        }
    }
}

fn compare(text: &str) {
    let mut base = problem(text);
    let density = random_density(&base, 5);
    let at_base = forward(&mut base, &density);
    let gradients = base.analysis.gradients(&at_base).expect("differentiable");
    let mut compared = 0;
    for (parameter, found) in &gradients.parameters {
        let at = |h: f64| {
            let mut case = parse_case(text, "rigid.toml").unwrap().case;
            match *parameter {
                Parameter::Load { load } => {
                    case.loads[load].amplitude.iter_mut().for_each(|point| point.factor *= 1.0 + h);
                }
                Parameter::Amplitude { motion } => {
                    for point in &mut case.dirichlet[motion].motion {
                        point.u.iter_mut().for_each(|u| *u *= 1.0 + h);
                        point.angle *= 1.0 + h;
                    }
                }
                Parameter::Friction { interface } => case.contacts[interface].friction += h,
                _ => return 0.0,
            }
            forward(&mut slipstick::build::build(&case).unwrap(), &density).value
        };
        let h = 1e-4;
        let expected = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
        if expected != 0.0 {
            compared += 1;
            assert!((found / expected - 1.0).abs() < 1e-6, "{parameter:?}: {found:e} instead of {expected:e}\n{text}");
        }
    }
    assert!(compared >= 2);
}
