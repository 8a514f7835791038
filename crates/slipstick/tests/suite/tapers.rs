//! A plug that tapers is pressed into a bore, whose rim it touches: where it touches, what contact takes of the work,
//! and gradients.

use crate::common::*;

/// A plug of slope 0.14/0.9 in a bore of radius 0.5 and depth 0.5; its side is `lift` above the place at which it meets
/// the rim, and its upper face moves down by `down`.
fn plug(lift: f64, down: f64, more: &str) -> String {
    let height = lift + 0.5 - 0.08 * 0.9 / 0.14;
    format!(
        "[[body]]\nname = 'plate'\nhollow_cylinder = {{ inner_radius = 0.5, outer_radius = 1.2, height = 0.5, elements = [2, 16, 2] }}\n\
         material = {{ neo_hooke = {{ youngs_modulus = 3000.0, poisson_ratio = 0.3 }} }}\n\
         [[body]]\nname = 'plug'\ncone = {{ bottom_radius = 0.42, top_radius = 0.56, height = 0.9, elements = [4, 2, 4] }}\n\
         material = {{ neo_hooke = {{ youngs_modulus = 9000.0, poisson_ratio = 0.3 }} }}\n\
         place = {{ translate = [0.0, {height:?}, 0.0] }}\n\
         [[contact]]\nslave = 'plate_inner'\nmaster = 'plug_side'\nfriction = 0.0\n{more}\n\
         [[dirichlet]]\nset = 'plate_outer'\n[[dirichlet]]\nset = 'plug_top'\n\
         motion = [{{ t = 1, u = [0, {:?}, 0] }}]\n[load_path]\nsteps = 8\n",
        -down
    )
}

/// The last values of quantities.
fn last(text: &str, names: &[&str]) -> Vec<f64> {
    let mut problem = problem(text);
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let found = slipstick::quantities::quantities(&problem, &run.path);
    let last = |name: &&str| *found.get(name).unwrap_or_else(|| panic!("{name}")).last().expect("a step");
    names.iter().map(last).collect()
}

const OLD: &str = "multiplier_shape = 'standard'\nnormals = 'averaged'";

/// By hand: the side of the plug is 0.02 above the rim and moves by 0.018 or 0.022. With standard shapes, whose mean gap
/// over the first facet below the rim is still open, there is no force after 0.022 either.
#[test]
fn a_plug_touches_the_rim_of_a_bore() {
    let force = |down: f64, more: &str| last(&plug(0.02, down, more), &["plate_inner_normal_force"])[0];
    assert_eq!(force(0.018, ""), 0.0);
    assert!(force(0.022, "") > 0.0);
    assert_eq!(force(0.022, OLD), 0.0);
}

/// Without friction, the bodies store the work of the supports but for what facets of the rim take or add on those of
/// the plug. Averaged normals push along the radius, so that the plug would meet no resistance.
#[test]
fn frictionless_contact_at_the_rim_of_a_bore_takes_no_work() {
    let taken = |more: &str| {
        let text = plug(0.0, 0.1, more).replace("steps = 8", "steps = 40");
        let found = last(&text, &["external_work", "strain_energy"]);
        println!("{more}: work {}, stored {}", found[0], found[1]);
        (found[0] / found[1] - 1.0).abs()
    };
    let (default, averaged) = (taken(""), taken("normals = 'averaged'"));
    println!("{default} {averaged}");
    assert!(default < 0.03, "{default}");
    assert!(averaged > 0.3, "{averaged}");
}

/// Adjoint gradients agree with central differences, for all methods, with and without friction.
#[test]
fn gradient_of_a_plug_in_a_bore() {
    for (enforcement, friction) in [
        ("lagrange = {}", 0.0),
        ("lagrange = {}", 0.3),
        ("penalty = {}", 0.3),
        ("augmented = { tolerance = 1e-11 }", 0.3),
    ] {
        let text = plug(0.01, 0.1, &format!("enforcement = {{ {enforcement} }}"))
            .replace("friction = 0.0", &format!("friction = {friction:?}"))
            .replace("elements = [2, 16, 2]", "elements = [1, 16, 1]")
            .replace("elements = [4, 2, 4]", "elements = [4, 1, 2]")
            .replace("steps = 8\n", "steps = 3\ntolerance = { relative = 1e-12 }\n")
            + "[design]\nbodies = ['plate', 'plug']\ninitial = 0.7\n[objective]\ncontact_force = { steps = 'all' }\n";
        let mut problem = problem(&text);
        let density = random_density(&problem, 5);
        let check = check_gradient(&mut problem, &density);
        println!("{enforcement} {friction}: {:.1e} {:?}", check.error, check.statuses);
        assert!(check.error < 1e-6, "{enforcement} {friction}: {:e} {:?}", check.error, check.statuses);
        assert!(check.statuses.last().unwrap().contains(['l', 't', 's']), "{:?}", check.statuses);
    }
}
