//! Stress in the material.

use super::relaxed::Relaxed;
use super::{Dimension, ElementData, Extreme, Quantity, QuantityError, Reads, StateDerivative, StateView};
use std::sync::Arc;

/// Largest von Mises stress in some elements: the p-norm (Σ (φ_e^q σ_v)^p)^(1/p) over their Gauss points,
/// relaxed for intermediate densities (`relaxed.rs`). \[F/L²\]
///
/// Test: `resultants_and_means_by_hand`.
#[derive(Clone, Debug)]
pub struct Stress {
    name: String,
    largest: Relaxed,
}

impl Stress {
    /// The largest value in these elements, with the exponent p of the norm.
    ///
    /// # Errors
    /// Without elements, or if p is not a finite number ≥ 1.
    pub fn new(name: impl Into<String>, elements: Vec<u32>, exponent: f64) -> Result<Self, QuantityError> {
        Ok(Self { name: name.into(), largest: Relaxed::new(elements, exponent)? })
    }
}

impl Quantity for Stress {
    fn name(&self) -> &str {
        &self.name
    }

    fn dimension(&self) -> Dimension {
        Dimension::STRESS
    }

    fn reads(&self) -> Reads {
        Reads { elements: ElementData { stress: true, ..ElementData::default() }, ..Reads::default() }
    }

    fn value(&self, state: &StateView) -> f64 {
        self.largest.norm(state, state.elements.stress)
    }

    fn extreme(&self) -> Option<Arc<dyn Quantity>> {
        Some(Extreme::of(self.clone(), |of, state| of.largest.largest(state, state.elements.stress)))
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        self.largest.pull_back(state, state.elements.stress, weight, (&mut to.elements.stress, &mut to.density));
    }
}
