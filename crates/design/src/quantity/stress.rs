//! Stress in the material.

use super::extreme::largest;
use super::smooth::p_norm;
use super::{Dimension, Extreme, Quantity, QuantityError, Reads, StateDerivative, StateView};
use std::ops::Range;
use std::sync::Arc;

/// Largest von Mises stress in some elements: the p-norm (Σ (φ_e^q σ_v)^p)^(1/p) over their Gauss
/// points. \[F/L²\]
///
/// σ_v is the stress of the solid material at the element's deformation. In an element that is
/// nearly void it does not vanish, so it is relaxed by φ^q: material that is not there does not
/// count, and a bound on the stress does not keep elements from becoming void. The norm is not
/// below the largest relaxed stress. Source: Le, Norato, Bruns, Ha, Tortorelli, Struct.
/// Multidiscip. Optim. 41 (2010) 605–620, with q = 1/2. Test: `resultants_and_means_by_hand`.
#[derive(Clone, Debug)]
pub struct Stress {
    name: String,
    /// Elements that count.
    elements: Vec<u32>,
    /// p.
    exponent: f64,
    /// q.
    relaxation: f64,
}

/// q.
pub(super) const RELAXATION: f64 = 0.5;

/// Entries per element in [`StateView::stress`].
pub const STRESS_POINTS: usize = 8;

/// Entries of an element in lists of stresses.
pub(super) fn points(element: u32) -> Range<usize> {
    let first = STRESS_POINTS * element as usize;
    first..first + STRESS_POINTS
}

impl Stress {
    /// The largest stress in these elements, with the exponent p of the norm.
    ///
    /// # Errors
    /// Without elements, or if p is not a finite number ≥ 1.
    pub fn new(name: impl Into<String>, elements: Vec<u32>, exponent: f64) -> Result<Self, QuantityError> {
        if elements.is_empty() {
            return Err(QuantityError::NoElements);
        }
        if !(exponent.is_finite() && exponent >= 1.0) {
            return Err(QuantityError::Exponent { value: exponent });
        }
        Ok(Self { name: name.into(), elements, exponent, relaxation: RELAXATION })
    }

    /// Relaxed stresses at the points of the elements, in their order.
    fn relaxed(&self, state: &StateView) -> Vec<f64> {
        let of = |&e: &u32| {
            let factor = state.density[e as usize].powf(self.relaxation);
            state.stress[points(e)].iter().map(move |stress| factor * stress)
        };
        self.elements.iter().flat_map(of).collect()
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
        Reads { stress: true, ..Reads::default() }
    }

    fn value(&self, state: &StateView) -> f64 {
        p_norm(&self.relaxed(state), self.exponent).0
    }

    fn extreme(&self) -> Option<Arc<dyn Quantity>> {
        Some(Extreme::of(self.clone(), |of, state| largest(of.relaxed(state).into_iter())))
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        let (_, slopes) = p_norm(&self.relaxed(state), self.exponent);
        for (&e, slopes) in self.elements.iter().zip(slopes.chunks_exact(STRESS_POINTS)) {
            let density = state.density[e as usize];
            let factor = density.powf(self.relaxation);
            let stresses = &state.stress[points(e)];
            to.stress[points(e)].iter_mut().zip(slopes).for_each(|(to, slope)| *to += weight * slope * factor);
            // the slope of φ^q is infinite at φ = 0, but the stress there does not count
            if density > 0.0 {
                let along: f64 = slopes.iter().zip(stresses).map(|(slope, stress)| slope * stress).sum();
                to.density[e as usize] += weight * along * self.relaxation * factor / density;
            }
        }
    }
}
