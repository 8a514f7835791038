//! Plastic strain in the material.

use super::relaxed::Relaxed;
use super::{Dimension, ElementData, Extreme, Quantity, QuantityError, Reads, StateDerivative, StateView};
use std::sync::Arc;

/// Largest equivalent plastic strain in some elements: the p-norm (Σ (φ_e^q α)^p)^(1/p) over their Gauss
/// points, relaxed for intermediate densities (`relaxed.rs`).
///
/// Test: `plastic_strains_by_hand`.
#[derive(Clone, Debug)]
pub struct PlasticStrain {
    name: String,
    largest: Relaxed,
}

impl PlasticStrain {
    /// The largest value in these elements, with the exponent p of the norm.
    ///
    /// # Errors
    /// Without elements, or if p is not a finite number ≥ 1.
    pub fn new(name: impl Into<String>, elements: Vec<u32>, exponent: f64) -> Result<Self, QuantityError> {
        Ok(Self { name: name.into(), largest: Relaxed::new(elements, exponent)? })
    }
}

impl Quantity for PlasticStrain {
    fn name(&self) -> &str {
        &self.name
    }

    fn dimension(&self) -> Dimension {
        Dimension::NONE
    }

    fn reads(&self) -> Reads {
        Reads { elements: ElementData { plastic_strain: true, ..ElementData::default() }, ..Reads::default() }
    }

    fn value(&self, state: &StateView) -> f64 {
        self.largest.norm(state, state.elements.plastic_strain)
    }

    fn extreme(&self) -> Option<Arc<dyn Quantity>> {
        Some(Extreme::of(self.clone(), |of, state| of.largest.largest(state, state.elements.plastic_strain)))
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        self.largest.pull_back(
            state,
            state.elements.plastic_strain,
            weight,
            (&mut to.elements.plastic_strain, &mut to.density),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::{STRESS_POINTS, check_derivatives};

    /// By hand: strains 0.3 at density 1/4 count half, 0.1 at density 1 counts fully; p = 2.
    #[test]
    fn plastic_strains_by_hand() {
        let mut strains = [0.0; 2 * STRESS_POINTS];
        (strains[1], strains[STRESS_POINTS]) = (0.3, 0.1);
        let state = StateView {
            density: &[0.25, 1.0],
            elements: ElementData { plastic_strain: &strains, ..ElementData::default() },
            ..StateView::default()
        };
        let strain = PlasticStrain::new("strain", vec![0, 1], 2.0).unwrap();
        assert!((strain.value(&state) - 0.15_f64.hypot(0.1)).abs() < 1e-15);
        assert!((strain.extreme().unwrap().value(&state) - 0.15).abs() < 1e-15);
        strains.iter_mut().enumerate().for_each(|(i, x)| *x += 0.01 * (i + 1) as f64);
        let state = StateView {
            density: &[0.25, 1.0],
            elements: ElementData { plastic_strain: &strains, ..ElementData::default() },
            ..StateView::default()
        };
        check_derivatives(&strain, &state).unwrap();
        assert!(PlasticStrain::new("strain", Vec::new(), 2.0).is_err());
        assert!(PlasticStrain::new("strain", vec![0], 0.5).is_err());
    }
}
