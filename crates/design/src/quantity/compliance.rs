//! The compliance of a loaded structure.

use super::{Dimension, Quantity, StateDerivative, StateView};

/// Work of the current loads on the current displacements, `f_ext · d`. \[F L\]
///
/// Minimizing it makes the structure stiff under its loads; for a linear structure it is twice the
/// stored energy. If only displacements are prescribed, it is zero.
#[derive(Clone, Debug)]
pub struct Compliance {
    name: String,
}

impl Default for Compliance {
    /// With the name `compliance`.
    fn default() -> Self {
        Self::named("compliance")
    }
}

impl Compliance {
    /// With a custom name.
    pub fn named(name: impl Into<String>) -> Self {
        Self { name: name.into() }
    }
}

impl Quantity for Compliance {
    fn name(&self) -> &str {
        &self.name
    }

    fn dimension(&self) -> Dimension {
        Dimension::WORK
    }

    fn value(&self, state: &StateView) -> f64 {
        state.external_force.iter().zip(state.displacement).map(|(f, d)| f * d).sum()
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        for i in 0..state.displacement.len() {
            to.displacement[i] += weight * state.external_force[i];
            to.external_force[i] += weight * state.displacement[i];
        }
    }
}
