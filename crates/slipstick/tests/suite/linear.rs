//! Linear equations among displacements, and points: uniform states of periodic cells, prescribed means, and
//! gradients.

use crate::common::scene::{LAGRANGE, Scene, augmented, penalty};
use crate::common::*;
use crate::quantity_gradients::check;
use slipstick::analysis::Forward;
use slipstick::build::{Problem, build};
use slipstick::case::parse_case;
use slipstick::quantities::quantities;

fn solved(text: &str) -> (Problem, Forward) {
    let mut problem = problem(text);
    let density = problem.initial_density().clone();
    let forward = forward(&mut problem, &density);
    (problem, forward)
}

fn last(problem: &Problem, forward: &Forward, name: &str) -> f64 {
    *quantities(problem, &forward.path).get(name).expect(name).last().unwrap()
}

fn near(value: f64, expected: f64, bound: f64) {
    assert!((value - expected).abs() <= bound * expected.abs().max(1.0), "{value} instead of {expected}");
}

fn end(forward: &Forward) -> &[f64] {
    &forward.path.states.last().unwrap().state.unknowns
}

const PATH: &str = "[load_path]\nsteps = 2\ntolerance = { relative = 1e-12 }\n";

/// A cell of 2 × 1 × 1 with opposite faces that move alike, apart from the displacement of a point for each
/// direction. Its corner is held. `rows` are the displacements of the three points.
fn cell(material: &str, rows: [[f64; 3]; 3]) -> String {
    let mut text = format!(
        "[[body]]\nname = 'cell'\nbox = {{ min = [0, 0, 0], max = [2, 1, 1], elements = [3, 2, 2] }}\n\
         material = {{ {material} }}\n[[set]]\nname = 'corner'\nnearest = [0, 0, 0]\n[[dirichlet]]\nset = 'corner'\n"
    );
    for (axis, u) in ["x", "y", "z"].into_iter().zip(rows) {
        text += &format!(
            "[[point]]\nname = 'point_{axis}'\nat = [3, 3, 3]\n\
             [[dirichlet]]\nset = 'point_{axis}'\nmotion = [{{ t = 1, u = {u:?} }}]\n\
             [[equation]]\nterms = [{{ set = 'cell_{axis}max' }}, {{ set = 'cell_{axis}min', factor = -1 }}, \
             {{ set = 'point_{axis}', factor = -1 }}]\n"
        );
    }
    text + PATH
}

/// The points prescribe the mean deformation of the cell, which is homogeneous. Its displacements are linear,
/// and the forces at the points are the nominal stress times the areas of the faces: by hand for linear
/// elasticity, σ = λ tr ε + 2 μ ε.
#[test]
fn a_periodic_cell_has_uniform_stress() {
    let gradient = [[0.02, 0.01, -0.004], [0.01, -0.03, 0.006], [-0.004, 0.006, 0.01]];
    let size = [2.0, 1.0, 1.0];
    let rows = [0, 1, 2].map(|a| gradient[a].map(|e| e * size[a]));
    let large = [0, 1, 2].map(|a: usize| [0.3, -0.2, 0.25].map(|e: f64| e * size[a] * if a == 1 { -0.7 } else { 1.0 }));
    for (material, rows) in [
        ("linear_elastic = { youngs_modulus = 1000, poisson_ratio = 0.25 }", rows),
        ("neo_hooke = { youngs_modulus = 1000, poisson_ratio = 0.25 }", large),
    ] {
        let (problem, forward) = solved(&cell(material, rows));
        let d = end(&forward);
        for (node, x) in problem.mesh.nodes[..36].iter().enumerate() {
            for c in 0..3 {
                let expected: f64 = (0..3).map(|a| rows[a][c] * x[a] / size[a]).sum();
                assert!((d[3 * node + c] - expected).abs() < 1e-11, "{material}: node {node}, {c}");
            }
        }
        if !material.starts_with("linear") {
            continue;
        }
        near(last(&problem, &forward, "energy_balance"), 0.0, 1e-12);
        let (lambda, mu) = (400.0, 400.0);
        let trace: f64 = (0..3).map(|a| gradient[a][a]).sum();
        for (a, axis) in ["x", "y", "z"].into_iter().enumerate() {
            for (c, component) in ["x", "y", "z"].into_iter().enumerate() {
                let stress = 2.0 * mu * gradient[a][c] + if a == c { lambda * trace } else { 0.0 };
                let force = last(&problem, &forward, &format!("reaction_point_{axis}_{component}"));
                near(force, stress * 2.0 / size[a], 1e-10);
            }
        }
    }
}

