//! Derivatives with respect to what is no density: friction, moduli, amplitudes of motions and loads.

use super::{ContactModel, Enforcement, GivenStiffness, LEAST_SHARE, Method, SlaveData, inverted};
use slipstick_contact::enforcement::friction_share;
use slipstick_path::StateError;
use slipstick_solid::ElementScaling;
use std::ops::Range;

/// A number of the model that a path can be differentiated by, beside the densities.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Parameter {
    /// Coefficient of friction μ of an interface.
    Friction {
        /// Number of the interface, from 0.
        interface: usize,
    },
    /// Young's modulus of a body, at the same Poisson's ratio. \[F/L²\]
    YoungsModulus {
        /// Number of the body, from 0.
        body: usize,
    },
    /// A factor on a prescribed motion, translation and angle, that is 1. Nodes that two equal motions share count for the
    /// first.
    Amplitude {
        /// Number of the motion, from 0.
        motion: usize,
    },
    /// A factor on a load that is 1.
    Load {
        /// Number of the load, from 0.
        load: usize,
    },
}

impl ContactModel {
    /// What derivatives by parameters belong to, in their order.
    pub fn parameter_names(&self) -> Vec<Parameter> {
        let interfaces = (0..self.interfaces.len()).map(|interface| Parameter::Friction { interface });
        let bodies = (0..self.bodies.len()).map(|body| Parameter::YoungsModulus { body });
        let motions = (0..self.prescribed.motions()).map(|motion| Parameter::Amplitude { motion });
        let loads = (0..self.loads.len()).map(|load| Parameter::Load { load });
        interfaces.chain(bodies).chain(motions).chain(loads).collect()
    }

    /// Adds ∂(λᵀF + ηᵀG)/∂μ of every interface, at an evaluated state.
    pub(super) fn pull_back_friction(&self, y: &[f64], lambda: &[f64], eta: &[f64], out: &mut [f64]) {
        for (j, slave) in self.slaves.iter().enumerate().filter(|(j, _)| self.own[*j]) {
            let share = friction_share(self.previous_kinematics[j].area, slave.area).0;
            out[slave.interface as usize] += share * self.law_weights(j, y, lambda, eta).by_friction;
        }
    }

    /// Adds ∂(λᵀF + ηᵀG)/∂E of every body through stiffnesses that are multiples of the bodies' own at the start design: of
    /// contact at partly covered nodes, and of the penalty method where it is not given in units. At an evaluated state.
    pub(super) fn pull_back_stiffness(&self, y: &[f64], lambda: &[f64], eta: &[f64], out: &mut [f64]) {
        let first = self.interfaces.len();
        for (j, slave) in self.slaves.iter().enumerate().filter(|(j, _)| self.own[*j]) {
            let Enforcement { method, stiffness } = self.interfaces[slave.interface as usize].enforcement;
            let absolute = method == Method::Penalty && matches!(stiffness, GivenStiffness::Absolute(_));
            let by_stiffness = self.law_weights(j, y, lambda, eta).by_stiffness;
            if absolute || by_stiffness == 0.0 {
                continue;
            }
            for (body, share) in self.start_shares[j].iter().enumerate().filter(|(_, share)| **share != 0.0) {
                let modulus = self.solid.material(self.bodies[body].start).youngs_modulus();
                out[first + body] += by_stiffness * share / modulus;
            }
        }
    }

    /// ∂ln k/∂ln E of every body for the bodies' own stiffness k at each slave node, k = s m/(s + m)/h with the mean moduli s
    /// and m of both sides, densities included.
    pub(super) fn hardness_shares(&self) -> Vec<Vec<f64>> {
        let moduli = |elements: &[u32]| -> Vec<f64> {
            let of = |e: u32| self.scalings[e as usize].factor * self.solid.material(e as usize).youngs_modulus();
            let within = |body: &Range<usize>| {
                elements.iter().filter(|&&e| body.contains(&(e as usize))).map(|&e| of(e)).sum::<f64>()
            };
            self.bodies.iter().map(|body| within(body) / elements.len() as f64).collect()
        };
        let master: Vec<Vec<f64>> = self.master_elements.iter().map(|elements| moduli(elements)).collect();
        let shares = |(slave, elements): (&SlaveData, &Vec<u32>)| {
            let (slaves, masters) = (moduli(elements), &master[slave.interface as usize]);
            let (s, m) = (slaves.iter().sum::<f64>(), masters.iter().sum::<f64>());
            // where one side is next to nothing, the stiffness is a part of the other's
            let (of_s, of_m) = match s * m / (s + m) {
                series if series >= LEAST_SHARE * s.max(m) => (m / (s + m), s / (s + m)),
                _ if s > m => (1.0, 0.0),
                _ => (0.0, 1.0),
            };
            let part = |of: f64, value: f64, sum: f64| if of == 0.0 { 0.0 } else { of * value / sum };
            slaves.iter().zip(masters).map(|(a, b)| part(of_s, *a, s) + part(of_m, *b, m)).collect()
        };
        self.slaves.iter().zip(&self.slave_elements).map(shares).collect()
    }

    /// Adds λᵀ ∂f_int/∂E of every body: its elements' λᵀ f_int over E.
    ///
    /// # Errors
    /// If elements are inverted.
    pub fn pull_back_moduli(&self, d: &[f64], lambda: &[f64], out: &mut [f64]) -> Result<(), StateError> {
        self.share.add(out, |out| self.pull_back_own_moduli(d, lambda, out))
    }

    /// The part of this rank.
    pub(super) fn pull_back_own_moduli(&self, d: &[f64], lambda: &[f64], out: &mut [f64]) -> Result<(), StateError> {
        let whole: Vec<ElementScaling> =
            self.scalings.iter().map(|s| ElementScaling { factor: s.factor, gamma: 0.0 }).collect();
        let mut works = vec![0.0; self.solid.elements()];
        let lambda = &lambda[..self.displacement_count()];
        self.solid.pull_back_density(d, &self.scalings, &whole, lambda, &mut works).map_err(inverted)?;
        let first = self.interfaces.len();
        for (body, elements) in self.bodies.iter().enumerate() {
            out[first + body] +=
                elements.clone().map(|e| works[e] / self.solid.material(e).youngs_modulus()).sum::<f64>();
        }
        Ok(())
    }

    /// Adds (∂ŷ/∂a)ᵀ μ of every motion and λᵀ ∂F/∂a of every load.
    pub(super) fn pull_back_amplitudes(
        &self,
        y: &[f64],
        time: f64,
        lambda: &[f64],
        by_prescribed: &[f64],
        out: &mut [f64],
    ) {
        let first = self.interfaces.len() + self.bodies.len();
        self.prescribed.pull_back_amplitudes(time, by_prescribed, &mut out[first..]);
        // R has minus the external force
        let weights: Vec<f64> = lambda[..self.displacement_count()].iter().map(|l| -l).collect();
        self.pull_back_loads(&y[..self.displacement_count()], time, &weights, out);
    }

    /// Adds weightsᵀ ∂f_ext/∂a of every load.
    pub(crate) fn pull_back_loads(&self, d: &[f64], time: f64, weights: &[f64], out: &mut [f64]) {
        let first = out.len() - self.loads.len();
        self.loads.pull_back_amplitudes(time, &self.positions(d), weights, &mut out[first..]);
    }
}
