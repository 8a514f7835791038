//! Contact if supports prescribe some of the displacements that contact acts on: plane strain with
//! friction, prescribed slip, slave nodes held along the surface, bodies held only by contact, and
//! gaps that nothing can close.

use crate::common::*;
use nalgebra::{Rotation3, Vector3};
use slipstick::analysis::Forward;
use slipstick::build::Problem;

/// Lagrange, augmented with default settings, and augmented with Uzawa's plain iteration.
const MULTIPLIERS: [(&str, &str); 3] = [
    ("Lagrange", "{ lagrange = {} }"),
    ("augmented", "{ augmented = { tolerance = 1e-10 } }"),
    ("plain Uzawa", "{ augmented = { tolerance = 1e-10, max_uzawa = 2000, stiffness = 40, acceleration = 0 } }"),
];

/// A block pressed onto a slab and dragged along it, in plane strain: z is prescribed at all nodes.
#[derive(Clone)]
struct Strip {
    enforcement: String,
    shape: &'static str,
    /// Elements of block and slab along x.
    elements: [usize; 2],
    /// Waypoints of the block's z and of its top's x and y.
    aside: &'static str,
    drag: String,
    place: String,
    /// Components of the slab that are held on both of its faces across z.
    slab: &'static str,
    more: String,
    steps: usize,
}

impl Default for Strip {
    fn default() -> Self {
        Self {
            enforcement: MULTIPLIERS[0].1.into(),
            shape: "standard",
            elements: [4, 9],
            aside: "[]",
            drag: "[{ t = 0.5, u = [0, -0.05, 0] }, { t = 1, u = [0.2, -0.05, 0] }]".into(),
            place: "{}".into(),
            slab: "['z']",
            more: String::new(),
            steps: 10,
        }
    }
}

impl Strip {
    fn text(&self) -> String {
        let Self { enforcement, shape, elements: [a, b], aside, drag, place, slab, more, steps } = self;
        let material = "material = { neo_hooke = { youngs_modulus = 1, poisson_ratio = 0.2 } }";
        let layers = if *a == 4 { 3 } else { 1 };
        let held = |body: &str, components: &str, motion: &str| {
            let faces = ["zmin", "zmax"].map(|face| {
                format!("[[dirichlet]]\nset = '{body}_{face}'\ncomponents = {components}\nmotion = {motion}\n")
            });
            if components == "[]" { String::new() } else { faces.concat() }
        };
        let (block, slab) = (held("a", "['z']", aside), held("b", slab, "[]"));
        format!(
            r#"
[[body]]
name = 'a'
box = {{ min = [0, 0, 0], max = [1, 1, 0.1], elements = [{a}, {a}, 1] }}
place = {place}
{material}
[[body]]
name = 'b'
box = {{ min = [-1, -1, 0], max = [2, 0, 0.1], elements = [{b}, {layers}, 1] }}
place = {place}
{material}
[[contact]]
slave = 'a_ymin'
master = 'b_ymax'
friction = 0.3
multiplier_shape = '{shape}'
enforcement = {enforcement}
{block}{slab}
[[dirichlet]]
set = 'b_ymin'
[[dirichlet]]
set = 'a_ymax'
components = ['x', 'y']
motion = {drag}
{more}
[load_path]
steps = {steps}
tolerance = {{ relative = 1e-11 }}
"#
        )
    }
}

/// Resultant contact force on the slave, and the sums of the supports' reactions on each body.
struct Forces {
    contact: Vector3<f64>,
    reactions: [Vector3<f64>; 2],
}

fn forces(problem: &mut Problem, run: &Forward) -> Forces {
    let states: Vec<_> = run.path.states.iter().map(|at| at.state.clone()).collect();
    let [.., before, last] = &states[..] else { panic!("a path") };
    let results = problem.analysis.design.contact_results(before, last, 1.0.into()).unwrap();
    let d = &last.unknowns[..3 * problem.mesh.nodes.len()];
    let mut force = vec![0.0; d.len()];
    problem.analysis.design.internal_force(d, (0.0.into(), &[]), &mut force).unwrap();
    let mut outer = vec![0.0; d.len()];
    problem.analysis.design.external_force(d, run.path.states.last().unwrap().time, &mut outer);
    // forces that supports exert in addition to contact and loads, by equilibrium
    for ((force, contact), outer) in force.iter_mut().zip(&results.force).zip(&outer) {
        *force -= contact + outer;
    }
    let fixed = problem.analysis.model().prescribed().fixed();
    let size = norm(&results.force);
    let free: f64 = (0..force.len()).filter(|&i| !fixed[i]).map(|i| force[i].powi(2)).sum::<f64>().sqrt();
    assert!(free < 1e-6 * size, "equilibrium is off by {:e}", free / size);
    let total = |values: &[f64], body: usize| -> Vector3<f64> {
        problem.mesh.bodies[body].nodes.clone().map(|n| Vector3::from_column_slice(&values[3 * n..][..3])).sum()
    };
    Forces { contact: total(&results.force, 0), reactions: [0, 1].map(|body| total(&force, body)) }
}

