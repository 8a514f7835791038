//! Plastic strain in the material.

use super::extreme::largest;
use super::smooth::p_norm;
use super::stress::{RELAXATION, STRESS_POINTS, points};
use super::{Dimension, Extreme, Quantity, QuantityError, Reads, StateDerivative, StateView};
use std::sync::Arc;

/// Largest equivalent plastic strain in some elements: the p-norm (Σ (φ_e^q α)^p)^(1/p) over their Gauss
/// points, relaxed as the [stress](super::Stress).
///
/// Test: `plastic_strains_by_hand`.
#[derive(Clone, Debug)]
pub struct PlasticStrain {
    name: String,
    elements: Vec<u32>,
    /// p.
    exponent: f64,
}

impl PlasticStrain {
    /// The largest plastic strain in these elements, with the exponent p of the norm.
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
        Ok(Self { name: name.into(), elements, exponent })
    }

    fn relaxed(&self, state: &StateView) -> Vec<f64> {
        let of = |&e: &u32| {
            let factor = state.density[e as usize].powf(RELAXATION);
            state.plastic_strain[points(e)].iter().map(move |strain| factor * strain)
        };
        self.elements.iter().flat_map(of).collect()
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
        Reads { plastic_strain: true, ..Reads::default() }
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
            let factor = density.powf(RELAXATION);
            let strains = &state.plastic_strain[points(e)];
            to.plastic_strain[points(e)].iter_mut().zip(slopes).for_each(|(to, slope)| *to += weight * slope * factor);
            // the slope of φ^q is infinite at φ = 0, but the strain there does not count
            if density > 0.0 {
                let along: f64 = slopes.iter().zip(strains).map(|(slope, strain)| slope * strain).sum();
                to.density[e as usize] += weight * along * RELAXATION * factor / density;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::check_derivatives;

    /// By hand: strains 0.3 at density 1/4 count half, 0.1 at density 1 counts fully; p = 2.
    #[test]
    fn plastic_strains_by_hand() {
        let mut strains = [0.0; 2 * STRESS_POINTS];
        (strains[1], strains[STRESS_POINTS]) = (0.3, 0.1);
        let state = StateView { density: &[0.25, 1.0], plastic_strain: &strains, ..StateView::default() };
        let strain = PlasticStrain::new("strain", vec![0, 1], 2.0).unwrap();
        assert!((strain.value(&state) - 0.15_f64.hypot(0.1)).abs() < 1e-15);
        assert!((strain.extreme().unwrap().value(&state) - 0.15).abs() < 1e-15);
        strains.iter_mut().enumerate().for_each(|(i, x)| *x += 0.01 * (i + 1) as f64);
        let state = StateView { density: &[0.25, 1.0], plastic_strain: &strains, ..StateView::default() };
        check_derivatives(&strain, &state).unwrap();
        assert!(PlasticStrain::new("strain", Vec::new(), 2.0).is_err());
        assert!(PlasticStrain::new("strain", vec![0], 0.5).is_err());
    }
}
