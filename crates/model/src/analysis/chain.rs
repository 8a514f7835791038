//! From the states of a path to the quantities of responses, and from their derivatives to those
//! with respect to unknowns, design and parameters.

use std::sync::Arc;

use slipstick_design::quantity::{
    ContactNode, ElementData, FrictionStep, PreviousDerivative, PreviousView, Reads, StateDerivative, StateView,
};
use slipstick_design::response::Response;
use slipstick_path::{Explicit, LoadTime, Observed, Path, PathResponses, StateError, StepState};

use super::error::AnalysisError;
use super::previous::PreviousData;
use super::steps::steps_of;
use crate::equations::{ContactResults, Design, Kinematics, Known};

/// The data of a state that quantities can read.
pub(crate) struct StateData {
    time: LoadTime,
    /// f_int. \[F\]
    pub(crate) internal: Vec<f64>,
    /// f_ext. \[F\]
    pub(crate) external: Vec<f64>,
    /// Of supports and prescribed motions; zero at free unknowns. Empty unless read. \[F\]
    pub(crate) reaction: Vec<f64>,
    contact: Vec<ContactNode>,
    /// Where `contact` and `reaction` come from. `None` unless one of them is read.
    pub(crate) results: Option<ContactResults>,
    /// Empty unless read.
    pub(crate) elements: ElementData<Vec<f64>>,
    /// The state before. Empty unless read.
    previous: PreviousData,
    /// Of contact, if `results` were computed.
    pub(crate) kinematics: Option<Arc<Kinematics>>,
}

impl StateData {
    /// At the end of a (sub-)step, with what is known of its state. All ranks call it and receive the same.
    pub(crate) fn of(
        design: &Design,
        reads: Reads,
        time: LoadTime,
        (previous, state): (&StepState, &StepState),
        known: Known<'_>,
    ) -> Result<Self, StateError> {
        let model = design.model();
        let n = model.prescribed().fixed().len();
        let d = &state.unknowns[..n];
        let mut external = vec![0.0; n];
        let internal = match known.internal {
            Some(internal) => internal.to_vec(),
            None => {
                let mut internal = vec![0.0; n];
                design.internal_force(d, (time, model.solid_history(previous)), &mut internal)?;
                internal
            }
        };
        design.external_force(d, time, &mut external);
        let mut data = Self {
            time,
            internal,
            external,
            reaction: Vec::new(),
            contact: Vec::new(),
            results: None,
            elements: ElementData::default(),
            previous: PreviousData::default(),
            kinematics: None,
        };
        if reads.reaction || reads.contact {
            let contact = design.contact_with(previous, &state.unknowns, (time, false), known)?;
            let results = contact.results(model, &model.contact_positions(&state.unknowns));
            data.kinematics = Some(contact.kinematics().clone());
            if reads.contact {
                data.contact = model.contact_nodes(&results);
            }
            if reads.reaction {
                data.reaction = model.reactions(time.t, &data.internal, &data.external, &results.force);
            }
            data.results = Some(results);
        }
        let reads = reads.elements;
        let reads_plastic_work = model.has_memory() && (reads.energy || reads.plastic_work);
        if reads.energy || reads_plastic_work {
            let [elastic, plastic] = design.energies(d, (time, model.solid_history(state)))?;
            data.elements.energy = if reads.energy { elastic } else { Vec::new() };
            data.elements.plastic_work = if reads_plastic_work { plastic } else { Vec::new() };
        }
        if reads.plastic_strain {
            data.elements.plastic_strain = design.plastic_strains(state);
        }
        if reads.stress {
            data.elements.stress = design.von_mises_stresses(time, state)?;
        }
        Ok(data)
    }

