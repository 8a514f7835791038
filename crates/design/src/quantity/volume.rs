//! Material volume and mass.

use super::{Dimension, Quantity, StateDerivative, StateView};

/// Volume of the material in the reference configuration, Σ φ_e V_e \[L³\], or its mass \[M\].
///
/// Test: `resultants_and_means_by_hand`.
#[derive(Clone, Debug)]
pub struct Volume {
    name: String,
    dimension: Dimension,
    /// Per unit of density, for every element.
    weights: Vec<f64>,
}

impl Volume {
    /// With the volume of every element that counts, and 0 for the others. \[L³\]
    pub fn new(name: impl Into<String>, volumes: Vec<f64>) -> Self {
        Self { name: name.into(), dimension: Dimension::VOLUME, weights: volumes }
    }

    /// The mass of that volume of a material of this mass density. \[M/L³\]
    pub fn mass(mut self, mass_density: f64) -> Self {
        self.dimension = Dimension::MASS;
        self.weights.iter_mut().for_each(|weight| *weight *= mass_density);
        self
    }
}

impl Quantity for Volume {
    fn name(&self) -> &str {
        &self.name
    }

    fn dimension(&self) -> Dimension {
        self.dimension
    }

    fn depends_on_state(&self) -> bool {
        false
    }

    fn depends_on_mesh(&self) -> bool {
        true
    }

    fn value(&self, state: &StateView) -> f64 {
        self.weights.iter().zip(state.density).map(|(volume, density)| volume * density).sum()
    }

    fn pull_back(&self, _: &StateView, weight: f64, to: &mut StateDerivative) {
        to.density.iter_mut().zip(&self.weights).for_each(|(to, volume)| *to += weight * volume);
    }
}
