//! A rigid roller that a load presses onto a block and that turns freely: only friction holds its rotation, and only
//! contact carries its load.

use crate::common::scene::{LAGRANGE, augmented, penalty};
use crate::common::*;
use slipstick::quantities::quantities;

/// The roller of radius 10 is driven by `travel` along `axis` (0 or 2) in the second half of the path; its axle has the
/// direction of the other one. `fine`: facets of 2 instead of 5.
fn roller(axis: usize, roller_is_slave: bool, fine: bool, travel: f64, steps: usize) -> String {
    let along =
        |long: f64, across: f64, height: f64| if axis == 0 { [long, height, across] } else { [across, height, long] };
    let count = |long: usize, high: usize| if axis == 0 { [long, high, 1] } else { [1, high, long] };
    let (block, cone) = if fine { (count(40, 2), [6, 6, 1]) } else { (count(16, 1), [4, 4, 1]) };
    let (turned, degrees) = if axis == 0 { ([1, 0, 0], 90) } else { ([0, 0, 1], -90) };
    let held = if axis == 0 { "['x', 'z', 'rx', 'ry']" } else { "['x', 'z', 'ry', 'rz']" };
    let pair = ["block_ymax", "roller_side"];
    let [slave, master] = if roller_is_slave { [pair[1], pair[0]] } else { pair };
    format!(
        "[[body]]\nname = 'block'\nbox = {{ min = {:?}, max = {:?}, elements = {block:?} }}\n\
         material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}\n\
         [[body]]\nname = 'roller'\nrigid = {{}}\n\
         cone = {{ bottom_radius = 10, top_radius = 10, height = 6, elements = {cone:?} }}\n\
         place = {{ rotate = {{ axis = {turned:?}, degrees = {degrees} }}, translate = {:?} }}\n\
         [[contact]]\nslave = '{slave}'\nmaster = '{master}'\nsides = 'as_given'\nfriction = 0.3\n\
         enforcement = {{ lagrange = {{}} }}\n\
         [[dirichlet]]\nset = 'block_ymin'\n\
         [[dirichlet]]\nset = 'roller'\ncomponents = {held}\n\
         motion = [{{ t = 0.5, u = [0, 0, 0] }}, {{ t = 1, u = {:?} }}]\n\
         [[load]]\nsurface = 'roller'\nforce = [0, -400, 0]\namplitude = [{{ t = 0.5, factor = 1 }}]\n\
         [load_path]\nsteps = {steps}\ntolerance = {{ relative = 1e-12 }}\n\
         [design]\nbodies = ['block']\ninitial = 0.9\nsimp = {{ p = 3, min = 1e-3 }}\n\
         [objective]\ncompliance = {{ steps = 'all' }}\n",
        along(0.0, 0.0, -8.0),
        along(80.0, 4.0, 0.0),
        along(20.0, -1.0, 10.0),
        along(travel, 0.0, 0.0),
    )
}

/// The angle times the radius, the force of the block's support against the load, the force of the drive, and the
/// moment about the axle, at the end.
fn rolled(axis: usize, roller_is_slave: bool, fine: bool, travel: f64, steps: usize) -> [f64; 4] {
    let mut problem = problem(&roller(axis, roller_is_slave, fine, travel, steps));
    let density = vec![1.0; problem.initial_density().len()].into();
    let run = forward(&mut problem, &density);
    assert_eq!(run.path.steps, steps);
    let found = quantities(&problem, &run.path);
    let last = |name: &str| *found.get(name).unwrap_or_else(|| panic!("no {name}")).last().expect("a step");
    let (drive, axle, sense) = if axis == 0 { ("x", "z", -1.0) } else { ("z", "x", 1.0) };
    [
        sense * 10.0 * last(&format!("rotation_roller_{axle}")),
        last("reaction_block_ymin_y"),
        last(&format!("reaction_roller_{drive}")),
        last(&format!("moment_roller_{axle}")),
    ]
}

