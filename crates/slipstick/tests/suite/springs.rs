//! Springs to the ground and between nodes: analytic displacements, forces and energies, bodies that only
//! springs hold, and gradients.

use crate::common::scene::{LAGRANGE, Scene, augmented, penalty};
use crate::common::*;
use crate::quantity_gradients::check;
use slipstick::analysis::Forward;
use slipstick::build::{Problem, build};
use slipstick::case::parse_case;
use slipstick::check::inspect;
use slipstick::quantities::quantities;

/// A bar of length 4 and cross-section 1 × 1 without lateral contraction, E A/L = 25.
fn bar(name: &str, from: f64) -> String {
    format!(
        "[[body]]\nname = '{name}'\nbox = {{ min = [{from:?}, 0, 0], max = [{:?}, 1, 1], elements = [3, 2, 1] }}\n\
         material = {{ linear_elastic = {{ youngs_modulus = 100, poisson_ratio = 0 }} }}\n",
        from + 4.0
    )
}

const PATH: &str = "[load_path]\nsteps = 2\ntolerance = { relative = 1e-12 }\n";

fn solved(text: &str) -> (Problem, Forward) {
    let mut problem = problem(text);
    let density = problem.initial_density().clone();
    let forward = forward(&mut problem, &density);
    (problem, forward)
}

/// Displacement of the first node of a set at the end of the path.
fn moved(problem: &Problem, forward: &Forward, set: &str) -> [f64; 3] {
    let node = 3 * problem.mesh.set_nodes(set).unwrap()[0] as usize;
    let d = &forward.path.states.last().unwrap().state.unknowns;
    [d[node], d[node + 1], d[node + 2]]
}

/// A quantity at the end of the path.
fn last(problem: &Problem, forward: &Forward, name: &str) -> f64 {
    *quantities(problem, &forward.path).get(name).expect(name).last().unwrap()
}

fn near(value: f64, expected: f64, bound: f64) {
    assert!((value - expected).abs() <= bound * expected.abs().max(1.0), "{value} instead of {expected}");
}

/// A bar and a spring in parallel, u = F/(E A/L + k): the spring is given by its stiffness or per area, along
/// an axis or in all directions, as many springs at the nodes, and along a line that does not turn. The work
/// of the load is stored in bar and spring.
#[test]
fn a_bar_against_a_spring() {
    let force = "[[dirichlet]]\nset = 'bar_xmin'\n[[load]]\nsurface = 'bar_xmax'\nforce = [3, 0, 0]\n";
    let quantity = "[[quantity]]\nname = 'push'\nspring_force = { spring = 'end', component = 'x' }\n";
    for spring in [
        "stiffness = 5\ndirection = [2, 0, 0]",
        "stiffness_per_area = 5\ndirection = [1, 0, 0]",
        "stiffness = 5",
        "stiffness = 5\nto = [9, 0.5, 0.5]\ndirection = [-1, 0, 0]",
    ] {
        let text =
            format!("{}{force}[[spring]]\nname = 'end'\nset = 'bar_xmax'\n{spring}\n{quantity}{PATH}", bar("bar", 0.0));
        let (problem, forward) = solved(&text);
        let u = moved(&problem, &forward, "bar_xmax");
        near(u[0], 0.1, 1e-12);
        near(u[1], 0.0, 1e-12);
        near(last(&problem, &forward, "push"), -0.5, 1e-12);
        near(last(&problem, &forward, "spring_energy"), 0.5 * 5.0 * 0.01, 1e-12);
        near(last(&problem, &forward, "strain_energy"), 0.5 * 25.0 * 0.01, 1e-12);
        near(last(&problem, &forward, "energy_balance"), 0.0, 1e-12);
        near(last(&problem, &forward, "reaction_bar_xmin_x"), -2.5, 1e-12);
    }
}

/// Springs between the nodes of two faces: bar, springs and bar in series, u = F/25 + F/k + F/25. Six nodes
/// have a twelfth or a sixth of the area.
#[test]
fn two_bars_joined_by_springs() {
    let text = format!(
        "{}{}[[dirichlet]]\nset = 'left_xmin'\n[[load]]\nsurface = 'right_xmax'\nforce = [3, 0, 0]\n\
         [[spring]]\nname = 'joint'\nset = 'right_xmin'\nto = 'left_xmax'\nstiffness = 6\n{PATH}",
        bar("left", 0.0),
        bar("right", 4.5)
    );
    let (problem, forward) = solved(&text);
    near(moved(&problem, &forward, "right_xmax")[0], 3.0 / 25.0 + 3.0 / 6.0 + 3.0 / 25.0, 1e-11);
    near(last(&problem, &forward, "spring_energy"), 0.5 * 9.0 / 6.0, 1e-11);
    near(last(&problem, &forward, "energy_balance"), 0.0, 1e-11);
}

