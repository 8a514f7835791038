//! Work of loads and supports.

use super::{Dimension, Quantity, Reads, StateDerivative, StateView};

/// Work that loads, supports and prescribed motions do on the bodies, summed over all (sub-)steps
/// since the start of the load case by the trapezoidal rule: Σ_n ½ (e_n + e_{n−1})·(d_n − d_{n−1}),
/// with the nodal forces e of loads and reactions. \[F L\]
///
/// Test: `external_work_by_hand`.
#[derive(Clone, Debug)]
pub struct ExternalWork {
    name: String,
    /// Displacement unknowns that count, `3·node + component`; `None`: all.
    unknowns: Option<Vec<u32>>,
    /// Further unknowns, at which only the loads count.
    loaded: Vec<u32>,
}

impl ExternalWork {
    /// The work done on all nodes.
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), unknowns: None, loaded: Vec::new() }
    }

    /// Counts only the work done on these displacement unknowns, `3·node + component`.
    #[must_use]
    pub fn on(self, unknowns: Vec<u32>) -> Self {
        Self { unknowns: Some(unknowns), ..self }
    }

    /// Also counts the work of loads, but not of reactions, on these displacement unknowns.
    #[must_use]
    pub fn of_loads_on(self, unknowns: Vec<u32>) -> Self {
        Self { loaded: unknowns, ..self }
    }

    /// The unknowns that count, and whether their reactions do.
    fn counted(&self, count: usize) -> impl Iterator<Item = (usize, bool)> {
        let all = self.unknowns.is_none().then_some(0..count).into_iter().flatten();
        let some = self.unknowns.iter().flatten().map(|&unknown| unknown as usize);
        let loaded = self.loaded.iter().map(|&unknown| (unknown as usize, false));
        some.chain(all).map(|unknown| (unknown, true)).chain(loaded)
    }
}

/// e_n + e_{n−1} of an unknown. \[F\]
fn forces(state: &StateView, i: usize, reactions: bool) -> f64 {
    let before = &state.previous;
    let loads = before.external_force[i] + state.external_force[i];
    if reactions { loads + before.reaction[i] + state.reaction[i] } else { loads }
}

/// d_n − d_{n−1} of an unknown. \[L\]
fn moved(state: &StateView, i: usize) -> f64 {
    state.displacement[i] - state.previous.displacement[i]
}

impl Quantity for ExternalWork {
    fn name(&self) -> &str {
        &self.name
    }

    fn dimension(&self) -> Dimension {
        Dimension::WORK
    }

    fn reads(&self) -> Reads {
        Reads { reaction: true, previous: true, ..Reads::default() }
    }

    fn accumulates(&self) -> bool {
        true
    }

    fn value(&self, state: &StateView) -> f64 {
        let work = |(i, reactions)| 0.5 * forces(state, i, reactions) * moved(state, i);
        self.counted(state.displacement.len()).map(work).fold(0.0, |sum, work| sum + work)
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        for (i, reactions) in self.counted(state.displacement.len()) {
            let by_displacement = 0.5 * weight * forces(state, i, reactions);
            let by_force = 0.5 * weight * moved(state, i);
            to.displacement[i] += by_displacement;
            to.previous.displacement[i] -= by_displacement;
            to.external_force[i] += by_force;
            to.previous.external_force[i] += by_force;
            if reactions {
                to.reaction[i] += by_force;
                to.previous.reaction[i] += by_force;
            }
        }
    }
}
