//! The contact and support data that quantities read at a state, and the pull-back of derivatives
//! with respect to these data to unknowns, previous state and parameters.

use crate::equations::law::{LawWeights, NodeLaw};
use crate::equations::{ContactModel, ContactResults, Design, Step, node};
use nalgebra::{Vector2, Vector3};
use slipstick_design::quantity::{ContactDerivative, ContactNode, StateView};
use slipstick_mesh::Rigid;
use slipstick_path::{Evaluated, Explicit, Inputs, LoadTime, StateError, StepState};
use slipstick_solid::stress::{STRESS_POINTS, von_mises};
use slipstick_solid::{ElementScaling, EnergyWeights, SolidAdjoint, SolidStep};

impl ContactModel {
    /// The data of the slave nodes that quantities read.
    pub(crate) fn contact_nodes(&self, results: &ContactResults) -> Vec<ContactNode> {
        let of = |(at, slave): (&crate::equations::NodalContact, &crate::equations::SlaveData)| ContactNode {
            node: at.node,
            pair: slave.interface,
            status: at.status,
            multiplier: at.multiplier,
            vector: at.global_multiplier,
            gap: at.weighted_gap,
            slip: at.weighted_slip,
            area: at.covered_area,
            reference_area: slave.area,
            follows_pressure: !self.pair(slave).shear_limit.is_finite() && !self.pair(slave).is_bonded(),
            friction_ratio: 1.0,
        };
        results.nodes.iter().zip(&self.slaves).map(of).collect()
    }

    /// Sets the [ratio](ContactNode::friction_ratio) of the coefficients of friction at the times at which a step starts and
    /// ends.
    pub(crate) fn set_friction_ratios(&self, nodes: &mut [ContactNode], from: LoadTime, to: LoadTime) {
        let pairs = self.interfaces.iter().map(|pair| [from, to].map(|time| pair.friction_factor(time)));
        let ratios: Vec<f64> = pairs.map(|[from, to]| if to > 0.0 { from / to } else { 1.0 }).collect();
        nodes.iter_mut().for_each(|at| at.friction_ratio = ratios[at.pair as usize]);
    }

    /// Forces of supports and prescribed motions, from the internal, external and contact forces;
    /// at bolts, their tension; zero at other free unknowns. `t` is the pseudo-time. \[F\]
    pub(crate) fn reactions(&self, t: f64, internal: &[f64], external: &[f64], contact: &[f64]) -> Vec<f64> {
        let fixed = self.prescribed.supported(t);
        let linear = &self.dependent.linear;
        if linear.is_empty() {
            let of = |(i, &fixed): (usize, &bool)| if fixed { internal[i] - external[i] - contact[i] } else { 0.0 };
            return fixed.iter().enumerate().map(of).collect();
        }
        // a prescribed displacement on which others depend has their forces too
        let mut all: Vec<f64> = (0..fixed.len()).map(|i| internal[i] - external[i] - contact[i]).collect();
        linear.pull_back(&mut all);
        let counts = |i: usize| fixed[i] || self.bolts.has_unknown(i);
        all.iter_mut().enumerate().filter(|(i, _)| !counts(*i)).for_each(|(_, force)| *force = 0.0);
        all
    }

    /// Rotation vector of a rigid body. \[rad\]
    pub(crate) fn rotation(&self, body: &Rigid, y: &[f64]) -> Option<[f64; 3]> {
        self.dependent.rigid.rotation(body.reference, y)
    }

    /// Nodes that hold the unknowns of rigid bodies.
    pub(crate) fn rigid_references(&self) -> impl Iterator<Item = usize> {
        self.dependent.rigid.references()
    }

    /// Area of the slave surface around each slave node in the reference configuration. \[L²\]
    pub(crate) fn slave_areas(&self) -> impl Iterator<Item = f64> {
        self.slaves.iter().map(|slave| slave.area)
    }

