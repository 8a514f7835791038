//! The largest of a positive field over the Gauss points of some elements, as material counts.

use super::extreme::largest;
use super::smooth::p_norm;
use super::{QuantityError, StateView};
use std::ops::Range;

/// Entries per element in lists over Gauss points, such as [`ElementData::stress`](super::ElementData::stress).
pub const STRESS_POINTS: usize = 8;

/// q.
const RELAXATION: f64 = 0.5;

/// The p-norm (Σ (φ_e^q x)^p)^(1/p) of a field x ≥ 0 over the Gauss points of some elements.
///
/// x is that of the solid material at the element's deformation. In an element that is nearly void it
/// does not vanish, so it is relaxed by φ^q: material that is not there does not count, and a bound does
/// not keep elements from becoming void. The norm is not below the largest relaxed value. Source: Le,
/// Norato, Bruns, Ha, Tortorelli, Struct. Multidiscip. Optim. 41 (2010) 605–620, with q = 1/2.
#[derive(Clone, Debug)]
pub(super) struct Relaxed {
    /// Elements that count.
    elements: Vec<u32>,
    /// p.
    exponent: f64,
}

impl Relaxed {
    /// # Errors
    /// Without elements, or if p is not a finite number ≥ 1.
    pub fn new(elements: Vec<u32>, exponent: f64) -> Result<Self, QuantityError> {
        if elements.is_empty() {
            return Err(QuantityError::NoElements);
        }
        if !(exponent.is_finite() && exponent >= 1.0) {
            return Err(QuantityError::Exponent { value: exponent });
        }
        Ok(Self { elements, exponent })
    }

    /// Relaxed values at the points of the elements, in their order.
    fn values(&self, state: &StateView, field: &[f64]) -> Vec<f64> {
        let of = |&e: &u32| {
            let factor = state.density[e as usize].powf(RELAXATION);
            field[points(e)].iter().map(move |x| factor * x)
        };
        self.elements.iter().flat_map(of).collect()
    }

    /// The norm.
    pub fn norm(&self, state: &StateView, field: &[f64]) -> f64 {
        p_norm(&self.values(state, field), self.exponent).0
    }

    /// The largest relaxed value.
    pub fn largest(&self, state: &StateView, field: &[f64]) -> f64 {
        largest(self.values(state, field).into_iter())
    }

    /// Adds `weight` times the derivatives of the norm with respect to the field and the densities.
    pub fn pull_back(
        &self,
        state: &StateView,
        field: &[f64],
        weight: f64,
        (by_field, by_density): (&mut [f64], &mut [f64]),
    ) {
        let (_, slopes) = p_norm(&self.values(state, field), self.exponent);
        for (&e, slopes) in self.elements.iter().zip(slopes.chunks_exact(STRESS_POINTS)) {
            let density = state.density[e as usize];
            let factor = density.powf(RELAXATION);
            by_field[points(e)].iter_mut().zip(slopes).for_each(|(to, slope)| *to += weight * slope * factor);
            // the slope of φ^q is infinite at φ = 0, but the value there does not count
            if density > 0.0 {
                let along: f64 = slopes.iter().zip(&field[points(e)]).map(|(slope, x)| slope * x).sum();
                by_density[e as usize] += weight * along * RELAXATION * factor / density;
            }
        }
    }
}

/// Entries of an element.
fn points(element: u32) -> Range<usize> {
    let first = STRESS_POINTS * element as usize;
    first..first + STRESS_POINTS
}
