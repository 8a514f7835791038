//! The model of a load case that differs from the others in friction, moduli, motions, loads or
//! positions of bodies.

use super::{ContactModel, Parameter};
use slipstick_solid::{MaterialError, Section};
use std::sync::Arc;

/// How the model of a load case differs.
#[derive(Debug, Clone, PartialEq)]
pub struct Variation {
    /// Coefficient of friction of each interface; `None`: its own.
    pub friction: Vec<Option<f64>>,
    /// Factor on the moduli of each body, all its sections together. > 0
    pub moduli: Vec<f64>,
    /// Factor on each prescribed motion, both translation and angle.
    pub motions: Vec<f64>,
    /// Factor on each load.
    pub loads: Vec<f64>,
    /// Displacement of every node at rest, from its position in the mesh: rigid motions of bodies.
    /// Three components per node; empty: none. \[L\]
    pub rest: Vec<f64>,
}

impl Variation {
    /// No difference from `model`.
    pub fn none(model: &ContactModel) -> Self {
        Self {
            friction: vec![None; model.interfaces.len()],
            moduli: vec![1.0; model.bodies.len()],
            motions: vec![1.0; model.prescribed.motions()],
            loads: vec![1.0; model.loads.len()],
            rest: Vec::new(),
        }
    }

    /// The derivative with respect to a parameter of the model, from that with respect to the
    /// parameter of the load case: its own coefficient of friction does not depend on the model's,
    /// and moduli are multiplied. Amplitudes are factors equal to 1 in both.
    pub(crate) fn to_model(&self, parameter: Parameter, derivative: f64) -> f64 {
        match parameter {
            Parameter::Friction { interface } if self.friction[interface].is_some() => 0.0,
            Parameter::YoungsModulus { body } => self.moduli[body] * derivative,
            _ => derivative,
        }
    }
}

impl ContactModel {
    /// The model of a load case.
    ///
    /// # Errors
    /// If a modulus is not positive.
    pub fn varied(&self, variation: &Variation) -> Result<Self, MaterialError> {
        let mut model = self.clone();
        for (interface, friction) in model.interfaces.iter_mut().zip(&variation.friction) {
            interface.friction = friction.unwrap_or(interface.friction);
        }
        model.prescribed = model.prescribed.varied(&variation.motions, &variation.rest);
        model.loads = model.loads.times(&variation.loads);
        model.rest = variation.rest.clone();
        if variation.moduli.iter().any(|factor| *factor != 1.0) {
            let stiffened = |(section, body): (&Section, usize)| {
                Ok(Section { material: section.material.stiffened(variation.moduli[body])?, ..*section })
            };
            let sections = self.solid.sections().iter().zip(self.solid.bodies_of_sections()).map(stiffened);
            let sections = sections.collect::<Result<Vec<Section>, MaterialError>>()?;
            model.solid = Arc::new(self.solid.as_ref().clone().with_sections(sections));
            model.start_at(self.start.density.clone());
        }
        Ok(model)
    }
}