/// The forces at the last state. The supports of each body carry its contact force, and those of
/// both bodies balance each other.
fn solve(text: &str) -> Forces {
    let mut problem = problem(text);
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let statuses = status_path(&mut problem, &run);
    let forces = forces(&mut problem, &run);
    if !text.contains("[[load]]") {
        let size = forces.contact.norm();
        let [block, slab] = forces.reactions;
        assert!((block + forces.contact).norm() < 1e-10 * size, "{block:?} {:?}", forces.contact);
        assert!((block + slab).norm() < 1e-10 * size, "{block:?} {slab:?}");
    }
    println!("  force {:?}, {}", forces.contact.as_slice(), statuses.last().unwrap());
    forces
}

fn same(name: &str, found: Vector3<f64>, expected: Vector3<f64>, bound: f64) {
    let error = (found - expected).norm() / expected.norm();
    assert!(error < bound, "{name}: {:?} deviates from {:?} by {error:e}", found.as_slice(), expected.as_slice());
}

/// The strip with all methods and shapes; the augmented Lagrangian agrees with Lagrange
/// multipliers. Returns the force of standard and dual shapes.
fn methods_agree(name: &str, strip: &Strip) -> [Vector3<f64>; 2] {
    ["standard", "dual"].map(|shape| {
        let force = |(method, enforcement): (&str, &str)| {
            println!("{name}, {method}, {shape}");
            solve(&Strip { enforcement: enforcement.into(), shape, ..strip.clone() }.text()).contact
        };
        let lagrange = force(MULTIPLIERS[0]);
        // the plain iteration takes hundreds of solves per step: one shape is enough
        let others = if shape == "standard" { &MULTIPLIERS[1..] } else { &MULTIPLIERS[1..2] };
        for &other in others {
            same(&format!("{name} {shape}: {}", other.0), force(other), lagrange, 1e-8);
        }
        lagrange
    })
}

/// Stiffnesses of the penalty method.
const STIFF: [f64; 3] = [1e3, 2e3, 1e4];

/// The penalty method tends to `limit` as 1/ε, with an order within `bound` of 1; returns the force
/// for the largest stiffness.
fn penalty_tends_to(name: &str, strip: &Strip, limit: Vector3<f64>, stiffness: [f64; 3], bound: f64) -> Vector3<f64> {
    let forces = stiffness.map(|stiffness: f64| {
        let enforcement = format!("{{ penalty = {{ stiffness = {stiffness:?} }} }}");
        println!("{name}, penalty {stiffness}");
        solve(&Strip { enforcement, ..strip.clone() }.text()).contact
    });
    let errors = forces.map(|force| (force - limit).norm() / limit.norm());
    println!("  off by {errors:?}");
    let order = |k: usize| (errors[k] / errors[k + 1]).ln() / (stiffness[k + 1] / stiffness[k]).ln();
    let orders = [order(0), order(1)];
    assert!(orders.iter().all(|order| (order - 1.0).abs() < bound), "{name}: orders {orders:?} of {errors:?}");
    forces[2]
}

/// Numbers of an earlier version, on which all four ways agree: a regression test.
#[test]
fn plane_strain_with_friction() {
    let strip = Strip::default();
    let [standard, dual] = methods_agree("plane strain", &strip);
    same("standard", standard, Vector3::new(-9.488e-4, 3.2147e-3, 0.0), 2e-5);
    same("dual", dual, Vector3::new(-9.478e-4, 3.2211e-3, 0.0), 2e-5);
    let stiff = penalty_tends_to("plane strain", &strip, standard, STIFF, 0.05);
    same("penalty", stiff, Vector3::new(-9.486e-4, 3.2143e-3, 0.0), 2e-5);
    // the friction cone, because everything slides
    let ratio = -standard[0] / standard[1];
    assert!(ratio > 0.29 && ratio < 0.3, "{ratio}");
}

