//! Objectives that are only round-off end an optimization, and earlier results are kept.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use slipstick::analysis::{AnalysisError, ForwardNotice};
use slipstick::build::{build, optimization};
use slipstick::case::parse_case;
use slipstick::optimize::{Optimization, OptimizeError};
use slipstick_design::quantity::{ContactForce, Dimension, Quantity, StateDerivative, StateView};
use slipstick_design::{ObservedSteps, Response};
use slipstick_path::Silent;

/// A block pressed onto a slab that is designed, or lifted off it.
fn case(down: f64, objective: &str) -> String {
    let material = "material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";
    format!(
        "[[body]]\nname = 'slab'\nbox = {{ min = [0, 0, 0], max = [4, 1, 2], elements = [4, 2, 2] }}\n{material}\n\
         [[body]]\nname = 'block'\nbox = {{ min = [0.6, 1.0, 0.3], max = [2.0, 1.7, 1.6], elements = [2, 1, 2] }}\n{material}\n\
         [[contact]]\nslave = 'block_ymin'\nmaster = 'slab_ymax'\nfriction = 0.3\n[[dirichlet]]\nset = 'slab_ymin'\n\
         [[dirichlet]]\nset = 'block_ymax'\nmotion = [{{ t = 1.0, u = [0, {:?}, 0] }}]\n[load_path]\nsteps = 2\n\
         [[load]]\nsurface = 'slab_xmax'\ntraction = [1, 0, 0]\n\
         [design]\nbodies = ['slab']\nvolume_fraction = 0.5\n[objective]\n{objective}\n[optimizer]\niterations = 3\n",
        -down
    )
}

fn prepared(text: &str) -> Optimization {
    let resolved = parse_case(text, "case.toml").unwrap_or_else(|e| panic!("{e}"));
    optimization(&resolved.case, build(&resolved.case).unwrap()).unwrap()
}

/// The contact force, but only round-off after it is lost.
struct Lost {
    force: ContactForce,
    lost: Arc<AtomicBool>,
}

impl Quantity for Lost {
    fn name(&self) -> &str {
        "lost"
    }

    fn dimension(&self) -> Dimension {
        Dimension::FORCE
    }

    fn value(&self, state: &StateView) -> f64 {
        // the remainder of a force after round-off
        let factor = if self.lost.load(Ordering::SeqCst) { 1e-16 } else { 1.0 };
        factor * self.force.value(state)
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        self.force.pull_back(state, weight, to);
    }
}

/// Contact that remains open is an error at once, whatever the value: with a load on the slab, its
/// slave nodes have residual forces of the size of the tolerance.
#[test]
fn open_contact_is_no_objective() {
    let mut open = prepared(&case(-0.1, "contact_force = { steps = 'all' }"));
    let Err(OptimizeError::Rounding(forward)) = open.advance(&mut Silent) else { panic!("no contact, no objective") };
    let rounding = forward.rounding.expect("says so");
    assert_eq!(rounding.notice, Some(ForwardNotice::ContactNeverCloses));
    assert!(
        rounding.value.abs() < 1e-6 && rounding.to_string().contains("contact never closes on the path"),
        "{rounding}"
    );
    assert_eq!(forward.path.steps, 2, "the path is available for writing");
    assert!(open.state.history.is_empty() && open.state.iteration == 0);
}

/// Friction dissipates work before contact opens, so that work is an objective although contact is
/// open at the step that observes it.
#[test]
fn work_done_before_contact_opens_is_an_objective() {
    let text = case(0.0, "minimise = { quantity = 'work' }").replace(
        "motion = [{ t = 1.0, u = [0, -0.0, 0] }]",
        "motion = [{ t = 0.25, u = [0, -0.05, 0] }, { t = 0.75, u = [0.2, -0.05, 0] }, { t = 1.0, u = [0.2, 0.3, 0] }]",
    );
    let text = text.replace("steps = 2", "steps = 8")
        + "[[quantity]]\nname = 'work'\nfriction_work = { slave = 'block_ymin' }\n";
    let mut optimization = prepared(&text);
    let forward = optimization.advance(&mut Silent).expect("work is not round-off");
    assert!(forward.path.states.last().expect("states").active_set.iter().all(|status| !status.is_closed()), "open");
    assert!(forward.value > 1e-3, "{}", forward.value);
}

/// No part of the slave faces the master, so the gap is infinite: an error that names it.
#[test]
fn an_infinite_gap_is_named() {
    let text = case(0.05, "minimise = { quantity = 'gap' }")
        .replace("min = [0.6, 1.0, 0.3], max = [2.0, 1.7, 1.6]", "min = [6.6, 1.0, 0.3], max = [8.0, 1.7, 1.6]");
    let text = text + "[[quantity]]\nname = 'gap'\ngap = { slave = 'block_ymin', measure = 'minimum' }\n";
    let Err(OptimizeError::Analysis(AnalysisError::Infinite { name, step })) = prepared(&text).advance(&mut Silent)
    else {
        panic!("an infinite gap has no derivative")
    };
    assert_eq!((name.as_str(), step), ("gap", 2));
}

