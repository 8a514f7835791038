//! Modified SIMP: stiffness of an element as a function of its density.

use schemars::JsonSchema;
use serde::Serialize;

/// Modified SIMP: `E(φ)/E₀ = φ_min + (1 − φ_min) φ^p`. Paper: (86).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Simp {
    /// Penalization power p ≥ 1.
    #[serde(rename = "p")]
    pub penalization: f64,
    /// φ_min: ratio of the void's to the solid's stiffness, in \[0, 1).
    #[serde(rename = "min")]
    pub minimum: f64,
}

impl Default for Simp {
    /// p = 3, φ_min = 1e-3.
    fn default() -> Self {
        Self { penalization: 3.0, minimum: 1e-3 }
    }
}

impl Simp {
    /// Stiffness factor of a density in [0, 1].
    pub fn factor(&self, density: f64) -> f64 {
        self.minimum + (1.0 - self.minimum) * density.powf(self.penalization)
    }

    /// d factor/dφ = (1 − φ_min) p φ^(p−1). Paper: (89).
    pub fn derivative(&self, density: f64) -> f64 {
        if self.penalization == 1.0 {
            return 1.0 - self.minimum;
        }
        (1.0 - self.minimum) * self.penalization * density.powf(self.penalization - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivative_matches_central_differences() {
        for penalization in [1.0, 2.5, 3.0] {
            let simp = Simp { penalization, minimum: 1e-3 };
            assert_eq!((simp.factor(0.0), simp.factor(1.0)), (1e-3, 1.0));
            for density in [0.05, 0.4, 0.95] {
                let h = 1e-5;
                let fd = (simp.factor(density + h) - simp.factor(density - h)) / (2.0 * h);
                assert!((fd - simp.derivative(density)).abs() < 1e-9);
            }
        }
    }
}
