//! The user's steps to which the states of a path belong.

use slipstick_path::Path;

/// For every state of a path, the user's step, through all load cases, that it completes or belongs
/// to; 0 for states of rest.
pub(crate) fn steps_of(path: &Path) -> Vec<usize> {
    let mut step = path.steps;
    let mut steps: Vec<usize> = path
        .states
        .iter()
        .rev()
        .map(|state| {
            step = state.completes.unwrap_or(step);
            if state.rest { 0 } else { step }
        })
        .collect();
    steps.reverse();
    steps
}
