//! Gravity and rotation: resultants, bodies whose deformation is known, energy, derivatives of whole paths.

use crate::common::scene::*;
use crate::common::*;
use crate::solved::{Scene as Case, Solved};
use slipstick::analysis::Forward;
use slipstick::build::Problem;
use slipstick::quantities::quantities;
use slipstick_mesh::{BoxShape, Mesh, box_mesh};

/// A box of 2 × 1 × 3 with each type of elements.
fn meshes() -> Vec<(&'static str, Mesh)> {
    let shape = BoxShape { min: [0.0; 3], max: [2.0, 1.0, 3.0], elements: [2, 1, 2], grading: [1.0; 3] };
    let hex8 = box_mesh("bar", &shape).unwrap();
    let (tet4, wedge6) = (hex8.divided(|_| true), hex8.divided_into_wedges(|_| Some(1)));
    let middle = |of: &[[f64; 3]]| std::array::from_fn(|c| of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64);
    let (hex27, tet10) = (hex8.second_order(middle).unwrap(), tet4.second_order(middle).unwrap());
    let wedge18 = wedge6.second_order(middle).unwrap();
    let quadratic = [("hex27", hex27), ("tet10", tet10), ("wedge18", wedge18)];
    [("hex8", hex8), ("wedge6", wedge6), ("tet4", tet4)].into_iter().chain(quadratic).collect()
}

/// A quantity at the end.
fn last(problem: &Problem, forward: &Forward, name: &str) -> f64 {
    let quantities = quantities(problem, &forward.path);
    *quantities.get(name).expect("a column").last().expect("a step")
}

/// The support carries m g in every direction, with m = ρ Σ φ^q V; mass 42 if solid.
#[test]
fn the_support_carries_the_weight() {
    for (name, mesh) in meshes() {
        for power in [1.0, 2.5] {
            let text = format!(
                "[[body]]\nname = 'bar'\nmesh = {{ file = 'bar' }}\nmass_density = 7.0\n\
                 material = {{ neo_hooke = {{ youngs_modulus = 4000.0, poisson_ratio = 0.3 }} }}\n\
                 [[dirichlet]]\nset = 'bar_ymin'\n[[load]]\ngravity = [3, -9.81, 1]\n\
                 [load_path]\nsteps = 2\ntolerance = {{ relative = 1e-12 }}\n\
                 [design]\nbodies = ['bar']\ninitial = 0.5\nmass_p = {power:?}\n\
                 [[quantity]]\nname = 'mass'\nmass = {{}}\n\
                 [[quantity]]\nname = 'x'\nreaction = {{ set = 'bar_ymin', component = 'x' }}\n\
                 [[quantity]]\nname = 'y'\nreaction = {{ set = 'bar_ymin', component = 'y' }}\n\
                 [[quantity]]\nname = 'z'\nreaction = {{ set = 'bar_ymin', component = 'z' }}\n\
                 [objective]\nminimise = {{ quantity = 'y' }}\n"
            );
            let mut problem = problem_with(&text, &[("bar", mesh.clone())]);
            let density = random_density(&problem, 3);
            let forward = forward(&mut problem, &density);
            let volumes = problem.mesh.element_volumes();
            let mass_of = |q: f64| 7.0 * volumes.iter().zip(density.iter()).map(|(v, d)| v * d.powf(q)).sum::<f64>();
            let last = |name: &str| last(&problem, &forward, name);
            let near = |found: f64, expected: f64| {
                assert!((found / expected - 1.0).abs() < 1e-10, "{name}, {power}: {found} instead of {expected}");
            };
            near(last("mass"), mass_of(1.0));
            for (component, g) in [("x", 3.0), ("y", -9.81), ("z", 1.0)] {
                near(last(component), -g * mass_of(power));
            }
        }
    }
}

/// A bar along x from 0 to 2 without lateral strain, held at x = 0.
fn bar(order: usize, elements: usize, load: &str) -> String {
    format!(
        "[[body]]\nname = 'bar'\norder = {order}\nmass_density = 3.0\n\
         box = {{ min = [0, 0, 0], max = [2, 0.5, 0.5], elements = [{elements}, 1, 1] }}\n\
         material = {{ linear_elastic = {{ youngs_modulus = 1000.0, poisson_ratio = 0.0 }} }}\n\
         [[dirichlet]]\nset = 'bar_xmin'\ncomponents = ['x']\n\
         [[dirichlet]]\nset = 'bar_ymin'\ncomponents = ['y']\n[[dirichlet]]\nset = 'bar_ymax'\ncomponents = ['y']\n\
         [[dirichlet]]\nset = 'bar_zmin'\ncomponents = ['z']\n[[dirichlet]]\nset = 'bar_zmax'\ncomponents = ['z']\n\
         [[load]]\n{load}\n[load_path]\nsteps = 2\ntolerance = {{ relative = 1e-13 }}\n"
    )
}