/// A bar of E A/L = 25 whose end moves by 0.1 in the mean: its force is 2.5. Under a force of 3 on the point, the
/// mean is 3/25. The block with lateral contraction has a face that does not stay plane: the force on the point
/// gives a mean displacement, which, prescribed, needs the same force.
#[test]
fn the_mean_of_a_face_is_driven_by_a_point() {
    let scene = |ratio: f64, drive: &str| {
        format!(
            "[[body]]\nname = 'bar'\nbox = {{ min = [0, 0, 0], max = [4, 1, 1], elements = [3, 2, 2] }}\n\
             material = {{ linear_elastic = {{ youngs_modulus = 100, poisson_ratio = {ratio} }} }}\n\
             [[dirichlet]]\nset = 'bar_xmin'\n[[point]]\nname = 'end'\nat = [4, 0.5, 0.5]\n\
             [[equation]]\nterms = [{{ set = 'end' }}, {{ set = 'bar_xmax', mean = true, factor = -1 }}]\n{drive}\n{PATH}"
        )
    };
    let motion =
        |u: f64| format!("[[dirichlet]]\nset = 'end'\ncomponents = ['x']\nmotion = [{{ t = 1, u = [{u:?}, 0, 0] }}]\n");
    let load = "[[load]]\nsurface = 'end'\nnodal_force = [3, 0, 0]\n";
    let (problem, forward) = solved(&scene(0.0, &motion(0.1)));
    near(last(&problem, &forward, "reaction_end_x"), 2.5, 1e-11);
    near(last(&problem, &forward, "reaction_bar_xmin_x"), -2.5, 1e-11);
    near(last(&problem, &forward, "energy_balance"), 0.0, 1e-12);
    let (problem, forward) = solved(&scene(0.0, load));
    let at = 3 * problem.mesh.set_nodes("end").unwrap()[0] as usize;
    near(end(&forward)[at], 3.0 / 25.0, 1e-12);
    near(last(&problem, &forward, "external_work"), 0.5 * 9.0 / 25.0, 1e-12);
    let (_, loaded) = solved(&scene(0.3, load));
    let (problem, driven) = solved(&scene(0.3, &motion(end(&loaded)[at])));
    near(last(&problem, &driven, "reaction_end_x"), 3.0, 1e-10);
    for (a, b) in end(&loaded).iter().zip(end(&driven)) {
        assert!((a - b).abs() < 1e-11);
    }
}