/// The block also slides across, as prescribed: friction has a component along z, which only the
/// supports carry.
#[test]
fn prescribed_sideways_slip() {
    let strip = Strip { aside: "[{ t = 0.5, u = [0, 0, 0] }, { t = 1, u = [0, 0, 0.02] }]", ..Strip::default() };
    let [standard, dual] = methods_agree("sideways", &strip);
    for force in [standard, dual] {
        assert!(force[2] < -5e-5, "{force:?}");
        let ratio = force[0].hypot(force[2]) / force[1];
        assert!(ratio > 0.28 && ratio < 0.3, "{ratio}");
    }
    // a node is about to open: in longer steps, and with stiffer penalties, it chatters, steps are cut in
    // two, and the path of friction is different
    let fine = Strip { steps: 40, ..strip };
    let limit = solve(&fine.text()).contact;
    penalty_tends_to("sideways", &fine, limit, [1e3, 2e3, 4e3], 0.2);
}

/// Slave nodes held or driven along the surface, so only their gaps are free.
#[test]
fn slave_nodes_held_along_the_surface() {
    let along = |motion: &str| format!("[[dirichlet]]\nset = 'a_ymin'\ncomponents = ['x']\nmotion = {motion}\n");
    let drag = "[{ t = 1, u = [0, -0.05, 0] }]".into();
    let strip = Strip { drag, more: along("[]"), ..Strip::default() };
    for force in methods_agree("held", &strip) {
        assert!(force[0].abs() < 1e-10 * force[1], "symmetric: {force:?}");
    }
    let strip = Strip { more: along("[{ t = 0.5, u = [0, 0, 0] }, { t = 1, u = [0.2, 0, 0] }]"), ..Strip::default() };
    let [standard, _] = methods_agree("driven", &strip);
    penalty_tends_to("driven", &strip, standard, STIFF, 0.05);
}

/// Only the block is prescribed along z; the slab is free, so friction along z is again an unknown.
#[test]
fn a_master_free_along_z() {
    let strip = Strip { slab: "[]", ..Strip::default() };
    let [standard, dual] = methods_agree("free", &strip);
    for force in [standard, dual] {
        assert!(force[2].abs() < 1e-9 * force[1], "{force:?}");
    }
    penalty_tends_to("free", &strip, standard, STIFF, 0.05);
}

/// If the scene is rotated about z by an angle that matches no axis, the forces rotate as well; if
/// x, y, z are renamed, so are they.
#[test]
fn turned_plane_strain_is_the_same() {
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), 35f64.to_radians());
    let point = |u: [f64; 3]| (turn * Vector3::from(u)).as_slice().to_vec();
    let (pressed, dragged) = (point([0.0, -0.05, 0.0]), point([0.2, -0.05, 0.0]));
    for aside in ["[]", "[{ t = 0.5, u = [0, 0, 0] }, { t = 1, u = [0, 0, 0.02] }]"] {
        let strip = Strip { aside, ..Strip::default() };
        let turned = Strip {
            place: "{ rotate = { axis = [0, 0, 1], degrees = 35 } }".into(),
            drag: format!("[{{ t = 0.5, u = {pressed:?} }}, {{ t = 1, u = {dragged:?} }}]"),
            ..strip.clone()
        };
        for enforcement in [MULTIPLIERS[0].1, "{ penalty = { stiffness = 100 } }"] {
            let text = |strip: &Strip| Strip { enforcement: enforcement.into(), ..strip.clone() }.text();
            let straight = solve(&text(&strip)).contact;
            same("turned", solve(&text(&turned)).contact, turn * straight, 1e-9);
            // the axes x, y, z are the old z, x, y
            let renamed = solve(&renamed(&text(&strip))).contact;
            same("renamed", renamed, Vector3::new(straight[2], straight[0], straight[1]), 1e-9);
        }
    }
}

