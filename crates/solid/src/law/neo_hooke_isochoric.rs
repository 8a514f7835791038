//! Neo-Hooke with an energy split into changes of shape and of volume.

use super::constants::{ELASTIC, Hooke};
use super::invariants::{Invariants, Slopes, change_of_shape, trace_and_second};
use super::volume::{self, Volume};
use super::{Constant, Law, Local, MaterialError, Real, Stress, Value};
use crate::registers::{AtPoints, Matrix};
use pulp::Simd;

/// Neo-Hooke with an energy split into changes of shape and of volume.
///
/// ```text
/// Ψ = μ/2 (J^(−2/3) I₁ − 3) + K/2 (J − 1)²
/// ```
///
/// Unlike the energy of the laws of rubber (`law/volume.rs`), this one stays finite as J → 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NeoHookeIsochoric {
    limit: Hooke,
}

impl NeoHookeIsochoric {
    /// From Young's modulus E \[F/L²\] and Poisson's ratio ν of the linearized law.
    ///
    /// # Errors
    /// E ≤ 0, ν outside (−1, 0.5), or a value that is not finite.
    pub fn new(youngs_modulus: f64, poisson_ratio: f64) -> Result<Self, MaterialError> {
        Self::from_values(&[youngs_modulus.into(), poisson_ratio.into()])
    }
}

impl Law for NeoHookeIsochoric {
    const CONSTANTS: &'static [Constant] = ELASTIC;
    const FORM: Option<&'static str> = Some("isochoric");

    fn with_constants(values: &[Value]) -> Result<Self, MaterialError> {
        Self::like(Hooke::new(values[0].number(), values[1].number()))
    }

    fn values(&self) -> Vec<Value> {
        vec![self.limit.youngs_modulus.into(), self.limit.poisson_ratio.into()]
    }

    fn like(limit: Hooke) -> Result<Self, MaterialError> {
        Ok(Self { limit })
    }

    fn hooke(&self) -> &Hooke {
        &self.limit
    }

    fn energy<T: Real>(&self, f: &[[T; 3]; 3]) -> T {
        let (change, u) = volume::quadratic_energy(self.limit.bulk(), f);
        let [first, _] = trace_and_second(f);
        T::from(0.5 * self.limit.mu) * (change * first - T::from(3.0)) + u
    }
}

impl Stress for NeoHookeIsochoric {
    type Prepared<S: Simd> = Invariants<S>;

    #[inline(always)]
    fn shear_modulus(&self) -> f64 {
        self.limit.mu
    }

    #[inline(always)]
    fn volumetric<S: Simd>(&self, simd: S, determinant: &AtPoints) -> AtPoints {
        change_of_shape(simd, determinant)
    }

    #[inline(always)]
    fn prepare<S: Simd>(&self, simd: S, at: &Local<'_>) -> Invariants<S> {
        let volume = Volume::quadratic(simd, at, self.limit.bulk() / self.limit.mu);
        let first = simd.splat_f64s(0.5);
        Invariants::new(simd, at, volume, |_| Slopes { first, second: None, curvature: None })
    }

    #[inline(always)]
    fn stress<S: Simd>(&self, simd: S, at: &Local<'_>, prepared: &Invariants<S>) -> Matrix<S> {
        prepared.stress(simd, at)
    }

    #[inline(always)]
    fn stress_change<S: Simd>(
        &self,
        simd: S,
        at: &Local<'_>,
        prepared: &Invariants<S>,
        change: &Matrix<S>,
    ) -> Matrix<S> {
        prepared.stress_change(simd, at, change)
    }
}
