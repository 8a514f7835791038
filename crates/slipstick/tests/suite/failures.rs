//! The explanation of a failed analysis for a singular matrix and for gaps that nothing can close:
//! which node and direction, what holds it, which contact pair acts there, and how to fix it. Each
//! case really fails.

use crate::common::*;
use slipstick::analysis::AnalysisError;
use slipstick::model::Unknown;
use slipstick::run::FailureReport;
use slipstick_path::{Silent, StateError, StepFailureKind};

/// A block above a slab of one element; `more` goes before the load path.
fn block_and_slab(gap: f64, more: &str) -> String {
    format!(
        r#"
[[body]]
name = "slab"
box = {{ min = [0, 0, 0], max = [1, 1, 1], elements = [1, 1, 1] }}
material = {{ neo_hooke = {{ youngs_modulus = 1000, poisson_ratio = 0.3 }} }}
[[body]]
name = "block"
box = {{ min = [0, {:?}, 0], max = [1, {:?}, 1], elements = [2, 1, 2] }}
material = {{ neo_hooke = {{ youngs_modulus = 1000, poisson_ratio = 0.3 }} }}
[[dirichlet]]
set = "slab_ymin"
{more}
[load_path]
steps = 2
max_cutbacks = 1
"#,
        1.0 + gap,
        2.0 + gap
    )
}

fn pair(friction: f64, enforcement: &str) -> String {
    format!(
        "[[contact]]\nslave = \"block_ymin\"\nmaster = \"slab_ymax\"\nfriction = {friction:?}\nenforcement = {enforcement}\n"
    )
}

const LAGRANGE: &str = "{ lagrange = {} }";

const PRESSURE: &str = "[[load]]\nsurface = \"block_ymax\"\npressure = 1\n";

/// Explains why a case fails; all of `parts` occur in the explanation, which does not mention
/// unknowns by number.
fn explained(text: &str, parts: &[&str]) -> (FailureReport, StepFailureKind) {
    let mut problem = problem(text);
    let density = problem.initial_density().clone();
    let error = problem.analysis.forward(&density, &mut Silent).map(drop).expect_err("it fails");
    let report = FailureReport::new(&error, &problem);
    let AnalysisError::March(failure) = &error else { panic!("{error}") };
    let kind = failure.attempts.last().expect("an attempt").1.clone();
    let told = report.to_string();
    println!("{told}\n");
    for part in parts {
        assert!(told.contains(part), "`{part}` is missing in:\n{told}");
    }
    assert!(!told.contains("unknown"), "{told}");
    (report, kind)
}

fn singular(text: &str, parts: &[&str]) -> FailureReport {
    let (report, kind) = explained(text, parts);
    assert!(matches!(kind, StepFailureKind::Singular { .. }), "{kind:?}");
    report
}

fn unheld(text: &str, parts: &[&str]) -> FailureReport {
    let (report, kind) = explained(text, parts);
    assert!(matches!(kind, StepFailureKind::State(StateError::Unheld { .. })), "{kind:?}");
    assert_eq!(report.attempts.len(), 1, "no smaller increment helps");
    report
}

/// Neither support nor contact: the free body is named, together with all its motions.
#[test]
fn a_free_body() {
    let report = unheld(
        &block_and_slab(0.1, PRESSURE),
        &[
            "nothing holds body `block` against its load along −y",
            "of body `block` at (",
            "no support holds node ",
            "no support prevents any rigid motion of body `block`",
            "help: a support (`[[dirichlet]]`) of body `block` against any rigid motion",
        ],
    );
    assert_eq!(report.places[0].body, "block");
    assert_eq!(report.cures.len(), 1, "{:?}", report.cures);
}

/// The motions left free at the end of a path, and the contact force.
fn left_free(text: &str) -> (Vec<String>, f64) {
    let mut problem = problem(text);
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let nodes = contact_path(&mut problem, &run).pop().expect("a state");
    let force = nodes.iter().map(|at| at.multiplier[0] * at.covered_area).sum();
    (run.path.states.last().expect("a state").report.left_free.clone(), force)
}

/// A rigid body that may turn on the slab without friction: without a load it does not, and the
/// rotation is named.
#[test]
fn a_rigid_body_that_may_turn() {
    let held = "[[dirichlet]]\nset = \"block\"\ncomponents = [\"x\", \"y\", \"z\", \"rx\", \"rz\"]\n";
    let pair = "[[contact]]\nslave = \"slab_ymax\"\nmaster = \"block_ymin\"\nfriction = 0.0\n";
    let material = "material = { neo_hooke = { youngs_modulus = 1000, poisson_ratio = 0.3 } }\n";
    let text = block_and_slab(0.0, &format!("{held}{pair}"));
    let block = text.rfind(material).expect("the material of the block");
    let (free, _) = left_free(&format!("{}rigid = {{}}\n{}", &text[..block], &text[block + material.len()..]));
    assert_eq!(free, ["`block` about y"]);
}

