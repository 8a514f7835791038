//! Start values of Newton's method, ahead of the last state.
//!
//! A start value changes the way to a solution, not the solution: every one is tried before the increment is cut back.

use crate::divided::{ask, serve};
use crate::march::{Path, PathState};
use crate::problem::StepProblem;
use slipstick_linalg::{Ranks, own_range};

/// Where Newton's method starts a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StartValues {
    /// At the last state.
    Previous,
    /// On the line through the last two states where the prescribed motion goes on as it did, else at the last state.
    #[default]
    Extrapolated,
}

/// Largest difference between extrapolated and prescribed motion, as part of the increment, at which the motion is taken
/// to go on as it did.
const STEADY: f64 = 0.1;

/// The path of a nearby problem, whose increments are followed: of the previous design, say.
///
/// Single precision is enough for that. Of several ranks, each has its part of the unknowns ([`own_range`]).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Guide {
    times: Vec<f64>,
    unknowns: Vec<Vec<f32>>,
    /// Number of all unknowns of a state.
    length: usize,
    /// Whether its sub-steps are taken too.
    holds_steps: bool,
}

/// Why numbers are not a [`Guide`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum GuideError {
    /// Times must start at 0 and ascend, one for each list of unknowns.
    #[error("times do not ascend from 0, or are not as many as the states")]
    Times,
    /// States must be of one length, that of this rank's part, and finite.
    #[error("states are of different or wrong lengths, or not finite")]
    Unknowns,
}

impl Guide {
    /// All states of a path.
    pub fn of(path: &Path, ranks: &dyn Ranks) -> Self {
        let length = path.states.last().map_or(0, |last| last.state.unknowns.len());
        let part = |at: &PathState| {
            let all = &at.state.unknowns;
            let own = if at.divided { 0..all.len() } else { own_range(length, ranks) };
            all[own].iter().map(|&v| v as f32).collect()
        };
        Self {
            times: path.states.iter().map(|s| s.time).collect(),
            unknowns: path.states.iter().map(part).collect(),
            length,
            holds_steps: false,
        }
    }

    /// The same guide for paths that are to have its sub-steps as well, as long as they converge: with friction, a path of
    /// other steps is another function of the design.
    pub fn holding_steps(self) -> Self {
        Self { holds_steps: true, ..self }
    }

    /// Only the steps and sub-steps of a path, without its states.
    pub fn steps_of(path: &Path) -> Self {
        let times: Vec<f64> = path.states.iter().map(|s| s.time).collect();
        Self { unknowns: vec![Vec::new(); times.len()], times, length: 0, holds_steps: true }
    }

    /// The state after `time`, if steps are to be taken as the guide has them.
    pub(crate) fn next_step(&self, time: f64) -> Option<f64> {
        self.times.iter().copied().find(|&t| t > time).filter(|_| self.holds_steps)
    }

    /// From its numbers: pseudo-times, ascending from 0, and at each this rank's part of the `length` unknowns ([`own_range`]),
    /// on one rank all of them.
    ///
    /// # Errors
    /// [`GuideError`].
    pub fn from_parts(
        times: Vec<f64>,
        unknowns: Vec<Vec<f32>>,
        length: usize,
        ranks: &dyn Ranks,
    ) -> Result<Self, GuideError> {
        let ascending =
            times.first() == Some(&0.0) && times.windows(2).all(|w| w[0] < w[1]) && times.iter().all(|t| t.is_finite());
        if !ascending || times.len() != unknowns.len() {
            return Err(GuideError::Times);
        }
        let part = own_range(length, ranks).len();
        if unknowns.iter().any(|u| u.len() != part || u.iter().any(|v| !v.is_finite())) {
            return Err(GuideError::Unknowns);
        }
        Ok(Self { times, unknowns, length, holds_steps: false })
    }

    /// Pseudo-times of the states.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Number of unknowns of a state.
    pub fn length(&self) -> usize {
        self.length
    }

    /// Does work of the first rank that asks for the unknowns of states by number; the other ranks [`serve`](Self::serve)
    /// meanwhile.
    pub fn with_unknowns<R>(&self, ranks: &dyn Ranks, work: impl FnOnce(&mut dyn FnMut(usize) -> Vec<f32>) -> R) -> R {
        ask(ranks, |index| self.whole(index, ranks), work)
    }