/// A block and a rigid body that nothing but springs to the ground holds. Springs of the nodes add up.
#[test]
fn bodies_that_only_springs_hold() {
    let text = format!(
        "{}[[body]]\nname = 'tool'\nbox = {{ min = [0, 3, 0], max = [1, 4, 1], elements = [1, 1, 1] }}\nrigid = {{}}\n\
         [[load]]\nsurface = 'bar_xmax'\nforce = [3, 0, 0]\n[[load]]\nsurface = 'tool'\nforce = [0, 3, 0]\n\
         [[spring]]\nname = 'foot'\nset = 'bar_xmin'\nnodal_stiffness = 1\n\
         [[spring]]\nname = 'hung'\nset = 'tool_ymax'\nstiffness_per_area = 12\n{PATH}\
         [[set]]\nname = 'feet'\nwithin = 'bar_xmin'\n[[quantity]]\nname = 'foot'\n\
         displacement = {{ set = 'feet', component = 'x' }}\n[[quantity]]\nname = 'push'\n\
         spring_force = {{ spring = 'foot', component = 'x' }}\n",
        bar("bar", 0.0)
    );
    let (mut problem, forward) = solved(&text);
    let inspection = inspect(&parse_case(&text, "case.toml").unwrap().case, &mut problem).unwrap();
    assert_eq!(inspection.notices, [], "springs hold both bodies");
    near(last(&problem, &forward, "foot"), 3.0 / 6.0, 1e-9);
    near(last(&problem, &forward, "push"), -3.0, 1e-9);
    near(moved(&problem, &forward, "tool_ymin")[1], 3.0 / 12.0, 1e-9);
}

/// A rigid body on a spring of length 3 that turns with it. Moved sideways by 2, it rises until the spring is
/// relaxed: by 3 − √5. Under a force of 1 downwards, it is where the bisection below finds equilibrium.
#[test]
fn a_spring_along_a_line_turns() {
    let scene = |load: &str| {
        format!(
            "{}[[body]]\nname = 'tool'\nbox = {{ min = [-1, 2, 0], max = [1, 4, 1], elements = [1, 1, 1] }}\n\
             rigid = {{ reference = [0, 3, 0] }}\n[[dirichlet]]\nset = 'bar_xmin'\n\
             [[dirichlet]]\nset = 'tool'\ncomponents = ['x', 'z', 'rx', 'ry', 'rz']\n\
             motion = [{{ t = 1, u = [2, 0, 0] }}]\n\
             [[spring]]\nname = 'rope'\nset = 'tool'\nto = [0, 6, 0]\ndirection = 'line'\nstiffness = 10\n{load}\
             [load_path]\nsteps = 4\ntolerance = {{ relative = 1e-12 }}\n",
            bar("bar", -9.0)
        )
    };
    let (problem, forward) = solved(&scene(""));
    near(moved(&problem, &forward, "tool_ymin")[1], 3.0 - f64::sqrt(5.0), 1e-10);
    let (problem, forward) = solved(&scene("[[load]]\nsurface = 'tool'\nforce = [0, -1, 0]\n"));
    let pull = |u: f64| {
        let length = f64::hypot(2.0, 3.0 - u);
        10.0 * (length - 3.0) * (3.0 - u) / length
    };
    let (mut low, mut high) = (-1.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if pull(middle) > 1.0 { low = middle } else { high = middle }
    }
    near(moved(&problem, &forward, "tool_ymin")[1], low, 1e-10);
}

