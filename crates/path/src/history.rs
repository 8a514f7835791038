//! Histories that are computed again instead of stored.
//!
//! A path stores the unknowns of every state, but a history may be much larger: seven numbers per
//! integration point with memory against three per node. Since it is explicit,
//! h_n = G(y_n; y_{n−1}, h_{n−1}), it follows from an earlier one and the unknowns in between, bit for
//! bit and without solving anything. A path therefore keeps every k-th history, with k as small as the
//! memory allows, and computes the others when they are requested. Those in between are kept for later
//! requests as far as the same memory allows; the sweep asks in descending order.

use crate::failure::StateError;
use crate::problem::{Iteration, StepProblem, Wanted};
use crate::time::{LoadTime, Span};
use crate::unknowns::StepState;
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::sync::{Arc, Mutex, PoisonError};

/// Computes the history at the end of a step from its unknowns, as the march has done.
pub trait HistoryUpdate: Debug + Send + Sync {
    /// h_n = G(y_n; y_{n−1}, h_{n−1}) of the step over `span` with unknowns `y` at its end, which
    /// the march has [held](crate::HoldFreeMotions), or not.
    ///
    /// # Errors
    /// If the equations have no value there.
    fn update(&self, previous: &StepState, y: &[f64], span: Span, held: bool) -> Result<Vec<f64>, StateError>;
}

/// The history of a problem's steps, evaluated by the problem itself.
pub struct Evaluator<P: StepProblem> {
    problem: P,
    buffers: Mutex<Buffers<P>>,
}

struct Buffers<P: StepProblem> {
    workspace: P::Workspace,
    /// The geometry at the end of the last step, with its time.
    latest: Option<(LoadTime, P::Geometry)>,
}

impl<P: StepProblem> Evaluator<P> {
    /// Of a problem, with buffers of its own.
    pub fn new(problem: P, workspace: P::Workspace) -> Self {
        Self { problem, buffers: Mutex::new(Buffers { workspace, latest: None }) }
    }
}

impl<P: StepProblem> Debug for Evaluator<P> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Evaluator").finish_non_exhaustive()
    }
}

impl<P> HistoryUpdate for Evaluator<P>
where
    P: StepProblem + Send + Sync,
    P::Workspace: Send,
    P::Geometry: Send,
{
    fn update(&self, previous: &StepState, y: &[f64], span: Span, held: bool) -> Result<Vec<f64>, StateError> {
        let mut buffers = self.buffers.lock().unwrap_or_else(PoisonError::into_inner);
        let Buffers { workspace, latest } = &mut *buffers;
        let problem = &self.problem;
        let geometry = match latest.take().filter(|(time, _)| *time == span.start()) {
            Some((_, geometry)) => geometry,
            None => problem.geometry(&previous.unknowns, Wanted::Residual, workspace)?,
        };
        let mut step = problem.begin(previous, &geometry, span, workspace)?;
        if let Some(motions) = problem.free_motions().filter(|_| held) {
            motions.hold(&mut step, previous, true);
        }
        let at = problem.evaluate(&step, y, None, Iteration::default(), Wanted::Residual, workspace)?;
        let history = problem.finish(&step, &at)?;
        *latest = Some((span.end(), at.geometry));
        Ok(history)
    }
}

/// What the history of the next state depends on.
pub(crate) struct KnownState {
    pub time: LoadTime,
    /// Whether its free motions were held.
    pub held: bool,
    pub state: StepState,
}

/// Where states without a history get it from.
pub(crate) struct Histories {
    update: Arc<dyn HistoryUpdate>,
    /// Largest number of histories at hand.
    room: usize,
    at_hand: Mutex<BTreeMap<usize, Vec<f64>>>,
}

impl Histories {
    /// With room for this number of them.
    pub fn new(update: Arc<dyn HistoryUpdate>, room: usize) -> Self {
        Self { update, room, at_hand: Mutex::default() }
    }

