//! Voce's hardening.

use super::Hardening;
use super::linear::{HARDENING_MODULUS, YIELD_STRESS};
use crate::law::constants::ELASTIC;
use crate::law::{Constant, Form, MaterialError, Range, Real, Value};

/// σ_y = σ₀ + (σ_∞ − σ₀) (1 − e^(−δα)) + H α.
///
/// References: Voce, J. Inst. Metals 74 (1948) 537–562; with the linear term Simo, Armero, Int. J. Numer.
/// Methods Engrg. 33 (1992) 1413–1449.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Voce {
    initial: f64,
    saturation: f64,
    rate: f64,
    modulus: f64,
}

impl Hardening for Voce {
    const CONSTANTS: &'static [Constant] = &[
        ELASTIC[0],
        ELASTIC[1],
        YIELD_STRESS,
        Constant {
            key: "saturation_stress",
            about: "Yield stress σ_∞ ≥ σ₀ to which hardening leads without H. [F/L²]",
            help: "the yield stress at large plastic strains",
            form: Form::Number(Range::Positive),
        },
        Constant {
            key: "saturation_rate",
            about: "Rate δ > 0 of the saturation: 1/δ is a plastic strain.",
            help: "for metals about 10 to 20",
            form: Form::Number(Range::Positive),
        },
        HARDENING_MODULUS,
    ];

    fn with_constants(values: &[Value]) -> Result<Self, MaterialError> {
        let [initial, saturation, rate, modulus] = [0, 1, 2, 3].map(|i| values[i].number());
        if saturation < initial {
            let problem = format!("the saturation stress {saturation} is below the initial yield stress {initial}");
            return Err(MaterialError::new("saturation_stress", problem, "softening has no unique solution"));
        }
        Ok(Self { initial, saturation, rate, modulus })
    }

    fn values(&self) -> Vec<Value> {
        [self.initial, self.saturation, self.rate, self.modulus].map(Value::from).to_vec()
    }

    fn like(youngs_modulus: f64) -> Self {
        let initial = 1e3 * youngs_modulus;
        Self { initial, saturation: 2.0 * initial, rate: 10.0, modulus: youngs_modulus }
    }

    fn yield_stress<R: Real>(&self, strain: R) -> R {
        let decayed = (R::from(-self.rate) * strain).exp_m1();
        R::from(self.initial) + R::from(self.modulus) * strain - R::from(self.saturation - self.initial) * decayed
    }

    fn slope(&self, strain: f64) -> f64 {
        self.modulus + (self.saturation - self.initial) * self.rate * (-self.rate * strain).exp()
    }

    fn work<R: Real>(&self, strain: R) -> R {
        let range = self.saturation - self.initial;
        let decayed = (R::from(-self.rate) * strain).exp_m1();
        (R::from(self.saturation) + R::from(0.5 * self.modulus) * strain) * strain
            + R::from(range / self.rate) * decayed
    }

    fn rows(&self) -> (Vec<f64>, bool) {
        // denser at the start, up to eight times the decay and one more row far beyond
        let strain = |k: i32| (f64::from(k) / 30.0).powi(2) * 8.0 / self.rate;
        ((0..31).map(strain).chain([10.0 + 8.0 / self.rate]).collect(), false)
    }
}