    /// The slave nodes' entries in a list over those of all pairs, pair by pair.
    pub(crate) fn by_pair<'a, T>(&'a self, nodes: &'a [T]) -> impl Iterator<Item = &'a [T]> {
        let mut rest = nodes;
        self.interfaces.iter().map(move |pair| {
            let (own, others) = rest.split_at(pair.interface.slave_nodes().len().min(rest.len()));
            rest = others;
            own
        })
    }
}

impl Design {
    /// Adds the derivatives of a quantity of slave nodes with respect to unknowns and previous
    /// state, and if requested, with respect to parameters. Neither depends on the density.
    ///
    /// A multiplier is an unknown, or follows from gap and slip by the node's law; a vector z = Σ_b
    /// (frame)_b ζ_b also depends on the frame. Test: `quantities_match_finite_differences`
    /// (tests/suite/quantity_gradients.rs).
    pub(crate) fn pull_back_contact_quantities(
        &self,
        step: &Step,
        at: &Evaluated<Self>,
        by: &[ContactDerivative],
        parameters: bool,
        to: &mut Explicit<'_>,
    ) {
        let model = &*self.model;
        let split = model.displacement_count();
        let x = model.contact_positions(&at.unknowns);
        let mut unknowns = vec![0.0; to.unknowns.len()];
        let (before, history) = (vec![0.0; to.unknowns.len()], vec![0.0; model.unknowns.history]);
        let mut previous = Inputs { previous: before, history, ..Inputs::default() };
        let mut by_parameters = vec![0.0; if parameters { to.inputs.parameters.len() } else { 0 }];
        for (j, now, node) in at.state.nodes_here().filter(|(j, ..)| !by[*j].is_zero()) {
            let by = &by[j];
            let vector = Vector3::from(by.vector);
            let weight = Vector3::from(by.multiplier) + now.frame.basis * vector;
            node::add_measures_pull_back(now, &node.step, by.gap, by.slip, by.area, &mut unknowns);
            node::add_frame_pull_back(now, &node.law.value(), &vector, &mut unknowns);
            match node.law {
                NodeLaw::Multiplier { .. } => {
                    unknowns[split + 3 * j..][..3].iter_mut().zip(&weight).for_each(|(to, w)| *to += w);
                }
                NodeLaw::Regularised(_) => {
                    let traction = node.law.traction();
                    node::add_traction_pull_back(now, &node.step, &traction, &weight, &mut unknowns);
                }
            }
            let mut weights = LawWeights::of(&node.law, Vector3::zeros(), weight);
            if parameters {
                self.pull_back_law_parameters(step, j, &weights, &mut by_parameters);
            }
            weights.by_slip += Vector2::from(by.slip);
            self.pull_back_law_previous(step, j, now, &x, &weights, &mut previous);
        }
        model.pull_to_nodes(&mut unknowns);
        model.pull_to_nodes(&mut previous.previous);
        model.share.sum(&mut [&mut unknowns, &mut previous.previous, &mut previous.history, &mut by_parameters]);
        // contact depends on reference positions as on displacements, now and before
        add(&mut to.inputs.position, &unknowns);
        add(&mut to.inputs.position, &previous.previous);
        add(to.unknowns, &unknowns);
        add(&mut to.inputs.previous, &previous.previous);
        add(&mut to.inputs.history, &previous.history);
        add(&mut to.inputs.parameters, &by_parameters);
    }

