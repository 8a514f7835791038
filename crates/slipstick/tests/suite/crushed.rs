//! Void that fails a march, and what the program says about it.

use crate::common::*;
use slipstick::crushed::CURE;
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
