//! GCMMA in the optimization loop: candidates are marched until the approximations are
//! conservative.

use crate::common::optimization::{finish, finish_in_pieces, prepared};
use slipstick::case::template;
use slipstick::optimize::IterationRecord;

/// The cube on the cuboid, whose force follows two points of a curve: an objective of large
/// curvature at long steps.
fn text(method: &str) -> String {
    let text = template("cube-on-cuboid").expect("a template").text;
    let (before, _) = text.split_once("[design]").expect("a design");
    format!(
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
    )
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
    let [mma, gcmma] = ["mma", "gcmma"].map(|method| finish(&mut prepared(&text(method))));
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
    let text = text("gcmma");
    let whole = finish(&mut prepared(&text));
    let last = finish_in_pieces(&text, whole.len());
    assert_eq!(last.history, whole);
}
