//! Effect of an element's density on its energy: modified SIMP and, optionally, interpolation of
//! the energy.

use schemars::JsonSchema;
use serde::Serialize;

use crate::Simp;

/// How an element's energy is scaled: `W = factor · [Ψ(γ u) + (1 − γ²) Ψ_L(u)]`, integrated over
/// the element, with Ψ the material's energy and Ψ_L its small-strain limit. The same type holds
/// the derivatives of both numbers with respect to the density.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElementScaling {
    /// Stiffness relative to the solid, E/E₀.
    pub factor: f64,
    /// Fraction γ of the displacements at which the finite-strain energy is evaluated: 1 in solid
    /// elements, 0 in empty ones.
    pub gamma: f64,
    /// Strength (yield stress) relative to the solid, divided by `factor`: for laws with memory.
    pub strength: f64,
    /// Share r of the solid's law, 1 in solid elements; the rest follows the law with the void's Poisson's ratio,
    /// where a section has one ([`Section::void_poisson_ratio`](crate::Section::void_poisson_ratio)).
    pub bulk: f64,
}

impl ElementScaling {
    /// The unscaled solid.
    pub const SOLID: Self = Self { factor: 1.0, gamma: 1.0, strength: 1.0, bulk: 1.0 };

    /// The derivatives of an element that is not designed.
    pub const NONE: Self = Self { factor: 0.0, gamma: 0.0, strength: 0.0, bulk: 0.0 };

    /// A solid with scaled stiffness, without interpolation of the energy.
    pub const fn stiffness(factor: f64) -> Self {
        Self { factor, ..Self::SOLID }
    }

    /// The scaling, or its derivative, as it applies to a law: for a small-strain law Ψ is Ψ_L, and
    /// the energy is factor · Ψ_L for any γ. With γ = 0 the elements evaluate the law at rest,
    /// where no element is inverted.
    #[inline(always)]
    pub(crate) fn effective(self, small_strains: bool) -> Self {
        if small_strains { Self { gamma: 0.0, ..self } } else { self }
    }
}

/// Energy interpolation: void elements follow linear elasticity, which no deformation can invert.
///
/// ```text
/// γ(x) = (tanh βη + tanh β(x − η)) / (tanh βη + tanh β(1 − η)),   x = φ^p
/// ```
///
/// Source: Wang, Lazarov, Sigmund, Jensen, Comput. Methods Appl. Mech. Engrg. 276 (2014) 453–472,
/// whose β₁ and ρ₀ are β and η here. As Ψ_L is quadratic, their Ψ(γu) − Ψ_L(γu) + Ψ_L(u) is
/// Ψ(γu) + (1 − γ²) Ψ_L(u).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct EnergyInterpolation {
    /// Threshold η of φ^p, in (0, 1).
    pub threshold: f64,
    /// Sharpness β > 0.
    pub sharpness: f64,
}

impl EnergyInterpolation {
    /// The published parameters, η = 0.01 and β = 500: elements with φ^p above 0.05 count as solid.
    pub const PUBLISHED: Self = Self { threshold: 0.01, sharpness: 500.0 };

    fn range(&self) -> f64 {
        (self.sharpness * self.threshold).tanh() + (self.sharpness * (1.0 - self.threshold)).tanh()
    }

    /// γ at `x` = φ^p in [0, 1]: 0 at 0, 1 at 1.
    pub fn gamma(&self, x: f64) -> f64 {
        let shifted = (self.sharpness * (x - self.threshold)).tanh();
        ((self.sharpness * self.threshold).tanh() + shifted) / self.range()
    }

    /// dγ/dx.
    pub fn derivative(&self, x: f64) -> f64 {
        let shifted = (self.sharpness * (x - self.threshold)).tanh();
        self.sharpness * (1.0 - shifted * shifted) / self.range()
    }
}

/// The map from density to the scaling of an element's energy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interpolation {
    /// Stiffness.
    pub simp: Simp,
    /// Energy interpolation; `None`: finite strains at every density.
    pub energy: Option<EnergyInterpolation>,
    /// Power with which the yield stress falls with the density; `None`: that of the stiffness. With a power
    /// of its own, the minimum of `simp` must be positive.
    pub strength: Option<f64>,
    /// Power q ≥ 1 of r = φ^q, with which the bulk modulus rises from that of the void's Poisson's ratio to that of
    /// the solid, relative to the shear modulus.
    pub bulk: f64,
    /// Power with which the mass falls with the density, ≥ 1.
    pub mass: f64,
}

