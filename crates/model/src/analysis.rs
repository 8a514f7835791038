//! Forward analysis and gradient of a built problem.

mod chain;
mod check_quantity;
mod error;
mod forward;
mod load_cases;
mod pairs;
mod previous;
mod repeated;
mod rounding;
mod steps;

use crate::equations::{ContactModel, Design, Parameter, Workspace};
pub(crate) use chain::StateData;
pub use error::{AnalysisError, ResponseRefused};
pub use forward::{Forward, ForwardNotice, Gradients};
pub use load_cases::{Designs, LoadCases};
pub use pairs::{PairResult, pair_results};
pub(crate) use previous::PreviousData;
use repeated::Repeated;
pub use rounding::Rounding;
use slipstick_design::ElementValues;
use slipstick_design::quantity::Reads;
use slipstick_design::response::{Constraint, Response};
use slipstick_path::{
    Guide, LinearSystem, LoadTime, MarchObserver, MarchOptions, Path, PathGradient, PathState, SweepOptions, Timings,
};
pub(crate) use steps::steps_of;

/// A model with load steps, objective and solver: everything that a density determines.
pub struct Analysis {
    /// The discrete problem with the densities of the last analysis, without what
    /// [`cases`](Self::cases) changes.
    pub design: Design,
    /// Buffers of its evaluations.
    pub workspace: Workspace,
    /// Ends of the user's steps, ascending: those of each load case in turn.
    pub times: Vec<LoadTime>,
    /// The load cases, which follow each other.
    pub cases: LoadCases,
    /// The objective to be minimized, if any; [`set_objective`](Self::set_objective) sets your own.
    pub objective: Option<Response>,
    /// Bounds on other responses; [`set_constraints`](Self::set_constraints) sets your own.
    pub constraints: Vec<Constraint>,
    /// March settings.
    pub march: MarchOptions,
    /// Sweep settings.
    pub sweep: SweepOptions,
    /// Linear solver.
    pub linear: LinearSystem,
    /// Path of a nearby density, which provides initial guesses for the next march.
    pub guide: Option<Guide>,
}

impl Analysis {
    /// The discrete problem without its densities.
    pub fn model(&self) -> &ContactModel {
        self.design.model()
    }

    /// The ends of the user's steps on [one axis](LoadTime::on_axis).
    pub fn axis(&self) -> Vec<f64> {
        self.times.iter().map(|time| time.on_axis()).collect()
    }

    /// Sets the density of every element, 1 outside the design.
    pub fn set_density(&mut self, density: &ElementValues) {
        self.design = Design::new(self.design.model().clone(), density);
        self.cases.set_density(density);
        self.workspace.forget();
    }

    /// Changes the model, for all load cases.
    fn change_model(&mut self, change: impl FnOnce(&mut ContactModel)) {
        self.design.of_changed_model(change);
        self.cases.follow(&self.design);
    }

    /// Sets the coefficient of friction of all contact pairs, in all load cases.
    pub fn set_friction(&mut self, friction: f64) {
        self.cases.share_friction();
        self.change_model(|model| model.set_friction(friction));
    }

    /// Sets the exponent by which densities are penalized, from the next analysis on.
    pub(crate) fn set_penalization(&mut self, penalization: f64) {
        self.change_model(|model| model.set_penalization(penalization));
    }

    /// Sets the interpolation of energies, from the next analysis on.
    pub(crate) fn set_energy_interpolation(&mut self, energy: Option<slipstick_solid::EnergyInterpolation>) {
        self.change_model(|model| model.set_energy_interpolation(energy));
    }

    /// Sets when Uzawa's iteration stops; does nothing if no contact pair uses it.
    pub(crate) fn set_uzawa(&mut self, uzawa: Option<crate::equations::Uzawa>) {
        self.change_model(|model| model.set_uzawa(uzawa));
    }

    /// Sets the relative tolerance of Uzawa's iteration; does nothing if no contact pair uses it.
    pub(crate) fn set_uzawa_tolerance(&mut self, tolerance: f64) {
        self.change_model(|model| model.set_uzawa_tolerance(tolerance));
    }