    /// Friction at every slave node in the step that ends at this state.
    pub(crate) fn friction_of_step(&self) -> impl Iterator<Item = FrictionStep> + '_ {
        self.contact.iter().zip(&self.previous.multiplier).map(|(at, before)| FrictionStep::of(at, *before))
    }

    /// With what quantities see of the state before.
    pub(crate) fn after(mut self, previous: PreviousData, design: &Design) -> Self {
        design.model().set_friction_ratios(&mut self.contact, previous.time, self.time);
        Self { previous, ..self }
    }

    /// What quantities at the next state see of this one.
    pub(crate) fn into_previous(self, state: &StepState) -> PreviousData {
        let displacement = state.unknowns[..self.internal.len()].to_vec();
        let Self { time, external, reaction, contact, kinematics, .. } = self;
        let multiplier = contact.iter().map(ContactNode::transmitted).collect();
        PreviousData { time, rest: false, displacement, external, reaction, multiplier, kinematics }
    }

    /// The view of a state; `step` and `steps` are those of its load case.
    pub(crate) fn view<'a>(
        &'a self,
        design: &'a Design,
        state: &'a StepState,
        (step, steps): (usize, usize),
    ) -> StateView<'a> {
        StateView {
            step,
            steps,
            time: self.time.on_axis(),
            displacement: &state.unknowns[..self.internal.len()],
            internal_force: &self.internal,
            external_force: &self.external,
            reaction: &self.reaction,
            contact: &self.contact,
            density: design.density(),
            elements: self.elements.map(Vec::as_slice),
            previous: PreviousView {
                displacement: &self.previous.displacement,
                external_force: &self.previous.external,
                reaction: &self.previous.reaction,
                multiplier: if self.contact.is_empty() { &[] } else { &self.previous.multiplier },
            },
        }
    }
}

/// The values of all terms of all responses: a row for each term, with a column for each user's
/// step. Columns of steps that a term does not observe are 0. `design_at` returns the design of the
/// load case at a pseudo-time.
pub(super) fn values<'a>(
    design_at: &dyn Fn(LoadTime) -> &'a Design,
    path: &Path,
    steps: usize,
    responses: &[&Response],
) -> Result<Vec<Vec<Vec<f64>>>, AnalysisError> {
    let ranks = design_at(LoadTime::default()).model().share().ranks().clone();
    let mut values: Vec<Vec<Vec<f64>>> =
        responses.iter().map(|response| vec![vec![0.0; steps]; response.terms().len()]).collect();
    // of the increments since the start of the load case
    let mut sums: Vec<Vec<f64>> = responses.iter().map(|response| vec![0.0; response.terms().len()]).collect();
    let user_steps = steps_of(path);
    // what quantities see of the state before, with its index
    let mut last: Option<(usize, PreviousData)> = None;
    for (index, at) in path.states.iter().enumerate().skip(1) {
        if at.rest {
            sums.iter_mut().flatten().for_each(|sum| *sum = 0.0);
            continue;
        }
        let (step, design) = (user_steps[index], design_at(at.time));
        let read = |response: &Response, term: usize| {
            let accumulates = response.terms()[term].quantity.accumulates();
            accumulates || at.completes.is_some() && response.term_observes(term, step, steps)
        };
        let terms: Vec<(usize, usize)> = (0..responses.len())
            .flat_map(|r| (0..responses[r].terms().len()).map(move |t| (r, t)))
            .filter(|&(r, t)| read(responses[r], t))
            .collect();
        if terms.is_empty() {
            continue;
        }
        let quantity = |(r, t): (usize, usize)| &responses[r].terms()[t].quantity;
        let mut reads = terms.iter().fold(Reads::default(), |reads, &term| reads.or(quantity(term).reads()));
        // the next step may see them
        reads.reaction |= reads.previous;
        reads.contact |= reads.previous;
        let (previous, state) = (path.state(index - 1, &*ranks), path.state(index, &*ranks));
        let before = last.as_ref().filter(|(known, _)| known + 1 == index);
        let known = Known::of(before.and_then(|(_, before)| before.kinematics.clone()), None);
        let mut data = StateData::of(design, reads, at.time, (&previous, &state), known)?;
        if reads.previous {
            let known = last.take().filter(|(known, _)| known + 1 == index);
            let before = match known {
                Some((_, before)) => before,
                None => PreviousData::of(design, path, index - 1, &*ranks)?,
            };
            data = data.after(before, design);
        }
        for (r, t) in terms {
            let (_, local, each) = responses[r].place(step, steps);
            let value = quantity((r, t)).value(&data.view(design, &state, (local, each)));
            if !value.is_finite() {
                let name = quantity((r, t)).name().to_owned();
                return Err(AnalysisError::Infinite { name, step });
            }
            if quantity((r, t)).accumulates() {
                sums[r][t] += value;
            } else {
                values[r][t][step - 1] = value;
            }
            if quantity((r, t)).accumulates() && at.completes.is_some() {
                values[r][t][step - 1] = sums[r][t];
            }
        }
        if reads.previous {
            last = Some((index, data.into_previous(&state)));
        }
    }
    Ok(values)
}