/// A load moves a body up to the pair that holds it: the contact force is the load on the area of 1.
/// Pulled the other way, the body is held by nothing: the direction and the pair are named.
#[test]
fn a_body_before_it_touches() {
    let held = "[[dirichlet]]\nset = \"block_xmin\"\ncomponents = [\"x\"]\n[[dirichlet]]\nset = \"block_xmax\"\ncomponents = [\"x\"]\n[[dirichlet]]\nset = \"block_zmin\"\ncomponents = [\"z\"]\n";
    let (free, force) = left_free(&block_and_slab(0.1, &format!("{}{PRESSURE}{held}", pair(0.3, LAGRANGE))));
    assert!(free.is_empty() && (force - 1.0).abs() < 1e-3, "{free:?} {force}");
    unheld(
        &block_and_slab(0.1, &format!("{}{}{held}", pair(0.3, LAGRANGE), PRESSURE.replace("= 1", "= -1"))),
        &[
            "nothing holds body `block` against its load along y",
            "no support prevents motion along y of body `block`",
            "contact pair `block_ymin` on `slab_ymax`, closed at 0 of 9 slave nodes",
            "help: a support (`[[dirichlet]]`) of body `block` against motion along y",
            "help: bodies that touch from the start, if contact pair `block_ymin` on `slab_ymax` is to hold body `block`",
        ],
    );
}

/// A hinge: one edge of the block is held, and it may turn about it.
#[test]
fn a_mechanism() {
    let hinge = "[[set]]\nname = \"edge\"\nboxes = [{ min = [-0.1, 2.05, -0.1], max = [0.1, 2.2, 1.1] }]\n[[dirichlet]]\nset = \"edge\"\n[[load]]\nsurface = \"block_ymax\"\ntraction = [0, -1, 0]\n";
    unheld(
        &block_and_slab(0.1, hinge),
        &[
            "no support prevents rotation about z of body `block`",
            "help: a support (`[[dirichlet]]`) of body `block` against rotation about z",
        ],
    );
}

/// By hand: a tie holds a block as supports do, and so does a spring in each direction at four corners;
/// contact does not, nor a support that has ended.
#[test]
fn what_holds_a_body_besides_contact() {
    let held = |more: &str| {
        let problem = problem(&block_and_slab(0.0, more));
        let model = problem.analysis.model();
        model.is_held_without_contact("block", &model.rest().unknowns, 1.0.into())
    };
    let tied = "[[contact]]\nslave = \"block_ymin\"\nmaster = \"slab_ymax\"\ntied = true\n";
    assert!(!held(&pair(0.3, LAGRANGE)));
    assert!(held(tied));
    assert!(held("[[dirichlet]]\nset = \"block_ymax\"\n"));
    assert!(!held("[[dirichlet]]\nset = \"block_ymax\"\ncomponents = [\"y\"]\n"));
    assert!(!held("[[dirichlet]]\nset = \"block_ymax\"\nmotion = [{ t = 0.5, u = [0, 0, 0] }]\nuntil = 0.5\n"));
    assert!(held("[[spring]]\nname = \"bed\"\nset = \"block_ymax\"\nstiffness = 10\n"));
}

/// Closed contact without friction holds a body only along its normal. Nothing moves the body along the
/// surface, so it stays where it is; a force would.
#[test]
fn a_body_that_slides_freely() {
    let text = block_and_slab(0.0, &format!("{}{PRESSURE}", pair(0.0, LAGRANGE)));
    let (free, force) = left_free(&text);
    assert_eq!(free, ["`block` along x, z and about y"]);
    assert!((force - 1.0).abs() < 1e-3, "{force}");
    let dragged = "[[load]]\nsurface = \"block_ymax\"\ntraction = [0.01, 0, 0]\n";
    let report = unheld(
        &text.replace("[load_path]", &format!("{dragged}[load_path]")),
        &[
            "nothing holds body `block` against its load along x",
            "contact pair `block_ymin` on `slab_ymax`, closed at 9 of 9 slave nodes",
            "help: friction (`contact.friction`) in contact pair `block_ymin` on `slab_ymax`",
        ],
    );
    assert_eq!(report.cures[0], "a support (`[[dirichlet]]`) of body `block` against motion along x");
}