/// Extension of the bar.
fn extension(text: String) -> f64 {
    let Solved { problem, forward } = Case::from(text).solve();
    let node = problem.mesh.surfaces["bar_xmax"].nodes()[0] as usize;
    forward.path.states.last().unwrap().state.unknowns[3 * node]
}

/// A hanging bar is longer by ρ g L²/(2E), and its energy is the work of its weight; linear elements are exact at
/// their nodes.
#[test]
fn a_hanging_bar() {
    let expected = 3.0 * 9.81 * 4.0 / 2000.0;
    for order in [1, 2] {
        let text = bar(order, 3, "gravity = [9.81, 0, 0]");
        let found = extension(text.clone());
        assert!((found / expected - 1.0).abs() < 1e-11, "{order}: {found} instead of {expected}");
        let Solved { problem, forward } = Case::from(text).solve();
        let [work, energy] = ["external_work", "strain_energy"].map(|name| last(&problem, &forward, name));
        // ∫ σ²/2E = (ρ g)² L³ A/(6E), to which quadratic elements come up exactly
        let exact = (3.0 * 9.81f64).powi(2) * 8.0 * 0.25 / 6000.0;
        assert!((work / energy - 1.0).abs() < 1e-11, "{work} {energy}");
        assert!(order == 1 || (energy / exact - 1.0).abs() < 1e-11, "{energy} instead of {exact}");
    }
}

/// In a rotating bar the force grows with the displacement: E u″ = −ρ ω² (x + u), so that the end lies at
/// tan(kL)/k, k² = ρ ω²/E. On the undeformed bar the extension would be a third smaller.
#[test]
fn a_rotating_bar() {
    let load = "centrifugal = { point = [0, 0.3, 5], direction = [0, 0, -2], angular_velocity = 9 }";
    let k = (3.0 * 81.0 / 1000.0f64).sqrt();
    let expected = (2.0 * k).tan() / k - 2.0;
    let found = [2, 4].map(|elements| (extension(bar(2, elements, load)) / expected - 1.0).abs());
    // order four: the end of a bar of quadratic elements
    assert!(found[1] < 3e-5 && found[1] < found[0] / 14.0, "{found:?}");
    let reference = 3.0 * 81.0 * 8.0 / 3000.0;
    assert!(expected > 1.5 * reference, "{expected} {reference}");
}

/// A thin disc with a hole that rotates slowly: the displacement of the hole's edge, a/E times the hoop stress
/// ρω²/4 [(3 + ν) b² + (1 − ν) a²] (Timoshenko, Goodier, Theory of Elasticity, art. 32).
#[test]
fn a_rotating_disc() {
    let text = "
[[body]]
name = 'disc'
order = 2
mass_density = 2.0
hollow_cylinder = { inner_radius = 1, outer_radius = 3, height = 0.05, elements = [4, 24, 1] }
material = { linear_elastic = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[dirichlet]]
set = 'disc_bottom'
components = ['y']
[[set]]
name = 'x'
boxes = [{ min = [-0.001, -1, -4], max = [0.001, 1, 4] }]
[[set]]
name = 'z'
boxes = [{ min = [-4, -1, -0.001], max = [4, 1, 0.001] }]
[[dirichlet]]
set = 'x'
components = ['x']
[[dirichlet]]
set = 'z'
components = ['z']
[[load]]
body = 'disc'
centrifugal = { point = [0, 7, 0], direction = [0, 1, 0], angular_velocity = 0.01 }
[load_path]
steps = 1
";
    let solved = Case::from(text.to_owned()).solve();
    let (a, b, nu) = (1.0, 3.0, 0.3);
    let expected = a / 1000.0 * 2.0 * 1e-4 / 4.0 * ((3.0 + nu) * b * b + (1.0 - nu) * a * a);
    for node in solved.problem.mesh.surfaces["disc_inner"].nodes() {
        let [x, _, z] = solved.problem.mesh.nodes[node as usize];
        let d = solved.displacement(node, 1);
        let found = (x * d.x + z * d.z) / x.hypot(z);
        assert!((found / expected - 1.0).abs() < 1e-3, "{found} instead of {expected}");
    }
}

/// Gravity that rises and falls, and a rotation of the slab alone, on a block that slides.
const FIELDS: &str = "
[[load]]
gravity = [2.0, -6.0, 1.0]
amplitude = [{ t = 0.4, factor = 1.0 }, { t = 0.9, factor = -0.5 }]
[[load]]
body = 'slab'
centrifugal = { point = [-3, 2, 1], direction = [1, 2, -2], angular_velocity = 1.5 }
";

