//! Hooke's law at small strains.

use super::constants::{ELASTIC, Hooke};
use super::{Constant, Law, Local, MaterialError, Real, Stress, Value, hooke};
use crate::registers::{Matrix, array};
use pulp::Simd;

/// Linear elasticity: Hooke's law between the small strain ε and the stress, in the undeformed
/// geometry.
///
/// ```text
/// Ψ = λ/2 (tr ε)² + μ ε:ε,   ε = (H + Hᵀ)/2,   H = ∂u/∂X = F − 1,   P = λ tr(ε) 1 + 2μ ε
/// ```
///
/// The law is meant for small displacements and rotations, as in most published tests of contact
/// codes. It is not objective: a rotation by the angle α strains the body by α²/2. No displacement
/// makes Ψ infinite or undefined, and inverted elements are not an error.
///
/// Reference: Hughes, The Finite Element Method (2000), section 2.7; B̄: section 4.5.2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearElastic {
    limit: Hooke,
    ratio: f64,
}

impl LinearElastic {
    /// From Young's modulus E \[F/L²\] and Poisson's ratio ν.
    ///
    /// # Errors
    /// E ≤ 0, ν outside (−1, 0.5), or a value that is not finite.
    pub fn new(youngs_modulus: f64, poisson_ratio: f64) -> Result<Self, MaterialError> {
        Self::from_values(&[youngs_modulus.into(), poisson_ratio.into()])
    }
}

impl Law for LinearElastic {
    const CONSTANTS: &'static [Constant] = ELASTIC;

    fn with_constants(values: &[Value]) -> Result<Self, MaterialError> {
        Self::like(Hooke::new(values[0].number(), values[1].number()))
    }

    fn values(&self) -> Vec<Value> {
        vec![self.limit.youngs_modulus.into(), self.limit.poisson_ratio.into()]
    }

    fn like(limit: Hooke) -> Result<Self, MaterialError> {
        let nu = limit.poisson_ratio;
        Ok(Self { limit, ratio: 2.0 * nu / (1.0 - 2.0 * nu) })
    }

    fn hooke(&self) -> &Hooke {
        &self.limit
    }

    fn energy<T: Real>(&self, f: &[[T; 3]; 3]) -> T {
        let h = std::array::from_fn(|a| std::array::from_fn(|b| f[a][b] - T::from(f64::from(a == b))));
        self.limit.energy(&h)
    }
}

impl Stress for LinearElastic {
    type Prepared<S: Simd> = ();

    #[inline(always)]
    fn shear_modulus(&self) -> f64 {
        self.limit.mu
    }

    #[inline(always)]
    fn prepare<S: Simd>(&self, _: S, _: &Local<'_>) {}

    #[inline(always)]
    fn stress<S: Simd>(&self, simd: S, at: &Local<'_>, (): &()) -> Matrix<S> {
        let unit = |a, b| simd.splat_f64s(f64::from(a == b));
        self.stress_change(simd, at, &(), &array(|a, b| simd.sub_f64s(at.gradient::<S>(a, b), unit(a, b))))
    }

    #[inline(always)]
    fn stress_change<S: Simd>(&self, simd: S, _: &Local<'_>, (): &(), change: &Matrix<S>) -> Matrix<S> {
        hooke(simd, self.ratio, array(|a, b| simd.add_f64s(change[a][b], change[b][a])))
    }

    #[inline(always)]
    fn small_strains(&self) -> bool {
        true
    }
}
