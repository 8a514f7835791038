//! Coupled compressible neo-Hooke.

use super::constants::{ELASTIC, Hooke};
use super::{Constant, Law, Local, MaterialError, Real, Stress, Value, determinant};
use crate::power::inverse_power;
use crate::registers::{AtPoints, Matrix, array, load, load_matrix, product};
use pulp::Simd;

/// Coupled compressible neo-Hooke.
///
/// ```text
/// Ψ = c/β (J^(−2β) − 1) + c (I₁ − 3),   c = E/(4(1+ν)),   β = ν/(1−2ν),   P = 2c (F − J^(−2β) F^(−T))
/// ```
///
/// Paper: (100).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NeoHooke {
    limit: Hooke,
    c: f64,
    beta: f64,
}

impl NeoHooke {
    /// From Young's modulus E \[F/L²\] and Poisson's ratio ν of the linearized law.
    ///
    /// # Errors
    /// E ≤ 0, ν outside (−1, 0.5), or a value that is not finite.
    pub fn new(youngs_modulus: f64, poisson_ratio: f64) -> Result<Self, MaterialError> {
        Self::from_values(&[youngs_modulus.into(), poisson_ratio.into()])
    }

    /// 2c, the factor of P. \[F/L²\]
    #[inline]
    pub fn modulus(&self) -> f64 {
        2.0 * self.c
    }

    /// 2β, the exponent of 1/J in P.
    #[inline]
    pub fn exponent(&self) -> f64 {
        2.0 * self.beta
    }
}

impl Law for NeoHooke {
    const CONSTANTS: &'static [Constant] = ELASTIC;
    const FORM: Option<&'static str> = Some("power");

    fn with_constants(values: &[Value]) -> Result<Self, MaterialError> {
        Self::like(Hooke::new(values[0].number(), values[1].number()))
    }

    fn values(&self) -> Vec<Value> {
        vec![self.limit.youngs_modulus.into(), self.limit.poisson_ratio.into()]
    }

    fn like(limit: Hooke) -> Result<Self, MaterialError> {
        let Hooke { youngs_modulus, poisson_ratio, .. } = limit;
        let c = youngs_modulus / (4.0 * (1.0 + poisson_ratio));
        Ok(Self { limit, c, beta: poisson_ratio / (1.0 - 2.0 * poisson_ratio) })
    }

    fn hooke(&self) -> &Hooke {
        &self.limit
    }

    fn energy<T: Real>(&self, f: &[[T; 3]; 3]) -> T {
        let i1 = f.as_flattened().iter().fold(T::from(0.0), |sum, &f| sum + f * f);
        let ln_j = determinant(f).ln();
        let volumetric = match self.beta {
            0.0 => T::from(-2.0) * ln_j,
            beta => (T::from(-2.0 * beta) * ln_j).exp_m1() / T::from(beta),
        };
        T::from(self.c) * (volumetric + i1 - T::from(3.0))
    }
}

impl Stress for NeoHooke {
    type Prepared<S: Simd> = ();

    #[inline(always)]
    fn shear_modulus(&self) -> f64 {
        self.modulus()
    }

    /// J^(−2β).
    #[inline(always)]
    fn volumetric<S: Simd>(&self, simd: S, determinant: &AtPoints) -> AtPoints {
        inverse_power(simd, determinant, self.exponent())
    }

    #[inline(always)]
    fn prepare<S: Simd>(&self, _: S, _: &Local<'_>) {}

    /// F − J^(−2β) F⁻ᵀ.
    #[inline(always)]
    fn stress<S: Simd>(&self, simd: S, at: &Local<'_>, (): &()) -> Matrix<S> {
        let volumetric = load::<S>(at.volumetric, at.v);
        array(|a, b| simd.negate_mul_add_e_f64s(volumetric, at.inverse::<S>(b, a), at.gradient::<S>(a, b)))
    }

    /// With A = F⁻¹ dF: dF + J^(−2β) (2β tr(A) F⁻ᵀ + (A F⁻¹)ᵀ).
    #[inline(always)]
    fn stress_change<S: Simd>(&self, simd: S, at: &Local<'_>, (): &(), change: &Matrix<S>) -> Matrix<S> {
        let (inverse, volumetric) = (load_matrix::<S>(at.inverse, at.v), load::<S>(at.volumetric, at.v));
        let relative = product(simd, &inverse, change);
        let trace = simd.add_f64s(simd.add_f64s(relative[0][0], relative[1][1]), relative[2][2]);
        let dilation = simd.mul_f64s(simd.splat_f64s(self.exponent()), trace);
        let transposed = product(simd, &relative, &inverse);
        array(|a, b| {
            let volume = simd.mul_add_e_f64s(dilation, inverse[b][a], transposed[b][a]);
            simd.mul_add_e_f64s(volumetric, volume, change[a][b])
        })
    }

    #[inline(always)]
    fn volumetric_exponent(&self) -> Option<f64> {
        Some(self.exponent())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// β → 0 is the limit of the law, not a division by zero.
    #[test]
    fn energy_is_continuous_at_vanishing_poisson_ratio() {
        let f = [[0.9, 0.1, 0.0], [0.0, 0.95, 0.2], [-0.1, 0.0, 0.9]];
        let [zero, small] = [0.0, 1e-9].map(|nu| NeoHooke::new(3.0, nu).unwrap().energy(&f));
        assert!((zero - small).abs() < 1e-8, "{zero} {small}");
    }
}
