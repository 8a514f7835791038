//! One number compared with an external reference.

use serde::{Deserialize, Serialize};

/// The expected value of a number, and the allowed deviation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Expected {
    /// A value, with a bound on the relative deviation.
    Value { value: f64, within: f64 },
    /// A band, ends included.
    Band { low: f64, high: f64 },
    /// At most this magnitude: an error or a ratio that should be zero.
    AtMost(f64),
    /// A value for comparison, if the deviation itself is the finding: steps of a convergence
    /// study, and known deviations that the text of the chapter explains.
    Compare(f64),
    /// No expectation: a number that explains others.
    Shown,
}

/// A number that the program found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// The quantity, in the terms of the field.
    pub what: String,
    /// The expected value.
    pub expected: Expected,
    /// The value found.
    pub found: f64,
    /// Whether it is known to lie outside its bound, and the chapter's remarks say why.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub known: bool,
}

impl Finding {
    /// A number that should be `value`, up to a relative deviation of `within`.
    pub fn value(what: impl Into<String>, value: f64, within: f64, found: f64) -> Self {
        Self { what: what.into(), expected: Expected::Value { value, within }, found, known: false }
    }

    /// A number in a band.
    pub fn band(what: impl Into<String>, [low, high]: [f64; 2], found: f64) -> Self {
        Self { what: what.into(), expected: Expected::Band { low, high }, found, known: false }
    }

    /// A number that should be zero, up to `most`.
    pub fn at_most(what: impl Into<String>, most: f64, found: f64) -> Self {
        Self { what: what.into(), expected: Expected::AtMost(most), found, known: false }
    }

    /// A number for comparison with `value`.
    pub fn compare(what: impl Into<String>, value: f64, found: f64) -> Self {
        Self { what: what.into(), expected: Expected::Compare(value), found, known: false }
    }

    /// A number without an expectation.
    pub fn shown(what: impl Into<String>, found: f64) -> Self {
        Self { what: what.into(), expected: Expected::Shown, found, known: false }
    }

    /// The same number, known to lie outside its bound.
    pub fn known(self) -> Self {
        Self { known: true, ..self }
    }

    /// Whether the number satisfies the expectation. NaN never does.
    pub fn holds(&self) -> bool {
        match self.expected {
            Expected::Value { value, within } => (self.found / value - 1.0).abs() <= within,
            Expected::Band { low, high } => (low..=high).contains(&self.found),
            Expected::AtMost(most) => self.found.abs() <= most,
            Expected::Compare(_) | Expected::Shown => self.found.is_finite(),
        }
    }

    /// Relative deviation; from the nearer end of a band, 0 inside; `None` where zero is expected.
    pub fn deviation(&self) -> Option<f64> {
        match self.expected {
            Expected::Value { value, .. } | Expected::Compare(value) => Some(self.found / value - 1.0),
            Expected::Band { low, high } => {
                let nearest = self.found.clamp(low, high);
                Some(if nearest == self.found { 0.0 } else { (self.found - nearest) / nearest.abs() })
            }
            Expected::AtMost(_) | Expected::Shown => None,
        }
    }
}
