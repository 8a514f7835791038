//! Slaves that are curved surfaces of few facets: where they touch, what contact takes of the work, and gradients.

use crate::common::*;
use slipstick::build::Problem;

const RADIUS: f64 = 0.7;

/// A half ball whose facets are as large as half its radius, above a flat slab; `motion` of its flat side.
fn ball(low: f64, motion: &str, more: &str) -> String {
    let height = RADIUS - low;
    format!(
        "[[body]]\nname = 'slab'\nbox = {{ min = [-2, -0.8, -1], max = [2, 0, 1], elements = [7, 2, 3] }}\n\
         material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}\n\
         [[body]]\nname = 'ball'\nhalf_ball = {{ radius = {RADIUS:?}, elements = [2, 2, 2] }}\n\
         material = {{ neo_hooke = {{ youngs_modulus = 2000.0, poisson_ratio = 0.3 }} }}\n\
         place = {{ translate = [0.1, {height:?}, 0.05] }}\n\
         [[contact]]\nslave = 'ball_dome'\nmaster = 'slab_ymax'\nfriction = 0.0\n{more}\n\
         [[dirichlet]]\nset = 'slab_ymin'\n[[dirichlet]]\nset = 'ball_flat'\nmotion = {motion}\n[load_path]\nsteps = 8\n"
    )
}

/// The values of a quantity in all steps.
fn values(text: &str, names: &[&str]) -> Vec<Vec<f64>> {
    let mut problem = problem(text);
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let found = slipstick::quantities::quantities(&problem, &run.path);
    names.iter().map(|name| found.get(name).unwrap_or_else(|| panic!("{name}")).to_vec()).collect()
}

/// By hand: the tip of the ball is 1 % of its radius above the slab or below it at the end of the first step. With the
/// standard shapes, whose mean gap is still open there, there is no force.
#[test]
fn a_ball_of_few_facets_touches_when_its_tip_does() {
    let force = |low: f64, more: &str| {
        let text = ball(low, "[{ t = 1, u = [0, 0, 0] }]", more).replace("steps = 8", "steps = 1");
        *values(&text, &["ball_dome_normal_force"])[0].last().expect("a step")
    };
    assert_eq!(force(-0.01 * RADIUS, ""), 0.0);
    assert!(force(0.01 * RADIUS, "") > 0.0);
    assert_eq!(force(0.01 * RADIUS, "multiplier_shape = 'standard'"), 0.0);
}

/// The ball is pressed down by 10 % of its radius and slides over the slab without friction. Work of the supports that
/// the bodies do not store is work that contact takes.
#[test]
fn frictionless_contact_of_few_facets_takes_no_work() {
    let motion = "[{ t = 0.5, u = [0, -0.07, 0] }, { t = 1, u = [0.3, -0.07, 0.1] }]";
    let taken = |more: &str| {
        let text = ball(0.0, motion, more).replace("steps = 8", "steps = 40");
        let found = values(&text, &["external_work", "strain_energy"]);
        let [work, stored] = [&found[0], &found[1]].map(|values| *values.last().expect("a step"));
        let largest = found[1].iter().fold(0.0, |largest: f64, energy| largest.max(*energy));
        println!("{more}: {:.3} % of {largest}", 100.0 * (work - stored) / largest);
        ((work - stored) / largest).abs()
    };
    let (default, averaged) = (taken(""), taken("normals = 'averaged'"));
    assert!(default < 0.02, "{default}");
    assert!(averaged > 2.0 * default, "{averaged} {default}");
}

/// Adjoint gradients agree with central differences, for all methods, with and without friction. The random
/// gradients draw many more such pairs.
#[test]
fn gradient_with_slaves_of_few_facets() {
    let cases = [("lagrange = {}", 0.0), ("lagrange = {}", 0.3), ("penalty = {}", 0.3)];
    for (enforcement, friction) in cases.into_iter().chain([("augmented = { tolerance = 1e-11 }", 0.0)]) {
        let motion = "[{ t = 0.5, u = [0, -0.07, 0] }, { t = 1, u = [0.2, -0.07, 0.1] }]";
        let text = ball(0.0, motion, &format!("enforcement = {{ {enforcement} }}"))
            .replace("friction = 0.0", &format!("friction = {friction:?}"))
            .replace("steps = 8\n", "steps = 2\ntolerance = { relative = 1e-12 }\n")
            + "[design]\nbodies = ['ball']\ninitial = 0.7\n[objective]\ncontact_force = { steps = 'all' }\n";
        let mut problem: Problem = problem(&text);
        let density = random_density(&problem, 5);
        let check = check_gradient(&mut problem, &density);
        println!("{enforcement} {friction}: {:.1e} {:?}", check.error, check.statuses);
        assert!(check.error < 1e-6, "{enforcement} {friction}: {:e} {:?}", check.error, check.statuses);
        assert!(check.statuses.last().unwrap().contains(['l', 't', 's']), "{:?}", check.statuses);
    }
}
