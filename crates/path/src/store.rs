//! The store of a path's states.

use crate::divided::on_first;
use crate::history::{Histories, KnownState};
use crate::iterations::StepReport;
use crate::reuse::KeptFactors;
use crate::time::LoadTime;
use crate::unknowns::StepState;
use slipstick_linalg::{Ranks, own_range};
use slipstick_status::ContactStatus;
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

/// An accepted state.
#[derive(Clone)]
pub struct PathState {
    /// When.
    pub time: LoadTime,
    /// Unknowns and history; with several ranks, each may hold only [its part](Path::state), and the
    /// history may be empty because it can be computed again.
    pub state: StepState,
    /// The user's step (1-based) that this state completes; `None` within a step that was cut back.
    pub completes: Option<usize>,
    /// How it converged.
    pub report: StepReport,
    /// Status of every contact node at this state.
    pub active_set: Vec<ContactStatus>,
    /// Whether this is the state at rest from which the path, or a new load case, starts; such a
    /// state does not depend on earlier ones.
    pub rest: bool,
    /// Whether each rank holds only its part of the unknowns and history.
    pub(crate) divided: bool,
    /// Where the history comes from, unless it is kept.
    pub(crate) histories: Option<Arc<Histories>>,
    pub(crate) factors: Option<Arc<KeptFactors>>,
}

impl std::fmt::Debug for PathState {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PathState")
            .field("time", &self.time)
            .field("completes", &self.completes)
            .field("unknowns", &self.state.unknowns.len())
            .field("keeps_factors", &self.factors.is_some())
            .finish()
    }
}

/// All accepted states; the first is the start. A path with several load cases starts again at rest
/// for each of them.
#[derive(Debug, Clone, Default)]
pub struct Path {
    /// In chronological order.
    pub states: Vec<PathState>,
    /// Number of the user's steps that are complete.
    pub steps: usize,
    /// Memory of the factors that are kept for the sweep. \[bytes\]
    pub factor_bytes: usize,
}

impl Path {
    /// Appends the path of the next load case.
    pub fn append(&mut self, next: Self) {
        self.states.extend(next.states);
        self.steps = next.steps;
        self.factor_bytes += next.factor_bytes;
    }

    /// The states of each load case, in order. Each load case begins at rest, except possibly the
    /// first if the path is only a part of a longer one.
    pub fn load_cases(&self) -> Vec<Range<usize>> {
        let begins = |&index: &usize| index == 0 || self.states[index].rest;
        let starts: Vec<usize> = (0..self.states.len()).filter(begins).collect();
        let ends = starts.iter().skip(1).copied().chain([self.states.len()]);
        starts.iter().copied().zip(ends).map(|(start, end)| start..end).collect()
    }

    /// Number of accepted (sub-)steps.
    pub fn increments(&self) -> usize {
        self.states.iter().filter(|state| !state.rest).count()
    }

    /// Returns a state. A state that is distributed over the ranks is gathered, and a history that is not
    /// kept is computed again, so all ranks must call this in the same order. The last two states of a load
    /// case, from which steps start, are complete on every rank.
    pub fn state(&self, index: usize, ranks: &dyn Ranks) -> Cow<'_, StepState> {
        let joined = |index: usize| {
            let PathState { state, divided, .. } = &self.states[index];
            match divided {
                false => Cow::Borrowed(state),
                true => {
                    let [unknowns, history] = [&state.unknowns, &state.history].map(|part| ranks.join(part));
                    Cow::Owned(StepState { unknowns, history })
                }
            }
        };
        let state = joined(index);
        let Some(histories) = &self.states[index].histories else { return state };
        let before = |is: &dyn Fn(&PathState) -> bool| (0..index).rev().find(|&before| is(&self.states[before]));
        let first = before(&|state| state.rest).unwrap_or(0);
        let kept = before(&|state| state.histories.is_none()).unwrap_or(first);
        let of = |n: usize| {
            let PathState { time, report, .. } = &self.states[first + n];
            KnownState { time: *time, held: report.holds, state: joined(first + n).into_owned() }
        };
        let history = histories.get(index - first, kept - first, &of);
        Cow::Owned(StepState { history, ..state.into_owned() })
    }

    /// An accepted state with its [whole](Self::state) unknowns and history.
    pub fn accepted(&self, index: usize, ranks: &dyn Ranks) -> Cow<'_, PathState> {
        let at = &self.states[index];
        match self.state(index, ranks) {
            Cow::Borrowed(_) => Cow::Borrowed(at),
            Cow::Owned(state) => Cow::Owned(PathState { state, divided: false, histories: None, ..at.clone() }),
        }
    }

    /// Runs a task on the first rank, such as writing files, which requests states by number. All
    /// ranks must call this; the other ranks send their parts meanwhile and get `None`.
    pub fn with_states<'a, R>(
        &'a self,
        ranks: &dyn Ranks,
        work: impl FnOnce(&mut dyn FnMut(usize) -> Cow<'a, StepState>) -> R,
    ) -> Option<R> {
        on_first(ranks, |index| self.state(index, ranks), work)
    }

    /// Keeps only this rank's part of each state, unless a later step may start from it.
    pub(crate) fn divide(&mut self, ranks: &dyn Ranks) {
        let Some(index) = self.states.len().checked_sub(3).filter(|_| ranks.size() > 1) else { return };
        let older = &mut self.states[..=index];
        for PathState { state, divided, .. } in older.iter_mut().rev().take_while(|state| !state.divided) {
            *divided = true;
            for values in [&mut state.unknowns, &mut state.history] {
                *values = values[own_range(values.len(), ranks)].to_vec();
            }
        }
    }

    /// The states that complete a user's step, with the step's number; with several ranks, each may
    /// hold only its part.
    pub fn completed(&self) -> impl Iterator<Item = (usize, &PathState)> {
        self.states.iter().filter_map(|s| s.completes.map(|n| (n, s)))
    }

    /// Returns the factors to keep with the next state, if they can be reused and fit; factors shared
    /// with the previous state need no extra memory.
    pub(crate) fn keep(&mut self, latest: Option<&Arc<KeptFactors>>, memory: usize) -> Option<Arc<KeptFactors>> {
        let latest = latest.filter(|latest| latest.factors.cost().is_some())?;
        let shared = self.states.last().and_then(|s| s.factors.as_ref()).is_some_and(|f| Arc::ptr_eq(f, latest));
        let bytes = self.factor_bytes + if shared { 0 } else { latest.bytes() };
        if bytes > memory {
            return None;
        }
        self.factor_bytes = bytes;
        Some(latest.clone())
    }

    /// Number of states that have factors for the sweep.
    pub fn states_with_factors(&self) -> usize {
        self.states.iter().filter(|s| s.factors.is_some()).count()
    }

    /// Number of states that keep a history; those of the others are [computed again](crate::LoadPath::histories).
    pub fn states_with_histories(&self) -> usize {
        self.states.iter().filter(|s| s.histories.is_none() && !s.state.history.is_empty()).count()
    }

    /// Drops the factors, which are no longer needed after the sweep.
    pub fn forget_factors(&mut self) {
        self.states.iter_mut().for_each(|s| s.factors = None);
        self.factor_bytes = 0;
    }

    /// Newton iterations of all failed attempts along the path.
    pub fn failed_iterations(&self) -> usize {
        self.states.iter().map(|s| s.report.failed_iterations).sum()
    }

    /// Newton iterations that led to the states of the path.
    pub fn newton_iterations(&self) -> usize {
        self.states.iter().map(|s| s.report.iterations.len()).sum()
    }
}
