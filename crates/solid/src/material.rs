//! Hyperelastic laws.

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

/// Coupled compressible neo-Hooke.
///
/// ```text
/// Ψ = c/β (J^(−2β) − 1) + c (I₁ − 3),   c = E/(4(1+ν)),   β = ν/(1−2ν),   P = 2c (F − J^(−2β) F^(−T))
/// ```
///
/// Paper: (100).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NeoHooke {
    youngs_modulus: f64,
    poisson_ratio: f64,
    c: f64,
    beta: f64,
}

impl NeoHooke {
    /// From Young's modulus E \[F/L²\] and Poisson's ratio ν of the linearised law.
    ///
    /// # Errors
    /// E ≤ 0, ν outside of (−1, 0.5), or a value that is not finite.
    pub fn new(youngs_modulus: f64, poisson_ratio: f64) -> Result<Self, MaterialError> {
        if !(youngs_modulus > 0.0 && youngs_modulus.is_finite()) {
            return Err(MaterialError::YoungsModulus(youngs_modulus));
        }
        if !(poisson_ratio > -1.0 && poisson_ratio < 0.5) {
            return Err(MaterialError::PoissonRatio(poisson_ratio));
        }
        Ok(Self {
            youngs_modulus,
            poisson_ratio,
            c: youngs_modulus / (4.0 * (1.0 + poisson_ratio)),
            beta: poisson_ratio / (1.0 - 2.0 * poisson_ratio),
        })
    }

    /// Young's modulus E. \[F/L²\]
    pub fn youngs_modulus(&self) -> f64 {
        self.youngs_modulus
    }

    /// Poisson's ratio ν.
    pub fn poisson_ratio(&self) -> f64 {
        self.poisson_ratio
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

    /// Energy density Ψ at determinant `j` > 0 and first invariant `i1`. \[F/L²\]
    pub fn energy(&self, j: f64, i1: f64) -> f64 {
        let volumetric =
            if self.beta == 0.0 { -2.0 * j.ln() } else { (-2.0 * self.beta * j.ln()).exp_m1() / self.beta };
        self.c * (volumetric + i1 - 3.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impossible_constants_are_refused() {
        assert_eq!(NeoHooke::new(-1.0, 0.3), Err(MaterialError::YoungsModulus(-1.0)));
        assert_eq!(NeoHooke::new(1.0, 0.5), Err(MaterialError::PoissonRatio(0.5)));
        assert!(NeoHooke::new(f64::NAN, 0.3).is_err() && NeoHooke::new(1.0, f64::NAN).is_err());
    }

    /// β → 0 is the limit of the law, not a division by zero.
    #[test]
    fn energy_is_continuous_at_vanishing_poisson_ratio() {
        let (zero, small) = (NeoHooke::new(3.0, 0.0).unwrap(), NeoHooke::new(3.0, 1e-9).unwrap());
        assert!((zero.energy(0.8, 2.9) - small.energy(0.8, 2.9)).abs() < 1e-8);
    }
}
