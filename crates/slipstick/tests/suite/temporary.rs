//! Supports that begin or end within the load path: analytic forces and displacements, the balance of energy, bodies
//! that only contact holds afterwards, and gradients.

use crate::common::scene::{LAGRANGE, Scene, augmented, penalty};
use crate::common::*;
use crate::quantity_gradients::check;
use slipstick::analysis::Forward;
use slipstick::build::{Problem, build};
use slipstick::case::parse_case;
use slipstick::check::inspect;
use slipstick::quantities::quantities;

/// A bar of length 4 and cross-section 1 × 1 without lateral contraction, E A/L = 25, held at x = 0.
const BAR: &str = "[[body]]\nname = 'bar'\nbox = { min = [0, 0, 0], max = [4, 1, 1], elements = [3, 2, 1] }\n\
                   material = { linear_elastic = { youngs_modulus = 100, poisson_ratio = 0 } }\n\
                   [[dirichlet]]\nset = 'bar_xmin'\n[load_path]\nsteps = 8\n\
                   [[quantity]]\nname = 'end'\ndisplacement = { set = 'bar_xmax', component = 'x' }\n";

fn solved(text: &str) -> (Problem, Forward) {
    let mut problem = problem(text);
    let density = problem.initial_density().clone();
    let forward = forward(&mut problem, &density);
    (problem, forward)
}

/// Compares columns of `quantities.csv`, one value for each load step.
fn compare(text: &str, columns: &[(&str, [f64; 9])], bound: f64) {
    let (problem, forward) = solved(text);
    let found = quantities(&problem, &forward.path);
    for (name, expected) in columns {
        let values = found.get(name).unwrap_or_else(|| panic!("no {name}"));
        for (step, (value, expected)) in values.iter().zip(expected).enumerate() {
            assert!((value - expected).abs() < bound, "{name}, step {step}: {value} instead of {expected}");
        }
    }
}

/// An end that is pulled by 0.2 until t = 0.5 and then let go springs back; it gives back the energy ½ 25 0.2² to
/// what held it.
#[test]
fn a_bar_that_is_let_go_springs_back() {
    let text =
        "[[dirichlet]]\nset = 'bar_xmax'\ncomponents = ['x']\nuntil = 0.5\nmotion = [{ t = 0.5, u = [0.2, 0, 0] }]\n";
    let (u, f, w) = (0.05, 1.25, 0.5);
    let columns = [
        ("end", [0.0, u, 2.0 * u, 3.0 * u, 4.0 * u, 0.0, 0.0, 0.0, 0.0]),
        ("reaction_bar_xmax_x", [0.0, f, 2.0 * f, 3.0 * f, 4.0 * f, 0.0, 0.0, 0.0, 0.0]),
        ("reaction_bar_xmin_x", [0.0, -f, -2.0 * f, -3.0 * f, -4.0 * f, 0.0, 0.0, 0.0, 0.0]),
        ("external_work", [0.0, w / 16.0, w / 4.0, 9.0 * w / 16.0, w, 0.0, 0.0, 0.0, 0.0]),
        ("strain_energy", [0.0, w / 16.0, w / 4.0, 9.0 * w / 16.0, w, 0.0, 0.0, 0.0, 0.0]),
    ];
    compare(&format!("{BAR}{text}"), &columns, 1e-6);
}

/// A force stretches the bar by 0.2 until t = 0.5. Then its end is driven to 0.6, in two rates, while the force stays;
/// or it is held where it is while the force ends.
#[test]
fn a_support_begins_where_the_end_is() {
    let force = "[[load]]\nsurface = 'bar_xmax'\nforce = [5, 0, 0]\namplitude = [{ t = 0.5, factor = 1 }";
    let begins = "[[dirichlet]]\nset = 'bar_xmax'\ncomponents = ['x']\nfrom = 0.5\n";
    let driven =
        format!("{BAR}{force}]\n{begins}motion = [{{ t = 0.75, u = [0.3, 0, 0] }}, {{ t = 1, u = [0.6, 0, 0] }}]\n");
    let columns = [
        ("end", [0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.45, 0.6]),
        ("reaction_bar_xmax_x", [0.0, 0.0, 0.0, 0.0, 0.0, 1.25, 2.5, 6.25, 10.0]),
    ];
    compare(&driven, &columns, 1e-5);
    let held = format!("{BAR}{force}, {{ t = 1, factor = 0 }}]\n{begins}");
    let columns = [
        ("end", [0.0, 0.05, 0.1, 0.15, 0.2, 0.2, 0.2, 0.2, 0.2]),
        ("reaction_bar_xmax_x", [0.0, 0.0, 0.0, 0.0, 0.0, 1.25, 2.5, 3.75, 5.0]),
    ];
    compare(&held, &columns, 1e-5);
}

