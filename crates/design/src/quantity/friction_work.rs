//! Work dissipated by friction.

use super::{Dimension, Patch, Quantity, Reads, StateDerivative, StateView};

/// Work that friction dissipates on a patch: Σ_j ζ_τj·ũ_τj, summed over all (sub-)steps since the
/// start of the load case. \[F L\]
///
/// ũ_τ is the objective slip increment of the paper, (24), which depends on the previous state.
/// Test: `pair_quantities_by_hand`.
#[derive(Clone, Debug)]
pub struct FrictionWork {
    name: String,
    patch: Patch,
}

impl FrictionWork {
    /// The work dissipated on a patch.
    pub fn new(name: impl Into<String>, patch: Patch) -> Self {
        Self { name: name.into(), patch }
    }
}

impl Quantity for FrictionWork {
    fn name(&self) -> &str {
        &self.name
    }

    fn dimension(&self) -> Dimension {
        Dimension::WORK
    }

    fn reads(&self) -> Reads {
        Reads { contact: true, ..Reads::default() }
    }

    fn accumulates(&self) -> bool {
        true
    }

    fn needs_contact(&self) -> bool {
        true
    }

    fn value(&self, state: &StateView) -> f64 {
        let nodes = self.patch.of(state.contact).filter(|(_, at)| at.status != 0);
        nodes.map(|(_, at)| at.multiplier[1] * at.slip[0] + at.multiplier[2] * at.slip[1]).sum()
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        for (j, at) in self.patch.of(state.contact).filter(|(_, at)| at.status != 0) {
            for c in 0..2 {
                to.contact[j].multiplier[1 + c] += weight * at.slip[c];
                to.contact[j].slip[c] += weight * at.multiplier[1 + c];
            }
        }
    }
}
