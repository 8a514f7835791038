//! Coupled compressible neo-Hooke.

use super::{Constants, MaterialError};

/// Coupled compressible neo-Hooke.
///
/// ```text
/// Ψ = c/β (J^(−2β) − 1) + c (I₁ − 3),   c = E/(4(1+ν)),   β = ν/(1−2ν),   P = 2c (F − J^(−2β) F^(−T))
/// ```
///
/// Paper: (100).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NeoHooke {
    constants: Constants,
    c: f64,
    beta: f64,
}

impl NeoHooke {
    /// From Young's modulus E \[F/L²\] and Poisson's ratio ν of the linearised law.
    ///
    /// # Errors
    /// E ≤ 0, ν outside of (−1, 0.5), or a value that is not finite.
    pub fn new(youngs_modulus: f64, poisson_ratio: f64) -> Result<Self, MaterialError> {
        Ok(Self {
            constants: Constants::new(youngs_modulus, poisson_ratio)?,
            c: youngs_modulus / (4.0 * (1.0 + poisson_ratio)),
            beta: poisson_ratio / (1.0 - 2.0 * poisson_ratio),
        })
    }

    pub(super) fn constants(&self) -> &Constants {
        &self.constants
    }

    /// Young's modulus E. \[F/L²\]
    pub fn youngs_modulus(&self) -> f64 {
        self.constants.youngs_modulus
    }

    /// Poisson's ratio ν.
    pub fn poisson_ratio(&self) -> f64 {
        self.constants.poisson_ratio
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

    /// β → 0 is the limit of the law, not a division by zero.
    #[test]
    fn energy_is_continuous_at_vanishing_poisson_ratio() {
        let (zero, small) = (NeoHooke::new(3.0, 0.0).unwrap(), NeoHooke::new(3.0, 1e-9).unwrap());
        assert!((zero.energy(0.8, 2.9) - small.energy(0.8, 2.9)).abs() < 1e-8);
    }
}
