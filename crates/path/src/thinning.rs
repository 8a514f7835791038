//! Drops histories of a growing path that can be computed again.

use crate::history::{Histories, HistoryUpdate};
use crate::store::PathState;
use std::sync::Arc;

/// Drops histories while a path grows.
pub(crate) struct Thinning {
    histories: Arc<Histories>,
    /// Largest number of histories that are kept, besides the last two.
    most: usize,
    /// Every how many states one is kept.
    stride: usize,
}

/// Fewer histories than this are not enough to compute the others in passing.
const FEWEST: usize = 8;

impl Thinning {
    /// For histories of `length` numbers and this memory, \[bytes\] of which one half is for histories that are
    /// kept, the other for those at hand.
    pub fn new(update: Arc<dyn HistoryUpdate>, length: usize, memory: usize) -> Self {
        let all = (memory / (8 * length)).max(FEWEST);
        let most = all / 2;
        Self { histories: Arc::new(Histories::new(update, all - most)), most, stride: 1 }
    }

    /// Drops what exceeds the memory, but keeps the histories of the first and the last two states, from
    /// which steps start.
    pub fn thin(&mut self, states: &mut [PathState]) {
        let Some(end) = states.len().checked_sub(2) else { return };
        loop {
            let between = |index: &usize| !index.is_multiple_of(self.stride);
            for index in (0..end).filter(between) {
                states[index].state.history = Vec::new();
                states[index].histories = Some(self.histories.clone());
            }
            let kept = states[..end].iter().filter(|state| state.histories.is_none()).count();
            if kept <= self.most || self.stride > states.len() {
                return;
            }
            self.stride *= 2;
        }
    }
}