#[test]
fn gradients_of_bodies_with_mass() {
    for (enforcement, objective) in
        [(LAGRANGE.to_owned(), "compliance"), (penalty(2e4), "contact_force"), (LAGRANGE.to_owned(), "work")]
    {
        let scene = Scene {
            enforcement,
            observed: "\"all\"",
            more: FIELDS.into(),
            design: "mass_p = 1.5".into(),
            ..Scene::default()
        };
        let text = scene.text().replace("\nmaterial", "\nmass_density = 2.0\nmaterial");
        let text = match objective {
            // of increments, which see the loads at both ends of a step
            "work" => {
                text.replace("contact_force = { steps = \"all\" }", "minimise = { quantity = 'work' }")
                    + "[[quantity]]\nname = 'work'\nexternal_work = {}\n"
            }
            _ => text.replace("contact_force = {", &format!("{objective} = {{")),
        };
        let mut problem = problem(&text);
        let density = random_density(&problem, 5);
        let check = check_gradient(&mut problem, &density);
        assert!(check.error < 1e-8, "{objective}: {}", check.error);
    }
}

/// A block that only its weight presses on a slab without mass, whose support carries it.
#[test]
fn a_block_rests_on_a_slab() {
    let text = Scene { more: "[[load]]\nbody = 'block'\ngravity = [0, -9.81, 0]\n".into(), ..Scene::default() }.text();
    let motion = format!("[[dirichlet]]\nset = \"block_ymax\"\nmotion = {}\n", Scene::default().motion);
    let text = text.replace(&motion, "").replace("name = \"block\"", "name = \"block\"\nmass_density = 2.0");
    let text = text.replace("[\"slab\", \"block\"]", "[\"slab\"]");
    let mut problem = problem(&text);
    let density = random_density(&problem, 5);
    let forward = forward(&mut problem, &density);
    let weight = 2.0 * 0.8f64.powi(3) * 9.81;
    let support = last(&problem, &forward, "reaction_slab_ymin_y");
    assert!((support / weight - 1.0).abs() < 1e-9, "{support} instead of {weight}");
}

/// A clamped bar of 6 × 2 × 2 hexahedra as a deck of CalculiX, with options of its material and a step.
pub fn bar_deck(options: &str, step: &str) -> String {
    let mut text = String::from("*NODE, NSET=NALL\n");
    let number = |[i, j, k]: [usize; 3]| 1 + i + 7 * (j + 3 * k);
    let places = |n: [usize; 3]| (0..n[0] * n[1] * n[2]).map(move |e| [e % n[0], e / n[0] % n[1], e / (n[0] * n[1])]);
    for place in places([7, 3, 3]) {
        let [x, y, z] = place.map(|at| 0.5 * at as f64);
        text += &format!("{}, {x}, {y}, {z}\n", number(place));
    }
    text += "*ELEMENT, TYPE=C3D8, ELSET=BAR\n";
    for (e, [i, j, k]) in places([6, 2, 2]).enumerate() {
        let corners = [[0, 0], [1, 0], [1, 1], [0, 1]];
        let corners = [0, 1].map(|up| corners.map(|[a, b]| number([i + a, j + b, k + up]).to_string()).join(", "));
        text += &format!("{}, {}\n", e + 1, corners.join(", "));
    }
    let clamped = places([1, 3, 3]).map(|place| number(place).to_string()).collect::<Vec<_>>().join(", ");
    text + "*NSET, NSET=CLAMPED\n"
        + &clamped
        + &format!("\n*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n{options}\n*SOLID SECTION, ELSET=BAR, MATERIAL=M\n")
        + &format!("*BOUNDARY\nCLAMPED, 1, 3\n{step}\n*END STEP\n")
}

/// Displacements of the middle of the end in CalculiX 2.20 (`*NODE PRINT`), for the same decks. Its centrifugal
/// force also acts at the deformed positions in steps with `NLGEOM`; it depends on the increments there in the
/// fifth digit (0.37288 with one increment, 0.37289 with four).
#[test]
fn another_program_agrees_on_decks() {
    for (step, load, expected) in [
        ("*STEP", "BAR, GRAV, 9.81, 0., -2., 0.", [0.0, -2.224116, 0.0]),
        ("*STEP, NLGEOM", "BAR, GRAV, 9.81, 0., -1., 0.", [-6.420783e-1, -1.785361, 0.0]),
        ("*STEP, NLGEOM", "BAR, CENTRIF, 16., -1., 0.5, 0.5, 0., 1., 0.", [3.728900e-1, 0.0, 0.0]),
    ] {
        let step = format!("{step}\n*STATIC\n0.25, 1.\n*DLOAD\n{load}");
        let text = "deck = { file = 'bar.inp' }\n".to_owned();
        let files = [("bar.inp".to_owned(), bar_deck("*DENSITY\n2.0", &step))].into();
        let solved = Case { text, files }.solve();
        let end = [3.0, 0.5, 0.5];
        let node = solved.problem.mesh.nodes.iter().position(|x| *x == end).expect("a node");
        let found = solved.displacement(node as u32, solved.steps());
        let deviation = (found - nalgebra::Vector3::from(expected)).norm() / nalgebra::Vector3::from(expected).norm();
        println!("{step} {load}: {found:?}, {deviation:e}");
        assert!(deviation < 5e-5, "{load}: {found:?} instead of {expected:?}");
    }
}
