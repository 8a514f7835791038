//! Initial guesses for Newton's method that predict beyond the last state.
//!
//! An initial guess affects the iterations, not the solution; where there are several equilibria,
//! it can select one. All guesses are tried before the increment is cut back.

use crate::divided::on_first;
use crate::problem::StepProblem;
use crate::store::{Path, PathState};
use crate::time::LoadTime;
use crate::unknowns::Held;
use slipstick_linalg::{Ranks, own_range};

/// Initial guess of Newton's method in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StartValues {
    /// Starts at the last state.
    Previous,
    /// Starts on the line through the last two states if the prescribed motion continues steadily,
    /// and otherwise at the last state.
    #[default]
    Extrapolated,
}

/// Largest difference between extrapolated and prescribed motion, as a fraction of the increment,
/// at which the motion counts as steady.
const STEADY: f64 = 0.1;

/// The path of a nearby problem, such as that of the previous design; initial guesses follow its
/// increments.
///
/// Single precision is sufficient. With several ranks, each rank has its part of the unknowns
/// ([`own_range`]).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Guide {
    times: Vec<f64>,
    unknowns: Vec<Vec<f32>>,
    /// Total number of unknowns of a state.
    length: usize,
    /// Whether its sub-steps are also used.
    holds_steps: bool,
}

/// Why given numbers do not form a valid [`Guide`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum GuideError {
    /// Times must start at 0 and ascend, one for each list of unknowns.
    #[error("times do not ascend from 0, or do not match the number of states")]
    Times,
    /// States must be finite and have the length of this rank's part.
    #[error("states have different or wrong lengths, or are not finite")]
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
            times: path.states.iter().map(|s| s.time.on_axis()).collect(),
            unknowns: path.states.iter().map(part).collect(),
            length,
            holds_steps: false,
        }
    }

    /// The same guide, but paths must also use its sub-steps as long as they converge: with
    /// friction, a path with different steps is a different function of the design.
    pub fn holding_steps(self) -> Self {
        Self { holds_steps: true, ..self }
    }

    /// Only the steps and sub-steps of a path, without its states.
    pub fn steps_of(path: &Path) -> Self {
        let times: Vec<f64> = path.states.iter().map(|s| s.time.on_axis()).collect();
        Self { unknowns: vec![Vec::new(); times.len()], times, length: 0, holds_steps: true }
    }

    /// The pseudo-time of the guide's next state after `time` in the same load case, if paths must use the
    /// guide's steps.
    pub(crate) fn next_step(&self, time: LoadTime) -> Option<f64> {
        let next = self.times.iter().copied().find(|&t| t > time.on_axis()).filter(|_| self.holds_steps)?;
        Some(next - LoadTime::start(time.case).on_axis())
    }

    /// Builds a guide from [times](LoadTime::on_axis), ascending from 0, and, for each time, this rank's part of
    /// the `length` unknowns ([`own_range`]). On one rank, this part is all of them.
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

    /// [Times](LoadTime::on_axis) of the states.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Number of unknowns of a state.
    pub fn length(&self) -> usize {
        self.length
    }

    /// Runs a task on the first rank, which requests the unknowns of states by number. All ranks
    /// must call this; the other ranks send their parts meanwhile and get `None`.
    pub fn with_unknowns<R>(
        &self,
        ranks: &dyn Ranks,
        work: impl FnOnce(&mut dyn FnMut(usize) -> Vec<f32>) -> R,
    ) -> Option<R> {
        on_first(ranks, |index| self.whole(index, ranks), work)
    }

    /// The unknowns of a state, gathered from all ranks.
    fn whole(&self, index: usize, ranks: &dyn Ranks) -> Vec<f32> {
        if ranks.size() == 1 {
            return self.unknowns[index].clone();
        }
        let part: Vec<f64> = self.unknowns[index].iter().map(|&v| f64::from(v)).collect();
        ranks.join(&part).into_iter().map(|v| v as f32).collect()
    }

    /// The last state plus the guide's increment from its time to `time`; `None` if the guide does
    /// not reach that far or has different unknowns. Each rank computes its part.
    fn ahead(&self, last: &[f64], from: LoadTime, time: LoadTime, ranks: &dyn Ranks) -> Option<Vec<f64>> {
        let (begin, end) = (self.at(from.on_axis())?, self.at(time.on_axis())?);
        if self.length != last.len() {
            return None;
        }
        let part = last[own_range(last.len(), ranks)].iter().enumerate();
        let ahead: Vec<f64> = part.map(|(i, last)| last + (self.value(end, i) - self.value(begin, i))).collect();
        Some(if ranks.size() == 1 { ahead } else { ranks.join(&ahead) })
    }

    /// The position of a time on the axis: number of the state before it, and the fraction of the way to the
    /// next.
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

