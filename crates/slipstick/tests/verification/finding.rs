//! One number against outside truth.

use serde::{Deserialize, Serialize};

/// What a number should be, and how far from it it may be.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Expected {
    /// A value, within a bound on the relative deviation.
    Value { value: f64, within: f64 },
    /// A band, ends included.
    Band { low: f64, high: f64 },
    /// At most so much in magnitude: an error or a ratio that should be zero.
    AtMost(f64),
    /// A value to compare with, where the deviation itself is the finding: steps of a convergence study, and known
    /// deviations that the text of the chapter explains.
    Compare(f64),
    /// Nothing: a number that explains others.
    Shown,
}

/// A number that the program found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// What, in words of the field.
    pub what: String,
    /// What it should be.
    pub expected: Expected,
    /// What it is.
    pub found: f64,
    /// Whether it is known to lie outside of its bound, and the chapter's remarks say why.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub known: bool,
}

impl Finding {
    /// A number that should be `value` up to `within`, relative.
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

    /// A number beside `value`.
    pub fn compare(what: impl Into<String>, value: f64, found: f64) -> Self {
        Self { what: what.into(), expected: Expected::Compare(value), found, known: false }
    }

    /// A number without an expectation.
    pub fn shown(what: impl Into<String>, found: f64) -> Self {
        Self { what: what.into(), expected: Expected::Shown, found, known: false }
    }

    /// The same, known to lie outside.
    pub fn known(self) -> Self {
        Self { known: true, ..self }
    }

    /// Whether the number is where it must be. NaN never is.
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
