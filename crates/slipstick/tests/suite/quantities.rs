//! What every run reports at each load step, against analytic values, equilibrium and the balance
//! of energy.

use crate::common::scene::Scene;
use crate::common::{forward, problem, random_density};
use slipstick::build::Problem;
use slipstick::model::StateResults;
use slipstick::quantities::{Quantities, quantities};

const METHODS: [(&str, &str); 3] = [
    ("Lagrange", "{ lagrange = {} }"),
    ("penalty", "{ penalty = { stiffness = 3000 } }"),
    ("augmented", "{ augmented = { stiffness = 1000 } }"),
];

fn solve(problem: &mut Problem, seed: u64) -> Quantities {
    let density = random_density(problem, seed);
    let forward = forward(problem, &density);
    quantities(problem, &forward.path)
}

fn last(quantities: &Quantities, name: &str) -> f64 {
    *quantities.get(name).unwrap_or_else(|| panic!("{name}: {:?}", quantities.names)).last().expect("a row")
}

const BAR: &str = "
[[body]]
name = 'bar'
box = { min = [0, 0, 0], max = [2, 0.5, 3], elements = [2, 1, 3] }
material = { linear_elastic = { youngs_modulus = 700.0, poisson_ratio = 0.0 } }
[[symmetry]]
normal = 'x'
[[symmetry]]
normal = 'y'
[[dirichlet]]
set = 'bar_zmin'
components = ['z']
[[dirichlet]]
set = 'bar_zmax'
components = ['z']
motion = [{ t = 1.0, u = [0, 0, 0.03] }]
[load_path]
steps = 3
";

/// A bar of Hooke's law, ν = 0, between two symmetry planes, stretched by 1 %: F = E A ε, W = ½ E A
/// ε² l. The trapezoidal rule is exact for forces that are linear in the displacement.
#[test]
fn a_bar_in_tension() {
    let found = solve(&mut problem(BAR), 1);
    let (force, energy) = (700.0 * 1.0 * 0.01, 0.5 * 700.0 * 1.0 * 0.01 * 0.03);
    let near = |name: &str, expected: f64| {
        let value = last(&found, name);
        assert!((value - expected).abs() < 1e-10 * (1.0 + expected.abs()), "{name}: {value} instead of {expected}");
    };
    near("reaction_bar_zmax_z", force);
    near("reaction_bar_zmin_z", -force);
    near("displacement_bar_zmax_z", 0.03);
    near("symmetry_reaction_x", 0.0);
    near("strain_energy_bar", energy);
    near("strain_energy", energy);
    near("external_work", energy);
    near("energy_balance", 0.0);
    assert_eq!(found.rows.iter().map(|row| row.step).collect::<Vec<_>>(), [0, 1, 2, 3]);
    let thirds = found.get("reaction_bar_zmax_z").expect("there");
    for (n, value) in thirds.iter().enumerate() {
        assert!((value - force * n as f64 / 3.0).abs() < 1e-10, "{n}: {value}");
    }
}

/// Reactions of all supports and symmetry planes, and a load, add up to zero; the pair's forces
/// agree with them, and friction stays within the cone.
#[test]
fn reactions_and_loads_are_in_equilibrium() {
    for (method, enforcement) in METHODS {
        for shape in ["standard", "dual"] {
            let scene = Scene {
                enforcement: enforcement.into(),
                shape,
                more: "[[load]]\nsurface = 'slab_xmax'\ntraction = [5.0, 4.0, -2.0]\n".into(),
                ..Scene::default()
            };
            let mut problem = problem(&scene.text());
            let found = solve(&mut problem, 3);
            let sums = ["x", "y", "z"].map(|axis| {
                last(&found, &format!("reaction_slab_ymin_{axis}"))
                    + last(&found, &format!("reaction_block_ymax_{axis}"))
            });
            let largest = last(&found, "reaction_block_ymax_y").abs();
            for (sum, load) in sums.iter().zip([5.0, 4.0, -2.0]) {
                assert!((sum + load).abs() < 1e-7 * largest, "{method}, {shape}: {sums:?} of {largest}");
            }
            // the block is held by its top and by the contact
            for axis in ["x", "y", "z"] {
                let (top, contact) = (format!("reaction_block_ymax_{axis}"), format!("block_ymin_force_{axis}"));
                let sum = last(&found, &top) + last(&found, &contact);
                assert!(sum.abs() < 1e-7 * largest, "{method}, {shape}, {axis}: {sum} of {largest}");
            }
            let (normal, friction) =
                (last(&found, "block_ymin_normal_force"), last(&found, "block_ymin_friction_force"));
            assert!(normal > 0.0 && friction > 0.0 && friction <= (1.0 + 1e-9) * scene.friction * normal, "{method}");
            let counts = ["open", "stick", "slip"].map(|status| last(&found, &format!("block_ymin_{status}")));
            assert_eq!(counts.iter().sum::<f64>(), 4.0, "{method}, {shape}: {counts:?}");
        }
    }
}

const SLIDE: &str = "[{ t = 0.25, u = [0, -0.06, 0] }, { t = 1.0, u = [0.9, -0.06, 0.1] }]";

