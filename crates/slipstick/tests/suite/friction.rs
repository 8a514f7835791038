//! Coulomb friction in full slip, and relations between the methods.

use crate::common::scene::*;
use crate::common::*;
use slipstick::build::Problem;
use slipstick_contact::ContactStatus;

/// A block without lateral strain (ν = 0, so nothing moves sideways) that slides along x on a rigid
/// plane.
fn sliding(friction: f64, enforcement: &str, shape: &str, plane_is_slave: bool) -> Problem {
    problem(&sliding_text(&format!("{friction:?}"), enforcement, shape, plane_is_slave))
}

/// Its text; `friction` may be followed by further keys of the pair.
fn sliding_text(friction: &str, enforcement: &str, shape: &str, plane_is_slave: bool) -> String {
    let (slave, master) = if plane_is_slave { ("base_ymax", "block_ymin") } else { ("block_ymin", "base_ymax") };
    // the nodal forces of prescribed slave nodes do not count
    let objective = if plane_is_slave { "" } else { "[objective]\ncontact_force = { steps = \"last\" }" };
    format!(
        r#"
[[body]]
name = "base"
box = {{ min = [0, 0, 0], max = [4, 1, 1], elements = [4, 1, 1] }}
material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.0 }} }}
[[body]]
name = "block"
box = {{ min = [0.6, 1, 0.1], max = [2.2, 1.5, 0.9], elements = [4, 1, 1] }}
material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.0 }} }}
[[set]]
name = "plane"
boxes = [{{ min = [-1, -1, -1], max = [5, 0.5, 2] }}]
[[set]]
name = "plane_top"
within = "base_ymax"
boxes = [{{ min = [-1, 0.5, -1], max = [5, 2, 2] }}]
[[contact]]
slave = "{slave}"
master = "{master}"
friction = {friction}
multiplier_shape = "{shape}"
enforcement = {enforcement}
[[dirichlet]]
set = "plane"
[[dirichlet]]
set = "plane_top"
[[dirichlet]]
set = "block_ymax"
motion = [{{ t = 0.2, u = [0, -0.02, 0] }}, {{ t = 1.0, u = [0.5, -0.02, 0] }}]
[load_path]
steps = 10
tolerance = {{ relative = 1e-12 }}
{objective}
"#
    )
}

/// Runs to the end; tangential and normal reaction on the block's top, and θ. Every touching node
/// must slip.
fn slide(problem: &mut Problem) -> (f64, f64, f64) {
    let density = problem.initial_density().clone();
    let run = forward(problem, &density);
    let contact = contact_path(problem, &run).pop().unwrap();
    assert!(contact.iter().filter(|c| c.status == ContactStatus::Slip).count() >= 4);
    assert!(contact.iter().all(|c| c.status != ContactStatus::Stick));
    let d = &run.path.states.last().unwrap().state.unknowns[..3 * problem.mesh.nodes.len()];
    let mut force = vec![0.0; d.len()];
    problem.analysis.design.internal_force(d, (0.0.into(), &[]), &mut force).unwrap();
    let top = problem.mesh.set_nodes("block_ymax").unwrap();
    let sum = |c: usize| top.iter().map(|&n| force[3 * n as usize + c]).sum::<f64>();
    assert!(sum(2).abs() < 1e-7 * sum(1).abs(), "nothing pulls across: {:e}", sum(2) / sum(1));
    (sum(0), -sum(1), run.value)
}

