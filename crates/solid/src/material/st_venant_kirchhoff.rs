//! St. Venant-Kirchhoff.

use super::{Constants, MaterialError};

/// St. Venant-Kirchhoff: Hooke's law between the Green-Lagrange strain E and the second Piola-Kirchhoff stress S.
///
/// ```text
/// Ψ = λ/2 (tr E)² + μ E:E,   E = (FᵀF − 1)/2,   S = λ tr(E) 1 + 2μ E,   P = F S
/// ```
///
/// For large rotations at small strains. It softens in compression: along one axis without lateral strain, the force falls
/// again below the stretch √(1/3), and Ψ stays finite as J → 0, so that nothing keeps elements from inverting.
///
/// Reference: Holzapfel, Nonlinear Solid Mechanics (2000), section 6.5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StVenantKirchhoff {
    constants: Constants,
    mu: f64,
    ratio: f64,
}

impl StVenantKirchhoff {
    /// From Young's modulus E \[F/L²\] and Poisson's ratio ν.
    ///
    /// # Errors
    /// E ≤ 0, ν outside of (−1, 0.5), or a value that is not finite.
    pub fn new(youngs_modulus: f64, poisson_ratio: f64) -> Result<Self, MaterialError> {
        Ok(Self {
            constants: Constants::new(youngs_modulus, poisson_ratio)?,
            mu: youngs_modulus / (2.0 * (1.0 + poisson_ratio)),
            ratio: 2.0 * poisson_ratio / (1.0 - 2.0 * poisson_ratio),
        })
    }

    pub(super) fn constants(&self) -> &Constants {
        &self.constants
    }

    /// Shear modulus μ. \[F/L²\]
    #[inline]
    pub fn shear_modulus(&self) -> f64 {
        self.mu
    }

    /// λ/μ.
    #[inline]
    pub fn lame_ratio(&self) -> f64 {
        self.ratio
    }

    /// Energy density Ψ at deformation gradient F. \[F/L²\]
    pub fn energy(&self, f: &[[f64; 3]; 3]) -> f64 {
        let (mut trace, mut squares) = (0.0, 0.0);
        for a in 0..3 {
            for b in 0..3 {
                let product: f64 = (0..3).map(|c| f[c][a] * f[c][b]).sum();
                let strain = 0.5 * (product - f64::from(a == b));
                squares += strain * strain;
                if a == b {
                    trace += strain;
                }
            }
        }
        self.mu * (0.5 * self.ratio * trace * trace + squares)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: stretch s along one axis without lateral strain has P = (λ + 2μ) s (s² − 1)/2, least at s = √(1/3).
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
