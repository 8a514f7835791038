//! The columns of the history of an optimization: the one list of their names and values.

use super::IterationRecord;

/// A number in the history.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Entry {
    /// A whole number.
    Count(usize),
    /// A number.
    Number(f64),
    /// None at this design.
    Missing,
}

/// A column: its name, and its value at a design.
pub type Column = (&'static str, fn(&IterationRecord) -> Entry);

/// The columns that every history has. [`IterationRecord`] says what they mean; `open`, `stick` and `slip`
/// are its `status`.
pub const COLUMNS: [Column; 15] = [
    ("iteration", |at| Entry::Count(at.iteration)),
    ("objective", |at| Entry::Number(at.objective)),
    ("volume_fraction", |at| Entry::Number(at.volume_fraction)),
    ("change", |at| at.change.into()),
    ("optimality", |at| at.optimality.into()),
    ("violation", |at| Entry::Number(at.violation)),
    ("discreteness", |at| Entry::Number(at.discreteness)),
    ("newton_iterations", |at| Entry::Count(at.newton_iterations)),
    ("uzawa_iterations", |at| Entry::Count(at.uzawa_iterations)),
    ("increments", |at| Entry::Count(at.increments)),
    ("open", |at| Entry::Count(at.status[0])),
    ("stick", |at| Entry::Count(at.status[1])),
    ("slip", |at| Entry::Count(at.status[2])),
    ("halvings", |at| Entry::Count(at.halvings)),
    ("inner_iterations", |at| Entry::Count(at.inner_iterations)),
];

/// The last column: the wall time of an iteration, which no record holds. \[s\]
pub const SECONDS: &str = "seconds";

impl From<Option<f64>> for Entry {
    fn from(value: Option<f64>) -> Self {
        value.map_or(Self::Missing, Self::Number)
    }
}