/// Coulomb's law for the whole block: the pulling force is μ times the pressing force.
#[test]
fn sliding_force_is_friction_times_normal_force() {
    for (method, enforcement) in
        [("Lagrange", LAGRANGE.into()), ("penalty", penalty(1e4)), ("augmented", augmented(1e4, 1e-11))]
    {
        for (shape, plane_is_slave) in [("standard", true), ("dual", true), ("standard", false)] {
            for friction in [0.05, 0.3] {
                // with the penalty method, the block's own face can warp, which changes the
                // direction of the traction; the plane remains plane
                if method == "penalty" && !plane_is_slave {
                    continue;
                }
                let (pull, press, _) = slide(&mut sliding(friction, &enforcement, shape, plane_is_slave));
                let error = pull / (friction * press) - 1.0;
                println!(
                    "{method} {shape}, plane slave {plane_is_slave}, mu {friction}: {pull:.6} of {press:.6}, {error:.1e}"
                );
                assert!(
                    press > 1.0 && error.abs() < 1e-9,
                    "{method} {shape} {plane_is_slave} mu {friction}: {error:e}"
                );
            }
        }
    }
}

/// The same for a coefficient that changes while the block slides: at the end, the last factor applies; before the
/// first waypoint, the first.
#[test]
fn sliding_force_follows_the_path_of_friction() {
    for (method, enforcement) in
        [("Lagrange", LAGRANGE.into()), ("penalty", penalty(1e4)), ("augmented", augmented(1e4, 1e-11))]
    {
        for (path, factor) in [
            ("{ t = 0.5, factor = 2.0 }, { t = 1.0, factor = 0.5 }", 0.5),
            ("{ t = 0.0, factor = 0.5 }, { t = 0.8, factor = 1.5 }", 1.5),
            ("{ t = 1.0, factor = 0.75 }", 0.75),
        ] {
            let friction = format!("0.2\nfriction_path = [{path}]");
            let (pull, press, _) = slide(&mut problem(&sliding_text(&friction, &enforcement, "standard", true)));
            let error = pull / (0.2 * factor * press) - 1.0;
            assert!(press > 1.0 && error.abs() < 1e-9, "{method}, {path}: {error:e}");
        }
    }
}

/// In full slip every nodal force is √(1+μ²) times its normal part, so θ grows by this factor
/// (Table 1 of the paper: 1.0044, 1.0291).
#[test]
fn contact_force_grows_with_friction() {
    for shape in ["standard", "dual"] {
        let at = |friction: f64| {
            let (_, press, value) = slide(&mut sliding(friction, LAGRANGE, shape, false));
            (press, -value)
        };
        let (_, without) = at(0.0);
        for friction in [0.1f64, 0.25] {
            let factor = (1.0 + friction * friction).sqrt();
            let (press, value) = at(friction);
            println!("{shape} mu {friction}: {} against {factor}", value / without);
            assert!((value / (press * factor) - 1.0).abs() < 1e-9, "{shape} mu {friction}: {value} {press}");
            // the pressing force itself changes only slightly
            assert!((value / without / factor - 1.0).abs() < 0.02, "{shape} mu {friction}: {value} {without}");
        }
    }
}

/// |θ| of the penalty method increases with ε towards that of the Lagrange method, with an error
/// proportional to 1/ε; the augmented method agrees with it for any ε.
#[test]
fn penalty_tends_to_lagrange_from_below_and_augmented_lies_on_it() {
    for shape in ["standard", "dual"] {
        let value = |enforcement: String| {
            let mut problem = problem(&Scene { enforcement, shape, friction: 0.3, ..Scene::default() }.text());
            let density = random_density(&problem, 5);
            let run = forward(&mut problem, &density);
            // sub-steps would be a different discretization in time
            assert_eq!(run.path.states.len(), 11);
            -run.value
        };
        let exact = value(LAGRANGE.into());
        let errors: Vec<f64> = [1e3, 1e4, 1e5].map(|e| (exact - value(penalty(e))) / exact).to_vec();
        println!("{shape}: penalty below Lagrange by {errors:?}");
        assert!(errors.iter().all(|&e| e > 0.0), "{errors:?}");
        assert!(errors.windows(2).all(|w| w[1] < 0.15 * w[0]), "{errors:?}");
        for stiffness in [3e3, 1e4] {
            let error = value(augmented(stiffness, 1e-11)) / exact - 1.0;
            println!("{shape}: augmented off by {error:.1e}");
            assert!(error.abs() < 1e-9, "{error:e}");
        }
    }
}