/// A prediction of the end of a step.
#[derive(Debug, PartialEq)]
pub(crate) enum Ahead {
    /// By the path of a guide.
    Guided(Vec<f64>),
    /// By the last two states.
    Extrapolated(Vec<f64>),
}

/// A prediction for the step from the path's last state to `time`, if there is one.
pub(crate) fn ahead<P: StepProblem>(
    problem: &P,
    path: &Path,
    time: LoadTime,
    values: StartValues,
    guide: Option<&Guide>,
    ranks: &dyn Ranks,
) -> Option<Ahead> {
    let last = path.states.last().expect("holds the start");
    let mut target = last.state.unknowns.clone();
    problem.prescribe(time, &mut target);
    let guided = guide.and_then(|g| g.ahead(&last.state.unknowns, last.time, time, ranks)).map(Ahead::Guided);
    let mut ahead = guided.or_else(|| match values {
        StartValues::Previous => None,
        StartValues::Extrapolated => extrapolated(problem, path, time, &target).map(Ahead::Extrapolated),
    })?;
    let (Ahead::Guided(start) | Ahead::Extrapolated(start)) = &mut ahead;
    for (i, &fixed) in prescribed(problem) {
        if fixed {
            start[i] = target[i];
        }
    }
    // the last state itself is not a prediction
    (*start != last.state.unknowns).then_some(ahead)
}

/// Which displacements are prescribed.
fn prescribed<P: StepProblem>(problem: &P) -> impl Iterator<Item = (usize, &bool)> {
    let unknowns = problem.unknowns();
    unknowns.fixed(Held::None).iter().enumerate().take(unknowns.displacements)
}