/// Driven by 9 in one step, or in ten, the roller rolls: its angle is 9/10, up to the facets, whichever side is the
/// slave; the block carries the load of 400, and no moment acts about the axle. Along z, everything is as along x.
#[test]
fn a_free_roller_rolls_in_one_step_or_in_many() {
    for (roller_is_slave, fine, steps, bound) in [
        (false, true, 2, 0.02),
        (false, true, 20, 0.02),
        (true, true, 2, 0.02),
        (false, false, 2, 0.06),
        (false, false, 20, 0.06),
    ] {
        let [angle, force, drive, moment] = rolled(0, roller_is_slave, fine, 9.0, steps);
        println!(
            "roller as slave {roller_is_slave}, fine {fine}, {steps} steps: {angle:.4} of 9, {force:.6}, {drive:.4}, {moment:.1e}"
        );
        assert!((angle / 9.0 - 1.0).abs() < bound, "{angle}");
        assert!((force / 400.0 - 1.0).abs() < 1e-9 && moment.abs() < 1e-8 * 4000.0, "{force} {moment}");
        assert!(drive.abs() < 0.3 * 400.0, "friction holds more than it can: {drive}");
    }
    let [x, z] = [0, 2].map(|axis| rolled(axis, false, true, 9.0, 2));
    assert!((x[0] / z[0] - 1.0).abs() < 1e-8 && (x[2] - z[2]).abs() < 1e-6, "{x:?} {z:?}");
}

/// The gradient of a roller that rolls, against central differences (order 4) of the whole path.
#[test]
fn gradient_of_a_free_roller() {
    let mut problem = problem(&roller(0, false, false, 1.8, 4));
    let density = problem.initial_density().clone();
    let check = check_gradient(&mut problem, &density);
    println!("error {:.1e}, {:?}", check.error, check.statuses);
    assert!(check.error < 1e-7, "the gradient is off by {:e}", check.error);
}

/// A roller of radius 10 between two plates that are pressed together by 1, of which the upper one then moves by 2, in
/// plane strain, with `layers` elements along the axle. Nothing but contact holds the roller.
fn between_plates(
    enforcement: &str,
    rigid: bool,
    layers: usize,
    order: usize,
    [along, around]: [usize; 2],
    steps: usize,
) -> String {
    let elastic = "material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }\n";
    let held = |set: &str, components: &str| format!("[[dirichlet]]\nset = '{set}'\ncomponents = {components}\n");
    // exact on curved surfaces: a rule that is not jumps where mesh lines of both sides nearly coincide
    let plate = |name: &str, low: f64, face: &str| {
        format!(
            "[[body]]\nname = '{name}'\norder = {order}\n{elastic}\
             box = {{ min = [-12, {low:?}, 0], max = [12, {:?}, 2], elements = [{}, 4, {layers}] }}\n\
             [[contact]]\nslave = '{name}_{face}'\nmaster = 'roller_side'\nsides = 'as_given'\nfriction = 0.3\n\
             cell_rule = 12\nenforcement = {enforcement}\n{}{}",
            low + 5.0,
            along,
            held(&format!("{name}_zmin"), "['z']"),
            held(&format!("{name}_zmax"), "['z']"),
        )
    };
    let roller = match rigid {
        true => held("roller", "['z', 'rx', 'ry']"),
        false => held("roller_bottom", "['z']") + &held("roller_top", "['z']"),
    };
    format!(
        "[[body]]\nname = 'roller'\norder = {order}\n{}\
         cone = {{ bottom_radius = 10, top_radius = 10, height = 2, elements = [{}, 4, {layers}] }}\n\
         place = {{ rotate = {{ axis = [1, 0, 0], degrees = 90 }} }}\n\
         {}{}{roller}[[dirichlet]]\nset = 'low_ymin'\n\
         [[dirichlet]]\nset = 'up_ymax'\n\
         motion = [{{ t = 0.5, u = [0, -1, 0] }}, {{ t = 1, u = [2, -1, 0] }}]\n\
         [load_path]\nsteps = {steps}\ntolerance = {{ relative = 1e-11 }}\n\
         [design]\nbodies = ['low', 'up']\ninitial = 0.9\nsimp = {{ p = 3, min = 1e-3 }}\n\
         [[quantity]]\nname = 'work'\nexternal_work = {{}}\n\
         [objective]\nminimise = {{ quantity = 'work' }}\n",
        if rigid { "rigid = {}\n" } else { elastic },
        around,
        plate("low", -15.0, "ymax"),
        plate("up", 10.0, "ymin"),
    )
}

