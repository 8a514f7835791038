//! Swift's hardening.

use super::Hardening;
use super::linear::YIELD_STRESS;
use crate::law::constants::ELASTIC;
use crate::law::{Constant, Form, MaterialError, Range, Real, Value};

/// σ_y = σ₀ (1 + α/ε₀)ⁿ, which is K (ε₀ + α)ⁿ with K = σ₀/ε₀ⁿ.
///
/// Reference: Swift, J. Mech. Phys. Solids 1 (1952) 1–18.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swift {
    initial: f64,
    reference: f64,
    exponent: f64,
}

impl Swift {
    /// (1 + α/ε₀)^exponent.
    fn power<R: Real>(&self, strain: R, exponent: f64) -> R {
        let one = R::from(1.0);
        (R::from(exponent) * (one + R::from(1.0 / self.reference) * strain).ln()).exp_m1() + one
    }
}

impl Hardening for Swift {
    const CONSTANTS: &'static [Constant] = &[
        ELASTIC[0],
        ELASTIC[1],
        YIELD_STRESS,
        Constant {
            key: "reference_strain",
            about: "Strain ε₀ > 0 by which the plastic strain is divided.",
            help: "for metals about 0.001 to 0.02; with σ_y = K (ε₀ + α)ⁿ, the yield stress is K ε₀ⁿ",
            form: Form::Number(Range::Positive),
        },
        Constant {
            key: "hardening_exponent",
            about: "Exponent 0 < n < 1.",
            help: "for metals about 0.05 to 0.5",
            form: Form::Number(Range::Between(0.0, 1.0, "for metals about 0.05 to 0.5")),
        },
    ];

    fn with_constants(values: &[Value]) -> Result<Self, MaterialError> {
        let [initial, reference, exponent] = [0, 1, 2].map(|i| values[i].number());
        Ok(Self { initial, reference, exponent })
    }

    fn values(&self) -> Vec<Value> {
        [self.initial, self.reference, self.exponent].map(Value::from).to_vec()
    }

    fn like(youngs_modulus: f64) -> Self {
        Self { initial: 1e3 * youngs_modulus, reference: 0.01, exponent: 0.2 }
    }

    fn yield_stress<R: Real>(&self, strain: R) -> R {
        R::from(self.initial) * self.power(strain, self.exponent)
    }

    fn slope(&self, strain: f64) -> f64 {
        self.initial * self.exponent / self.reference * self.power(strain, self.exponent - 1.0)
    }

    fn work<R: Real>(&self, strain: R) -> R {
        let next = self.exponent + 1.0;
        R::from(self.initial * self.reference / next) * (self.power(strain, next) - R::from(1.0))
    }

    fn rows(&self) -> (Vec<f64>, bool) {
        // at equal ratios of ε₀ + α up to a strain of 1, and one more row far beyond
        let ratio = (1.0 + 1.0 / self.reference).ln() / 30.0;
        let strain = |k: i32| self.reference * (ratio * f64::from(k)).exp_m1();
        ((0..31).map(strain).chain([10.0]).collect(), false)
    }
}
