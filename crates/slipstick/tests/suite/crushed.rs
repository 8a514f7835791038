//! Void that fails a march, that holds pieces of a design, or is stiffer than what touches it, and what
//! the program says about it.

use crate::common::*;
use slipstick::check::{NoticeKind, inspect};
use slipstick::crushed::CURE;
use slipstick::design::ElementValues;
use slipstick::path::{Silent, StateError};
use slipstick::run::FailureReport;

/// A block whose middle layer is void, pressed together and sheared in one step.
const CASE: &str = r#"
[[body]]
name = "block"
box = { min = [0, 0, 0], max = [1, 1.5, 1], elements = [2, 3, 2] }
material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[dirichlet]]
set = "block_ymin"
[[dirichlet]]
set = "block_ymax"
motion = [{ t = 1.0, u = [0.5, -0.6, 0] }]
[load_path]
steps = 1
max_cutbacks = 0
[design]
bodies = ["block"]
initial = 0.6
passive_void = [{ min = [0, 0.5, 0], max = [1, 1, 1] }]
volume_fraction = 0.6
[[quantity]]
name = "push"
reaction = { set = "block_ymax", component = "y" }
[objective]
minimise = { quantity = "push" }
[optimizer]
iterations = 1
"#;

/// Void that inverts is named with its cure, and the cure works; solid elements that invert are not.
#[test]
fn void_that_inverts_has_a_cure() {
    let mut case = problem(CASE);
    let density = case.initial_density().clone();
    let error = case.analysis.forward(&density, &mut Silent).expect_err("void inverts");
    let report = FailureReport::new(&error, &case);
    assert_eq!(report.cures.first().map(String::as_str), Some(CURE), "{report}");
    let inverted = |elements: &[u32]| StateError::InvertedElements { elements: elements.to_vec() };
    // elements 2, 3, 8 and 9 are the layer; the others are solid or grey
    let crushed = |errors: &[StateError]| case.crushed_void(&density, errors.iter());
    assert_eq!(crushed(&[inverted(&[0, 1])]), None);
    let found = crushed(&[inverted(&[0, 1]), inverted(&[1, 3]), inverted(&[8])]).expect("void");
    assert_eq!((found.attempts, found.element, found.body.as_str()), (2, 3, "block"));
    // a facet of the layer, and one of the solid
    let facet = |y: [f64; 2]| {
        let on = |x: &[f64; 3]| x[0] == 0.0 && x[2] <= 0.5 && y.contains(&x[1]);
        let nodes = (0u32..).zip(&case.mesh.nodes).filter(|(_, x)| on(x)).map(|(n, _)| n);
        StateError::FoldedFacet { nodes: nodes.collect() }
    };
    assert_eq!(crushed(&[facet([0.0, 0.5])]), None);
    assert_eq!(crushed(&[facet([0.5, 1.0])]).map(|found| found.element), Some(2));

    let cured = CASE.replace("[design]", "[design]\nenergy_interpolation = {}");
    let mut case = problem(&cured);
    assert_eq!(case.crushed_void(&density, [inverted(&[2])].iter()), None);
    assert!(case.analysis.forward(&density, &mut Silent).is_ok());
}

/// The block with this density in its middle layer; everything else is solid.
fn layered_with_cap(case: &slipstick::problem::Problem, middle: f64) -> ElementValues {
    let centroids = case.mesh.centroids();
    let of = |c: &[f64; 3]| if (0.5..1.0).contains(&c[1]) { middle } else { 1.0 };
    centroids.iter().map(of).collect::<Vec<f64>>().into()
}

