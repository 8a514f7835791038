//! Derivatives with respect to parameters other than densities: friction, moduli, amplitudes of
//! motions and loads.

use super::design::in_series;
use super::evaluated::{ContactState, Step};
use super::law::LawWeights;
use super::{ContactModel, Design, Enforcement, GivenStiffness, LoadState, Method, Share, SlaveData};
use slipstick_path::LoadTime;
use slipstick_solid::ElementScaling;
use std::ops::Range;

/// A parameter of the model, other than the densities, with respect to which a path can be
/// differentiated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Parameter {
    /// Coefficient of friction μ of an interface, before the factors of its path.
    Friction {
        /// Number of the interface, from 0.
        interface: usize,
    },
    /// Young's modulus of the small-strain limit of a body's law: a change multiplies all moduli of
    /// the law, and of those in regions of the body, by one factor, at the same Poisson's ratio. \[F/L²\]
    YoungsModulus {
        /// Number of the body, from 0.
        body: usize,
    },
    /// A factor, equal to 1, on a prescribed motion, both translation and angle. A node that two
    /// identical motions share counts towards the first of them.
    Amplitude {
        /// Number of the motion, from 0.
        motion: usize,
    },
    /// A factor, equal to 1, on the force to which a bolt is tightened.
    Preload {
        /// Number of the bolt, from 0.
        bolt: usize,
    },
    /// A factor, equal to 1, on a load.
    Load {
        /// Number of the load, from 0.
        load: usize,
    },
    /// Coefficient of thermal expansion α of a body: a change multiplies those in regions of the body by the
    /// same factor. \[1/temperature\]
    Expansion {
        /// Number of the body, from 0.
        body: usize,
    },
    /// A factor, equal to 1, on a change of temperature.
    Temperature {
        /// Number of the change, from 0.
        change: usize,
    },
}

impl ContactModel {
    /// The parameters of the model: all but the moduli of rigid bodies, and the expansion of bodies that have none
    /// or whose temperature never changes.
    pub fn parameter_names(&self) -> Vec<Parameter> {
        self.all_parameters().into_iter().filter(|parameter| self.has_parameter(parameter)).collect()
    }

    /// Young's modulus of a body's own section, to which the derivative refers. \[F/L²\]
    pub(crate) fn modulus_of(&self, body: usize) -> f64 {
        self.solid.sections()[body].material.youngs_modulus()
    }

    /// Whether the model has this parameter.
    pub(crate) fn has_parameter(&self, parameter: &Parameter) -> bool {
        match *parameter {
            Parameter::YoungsModulus { body } => !self.dependent.rigid.has_element(self.bodies[body].start),
            Parameter::Expansion { body } => {
                self.expansion_of(body) != 0.0 && self.temperatures.reach(&self.bodies[body])
            }
            _ => true,
        }
    }

    /// One parameter for each derivative, in their order.
    pub(crate) fn all_parameters(&self) -> Vec<Parameter> {
        let interfaces = (0..self.interfaces.len()).map(|interface| Parameter::Friction { interface });
        let bodies = (0..self.bodies.len()).map(|body| Parameter::YoungsModulus { body });
        let motions = (0..self.prescribed.motions()).map(|motion| Parameter::Amplitude { motion });
        let bolts = (0..self.bolts.list().len()).map(|bolt| Parameter::Preload { bolt });
        let loads = (0..self.loads.len()).map(|load| Parameter::Load { load });
        let expansions = (0..self.bodies.len()).map(|body| Parameter::Expansion { body });
        let temperatures = (0..self.temperatures.len()).map(|change| Parameter::Temperature { change });
        let others = interfaces.chain(bodies).chain(motions).chain(bolts).chain(loads);
        others.chain(expansions).chain(temperatures).collect()
    }

    /// The factors on the forces of bolts in the list of all parameters.
    pub(crate) fn preload_parameters(&self) -> Range<usize> {
        let first = self.interfaces.len() + self.bodies.len() + self.prescribed.motions();
        first..first + self.bolts.list().len()
    }

    /// The factors on loads in the list of all parameters; expansions and temperatures follow.
    pub(crate) fn load_parameters(&self) -> Range<usize> {
        let first = self.preload_parameters().end;
        first..first + self.loads.len()
    }

    /// α of a body's own section, to which the derivative refers. \[1/temperature\]
    pub(super) fn expansion_of(&self, body: usize) -> f64 {
        self.solid.sections()[body].thermal_expansion
    }

    /// ∂ln k/∂ln E of every body for the bodies' own stiffness k at each slave node, k = s
    /// m/(s + m)/h with the mean moduli s and m of both sides, densities included.
    pub(super) fn stiffness_shares(&self, scalings: &[ElementScaling]) -> Vec<Vec<f64>> {
        let moduli = |elements: &[u32]| -> Vec<f64> {
            let within = |body: &Range<usize>| {
                let of_body = elements.iter().filter(|&&e| body.contains(&(e as usize)));
                of_body.map(|&e| self.modulus(e, scalings)).sum::<f64>()
            };
            self.bodies.iter().map(|body| within(body) / elements.len() as f64).collect()
        };
        let master: Vec<Vec<f64>> = self.contact_elements.of_masters.iter().map(|elements| moduli(elements)).collect();
        let shares = |(slave, elements): (&SlaveData, &Vec<u32>)| {
            let (slaves, masters) = (moduli(elements), &master[slave.interface as usize]);
            let (s, m) = (slaves.iter().sum::<f64>(), masters.iter().sum::<f64>());
            let [of_s, of_m] = in_series(s, m).1;
            let part = |of: f64, value: f64, sum: f64| if of == 0.0 { 0.0 } else { of * value / sum };
            slaves.iter().zip(masters).map(|(a, b)| part(of_s, *a, s) + part(of_m, *b, m)).collect()
        };
        self.slaves.iter().zip(&self.contact_elements.of_slaves).map(shares).collect()
    }
}

