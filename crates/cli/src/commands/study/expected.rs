//! Expected numbers of runs, and expected ratios.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use serde::Deserialize;

use crate::setup::text;
use slipstick_service::failure::{Failure, Outcome};

/// Contents of a file of expected numbers.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expectations {
    /// A line for people.
    #[serde(rename = "about", default)]
    _about: String,
    /// Expected numbers by run and quantity.
    #[serde(default)]
    pub runs: BTreeMap<String, BTreeMap<String, Expected>>,
    /// Expected ratios of two numbers.
    #[serde(default)]
    pub ratios: Vec<Ratio>,
}

/// A ratio of two numbers.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ratio {
    /// Run and quantity.
    pub of: (String, String),
    /// Run and quantity of the denominator.
    pub to: (String, String),
    /// The expected ratio.
    pub is: Expected,
}

impl Ratio {
    /// Its name in tables next to the run of the numerator; the other run is named if it is
    /// different.
    pub fn name(&self) -> String {
        let [(run, quantity), (to_run, to)] = [&self.of, &self.to];
        if run == to_run { format!("{quantity} / {to}") } else { format!("{quantity} / {to} of {to_run}") }
    }
}

/// The expected value of a number.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expected {
    /// The value.
    pub value: Option<f64>,
    /// Allowed relative deviation.
    #[serde(default)]
    pub relative: f64,
    /// Allowed absolute deviation.
    #[serde(default)]
    pub absolute: f64,
    /// The largest allowed value.
    pub at_most: Option<f64>,
    /// The smallest allowed value.
    pub at_least: Option<f64>,
    /// The source of the expectation.
    pub source: String,
}

impl Expected {
    /// Whether a number is as expected; NaN never is.
    pub fn holds(&self, found: f64) -> bool {
        let near = |value: f64| (found - value).abs() <= self.absolute.max(self.relative * value.abs());
        found.is_finite()
            && self.value.is_none_or(near)
            && self.at_most.is_none_or(|most| found <= most)
            && self.at_least.is_none_or(|least| found >= least)
    }
}

impl fmt::Display for Expected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts = Vec::new();
        if let Some(value) = self.value {
            parts.push(format!("{value} ± {:.1e}", self.absolute.max(self.relative * value.abs())));
        }
        parts.extend(self.at_least.map(|least| format!("at least {least}")));
        parts.extend(self.at_most.map(|most| format!("at most {most}")));
        write!(f, "expected {} ({})", parts.join(", "), self.source)
    }
}

impl Expectations {
    /// Reads a file of expected numbers.
    ///
    /// # Errors
    /// [`Failure::Input`] if the file cannot be read, and for an entry without any expectation.
    pub fn read(path: &Path) -> Outcome<Self> {
        let cure = "docs/studies.md describes the file of expected numbers";
        let file: Self = serde_json::from_str(&text(path)?)
            .map_err(|error| Failure::input(format!("{}: {error}", path.display()), cure))?;
        let numbers =
            file.runs.iter().flat_map(|(run, all)| all.iter().map(move |(name, one)| (run, name.clone(), one)));
        let ratios = file.ratios.iter().map(|ratio| (&ratio.of.0, ratio.name(), &ratio.is));
        let empty = |one: &Expected| one.value.is_none() && one.at_most.is_none() && one.at_least.is_none();
        if let Some((run, name, _)) = numbers.chain(ratios).find(|(.., one)| empty(one)) {
            let message = format!("{}: {run}: {name} has none of value, at_most and at_least", path.display());
            return Err(Failure::input(message, cure));
        }
        Ok(file)
    }

    /// The runs with expectations, each once.
    pub fn names(&self) -> Vec<&String> {
        let of_ratios = self.ratios.iter().flat_map(|ratio| [&ratio.of.0, &ratio.to.0]);
        let mut names: Vec<&String> = self.runs.keys().chain(of_ratios).collect();
        names.sort_unstable();
        names.dedup();
        names
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_compared() {
        let read = |text: &str| serde_json::from_str::<Expected>(text).expect("right");
        let near = read(r#"{ "value": -2, "relative": 0.1, "source": "by hand" }"#);
        assert!(near.holds(-2.19) && near.holds(-1.81) && !near.holds(-2.21) && !near.holds(f64::NAN));
        let between = read(r#"{ "at_least": 0, "at_most": 1, "source": "by hand" }"#);
        assert!(between.holds(0.0) && between.holds(1.0) && !between.holds(1.1) && !between.holds(-0.1));
    }

    #[test]
    fn ratios_are_named() {
        let ratio = |to: &str| -> Ratio {
            let text =
                format!(r#"{{ "of": ["a", "x at 1"], "to": ["{to}", "x"], "is": {{ "value": 1, "source": "" }} }}"#);
            serde_json::from_str(&text).expect("right")
        };
        assert_eq!([ratio("a").name(), ratio("b").name()], ["x at 1 / x", "x at 1 / x of b"]);
    }
}
