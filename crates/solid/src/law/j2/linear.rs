//! Linear hardening.

use super::Hardening;
use crate::law::constants::ELASTIC;
use crate::law::{Constant, Form, MaterialError, Range, Real, Value};

/// σ_y = σ₀ + H α; H = 0 is perfect plasticity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear {
    initial: f64,
    modulus: f64,
}

/// Initial yield stress.
pub(super) const YIELD_STRESS: Constant = Constant {
    key: "yield_stress",
    about: "Initial yield stress σ₀ > 0, a true stress. [F/L²]",
    help: "the stress at which plastic strain begins",
    form: Form::Number(Range::Positive),
};

/// Slope of linear hardening.
pub(super) const HARDENING_MODULUS: Constant = Constant {
    key: "hardening_modulus",
    about: "Hardening modulus H ≥ 0: true stress per plastic strain; 0 is perfect plasticity. [F/L²]",
    help: "E Eₜ/(E − Eₜ) with the slope Eₜ of the stress-strain curve, or 0",
    form: Form::Number(Range::NotNegative),
};

impl Hardening for Linear {
    const CONSTANTS: &'static [Constant] = &[ELASTIC[0], ELASTIC[1], YIELD_STRESS, HARDENING_MODULUS];

    fn with_constants(values: &[Value]) -> Result<Self, MaterialError> {
        Ok(Self { initial: values[0].number(), modulus: values[1].number() })
    }

    fn values(&self) -> Vec<Value> {
        vec![self.initial.into(), self.modulus.into()]
    }

    fn like(youngs_modulus: f64) -> Self {
        Self { initial: 1e3 * youngs_modulus, modulus: youngs_modulus }
    }

    fn yield_stress<R: Real>(&self, strain: R) -> R {
        R::from(self.initial) + R::from(self.modulus) * strain
    }

    fn slope(&self, _: f64) -> f64 {
        self.modulus
    }

    fn work<R: Real>(&self, strain: R) -> R {
        (R::from(self.initial) + R::from(0.5 * self.modulus) * strain) * strain
    }

    fn rows(&self) -> (Vec<f64>, bool) {
        (vec![0.0, 10.0], true)
    }
}
