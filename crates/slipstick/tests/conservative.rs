//! GCMMA in the optimization loop: candidates are marched until the approximations are
//! conservative.

mod common;

use common::problem;
use slipstick::build::optimization;
use slipstick::case::parse_case;
use slipstick::case::template;
use slipstick::optimize::{IterationRecord, Optimization, OptimizationState};
use slipstick_path::Silent;

/// The cube on the cuboid, whose force follows two points of a curve: an objective of large
/// curvature at long steps.
fn prepared(method: &str) -> Optimization {
    let text = template("cube-on-cuboid").expect("a template").text;
    let (before, _) = text.split_once("[design]").expect("a design");
    let text = format!(
        "{before}
[design]
bodies = ['cuboid', 'cube']
volume_fraction = 0.5
[[quantity]]
name = 'push'
reaction = {{ set = 'cuboid_ymin', component = 'y' }}
[objective]
follow = {{ quantity = 'push', points = [[0.5, 25.0], [1.0, 20.0]] }}
[optimizer]
iterations = 8
method = '{method}'
mma = {{ move_limit = 0.5 }}
"
    );
    let case = parse_case(&text, "case.toml").unwrap_or_else(|e| panic!("{e}")).case;
    optimization(&case, problem(&text)).unwrap()
}

fn finish(optimization: &mut Optimization) -> Vec<IterationRecord> {
    while !optimization.finished() {
        optimization.advance(&mut Silent).unwrap();
    }
    optimization.state.history.clone()
}

/// Whether no feasible design is followed by an infeasible one or by one with a larger objective,
/// up to the tolerance by which approximations are judged.
fn is_monotone(history: &[IterationRecord]) -> bool {
    history.windows(2).all(|pair| {
        let [before, after] = pair else { return false };
        before.violation > 1e-6
            || after.violation <= 1e-6 && after.objective <= before.objective + 1e-6 * before.objective.abs()
    })
}

/// MMA rises and falls on this problem; GCMMA only falls, by inner iterations.
#[test]
fn gcmma_is_monotone_where_mma_is_not() {
    let [mma, gcmma] = ["mma", "gcmma"].map(|method| finish(&mut prepared(method)));
    assert!(!is_monotone(&mma) && mma.iter().all(|record| record.inner_iterations == 0));
    assert!(is_monotone(&gcmma), "{gcmma:?}");
    let inner: usize = gcmma.iter().map(|record| record.inner_iterations).sum();
    assert!(inner >= 8, "{inner}");
    let marched = gcmma.iter().filter(|record| record.inner_iterations > 0);
    assert!(marched.clone().count() > 2 && marched.clone().all(|record| record.failed_iterations > 0));
    let last = |history: &[IterationRecord]| history.last().map(|record| record.objective).unwrap_or_default();
    assert!(last(&gcmma) < 0.2 * last(&mma), "{} {}", last(&gcmma), last(&mma));
}

/// After every iteration, an optimization continues bit for bit from its written state and the path
/// of the last design, also if the next design is found by inner iterations.
#[test]
fn gcmma_continues_from_its_state() {
    let whole = finish(&mut prepared("gcmma"));
    let mut state: Option<String> = None;
    let mut guide = None;
    for _ in 0..whole.len() {
        let mut part = prepared("gcmma");
        if let Some(text) = &state {
            part.state = serde_json::from_str::<OptimizationState>(text).unwrap();
        }
        part.problem.analysis.guide = guide;
        part.advance(&mut Silent).unwrap();
        guide = part.problem.analysis.guide.take();
        state = Some(serde_json::to_string(&part.state).unwrap());
    }
    let last: OptimizationState = serde_json::from_str(&state.unwrap()).unwrap();
    assert_eq!(last.history, whole);
}
