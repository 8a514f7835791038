//! Hencky.

use super::constants::{ELASTIC, Hooke};
use super::principal::{Principal, Spectrum, Tensor, logarithm};
use super::volume::Volume;
use super::{Constant, Law, Local, MaterialError, Real, Stress, Value};
use crate::power::natural_logarithm;
use crate::registers::{AtPoints, Matrix};
use pulp::Simd;

/// Hencky's law: Hooke's law in logarithmic strains ε = ½ ln C. Metals up to moderate elastic strains,
/// and the elastic part of the laws with plasticity.
///
/// ```text
/// Ψ = μ dev ε : dev ε + K/2 (ln J)²
/// ```
///
/// With C = Σ_a c_a N_a ⊗ N_a and e_a = ½ ln c_a − ⅓ ln J, the deviatoric part of S has the principal
/// values s_a = 2μ e_a/c_a. The energy is not polyconvex: in tension, the stress has a maximum at
/// strains of order one.
///
/// References: Hencky, Z. tech. Phys. 9 (1928) 215–220; Anand, J. Appl. Mech. 46 (1979) 78–82.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hencky {
    limit: Hooke,
}

impl Hencky {
    /// From Young's modulus E \[F/L²\] and Poisson's ratio ν.
    ///
    /// # Errors
    /// E ≤ 0, ν outside (−1, 0.5), or a value that is not finite.
    pub fn new(youngs_modulus: f64, poisson_ratio: f64) -> Result<Self, MaterialError> {
        Self::from_values(&[youngs_modulus.into(), poisson_ratio.into()])
    }
}

/// Principal stresses and their derivatives, divided by the shear modulus, for the eigenvalues `c` of C,
/// and J.
fn principal(c: [f64; 3], j: f64) -> Principal {
    let ln_j = j.ln() / 3.0;
    let t = c.map(|c| c.ln() - 2.0 * ln_j);
    let mut out = Principal { stress: [0.0; 3], slopes: [[0.0; 3]; 3], quotients: [0.0; 3] };
    for a in 0..3 {
        out.stress[a] = t[a] / c[a];
        for b in 0..3 {
            let own = if a == b { 1.0 - t[a] } else { 0.0 };
            out.slopes[a][b] = (own - 1.0 / 3.0) / (c[a] * c[b]);
        }
        // (t_a − t_b)/(c_a − c_b) = ln(c_a/c_b)/(c_a − c_b)
        let (first, second) = (c[(a + 1) % 3], c[(a + 2) % 3]);
        let relative = (first - second) / second;
        let quotient = if relative == 0.0 { 1.0 / second } else { relative.ln_1p() / (first - second) };
        out.quotients[a] = (quotient - t[(a + 2) % 3] / second) / first;
    }
    out
}

impl Law for Hencky {
    const CONSTANTS: &'static [Constant] = ELASTIC;

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
        let strain = logarithm(&Tensor::of(f)).0.map(|row| row.map(|x| T::from(0.5) * x));
        self.limit.energy(&strain)
    }
}

impl Stress for Hencky {
    type Prepared<S: Simd> = Spectrum<S>;

    #[inline(always)]
    fn shear_modulus(&self) -> f64 {
        self.limit.mu
    }

    /// ln J.
    #[inline(always)]
    fn volumetric<S: Simd>(&self, simd: S, determinant: &AtPoints) -> AtPoints {
        natural_logarithm(simd, determinant)
    }

    #[inline(always)]
    fn prepare<S: Simd>(&self, simd: S, at: &Local<'_>) -> Spectrum<S> {
        let volume = Volume::logarithmic(simd, at, self.limit.bulk() / self.limit.mu);
        Spectrum::new(simd, at, volume, principal)
    }

    #[inline(always)]
    fn stress<S: Simd>(&self, simd: S, at: &Local<'_>, prepared: &Spectrum<S>) -> Matrix<S> {
        prepared.stress(simd, at)
    }

    #[inline(always)]
    fn stress_change<S: Simd>(&self, simd: S, at: &Local<'_>, prepared: &Spectrum<S>, change: &Matrix<S>) -> Matrix<S> {
        prepared.stress_change(simd, at, change)
    }
}
