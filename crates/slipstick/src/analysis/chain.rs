//! From an objective on displacements and forces to one on the unknowns, the design and the parameters.

use crate::model::ContactModel;
use slipstick_design::objective::{Objective, StateDerivative, StateView};
use slipstick_path::{Path, PathGradient, PathObjective, StateError, StepState};

/// Internal and external forces at a state. \[F\]
pub(super) struct Forces {
    internal: Vec<f64>,
    external: Vec<f64>,
}

impl Forces {
    pub(super) fn at(model: &ContactModel, time: f64, state: &StepState) -> Result<Self, StateError> {
        let n = model.prescribed().fixed().len();
        let (mut internal, mut external) = (vec![0.0; n], vec![0.0; n]);
        model.internal_force(&state.unknowns[..n], &mut internal)?;
        model.external_force(&state.unknowns[..n], time, &mut external);
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
    objective: &'a dyn Objective,
    steps: usize,
    /// Per observed step: its number, ∂θ/∂y, and ∂θ/∂φ and ∂θ/∂p.
    partials: Vec<(usize, Vec<f64>, PathGradient)>,
}

impl<'a> Adapter<'a> {
    pub(super) fn new(objective: &'a dyn Objective, steps: usize) -> Self {
        Self { objective, steps, partials: Vec::new() }
    }

    pub(super) fn prepare(&mut self, model: &ContactModel, path: &Path) -> Result<(), StateError> {
        for (step, at) in path.completed() {
            if !self.objective.observes(step, self.steps) {
                continue;
            }
            let forces = Forces::at(model, at.time, &at.state)?;
            let n = forces.internal.len();
            let d = &at.state.unknowns[..n];
            let [mut by_displacement, mut by_internal, mut by_external] = std::array::from_fn(|_| vec![0.0; n]);
            self.objective.derivative(
                &forces.view(step, self.steps, at.time, &at.state),
                &mut StateDerivative {
                    displacement: &mut by_displacement,
                    internal_force: &mut by_internal,
                    external_force: &mut by_external,
                },
            );
            model.add_internal_tangent_product(d, &by_internal, &mut by_displacement)?;
            model.pull_back_external_force(d, at.time, &by_external, &mut by_displacement);
            let mut design = vec![0.0; model.solid().elements()];
            model.pull_back_density(d, &by_internal, &mut design)?;
            let mut parameters = vec![0.0; model.parameter_names().len()];
            model.pull_back_moduli(d, &by_internal, &mut parameters)?;
            model.pull_back_loads(d, at.time, &by_external, &mut parameters);
            self.partials.push((step, by_displacement, PathGradient { design, parameters }));
        }
        Ok(())
    }
}

impl PathObjective for Adapter<'_> {
    fn add_derivative(
        &mut self,
        step: usize,
        _time: f64,
        _state: &StepState,
        by_unknowns: &mut [f64],
        to: &mut PathGradient,
    ) -> Result<(), StateError> {
        let add = |to: &mut [f64], from: &[f64]| to.iter_mut().zip(from).for_each(|(to, from)| *to += from);
        if let Some((_, d, gradient)) = self.partials.iter().find(|p| p.0 == step) {
            add(by_unknowns, d);
            add(&mut to.design, &gradient.design);
            add(&mut to.parameters, &gradient.parameters);
        }
        Ok(())
    }
}