/// The gradients of all quantities, the forces of springs included, by finite differences: springs of all
/// kinds on bodies in contact.
#[test]
fn quantities_with_springs_match_finite_differences() {
    let more = "[[load]]\nsurface = 'slab_xmax'\ntraction = [5.0, 4.0, -2.0]\n\
                [[spring]]\nname = 'foundation'\nset = 'slab_xmin'\nstiffness_per_area = 60\n\
                [[spring]]\nname = 'joint'\nset = 'block_zmax'\nto = 'slab_zmax'\ndirection = 'line'\nstiffness = 40\n\
                [[spring]]\nname = 'slanted'\nset = 'slab_xmax'\ndirection = [1, -1, 0.5]\nnodal_stiffness = 20\n\
                [[spring]]\nname = 'bound'\nset = 'block_ymin'\nto = 'slab_ymax'\nstiffness = 30\n";
    let methods = [("Lagrange", LAGRANGE.into()), ("penalty", penalty(2e4)), ("augmented", augmented(1e4, 1e-11))];
    for (method, enforcement) in methods {
        let scene = Scene {
            slab: [3, 1, 1],
            block: [1, 1, 1],
            friction: 0.35,
            motion: "[{ t = 0.4, u = [0, -0.1, 0] }, { t = 1.0, u = [0.1, -0.12, 0.03], angle = 3 }]".into(),
            drive: "rotation = { point = [1.0, 1.8, 0.5], direction = [0.2, 0, 1] }".into(),
            steps: 5,
            more: more.into(),
            enforcement,
            ..Scene::default()
        };
        let errors = check(&format!("springs {method}"), &mut problem(&scene.text()), 3, &[1.0]);
        assert_eq!(errors.iter().filter(|(name, _)| name.contains("force of `")).count(), 4);
    }
}

/// The driving force of a rigid body with springs at its reference point and at its nodes: its gradient by
/// central differences of order 4.
#[test]
fn the_reaction_of_a_sprung_rigid_body_matches_finite_differences() {
    let text = format!(
        "{}[[body]]\nname = 'tool'\nbox = {{ min = [4, -1, -1], max = [5, 2, 2], elements = [1, 1, 1] }}\nrigid = {{}}\n\
         [[contact]]\nslave = 'bar_xmax'\nmaster = 'tool_xmin'\nfriction = 0.3\n\
         [[dirichlet]]\nset = 'bar_xmin'\n[[dirichlet]]\nset = 'tool'\ncomponents = ['x', 'y', 'rx', 'ry', 'rz']\n\
         motion = [{{ t = 1, u = [-0.3, 0, 0] }}]\n[[load]]\nsurface = 'tool'\nforce = [0, 0, 0.5]\n\
         [[spring]]\nname = 'rope'\nset = 'tool'\nto = [9, 4, 2]\ndirection = 'line'\nstiffness = 10\n\
         [[spring]]\nname = 'bed'\nset = 'tool_ymin'\nstiffness_per_area = 3\n{PATH}\
         [design]\nbodies = ['bar']\ninitial = 0.6\n[[quantity]]\nname = 'drive'\n\
         reaction = {{ set = 'tool', component = [1, 0.4, 0] }}\n[objective]\nminimise = {{ quantity = 'drive' }}\n",
        bar("bar", 0.0).replace("linear_elastic", "neo_hooke").replace("poisson_ratio = 0", "poisson_ratio = 0.3")
    );
    let mut problem = problem(&text);
    let density = random_density(&problem, 4);
    let base = forward(&mut problem, &density);
    let gradient = problem.analysis.gradient(&base).unwrap();
    let direction = Random::new(9).vector(density.len(), 1.0);
    let mut at = |shift: f64| {
        let mut moved = density.clone();
        designed(&problem).into_iter().for_each(|e| moved[e] += shift * direction[e]);
        forward(&mut problem, &moved).value
    };
    let h = 1e-3;
    let difference = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
    let along: f64 = gradient.iter().zip(&direction).map(|(g, v)| g * v).sum();
    assert!((along / difference - 1.0).abs() < 1e-7, "{along} {difference}");
}

/// Springs that make no sense are refused, with their place.
#[test]
fn useless_springs_are_refused() {
    let of = |spring: &str| {
        let text = format!(
            "{}[[dirichlet]]\nset = 'bar_xmin'\n[[spring]]\nname = 'end'\nset = 'bar_xmax'\n{spring}\n{PATH}",
            bar("bar", 0.0)
        );
        match parse_case(&text, "case.toml") {
            Err(errors) => errors.to_string(),
            Ok(resolved) => build(&resolved.case).err().map_or(String::new(), |error| error.to_string()),
        }
    };
    assert_eq!(of("stiffness = 1"), "");
    for (spring, message) in [
        ("", "the stiffness is missing"),
        ("stiffness = -1", "must be greater than zero"),
        ("stiffness = 1\ndirection = 'line'", "no line that it could follow"),
        ("stiffness = 1\ndirection = [0, 0, 0]", "zero vector"),
        ("stiffness = 1\nto = 'bar_xmax'", "belongs to both ends"),
        ("stiffness = 1\nto = [4, 0, 0]\ndirection = 'line'", "no line joins them"),
        ("stiffness = 1\nto = 'bar'", "there is no surface or set called `bar`"),
    ] {
        assert!(of(spring).contains(message), "{spring}: {}", of(spring));
    }
}