impl Design {
    /// Adds (∂ŷ/∂a)ᵀ μ of every motion and λᵀ ∂F/∂a of every load.
    pub(super) fn pull_back_amplitudes(
        &self,
        d: &[f64],
        time: LoadTime,
        lambda: &[f64],
        by_prescribed: &[f64],
        out: &mut [f64],
    ) {
        let model = &*self.model;
        let first = model.interfaces.len() + model.bodies.len();
        model.prescribed.pull_back_amplitudes(time, by_prescribed, &mut out[first..]);
        // R contains minus the external force
        let weights: Vec<f64> = lambda.iter().map(|l| -l).collect();
        self.pull_back_loads(d, time, &weights, out);
    }

    /// Adds weightsᵀ ∂f_ext/∂a of every load.
    pub(crate) fn pull_back_loads(&self, d: &[f64], time: LoadTime, weights: &[f64], out: &mut [f64]) {
        let (loads, x) = (&self.model.loads, self.model.positions(d));
        let of_loads = &mut out[self.model.load_parameters()];
        loads.pull_back_amplitudes(self.load_state(time, &x, None), weights, of_loads);
    }

    /// The state of loads at positions, in a part of the model or in all of it.
    pub(super) fn load_state<'a>(&'a self, time: LoadTime, x: &'a [f64], part: Option<&'a Share>) -> LoadState<'a> {
        LoadState { time, x, masses: &self.masses, part }
    }

    /// External force at displacements `d` and pseudo-time `time`. \[F\]
    pub fn external_force(&self, d: &[f64], time: LoadTime, out: &mut [f64]) {
        out.fill(0.0);
        if self.model.has_loads() {
            let x = self.model.positions(d);
            self.model.loads.add_residual(self.load_state(time, &x, None), out);
            out.iter_mut().for_each(|f| *f = -*f);
        }
    }

    /// Adds the transposed derivative of [`external_force`](Self::external_force) with respect to
    /// the displacements, times `weights`.
    pub fn pull_back_external_force(&self, d: &[f64], time: LoadTime, weights: &[f64], out: &mut [f64]) {
        if self.model.has_loads() {
            let (weights, x): (Vec<f64>, _) = (weights.iter().map(|w| -w).collect(), self.model.positions(d));
            self.model.loads.add_transposed_product(self.load_state(time, &x, None), &weights, out);
        }
    }

    /// Adds weightsᵀ ∂f_ext/∂φ of every element, through its mass.
    pub(crate) fn pull_back_masses(&self, d: &[f64], time: LoadTime, weights: &[f64], out: &mut [f64]) {
        if !self.masses.is_empty() {
            let x = self.model.positions(d);
            self.model.loads.pull_back_density(self.load_state(time, &x, None), &self.mass_slopes, weights, out);
        }
    }

    /// Adds ∂(λᵀF + ηᵀG)/∂μ of every interface. Also adds ∂(λᵀF + ηᵀG)/∂E of every body through
    /// stiffnesses that are multiples of the bodies' own at the start design: those of contact at
    /// partly covered nodes, and of the penalty method unless given in units.
    pub(super) fn pull_back_contact(
        &self,
        step: &Step,
        contact: &ContactState,
        lambda: &[f64],
        eta: &[f64],
        out: &mut [f64],
    ) {
        let lambda = self.model.contact_vector(lambda);
        for (j, now, node) in contact.nodes_here() {
            let weights = self.law_weights(j, now, &node.law, &lambda, &eta[self.model.history.contact.clone()]);
            self.pull_back_law_parameters(step, j, &weights, out);
        }
    }

    /// Adds the derivatives through friction and stiffness of node j.
    pub(super) fn pull_back_law_parameters(
        &self,
        step: &Step,
        j: usize,
        &LawWeights { by_friction, by_stiffness, .. }: &LawWeights,
        out: &mut [f64],
    ) {
        let model = &*self.model;
        let first = model.interfaces.len();
        let slave = &model.slaves[j];
        let factor = model.pair(slave).friction_factor(step.time);
        out[slave.interface as usize] += factor * by_friction;
        let Enforcement { method, stiffness } = model.interfaces[slave.interface as usize].enforcement;
        let absolute = method == Method::Penalty && matches!(stiffness, GivenStiffness::Absolute(_));
        if absolute || by_stiffness == 0.0 {
            return;
        }
        for (body, share) in model.start.shares[j].iter().enumerate().filter(|(_, share)| **share != 0.0) {
            out[first + body] += by_stiffness * share / model.modulus_of(body);
        }
    }
}