/// The case with x, y, z called y, z, x.
fn renamed(text: &str) -> String {
    let names: String = text.replace("xm", "\u{1}m").replace("'x'", "'\u{1}'");
    let names = names.replace("zm", "xm").replace("'z'", "'x'").replace("ym", "zm").replace("'y'", "'z'");
    let names = names.replace("\u{1}m", "ym").replace("'\u{1}'", "'y'");
    let mut out = String::new();
    let mut rest = names.as_str();
    while let Some(start) = rest.find('[') {
        let end = rest[start..].find(']').map_or(rest.len(), |end| start + end);
        let items: Vec<&str> = rest[start + 1..end].split(',').map(str::trim).collect();
        match items[..] {
            [x, y, z] if items.iter().all(|item| item.parse::<f64>().is_ok()) => {
                out += &format!("{}[{z}, {x}, {y}", &rest[..start]);
                rest = &rest[end..];
            }
            _ => {
                out += &rest[..=start];
                rest = &rest[start + 1..];
            }
        }
    }
    out + rest
}

/// The adjoint gradient against central differences of order 4 in these constraints.
#[test]
fn gradients_under_constraints() {
    let design = "[design]\nbodies = ['a', 'b']\ninitial = 0.5\nsimp = { p = 3, min = 1e-3 }\n[objective]\ncontact_force = { steps = 'last' }\n";
    let along = "[[dirichlet]]\nset = 'a_ymin'\ncomponents = ['x']\nmotion = [{ t = 0.5, u = [0, 0, 0] }, { t = 1, u = [0.2, 0, 0] }]\n";
    let plain = Strip { elements: [2, 6], more: design.into(), ..Strip::default() };
    let aside = "[{ t = 0.5, u = [0, 0, 0] }, { t = 1, u = [0, 0, 0.02] }]";
    let degrees = "{ rotate = { axis = [0, 0, 1], degrees = 35 } }";
    let scenes = [
        ("plane strain", plain.clone()),
        ("sideways", Strip { aside, ..plain.clone() }),
        ("driven", Strip { more: format!("{along}{design}"), ..plain.clone() }),
        ("free", Strip { slab: "[]", ..plain.clone() }),
        (
            "turned",
            Strip {
                place: degrees.into(),
                drag: "[{ t = 0.5, u = [0.03, -0.04, 0] }, { t = 1, u = [0.19, 0.07, 0] }]".into(),
                ..plain.clone()
            },
        ),
    ];
    let methods = ["{ lagrange = {} }", "{ augmented = { tolerance = 1e-11 } }", "{ penalty = { stiffness = 100 } }"];
    for (name, scene) in scenes {
        // the adjoint of the augmented Lagrangian is that of Lagrange multipliers
        let [lagrange, augmented, penalty] = methods;
        for (enforcement, shape) in
            [(lagrange, "standard"), (lagrange, "dual"), (augmented, "standard"), (penalty, "dual")]
        {
            let strip = Strip { enforcement: enforcement.into(), shape, ..scene.clone() };
            let text = strip.text().replace("steps = 10", "steps = 4").replace("relative = 1e-11", "relative = 1e-12");
            let mut problem = problem(&text);
            let density = random_density(&problem, 11);
            let check = check_gradient(&mut problem, &density);
            println!("{name} {enforcement} {shape}: error {:.1e}, {:?}", check.error, check.statuses);
            assert!(check.error < 1e-7, "{name} {enforcement} {shape}: off by {:e}", check.error);
            assert!(check.statuses.last().is_some_and(|last| last.contains(['l', 't'])), "{:?}", check.statuses);
        }
    }
}

/// A body whose supports hold it only along x and z; contact carries its load.
#[test]
fn a_body_held_by_contact_alone() {
    let text = |enforcement: &str| {
        format!(
            r#"
[[body]]
name = 'a'
box = {{ min = [0, 0, 0], max = [1, 1, 1], elements = [2, 2, 2] }}
material = {{ neo_hooke = {{ youngs_modulus = 1, poisson_ratio = 0.2 }} }}
[[body]]
name = 'b'
box = {{ min = [-1, -1, -1], max = [2, 0, 2], elements = [5, 2, 5] }}
material = {{ neo_hooke = {{ youngs_modulus = 1, poisson_ratio = 0.2 }} }}
[[contact]]
slave = 'a_ymin'
master = 'b_ymax'
friction = 0.3
enforcement = {enforcement}
[[dirichlet]]
set = 'b_ymin'
[[dirichlet]]
set = 'a_xmax'
components = ['x']
[[dirichlet]]
set = 'a_zmin'
components = ['z']
[[load]]
surface = 'a_ymax'
pressure = 0.01
[load_path]
steps = 2
tolerance = {{ relative = 1e-11 }}
"#
        )
    };
    let default = "{ augmented = {} }";
    let all = MULTIPLIERS.map(|(name, enforcement)| {
        println!("held by contact, {name}");
        solve(&text(enforcement)).contact
    });
    // pressure over the top, whose area is slightly larger than 1
    assert!(all[0][1] > 0.01 && all[0][1] < 0.0102, "{:?}", all[0]);
    same("augmented", all[1], all[0], 1e-8);
    same("plain Uzawa", all[2], all[0], 1e-8);
    same("augmented, by default", solve(&text(default)).contact, all[0], 1e-5);
}

