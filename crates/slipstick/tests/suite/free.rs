//! Bodies that only contact holds: equilibrium, a comparison with supported bodies, and gradients,
//! which are compared with central differences (order 4) of the whole forward analysis.

use crate::common::scene::*;
use crate::common::*;
use slipstick::verify::{Verdict, VerifyOptions, verify_gradient};
use slipstick_path::Silent;

const MATERIAL: &str = "material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";

/// A slab, and blocks above it with a gap of 0.05 below each; a pressure acts on the last block.
struct Pile<'a> {
    blocks: usize,
    friction: f64,
    enforcement: &'a str,
    gap: f64,
    more: &'a str,
}

impl Pile<'_> {
    fn text(&self) -> String {
        let Self { blocks, friction, enforcement, gap, more } = self;
        let mut text = format!(
            "[[body]]\nname = 'b0'\nbox = {{ min = [0, 0, 0], max = [4, 1, 2], elements = [6, 1, 4] }}\n{MATERIAL}\n\
             [[dirichlet]]\nset = 'b0_ymin'\n"
        );
        for k in 1..=*blocks {
            let low = 1.0 + gap * k as f64 + 0.8 * (k - 1) as f64;
            text += &format!(
                "[[body]]\nname = 'b{k}'\nbox = {{ min = [1.3, {low:?}, 0.3], max = [2.7, {:?}, 1.7], elements = [2, 1, 2] }}\n\
                 {MATERIAL}\n[[contact]]\nslave = 'b{k}_ymin'\nmaster = 'b{}_ymax'\nfriction = {friction:?}\n\
                 enforcement = {enforcement}\n",
                low + 0.8,
                k - 1
            );
        }
        text + &format!(
            "[[load]]\nsurface = 'b{blocks}_ymax'\npressure = 5.0\n{more}\n[load_path]\nsteps = 3\n\
             tolerance = {{ relative = 1e-12 }}\n[design]\nbodies = ['b0', 'b1']\ninitial = 0.8\n\
             simp = {{ p = 3, min = 1e-3 }}\n[objective]\ncompliance = {{ steps = 'all' }}\n"
        )
    }
}

const FIRST: Pile<'_> = Pile { blocks: 1, friction: 0.3, enforcement: LAGRANGE, gap: 0.05, more: "" };

