//! Elastic energy.

use super::{Dimension, ElementData, Quantity, Reads, StateDerivative, StateView};
use std::ops::Range;

/// Elastic energy stored in some elements. \[F L\]
///
/// Test: `resultants_and_means_by_hand`.
#[derive(Clone, Debug)]
pub struct StrainEnergy {
    name: String,
    elements: Range<usize>,
}

impl StrainEnergy {
    /// The energy of consecutive elements, such as those of a body.
    pub fn new(name: impl Into<String>, elements: Range<usize>) -> Self {
        Self { name: name.into(), elements }
    }
}

impl Quantity for StrainEnergy {
    fn name(&self) -> &str {
        &self.name
    }

    fn dimension(&self) -> Dimension {
        Dimension::WORK
    }

    fn reads(&self) -> Reads {
        Reads { elements: ElementData { energy: true, ..ElementData::default() }, ..Reads::default() }
    }

    fn value(&self, state: &StateView) -> f64 {
        state.elements.energy[self.elements.clone()].iter().sum()
    }

    fn pull_back(&self, _: &StateView, weight: f64, to: &mut StateDerivative) {
        to.elements.energy[self.elements.clone()].iter_mut().for_each(|to| *to += weight);
    }
}
