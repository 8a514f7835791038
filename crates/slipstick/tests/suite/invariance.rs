//! Results must not depend on the observer's frame, the units, or the number of threads, and forces
//! must balance.

use crate::common::scene::*;
use crate::common::*;
use nalgebra::{Rotation3, Unit, Vector3};
use slipstick::analysis::{Forward, pair_results};
use slipstick::design::ElementValues;

/// All methods with their default parameters.
const DEFAULTS: [(&str, &str); 3] =
    [("Lagrange", LAGRANGE), ("penalty", "{ penalty = {} }"), ("augmented", "{ augmented = {} }")];

/// Newton and Uzawa iterations of every accepted state.
fn counts(run: &Forward) -> Vec<(usize, usize)> {
    run.path.states.iter().map(|s| (s.report.iterations.len(), s.report.uzawa)).collect()
}

fn scene(enforcement: &str) -> Scene {
    Scene {
        slab: [3, 1, 2],
        block: [2, 1, 2],
        corner: [0.93, 1.0, 0.37],
        enforcement: enforcement.into(),
        load_path: String::new(),
        ..Scene::default()
    }
}

fn run(scene: &Scene) -> (Forward, ElementValues) {
    let mut problem = problem(&scene.text());
    let density = random_density(&problem, 21);
    let run = forward(&mut problem, &density);
    let gradient = problem.analysis.gradient(&run).unwrap();
    (run, gradient)
}

/// The whole problem translated and rotated: same iterations, same θ and gradient. Waypoints are
/// rotated as well.
#[test]
fn rigid_motion_changes_nothing() {
    let (axis, degrees) = (Vector3::new(0.3, -0.5, 0.8), 73.0);
    let turn = Rotation3::from_axis_angle(&Unit::new_normalize(axis), f64::to_radians(degrees));
    let points = [(0.4, [0.0, -0.08, 0.0]), (1.0, [0.12, -0.1, 0.05])];
    let motion = |turn: &Rotation3<f64>| {
        let point = |(t, u): (f64, [f64; 3])| {
            let u = turn * Vector3::from(u);
            format!("{{ t = {t}, u = [{:?}, {:?}, {:?}] }}", u.x, u.y, u.z)
        };
        format!("[{}]", points.map(point).join(", "))
    };
    for (method, enforcement) in DEFAULTS {
        let (base, gradient) = run(&Scene { motion: motion(&Rotation3::identity()), ..scene(enforcement) });
        let place = format!(
            "{{ rotate = {{ axis = [{}, {}, {}], degrees = {degrees} }}, translate = [5.0, -3.0, 2.0] }}",
            axis.x, axis.y, axis.z
        );
        let (moved, moved_gradient) = run(&Scene { motion: motion(&turn), place, ..scene(enforcement) });
        let (value, slope) = (moved.value / base.value - 1.0, deviation(&moved_gradient, &gradient));
        println!("{method}: theta changes by {value:.1e}, the gradient by {slope:.1e}");
        assert_eq!(counts(&moved), counts(&base), "{method}");
        assert!(value.abs() < 1e-10 && slope < 1e-9, "{method}: {value:e} {slope:e}");
    }
}

/// Millimetres or metres, and E times 1e4: same iterations with default parameters and tolerances,
/// θ in the new unit of force.
#[test]
fn units_change_nothing() {
    let motion = |l: f64| {
        format!(
            "[{{ t = 0.5, u = [0, {:?}, 0] }}, {{ t = 1.0, u = [{:?}, {:?}, {:?}] }}]",
            -0.1 * l,
            0.1 * l,
            -0.1 * l,
            0.03 * l
        )
    };
    for (method, enforcement) in DEFAULTS {
        for shape in ["standard", "dual"] {
            let at = |length: f64, modulus: f64| {
                run(&Scene { length, modulus, motion: motion(length), shape, ..scene(enforcement) })
            };
            let (base, gradient) = at(1.0, 1000.0);
            for (length, modulus) in [(1e-3, 1e9), (1e3, 1e-3), (1.0, 1e7)] {
                let (other, other_gradient) = at(length, modulus);
                let force = length * length * modulus / 1000.0;
                let value = other.value / (force * base.value) - 1.0;
                let slope = deviation(&other_gradient.iter().map(|g| g / force).collect::<Vec<_>>(), &gradient);
                println!("{method} {shape}, L × {length:e}, E = {modulus:e}: theta {value:.1e}, gradient {slope:.1e}");
                assert_eq!(counts(&other), counts(&base), "{method} {shape} L × {length:e} E {modulus:e}");
                assert!(value.abs() < 1e-10 && slope < 1e-8, "{method}: {value:e} {slope:e}");
            }
        }
    }
}

