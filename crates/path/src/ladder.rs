//! The ladder of attempts at a (sub-)step: which follow a failed one, and in what order.
//!
//! None of them changes the equations, so the adjoint is the same whichever succeeds.

use crate::failure::{StateError, StepFailure, StepFailureKind};
use crate::newton::still_falls;
use crate::problem::{Attempt, StepProblem};
use std::fmt;

/// A rung of the ladder: how an attempt at a (sub-)step iterates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rung {
    /// From a predicted state: that of a guide, or on the line through the last two states.
    Predicted,
    /// From the last state.
    LastState,
    /// From the last state, with another setting of the iteration, such as another c.
    Setting(usize),
    /// Uzawa's iteration over all multipliers, with its settings of this number, and then Newton's
    /// method.
    Held(usize),
}

impl fmt::Display for Rung {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Predicted => write!(f, "from a predicted state"),
            Self::LastState => write!(f, "from the last state"),
            Self::Setting(number) => write!(f, "setting {number} of the iteration"),
            Self::Held(number) => write!(f, "held multipliers {}", number + 1),
        }
    }
}

impl Rung {
    /// The rung of an attempt that starts at a prediction, or at the last state.
    pub(crate) fn of(attempt: Attempt, predicted: bool) -> Self {
        match attempt {
            Attempt::Setting(0) if predicted => Self::Predicted,
            Attempt::Setting(0) => Self::LastState,
            Attempt::Setting(number) => Self::Setting(number),
            Attempt::Rescue(number) => Self::Held(number),
        }
    }
}

/// A failed attempt at a (sub-)step.
#[derive(Debug, Clone, PartialEq)]
pub struct FailedAttempt {
    /// Pseudo-time at the end of the increment.
    pub time: f64,
    /// How it iterated.
    pub rung: Rung,
    /// Why it failed.
    pub kind: StepFailureKind,
    /// Its Newton iterations.
    pub iterations: usize,
}

/// Newton iterations that failed attempts at a step may take before its increment is halved no
/// further, in units of the costliest single solve: the maximum of an attempt, or the previous
/// state's own iterations if these were more. Steps that converge at all need up to about half of it.
const PATIENCE: usize = 20;

/// Whether attempts at a step have cost so much that smaller increments are no longer tried.
/// `neighbour` is the cost of the last accepted state.
pub(crate) fn is_exhausted(tried: &[FailedAttempt], neighbour: usize, max_iterations: usize) -> bool {
    iterations_of(tried) > PATIENCE * max_iterations.max(neighbour)
}

/// Newton iterations of failed attempts.
pub(crate) fn iterations_of(tried: &[FailedAttempt]) -> usize {
    tried.iter().map(|failed| failed.iterations).sum()
}

/// Returns the attempt after `last`, which started from the last state and failed: the next
/// setting, or held multipliers if they may help. `own` is the failure of the method itself,
/// `rescue` tells whether held multipliers are tried for an increment of this length.
pub(crate) fn next_attempt<P: StepProblem>(
    problem: &P,
    last: Attempt,
    failure: &StepFailure,
    own: &StepFailure,
    rescue: bool,
) -> Option<Attempt> {
    if let Attempt::Setting(setting) = last {
        // other settings of the iteration cannot avoid an inverted element
        let geometric = matches!(failure.kind, StepFailureKind::State(_));
        let next = Attempt::Setting(setting + 1);
        if !geometric && problem.method(next).is_some() {
            return Some(next);
        }
    }
    let next = match last {
        Attempt::Setting(_) => Attempt::Rescue(0),
        Attempt::Rescue(number) => Attempt::Rescue(number + 1),
    };
    (rescue && may_be_rescued(own) && problem.method(next).is_some()).then_some(next)
}

/// Whether held multipliers may help. They do not if prescribed displacements leave no solution or
/// an unknown is undetermined, if the increment is so long that contact is missed or a rotation is
/// ambiguous, or if Newton's method only needs more iterations.
fn may_be_rescued(failure: &StepFailure) -> bool {
    match &failure.kind {
        StepFailureKind::State(StateError::PassedThrough { .. } | StateError::TurnedTooFar { .. }) => false,
        StepFailureKind::State(state) => !state.is_prescribed(),
        StepFailureKind::Singular { .. } => false,
        StepFailureKind::TooManyIterations { .. } => !still_falls(&failure.iterations),
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: twenty times the maximum of an attempt, or of what the last state took if that is more.
    #[test]
    fn patience_is_counted_in_iterations() {
        let tried = |iterations: usize| {
            let failed = |iterations| FailedAttempt {
                time: 1.0,
                rung: Rung::LastState,
                kind: StepFailureKind::Diverged,
                iterations,
            };
            [failed(iterations - 25), failed(25)]
        };
        let verdicts = |neighbour: usize| [500, 501, 800, 801].map(|n| is_exhausted(&tried(n), neighbour, 25));
        assert_eq!(verdicts(6), [false, true, true, true]);
        assert_eq!(verdicts(40), [false, false, false, true]);
    }
}