    /// Adds the derivatives of Σ_e w_e W_e with respect to displacements, densities and, if
    /// requested, moduli, for weights w of the elements' strain energies in `view`.
    ///
    /// With W = factor · [Ψ(γ u) + (1 − γ²) Ψ_L(u)], ∂W/∂u is the internal force, W is linear in
    /// the factor, and ∂W/∂γ = (u·∂W/∂u − 2 factor Ψ_L)/γ. Test:
    /// `quantities_match_finite_differences` (tests/suite/quantity_gradients.rs).
    ///
    /// # Errors
    /// If elements are inverted.
    pub(crate) fn pull_back_energies(
        &self,
        (time, d): (LoadTime, &[f64]),
        view: &StateView<'_>,
        weights: &[f64],
        parameters: bool,
        by_displacement: &mut [f64],
        to: &mut Inputs,
    ) -> Result<(), StateError> {
        let model = &*self.model;
        let all = weights;
        let weights = &self.without_memory(weights);
        let weighted =
            |(scaling, weight): (&ElementScaling, &f64)| ElementScaling { factor: weight * scaling.factor, ..*scaling };
        let scalings: Vec<ElementScaling> = self.scalings.iter().zip(weights).map(weighted).collect();
        let mut force = vec![0.0; d.len()];
        let stretches = model.stretches(time);
        let step = SolidStep { scalings: &scalings, history: &[], stretches: &stretches };
        let result = model.solid.internal_force(d, step, &mut force).map_err(crate::equations::inverted);
        model.share.agree(result)?;
        model.share.sum(&mut [&mut force]);
        by_displacement.iter_mut().zip(force).for_each(|(to, force)| *to += force);
        let interpolated = self.scaling_slopes().iter().any(|slope| slope.gamma != 0.0);
        let by_gamma = if interpolated { self.energies_by_gamma(d, &stretches)? } else { Vec::new() };
        // a void without stiffness has energy as soon as its density rises
        let none = self.scalings.iter().any(|scaling| scaling.factor == 0.0);
        let of_solid = if none { self.energies_with(|_| 1.0, |s| s.bulk, d, &stretches)? } else { Vec::new() };
        let softened = model.solid.sections().iter().any(|section| section.void_poisson_ratio.is_some());
        let by_bulk = if softened {
            let [solid, soft] = [1.0, 0.0].map(|bulk| self.energies_with(|s| s.factor, |_| bulk, d, &stretches));
            solid?.iter().zip(soft?).map(|(solid, soft)| solid - soft).collect()
        } else {
            vec![0.0; weights.len()]
        };
        for (e, (scaling, slope)) in self.scalings.iter().zip(self.scaling_slopes()).enumerate() {
            if slope.factor != 0.0 {
                let energy = if none { of_solid[e] } else { view.elements.energy[e] / scaling.factor };
                to.density[e] += weights[e] * energy * slope.factor;
            }
            if slope.gamma != 0.0 {
                to.density[e] += weights[e] * by_gamma[e] * slope.gamma;
            }
            to.density[e] += weights[e] * by_bulk[e] * slope.bulk;
        }
        if parameters {
            let first = model.interfaces.len();
            for (body, elements) in model.bodies.iter().enumerate() {
                let works = elements.clone().map(|e| all[e] * view.elements.energy[e]);
                to.parameters[first + body] += works.sum::<f64>() / model.modulus_of(body);
            }
        }
        Ok(())
    }

    /// Adds the derivatives of the energies of elements with memory, with weights of the elastic energies and
    /// of the plastic work, at a state. Elastic elements do not count. Test:
    /// `gradients_through_plastic_states` (tests/suite/plasticity.rs).
    pub(crate) fn pull_back_inelastic_energies(
        &self,
        (time, state): (LoadTime, &StepState),
        [elastic, plastic]: [&[f64]; 2],
        by_displacement: &mut [f64],
        (by_history, by_density): (&mut [f64], &mut [f64]),
    ) {
        let model = &*self.model;
        if !model.has_memory() {
            return;
        }
        let d = &state.unknowns[..model.displacement_count()];
        let (mut force, mut history) = (vec![0.0; d.len()], vec![0.0; model.history.solid.len()]);
        let mut density = vec![0.0; by_density.len()];
        let stretches = model.stretches(time);
        let step = self.solid_step(model.solid_history(state), &stretches);
        let weights = EnergyWeights { elastic, plastic };
        let states = (&mut force[..], &mut history[..]);
        let slopes = (self.scaling_slopes(), &mut density[..]);
        model.solid.pull_back_inelastic_energies(d, step, weights, states, slopes);
        model.share.sum(&mut [&mut force, &mut history, &mut density]);
        add(by_displacement, &force);
        add(&mut by_history[model.history.solid.clone()], &history);
        add(by_density, &density);
    }

