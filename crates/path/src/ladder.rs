//! The ladder of attempts at a (sub-)step: which follow a failed one, and in what order.
//!
//! None of them changes the equations, so the adjoint is the same whichever succeeds.

use crate::failure::{StateError, StepFailure, StepFailureKind};
use crate::iterations::still_falls;
use crate::problem::{Attempt, StepProblem};
use crate::time::LoadTime;
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
    /// From the last state, with a penalty whose stiffness grows, and then Newton's method.
    Penalty,
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
            Self::Penalty => write!(f, "growing penalty"),
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
            Attempt::Penalty(_) => Self::Penalty,
            Attempt::Rescue(number) => Self::Held(number),
        }
    }
}

/// A failed attempt at a (sub-)step.
#[derive(Debug, Clone, PartialEq)]
pub struct FailedAttempt {
    /// The end of the increment.
    pub time: LoadTime,
    /// How it iterated.
    pub rung: Rung,
    /// Why it failed.
    pub kind: StepFailureKind,
    /// Its Newton iterations.
    pub iterations: usize,
}

/// Newton iterations that failed attempts may take since the last accepted state before no other rung and
/// no smaller increment is tried, in units of the costliest single solve: the maximum of an attempt, or the
/// last state's own iterations or, up to twice that maximum, those of a failed attempt if these were more.
const PATIENCE: usize = 15;

/// What all failed attempts at a step may take besides, once most of the step is done; a part of the step
/// earns its part of this.
const PATIENCE_WITH_PROGRESS: f64 = 20.0;

/// The part of a step that is done, and what it took.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Progress {
    /// From 0 to 1.
    pub done: f64,
    /// Number of failed attempts before the last accepted state.
    pub before: usize,
    /// Newton iterations that led to that state.
    pub neighbour: usize,
}

/// Whether attempts at a step have cost so much that no others are tried.
pub(crate) fn is_exhausted(tried: &[FailedAttempt], progress: Progress, max_iterations: usize) -> bool {
    let Progress { done, before, neighbour } = progress;
    let own = tried.iter().filter(|failed| !matches!(failed.rung, Rung::Penalty | Rung::Held(_)));
    let solve = own.map(|failed| failed.iterations).max().unwrap_or(0).min(2 * max_iterations);
    let unit = max_iterations.max(neighbour).max(solve);
    let all = (PATIENCE as f64 + PATIENCE_WITH_PROGRESS * done) * unit as f64;
    iterations_of(&tried[before..]) > PATIENCE * unit || iterations_of(tried) as f64 > all
}

/// Newton iterations of failed attempts.
pub(crate) fn iterations_of(tried: &[FailedAttempt]) -> usize {
    tried.iter().map(|failed| failed.iterations).sum()
}

/// Returns the attempt after `last`, which started from the last state and failed: the next
/// setting, a growing penalty, or held multipliers if they may help. `own` is the failure of the method itself,
/// `rescue` tells whether held multipliers are tried for an increment of this length.
pub(crate) fn next_attempt<P: StepProblem>(
    problem: &P,
    last: Attempt,
    failure: &StepFailure,
    own: &StepFailure,
    rescue: bool,
) -> Option<Attempt> {
    // other settings of the iteration cannot avoid an inverted element, or forces that explode
    let geometric = matches!(failure.kind, StepFailureKind::State(_) | StepFailureKind::Diverged)
        && !matches!(last, Attempt::Penalty(_));
    // nor does a penalty determine multipliers that the step's own equations leave undetermined
    let determined = !matches!(failure.kind, StepFailureKind::Singular { .. });
    let others = match last {
        Attempt::Setting(0) => &[Attempt::Setting(1), Attempt::Penalty(0)][..],
        Attempt::Setting(1) => &[Attempt::Penalty(0), Attempt::Setting(2)],
        Attempt::Penalty(_) => &[Attempt::Setting(2)],
        Attempt::Setting(_) | Attempt::Rescue(_) => &[],
    };
    let helps = |next: &Attempt| !geometric && (determined || matches!(next, Attempt::Setting(_)));
    let next = others.iter().copied().find(|next| helps(next) && problem.method(*next).is_some());
    if next.is_some() {
        return next;
    }
    let next = match last {
        Attempt::Setting(_) | Attempt::Penalty(_) => Attempt::Rescue(0),
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

    /// By hand: fifteen times the maximum of an attempt, or of what the last state took if that is more;
    /// twenty-five times if half of the step is done and some of the attempts precede the last state.
    #[test]
    fn patience_is_counted_in_iterations() {
        let tried = |iterations: usize, solve: usize| {
            let failed = |iterations, rung| FailedAttempt {
                time: 1.0.into(),
                rung,
                kind: StepFailureKind::Diverged,
                iterations,
            };
            let others = iterations - 375 - solve;
            [failed(375, Rung::Held(0)), failed(others, Rung::Penalty), failed(solve, Rung::LastState)]
        };
        let verdicts = |done: f64, before: usize, neighbour: usize, solve: usize| {
            let progress = Progress { done, before, neighbour };
            let sums = [375, 376, 600, 601, 625, 626].map(|n| n.max(375 + solve));
            sums.map(|n| is_exhausted(&tried(n, solve), progress, 25))
        };
        assert_eq!(verdicts(0.0, 0, 6, 0), [false, true, true, true, true, true]);
        assert_eq!(verdicts(0.5, 0, 6, 0), [false, true, true, true, true, true]);
        assert_eq!(verdicts(0.5, 1, 6, 0), [false, false, false, false, false, true]);
        assert_eq!(verdicts(0.0, 0, 40, 0), [false, false, false, true, true, true]);
        // a failed attempt of 40 iterations
        assert_eq!(verdicts(0.0, 0, 6, 40), [false, false, false, true, true, true]);
    }
}
