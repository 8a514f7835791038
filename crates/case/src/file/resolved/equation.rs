//! Reference points, and linear equations among displacements.

use super::Component;
use schemars::JsonSchema;
use serde::Serialize;

/// A point that belongs to no body. What moves it: a `[[dirichlet]]`, equations and springs; components that
/// none of them has are held.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Point {
    /// Unique name, which other tables use like that of a set.
    pub name: String,
    /// Its position. \[L\]
    pub at: [f64; 3],
}

/// Linear equations among displacements, Σ a u = 0: one for each node of the sets, and for each component.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Equation {
    /// The terms.
    pub terms: Vec<EquationTerm>,
}

/// A term of an equation.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct EquationTerm {
    /// Surface, node set, `[[point]]`, or rigid body: its reference point.
    pub set: String,
    /// The component of the displacement; `None`: in all terms, for an equation for each of the three.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub component: Option<TermComponent>,
    /// a.
    pub factor: f64,
    /// Whether the term is the mean displacement of the set, over the reference area of a surface or over the
    /// nodes of a set; otherwise, each of its nodes has an equation.
    pub mean: bool,
}

/// A component of a displacement.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum TermComponent {
    /// An axis.
    Axis(Component),
    /// The component along a direction, whose length does not matter.
    Direction([f64; 3]),
}