/// External work is stored in the bodies or taken by contact, up to the error of the trapezoidal
/// rule.
#[test]
fn work_is_stored_or_taken_by_contact() {
    for (method, enforcement) in METHODS {
        let unbalanced = |steps: usize| {
            let scene = Scene { enforcement: enforcement.into(), steps, motion: SLIDE.into(), ..Scene::default() };
            let found = solve(&mut problem(&scene.text()), 3);
            let [work, stored, taken] =
                ["external_work", "strain_energy", "contact_work"].map(|name| last(&found, name));
            assert!(taken > 0.05 * work && stored > 0.05 * work, "{method}: {work} {stored} {taken}");
            ((work - stored - taken) / work).abs()
        };
        let errors = [8, 16, 32].map(unbalanced);
        println!("{method}: unbalanced part of external work {errors:?}");
        assert!(errors[2] < 0.5 * errors[1] && errors[1] < 0.5 * errors[0] && errors[2] < 1e-3, "{method}: {errors:?}");
    }
}

/// While strains are small, contact takes what friction dissipates, up to the size of the load
/// steps: in the first step of sliding, the trapezoidal rule sees half of the friction that acts at
/// its end.
#[test]
fn friction_work_is_contact_work_at_small_strains() {
    let motion = "[{ t = 0.25, u = [0, -6e-4, 0] }, { t = 1.0, u = [0.9, -6e-4, 0.1] }]";
    let apart = |steps: usize| {
        let enforcement = METHODS[0].1.into();
        let scene = Scene { enforcement, block: [2; 3], steps, motion: motion.into(), ..Scene::default() };
        let found = solve(&mut problem(&scene.text()), 3);
        let (friction, taken) = (last(&found, "friction_work"), last(&found, "contact_work"));
        assert!(taken > 0.9 * last(&found, "external_work"), "{steps}: {taken}");
        (friction / taken - 1.0).abs()
    };
    let errors = [16, 64, 256].map(apart);
    println!("friction work over contact work − 1: {errors:?}");
    assert!(errors[1] < 0.3 * errors[0] && errors[2] < 0.3 * errors[1] && errors[2] < 3e-3, "{errors:?}");
}

/// The same bar: stress E ε, energy density ½ E ε², and reactions that add up to E A ε.
#[test]
fn fields_of_a_bar() {
    let mut problem = problem(BAR);
    let density = random_density(&problem, 1);
    let forward = forward(&mut problem, &density);
    let state = &forward.path.states.last().expect("states").state;
    let fields = problem.analysis.design.element_fields(&problem.mesh, state, 1.0.into(), &StateResults::default());
    let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} instead of {expected}");
    for (e, stress) in fields.stress.chunks_exact(6).enumerate() {
        stress.iter().zip([0.0, 0.0, 7.0, 0.0, 0.0, 0.0]).for_each(|(found, expected)| near(*found, expected));
        near(fields.von_mises[e], 7.0);
        near(fields.energy_density[e], 0.035);
    }
    let top = problem.mesh.set_nodes("bar_zmax").expect("a set");
    near(top.iter().map(|&node| fields.reaction[3 * node as usize + 2]).sum(), 7.0);
    near(fields.reaction.chunks_exact(3).map(|of| of[2]).sum(), 0.0);
}

/// A case's own external work is the column that every run has; the parts done on the drive, on the
/// support and by the load are the whole.
#[test]
fn external_work_of_sets_adds_up() {
    let sets = [
        ("whole", ""),
        ("drive", "set = 'block_ymax'"),
        ("support", "set = 'slab_ymin'"),
        ("load", "set = 'slab_xmax'"),
    ];
    let own = sets.map(|(name, set)| format!("[[quantity]]\nname = '{name}'\nexternal_work = {{ {set} }}\n"));
    // the corner that support and load share moves with neither
    let more = format!("[[load]]\nsurface = 'slab_xmax'\ntraction = [5.0, 4.0, -2.0]\n{}", own.concat());
    let scene = Scene { motion: SLIDE.into(), more, ..Scene::default() };
    let found = solve(&mut problem(&scene.text()), 3);
    let [whole, drive, support, load] = sets.map(|(name, _)| last(&found, name));
    assert_eq!(found.get("whole"), found.get("external_work"));
    assert_eq!(support, 0.0, "a support that does not move does no work");
    assert!(drive > 0.0 && load != 0.0, "{drive} {load}");
    assert!((drive + load - whole).abs() < 1e-12 * whole, "{drive} + {load} instead of {whole}");
}

/// The work of friction at the nodes, times the areas around them, is that of the pair; sliding by
/// the motion of the block is the distance that the nodes slip.
#[test]
fn slip_and_wear_add_up() {
    let motion = "[{ t = 0.2, u = [0, -0.05, 0] }, { t = 1.0, u = [0.4, -0.05, 0] }]".to_owned();
    let scene = Scene { friction: 0.1, motion, ..Scene::default() };
    let mut problem = problem(&scene.text());
    let found = solve(&mut problem, 3);
    let row = found.rows.last().expect("rows");
    let areas = problem.mesh.surfaces["block_ymin"].node_areas(&problem.mesh.nodes);
    assert_eq!(areas.len(), row.slipped.len());
    assert!(row.slipped.iter().zip(&areas).all(|(at, (_, area))| (at.area - area).abs() < 1e-12 * area));
    let work: f64 = row.slipped.iter().map(|at| at.work).sum();
    let expected = last(&found, "block_ymin_friction_work");
    assert!(expected > 0.0 && (work - expected).abs() < 1e-10 * expected, "{work} {expected}");
    // the slab and the block yield, so the surfaces slide less than the block's top moves
    assert!(row.slipped.iter().all(|at| at.distance > 0.25 && at.distance < 0.45), "{:?}", row.slipped);
}
