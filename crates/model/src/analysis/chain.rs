//! From an objective on displacements and forces to one on the unknowns, the design and the parameters.

use crate::model::Design;
use slipstick_design::objective::{Objective, StateDerivative, StateView};
use slipstick_path::{PathGradient, PathObjective, StateError, StepState};

/// Internal and external forces at a state. \[F\]
pub(super) struct Forces {
    internal: Vec<f64>,
    external: Vec<f64>,
}

impl Forces {
    pub(super) fn at(design: &Design, time: f64, state: &StepState) -> Result<Self, StateError> {
        let n = design.model().prescribed().fixed().len();
        let (mut internal, mut external) = (vec![0.0; n], vec![0.0; n]);
        design.internal_force(&state.unknowns[..n], &mut internal)?;
        design.model().external_force(&state.unknowns[..n], time, &mut external);
        Ok(Self { internal, external })
    }

    pub(super) fn view<'a>(&'a self, step: usize, steps: usize, time: f64, state: &'a StepState) -> StateView<'a> {
        StateView {
            step,
            steps,
            time,
            displacement: &state.unknowns[..self.internal.len()],
            internal_force: &self.internal,
            external_force: &self.external,
        }
    }
}

/// Chains an objective on forces to unknowns, design, moduli and loads: ∂θ/∂d += (∂f/∂d)ᵀ ∂θ/∂f, ∂θ/∂φ += (∂f/∂φ)ᵀ ∂θ/∂f.
///
/// Nothing depends on the multipliers. Paper: (92)–(99).
pub(super) struct Adapter<'a> {
    pub(super) objective: &'a dyn Objective,
    /// User steps of the path.
    pub(super) steps: usize,
    /// Whether derivatives with respect to moduli and loads are requested.
    pub(super) parameters: bool,
}

impl PathObjective<Design> for Adapter<'_> {
    fn add_derivative(
        &mut self,
        design: &Design,
        step: usize,
        time: f64,
        state: &StepState,
        by_unknowns: &mut [f64],
        to: &mut PathGradient,
    ) -> Result<(), StateError> {
        if !self.objective.observes(step, self.steps) {
            return Ok(());
        }
        let forces = Forces::at(design, time, state)?;
        let n = forces.internal.len();
        let d = &state.unknowns[..n];
        let [mut by_displacement, mut by_internal, mut by_external] = std::array::from_fn(|_| vec![0.0; n]);
        self.objective.derivative(
            &forces.view(step, self.steps, time, state),
            &mut StateDerivative {
                displacement: &mut by_displacement,
                internal_force: &mut by_internal,
                external_force: &mut by_external,
            },
        );
        design.add_internal_tangent_product(d, &by_internal, &mut by_displacement)?;
        design.model().pull_back_external_force(d, time, &by_external, &mut by_displacement);
        by_unknowns.iter_mut().zip(&by_displacement).for_each(|(to, from)| *to += from);
        design.pull_back_density(d, &by_internal, &mut to.design)?;
        if self.parameters {
            design.pull_back_moduli(d, &by_internal, &mut to.parameters)?;
            design.model().pull_back_loads(d, time, &by_external, &mut to.parameters);
        }
        Ok(())
    }
}