/// A block is pressed on a slab by its top, which is let go while a pressure on it remains: then only contact holds
/// it, and carries the pressure. A support that still acts counts as one, so nothing else holds the block before.
#[test]
fn a_block_that_is_let_go_rests_on_contact() {
    let text = "[[body]]\nname = 'slab'\nbox = { min = [0, 0, 0], max = [3, 1, 2], elements = [3, 1, 2] }\n\
                material = { neo_hooke = { youngs_modulus = 1000, poisson_ratio = 0.3 } }\n\
                [[body]]\nname = 'block'\nbox = { min = [0.5, 1, 0.5], max = [2.3, 2, 1.4], elements = [2, 1, 2] }\n\
                material = { neo_hooke = { youngs_modulus = 1000, poisson_ratio = 0.3 } }\n\
                [[contact]]\nslave = 'block_ymin'\nmaster = 'slab_ymax'\nfriction = 0.3\n\
                [[dirichlet]]\nset = 'slab_ymin'\n\
                [[dirichlet]]\nset = 'block_ymax'\nuntil = 0.5\nmotion = [{ t = 0.5, u = [0, -0.02, 0] }]\n\
                [[load]]\nsurface = 'block_ymax'\ntraction = [0, -5, 0]\n[load_path]\nsteps = 4\n\
                [[quantity]]\nname = 'pressed'\ncontact_force = { slave = 'block_ymin', component = 'y' }\n";
    let (problem, forward) = solved(text);
    let found = quantities(&problem, &forward.path);
    let column = |name: &str| found.get(name).expect(name);
    let weight = |step: usize| 5.0 * 1.8 * 0.9 * step as f64 / 4.0;
    for step in 1..=4 {
        let held = column("reaction_block_ymax_y")[step];
        let pressed = column("pressed")[step];
        assert!((pressed - (weight(step) - held)).abs() < 1e-6 * pressed, "step {step}: {pressed}, {held}");
        assert!(if step < 3 { held < -1.0 } else { held == 0.0 }, "step {step}: {held}");
        assert_eq!(column("holding_work")[step], 0.0, "step {step}");
    }
}

/// Gradients of all quantities by density through supports that begin and end, for all methods, and with viscous forces.
#[test]
fn gradients_with_temporary_supports() {
    let methods = [LAGRANGE.to_owned(), penalty(4e3), augmented(4e3, 1e-12)];
    for (enforcement, viscosity) in methods.into_iter().zip([40, 0, 0]) {
        let side = "[[set]]\nname = 'front'\nwithin = 'slab_zmax'\nboxes = [{ min = [0, 0.5, 0], max = [9, 1, 9] }]\n[[set]]\nname = 'side'\nwithin = 'block_zmin'\nboxes = [{ min = [-9, 0, -9], max = [9, 1.5, 9] }]\n[[dirichlet]]\nset = 'front'\ncomponents = ['z']\nfrom = 0.4\n\
                    motion = [{ t = 0.8, u = [0, 0, 0.03] }]\n\
                    [[dirichlet]]\nset = 'side'\ncomponents = ['x']\nfrom = 0.2\nuntil = 0.6\n";
        let scene = Scene {
            slab: [3, 1, 1],
            block: [2, 1, 2],
            enforcement,
            load_path: format!("tolerance = {{ relative = 1e-12 }}\nviscosity = {viscosity}"),
            friction: 0.35,
            motion: "[{ t = 0.4, u = [0, -0.1, 0] }, { t = 1.0, u = [0.1, -0.12, 0.03] }]".into(),
            steps: 5,
            more: side.into(),
            ..Scene::default()
        };
        check("temporary supports", &mut problem(&scene.text()), 3, &[1.0]);
    }
}

/// What a support that begins or ends cannot be, with its place.
#[test]
fn impossible_supports_are_refused() {
    let table = |keys: &str| format!("{BAR}[[dirichlet]]\nset = 'bar_xmax'\n{keys}\n");
    for (keys, key, message) in [
        ("from = 1.0", "from", "between 0 and 1"),
        ("from = 0.5\nuntil = 0.25", "begin earlier", "acts in no load step"),
        ("from = 0.9", "begin earlier", "acts in no load step"),
        ("until = 1.0", "until", "between 0 and 1"),
        ("from = 0.5\nmotion = [{ t = 0.25, u = [1, 0, 0] }]", "motion", "not later than `from`"),
        (
            "until = 0.5\nrotation = { point = [0, 0, 0], direction = [1, 0, 0] }\nmotion = [{ t = 1, angle = 5 }]",
            "a rotation",
            "cannot begin or end",
        ),
    ] {
        let error = parse_case(&table(keys), "case.toml").expect_err(keys).to_string();
        assert!(error.contains(key) && error.contains(message), "{keys}: {error}");
    }
    // the nodes of an edge that a permanent support holds
    let table = |motion: &str| format!("{BAR}[[dirichlet]]\nset = 'bar_ymin'\nuntil = 0.5\n{motion}");
    let built = |motion: &str| build(&parse_case(&table(motion), "case.toml").expect("a case").case);
    let error = built("motion = [{ t = 0.5, u = [0, 0.1, 0] }]").err().expect("an error").to_string();
    assert!(error.contains("begins or ends within the path"), "{error}");
    assert!(built("").is_ok(), "both hold these nodes still");
}

/// `check` says from when on supports do not hold a body; two that take turns do. A motion that the end of its support
/// cuts is a warning.
#[test]
fn bodies_that_are_let_go_are_noticed() {
    let text = BAR.replace("set = 'bar_xmin'\n", "set = 'bar_xmin'\nuntil = 0.5\n");
    let found = |text: &str| {
        let case = parse_case(text, "case.toml").expect("a case").case;
        let mut problem = build(&case).expect("a problem");
        inspect(&case, &mut problem).expect("a reference configuration").notices
    };
    let notices = found(&text);
    let [loose] = &notices[..] else { panic!("{notices:?}") };
    assert!(loose.path == "dirichlet[0].until" && loose.message.starts_with("after t = 0.5, body `bar` is free in 6"));
    assert!(found(&format!("{text}[[dirichlet]]\nset = 'bar_xmax'\nfrom = 0.5\n")).is_empty());
    let early = format!("{BAR}[[dirichlet]]\nset = 'bar_xmax'\nuntil = 0.5\nmotion = [{{ t = 1, u = [0.1, 0, 0] }}]\n");
    let warnings = parse_case(&early, "case.toml").expect("a case").warnings;
    assert!(warnings.iter().any(|w| format!("{w:?}").contains("before its waypoint at t = 1")), "{warnings:?}");
}