impl Interpolation {
    /// The default power of the bulk modulus.
    pub const BULK: f64 = 3.0;

    /// Mass of an element relative to the solid, and its derivative: φ^q without a minimum, so that a void
    /// has no weight. With q = 1, this is the mass of the material.
    pub fn mass(&self, density: f64) -> [f64; 2] {
        [density.powf(self.mass), power_slope(density, self.mass)]
    }

    /// Scaling of an element with a density in [0, 1].
    pub fn scaling(&self, density: f64) -> ElementScaling {
        let gamma = self.energy.map_or(1.0, |energy| energy.gamma(density.powf(self.simp.penalization)));
        let factor = self.simp.factor(density);
        let strength = self.of_strength().map_or(1.0, |own| own.factor(density) / factor);
        ElementScaling { factor, gamma, strength, bulk: density.powf(self.bulk) }
    }

    /// Its derivative with respect to the density.
    pub fn derivative(&self, density: f64) -> ElementScaling {
        let Simp { penalization: p, .. } = self.simp;
        let gamma = self.energy.map_or(0.0, |energy| energy.derivative(density.powf(p)) * power_slope(density, p));
        let (factor, slope) = (self.simp.factor(density), self.simp.derivative(density));
        let strength = self
            .of_strength()
            .map_or(0.0, |own| (own.derivative(density) - own.factor(density) / factor * slope) / factor);
        ElementScaling { factor: slope, gamma, strength, bulk: power_slope(density, self.bulk) }
    }

    /// The scaling of the yield stress, if it has a power of its own.
    fn of_strength(&self) -> Option<Simp> {
        self.strength.map(|own| Simp { penalization: own, ..self.simp })
    }
}

/// d φ^q/dφ; 0⁰ counts as 1.
fn power_slope(density: f64, power: f64) -> f64 {
    if power == 1.0 { 1.0 } else { power * density.powf(power - 1.0) }
}

impl From<Simp> for Interpolation {
    fn from(simp: Simp) -> Self {
        Self { simp, energy: None, strength: None, bulk: Self::BULK, mass: 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interpolation(penalization: f64, energy: EnergyInterpolation) -> Interpolation {
        Interpolation { energy: Some(energy), ..Simp { penalization, minimum: 1e-3 }.into() }
    }

    #[test]
    fn derivatives_of_the_scaling_match_differences() {
        let soft = EnergyInterpolation { threshold: 0.2, sharpness: 8.0 };
        for (energy, densities) in [(EnergyInterpolation::PUBLISHED, [0.1, 0.2, 0.24]), (soft, [0.1, 0.5, 0.9])] {
            for penalization in [1.0, 2.5, 3.0] {
                let law = interpolation(penalization, energy);
                for density in densities {
                    let h = 1e-5;
                    let at = |s: f64| law.scaling(density + s * h).gamma;
                    let fd = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * h);
                    let found = law.derivative(density);
                    assert!((fd - found.gamma).abs() < 1e-8 * (1.0 + found.gamma.abs()), "{fd} {}", found.gamma);
                    assert_eq!(found.factor, law.simp.derivative(density));
                    let at = |s: f64| law.scaling(density + s * h).bulk;
                    let fd = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * h);
                    assert!((fd - found.bulk).abs() < 1e-8, "{fd} {}", found.bulk);
                }
            }
        }
    }

    /// Empty elements are linear, solid ones are unchanged, and the midpoint is at φ^p = η, where
    /// tanh βη ≈ 1.
    #[test]
    fn limits_of_the_energy_interpolation() {
        let law = interpolation(3.0, EnergyInterpolation::PUBLISHED);
        assert_eq!(law.scaling(0.0), ElementScaling { factor: 1e-3, gamma: 0.0, strength: 1.0, bulk: 0.0 });
        assert_eq!(law.scaling(1.0), ElementScaling::SOLID);
        assert_eq!((law.scaling(0.4).gamma, law.derivative(0.4).gamma), (1.0, 0.0));
        assert!((law.scaling(0.01_f64.cbrt()).gamma - 0.5).abs() < 1e-4);
        let plain = Interpolation::from(law.simp);
        assert_eq!((plain.scaling(0.0).gamma, plain.derivative(0.2).gamma), (1.0, 0.0));
    }
}
