//! Nodes that the other surface reaches within a step, of which no row was there before: their slip is
//! that of the bodies, so friction acts at once.

use super::gradients::check;
use crate::common::scene::{LAGRANGE, augmented, penalty};
use crate::common::{forward, problem};
use slipstick::build::Problem;

/// A cylinder of radius 10, pressed into a block by 0.3 in `presses` steps and then moved along it, beyond the part of
/// the block that it covered, in `slides` steps.
fn rolled(enforcement: &str, roller: &str, [presses, slides]: [usize; 2]) -> Problem {
    let steps = presses + slides;
    let (drive, side) = if roller.contains("rigid") { ("roller", "side") } else { ("roller_inner", "outer") };
    problem(&format!(
        r#"
[[body]]
name = "block"
box = {{ min = [0, -8, 0], max = [80, 0, 4], elements = [40, 4, 1] }}
material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}
[[body]]
name = "roller"
{roller}
place = {{ rotate = {{ axis = [1, 0, 0], degrees = 90 }}, translate = [20, 10, -1] }}
[[contact]]
slave = "block_ymax"
master = "roller_{side}"
sides = "as_given"
friction = 0.3
enforcement = {enforcement}
[[dirichlet]]
set = "block_ymin"
[[dirichlet]]
set = "{drive}"
motion = [{{ t = {}, u = [0, -0.3, 0] }}, {{ t = 1.0, u = [30, -0.3, 1] }}]
[load_path]
steps = {steps}
"#,
        presses as f64 / steps as f64,
    ))
}

const RIGID: &str = "cone = { bottom_radius = 10, top_radius = 10, height = 6, elements = [4, 4, 1] }\nrigid = {}";
const ELASTIC: &str = "hollow_cylinder = { inner_radius = 5, outer_radius = 10, height = 6, elements = [3, 64, 1] }
material = { neo_hooke = { youngs_modulus = 2000.0, poisson_ratio = 0.3 } }";

/// Coulomb's law: all nodes slide, so their friction forces are 0.3 of their normal forces, along the
/// motion of the roller.
#[test]
fn a_roller_that_moves_beyond_its_contact_in_one_step_has_friction() {
    for enforcement in [LAGRANGE.into(), "{ penalty = {} }".into(), "{ augmented = {} }".to_owned()] {
        for (roller, slides) in [(RIGID, 4), (RIGID, 2), (RIGID, 1), (ELASTIC, 2), (ELASTIC, 1)] {
            let mut problem = rolled(&enforcement, roller, [3, slides]);
            let density = problem.initial_density().clone();
            let path = forward(&mut problem, &density).path;
            let found = slipstick::quantities::quantities(&problem, &path);
            let of = |name: &str| found.get(&format!("block_ymax_{name}")).expect("it is reported");
            for step in 4..=3 + slides {
                let (normal, friction) = (of("normal_force")[step], of("friction_force")[step]);
                assert!(normal > 100.0 && of("stick")[step] == 0.0, "{enforcement}, {slides}: {normal}");
                assert!((friction / normal - 0.3).abs() < 1e-6, "{enforcement}, {slides}: {friction} of {normal}");
                assert!(of("force_x")[step] > 0.29 * normal, "{enforcement}, {slides}");
            }
        }
    }
}

/// How a roller is held and driven in the test of gradients, over a path of three load steps of which the first presses
/// it on.
struct Drive {
    name: &'static str,
    roller: &'static str,
    /// Supports and loads of the roller.
    text: &'static str,
}

/// With oblique motions, so that the direction of friction depends on the design. Where a force presses the roller on,
/// only contact holds it along y.
const DRIVES: [Drive; 4] = [
    Drive {
        name: "rigid, driven",
        roller: RIGID,
        text: "[[dirichlet]]
set = 'roller'
motion = [{ t = 0.333333333333, u = [0, -0.3, 0] }, { t = 1.0, u = [30, -0.3, 1] }]",
    },
    Drive {
        name: "elastic, driven",
        roller: RING,
        text: "[[dirichlet]]
set = 'roller_inner'
motion = [{ t = 0.333333333333, u = [0, -0.3, 0] }, { t = 1.0, u = [30, -0.3, 1] }]",
    },
    Drive {
        name: "elastic, held by contact along y",
        roller: RING,
        text: "[[dirichlet]]
set = 'roller_inner'
components = ['x', 'z']
motion = [{ t = 0.333333333333, u = [0, 0, 0] }, { t = 1.0, u = [30, 0, 1] }]
[[load]]
surface = 'roller_inner'
force = [0, -400, 0]
amplitude = [{ t = 0.333333333333, factor = 1 }]",
    },
    Drive {
        name: "rigid, held by contact along y",
        roller: RIGID,
        text: "[[dirichlet]]
set = 'roller'
components = ['x', 'z', 'rx', 'ry', 'rz']
motion = [{ t = 0.333333333333, u = [0, 0, 0] }, { t = 1.0, u = [30, 0, 1] }]
[[load]]
surface = 'roller'
force = [0, -400, 0]
amplitude = [{ t = 0.333333333333, factor = 1 }]",
    },
];

const RING: &str = "hollow_cylinder = { inner_radius = 5, outer_radius = 10, height = 6, elements = [2, 32, 1] }
material = { neo_hooke = { youngs_modulus = 2000.0, poisson_ratio = 0.3 } }";

/// Central differences of the whole path, with nodes that are open before the last step and slide or stick after it.
#[test]
fn gradient_of_nodes_that_are_reached_within_a_step() {
    for drive in &DRIVES {
        for (method, enforcement) in
            [("Lagrange", LAGRANGE.into()), ("penalty", penalty(1e3)), ("augmented", augmented(1e3, 1e-11))]
        {
            let name = format!("{}, {method}", drive.name);
            let mut problem = problem(&drive.text(&enforcement));
            let (statuses, _) = check(&name, &mut problem);
            let [.., before, last] = &statuses[..] else { panic!("two states") };
            let reached = before.iter().zip(last).filter(|(before, last)| **before == 'o' && **last != 'o').count();
            assert!(reached > 0, "{name}: {statuses:?}");
        }
    }
}

impl Drive {
    fn text(&self, enforcement: &str) -> String {
        let Self { roller, text, .. } = self;
        let side = if roller.contains("rigid") { "side" } else { "outer" };
        format!(
            r#"
[[body]]
name = "block"
box = {{ min = [0, -8, 0], max = [80, 0, 4], elements = [16, 1, 1] }}
material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}
[[body]]
name = "roller"
{roller}
place = {{ rotate = {{ axis = [1, 0, 0], degrees = 90 }}, translate = [20, 10, -1] }}
[[contact]]
slave = "block_ymax"
master = "roller_{side}"
sides = "as_given"
friction = 0.3
enforcement = {enforcement}
[[dirichlet]]
set = "block_ymin"
{text}
[load_path]
steps = 3
tolerance = {{ relative = 1e-12 }}
[design]
bodies = ['block']
initial = 0.6
simp = {{ p = 3, min = 0.01 }}
[objective]
contact_force = {{ steps = 'last' }}
"#
        )
    }
}