    /// The history of state `n` of a load case, whose states are given by number, and complete on every
    /// rank; `kept` is the last state before it that keeps its own. All ranks must call this in the same
    /// order.
    pub fn get(&self, n: usize, kept: usize, state: &dyn Fn(usize) -> KnownState) -> Vec<f64> {
        let mut at_hand = self.at_hand.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(history) = at_hand.get(&n) {
            return history.clone();
        }
        at_hand.retain(|&index, _| index < n);
        let (mut from, mut history) = match at_hand.range(kept..).next_back() {
            Some((&index, history)) => (index, history.clone()),
            None => (kept, state(kept).state.history),
        };
        if at_hand.len() >= self.room {
            at_hand.pop_first();
        }
        let stride = (n - from).div_ceil(self.room.saturating_sub(at_hand.len()).max(1));
        let mut previous = state(from);
        while from < n {
            let next = state(from + 1);
            let (before, span) = (StepState { history, ..previous.state }, Span::new(previous.time, next.time.t));
            let updated = self.update.update(&before, &next.state.unknowns, span, next.held);
            history = updated.expect("the march has evaluated the same step");
            from += 1;
            if (n - from).is_multiple_of(stride) {
                at_hand.insert(from, history.clone());
            }
            previous = next;
        }
        history
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equations::UnknownAt;
    use crate::spring::Spring;
    use crate::{LinearSystem, LoadPath, MarchOptions, Path, PathGradient, Silent, Solver, SweepOptions, march, sweep};
    use slipstick_linalg::{Alone, SolverChoice};
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Counts updates.
    #[derive(Debug)]
    struct Counting(Evaluator<Spring>, Arc<AtomicUsize>);

    impl HistoryUpdate for Counting {
        fn update(&self, previous: &StepState, y: &[f64], span: Span, held: bool) -> Result<Vec<f64>, StateError> {
            self.1.fetch_add(1, Ordering::Relaxed);
            self.0.update(previous, y, span, held)
        }
    }

    /// A path of 100 steps, its gradient, and the number of updates that the sweep has needed.
    fn marched(histories: usize) -> (Path, PathGradient, usize) {
        let (spring, count) = (Spring::default(), Arc::new(AtomicUsize::new(0)));
        let evaluator = Evaluator::new(Spring::default(), Spring::workspace());
        let times: Vec<f64> = (1..=100).map(|step| 0.02 * f64::from(step)).collect();
        let load_path = LoadPath {
            histories: Some(Arc::new(Counting(evaluator, count.clone()))),
            ..LoadPath::new(Spring::rest(), &times)
        };
        let mut linear = LinearSystem::new(SolverChoice::Auto);
        let mut solver = Solver { problem: &spring, linear: &mut linear, workspace: &mut Spring::workspace() };
        let options = MarchOptions { memory: 24 * histories, ..MarchOptions::default() };
        let path = march(&mut solver, &load_path, &options, &mut Silent).unwrap();
        assert_eq!(count.load(Ordering::Relaxed), 0, "the march needs only the last state");
        let options = SweepOptions { parameters: true, ..SweepOptions::default() };
        let mut last = UnknownAt { state: 100, unknown: 3 };
        let gradient = sweep(&mut solver, &path, &mut last, &options).unwrap().remove(0);
        (path, gradient, count.load(Ordering::Relaxed))
    }

    /// With a tenth of the memory, gradient and states are the same, bit for bit, for less than three
    /// updates per step: without a solve, these cost a fraction of a step.
    #[test]
    fn histories_are_computed_again() {
        let (whole, gradient, none) = marched(usize::MAX / 24);
        assert_eq!(none, 0);
        assert!(whole.states.iter().all(|state| state.state.history.len() == 3));
        let (thin, again, updates) = marched(10);
        assert_eq!(again, gradient);
        assert!(updates < 300, "{updates}");
        let kept: Vec<usize> = (0..=100).filter(|&index| !thin.states[index].state.history.is_empty()).collect();
        assert_eq!(kept, [0, 32, 64, 96, 99, 100]);
        // in any order
        for index in (0..=100).chain([57, 3, 80]).chain((0..=100).rev()) {
            assert_eq!(thin.state(index, &Alone), whole.state(index, &Alone), "state {index}");
        }
        let histories = thin.states[1].histories.as_ref().expect("is not kept");
        assert!(histories.at_hand.lock().unwrap().len() <= 5);
    }
}
