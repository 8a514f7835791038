//! Components and norms of vectors.

use schemars::JsonSchema;
use serde::Serialize;
use slipstick_design::quantity::{QuantityError, VectorMeasure};

/// A component of a vector, or its norm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum VectorComponent {
    /// An axis or the norm.
    Word(VectorWord),
    /// The component along a direction, whose length does not matter.
    Direction([f64; 3]),
}

/// An axis or the norm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum VectorWord {
    /// Along x.
    X,
    /// Along y.
    Y,
    /// Along z.
    Z,
    /// The norm.
    Norm,
}

/// How contact forces are reduced to one number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum ForceComponent {
    /// An axis, the norm, or a sum over the nodes.
    Word(ForceWord),
    /// The component along a direction, whose length does not matter.
    Direction([f64; 3]),
}

/// An axis, the norm, or a sum over the nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForceWord {
    /// Component of the resultant along x.
    X,
    /// Component of the resultant along y.
    Y,
    /// Component of the resultant along z.
    Z,
    /// Norm of the resultant.
    Norm,
    /// Sum of the normal forces.
    Normal,
    /// Sum of the magnitudes of the friction forces.
    Tangential,
    /// Sum of the magnitudes of the nodal forces, the paper's objective (91).
    Nodal,
}

impl ForceComponent {
    /// The same of the opposite force.
    pub(super) fn reversed(self) -> Self {
        match self {
            Self::Word(ForceWord::X) => Self::Direction([-1.0, 0.0, 0.0]),
            Self::Word(ForceWord::Y) => Self::Direction([0.0, -1.0, 0.0]),
            Self::Word(ForceWord::Z) => Self::Direction([0.0, 0.0, -1.0]),
            Self::Direction(direction) => Self::Direction(direction.map(|c| -c)),
            Self::Word(ForceWord::Norm | ForceWord::Normal | ForceWord::Tangential | ForceWord::Nodal) => self,
        }
    }
}

impl VectorComponent {
    /// The measure of a vector that it stands for.
    pub(super) fn measure(self) -> Result<VectorMeasure, QuantityError> {
        match self {
            Self::Direction(direction) => VectorMeasure::along(direction),
            Self::Word(VectorWord::X) => VectorMeasure::along([1.0, 0.0, 0.0]),
            Self::Word(VectorWord::Y) => VectorMeasure::along([0.0, 1.0, 0.0]),
            Self::Word(VectorWord::Z) => VectorMeasure::along([0.0, 0.0, 1.0]),
            Self::Word(VectorWord::Norm) => Ok(VectorMeasure::Norm),
        }
    }
}
