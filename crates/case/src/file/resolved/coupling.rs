//! Couplings of faces to reference points.

use schemars::JsonSchema;
use serde::Serialize;

/// A reference point with displacement and rotation, to which the nodes of a face are coupled. Rotations must
/// be small: the coupling is linear.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Coupling {
    /// Unique name, which `[[dirichlet]]` and `[[load]]` use like that of a rigid body.
    pub name: String,
    /// Surface or node set.
    pub set: String,
    /// Position of the reference point. \[L\]
    pub at: [f64; 3],
    /// How the nodes are coupled.
    pub kind: CouplingKind,
}

/// How the nodes of a face are coupled to a reference point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CouplingKind {
    /// The point moves as the face does in the mean; a force on it is spread over the face.
    Distributing,
    /// All nodes move with the point, as parts of a rigid body.
    Kinematic,
}