/// The forces along and across the upper plate, and the Newton iterations of the path.
fn pressed_between(enforcement: &str, rigid: bool, layers: usize, order: usize) -> ([f64; 2], usize) {
    let mut problem = problem(&between_plates(enforcement, rigid, layers, order, [24 / order, 8 / order], 10));
    let density = vec![1.0; problem.initial_density().len()].into();
    let run = forward(&mut problem, &density);
    assert_eq!(run.path.steps, 10);
    assert_eq!(run.path.failed_iterations(), 0, "rigid {rigid}, {layers} layers of order {order}");
    let iterations = run.path.states.iter().map(|at| at.report.iterations.len()).sum();
    let found = quantities(&problem, &run.path);
    let last =
        |axis: &str| *found.get(&format!("reaction_up_ymax_{axis}")).expect("a reaction").last().expect("a step");
    (["x", "y"].map(last), iterations)
}

/// In plane strain, elements along the axle change neither the forces nor, with Lagrange multipliers, the iterations by
/// more than one per step, whether the roller is rigid or elastic, with linear and with quadratic elements, of which
/// one layer has nodes between the planes.
#[test]
fn a_roller_between_plates_in_plane_strain_has_any_number_of_layers() {
    for (enforcement, rigid, order, others) in [
        (LAGRANGE, true, 1, &[2, 3][..]),
        (LAGRANGE, false, 1, &[2, 3]),
        (LAGRANGE, true, 2, &[2]),
        (LAGRANGE, false, 2, &[2]),
        (&augmented(1e4, 1e-11), false, 1, &[2]),
        (&penalty(1e4), false, 1, &[2]),
    ] {
        let (one, iterations) = pressed_between(enforcement, rigid, 1, order);
        for &layers in others {
            let (more, needed) = pressed_between(enforcement, rigid, layers, order);
            let case = format!("{enforcement}, rigid {rigid}, order {order}, {layers} layers");
            println!("{case}: {more:?}, {needed}; one: {one:?}, {iterations}");
            let apart = (more[0] - one[0]).hypot(more[1] - one[1]);
            assert!(apart < 1e-9 * one[1].abs(), "{case}: {one:?} becomes {more:?}");
            // Uzawa's updates may need more
            let bound = if enforcement == LAGRANGE { iterations + 10 } else { 2 * iterations };
            assert!(needed <= bound, "{case}: {needed} iterations instead of {iterations}");
        }
    }
}

/// The derivative along a random direction with the roller in place, rigid and elastic, against central differences
/// (order 4) of the whole path.
#[test]
fn gradient_of_plates_around_a_roller() {
    let augmented = augmented(1e4, 1e-11);
    for (enforcement, rigid) in [(LAGRANGE, true), (LAGRANGE, false), (&augmented, false)] {
        let mut problem = problem(&between_plates(enforcement, rigid, 2, 1, [16, 8], 10));
        let density = problem.initial_density().clone();
        let (found, expected) = along_a_direction(&mut problem, &density, 5, 1e-5);
        println!("{enforcement}, rigid {rigid}: {found:e} and {expected:e}");
        assert!(
            (found / expected - 1.0).abs() < 1e-7,
            "{enforcement}, rigid {rigid}: {found:e} instead of {expected:e}"
        );
    }
}
