//! Internal and external forces of the model at a state, and their derivatives: what objectives see.

use super::{ContactModel, inverted};
use slipstick_path::StateError;

impl ContactModel {
    /// Internal force at displacements `d` and current density.
    ///
    /// # Errors
    /// If elements are inverted.
    pub fn internal_force(&self, d: &[f64], out: &mut [f64]) -> Result<(), StateError> {
        let result = self.solid.internal_force(d, &self.scalings, out).map_err(inverted);
        self.share.agree(result)?;
        self.share.sum(&mut [out]);
        Ok(())
    }

    /// Adds K v with K = ∂f_int/∂d, which is symmetric.
    ///
    /// # Errors
    /// If elements are inverted.
    pub fn add_internal_tangent_product(&self, d: &[f64], v: &[f64], out: &mut [f64]) -> Result<(), StateError> {
        self.share.add(out, |out| self.solid.add_tangent_product(d, &self.scalings, v, out).map_err(inverted))
    }

    /// Adds λᵀ ∂f_int/∂φ of every element.
    ///
    /// # Errors
    /// If elements are inverted.
    pub fn pull_back_density(&self, d: &[f64], lambda: &[f64], out: &mut [f64]) -> Result<(), StateError> {
        let (solid, scalings, slopes) = (&self.solid, &self.scalings, &self.scaling_slopes);
        self.share.add(out, |out| solid.pull_back_density(d, scalings, slopes, lambda, out).map_err(inverted))
    }

    /// External force at displacements `d` and pseudo-time `time`.
    pub fn external_force(&self, d: &[f64], time: f64, out: &mut [f64]) {
        out.fill(0.0);
        if !self.loads.is_empty() {
            self.loads.add_residual(time, &self.positions(d), out);
            out.iter_mut().for_each(|f| *f = -*f);
        }
    }

    /// Adds the transposed derivative of [`external_force`](Self::external_force) with respect to the displacements, times
    /// `weights`.
    pub fn pull_back_external_force(&self, d: &[f64], time: f64, weights: &[f64], out: &mut [f64]) {
        if !self.loads.is_empty() {
            let weights: Vec<f64> = weights.iter().map(|w| -w).collect();
            self.loads.add_transposed_product(time, &self.positions(d), &weights, out);
        }
    }
}