/// Nine slave nodes that are prescribed along the normal, against one element whose left half is
/// held: nine gaps and only two free displacements.
#[test]
fn contradicting_contact_conditions() {
    let pressed = "motion = [{ t = 1, u = [0, -0.1, 0] }]\n";
    let held = "[[dirichlet]]\nset = \"slab_xmin\"\n[[dirichlet]]\nset = \"slab_xmax\"\ncomponents = [\"x\", \"z\"]\n";
    let driven =
        format!("[[dirichlet]]\nset = \"block_ymin\"\n{pressed}[[dirichlet]]\nset = \"block_ymax\"\n{pressed}{held}");
    let report = singular(
        &block_and_slab(0.0, &format!("{}{driven}", pair(0.3, LAGRANGE))),
        &[
            "nothing determines the normal contact traction along y of contact pair `block_ymin` on `slab_ymax`",
            "is held along x, y and z by `block_ymin`",
            "all opposite master nodes are held along x and z by `slab_xmin`, `slab_xmax`",
            "contact pair `block_ymin` on `slab_ymax` imposes 9 conditions at its closed nodes, on 2 free displacements",
            "not held along y by `block_ymin`: contact pair `block_ymin` on `slab_ymax` also constrains it along y",
            "help: slave and master of `block_ymin` on `slab_ymax` exchanged",
        ],
    );
    assert_eq!(report.places[0].position[1], 1.0);
}

/// Both surfaces are prescribed along the normal and pushed through each other: no multiplier can
/// close the gap, and a multiplier of zero would hide it. The penalty method has a force: stiffness
/// times depth times area.
#[test]
fn prescribed_penetration() {
    let driven = "[[dirichlet]]\nset = \"block_ymin\"\nmotion = [{ t = 1, u = [0, -0.1, 0] }]\n[[dirichlet]]\nset = \"block_ymax\"\n[[dirichlet]]\nset = \"slab_ymax\"\ncomponents = [\"y\"]\n";
    for enforcement in [LAGRANGE, "{ augmented = {} }", "{ augmented = { acceleration = 0 } }"] {
        for gap in [0.0, 0.06] {
            let (report, kind) = explained(
                &block_and_slab(gap, &format!("{}{driven}", pair(0.3, enforcement))),
                &[
                    "prescribed displacements push slave node ",
                    "is held along x, y and z by `block_ymin`",
                    "all opposite master nodes are held along y by `slab_ymax`",
                    "contact pair `block_ymin` on `slab_ymax` acts along y, where no displacement of either surface is free",
                    "help: one surface of `block_ymin` on `slab_ymax` left free along its normal (`block_ymin`, `slab_ymax`)",
                    "help: the penalty method for `block_ymin` on `slab_ymax`",
                ],
            );
            let StepFailureKind::State(StateError::PrescribedPenetration { node, depth }) = kind else {
                panic!("{kind:?}")
            };
            // the first step presses by 0.05, the second one by 0.1
            let (step, expected) = if gap == 0.0 { (1, 0.05) } else { (2, 0.04) };
            assert_eq!((report.step, report.places[0].number), (Some(step), node));
            assert!((depth - expected).abs() < 1e-9, "{depth}");
            assert_eq!(report.attempts.len(), 1, "no other way to the step helps");
        }
    }
    let text = block_and_slab(0.0, &format!("{}{driven}", pair(0.0, "{ penalty = { stiffness = 40 } }")));
    let mut problem = problem(&text);
    let density = problem.initial_density().clone();
    let run = forward(&mut problem, &density);
    let nodes = contact_path(&mut problem, &run).pop().expect("a state");
    let force: f64 = nodes.iter().map(|at| at.multiplier[0] * at.covered_area).sum();
    assert!((force - 40.0 * 0.1).abs() < 1e-9, "{force}");
}

/// Surfaces that are held where they touch, without a gap, are not an error: the multiplier is
/// zero.
#[test]
fn prescribed_touch() {
    let driven = "[[dirichlet]]\nset = \"block_ymin\"\nmotion = [{ t = 1, u = [0.01, 0, 0] }]\n[[dirichlet]]\nset = \"block_ymax\"\n[[dirichlet]]\nset = \"slab_ymax\"\ncomponents = [\"y\"]\n";
    for enforcement in [LAGRANGE, "{ augmented = {} }"] {
        let mut problem = problem(&block_and_slab(0.0, &format!("{}{driven}", pair(0.3, enforcement))));
        let density = problem.initial_density().clone();
        let run = forward(&mut problem, &density);
        assert!(status_path(&mut problem, &run).iter().all(|statuses| statuses == "ooooooooo"));
    }
}

