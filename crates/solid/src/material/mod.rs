//! Hyperelastic laws.

mod neo_hooke;
mod st_venant_kirchhoff;

pub use neo_hooke::NeoHooke;
pub use st_venant_kirchhoff::StVenantKirchhoff;

/// Why a material cannot be built.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum MaterialError {
    /// Young's modulus must be positive and finite.
    #[error("Young's modulus {0} must be positive")]
    YoungsModulus(f64),
    /// Poisson's ratio must lie in (−1, 0.5).
    #[error("Poisson's ratio {0} must be greater than -1 and less than 0.5")]
    PoissonRatio(f64),
}

/// A hyperelastic law; all have the same small-strain limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Material {
    /// Compressible neo-Hooke.
    NeoHooke(NeoHooke),
    /// St. Venant-Kirchhoff: linear between Green-Lagrange strain and second Piola-Kirchhoff stress.
    StVenantKirchhoff(StVenantKirchhoff),
}

impl Material {
    /// Young's modulus E of the small-strain limit. \[F/L²\]
    pub fn youngs_modulus(&self) -> f64 {
        self.constants().youngs_modulus
    }

    /// Poisson's ratio ν of the small-strain limit.
    pub fn poisson_ratio(&self) -> f64 {
        self.constants().poisson_ratio
    }

    /// Energy density Ψ at deformation gradient F, det F > 0. \[F/L²\]
    pub fn energy(&self, f: &[[f64; 3]; 3]) -> f64 {
        match self {
            Self::NeoHooke(law) => law.energy(determinant(f), f.as_flattened().iter().map(|f| f * f).sum()),
            Self::StVenantKirchhoff(law) => law.energy(f),
        }
    }

    fn constants(&self) -> &Constants {
        match self {
            Self::NeoHooke(law) => law.constants(),
            Self::StVenantKirchhoff(law) => law.constants(),
        }
    }
}

impl From<NeoHooke> for Material {
    fn from(law: NeoHooke) -> Self {
        Self::NeoHooke(law)
    }
}

impl From<StVenantKirchhoff> for Material {
    fn from(law: StVenantKirchhoff) -> Self {
        Self::StVenantKirchhoff(law)
    }
}

/// Constants of the small-strain limit.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Constants {
    youngs_modulus: f64,
    poisson_ratio: f64,
}

impl Constants {
    fn new(youngs_modulus: f64, poisson_ratio: f64) -> Result<Self, MaterialError> {
        if !(youngs_modulus > 0.0 && youngs_modulus.is_finite()) {
            return Err(MaterialError::YoungsModulus(youngs_modulus));
        }
        if !(poisson_ratio > -1.0 && poisson_ratio < 0.5) {
            return Err(MaterialError::PoissonRatio(poisson_ratio));
        }
        Ok(Self { youngs_modulus, poisson_ratio })
    }
}

fn determinant(f: &[[f64; 3]; 3]) -> f64 {
    let minor = |a: usize, b: usize| f[1][a] * f[2][b] - f[1][b] * f[2][a];
    f[0][0] * minor(1, 2) - f[0][1] * minor(0, 2) + f[0][2] * minor(0, 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impossible_constants_are_refused() {
        assert_eq!(NeoHooke::new(-1.0, 0.3), Err(MaterialError::YoungsModulus(-1.0)));
        assert_eq!(StVenantKirchhoff::new(1.0, 0.5), Err(MaterialError::PoissonRatio(0.5)));
        assert!(NeoHooke::new(f64::NAN, 0.3).is_err() && StVenantKirchhoff::new(1.0, f64::NAN).is_err());
    }

    /// By hand: F = 1 + ε(e ⊗ n) has energy μ ε²/2 (shear) and (λ/2 + μ) ε² (stretch) to second order, in both laws.
    #[test]
    fn laws_share_the_small_strain_limit() {
        let (e, nu) = (7.0, 0.3);
        let (mu, lambda) = (e / (2.0 * (1.0 + nu)), e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)));
        let laws: [Material; 2] = [NeoHooke::new(e, nu).unwrap().into(), StVenantKirchhoff::new(e, nu).unwrap().into()];
        for law in laws {
            assert_eq!((law.youngs_modulus(), law.poisson_ratio()), (e, nu));
            let small = 1e-3;
            let second = |a: usize, b: usize| {
                let at = |h: f64| {
                    let mut f = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
                    f[a][b] += h;
                    law.energy(&f)
                };
                0.5 * (at(small) + at(-small)) / (small * small)
            };
            for (a, b, expected) in [(0, 1, 0.5 * mu), (2, 0, 0.5 * mu), (1, 1, 0.5 * lambda + mu)] {
                assert!((second(a, b) / expected - 1.0).abs() < 1e-4, "{law:?}: {} {expected}", second(a, b));
            }
        }
    }
}
