//! Forward analysis and gradient of a built problem.

use crate::model::{ContactModel, Parameter};
use slipstick_contact::friction::Status;
use slipstick_design::objective::{Objective, StateDerivative, StateView};
use slipstick_path::{
    Guide, LinearSystem, MarchFailure, MarchObserver, MarchOptions, Path, PathGradient, PathObjective, PathState,
    StateError, StepState, SweepError, SweepOptions, Timings, march, sweep,
};

/// Contact results of a slave node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodalContact {
    /// Global node number.
    pub node: u32,
    /// Open, stick or slip.
    pub status: Status,
    /// Multiplier ζ = (normal, ξ, η) in the node's frame, minus the slave traction; normal ≥ 0 in compression. \[F/L²\]
    pub traction: [f64; 3],
    /// The multiplier as a vector z. \[F/L²\]
    pub global_traction: [f64; 3],
    /// Weighted gap over tributary area, ≥ 0 open; `None` where nothing lies opposite. \[L\]
    pub gap: Option<f64>,
    /// Weighted gap g̃. \[L³\]
    pub weighted_gap: f64,
    /// Weighted slip increment ũ_τ of the last (sub-)step. \[L³\]
    pub weighted_slip: [f64; 2],
    /// Slip increment over tributary area. \[L\]
    pub slip: [f64; 2],
    /// Tributary area of the overlap. \[L²\]
    pub area: f64,
}

/// A forward analysis with the objective's value.
#[derive(Debug, Clone)]
pub struct Forward {
    /// Densities of all elements.
    pub density: Vec<f64>,
    /// All states.
    pub path: Path,
    /// Per user's step: θ_s where the objective observes it, else 0.
    pub step_values: Vec<f64>,
    /// θ = Σ θ_s.
    pub value: f64,
    /// What is probably not meant.
    pub notice: Option<ForwardNotice>,
}

/// Derivatives of the objective.
#[derive(Debug, Clone, PartialEq)]
pub struct Gradients {
    /// dθ/dφ of every element, zero outside of the design.
    pub density: Vec<f64>,
    /// dθ/dp of every other parameter of the model but coefficients of friction that are 0. Stiffnesses of contact that are
    /// multiples of the bodies' own at the start design follow the moduli.
    pub parameters: Vec<(Parameter, f64)>,
}

/// What a whole path can be that is probably not meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum ForwardNotice {
    /// There are contact pairs, but no slave node is ever in contact: contact forces are 0, or rounding.
    #[error("contact never closed on the path: contact forces and their derivatives are 0, or rounding")]
    ContactNeverCloses,
    /// No slave node is in contact at the steps that the objective observes.
    #[error("contact is open at every step that the objective observes: its value and gradient are 0, or rounding")]
    ContactOpenWhereObserved,
}

