//! Forward analysis and gradient of a built problem.

mod chain;
mod pairs;
mod rounding;

use crate::model::{ContactModel, Design, Parameter, Workspace};
use chain::{Adapter, Forces};
pub use pairs::{PairResult, pair_results};
pub use rounding::Rounding;
use slipstick_design::ElementValues;
use slipstick_design::objective::{Objective, StateView, WrongDerivative, check_derivatives};
use slipstick_path::{
    Guide, LinearSystem, LoadPath, MarchFailure, MarchObserver, MarchOptions, Path, PathGradient, PathState, Solver,
    StateError, SweepError, SweepOptions, Timings, march, sweep,
};

/// A forward analysis with the objective's value.
#[derive(Debug, Clone)]
pub struct Forward {
    /// Densities of all elements.
    pub density: ElementValues,
    /// All states.
    pub path: Path,
    /// For each user's step, θ_s if the objective observes it, otherwise 0.
    pub step_values: Vec<f64>,
    /// θ = Σ θ_s.
    pub value: f64,
    /// A likely mistake in the case.
    pub notice: Option<ForwardNotice>,
    /// Set where θ at the end of a whole path is only round-off.
    pub rounding: Option<Rounding>,
}

/// Derivatives of the objective.
#[derive(Debug, Clone, PartialEq)]
pub struct Gradients {
    /// dθ/dφ of every element, zero outside the design.
    pub density: ElementValues,
    /// dθ/dp of every other parameter of the model, except coefficients of friction that are 0. Contact stiffnesses
    /// that are multiples of the bodies' own stiffness at the start design vary with the moduli.
    pub parameters: Vec<(Parameter, f64)>,
}

/// A likely mistake in the case that a whole path reveals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum ForwardNotice {
    /// There are contact pairs, but no slave node is ever in contact: contact forces are 0, or only round-off.
    #[error("contact never closed on the path: contact forces and their derivatives are 0, or round-off")]
    ContactNeverCloses,
    /// No slave node is in contact at the steps that the objective observes.
    #[error("contact is open at every step that the objective observes: its value and gradient are 0, or round-off")]
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

/// Why an objective is rejected.
#[derive(Debug, thiserror::Error)]
pub enum ObjectiveRefused {
    /// Its derivative is not the derivative of its value.
    #[error(transparent)]
    Derivative(#[from] WrongDerivative),
    /// It observes no step of the load path: it would always be zero.
    #[error(
        "objective `{name}` observes none of the {steps} load steps; Objective::observes must be true for at least one"
    )]
    NoSteps {
        /// The objective's name.
        name: String,
        /// Steps of the load path.
        steps: usize,
    },
}

/// A model with load steps, objective and solver: everything that a density determines.
pub struct Analysis {
    /// The discrete problem with the densities of the last analysis.
    pub design: Design,
    /// Buffers of its evaluations.
    pub workspace: Workspace,
    /// Ends of the user's steps in pseudo-time, ascending.
    pub times: Vec<f64>,
    /// Pseudo-times, between two of the steps, at which another load case begins at rest.
    pub restarts: Vec<f64>,
    /// The objective to be minimised, if any; [`set_objective`](Self::set_objective) sets your own.
    pub objective: Option<Box<dyn Objective>>,
    /// March settings.
    pub march: MarchOptions,
    /// Sweep settings.
    pub sweep: SweepOptions,
    /// Linear solver.
    pub linear: LinearSystem,
    /// Path of a nearby density, from which the next march takes its start values.
    pub guide: Option<Guide>,
}

impl Analysis {
    /// The discrete problem without its densities.
    pub fn model(&self) -> &ContactModel {
        self.design.model()
    }

    /// Sets the density of every element, 1 outside the design.
    pub fn set_density(&mut self, density: &ElementValues) {
        self.design = Design::new(self.design.model().clone(), density);
        self.workspace.forget();
    }

    /// Sets the coefficient of friction of all contact pairs.
    pub fn set_friction(&mut self, friction: f64) {
        self.design.of_changed_model(|model| model.set_friction(friction));
    }

    /// Sets when Uzawa's iteration stops; does nothing if no contact pair uses it.
    pub(crate) fn set_uzawa(&mut self, uzawa: Option<crate::model::Uzawa>) {
        self.design.of_changed_model(|model| model.set_uzawa(uzawa));
    }

    /// Sets the relative tolerance of Uzawa's iteration; does nothing if no contact pair uses it.
    pub(crate) fn set_uzawa_tolerance(&mut self, tolerance: f64) {
        self.design.of_changed_model(|model| model.set_uzawa_tolerance(tolerance));
    }

    /// From now on, measures with `clock` (seconds from any origin) how the time is spent.
    pub fn measure(&mut self, clock: fn() -> f64) {
        self.workspace.timings = Timings::with_clock(clock);
        self.linear.set_timings(Timings::with_clock(clock));
    }

    /// How the time was spent since [`measure`](Self::measure) was called.
    pub fn timings(&self) -> Timings {
        self.workspace.timings + self.linear.timings()
    }

    /// Replaces the objective. Debug builds check its derivatives first ([`check_objective`](Self::check_objective)).
    ///
    /// # Errors
    /// [`ObjectiveRefused`]; the previous objective is then kept.
    pub fn set_objective(&mut self, objective: Box<dyn Objective>) -> Result<(), ObjectiveRefused> {
        let steps = self.times.len();
        if !(1..=steps).any(|step| objective.observes(step, steps)) {
            return Err(ObjectiveRefused::NoSteps { name: objective.name().into(), steps });
        }
        if cfg!(debug_assertions) {
            self.check_objective(objective.as_ref())?;
        }
        self.objective = Some(objective);
        Ok(())
    }