/// A value that becomes round-off later ends the optimization there; the earlier iterations remain
/// unchanged.
#[test]
fn finished_iterations_stay() {
    let mut optimization = prepared(&case(0.1, "contact_force = { steps = 'last' }"));
    let lost = Arc::new(AtomicBool::new(false));
    let analysis = &mut optimization.problem.analysis;
    let (slaves, nodes) = (analysis.model().slave_nodes(), optimization.problem.mesh.nodes.len());
    let force = ContactForce::new(slaves, nodes, 0.0).unwrap();
    let lost_force = Lost { force, lost: lost.clone() };
    analysis.set_objective(Response::of(Arc::new(lost_force), ObservedSteps::Last, -1.0)).unwrap();
    for _ in 0..2 {
        assert!(optimization.advance(&mut Silent).unwrap().rounding.is_none());
    }
    let before = serde_json::to_string(&optimization.state).unwrap();
    let evaluated = optimization.evaluated().cloned();
    lost.store(true, Ordering::SeqCst);
    let Err(OptimizeError::Rounding(forward)) = optimization.advance(&mut Silent) else { panic!("rounding") };
    let rounding = forward.rounding.expect("says so");
    // E h u by hand: the elements of the block are smaller, 0.7 × 0.7 × 0.65
    let scale = 1000.0 * (0.7f64 * 0.7 * 0.65).cbrt() * 0.1;
    assert!(
        rounding.notice.is_none() && rounding.scale > scale && rounding.scale < 1.2 * scale,
        "{rounding:?} {scale}"
    );
    assert_eq!(serde_json::to_string(&optimization.state).unwrap(), before);
    assert_eq!(optimization.evaluated(), evaluated.as_ref());
}

/// Work and forces that are small, or independent of contact, do not count as round-off.
#[test]
fn small_objectives_go_on() {
    // contact stays open, but the objective is the work of the load on the slab
    let mut work = prepared(&case(-0.1, "compliance = {}"));
    let forward = work.advance(&mut Silent).unwrap_or_else(|e| panic!("{e}"));
    assert!(forward.notice.is_some() && forward.rounding.is_none() && forward.value > 0.0);
    // pressed by a thousandth of the block's height on a slab of a thousandth of its stiffness,
    // with low density
    let soft = case(1e-3, "contact_force = {}").replacen("youngs_modulus = 1000.0", "youngs_modulus = 1.0", 1);
    let soft = soft.replace("traction = [1, 0, 0]", "traction = [0, 0, 1e-9]");
    let mut soft = prepared(&soft.replace("volume_fraction = 0.5", "volume_fraction = 0.1"));
    let forward = soft.advance(&mut Silent).unwrap_or_else(|e| panic!("{e}"));
    assert!(forward.rounding.is_none() && forward.value < 0.0, "{}", forward.value);
}

/// A nearly incompressible block lifts off: without stress, the residual is round-off of the stiffness
/// against compression, which the scale of forces does not show. Exact: the block moves with its
/// support, and the slab is at rest.
#[test]
fn lift_off_ends_at_round_off() {
    let text = r#"
[[body]]
name = "slab"
box = { min = [0.0, 0.0, 0.0], max = [3.0, 1.0, 2.0], elements = [6, 2, 4] }
material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.49995 } }
element = "f_bar"

[[body]]
name = "block"
box = { min = [0.7, 1.0, 0.5], max = [2.2, 1.8, 1.5], elements = [3, 2, 2] }
material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.49995 } }
element = "f_bar"

[[contact]]
slave = "block_ymin"
master = "slab_ymax"
friction = 0.3

[[dirichlet]]
set = "slab_ymin"

[[dirichlet]]
set = "block_ymax"
motion = [{ t = 0.5, u = [0.0, -0.02, 0.0] }, { t = 1.0, u = [0.0, 0.02, 0.0] }]

[load_path]
steps = 4
"#;
    let mut problem = crate::common::problem(text);
    let density = problem.initial_density().clone();
    let path = problem.analysis.forward(&density, &mut Silent).unwrap().path;
    assert_eq!(path.steps, 4);
    assert!(path.failed_iterations() < 50, "{}", path.failed_iterations());
    let last = path.states.last().unwrap();
    assert!(last.active_set.iter().all(|status| !status.is_closed()), "{:?}", last.active_set);
    let [slab, block] = [0, 1].map(|body| problem.mesh.bodies[body].nodes.clone());
    for (nodes, exact) in [(slab, [0.0; 3]), (block, [0.0, 0.02, 0.0])] {
        for (at, exact) in nodes.flat_map(|node| (0..3).map(move |i| (3 * node + i, exact[i]))) {
            assert!((last.state.unknowns[at] - exact).abs() < 1e-12, "{at}: {}", last.state.unknowns[at]);
        }
    }
}