/// Two rigid bodies, one of which moves twice as far the other way, in the direction of an oblique axis: the
/// force on the first is that of the spring at the second, times the ratio.
#[test]
fn rigid_bodies_are_geared() {
    let text = format!(
        "[[body]]\nname = 'bar'\nbox = {{ min = [0, 0, 0], max = [4, 1, 1], elements = [1, 1, 1] }}\n\
         material = {{ linear_elastic = {{ youngs_modulus = 100, poisson_ratio = 0 }} }}\n[[dirichlet]]\nset = 'bar_xmin'\n\
         [[body]]\nname = 'a'\nbox = {{ min = [0, 3, 0], max = [1, 4, 1], elements = [1, 1, 1] }}\nrigid = {{}}\n\
         [[body]]\nname = 'b'\nbox = {{ min = [3, 3, 0], max = [4, 4, 1], elements = [1, 1, 1] }}\nrigid = {{}}\n\
         [[equation]]\nterms = [{{ set = 'a', component = 'x', factor = 2 }}, {{ set = 'b', component = [3, 4, 0] }}]\n\
         [[dirichlet]]\nset = 'a'\nmotion = [{{ t = 1, u = [0.3, 0, 0] }}]\n\
         [[dirichlet]]\nset = 'b'\ncomponents = ['z', 'rx', 'ry', 'rz']\n\
         [[spring]]\nname = 'k'\nset = 'b'\nstiffness = 5\n{PATH}"
    );
    let (problem, forward) = solved(&text);
    let b = 3 * problem.mesh.rigid[1].reference as usize;
    // the spring pulls b along the axis only
    near(end(&forward)[b], -0.6 * 0.6, 1e-11);
    near(end(&forward)[b + 1], -0.6 * 0.8, 1e-11);
    near(last(&problem, &forward, "reaction_a_x"), 2.0 * 5.0 * 0.6, 1e-10);
}

/// The gradients of all quantities by finite differences: equations at contact nodes, means that move together,
/// nodes that follow a sprung point, and a point that is driven.
#[test]
fn quantities_with_equations_match_finite_differences() {
    let more = "[[load]]\nsurface = 'slab_xmax'\ntraction = [5.0, 4.0, -2.0]\n\
                [[point]]\nname = 'free'\nat = [4, 1, 1]\n[[point]]\nname = 'driven'\nat = [4, 1, 1]\n\
                [[spring]]\nname = 'k'\nset = 'free'\nstiffness = 40\n\
                [[set]]\nname = 'rim'\nwithin = 'slab_xmax'\nboxes = [{ min = [3, 0.5, -1], max = [5, 2, 2] }]\n\
                [[equation]]\nterms = [{ set = 'rim', component = 'x' }, { set = 'free', component = 'x', factor = -1 }]\n\
                [[equation]]\nterms = [{ set = 'slab_xmax', mean = true, component = 'z' }, \
                { set = 'free', component = [0, 1, 0.5], factor = -1 }, { set = 'slab_zmin', mean = true, component = 'y', factor = 0.3 }]\n\
                [[set]]\nname = 'edge'\nwithin = 'block_ymin'\nnearest = [0.6, 1, 0.1]\n\
                [[set]]\nname = 'other'\nwithin = 'slab_ymax'\nnearest = [0, 1, 0]\n\
                [[equation]]\nterms = [{ set = 'edge', component = 'x' }, { set = 'other', component = [1, 0, -1], factor = 0.5 }]\n\
                [[equation]]\nterms = [{ set = 'block_zmax', mean = true, component = 'z' }, { set = 'driven', component = 'z', factor = -1 }]\n\
                [[dirichlet]]\nset = 'driven'\nmotion = [{ t = 1, u = [0, 0, 0.02] }]\n";
    let methods = [("Lagrange", LAGRANGE.into()), ("penalty", penalty(2e4)), ("augmented", augmented(1e4, 1e-11))];
    for (method, enforcement) in methods {
        let scene = Scene {
            slab: [3, 1, 1],
            block: [1, 2, 1],
            friction: 0.35,
            motion: "[{ t = 0.4, u = [0, -0.1, 0] }, { t = 1.0, u = [0.1, -0.12, 0.03], angle = 3 }]".into(),
            drive: "rotation = { point = [1.0, 1.8, 0.5], direction = [0.2, 0, 1] }".into(),
            steps: 5,
            more: more.into(),
            enforcement,
            ..Scene::default()
        };
        check(&format!("equations {method}"), &mut problem(&scene.text()), 3, &[1.0]);
    }
}