/// Adds the derivatives of the quantities that depend only on the densities.
pub(super) fn add_density_derivative(design: &Design, response: &Response, slopes: &[Vec<f64>], out: &mut [f64]) {
    let view = StateView { density: design.density(), ..StateView::default() };
    for (term, slopes) in response.terms().iter().zip(slopes).filter(|(term, _)| !term.quantity.depends_on_state()) {
        let mut by = StateDerivative::zero(&view);
        term.quantity.pull_back(&view, slopes.iter().sum(), &mut by);
        out.iter_mut().zip(&by.density).for_each(|(to, from)| *to += from);
    }
}

/// The responses of a path as the sweep uses them.
pub(super) struct Adapter<'a> {
    path: &'a Path,
    responses: &'a [&'a Response],
    /// User steps of the path.
    steps: usize,
    /// The step of every state.
    user_steps: Vec<usize>,
    /// dθ/dq of every response, term and state.
    weights: Vec<Vec<Vec<f64>>>,
    /// Whether derivatives with respect to moduli and loads are requested.
    parameters: bool,
    /// The data of a state that the quantities of all responses read, with its index.
    seen: Option<(usize, Arc<StateData>)>,
    /// Derivatives of every response with respect to the state before the last one treated, from
    /// increments.
    later: Vec<Option<PreviousDerivative>>,
}

impl<'a> Adapter<'a> {
    /// `slopes`: derivatives of every response with respect to its terms at the user's steps.
    pub(super) fn new(
        path: &'a Path,
        responses: &'a [&'a Response],
        slopes: &[Vec<Vec<f64>>],
        steps: usize,
        parameters: bool,
    ) -> Self {
        let of_term = |response: &Response, term: usize, slopes: &[f64]| -> Vec<f64> {
            let quantity = &response.terms()[term].quantity;
            let mut weights = vec![0.0; path.states.len()];
            if !quantity.depends_on_state() {
                return weights;
            }
            let mut later = 0.0;
            for (weight, state) in weights.iter_mut().zip(&path.states).rev() {
                let here = state.completes.map_or(0.0, |step| slopes[step - 1]);
                later = if state.rest { 0.0 } else { later + here };
                *weight = if quantity.accumulates() { later } else { here };
            }
            weights
        };
        let of_response = |(response, slopes): (&&Response, &Vec<Vec<f64>>)| {
            slopes.iter().enumerate().map(|(term, slopes)| of_term(response, term, slopes)).collect()
        };
        let weights = responses.iter().zip(slopes).map(of_response).collect();
        let later = vec![None; responses.len()];
        Self { path, responses, steps, user_steps: steps_of(path), weights, parameters, seen: None, later }
    }

    /// The data of a state that the responses read; computed once for all of them.
    fn seen(&mut self, design: &Design, at: &Observed<'_, Design>) -> Result<Arc<StateData>, StateError> {
        if let Some((_, data)) = self.seen.as_ref().filter(|(index, _)| *index == at.index) {
            return Ok(data.clone());
        }
        let reads = (0..self.responses.len()).fold(Reads::default(), |reads, response| {
            let terms = self.terms(response, at.index);
            terms.fold(reads, |reads, (term, _)| reads.or(self.responses[response].terms()[term].quantity.reads()))
        });
        let later = self.later.iter().flatten().any(|later| !later.multiplier.is_empty());
        let reads = Reads { contact: reads.contact || later, ..reads };
        let known = Known::of(Some(at.step.previous().clone()), Some(at.evaluated));
        let mut data = StateData::of(design, reads, at.time, (at.previous, at.state), known)?;
        if reads.previous {
            let ranks = design.model().share().ranks();
            data = data.after(PreviousData::of(design, self.path, at.index - 1, &**ranks)?, design);
        }
        // the sweep reuses their memory at the next state
        data.kinematics = None;
        let data = Arc::new(data);
        self.seen = Some((at.index, data.clone()));
        Ok(data)
    }

    /// Keeps derivatives with respect to the state before until the sweep arrives there. At rest,
    /// only the loads depend on anything, namely on their amplitudes and on masses.
    fn keep_for_previous(
        &mut self,
        response: usize,
        design: &Design,
        before: &PreviousData,
        mut by: PreviousDerivative,
        to: &mut Explicit<'_>,
    ) {
        if !before.rest {
            self.later[response] = Some(by);
        } else {
            let supported = design.model().prescribed().supported(before.time.t);
            let by_reaction = by.reaction.iter().zip(&*supported);
            // the reactions are minus the loads on prescribed unknowns
            by.external_force
                .iter_mut()
                .zip(by_reaction)
                .filter(|(_, (_, fixed))| **fixed)
                .for_each(|(load, (reaction, _))| *load -= reaction);
            let (d, time, weights) = (&before.displacement, before.time, &by.external_force);
            design.pull_back_masses(d, time, weights, &mut to.inputs.density);
            if self.parameters {
                design.pull_back_loads(d, time, weights, &mut to.inputs.parameters);
            }
        }
    }

    /// Terms of a response with their weights at a state, if these are not zero.
    fn terms(&self, response: usize, index: usize) -> impl Iterator<Item = (usize, f64)> {
        let terms = self.weights[response].iter().enumerate();
        terms.map(move |(term, weights)| (term, weights[index])).filter(|(_, weight)| *weight != 0.0)
    }
}

