//! Judges iterations: whether they have converged, stall or repeat an active set.

use super::settings::Tolerances;
use crate::iterations::IterationRecord;
use crate::problem::Scales;
use slipstick_status::ContactStatus;

/// Largest ratio of two increments for which the next one is predicted.
const CONTRACTION: f64 = 0.1;

/// Estimates the norms of the next increments (displacements, multipliers). If full increments of the
/// displacements contract fast and the active set does not change, these are the last norms times a
/// factor: the square of that contraction, as Newton's method is expected to repeat it, but at least
/// the `fall` of the scaled residual, to which the next increments are proportional and in which the
/// error of the linear solve shows. (Deuflhard, Newton Methods for Nonlinear Problems, 2.1.)
pub(super) fn foreseen(before: Option<&IterationRecord>, last: &IterationRecord, fall: f64) -> (f64, f64) {
    let full = |b: &&IterationRecord| b.step_length == 1.0 && last.step_length == 1.0;
    let factor = before.filter(full).map_or(1.0, |before| {
        let contraction = last.displacement / before.displacement;
        if contraction < CONTRACTION { fall.max(contraction * contraction) } else { 1.0 }
    });
    (factor * last.displacement, factor * last.multiplier)
}

/// Whether all bounds hold, with the predicted norms of the `next` increments.
pub(super) fn converged(record: &IterationRecord, next: (f64, f64), scales: &Scales, tolerances: &Tolerances) -> bool {
    tolerances.residual.allows(record.residual, scales.force)
        && tolerances.displacement.allows_increment(record.displacement, next.0, scales.displacement)
        && tolerances.contact.allows(record.contact, scales.multiplier)
        && tolerances.multiplier.allows_increment(record.multiplier, next.1, scales.multiplier)
}

/// Iterations without a new best residual after which increments are damped.
const STALLED: usize = 3;

/// A residual counts as a new best if it is below this fraction of the best so far.
const PROGRESS: f64 = 0.7;

/// Tracks the decrease of the residual.
#[derive(Default)]
pub(super) struct Progress {
    best: Option<f64>,
    pub(super) since: usize,
    /// Set at the first stall or outburst.
    pub(super) damped: bool,
}

impl Progress {
    pub(super) fn add(&mut self, size: f64) {
        if self.best.is_none_or(|best| size < PROGRESS * best) {
            self.best = Some(size);
            self.since = 0;
        } else {
            self.since += 1;
            self.damped |= self.since >= STALLED;
        }
    }

    /// Whether `size` is still well below the best so far.
    pub(super) fn falls_to(&self, size: f64) -> bool {
        self.best.is_none_or(|best| size < 0.1 * best)
    }
}

/// Number of recent iterations in which changes of status are reported.
const RECENT: usize = 8;

/// Detects an active set that recurs.
#[derive(Default)]
pub(super) struct ActiveSets {
    history: Vec<Vec<ContactStatus>>,
}

impl ActiveSets {
    /// Adds the set of this iteration. Returns the positions that change if this set was entered at
    /// least three times before.
    pub(super) fn cycling(&mut self, now: &[ContactStatus]) -> Option<Vec<u32>> {
        let changed = self.history.last().is_some_and(|last| last != now);
        let entered = |i: usize| self.history[i] == now && (i == 0 || self.history[i - 1] != now);
        let cycle = changed && (0..self.history.len()).filter(|&i| entered(i)).count() >= 3;
        let nodes = cycle.then(|| self.changing(now));
        self.history.push(now.to_vec());
        nodes
    }

    /// Positions whose status was different in the last iterations.
    pub(super) fn changing(&self, now: &[ContactStatus]) -> Vec<u32> {
        let changes = |&i: &u32| self.history.iter().rev().take(RECENT).any(|set| set[i as usize] != now[i as usize]);
        (0..now.len() as u32).filter(changes).collect()
    }
}
#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: after a contraction by a factor of 100, one by 100² is expected, or by the fall of the
    /// residual if that is less; after a damped increment, or a contraction by less than 10, none is
    /// expected.
    #[test]
    fn increments_are_foreseen_by_their_contraction() {
        let record = |displacement: f64, step_length: f64| IterationRecord {
            displacement,
            multiplier: 3e-2,
            step_length,
            ..IterationRecord::default()
        };
        let close = |found: (f64, f64), factor: f64| {
            let apart = |a: f64, b: f64| (a - b).abs() <= 1e-14 * b;
            assert!(apart(found.0, factor * 1e-4) && apart(found.1, factor * 3e-2), "{found:?} instead of {factor}");
        };
        let last = record(1e-4, 1.0);
        close(foreseen(None, &last, 1e-5), 1.0);
        close(foreseen(Some(&record(1e-2, 1.0)), &last, 1e-5), 1e-4);
        close(foreseen(Some(&record(1e-2, 1.0)), &last, 0.02), 0.02);
        close(foreseen(Some(&record(9e-4, 1.0)), &last, 1e-5), 1.0);
        close(foreseen(Some(&record(1e-2, 0.5)), &last, 1e-5), 1.0);
    }

    /// By counting: three iterations without a residual below 0.7 of the best are a stall, and the
    /// stall is remembered.
    #[test]
    fn a_stall_is_three_iterations_without_progress() {
        let damped = |sizes: &[f64]| {
            let mut progress = Progress::default();
            sizes.iter().map(|&size| (progress.add(size), progress.damped).1).collect::<Vec<_>>()
        };
        assert_eq!(damped(&[1.0, 0.8, 0.75, 0.71, 0.1]), [false, false, false, true, true]);
        assert_eq!(damped(&[1.0, 0.8, 0.75, 0.6, 0.5, 0.5, 0.5]), [false, false, false, false, false, false, true]);
        let mut progress = Progress::default();
        assert!(progress.falls_to(3.0));
        progress.add(1.0);
        assert!(progress.falls_to(0.09) && !progress.falls_to(0.11));
    }

    #[test]
    fn an_alternating_active_set_is_recognised_and_a_settled_one_is_not() {
        use ContactStatus::{Inactive, Slip, Stick};
        let mut sets = ActiveSets::default();
        let verdicts: Vec<_> = (0..8).map(|k| sets.cycling(&[Stick, [Inactive, Stick][k % 2]])).collect();
        assert_eq!(verdicts.iter().position(Option::is_some), Some(6));
        assert_eq!(verdicts[6], Some(vec![1]));
        let mut sets = ActiveSets::default();
        assert!((0..20).all(|_| sets.cycling(&[Stick, Slip]).is_none()));
        // one excursion from a set that persisted for long is not a cycle
        assert!([[Stick, Stick], [Stick, Slip]].iter().all(|set| sets.cycling(set).is_none()));
    }
}
