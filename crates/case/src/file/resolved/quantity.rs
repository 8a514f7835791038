//! Named quantities, and the objective and constraints that are made of them.

use schemars::JsonSchema;
use serde::Serialize;

pub use crate::quantity::*;
pub use slipstick_design::{ObservedSteps, OverLoadCases};

/// A number that every state of the load path has: a column of `quantities.csv`, and what
/// objective and constraints are made of.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Quantity {
    /// Unique name.
    pub name: String,
    /// What charts call it; `None`: its name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub label: Option<String>,
    /// What it measures.
    #[serde(flatten)]
    pub kind: QuantityKind,
}

/// A quantity with a weight.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct QuantityTerm {
    /// Name of a `[[quantity]]`.
    pub quantity: String,
    /// Its factor.
    pub weight: f64,
}

/// A weighted sum of quantities over load steps, or the worst of them.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Combination {
    /// The quantities with their weights.
    pub sum: Vec<QuantityTerm>,
    /// The load steps in which they count.
    pub steps: ObservedSteps,
    /// Instead of the sum, the worst of all quantities and steps: the largest if minimized, the
    /// smallest if maximized.
    pub worst: bool,
}

/// Points that a quantity should pass through.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CurveToFollow {
    /// Name of a `[[quantity]]`.
    pub quantity: String,
    /// Pseudo-time and value of each point, with ascending times above 0.
    pub points: Vec<[f64; 2]>,
}

/// A bound on a quantity.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Constraint {
    /// Name of a `[[quantity]]`.
    pub quantity: String,
    /// The load steps at which it holds.
    pub steps: ObservedSteps,
    /// Bound from above, in units of the quantity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// Bound from below, in units of the quantity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// Whether the bound holds for the extreme itself where a smooth measure (`minimum`, `peak`,
    /// `stress`) errs on the unsafe side; `false`: for the smooth measure.
    #[serde(skip_serializing_if = "is_true")]
    pub corrected: bool,
}

fn is_true(value: &bool) -> bool {
    *value
}