/// Why an analysis failed.
#[derive(Debug, thiserror::Error)]
pub enum AnalysisError {
    /// The march failed beyond retry.
    #[error(transparent)]
    March(#[from] Box<MarchFailure>),
    /// The adjoint failed.
    #[error(transparent)]
    Sweep(#[from] SweepError),
    /// A converged state could not be evaluated.
    #[error(transparent)]
    State(#[from] StateError),
    /// The path was cancelled before its end.
    #[error("the path ends after {steps} of {all} load steps: the objective has no gradient there")]
    Unfinished {
        /// Steps that are complete.
        steps: usize,
        /// Steps of the load path.
        all: usize,
    },
}

/// A model with load steps, objective and solver: everything that a density determines.
pub struct Analysis {
    /// The discrete problem.
    pub model: ContactModel,
    /// Ends of the user's steps in pseudo-time, ascending.
    pub times: Vec<f64>,
    /// What is minimised, if anything.
    pub objective: Option<Box<dyn Objective>>,
    /// March settings.
    pub march: MarchOptions,
    /// Sweep settings.
    pub sweep: SweepOptions,
    /// Linear solver.
    pub linear: LinearSystem,
    /// Path of a nearby density, which the next march follows for its start values.
    pub guide: Option<Guide>,
}

impl Analysis {
    /// Measures from now on, with `clock` (seconds from any origin), where the time goes.
    pub fn measure(&mut self, clock: fn() -> f64) {
        self.model.set_timings(Timings::with_clock(clock));
        self.linear.set_timings(Timings::with_clock(clock));
    }

    /// Where the time went since [`measure`](Self::measure).
    pub fn timings(&self) -> Timings {
        self.model.timings() + self.linear.timings()
    }

    /// Marches the whole path with the given element densities and evaluates the objective.
    ///
    /// # Errors
    /// [`AnalysisError::March`] with what converged before the failure.
    pub fn forward(&mut self, density: &[f64], observer: &mut dyn MarchObserver) -> Result<Forward, AnalysisError> {
        self.model.set_density(density);
        let rest = self.model.rest();
        // without an objective there is no gradient to keep factors for
        let factor_memory = if self.objective.is_some() { self.march.factor_memory } else { 0 };
        let options = MarchOptions { factor_memory, ..self.march };
        let guide = self.guide.as_ref();
        let path = march(&mut self.model, &mut self.linear, rest, &self.times, &options, guide, observer)?;
        let mut step_values = vec![0.0; self.times.len()];
        let steps = self.times.len();
        if let Some(objective) = &self.objective {
            for (step, state) in path.completed() {
                if objective.observes(step, steps) {
                    let force = unbalanced_force(&self.model, state.time, &state.state)?;
                    step_values[step - 1] =
                        objective.value(&view(&self.model, step, steps, state.time, &state.state, &force));
                }
            }
        }
        let notice = self.notice(&path);
        Ok(Forward { density: density.to_vec(), value: step_values.iter().sum(), path, step_values, notice })
    }

    /// Whether contact is open where it should count; nothing is said of a path that was cut short.
    fn notice(&self, path: &Path) -> Option<ForwardNotice> {
        let steps = self.times.len();
        if path.steps < steps || self.model.interfaces().is_empty() {
            return None;
        }
        let closed = |state: &PathState| state.active_set.iter().any(|&status| status != 0);
        if !path.states.iter().any(closed) {
            return Some(ForwardNotice::ContactNeverCloses);
        }
        let objective = self.objective.as_ref()?;
        let mut observed = path.completed().filter(|(step, _)| objective.observes(*step, steps));
        (!observed.any(|(_, state)| closed(state))).then_some(ForwardNotice::ContactOpenWhereObserved)
    }

    /// dθ/dφ of every element: the densities' part of [`gradients`](Self::gradients).
    ///
    /// # Errors
    /// As [`gradients`](Self::gradients).
    ///
    /// # Panics
    /// Without an objective.
    pub fn gradient(&mut self, forward: &Forward) -> Result<Vec<f64>, AnalysisError> {
        self.sweep_back(forward, false).map(|gradient| gradient.design)
    }

    /// Derivatives of θ at the densities of a forward analysis by this model, with the friction that it had then.
    ///
    /// # Errors
    /// [`AnalysisError::Sweep`]; [`AnalysisError::Unfinished`] for a path that was cancelled.
    ///
    /// # Panics
    /// Without an objective.
    pub fn gradients(&mut self, forward: &Forward) -> Result<Gradients, AnalysisError> {
        let PathGradient { design, parameters } = self.sweep_back(forward, true)?;
        // without friction, θ has a kink: a coefficient cannot become negative
        let interfaces = self.model.interfaces();
        let smooth =
            |p: &Parameter| !matches!(p, Parameter::Friction { interface } if interfaces[*interface].friction == 0.0);
        let parameters = self.model.parameter_names().into_iter().zip(parameters).filter(|(p, _)| smooth(p)).collect();
        Ok(Gradients { density: design, parameters })
    }

    fn sweep_back(&mut self, forward: &Forward, parameters: bool) -> Result<PathGradient, AnalysisError> {
        let (steps, all) = (forward.path.steps, self.times.len());
        if steps < all {
            return Err(AnalysisError::Unfinished { steps, all });
        }
        if self.model.density() != forward.density {
            self.model.set_density(&forward.density);
        }
        let options = SweepOptions { parameters, ..self.sweep };
        let objective = self.objective.take().expect("a gradient needs an objective");
        let mut adapter = Adapter { objective: objective.as_ref(), steps: self.times.len(), partials: Vec::new() };
        let result = adapter.prepare(&self.model, &forward.path).map_err(AnalysisError::from).and_then(|()| {
            sweep(&mut self.model, &mut self.linear, &forward.path, &mut adapter, &options).map_err(Into::into)
        });
        self.objective = Some(objective);
        result
    }
}

fn unbalanced_force(model: &ContactModel, time: f64, state: &StepState) -> Result<Vec<f64>, StateError> {
    let n = model.prescribed().fixed().len();
    let mut force = vec![0.0; n];
    model.unbalanced_force(&state.unknowns[..n], time, &mut force)?;
    Ok(force)
}

fn view<'a>(
    model: &ContactModel,
    step: usize,
    steps: usize,
    time: f64,
    state: &'a StepState,
    force: &'a [f64],
) -> StateView<'a> {
    let n = model.prescribed().fixed().len();
    StateView { step, steps, time, displacement: &state.unknowns[..n], internal_force: force }
}

/// Chains an objective on internal minus external forces f to unknowns, design, moduli and loads: ∂θ/∂d += (∂f/∂d)ᵀ ∂θ/∂f,
/// ∂θ/∂φ += (∂f/∂φ)ᵀ ∂θ/∂f.
///
/// Nothing depends on the multipliers. Paper: (92)–(99).
struct Adapter<'a> {
    objective: &'a dyn Objective,
    steps: usize,
    /// Per observed step: its number, ∂θ/∂y, and ∂θ/∂φ and ∂θ/∂p.
    partials: Vec<(usize, Vec<f64>, PathGradient)>,
}

impl Adapter<'_> {
    fn prepare(&mut self, model: &ContactModel, path: &Path) -> Result<(), StateError> {
        for (step, at) in path.completed() {
            if !self.objective.observes(step, self.steps) {
                continue;
            }
            let force = unbalanced_force(model, at.time, &at.state)?;
            let n = force.len();
            let d = &at.state.unknowns[..n];
            let (mut by_displacement, mut by_force) = (vec![0.0; n], vec![0.0; n]);
            self.objective.derivative(
                &view(model, step, self.steps, at.time, &at.state, &force),
                &mut StateDerivative { displacement: &mut by_displacement, internal_force: &mut by_force },
            );
            model.pull_back_unbalanced_force(d, at.time, &by_force, &mut by_displacement)?;
            let mut by_design = vec![0.0; model.solid().elements()];
            model.pull_back_density(d, &by_force, &mut by_design)?;
            let mut parameters = vec![0.0; model.parameter_names().len()];
            model.pull_back_moduli(d, &by_force, &mut parameters)?;
            model.pull_back_loads(d, at.time, &by_force, &mut parameters);
            self.partials.push((step, by_displacement, PathGradient { design: by_design, parameters }));
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
