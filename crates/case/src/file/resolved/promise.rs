//! Values that a design promised.

use schemars::JsonSchema;
use serde::Serialize;

use super::ObservedSteps;

/// The values of a quantity that a design promised at the end of each load case, or the worst over other
/// load steps; a run of its part is compared with them.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Promise {
    /// A column of `quantities.csv`.
    pub quantity: String,
    /// Its values, one for each load case, in the order of the case.
    pub values: Vec<f64>,
    /// Bound of the design from above, in units of the quantity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// Bound of the design from below, in units of the quantity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// Load steps of each load case over which the value is the worst one: the largest with `max`, the
    /// smallest with `min`.
    #[serde(skip_serializing_if = "Promise::is_at_the_end")]
    pub steps: ObservedSteps,
}

impl Promise {
    /// Whether these are only the last load steps.
    fn is_at_the_end(steps: &ObservedSteps) -> bool {
        *steps == ObservedSteps::Last
    }
}