/// What cannot hold is refused at its place; what follows from other equations adds nothing.
#[test]
fn equations_that_cannot_hold_are_refused() {
    let of = |more: &str| {
        let text = format!(
            "[[body]]\nname = 'bar'\nbox = {{ min = [0, 0, 0], max = [4, 1, 1], elements = [2, 1, 1] }}\n\
             material = {{ linear_elastic = {{ youngs_modulus = 100, poisson_ratio = 0 }} }}\n\
             [[body]]\nname = 'tool'\nbox = {{ min = [0, 3, 0], max = [1, 4, 1], elements = [1, 1, 1] }}\nrigid = {{}}\n\
             [[dirichlet]]\nset = 'tool'\n[[dirichlet]]\nset = 'bar_xmin'\n[[point]]\nname = 'p'\nat = [9, 0, 0]\n\
             [[dirichlet]]\nset = 'p'\nmotion = [{{ t = 1, u = [1, 0, 0] }}]\n{more}\n{PATH}"
        );
        match parse_case(&text, "case.toml") {
            Err(errors) => errors.to_string(),
            Ok(resolved) => build(&resolved.case).err().map_or(String::new(), |error| error.to_string()),
        }
    };
    let equation = |terms: &str| format!("[[equation]]\nterms = [{terms}]\n");
    let to_point = equation("{ set = 'bar_xmax' }, { set = 'p', factor = -1 }");
    assert_eq!(of(&to_point), "");
    assert_eq!(of(&to_point.repeat(2)), "", "twice the same");
    for (terms, message) in [
        ("{ set = 'bar_xmin' }, { set = 'p', factor = -1 }", "determine all displacements in it, and violate it"),
        ("{ set = 'bar_xmax' }, { set = 'bar_ymax', factor = -1 }", "`bar_xmax` has 4 nodes, and `bar_ymax` has 6"),
        ("{ set = 'bar_xmax' }, { set = 'bar_zmax', factor = -1 }, { set = 'p' }", "has 6"),
        ("{ set = 'tool_ymin' }, { set = 'p', factor = -1 }", "nodes of the rigid body `tool`"),
        ("{ set = 'bar_xmax', component = 'x' }, { set = 'p' }", "some terms have a component"),
        ("{ set = 'bar_xmax', factor = 0 }", "must not be zero"),
        ("{ set = 'q' }", "there is no surface or set called `q`"),
        ("", "the equation has no terms"),
    ] {
        let found = of(&equation(terms));
        assert!(found.contains(message), "{terms}: {found}");
    }
}

/// A bar without lateral contraction, clamped at one end, with a coupling of the other.
fn coupled(kind: &str, at: [f64; 3], more: &str) -> String {
    format!(
        "[[body]]\nname = 'bar'\nbox = {{ min = [0, 0, 0], max = [4, 1, 1], elements = [4, 2, 2] }}\n\
         material = {{ linear_elastic = {{ youngs_modulus = 100, poisson_ratio = 0.3 }} }}\n\
         [[dirichlet]]\nset = 'bar_xmin'\n\
         [[coupling]]\nname = 'end'\nset = 'bar_xmax'\nat = {at:?}\nkind = '{kind}'\n{more}{PATH}"
    )
}