/// Two cubes, stretched by λ_x and λ_z together with their touching surfaces, whose area grows by
/// λ_x λ_z, and pressed together. With ε over the reference area the pressure is ε λ_x λ_z times
/// the depth, over the current area ε times the depth.
///
/// The depth solves 2 λ_y − g = 2 − δ with P(λ_y) = −λ_x λ_z ζ and P = 2c (λ_y − J^(−2β)/λ_y) of
/// the neo-Hookean law.
#[test]
fn penalty_over_the_reference_area() {
    let (x, z, pressed, stiffness) = (1.2, 0.9, 0.3, 4.0);
    let (modulus, ratio) = (1.0, 0.2);
    let (c, beta) = (modulus / (4.0 * (1.0 + ratio)), ratio / (1.0 - 2.0 * ratio));
    let mut forces = Vec::new();
    for (scaling, factor) in [("area", 1.0), ("reference_area", x * z)] {
        let mut text = format!(
            "[[contact]]\nslave = 'a_ymin'\nmaster = 'b_ymax'\nfriction = 0\nenforcement = {{ penalty = {{ stiffness = {stiffness:?}, scaling = '{scaling}' }} }}\n\
             [[dirichlet]]\nset = 'b_ymin'\ncomponents = ['y']\n\
             [[dirichlet]]\nset = 'a_ymax'\ncomponents = ['y']\nmotion = [{{ t = 1, u = [0, -{pressed:?}, 0] }}]\n\
             [load_path]\nsteps = 3\ntolerance = {{ relative = 1e-12 }}\n"
        );
        for (body, elements, low) in [("a", [2, 1, 2], 0.0), ("b", [3, 2, 1], -1.0)] {
            text += &format!(
                "[[body]]\nname = '{body}'\nbox = {{ min = [0, {low:?}, 0], max = [1, {:?}, 1], elements = {elements:?} }}\n\
                 material = {{ neo_hooke = {{ youngs_modulus = {modulus:?}, poisson_ratio = {ratio:?} }} }}\n",
                low + 1.0
            );
            for (axis, u) in [("x", [x - 1.0, 0.0, 0.0]), ("z", [0.0, 0.0, z - 1.0])] {
                text += &format!(
                    "[[dirichlet]]\nset = '{body}_{axis}min'\ncomponents = ['{axis}']\n\
                     [[dirichlet]]\nset = '{body}_{axis}max'\ncomponents = ['{axis}']\nmotion = [{{ t = 1, u = {u:?} }}]\n"
                );
            }
        }
        // bisection for λ_y: compression grows with the depth
        let depth = |y: f64| 2.0 * y - (2.0 - pressed);
        let traction = |y: f64| stiffness * factor * depth(y);
        let excess = |y: f64| 2.0 * c * (y - (x * y * z).powf(-2.0 * beta) / y) + x * z * traction(y);
        let (mut low, mut high) = (0.5 * (2.0 - pressed), 1.0);
        assert!(excess(low) < 0.0 && excess(high) > 0.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if excess(middle) < 0.0 { low = middle } else { high = middle }
        }
        let mut problem = problem(&text);
        let density = problem.initial_density().clone();
        let run = forward(&mut problem, &density);
        let nodes = contact_path(&mut problem, &run).pop().expect("a state");
        let force: f64 = nodes.iter().map(|at| at.multiplier[0] * at.covered_area).sum();
        for at in &nodes {
            let gap = at.gap.expect("covered");
            assert!((at.multiplier[0] + stiffness * factor * gap).abs() < 1e-10, "{scaling}: {at:?}");
            assert!((gap + depth(low)).abs() < 1e-9, "{scaling}: {gap} instead of {}", -depth(low));
        }
        let expected = x * z * traction(low);
        println!("{scaling}: force {force:.9}, exact {expected:.9}");
        assert!((force - expected).abs() < 1e-9, "{force} {expected}");
        forces.push(force);
    }
    assert!(forces[1] > 1.01 * forces[0], "{forces:?}");
}