/// Unknowns are numbered by nodes, then slave nodes; supports of a node are all sets and planes
/// that hold it.
#[test]
fn unknowns_and_supports_have_names() {
    let more = format!(
        "{}[[dirichlet]]\nset = \"block_zmin\"\ncomponents = [\"z\"]\n[[dirichlet]]\nset = \"block_ymin\"\ncomponents = [\"z\"]\n[[symmetry]]\nnormal = \"x\"\nat = 0\n",
        pair(0.3, LAGRANGE)
    );
    let problem = problem(&block_and_slab(0.0, &more));
    let (model, count) = (problem.analysis.model(), problem.mesh.nodes.len());
    assert_eq!(model.unknown(3 * 5 + 1), Some(Unknown::Displacement { node: 5, axis: 1 }));
    assert_eq!(model.unknown(3 * (count + 2)), Some(Unknown::Multiplier { row: 2, component: 0 }));
    assert_eq!(model.unknown(3 * (count + 9)), None);
    let at = |place: [f64; 3]| {
        let bodies = problem.mesh.bodies[1].nodes.clone();
        bodies.into_iter().find(|&n| problem.mesh.nodes[n] == place).expect("a node") as u32
    };
    let corner = at([0.0, 1.0, 0.0]);
    assert_eq!(model.holders(&[corner], 2), ["`block_zmin`", "`block_ymin`"]);
    assert_eq!(model.holders(&[corner], 0), ["a symmetry plane"]);
    assert_eq!(model.holders(&[corner], 1), [""; 0]);
    assert_eq!(model.holders(&[corner, at([1.0, 2.0, 1.0])], 2), [""; 0]);
    assert_eq!(model.pairs_of(corner), [(0, true)]);
    assert_eq!(model.pair_name(0), "`block_ymin` on `slab_ymax`");
}

/// Nodes of void elements without any stiffness, in a body whose supports prevent every rigid
/// motion.
#[test]
fn void_without_stiffness() {
    let more = "[design]\nbodies = [\"block\"]\nvolume_fraction = 0.5\nsimp = { p = 3, min = 0 }\npassive_void = [{ min = [0, 1, 0], max = [0.5, 2, 0.5] }]\n[[dirichlet]]\nset = \"block_xmax\"\n";
    let report = singular(
        &block_and_slab(0.1, more),
        &["supports prevent every rigid motion of body `block`", "no support holds node "],
    );
    assert!(report.cures.iter().any(|cure| cure.contains("design.simp.min")), "{:?}", report.cures);
}

/// A block of width 1.2 and height 0.7 under the weight W, drawn at its top by a force H that grows to 1.2 W. A rigid
/// block tips over its edge at H = W · 0.6/0.7, and a soft one earlier; with μ = 1.3, it does not slide before. The
/// explanation names the motion about −z, and the load that was reached is below the limit.
#[test]
fn a_block_that_tips_over_is_named_with_its_motion() {
    let text = r#"
[[body]]
name = "slab"
box = { min = [-2, -0.8, -0.5], max = [2, 0, 0.5], elements = [8, 2, 1] }
material = { neo_hooke = { youngs_modulus = 1000, poisson_ratio = 0.3 } }
[[body]]
name = "block"
box = { min = [-0.6, 0, -0.5], max = [0.6, 0.7, 0.5], elements = [4, 2, 1] }
material = { neo_hooke = { youngs_modulus = 1000, poisson_ratio = 0.3 } }
[[contact]]
slave = "block_ymin"
master = "slab_ymax"
friction = 1.3
enforcement = { lagrange = {} }
[[dirichlet]]
set = "slab_ymin"
[[load]]
surface = "block_ymax"
force = [0, -10, 0]
amplitude = [{ t = 0.5, factor = 1 }]
[[load]]
surface = "block_ymax"
force = [12, 0, 0]
amplitude = [{ t = 0.5, factor = 0 }, { t = 1.0, factor = 1 }]
[load_path]
steps = 16
"#;
    let parts = ["only contact holds body `block`", "about −z", "they may exceed what contact can carry"];
    let (report, _) = explained(text, &parts);
    let reached = report.reached.expect("some steps converge");
    let drawn = 1.2 * (reached - 0.5) / 0.5;
    assert!(drawn > 0.5 && drawn < 0.6 / 0.7, "{drawn} of the weight");
    assert!(report.cures[0].starts_with("a smaller load"), "{report}");
}
