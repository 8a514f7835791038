//! Start values of Newton's method, ahead of the last state.
//!
//! A start value changes the way to a solution, not the solution: every one is tried before the increment is cut back.

use crate::march::Path;
use crate::problem::StepProblem;
use slipstick_linalg::Ranks;

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
/// Single precision is enough for that. Of several ranks, the first has the unknowns; the others need the times only.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Guide {
    times: Vec<f64>,
    unknowns: Vec<Vec<f32>>,
    /// Whether its sub-steps are taken too.
    holds_steps: bool,
}

/// Why numbers are not a [`Guide`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum GuideError {
    /// Times must start at 0 and ascend, one for each list of unknowns.
    #[error("times do not ascend from 0, or are not as many as the states")]
    Times,
    /// States must be of one length and finite.
    #[error("states are of different lengths, or not finite")]
    Unknowns,
}

impl Guide {
    /// All states of a path.
    pub fn of(path: &Path) -> Self {
        let single = |values: &Vec<f64>| values.iter().map(|&v| v as f32).collect();
        Self {
            times: path.states.iter().map(|s| s.time).collect(),
            unknowns: path.states.iter().map(|s| single(&s.state.unknowns)).collect(),
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
        Self { unknowns: vec![Vec::new(); times.len()], times, holds_steps: true }
    }

    /// The state after `time`, if steps are to be taken as the guide has them.
    pub(crate) fn next_step(&self, time: f64) -> Option<f64> {
        self.times.iter().copied().find(|&t| t > time).filter(|_| self.holds_steps)
    }

    /// From its numbers: pseudo-times, ascending from 0, and the unknowns at each.
    ///
    /// # Errors
    /// [`GuideError`].
    pub fn from_parts(times: Vec<f64>, unknowns: Vec<Vec<f32>>) -> Result<Self, GuideError> {
        let ascending =
            times.first() == Some(&0.0) && times.windows(2).all(|w| w[0] < w[1]) && times.iter().all(|t| t.is_finite());
        if !ascending || times.len() != unknowns.len() {
            return Err(GuideError::Times);
        }
        let length = unknowns[0].len();
        if unknowns.iter().any(|u| u.len() != length || u.iter().any(|v| !v.is_finite())) {
            return Err(GuideError::Unknowns);
        }
        Ok(Self { times, unknowns, holds_steps: false })
    }

    /// Pseudo-times of the states.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Unknowns of the states.
    pub fn unknowns(&self) -> &[Vec<f32>] {
        &self.unknowns
    }

    /// Keeps the unknowns on the first of several ranks only.
    pub fn leave_to_first(&mut self, ranks: &dyn Ranks) {
        if ranks.rank() > 0 {
            self.unknowns.iter_mut().for_each(|unknowns| *unknowns = Vec::new());
        }
    }

    /// [`ahead`](Self::ahead) by the first rank, on all.
    fn ahead_on(&self, last: &[f64], from: f64, time: f64, ranks: &dyn Ranks) -> Option<Vec<f64>> {
        if ranks.size() == 1 {
            return self.ahead(last, from, time);
        }
        let ahead = if ranks.rank() == 0 { self.ahead(last, from, time) } else { None };
        Some(ranks.of_first(&ahead.unwrap_or_default())).filter(|ahead| ahead.len() == last.len())
    }

    /// The last state plus the guide's increment from its time to `time`; `None` if the guide does not reach so far or
    /// has other unknowns.
    fn ahead(&self, last: &[f64], from: f64, time: f64) -> Option<Vec<f64>> {
        let (begin, end) = (self.at(from)?, self.at(time)?);
        let fits = self.unknowns[0].len() == last.len();
        fits.then(|| (0..last.len()).map(|i| last[i] + (self.value(end, i) - self.value(begin, i))).collect())
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
    let guided = guide.and_then(|g| g.ahead_on(&last.state.unknowns, last.time, time, ranks));
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