/// Of three layers, the middle one is void: the one above hangs on nothing unless it touches a support.
/// Grey material holds, void does not.
#[test]
fn loose_pieces_are_found() {
    let case = problem(CASE);
    let at = |e: usize| case.mesh.centroids()[e];
    let layered = |[bottom, middle, top]: [f64; 3]| -> ElementValues {
        let of = |e: usize| {
            if at(e)[1] < 0.5 {
                bottom
            } else if at(e)[1] < 1.0 {
                middle
            } else {
                top
            }
        };
        (0..case.mesh.elements.len()).map(of).collect::<Vec<f64>>().into()
    };
    // both ends are prescribed
    assert_eq!(case.loose_pieces(&layered([1.0, 0.0, 1.0])), None);
    // only the bottom is
    let bottom = CASE.replacen("[[dirichlet]]\nset = \"block_ymin\"\n", "", 1).replace("block_ymax", "block_ymin");
    let free = problem(&bottom);
    let found = free.loose_pieces(&layered([1.0, 0.1, 1.0])).expect("the top is loose");
    assert_eq!((found.pieces, found.elements, found.body.as_str()), (1, 4, "block"));
    assert!(found.at[1] > 1.0, "{found}");
    assert_eq!(free.loose_pieces(&layered([1.0, 0.35, 1.0])), None);
    // a symmetry plane does not count as a support
    let half = problem(&(bottom.clone() + "[[symmetry]]\nnormal = \"z\"\nat = 0\n"));
    assert_eq!(half.loose_pieces(&layered([1.0, 0.1, 1.0])).map(|found| found.elements), Some(4));
    // a tie to a body that nothing holds does not hold, a tie to one that is held does
    let tied = "[[body]]\nname = \"cap\"\nbox = { min = [0, 1.5, 0], max = [1, 2, 1], elements = [3, 1, 3] }\n\
                material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }\n\
                [[contact]]\nslave = \"cap_ymin\"\nmaster = \"block_ymax\"\ntied = true\n";
    let capped = problem(&(bottom.clone() + tied));
    assert_eq!(capped.loose_pieces(&layered_with_cap(&capped, 0.1)).map(|found| found.elements), Some(13));
    assert_eq!(capped.loose_pieces(&layered_with_cap(&capped, 0.35)), None);
    let held = problem(&(bottom.clone() + tied + "[[dirichlet]]\nset = \"cap_ymax\"\n"));
    assert_eq!(held.loose_pieces(&layered_with_cap(&held, 0.1)), None);
    // grey elements alone do not count as a piece
    assert_eq!(free.loose_pieces(&layered([1.0, 0.1, 0.4])), None);
}

/// E_void = 1e-3 · 20000 = 20 against rubber with E = 5: a hundredth of the ratio is 2.5e-6.
#[test]
fn void_stiffer_than_what_touches_it() {
    let text = |min: &str| {
        format!(
            r#"
[[body]]
name = "pad"
box = {{ min = [0, 0, 0], max = [1, 1, 1], elements = [1, 1, 1] }}
material = {{ neo_hooke = {{ youngs_modulus = 5.0, poisson_ratio = 0.3 }} }}
[[body]]
name = "cover"
box = {{ min = [0, 1, 0], max = [1, 2, 1], elements = [1, 1, 1] }}
material = {{ neo_hooke = {{ youngs_modulus = 20000.0, poisson_ratio = 0.3 }} }}
[[contact]]
slave = "pad_ymax"
master = "cover_ymin"
friction = 0.3
[[dirichlet]]
set = "pad_ymin"
[[dirichlet]]
set = "cover_ymax"
[load_path]
steps = 1
[design]
bodies = ["cover"]
initial = 0.5
simp = {{ p = 3, min = {min} }}
"#
        )
    };
    let found = |min: &str| {
        let case = slipstick::case::parse_case(&text(min), "case").expect("a case").case;
        let notices = inspect(&case, &mut problem(&text(min))).expect("inspected").notices;
        notices.into_iter().find(|notice| notice.kind == NoticeKind::StiffVoid)
    };
    let notice = found("1e-3").expect("a notice");
    assert!(
        notice.message.contains("`cover` (Young's modulus 20") && notice.message.contains("`pad`"),
        "{}",
        notice.message
    );
    assert!(notice.help.contains("2e-6") || notice.help.contains("3e-6"), "{}", notice.help);
    assert_eq!(found("2e-4"), None);
}

/// An optimization goes on with void that follows linear elasticity where void makes a path fail: as one that
/// interpolates from there on, and bit for bit when it resumes.
#[test]
fn an_optimization_survives_void_that_inverts() {
    let run = |text: &str| {
        let case = slipstick::case::parse_case(text, "case.toml").expect("a case").case;
        let mut optimization = slipstick::build::optimization(&case, problem(text)).expect("an optimization");
        optimization.set_iterations(2);
        optimization
    };
    let mut rescued = run(CASE);
    let mut resumed = run(CASE);
    let mut interpolated = run(&CASE.replace("[design]", "[design]\nenergy_interpolation = {}"));
    for number in 0..3 {
        let copy = serde_json::to_string(&rescued.state).expect("JSON");
        resumed.state = serde_json::from_str(&copy).expect("a state");
        rescued.advance(&mut Silent).expect("goes on");
        interpolated.advance(&mut Silent).expect("goes on");
        resumed.advance(&mut Silent).expect("goes on");
        assert_eq!(rescued.state.history[number].objective, resumed.state.history[number].objective);
        assert_eq!(rescued.state.x, resumed.state.x);
        assert_eq!(rescued.state.x, interpolated.state.x);
    }
    let since = rescued.state.interpolation.as_ref().expect("interpolates");
    assert_eq!((since.from, since.void.body.as_str()), (0, "block"));
    assert_eq!(interpolated.state.interpolation, None);
}
