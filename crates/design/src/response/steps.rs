//! The load steps at which a response observes its quantities.

use crate::quantity::QuantityError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The user load steps at which a quantity is observed.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ObservedSteps {
    /// The last step only. Paper: (91) with `s = N`.
    #[default]
    Last,
    /// All steps. Paper: (96).
    All,
    /// The listed steps, from 1, ascending and unique.
    #[serde(untagged)]
    Only(Vec<usize>),
}

impl fmt::Display for ObservedSteps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Last => f.write_str("at the last load step"),
            Self::All => f.write_str("over all load steps"),
            Self::Only(steps) => {
                let steps: Vec<String> = steps.iter().map(usize::to_string).collect();
                write!(f, "at load step{} {}", if steps.len() == 1 { "" } else { "s" }, steps.join(", "))
            }
        }
    }
}

impl ObservedSteps {
    /// Whether step `step` (from 1) of `steps` is observed.
    pub fn contains(&self, step: usize, steps: usize) -> bool {
        match self {
            Self::Last => step == steps,
            Self::All => (1..=steps).contains(&step),
            Self::Only(list) => list.contains(&step),
        }
    }

    /// Checks the steps against the number of load steps.
    ///
    /// # Errors
    ///
    /// An empty list, a listed step outside `1..=steps`, or one that is listed twice.
    pub fn check(&self, steps: usize) -> Result<(), QuantityError> {
        let Self::Only(list) = self else {
            return Ok(());
        };
        if list.is_empty() {
            return Err(QuantityError::NoSteps);
        }
        for (position, &step) in list.iter().enumerate() {
            if !(1..=steps).contains(&step) {
                return Err(QuantityError::StepOutOfRange { step, steps });
            }
            if list[..position].contains(&step) {
                return Err(QuantityError::DuplicateStep { step });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn observed_steps() {
        let observed = |choice: &ObservedSteps| (1..=4).filter(|&step| choice.contains(step, 4)).collect::<Vec<_>>();
        assert_eq!(observed(&ObservedSteps::Last), [4]);
        assert_eq!(observed(&ObservedSteps::All), [1, 2, 3, 4]);
        assert_eq!(observed(&ObservedSteps::Only(vec![3, 1])), [1, 3]);
        assert_eq!(ObservedSteps::Only(vec![1, 5]).check(4), Err(QuantityError::StepOutOfRange { step: 5, steps: 4 }));
        assert_eq!(ObservedSteps::Only(vec![0]).check(4), Err(QuantityError::StepOutOfRange { step: 0, steps: 4 }));
        assert_eq!(ObservedSteps::Only(vec![2, 2]).check(4), Err(QuantityError::DuplicateStep { step: 2 }));
        assert_eq!(ObservedSteps::Only(vec![]).check(4), Err(QuantityError::NoSteps));
        assert_eq!(ObservedSteps::Only(vec![4, 2]).check(4), Ok(()));
    }
}
