//! St. Venant-Kirchhoff.

use super::constants::{ELASTIC, Hooke};
use super::{Constant, Law, Local, MaterialError, Real, Stress, Value, hooke};
use crate::registers::{Matrix, array, load_matrix, product, transpose};
use pulp::Simd;

/// St. Venant-Kirchhoff: Hooke's law between the Green-Lagrange strain E and the second
/// Piola-Kirchhoff stress S.
///
/// ```text
/// Ψ = λ/2 (tr E)² + μ E:E,   E = (FᵀF − 1)/2,   S = λ tr(E) 1 + 2μ E,   P = F S
/// ```
///
/// The law is meant for large rotations at small strains. It softens in compression: along one axis
/// without lateral strain, the force decreases again below the stretch √(1/3). Ψ stays finite as J
/// → 0, so nothing keeps elements from inverting.
///
/// Reference: Holzapfel, Nonlinear Solid Mechanics (2000), section 6.5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StVenantKirchhoff {
    limit: Hooke,
    ratio: f64,
}

impl StVenantKirchhoff {
    /// From Young's modulus E \[F/L²\] and Poisson's ratio ν.
    ///
    /// # Errors
    /// E ≤ 0, ν outside (−1, 0.5), or a value that is not finite.
    pub fn new(youngs_modulus: f64, poisson_ratio: f64) -> Result<Self, MaterialError> {
        Self::from_values(&[youngs_modulus.into(), poisson_ratio.into()])
    }

    /// λ/μ.
    #[inline]
    pub fn lame_ratio(&self) -> f64 {
        self.ratio
    }

    /// S/μ.
    #[inline(always)]
    fn second_stress<S: Simd>(&self, simd: S, at: &Local<'_>) -> Matrix<S> {
        let gradient = load_matrix::<S>(at.gradient, at.v);
        let mut doubled = product(simd, &transpose::<S>(&gradient), &gradient);
        for a in 0..3 {
            doubled[a][a] = simd.sub_f64s(doubled[a][a], simd.splat_f64s(1.0));
        }
        hooke(simd, self.ratio, doubled)
    }
}

impl Law for StVenantKirchhoff {
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
        let (mut trace, mut squares) = (T::from(0.0), T::from(0.0));
        for a in 0..3 {
            for b in 0..3 {
                let product = (0..3).fold(T::from(0.0), |sum, c| sum + f[c][a] * f[c][b]);
                let strain = T::from(0.5) * (product - T::from(f64::from(a == b)));
                squares = squares + strain * strain;
                if a == b {
                    trace = trace + strain;
                }
            }
        }
        T::from(self.limit.mu) * (T::from(0.5 * self.ratio) * trace * trace + squares)
    }
}

impl Stress for StVenantKirchhoff {
    type Prepared<S: Simd> = ();

    #[inline(always)]
    fn shear_modulus(&self) -> f64 {
        self.limit.mu
    }

    #[inline(always)]
    fn prepare<S: Simd>(&self, _: S, _: &Local<'_>) {}

    /// F S/μ.
    #[inline(always)]
    fn stress<S: Simd>(&self, simd: S, at: &Local<'_>, (): &()) -> Matrix<S> {
        product(simd, &load_matrix::<S>(at.gradient, at.v), &self.second_stress(simd, at))
    }

    /// (dF S + F dS)/μ, where 2 dE = FᵀdF + (FᵀdF)ᵀ.
    #[inline(always)]
    fn stress_change<S: Simd>(&self, simd: S, at: &Local<'_>, (): &(), change: &Matrix<S>) -> Matrix<S> {
        let gradient = load_matrix::<S>(at.gradient, at.v);
        let half = product(simd, &transpose::<S>(&gradient), change);
        let doubled = array(|a, b| simd.add_f64s(half[a][b], half[b][a]));
        let second = hooke(simd, self.ratio, doubled);
        let geometric = product(simd, change, &self.second_stress(simd, at));
        let material = product(simd, &gradient, &second);
        array(|a, b| simd.add_f64s(geometric[a][b], material[a][b]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Computed by hand: stretch s along one axis without lateral strain has P = (λ + 2μ) s
    /// (s² − 1)/2, with its minimum at s = √(1/3).
    #[test]
    fn it_softens_in_compression() {
        let (e, nu) = (10.0, 0.25);
        let law = StVenantKirchhoff::new(e, nu).unwrap();
        let (mu, lambda) = (4.0, 4.0);
        let energy = |s: f64| law.energy(&[[1.0, 0.0, 0.0], [0.0, s, 0.0], [0.0, 0.0, 1.0]]);
        let force = |s: f64| (energy(s + 1e-5) - energy(s - 1e-5)) / 2e-5;
        for s in [0.2, 0.7, 1.3] {
            assert!((force(s) - 0.5 * (lambda + 2.0 * mu) * s * (s * s - 1.0)).abs() < 1e-8, "{s}: {}", force(s));
        }
        assert!(force(0.5) > force(1.0 / 3.0_f64.sqrt()));
    }
}
