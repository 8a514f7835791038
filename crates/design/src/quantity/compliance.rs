//! The compliance of a loaded structure.

use super::{Measure, Objective, ObservedSteps, StateDerivative, StateView};

/// Work of the current loads on the current displacements: `θ_s = f_ext · d`. \[F L\]
///
/// Minimising it makes the structure stiff under its loads; for a linear structure it is twice the stored energy. If
/// only displacements are prescribed, it is zero.
#[derive(Clone, Debug)]
pub struct Compliance {
    steps: ObservedSteps,
}

impl Compliance {
    /// Check `steps` against the load path with [`ObservedSteps::check`].
    pub fn new(steps: ObservedSteps) -> Self {
        Self { steps }
    }
}

impl Objective for Compliance {
    fn name(&self) -> &str {
        "compliance"
    }

    fn measure(&self) -> Measure {
        Measure::Work
    }

    fn observes(&self, step: usize, steps: usize) -> bool {
        self.steps.contains(step, steps)
    }

    fn value(&self, state: &StateView) -> f64 {
        state.external_force.iter().zip(state.displacement).map(|(f, d)| f * d).sum()
    }

    fn derivative(&self, state: &StateView, derivative: &mut StateDerivative) {
        for i in 0..state.displacement.len() {
            derivative.displacement[i] += state.external_force[i];
            derivative.external_force[i] += state.displacement[i];
        }
    }
}