impl PathResponses<Design> for Adapter<'_> {
    fn count(&self) -> usize {
        self.responses.len()
    }

    fn observes(&self, response: usize, index: usize) -> bool {
        self.later[response].is_some() || self.terms(response, index).next().is_some()
    }

    /// ∂θ/∂d += (∂f/∂d)ᵀ ∂θ/∂f and ∂θ/∂φ += (∂f/∂φ)ᵀ ∂θ/∂f, and likewise for contact and energies.
    /// Paper: (92)–(99).
    fn add_derivative(
        &mut self,
        response: usize,
        design: &Design,
        at: &Observed<'_, Design>,
        to: &mut Explicit<'_>,
    ) -> Result<(), StateError> {
        let model = design.model();
        let data = self.seen(design, at)?;
        let terms = self.responses[response].terms();
        let quantities = || self.terms(response, at.index).map(|(term, weight)| (&terms[term].quantity, weight));
        let reads = quantities().fold(Reads::default(), |reads, (quantity, _)| reads.or(quantity.reads()));
        let (_, step, steps) = self.responses[response].place(self.user_steps[at.index].max(1), self.steps);
        let view = data.view(design, at.state, (step, steps));
        let mut by = StateDerivative::zero(&view);
        quantities().for_each(|(quantity, weight)| quantity.pull_back(&view, weight, &mut by));
        if let Some(later) = self.later[response].take() {
            by.add_later(&later, view.contact);
        }
        if reads.previous {
            self.keep_for_previous(response, design, &data.previous, std::mem::take(&mut by.previous), to);
        }
        if !model.springs().is_empty() {
            // at the reference point of a rigid body, the reaction is the force of springs minus the loads
            for i in model.rigid_references().flat_map(|node| 3 * node..3 * node + 3) {
                let Some(weight) = by.reaction.get_mut(i).filter(|_| model.prescribed().fixed()[i]) else { continue };
                by.internal_force[i] += *weight;
                by.external_force[i] -= std::mem::take(weight);
            }
        }
        let d = view.displacement;
        let by_internal = by.internal_force.iter().any(|&weight| weight != 0.0);
        if by_internal {
            let before = (at.time, model.solid_history(at.previous));
            design.add_internal_tangent_product(d, before, &by.internal_force, &mut by.displacement)?;
            design.pull_back_internal_history(d, before, &by.internal_force, &mut to.inputs.history);
        }
        design.pull_back_external_force(d, at.time, &by.external_force, &mut by.displacement);
        if reads.elements.energy {
            design.pull_back_energies(
                (at.time, d),
                &view,
                &by.elements.energy,
                self.parameters,
                &mut by.displacement,
                to.inputs,
            )?;
        }
        if reads.elements.stress {
            let by_state = (&mut by.displacement[..], &mut to.history[..]);
            design.pull_back_stresses(
                (at.time, at.state),
                &view,
                &by.elements.stress,
                self.parameters,
                by_state,
                to.inputs,
            );
        }
        if reads.elements.energy || reads.elements.plastic_work {
            let weights = [&by.elements.energy[..], &by.elements.plastic_work];
            let by_history = (&mut to.history[..], &mut to.inputs.density[..]);
            design.pull_back_inelastic_energies((at.time, at.state), weights, &mut by.displacement, by_history);
        }
        if reads.elements.plastic_strain {
            design.pull_back_plastic_strains(&by.elements.plastic_strain, to.history);
        }
        to.unknowns.iter_mut().zip(&by.displacement).for_each(|(to, from)| *to += from);
        let (fixed, linear) = (model.prescribed().fixed(), model.prescribed().linear());
        let prescribed = by.reaction.iter().zip(fixed).enumerate();
        prescribed
            .filter(|(i, (_, fixed))| **fixed && !linear.is_dependent(*i))
            .for_each(|(i, (weight, _))| to.residual[i] += weight);
        let slipstick_path::Inputs { previous, parameters, .. } = &mut *to.inputs;
        let parameters = if self.parameters { &mut parameters[..] } else { &mut [] };
        let tension = [&mut to.residual[..], &mut to.unknowns[..], &mut previous[..], &mut *parameters];
        model.pull_back_tension(at.step, d, &by.reaction, tension);
        let of_supports = [&mut to.residual[..], &mut to.unknowns[..], &mut previous[..], parameters];
        model.pull_back_temporary_reactions(at.step, d, &by.reaction, of_supports);
        // the reactions of a rigid body are the forces at its nodes; at its reference point, they are only
        // minus the loads
        for node in model.rigid_references() {
            for i in 3 * node..3 * node + 3 {
                by.external_force[i] -= std::mem::take(&mut to.residual[i]);
            }
        }
        if by.contact.iter().any(|by| !by.is_zero()) {
            design.pull_back_contact_quantities(at.step, at.evaluated, &by.contact, self.parameters, to);
        }
        if !to.inputs.position.is_empty() {
            let position = &mut to.inputs.position;
            design.pull_back_external_force(d, at.time, &by.external_force, position);
            if by_internal {
                design.pull_back_internal_force_by_positions(at.step, d, &by.internal_force, position)?;
            }
        }
        if by_internal {
            design.pull_back_density(
                d,
                (at.time, model.solid_history(at.previous)),
                &by.internal_force,
                &mut to.inputs.density,
            )?;
        }
        design.pull_back_masses(d, at.time, &by.external_force, &mut to.inputs.density);
        to.inputs.density.iter_mut().zip(&by.density).for_each(|(to, from)| *to += from);
        if self.parameters {
            if by_internal {
                let before = (at.time, model.solid_history(at.previous));
                design.pull_back_solid_parameters(d, before, &by.internal_force, &mut to.inputs.parameters)?;
            }
            if reads.elements.energy || reads.elements.plastic_work {
                let weights = [&by.elements.energy[..], &by.elements.plastic_work];
                let parameters = &mut to.inputs.parameters;
                design.pull_back_energies_by_expansion((at.time, at.state), &view, weights, parameters)?;
            }
            if reads.elements.stress {
                let parameters = &mut to.inputs.parameters;
                design.pull_back_stresses_by_expansion((at.time, at.state), &by.elements.stress, parameters);
            }
            design.pull_back_loads(d, at.time, &by.external_force, &mut to.inputs.parameters);
        }
        Ok(())
    }
}
