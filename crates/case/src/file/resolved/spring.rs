//! Springs.

use schemars::JsonSchema;
use serde::Serialize;

/// Linear springs from the nodes of a set to the ground, or to nodes of another set. They do not depend on
/// the design, and carry no force in the mesh.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Spring {
    /// Unique name.
    pub name: String,
    /// Surface, node set or rigid body: its reference point.
    pub set: String,
    /// Where the other ends are; `None`: the ground.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to: Option<SpringEnd>,
    /// The direction in which they act; `None`: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<SpringDirection>,
    /// The stiffness.
    #[serde(flatten)]
    pub stiffness: SpringStiffness,
}

/// The other ends of springs.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum SpringEnd {
    /// For each node, the nearest node of this surface or set, or the reference point of this rigid body.
    Set(String),
    /// A point that does not move. \[L\]
    Point([f64; 3]),
}

/// The direction in which a spring acts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum SpringDirection {
    /// A fixed direction, whose length does not matter.
    Fixed([f64; 3]),
    /// The line between the two nodes.
    Word(SpringLine),
}

/// The line between the two nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpringLine {
    /// It turns with the nodes.
    Line,
}

/// The stiffness of springs, > 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpringStiffness {
    /// Of all together: spread over the reference area of a surface, or evenly over the nodes of a set.
    /// \[F/L\]
    Stiffness(f64),
    /// Of each node. \[F/L\]
    NodalStiffness(f64),
    /// Per reference area of a surface: an elastic foundation, lumped at the nodes. \[F/L³\]
    StiffnessPerArea(f64),
}