fn methods() -> [(&'static str, String); 3] {
    [("Lagrange", LAGRANGE.into()), ("penalty", penalty(2e4)), ("augmented", augmented(1e4, 1e-11))]
}

/// Each method, and both with and without friction.
fn methods_and_friction() -> impl Iterator<Item = (&'static str, String, f64)> {
    let [lagrange, penalty, augmented] = methods();
    let of = |(name, enforcement): (&'static str, String), friction| (name, enforcement, friction);
    [of(lagrange.clone(), 0.0), of(lagrange, 0.3), of(penalty, 0.3), of(augmented, 0.0)].into_iter()
}

/// The normal force at the end, the compliance, and the motions left free.
fn solved(text: &str) -> (f64, f64, Vec<String>) {
    let mut problem = problem(text);
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let nodes = contact_path(&mut problem, &run).pop().expect("a state");
    let force = nodes.iter().map(|at| at.multiplier[0] * at.covered_area).sum();
    (force, run.value, run.path.states.last().expect("a state").report.left_free.clone())
}

/// Pressure on an area of 1.4² gives the force of every pair, up to the change of that area; also for
/// gaps of several elements.
#[test]
fn loaded_bodies_move_up_to_their_contact() {
    for gap in [0.0, 0.05, 3.0] {
        for friction in [0.0, 0.3] {
            for blocks in [1, 2, 3] {
                let (force, ..) = solved(&Pile { blocks, friction, gap, ..FIRST }.text());
                let expected = 5.0 * 1.4 * 1.4 * blocks as f64;
                println!("gap {gap}, friction {friction}, {blocks} blocks: {force} of {expected}");
                assert!((force / expected - 1.0).abs() < 0.01, "{gap} {friction} {blocks}: {force} of {expected}");
            }
        }
    }
}

/// Supports on the planes of symmetry of a frictionless block carry nothing, so a block without them is
/// in the same state.
#[test]
fn a_free_body_is_where_its_symmetry_would_hold_it() {
    let set = |name: &str, min: [f64; 3], max: [f64; 3], component: &str| {
        format!(
            "[[set]]\nname = '{name}'\nboxes = [{{ min = {min:?}, max = {max:?} }}]\n[[dirichlet]]\nset = '{name}'\n\
             components = ['{component}']\n"
        )
    };
    let held = set("mid_x", [1.99, 1.01, 0.0], [2.01, 9.0, 2.0], "x")
        + &set("mid_z", [1.0, 1.01, 0.99], [3.0, 9.0, 1.01], "z");
    let free = solved(&Pile { friction: 0.0, ..FIRST }.text());
    let supported = solved(&Pile { friction: 0.0, more: &held, ..FIRST }.text());
    assert_eq!(free.2, ["`b1` along x, z and about y"]);
    assert!(supported.2.is_empty(), "{:?}", supported.2);
    assert!((free.0 / supported.0 - 1.0).abs() < 1e-9, "{} {}", free.0, supported.0);
    assert!((free.1 / supported.1 - 1.0).abs() < 1e-9, "{} {}", free.1, supported.1);
}

/// The gradient at the initial density (`spread` = 0), at a random one (1), or in between. Without friction,
/// the dent is then no longer symmetric, and the springs carry a small force, which the gradient includes.
fn check(name: &str, text: &str, spread: f64) {
    let mut problem = problem(text);
    let (initial, random) = (problem.initial_density().clone(), random_density(&problem, 7));
    let density = initial.iter().zip(random.iter()).map(|(i, r)| i + spread * (r - i)).collect();
    let check = check_gradient(&mut problem, &density);
    let held = check.forward.path.states.iter().filter(|state| state.report.holds).count();
    println!("{name}: error {:.1e}, {held} steps held, {:?}", check.error, check.statuses);
    assert!(held > 0, "{name}: no step holds free motions");
    if check.forward.path.states.iter().any(|state| !state.report.left_free.is_empty()) {
        let force = check.forward.path.states.iter().map(|state| state.report.holding).fold(0.0, f64::max);
        assert!(force > 1e-6 && force < 1e-3, "{name}: springs carry {force:e}");
    }
    assert!(check.error < 1e-7, "{name}: the gradient is off by {:e}", check.error);
}

/// With friction, contact holds the block; without, it may slide and turn, and a random density would push
/// it off the dent with more than the springs may carry.
#[test]
fn gradient_of_loaded_bodies() {
    for (method, enforcement, friction) in methods_and_friction() {
        let pile = Pile { friction, enforcement: &enforcement, ..FIRST };
        check(&format!("{method}, friction {friction}"), &pile.text(), if friction > 0.0 { 1.0 } else { 0.01 });
    }
}

/// One block pushes another.
#[test]
fn gradient_of_a_pile() {
    for (method, enforcement) in methods() {
        let pile = Pile { blocks: 2, friction: 0.0, enforcement: &enforcement, ..FIRST };
        check(&format!("{method}, two blocks"), &pile.text(), 0.01);
    }
}

/// A rigid block with six free motions. At the random density, its active set is at a kink.
#[test]
fn gradient_of_a_rigid_body() {
    for (method, enforcement, friction) in methods_and_friction() {
        let text = Pile { friction, enforcement: &enforcement, ..FIRST }.text();
        let at = text.rfind(MATERIAL).expect("the material of the block");
        let text = format!("{}rigid = {{}}{}", &text[..at], &text[at + MATERIAL.len()..]);
        let text = text.replace("surface = 'b1_ymax'\npressure = 5.0", "surface = 'b1'\nforce = [0, -10, 0]");
        let text = text.replace("bodies = ['b0', 'b1']", "bodies = ['b0']");
        let pair = ("slave = 'b1_ymin'\nmaster = 'b0_ymax'", "slave = 'b0_ymax'\nmaster = 'b1_ymin'");
        check(&format!("{method}, rigid, friction {friction}"), &text.replace(pair.0, pair.1), 0.01);
    }
}

/// A block on a rigid flat slab, without friction: nothing but the springs resists a lateral load of 0.04 %
/// of the normal one. In equilibrium their force is the load, so they take Σ F_n (x_n − x_n−1) with the
/// mean position x of the block's corners.
#[test]
fn springs_take_the_work_of_a_load_that_nothing_else_resists() {
    let load = 4e-3;
    let text = Pile { friction: 0.0, gap: 0.0, ..FIRST }.text();
    let text = text.replace("pressure = 5.0", &format!("force = [{load:?}, -10, 0]"));
    let text = text.replacen(MATERIAL, "rigid = {}", 1).replace("set = 'b0_ymin'", "set = 'b0'");
    let text = text.replace("bodies = ['b0', 'b1']", "bodies = ['b1']");
    let mut problem = problem(&text);
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let found = slipstick::quantities::quantities(&problem, &run.path);
    let taken = found.get("holding_work").expect("a loose body");
    let corner = |node: usize| {
        let [x, y, z] = problem.mesh.nodes[node];
        [x, z].iter().zip([[1.3, 2.7], [0.3, 1.7]]).all(|(c, ends)| ends.contains(c)) && y >= 1.0
    };
    let corners: Vec<usize> = (0..problem.mesh.nodes.len()).filter(|&node| corner(node)).collect();
    assert_eq!(corners.len(), 8);
    let mean = |state: &slipstick_path::PathState| {
        corners.iter().map(|&node| state.state.unknowns[3 * node]).sum::<f64>() / corners.len() as f64
    };
    let states = &run.path.states;
    let moves = states.windows(2).map(|pair| load * pair[1].time.t * (mean(&pair[1]) - mean(&pair[0])));
    let expected: f64 = moves.sum();
    let last = *taken.last().expect("a step");
    assert!(expected > 0.0 && (last / expected - 1.0).abs() < 1e-6, "{last} {expected}");
}

/// `slipstick verify gradient` finds the gradient of a body that only contact holds right, along a random
/// direction and along an element.
#[test]
fn gradients_of_free_bodies_are_verified() {
    for friction in [0.0, 0.3] {
        let mut problem = problem(&Pile { friction, ..FIRST }.text());
        let density = problem.initial_density().clone();
        let designed: Vec<u32> = (0..density.len() as u32).collect();
        let options = VerifyOptions {
            directions: 1,
            elements: 1,
            step: 1e-4,
            halvings: 3,
            forward_tolerance: 1e-12,
            tolerance: 1e-6,
        };
        let check =
            verify_gradient(&mut problem.analysis, &density, &designed, &options, &mut Silent).expect("it runs");
        assert_eq!(check.count(Verdict::Right), 2, "friction {friction}: {check:#?}");
    }
}