/// The extrapolation of the last two states to `time`; `None` if the path has fewer than two
/// states, or if the prescribed motion or a load does not continue as before.
fn extrapolated<P: StepProblem>(problem: &P, path: &Path, time: LoadTime, target: &[f64]) -> Option<Vec<f64>> {
    let [.., before, last] = path.states.as_slice() else { return None };
    if last.rest {
        return None;
    }
    let (from, to) = (&before.state.unknowns, &last.state.unknowns);
    let ratio = (time.t - last.time.t) / (last.time.t - before.time.t);
    let ahead: Vec<f64> = from.iter().zip(to).map(|(a, b)| b + ratio * (b - a)).collect();
    let (mut increment, mut difference) = (0.0, 0.0);
    for (i, &fixed) in prescribed(problem) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::march::{LoadPath, MarchOptions, Silent, march};
    use crate::spring::Spring;
    use crate::{LinearSystem, Solver, StepReport, StepState};
    use slipstick_linalg::{Alone, SolverChoice};

    fn guide() -> Guide {
        let unknowns = [[0.0, 0.0], [1.0, -2.0], [4.0, 2.0]].map(|u| u.to_vec()).to_vec();
        Guide::from_parts(vec![0.0, 0.5, 2.0], unknowns, 2, &Alone).unwrap()
    }

    /// By hand: a time lies at a fraction of the way between two states, and the increment between
    /// two times is added to the last state.
    #[test]
    fn a_guide_is_linear_between_its_states() {
        let guide = guide();
        assert_eq!(
            [0.0, 0.125, 0.5, 0.875, 2.0].map(|time| guide.at(time)),
            [Some((0, 0.0)), Some((0, 0.25)), Some((0, 1.0)), Some((1, 0.25)), Some((1, 1.0))]
        );
        assert_eq!(guide.at(2.1), None);
        // u is (0.5, −1) at 0.25 and (1.75, −1) at 0.875
        assert_eq!(guide.ahead(&[10.0, 20.0], 0.25.into(), 0.875.into(), &Alone), Some(vec![11.25, 20.0]));
        assert_eq!(guide.ahead(&[10.0, 20.0], 0.25.into(), 2.5.into(), &Alone), None);
        assert_eq!(guide.ahead(&[10.0, 20.0, 30.0], 0.25.into(), 0.875.into(), &Alone), None);
        assert_eq!(guide.next_step(0.5.into()), None);
        let holding = guide.holding_steps();
        assert_eq!(
            [0.0, 0.5, 1.9, 2.0].map(|time| holding.next_step(time.into())),
            [Some(0.5), Some(2.0), Some(2.0), None]
        );
    }

    #[test]
    fn numbers_that_are_no_guide() {
        let from = |times: &[f64], unknowns: &[&[f32]]| {
            Guide::from_parts(times.to_vec(), unknowns.iter().map(|u| u.to_vec()).collect(), 2, &Alone).err()
        };
        let (one, other): (&[f32], &[f32]) = (&[0.0, 0.0], &[1.0, 2.0]);
        assert_eq!(from(&[0.0, 1.0], &[one, other]), None);
        for times in [&[0.1, 1.0][..], &[0.0, 0.0], &[0.0, f64::INFINITY], &[0.0], &[]] {
            assert_eq!(from(times, &[one, other]), Some(GuideError::Times), "{times:?}");
        }
        assert_eq!(from(&[0.0, 1.0], &[one, &[1.0]]), Some(GuideError::Unknowns));
        assert_eq!(from(&[0.0, 1.0], &[one, &[1.0, f32::NAN]]), Some(GuideError::Unknowns));
    }

    /// A path of two states, at 1 and 1.5, whose unknowns are linear in time, with the motion of
    /// the driven node.
    fn line(spring: &Spring) -> Path {
        let at = |time: f64| {
            let mut unknowns = vec![0.0, 0.0, 0.0, 3.0 * time, 1.0 - time, 2.0];
            spring.prescribe(time.into(), &mut unknowns);
            PathState {
                time: time.into(),
                state: StepState { unknowns, history: vec![0.0; 3] },
                completes: None,
                report: StepReport::default(),
                active_set: Vec::new(),
                rest: false,
                divided: false,
                histories: None,
                factors: None,
            }
        };
        Path { states: vec![at(1.0), at(1.5)], steps: 0, factor_bytes: 0 }
    }

    /// By hand: the line continues to 2.25 by one and a half times the last increment, as long as
    /// motion and loads continue as before, up to a tenth of their increments.
    #[test]
    fn start_values_go_on_where_motion_and_loads_do() {
        let extrapolated = StartValues::Extrapolated;
        let starts = |spring: &Spring, path: &Path, values| ahead(spring, path, 2.25.into(), values, None, &Alone);
        let exact = [1.8, -0.9, 0.45, 6.75, -1.25, 2.0];
        let close = |found: Option<Ahead>, steady: bool| match found {
            Some(Ahead::Extrapolated(found)) => {
                let off = found.iter().zip(exact).fold(0.0, |off: f64, (a, b)| off.max((a - b).abs()));
                assert!(steady && off < 1e-14, "{found:?} instead of {exact:?}");
            }
            other => assert!(other.is_none() && !steady, "{other:?}"),
        };
        // from 1 to 1.5 the load grows by 0.5, so a further 0.75 would be steady; the bound is a
        // tenth of the increment
        for (load, steady) in [
            ((|time| time) as fn(f64) -> f64, true),
            (|time| if time < 2.0 { time } else { 2.31 }, true),
            (|time| if time < 2.0 { time } else { 2.35 }, false),
            (|time| if time < 2.0 { time } else { 2.19 }, true),
            (|time| if time < 2.0 { time } else { 2.15 }, false),
            (|time| 1e3 * time * time, false),
        ] {
            let spring = Spring { load, ..Spring::default() };
            close(starts(&spring, &line(&spring), extrapolated), steady);
            close(starts(&spring, &line(&spring), StartValues::Previous), false);
        }
        // a motion that reverses, motions that are off by 0.3 and 0.04 of the increment, and a path
        // that has restarted
        let spring = Spring::default();
        for (before, steady) in [(2.0, false), (0.8 + 0.1375, false), (0.8 + 0.0183, true)] {
            let mut turned = line(&spring);
            turned.states[0].state.unknowns[0] = before;
            close(starts(&spring, &turned, extrapolated), steady);
        }
        let mut anew = line(&spring);
        anew.states[1].rest = true;
        close(starts(&spring, &anew, extrapolated), false);
    }

    /// For a linear spring, steps that start on the line through the last two states start at the
    /// solution.
    #[test]
    fn a_linear_path_is_extrapolated() {
        let (mut linear, mut workspace) = (LinearSystem::new(SolverChoice::Auto), Spring::workspace());
        let mut solver = Solver { problem: &Spring::linear(), linear: &mut linear, workspace: &mut workspace };
        let load_path = LoadPath::new(Spring::rest(), &[0.3, 1.0, 1.2]);
        let path = march(&mut solver, &load_path, &MarchOptions::default(), &mut Silent).unwrap();
        for at in &path.states[2..] {
            assert_eq!(at.report.iterations.len(), 1);
            assert!(at.report.iterations[0].displacement < 1e-14);
        }
    }
}
