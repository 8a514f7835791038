//! Stress at the stress points of an element of second order, and its derivatives. F̄ averages over the
//! integration points, which are others.

use super::{Tensor, cofactor, contract, determinant, plus_identity, trace, von_mises_slope};
use crate::{Formulation, Section};
use std::array::from_fn;

/// An element's stress points, with what F̄ needs from its integration points.
pub(crate) struct AveragedPoints<const N: usize> {
    /// ∂N_i/∂X and ∂u/∂X at the stress points.
    pub gradients: Vec<[[f64; 3]; N]>,
    pub h: Vec<Tensor>,
    /// The same at the integration points.
    pub inner: (Vec<[[f64; 3]; N]>, Vec<Tensor>),
    /// The average at stress point s is Σ_q `average[s][q]` x_q.
    pub average: Vec<Vec<f64>>,
}

impl<const N: usize> AveragedPoints<N> {
    /// F of the stress at every stress point.
    pub fn deformation(&self, section: &Section, gamma: f64) -> Vec<Tensor> {
        let small = section.material.small_strains();
        let gamma = if small { 1.0 } else { gamma };
        let averages = self.averages(section, gamma);
        let at = |(h, average): (&Tensor, f64)| -> Tensor {
            let f = plus_identity(h, gamma);
            match section.formulation {
                Formulation::Full | Formulation::Reduced => f,
                Formulation::FBar if small => {
                    let shift = (average - trace(h)) / 3.0;
                    from_fn(|a| from_fn(|b| f[a][b] + f64::from(a == b) * shift))
                }
                Formulation::FBar => {
                    let ratio = (average / determinant(&f)).cbrt();
                    f.map(|row| row.map(|f| ratio * f))
                }
            }
        };
        self.h.iter().zip(averages).map(at).collect()
    }

    /// The averages of J, or of tr H for small strains, at the stress points.
    fn averages(&self, section: &Section, gamma: f64) -> Vec<f64> {
        let of = |h: &Tensor| match section.material.small_strains() {
            true => trace(h),
            false => determinant(&plus_identity(h, gamma)),
        };
        let inner: Vec<f64> = self.inner.1.iter().map(of).collect();
        self.average.iter().map(|row| row.iter().zip(&inner).map(|(w, x)| w * x).sum()).collect()
    }

    /// As for [`Points::pull_back`](super::Points::pull_back).
    pub fn pull_back(&self, section: &Section, gamma: f64, weights: &[f64]) -> ([[f64; 3]; N], f64) {
        let small = section.material.small_strains();
        let gamma = if small { 1.0 } else { gamma };
        let deformation = self.deformation(section, gamma);
        let averages = self.averages(section, gamma);
        let mut at_points = vec![[[0.0; 3]; 3]; self.h.len()];
        // by the averages
        let mut inner = vec![0.0; self.inner.1.len()];
        for (s, slope) in at_points.iter_mut().enumerate().filter(|(s, _)| weights[*s] != 0.0) {
            *slope = von_mises_slope(&section.material, &deformation[s]).1.map(|row| row.map(|x| weights[s] * x));
            let by_average = match section.formulation {
                Formulation::Full | Formulation::Reduced => continue,
                Formulation::FBar if small => {
                    let third = trace(slope) / 3.0;
                    (0..3).for_each(|a| slope[a][a] -= third);
                    third
                }
                Formulation::FBar => {
                    let f = plus_identity(&self.h[s], gamma);
                    let (j, along) = (determinant(&f), contract(slope, &deformation[s]));
                    let (ratio, cofactor) = ((averages[s] / j).cbrt(), cofactor(&f));
                    *slope = from_fn(|a| from_fn(|b| ratio * slope[a][b] - along / (3.0 * j) * cofactor[a][b]));
                    along / (3.0 * averages[s])
                }
            };
            inner.iter_mut().zip(&self.average[s]).for_each(|(to, w)| *to += by_average * w);
        }
        let of_inner = |(h, by): (&Tensor, &f64)| -> Tensor {
            if small {
                return from_fn(|a| from_fn(|b| f64::from(a == b) * by));
            }
            cofactor(&plus_identity(h, gamma)).map(|row| row.map(|c| by * c))
        };
        let inner_slopes: Vec<Tensor> = self.inner.1.iter().zip(&inner).map(of_inner).collect();
        let slopes = at_points.iter().chain(&inner_slopes);
        let gradients = self.gradients.iter().chain(&self.inner.0);
        let (mut forces, mut by_gamma) = ([[0.0; 3]; N], 0.0);
        for ((slope, gradients), h) in slopes.zip(gradients).zip(self.h.iter().chain(&self.inner.1)) {
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