    /// Compares an objective's derivatives with differences of its values, at small random displacements of all nodes and
    /// the internal forces of the bodies there (density as set), for every step that it observes.
    ///
    /// # Errors
    /// The first wrong derivative.
    pub fn check_objective(&self, objective: &dyn Objective) -> Result<(), WrongDerivative> {
        let (displacement, internal_force) = self.some_state();
        let steps = self.times.len();
        for (step, &time) in (1..=steps).zip(&self.times).filter(|(step, _)| objective.observes(*step, steps)) {
            let mut external_force = vec![0.0; displacement.len()];
            self.model().external_force(&displacement, time, &mut external_force);
            let (displacement, internal_force) = (&displacement[..], &internal_force[..]);
            let external_force = &external_force[..];
            check_derivatives(
                objective,
                &StateView { step, steps, time, displacement, internal_force, external_force },
            )?;
        }
        Ok(())
    }

    /// Displacements of all nodes that are small compared to the elements, and the internal forces there.
    fn some_state(&self) -> (Vec<f64>, Vec<f64>) {
        let n = self.model().prescribed().fixed().len();
        let size = self.model().smallest_element().cbrt();
        let mut force = vec![0.0; n];
        let mut amplitude = 1e-2 * size;
        loop {
            // spread by the golden ratio, so that no two entries are alike
            let spread = |i: usize| (0.618_033_988_749_894_9 * (i + 1) as f64).fract() - 0.5;
            let displacement: Vec<f64> = (0..n).map(|i| amplitude * spread(i)).collect();
            // at rest no element is inverted, so this loop ends
            if self.design.internal_force(&displacement, &mut force).is_ok() {
                return (displacement, force);
            }
            amplitude *= 0.1;
        }
    }

    /// Marches the whole path with the given element densities and evaluates the objective.
    ///
    /// # Errors
    /// [`AnalysisError::March`] with the path up to the failure.
    pub fn forward(
        &mut self,
        density: &ElementValues,
        observer: &mut dyn MarchObserver,
    ) -> Result<Forward, AnalysisError> {
        self.set_density(density);
        // without an objective there is no gradient to keep factors for
        let factor_memory = if self.objective.is_some() { self.march.factor_memory } else { 0 };
        let options = MarchOptions { factor_memory, ..self.march };
        let (start, guide) = (self.design.model().rest(), self.guide.as_ref());
        let load_path = LoadPath { start, times: &self.times, restarts: &self.restarts, guide };
        let Self { design, linear, workspace, .. } = self;
        let path = march(&mut Solver { problem: &*design, linear, workspace }, &load_path, &options, observer)?;
        let mut step_values = vec![0.0; self.times.len()];
        let steps = self.times.len();
        if let Some(objective) = &self.objective {
            for (index, at) in path.states.iter().enumerate() {
                if let Some(step) = at.completes.filter(|&step| objective.observes(step, steps)) {
                    let state = path.state(index, self.linear.ranks());
                    let forces = Forces::at(&self.design, at.time, &state)?;
                    step_values[step - 1] = objective.value(&forces.view(step, steps, at.time, &state));
                }
            }
        }
        let notice = self.notice(&path);
        let value = step_values.iter().sum();
        let rounding = if path.steps == steps { self.rounding(value, notice) } else { None };
        Ok(Forward { density: density.clone(), value, path, step_values, notice, rounding })
    }

    /// Whether contact is open where it should count; `None` for an incomplete path.
    fn notice(&self, path: &Path) -> Option<ForwardNotice> {
        let steps = self.times.len();
        if path.steps < steps || self.model().interfaces().is_empty() {
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

    /// dθ/dφ of every element, the density part of [`gradients`](Self::gradients).
    ///
    /// # Errors
    /// As [`gradients`](Self::gradients).
    ///
    /// # Panics
    /// Without an objective.
    pub fn gradient(&mut self, forward: &Forward) -> Result<ElementValues, AnalysisError> {
        self.sweep_back(forward, false).map(|gradient| gradient.design.into())
    }

    /// Derivatives of θ at the densities of a forward analysis by this model, with the coefficients of friction of that
    /// analysis.
    ///
    /// # Errors
    /// [`AnalysisError::Sweep`]; [`AnalysisError::Unfinished`] for a path that was cancelled.
    ///
    /// # Panics
    /// Without an objective.
    pub fn gradients(&mut self, forward: &Forward) -> Result<Gradients, AnalysisError> {
        let PathGradient { design, parameters } = self.sweep_back(forward, true)?;
        // without friction, θ has a kink: a coefficient cannot become negative
        let interfaces = self.model().interfaces();
        let smooth =
            |p: &Parameter| !matches!(p, Parameter::Friction { interface } if interfaces[*interface].friction == 0.0);
        let parameters =
            self.model().parameter_names().into_iter().zip(parameters).filter(|(p, _)| smooth(p)).collect();
        Ok(Gradients { density: design.into(), parameters })
    }

    fn sweep_back(&mut self, forward: &Forward, parameters: bool) -> Result<PathGradient, AnalysisError> {
        let (steps, all) = (forward.path.steps, self.times.len());
        if steps < all {
            return Err(AnalysisError::Unfinished { steps, all });
        }
        if *self.design.density() != forward.density {
            self.set_density(&forward.density);
        }
        let options = SweepOptions { parameters, ..self.sweep };
        let Self { design, linear, workspace, objective, .. } = self;
        let objective = objective.as_deref().expect("a gradient needs an objective");
        let mut adapter = Adapter { objective, steps: all, parameters };
        let mut solver = Solver { problem: &*design, linear, workspace };
        sweep(&mut solver, &forward.path, &mut adapter, &options).map_err(Into::into)
    }
}