/// c_n and c_t with units, per area and as the paper's factors of weighted measures (the tributary
/// area of an interior node is 0.16 here): the iterations differ, but the solution and its gradient
/// do not.
#[test]
fn complementarity_parameters_change_the_iteration_only() {
    let at = |enforcement: &str| run(&Scene { load_path: Scene::default().load_path, ..scene(enforcement) });
    let (base, gradient) = at(LAGRANGE);
    let mut iterations = vec![base.path.newton_iterations()];
    for c in [
        "complementarity_parameter = 50",
        "stiffness = 2000",
        "stiffness = { normal = 5e4, tangential = 1e3 }",
        "stiffness = { normal = 2e3, tangential = 3e4 }, scaling = \"weighted\"",
    ] {
        let (other, other_gradient) = at(&format!("{{ lagrange = {{ {c} }} }}"));
        let (value, slope) = (other.value / base.value - 1.0, deviation(&other_gradient, &gradient));
        println!("{c}: theta {value:.1e}, gradient {slope:.1e}, {} Newton", other.path.newton_iterations());
        assert!(value.abs() < 1e-11 && slope < 1e-10, "{c}: {value:e} {slope:e}");
        iterations.push(other.path.newton_iterations());
    }
    assert!(iterations.iter().any(|n| *n != iterations[0]), "the parameters have no effect: {iterations:?}");
}

/// θ and gradient do not depend on the number of threads, bit for bit.
#[test]
fn threads_change_no_bit() {
    let at_points = ("penalty at points", "{ penalty = { pressure_at = \"points\" } }");
    for (method, enforcement) in DEFAULTS.into_iter().chain([at_points]) {
        let mut results = Vec::new();
        for threads in [1, 2, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let (run, gradient) = pool.install(|| run(&scene(enforcement)));
            let bits: Vec<u64> = gradient.iter().chain([&run.value]).map(|v| v.to_bits()).collect();
            let states: Vec<u64> =
                run.path.states.iter().flat_map(|s| &s.state.unknowns).map(|u| u.to_bits()).collect();
            results.push((bits, states));
        }
        assert!(results[0] == results[1] && results[0] == results[2], "{method}");
    }
}

