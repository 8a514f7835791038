//! Derivatives with respect to what is no density: friction, moduli, amplitudes of the prescribed motion.

use super::{ContactModel, inverted};
use slipstick_contact::enforcement::friction_share;
use slipstick_path::StateError;
use slipstick_solid::ElementScaling;

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
    /// A factor on a prescribed motion, translation and angle, that is 1.
    Amplitude {
        /// Number of the motion, from 0.
        motion: usize,
    },
}

impl ContactModel {
    /// What derivatives by parameters belong to, in their order.
    pub fn parameter_names(&self) -> Vec<Parameter> {
        let interfaces = (0..self.interfaces.len()).map(|interface| Parameter::Friction { interface });
        let bodies = (0..self.bodies.len()).map(|body| Parameter::YoungsModulus { body });
        let motions = (0..self.prescribed.motions()).map(|motion| Parameter::Amplitude { motion });
        interfaces.chain(bodies).chain(motions).collect()
    }

    /// Adds ∂(λᵀF + ηᵀG)/∂μ of every interface, at an evaluated state.
    pub(super) fn pull_back_friction(&self, y: &[f64], lambda: &[f64], eta: &[f64], out: &mut [f64]) {
        for (j, slave) in self.slaves.iter().enumerate() {
            let share = friction_share(self.previous_kinematics[j].area, slave.area).0;
            out[slave.interface as usize] += share * self.law_weights(j, y, lambda, eta).by_friction;
        }
    }

    /// Adds λᵀ ∂f_int/∂E of every body: its elements' λᵀ f_int over E.
    ///
    /// # Errors
    /// If elements are inverted.
    pub fn pull_back_moduli(&self, d: &[f64], lambda: &[f64], out: &mut [f64]) -> Result<(), StateError> {
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

    /// Adds (∂ŷ/∂a)ᵀ μ of every motion.
    pub(super) fn pull_back_amplitudes(&self, time: f64, by_prescribed: &[f64], out: &mut [f64]) {
        let first = self.interfaces.len() + self.bodies.len();
        self.prescribed.pull_back_amplitudes(time, by_prescribed, &mut out[first..]);
    }
}