/// A force on a reference point beside the face acts like a force on its centre and the moment of its arm; both
/// couplings move their reference points by the displacement and rotation of the centre. Prescribing these
/// needs the same force.
#[test]
fn couplings_transfer_forces_and_moments() {
    for kind in ["distributing", "kinematic"] {
        let force = [0.03, -0.02, 0.05];
        let load = |moment: &str| format!("[[load]]\nsurface = 'end'\nforce = {force:?}\n{moment}");
        let (problem, beside) = solved(&coupled(kind, [6.0, 1.5, 0.5], &load("")));
        // (2, 1, 0) × f
        let moment = "[[load]]\nsurface = 'end'\nmoment = [0.05, -0.1, -0.07]\n";
        let (_, centred) = solved(&coupled(kind, [4.0, 0.5, 0.5], &load(moment)));
        let (beside, centred) = (end(&beside), end(&centred));
        let at = 3 * problem.mesh.couplings[0].reference as usize;
        for (a, b) in beside[..at].iter().zip(centred) {
            assert!((a - b).abs() < 1e-12, "{kind}: {a} {b}");
        }
        let vector = |d: &[f64], at: usize| nalgebra::Vector3::from_column_slice(&d[at..at + 3]);
        let turn = vector(beside, at + 3) / problem.mesh.couplings[0].length;
        assert!(turn.norm() > 1e-3);
        let expected = vector(centred, at) + turn.cross(&nalgebra::Vector3::new(2.0, 1.0, 0.0));
        assert!((vector(beside, at) - expected).norm() < 1e-12, "{kind}");
        if kind == "kinematic" {
            for &node in problem.mesh.set_nodes("bar_xmax").unwrap().iter() {
                let arm =
                    nalgebra::Vector3::from(problem.mesh.nodes[node as usize]) - nalgebra::Vector3::new(6.0, 1.5, 0.5);
                let moved = vector(beside, at) + turn.cross(&arm);
                assert!((vector(beside, 3 * node as usize) - moved).norm() < 1e-12);
            }
        }
        let u: [f64; 3] = vector(beside, at).into();
        let drive =
            format!("[[dirichlet]]\nset = 'end'\ncomponents = ['x', 'y', 'z']\nmotion = [{{ t = 1, u = {u:?} }}]\n");
        let (problem, driven) = solved(&coupled(kind, [6.0, 1.5, 0.5], &drive));
        for (axis, force) in ["x", "y", "z"].iter().zip(force) {
            near(last(&problem, &driven, &format!("reaction_end_{axis}")), force, 1e-10);
        }
    }
}

/// The rotation about an edge is not determined.
#[test]
fn couplings_of_edges_are_refused() {
    for kind in ["distributing", "kinematic"] {
        let edge = "[[set]]\nname = 'edge'\nwithin = 'bar_xmax'\nboxes = [{ min = [3, 0.9, -1], max = [5, 2, 2] }]\n";
        let text = coupled(kind, [4.0, 1.0, 0.2], edge).replace("set = 'bar_xmax'\nat", "set = 'edge'\nat");
        let error = build(&parse_case(&text, "case.toml").unwrap().case).err().map(|error| error.to_string());
        assert!(error.as_deref().is_some_and(|error| error.contains("lie on a line")), "{kind}: {error:?}");
    }
}

/// Couplings that are loaded, driven and turned: all gradients by finite differences.
#[test]
fn quantities_with_couplings_match_finite_differences() {
    let more = "[[load]]\nsurface = 'slab_xmax'\ntraction = [5.0, 4.0, -2.0]\n\
                [[coupling]]\nname = 'pull'\nset = 'block_xmax'\nat = [2, 1.5, 0.5]\nkind = 'distributing'\n\
                [[load]]\nsurface = 'pull'\nforce = [1, 0.5, 0.3]\n[[load]]\nsurface = 'pull'\nmoment = [0.1, 0.2, -0.3]\n\
                [[set]]\nname = 'rim'\nwithin = 'slab_xmax'\nboxes = [{ min = [3, 0.4, -1], max = [5, 2, 2] }]\n\
                [[coupling]]\nname = 'turn'\nset = 'rim'\nat = [4, 1, 0.5]\nkind = 'kinematic'\n\
                [[dirichlet]]\nset = 'turn'\ncomponents = ['z', 'rx', 'ry']\nmotion = [{ t = 1, angle = 2 }]\n\
                rotation = { point = [4, 1, 0.5], direction = [1, 0.5, 0] }\n";
    let scene = Scene {
        slab: [3, 2, 1],
        friction: 0.35,
        motion: "[{ t = 0.4, u = [0, -0.1, 0] }, { t = 1.0, u = [0.1, -0.12, 0.03] }]".into(),
        steps: 5,
        more: more.into(),
        ..Scene::default()
    };
    check("couplings", &mut problem(&scene.text()), 3, &[1.0]);
}
