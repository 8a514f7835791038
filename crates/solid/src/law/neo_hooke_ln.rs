//! Neo-Hooke with the logarithm of J.

use super::constants::{ELASTIC, Hooke};
use super::{Constant, Law, Local, MaterialError, Real, Stress, Value, determinant};
use crate::power::natural_logarithm;
use crate::registers::{AtPoints, Matrix, array, load, load_matrix, product};
use pulp::Simd;

/// Neo-Hooke with the logarithm of J.
///
/// ```text
/// Ψ = μ/2 (I₁ − 3) − μ ln J + λ/2 (ln J)²,   P = μ F + (λ ln J − μ) F^(−T)
/// ```
///
/// Reference: Bonet, Wood, *Nonlinear Continuum Mechanics for Finite Element Analysis*, 1997, 5.4.3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NeoHookeLn {
    limit: Hooke,
}

impl NeoHookeLn {
    /// From Young's modulus E \[F/L²\] and Poisson's ratio ν of the linearized law.
    ///
    /// # Errors
    /// E ≤ 0, ν outside (−1, 0.5), or a value that is not finite.
    pub fn new(youngs_modulus: f64, poisson_ratio: f64) -> Result<Self, MaterialError> {
        Self::from_values(&[youngs_modulus.into(), poisson_ratio.into()])
    }

    /// λ/μ.
    #[inline(always)]
    fn ratio(&self) -> f64 {
        self.limit.lambda / self.limit.mu
    }
}

impl Law for NeoHookeLn {
    const CONSTANTS: &'static [Constant] = ELASTIC;
    const FORM: Option<&'static str> = Some("ln");

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
        let i1 = f.as_flattened().iter().fold(T::from(0.0), |sum, &f| sum + f * f);
        let ln_j = determinant(f).ln();
        let Hooke { lambda, mu, .. } = self.limit;
        T::from(0.5 * mu) * (i1 - T::from(3.0) - T::from(2.0) * ln_j) + T::from(0.5 * lambda) * ln_j * ln_j
    }
}

impl Stress for NeoHookeLn {
    type Prepared<S: Simd> = ();

    #[inline(always)]
    fn shear_modulus(&self) -> f64 {
        self.limit.mu
    }

    /// 1 − λ/μ ln J.
    #[inline(always)]
    fn volumetric<S: Simd>(&self, simd: S, determinant: &AtPoints) -> AtPoints {
        natural_logarithm(simd, determinant).map(|ln_j| 1.0 - self.ratio() * ln_j)
    }

    #[inline(always)]
    fn prepare<S: Simd>(&self, _: S, _: &Local<'_>) {}

    /// F − (1 − λ/μ ln J) F⁻ᵀ.
    #[inline(always)]
    fn stress<S: Simd>(&self, simd: S, at: &Local<'_>, (): &()) -> Matrix<S> {
        let volumetric = load::<S>(at.volumetric, at.v);
        array(|a, b| simd.negate_mul_add_e_f64s(volumetric, at.inverse::<S>(b, a), at.gradient::<S>(a, b)))
    }

    /// With A = F⁻¹ dF: dF + λ/μ tr(A) F⁻ᵀ + (1 − λ/μ ln J) (A F⁻¹)ᵀ.
    #[inline(always)]
    fn stress_change<S: Simd>(&self, simd: S, at: &Local<'_>, (): &(), change: &Matrix<S>) -> Matrix<S> {
        let (inverse, volumetric) = (load_matrix::<S>(at.inverse, at.v), load::<S>(at.volumetric, at.v));
        let relative = product(simd, &inverse, change);
        let trace = simd.add_f64s(simd.add_f64s(relative[0][0], relative[1][1]), relative[2][2]);
        let dilation = simd.mul_f64s(simd.splat_f64s(self.ratio()), trace);
        let transposed = product(simd, &relative, &inverse);
        array(|a, b| {
            let sum = simd.mul_add_e_f64s(dilation, inverse[b][a], change[a][b]);
            simd.mul_add_e_f64s(volumetric, transposed[b][a], sum)
        })
    }
}