    /// Adds the derivatives of Σ w α with respect to the history, for weights of the equivalent plastic
    /// strains.
    pub(crate) fn pull_back_plastic_strains(&self, weights: &[f64], by_history: &mut [f64]) {
        let model = &*self.model;
        let mut history = vec![0.0; model.history.solid.len()];
        model.solid.pull_back_plastic_strains(weights, &mut history);
        model.share.sum(&mut [&mut history]);
        add(&mut by_history[model.history.solid.clone()], &history);
    }

    /// Adds (∂f_int/∂h)ᵀ λ for the history at the start of the step.
    pub(crate) fn pull_back_internal_history(
        &self,
        d: &[f64],
        (time, before): (LoadTime, &[f64]),
        lambda: &[f64],
        by_history: &mut [f64],
    ) {
        let model = &*self.model;
        if !model.has_memory() {
            return;
        }
        let mut history = vec![0.0; model.history.solid.len()];
        let none = vec![0.0; history.len()];
        let adjoint = SolidAdjoint { forces: lambda, history: &none };
        let stretches = model.stretches(time);
        let step = self.solid_step(before, &stretches);
        let result = model.solid.pull_back_previous(d, step, adjoint, &mut history);
        result.expect("the state has been evaluated with these displacements");
        model.share.sum(&mut [&mut history]);
        add(&mut by_history[model.history.solid.clone()], &history);
    }

    /// Weights of the elements, zero for those with memory.
    fn without_memory(&self, weights: &[f64]) -> Vec<f64> {
        let memory = |e: usize| self.model.solid.material(e).kind().has_memory();
        weights.iter().enumerate().map(|(e, weight)| if memory(e) { 0.0 } else { *weight }).collect()
    }

    /// Equivalent plastic strain at the Gauss points of all elements, complete on every rank.
    pub(crate) fn plastic_strains(&self, state: &StepState) -> Vec<f64> {
        let model = &*self.model;
        let mut strains = model.solid.plastic_strains(model.solid_history(state)).into_flattened();
        model.share.sum(&mut [&mut strains]);
        strains
    }

    /// Energies with other factors and shares of the solid's law, complete on every rank. \[F L\]
    fn energies_with(
        &self,
        factor: impl Fn(&ElementScaling) -> f64,
        bulk: impl Fn(&ElementScaling) -> f64,
        d: &[f64],
        stretches: &[f64],
    ) -> Result<Vec<f64>, StateError> {
        let model = &*self.model;
        let of = |scaling: &ElementScaling| ElementScaling { factor: factor(scaling), bulk: bulk(scaling), ..*scaling };
        let scalings: Vec<ElementScaling> = self.scalings.iter().map(of).collect();
        let step = SolidStep { scalings: &scalings, history: &[], stretches };
        let energies = model.solid.energies(d, step).map_err(crate::equations::inverted);
        let mut energies = model.share.agree(energies)?;
        model.share.sum(&mut [&mut energies]);
        Ok(energies)
    }

    /// Von Mises stress of the solid material at the Gauss points of all elements, complete on
    /// every rank. \[F/L²\]
    ///
    /// # Errors
    /// If elements are inverted.
    pub(crate) fn von_mises_stresses(&self, time: LoadTime, state: &StepState) -> Result<Vec<f64>, StateError> {
        let model = &*self.model;
        let stretches = model.stretches(time);
        let d = &state.unknowns[..model.displacement_count()];
        let mut sizes = vec![0.0; STRESS_POINTS * self.scalings.len()];
        let step = self.solid_step(model.solid_history(state), &stretches);
        let found = model.solid.visit_stresses(d, step, |element, stresses| {
            let points = sizes[STRESS_POINTS * element..].iter_mut().zip(stresses);
            points.for_each(|(size, stress)| *size = von_mises(stress));
        });
        model.share.agree(found.map_err(crate::equations::inverted))?;
        model.share.sum(&mut [&mut sizes]);
        Ok(sizes)
    }

