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

    fn counted(&self, count: usize) -> impl Iterator<Item = usize> {
        let all = self.unknowns.is_none().then_some(0..count).into_iter().flatten();
        self.unknowns.iter().flatten().map(|&unknown| unknown as usize).chain(all)
    }
}

/// e_n + e_{n−1} of an unknown. \[F\]
fn forces(state: &StateView, i: usize) -> f64 {
    loads(state, i) + state.previous.reaction[i] + state.reaction[i]
}

/// The part of loads in e_n + e_{n−1}. \[F\]
fn loads(state: &StateView, i: usize) -> f64 {
    state.previous.external_force[i] + state.external_force[i]
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
        let work = self.counted(state.displacement.len()).map(|i| forces(state, i) * moved(state, i));
        let of_loads = self.loaded.iter().map(|&i| loads(state, i as usize) * moved(state, i as usize));
        work.chain(of_loads).fold(0.0, |sum, term| sum + 0.5 * term)
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        for i in self.counted(state.displacement.len()) {
            let by_displacement = 0.5 * weight * forces(state, i);
            let by_force = 0.5 * weight * moved(state, i);
            to.displacement[i] += by_displacement;
            to.previous.displacement[i] -= by_displacement;
            to.external_force[i] += by_force;
            to.previous.external_force[i] += by_force;
            to.reaction[i] += by_force;
            to.previous.reaction[i] += by_force;
        }
        for i in self.loaded.iter().map(|&i| i as usize) {
            let by_displacement = 0.5 * weight * loads(state, i);
            let by_force = 0.5 * weight * moved(state, i);
            to.displacement[i] += by_displacement;
            to.previous.displacement[i] -= by_displacement;
            to.external_force[i] += by_force;
            to.previous.external_force[i] += by_force;
        }
    }
}