    /// What the other ranks do while the first works [`with_unknowns`](Self::with_unknowns).
    pub fn serve(&self, ranks: &dyn Ranks) {
        serve(ranks, |index| self.whole(index, ranks));
    }

    /// The unknowns of a state from all ranks.
    fn whole(&self, index: usize, ranks: &dyn Ranks) -> Vec<f32> {
        if ranks.size() == 1 {
            return self.unknowns[index].clone();
        }
        let part: Vec<f64> = self.unknowns[index].iter().map(|&v| f64::from(v)).collect();
        ranks.join(&part).into_iter().map(|v| v as f32).collect()
    }

    /// The last state plus the guide's increment from its time to `time`; `None` if the guide does not reach so far or
    /// has other unknowns. Each rank does its part.
    fn ahead(&self, last: &[f64], from: f64, time: f64, ranks: &dyn Ranks) -> Option<Vec<f64>> {
        let (begin, end) = (self.at(from)?, self.at(time)?);
        if self.length != last.len() {
            return None;
        }
        let part = last[own_range(last.len(), ranks)].iter().enumerate();
        let ahead: Vec<f64> = part.map(|(i, last)| last + (self.value(end, i) - self.value(begin, i))).collect();
        Some(if ranks.size() == 1 { ahead } else { ranks.join(&ahead) })
    }

    /// Where `time` lies: number of the state before, and the part of the way to the next.
    fn at(&self, time: f64) -> Option<(usize, f64)> {
        let next = self.times.partition_point(|&t| t < time).max(1);
        let (before, after) = (*self.times.get(next - 1)?, *self.times.get(next)?);
        Some((next - 1, (time - before) / (after - before)))
    }

    fn value(&self, (state, part): (usize, f64), i: usize) -> f64 {
        let (a, b) = (f64::from(self.unknowns[state][i]), f64::from(self.unknowns[state + 1][i]));
        a + part * (b - a)
    }
}

/// Start values for the step from the path's last state to `time`, best first; the last is the last state.
pub(crate) fn candidates(
    problem: &dyn StepProblem,
    path: &Path,
    time: f64,
    values: StartValues,
    guide: Option<&Guide>,
    ranks: &dyn Ranks,
) -> Vec<Vec<f64>> {
    let last = path.states.last().expect("holds the start");
    let mut target = last.state.unknowns.clone();
    problem.prescribe(time, &mut target);
    let guided = guide.and_then(|g| g.ahead(&last.state.unknowns, last.time, time, ranks));
    let mut ahead = guided.or_else(|| match values {
        StartValues::Previous => None,
        StartValues::Extrapolated => extrapolated(problem, path, time, &target),
    });
    if let Some(start) = &mut ahead {
        for (i, &fixed) in problem.fixed().iter().enumerate().take(problem.displacements()) {
            if fixed {
                start[i] = target[i];
            }
        }
    }
    ahead.into_iter().chain([last.state.unknowns.clone()]).collect()
}

/// The line through the last two states at `time`; `None` where there are no two states, or where the prescribed motion
/// or a load takes another course than before.
fn extrapolated(problem: &dyn StepProblem, path: &Path, time: f64, target: &[f64]) -> Option<Vec<f64>> {
    let [.., before, last] = path.states.as_slice() else { return None };
    if last.rest {
        return None;
    }
    let (from, to) = (&before.state.unknowns, &last.state.unknowns);
    let ratio = (time - last.time) / (last.time - before.time);
    let ahead: Vec<f64> = from.iter().zip(to).map(|(a, b)| b + ratio * (b - a)).collect();
    let (mut increment, mut difference) = (0.0, 0.0);
    for (i, &fixed) in problem.fixed().iter().enumerate().take(problem.displacements()) {
        if fixed {
            increment += (target[i] - to[i]).powi(2);
            difference += (target[i] - ahead[i]).powi(2);
        }
    }
    let factors = [before.time, last.time, time].map(|time| problem.load_factors(time));
    let steady = (0..factors[2].len()).all(|i| {
        let [from, to, target] = [0, 1, 2].map(|k: usize| factors[k][i]);
        (target - (to + ratio * (to - from))).abs() <= STEADY * (target - to).abs()
    });
    (steady && difference <= STEADY * STEADY * increment).then_some(ahead)
}