/// The contact force on the slave, computed directly as Σ_j A_j z_j, balances the internal forces
/// of the slave nodes, those of the master nodes, and the supports' reactions.
#[test]
fn forces_balance() {
    for (method, enforcement) in DEFAULTS {
        for shape in ["standard", "dual"] {
            let mut problem = problem(
                &Scene { shape, load_path: "tolerance = { relative = 1e-12 }".into(), ..scene(enforcement) }.text(),
            );
            let density = random_density(&problem, 21);
            let run = forward(&mut problem, &density);
            let contact = contact_path(&mut problem, &run).pop().unwrap();
            let by_traction: Vector3<f64> =
                contact.iter().map(|c| Vector3::from(c.global_multiplier) * c.covered_area).sum();
            let states: Vec<_> = run.path.states.iter().map(|at| at.state.clone()).collect();
            let [.., before, last] = &states[..] else { panic!("a path") };
            let results = problem.analysis.design.contact_results(before, last, 1.0.into()).unwrap();
            let pairs = pair_results(problem.analysis.model(), &results);
            let [pair] = &pairs[..] else { panic!("one pair") };
            let d = &run.path.states.last().unwrap().state.unknowns[..3 * problem.mesh.nodes.len()];
            let mut force = vec![0.0; d.len()];
            problem.analysis.design.internal_force(d, (0.0.into(), &[]), &mut force).unwrap();
            let total = |set: &str| -> Vector3<f64> {
                let nodes = problem.mesh.set_nodes(set).unwrap();
                nodes.iter().map(|&n| Vector3::from_column_slice(&force[3 * n as usize..][..3])).sum()
            };
            let size = by_traction.norm();
            assert!(size > 1.0);
            assert!((Vector3::from(pair.force) + by_traction).norm() < 1e-14 * size && pair.peak_pressure > 0.0);
            // R = f_int + f_co = 0 at free nodes; supports carry f_int
            let exact = [
                ("block_ymin", -by_traction),
                ("slab_ymax", by_traction),
                ("block_ymax", by_traction),
                ("slab_ymin", -by_traction),
            ];
            for (set, exact) in exact {
                let error = (total(set) - exact).norm() / size;
                // the augmented multipliers satisfy equilibrium to Uzawa's tolerance
                let bound = if method == "augmented" { 1e-7 } else { 1e-10 };
                assert!(error < bound, "{method} {shape} {set}: {error:e}");
            }
            println!(
                "{method} {shape}: force {by_traction:.3?}, supports balance to {:.1e}",
                (total("block_ymax") + total("slab_ymin")).norm() / size
            );
            assert!((total("block_ymax") + total("slab_ymin")).norm() < 1e-10 * size);
        }
    }
}

/// Pairs of bodies that are not in contact with each other have independent solutions, whatever
/// method the others have: those of separate cases.
#[test]
fn pairs_of_other_bodies_and_methods_change_nothing() {
    let alone: Vec<String> = DEFAULTS
        .iter()
        .enumerate()
        .map(|(i, (_, enforcement))| {
            // steps far below the tolerance to which both are solved; each problem at a different
            // place
            let load_path = "tolerance = { relative = 1e-13 }".into();
            let place = format!("{{ translate = [0.0, 0.0, {:?}] }}", 3.0 * i as f64);
            let enforcement = enforcement.replace("augmented = {}", "augmented = { tolerance = 1e-12 }");
            Scene { place, load_path, ..scene(&enforcement) }.text()
        })
        .collect();
    // the bodies, pairs and motions of all in one case
    let own = |i: usize| {
        let (tables, _) = alone[i].split_once("[load_path]").unwrap();
        tables.replace("slab", &format!("slab{i}")).replace("block", &format!("block{i}"))
    };
    let (_, rest) = alone[0].split_once("[load_path]").unwrap();
    let bodies = r#"["slab0", "block0", "slab1", "block1", "slab2", "block2"]"#;
    let rest = rest.replace(r#"["slab", "block"]"#, bodies);
    let together = format!("{}{}{}[load_path]{rest}", own(0), own(1), own(2));
    let tractions = |text: &str| -> Vec<f64> {
        let mut problem = problem(text);
        let density = problem.initial_density().clone();
        let run = forward(&mut problem, &density);
        contact_path(&mut problem, &run).iter().flatten().flat_map(|node| node.global_multiplier).collect()
    };
    let all = tractions(&together);
    let separate: Vec<Vec<f64>> = alone.iter().map(|text| tractions(text)).collect();
    let (steps, nodes) = (10, separate[0].len() / 30);
    assert!(separate.iter().all(|own| own.len() == 3 * nodes * steps) && all.len() == 9 * nodes * steps);
    for (i, own) in separate.iter().enumerate() {
        let of_all: Vec<f64> =
            (0..steps).flat_map(|step| all[9 * nodes * step + 3 * nodes * i..][..3 * nodes].to_vec()).collect();
        let apart = deviation(&of_all, own);
        println!("{}: {apart:.1e}", DEFAULTS[i].0);
        assert!(apart < 1e-9, "{}: {apart:e}", DEFAULTS[i].0);
    }
}