    /// Adds the derivatives of a function of the stresses in `view`, with these slopes, with
    /// respect to displacements, densities (through the interpolation of energies) and, if
    /// requested, moduli. Test: `quantities_match_finite_differences`
    /// (tests/suite/quantity_gradients.rs).
    pub(crate) fn pull_back_stresses(
        &self,
        (time, state): (LoadTime, &StepState),
        view: &StateView<'_>,
        by_stress: &[f64],
        parameters: bool,
        (by_displacement, by_history): (&mut [f64], &mut [f64]),
        to: &mut Inputs,
    ) {
        let model = &*self.model;
        let d = &state.unknowns[..model.displacement_count()];
        let (mut force, mut by_density) = (vec![0.0; d.len()], vec![0.0; self.scalings.len()]);
        let mut history = vec![0.0; model.history.solid.len()];
        let stretches = model.stretches(time);
        let step = (self.solid_step(model.solid_history(state), &stretches), self.scaling_slopes());
        model.solid.pull_back_stresses(d, step, by_stress, (&mut force, &mut history), &mut by_density);
        model.share.sum(&mut [&mut force, &mut history, &mut by_density]);
        add(&mut by_history[model.history.solid.clone()], &history);
        by_displacement.iter_mut().zip(force).for_each(|(to, from)| *to += from);
        to.density.iter_mut().zip(by_density).for_each(|(to, from)| *to += from);
        if parameters {
            // σ is proportional to E
            let first = model.interfaces.len();
            for (body, elements) in model.bodies.iter().enumerate() {
                let points = STRESS_POINTS * elements.start..STRESS_POINTS * elements.end;
                let along: f64 =
                    by_stress[points.clone()].iter().zip(&view.elements.stress[points]).map(|(b, s)| b * s).sum();
                to.parameters[first + body] += along / model.modulus_of(body);
            }
        }
    }

    /// ∂W/∂γ of every element, (v·∂W/∂v − 2 factor Ψ_L)/γ with the displacements v without thermal
    /// expansion, for which v·∂W/∂v = (u − (θ − 1) X)·f.
    fn energies_by_gamma(&self, d: &[f64], stretches: &[f64]) -> Result<Vec<f64>, StateError> {
        let model = &*self.model;
        let whole = |s: &ElementScaling| ElementScaling { factor: s.factor, ..ElementScaling::NONE };
        let whole: Vec<ElementScaling> = self.scalings.iter().map(whole).collect();
        let linear = |s: &ElementScaling| ElementScaling { gamma: 0.0, ..*s };
        let linear: Vec<ElementScaling> = self.scalings.iter().map(linear).collect();
        let step = self.solid_step(&[], stretches);
        let mut work = vec![0.0; self.scalings.len()];
        let mut result = model.solid.pull_back_density(d, step, &whole, d, &mut work);
        if !stretches.is_empty() {
            let mut expansion = vec![0.0; work.len()];
            let of_expansion = model.solid.pull_back_density(d, step, &whole, &model.coordinates, &mut expansion);
            result = result.and(of_expansion);
            let each = work.iter_mut().zip(expansion).zip(stretches);
            each.for_each(|((work, expansion), stretch)| *work -= (stretch - 1.0) * expansion);
        }
        let linear = model.solid.energies(d, SolidStep { scalings: &linear, ..step });
        let result = result.and(linear).map_err(crate::equations::inverted);
        let linear = model.share.agree(result)?;
        for ((work, linear), scaling) in work.iter_mut().zip(linear).zip(&self.scalings) {
            *work = if scaling.gamma == 0.0 { 0.0 } else { (*work - 2.0 * linear) / scaling.gamma };
        }
        model.share.sum(&mut [&mut work]);
        Ok(work)
    }
}

fn add(to: &mut [f64], from: &[f64]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to += from);
}
