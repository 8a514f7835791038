//! Stress at the integration points of an element of first order, and its derivatives.

use super::{Tensor, cofactor, contract, determinant, plus_identity, trace, von_mises_slope};
use crate::{Formulation, Section};
use std::array::from_fn;

/// An element's points: gradients of its shape functions, weights, and ∂u/∂X.
pub(crate) struct Points<const N: usize> {
    gradients: Vec<[[f64; 3]; N]>,
    weights: Vec<f64>,
    h: Vec<Tensor>,
}

impl<const N: usize> Points<N> {
    pub fn new(gradients: Vec<[[f64; 3]; N]>, weights: Vec<f64>, d: &[[f64; 3]; N]) -> Self {
        // relative to the first corner: a translation causes no round-off
        let at = |i: usize, a: usize| d[i][a] - d[0][a];
        let h = |gradients: &[[f64; 3]; N]| from_fn(|a| from_fn(|b| (0..N).map(|i| at(i, a) * gradients[i][b]).sum()));
        let h = gradients.iter().map(h).collect();
        Self { gradients, weights, h }
    }

    /// F of the stress at every point.
    pub fn deformation(&self, section: &Section, gamma: f64) -> Vec<Tensor> {
        let volume: f64 = self.weights.iter().sum();
        let mean = |of: &dyn Fn(&Tensor) -> f64| {
            self.weights.iter().zip(&self.h).map(|(w, h)| w * of(h)).sum::<f64>() / volume
        };
        let small = section.material.small_strains();
        match section.formulation {
            Formulation::Full | Formulation::Reduced => {
                self.h.iter().map(|h| plus_identity(h, if small { 1.0 } else { gamma })).collect()
            }
            Formulation::FBar if small => {
                let mean = mean(&trace);
                let moved = |h: &Tensor| {
                    let shift = (mean - trace(h)) / 3.0;
                    from_fn(|a| from_fn(|b| h[a][b] + f64::from(a == b) * (1.0 + shift)))
                };
                self.h.iter().map(moved).collect()
            }
            Formulation::FBar => {
                let mean = mean(&|h| determinant(&plus_identity(h, gamma)));
                let scaled = |h: &Tensor| {
                    let f = plus_identity(h, gamma);
                    let ratio = (mean / determinant(&f)).cbrt();
                    f.map(|row| row.map(|f| ratio * f))
                };
                self.h.iter().map(scaled).collect()
            }
        }
    }

    /// Forces on the nodes for weights of σ_v at the points, and the derivative with respect to γ.
    pub fn pull_back(&self, section: &Section, gamma: f64, weights: &[f64]) -> ([[f64; 3]; N], f64) {
        let material = &section.material;
        let small = material.small_strains();
        let gamma = if small { 1.0 } else { gamma };
        let deformation = self.deformation(section, gamma);
        let by_f = |(f, weight): (&Tensor, &f64)| -> Tensor {
            if *weight == 0.0 {
                return [[0.0; 3]; 3];
            }
            von_mises_slope(material, f).1.map(|row| row.map(|slope| weight * slope))
        };
        let slopes: Vec<Tensor> = deformation.iter().zip(weights).map(by_f).collect();
        let volume: f64 = self.weights.iter().sum();
        let slopes: Vec<Tensor> = match section.formulation {
            Formulation::Full | Formulation::Reduced => slopes,
            Formulation::FBar if small => {
                let sum: f64 = slopes.iter().map(trace).sum::<f64>() / 3.0;
                let of = |(slope, weight): (&Tensor, &f64)| -> Tensor {
                    let shift = sum * weight / volume - trace(slope) / 3.0;
                    from_fn(|a| from_fn(|b| slope[a][b] + f64::from(a == b) * shift))
                };
                slopes.iter().zip(&self.weights).map(of).collect()
            }
            Formulation::FBar => {
                let plain: Vec<Tensor> = self.h.iter().map(|h| plus_identity(h, gamma)).collect();
                let determinants: Vec<f64> = plain.iter().map(determinant).collect();
                let mean = self.weights.iter().zip(&determinants).map(|(w, j)| w * j).sum::<f64>() / volume;
                // F̄ = (J̄/J)^(1/3) F
                let along: Vec<f64> = slopes.iter().zip(&deformation).map(|(slope, f)| contract(slope, f)).collect();
                let by_mean = along.iter().sum::<f64>() / (3.0 * mean);
                let of = |p: usize| -> Tensor {
                    let ratio = (mean / determinants[p]).cbrt();
                    let cofactor = cofactor(&plain[p]);
                    let by_determinant = by_mean * self.weights[p] / volume - along[p] / (3.0 * determinants[p]);
                    from_fn(|a| from_fn(|b| ratio * slopes[p][a][b] + by_determinant * cofactor[a][b]))
                };
                (0..plain.len()).map(of).collect()
            }
        };
        let mut forces = [[0.0; 3]; N];
        let mut by_gamma = 0.0;
        for ((slope, gradients), h) in slopes.iter().zip(&self.gradients).zip(&self.h) {
            for (force, gradient) in forces.iter_mut().zip(gradients) {
                for a in 0..3 {
                    force[a] += gamma * (0..3).map(|b| slope[a][b] * gradient[b]).sum::<f64>();
                }
            }
            by_gamma += if small { 0.0 } else { contract(slope, h) };
        }
        (forces, by_gamma)
    }
}