    /// Another analysis of the same problem, with a solver and buffers of its own, and without a
    /// guide.
    pub(crate) fn another(&self) -> Self {
        Self {
            design: self.design.clone(),
            workspace: self.workspace.another(),
            times: self.times.clone(),
            cases: self.cases.clone(),
            objective: self.objective.clone(),
            constraints: self.constraints.clone(),
            march: self.march,
            sweep: self.sweep,
            linear: self.linear.another(),
            guide: None,
        }
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

    /// Replaces the objective. Debug builds check the derivatives of its quantities first
    /// ([`check_quantity`](Self::check_quantity)).
    ///
    /// # Errors
    /// [`ResponseRefused`]; the previous objective is then kept.
    pub fn set_objective(&mut self, objective: Response) -> Result<(), ResponseRefused> {
        self.check_response(&objective)?;
        self.objective = Some(objective);
        Ok(())
    }

    /// Replaces the constraints. Debug builds check the derivatives of their quantities first.
    ///
    /// # Errors
    /// [`ResponseRefused`]; the previous constraints are then kept.
    pub fn set_constraints(&mut self, constraints: Vec<Constraint>) -> Result<(), ResponseRefused> {
        constraints.iter().try_for_each(|constraint| self.check_response(&constraint.response))?;
        self.constraints = constraints;
        Ok(())
    }

    fn check_response(&self, response: &Response) -> Result<(), ResponseRefused> {
        let steps = self.times.len();
        if !(1..=steps).any(|step| response.observes(step, steps)) {
            return Err(ResponseRefused::NoSteps { name: response.name().into(), steps });
        }
        if cfg!(debug_assertions) {
            response.terms().iter().try_for_each(|term| self.check_quantity(term.quantity.as_ref()))?;
        }
        Ok(())
    }

    /// The parts of the objective, if any, and the responses of the constraints.
    fn responses(&self) -> Vec<Response> {
        let constraints = self.constraints.iter().map(|constraint| constraint.response.clone());
        self.objective.iter().flat_map(Response::parts).chain(constraints).collect()
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
        // without an objective there is no gradient to keep factors for
        let keeps_factors = self.march.keeps_factors && self.objective.is_some();
        self.forward_keeping(keeps_factors, density, observer)
    }

    /// As [`forward`](Self::forward), if no gradient follows: no factors are kept for it.
    ///
    /// # Errors
    /// As [`forward`](Self::forward).
    pub fn forward_only(
        &mut self,
        density: &ElementValues,
        observer: &mut dyn MarchObserver,
    ) -> Result<Forward, AnalysisError> {
        self.forward_keeping(false, density, observer)
    }

    fn forward_keeping(
        &mut self,
        keeps_factors: bool,
        density: &ElementValues,
        observer: &mut dyn MarchObserver,
    ) -> Result<Forward, AnalysisError> {
        self.set_density(density);
        let options = MarchOptions { keeps_factors, ..self.march };
        let path = self.march_all(&options, observer)?;
        let steps = self.times.len();
        let responses = self.responses();
        let of_extremes: Vec<Option<Response>> =
            self.constraints.iter().map(|constraint| constraint.response.extreme()).collect();
        let all: Vec<&Response> = responses.iter().chain(of_extremes.iter().flatten()).collect();
        let mut quantities = chain::values(&|time| self.design_at(time), &path, steps, &all)?;
        let mut extremes = quantities.split_off(responses.len()).into_iter();
        let mut extreme = |response: &Option<Response>| {
            let response = response.as_ref()?;
            extremes.next().map(|of| response.reduce(&of, &self.axis()).0)
        };
        let extremes: Vec<Option<f64>> = of_extremes.iter().map(&mut extreme).collect();
        let step_values = match &self.objective {
            Some(objective) => objective.step_values(&quantities[0]),
            None => vec![0.0; steps],
        };
        let values = responses.iter().zip(&quantities).map(|(response, of)| response.reduce(of, &self.axis()).0);
        let mut parts: Vec<f64> = values.collect();
        let constraints = parts.split_off(parts.len() - self.constraints.len());
        let value = parts.get(largest(&parts)).copied().unwrap_or(0.0);
        let notice = self.notice(&path);
        let rounding = if path.steps == steps { self.rounding(value, notice.as_ref()) } else { None };
        let density = density.clone();
        Ok(Forward { density, path, step_values, value, parts, constraints, extremes, quantities, notice, rounding })
    }

    /// A notice if contact never closes, also in one load case of several, or is open at all steps
    /// that the objective observes; `None` also for an incomplete path.
    fn notice(&self, path: &Path) -> Option<ForwardNotice> {
        let steps = self.times.len();
        if path.steps < steps || self.model().interfaces().is_empty() {
            return None;
        }
        let closed = |state: &PathState| state.active_set.iter().any(|status| status.is_closed());
        if !path.states.iter().any(closed) {
            return Some(ForwardNotice::ContactNeverCloses);
        }
        // others may be nonzero with open contact, and sums over the path come from earlier steps
        let at_steps = |of: &&Response| of.needs_contact() && !of.accumulates();
        if let Some(objective) = self.objective.as_ref().filter(at_steps) {
            let mut observed = path.completed().filter(|(step, _)| objective.observes(*step, steps));
            if !observed.any(|(_, state)| closed(state)) {
                return Some(ForwardNotice::ContactOpenWhereObserved);
            }
        }
        let never = self.cases.names().iter().zip(path.load_cases());
        let never = never.filter(|(_, states)| !path.states[states.clone()].iter().any(closed));
        let never: Vec<String> = never.map(|(name, _)| name.clone()).collect();
        (!never.is_empty()).then_some(ForwardNotice::ContactNeverClosesIn(never))
    }

    /// dθ/dφ of every element, the density part of [`gradients`](Self::gradients).
    ///
    /// # Errors
    /// As [`gradients`](Self::gradients).
    ///
    /// # Panics
    /// Without an objective.
    pub fn gradient(&mut self, forward: &Forward) -> Result<ElementValues, AnalysisError> {
        self.gradient_of_objective(forward, false).map(|gradient| gradient.design.into())
    }

    /// Derivatives of θ at the densities of a forward analysis by this model, with the coefficients
    /// of friction of that analysis.
    ///
    /// # Errors
    /// [`AnalysisError::Sweep`]; [`AnalysisError::Unfinished`] for a path that was cancelled.
    ///
    /// # Panics
    /// Without an objective.
    pub fn gradients(&mut self, forward: &Forward) -> Result<Gradients, AnalysisError> {
        let gradient = self.gradient_of_objective(forward, true)?;
        Ok(self.named(gradient))
    }

    fn named(&self, PathGradient { design, parameters, .. }: PathGradient) -> Gradients {
        // without friction, θ has a kink: a coefficient cannot become negative
        let interfaces = self.model().interfaces();
        let smooth =
            |p: &Parameter| !matches!(p, Parameter::Friction { interface } if interfaces[*interface].friction == 0.0);
        let names = self.model().all_parameters().into_iter();
        let offered = |p: &Parameter| smooth(p) && self.model().has_parameter(p);
        let parameters = names.zip(parameters).filter(|(p, _)| offered(p)).collect();
        Gradients { density: design.into(), parameters }
    }

    /// Derivatives of the objective's [parts](Response::parts), if any, and of the responses of all
    /// constraints. They share tangents and factors. Derivatives with respect to parameters other than densities are zero
    /// unless `parameters`.
    ///
    /// # Errors
    /// As [`gradients`](Self::gradients).
    pub fn response_gradients(&mut self, forward: &Forward, parameters: bool) -> Result<Vec<Gradients>, AnalysisError> {
        let responses = self.responses();
        let each = responses.iter().zip(&forward.quantities);
        let slopes: Vec<_> = each.map(|(response, of)| response.reduce(of, &self.axis()).1).collect();
        let gradients = self.sweep_back(forward, &responses, &slopes, parameters)?;
        Ok(gradients.into_iter().map(|gradient| self.named(gradient)).collect())
    }

    /// Derivatives of Σ w_kn q_kn, where q_kn is the value of the objective's term k at the user's
    /// step n, `forward.quantities[0][k][n − 1]`, and `weights[k][n − 1]` is w_kn: the product of
    /// the weights with the Jacobian of all these values. The weights of steps that a term does not
    /// observe must be 0. The objective's own reduction, weights and load cases have no effect, so
    /// with an objective that has several terms at all steps, each call gives any derivative of its
    /// quantities at the cost of one adjoint; an objective with several [parts](Response::parts) gives
    /// those of its first part only. Derivatives with respect to parameters other than
    /// densities are zero unless `parameters`. Test: `weighted_values_are_pulled_back`.
    ///
    /// # Errors
    /// As [`gradients`](Self::gradients).
    ///
    /// # Panics
    /// Without an objective, or if there is not one weight for each term and step.
    pub fn pull_back(
        &mut self,
        forward: &Forward,
        weights: Vec<Vec<f64>>,
        parameters: bool,
    ) -> Result<Gradients, AnalysisError> {
        let (objective, steps) = (self.objective.as_ref().expect("an objective"), self.times.len());
        let complete = weights.len() == objective.terms().len() && weights.iter().all(|row| row.len() == steps);
        assert!(complete, "one weight for each term and step");
        // every call gives the same bits, whatever was computed before
        self.workspace.forget();
        self.linear.forget();
        let gradient = self.sweep_back(forward, &self.responses()[..1], &[weights], parameters)?.swap_remove(0);
        Ok(self.named(gradient))
    }

    /// Moves the nodes to reference positions X, three entries each, in all load cases. Quantities keep what they took
    /// from the mesh when they were built, such as weights of nodes.
    ///
    /// # Errors
    /// [`AnalysisError::Positions`], or [`AnalysisError::State`] if elements are inverted there; nothing has then
    /// changed.
    pub fn set_positions(&mut self, x: &[f64]) -> Result<(), AnalysisError> {
        let model = self.model();
        let fixed = model.fixes_positions();
        if !fixed.is_empty() {
            return Err(AnalysisError::Positions { what: fixed.join("; ") });
        }
        let moved = model.at_positions(x)?;
        self.change_model(|model| *model = moved);
        self.workspace.forget();
        Ok(())
    }

    /// dθ/dX with respect to the reference positions of all nodes, three entries each, at fixed material constants
    /// and prescribed motions. Contact stiffnesses that are multiples of the bodies' own stiffness, and the areas that
    /// count as the whole surface around a node, remain those of the start design. Test: tests/suite/positions.rs.
    ///
    /// # Errors
    /// [`AnalysisError::Positions`] if the model or the objective has no such derivatives; otherwise as
    /// [`gradients`](Self::gradients).
    ///
    /// # Panics
    /// Without an objective.
    pub fn gradient_by_positions(&mut self, forward: &Forward) -> Result<Vec<f64>, AnalysisError> {
        let mut fixed = self.model().fixes_positions();
        for term in self.objective.iter().flat_map(Response::terms) {
            let Reads { elements, previous, .. } = term.quantity.reads();
            if elements.any() || previous || term.quantity.depends_on_mesh() {
                fixed.push(format!("the quantity `{}`", term.quantity.name()));
            }
        }
        if !fixed.is_empty() {
            return Err(AnalysisError::Positions { what: fixed.join("; ") });
        }
        self.sweep.positions = true;
        let gradient = self.gradient_of_objective(forward, false);
        self.sweep.positions = false;
        gradient.map(|gradient| gradient.positions)
    }

    fn gradient_of_objective(&mut self, forward: &Forward, parameters: bool) -> Result<PathGradient, AnalysisError> {
        assert!(self.objective.is_some(), "a gradient needs an objective");
        // the part that is the objective
        let part = largest(&forward.parts);
        let responses = &self.responses()[part..=part];
        let slopes = [responses[0].reduce(&forward.quantities[part], &self.axis()).1];
        self.sweep_back(forward, responses, &slopes, parameters).map(|mut gradients| gradients.swap_remove(0))
    }

    /// Derivatives of responses; `slopes` are those of each with respect to the values of its terms
    /// at the user's steps.
    fn sweep_back(
        &mut self,
        forward: &Forward,
        responses: &[Response],
        slopes: &[Vec<Vec<f64>>],
        parameters: bool,
    ) -> Result<Vec<PathGradient>, AnalysisError> {
        let (steps, all) = (forward.path.steps, self.times.len());
        if steps < all {
            return Err(AnalysisError::Unfinished { steps, all });
        }
        if *self.design.density() != forward.density {
            self.set_density(&forward.density);
        }
        let options = SweepOptions { parameters, ..self.sweep };
        let repeated = Repeated::new(responses, slopes);
        let swept: Vec<&Response> = repeated.once().map(|r| &responses[r]).collect();
        let slopes: Vec<Vec<Vec<f64>>> = repeated.once().map(|r| slopes[r].clone()).collect();
        Ok(repeated.gradients(&self.sweep_all(&forward.path, &swept, &slopes, &options)?))
    }
}

/// Index of the largest value; 0 without values.
fn largest(values: &[f64]) -> usize {
    (0..values.len()).max_by(|&a, &b| values[a].total_cmp(&values[b])).unwrap_or(0)
}
