//! Load cases, and how they differ from the rest of the case.

use schemars::JsonSchema;
use serde::Serialize;

/// A load case: the same bodies and design on a separate load path that starts at rest. Friction,
/// moduli, motions, loads and positions may differ from the rest of the case.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct LoadCase {
    /// Unique name.
    pub name: String,
    /// Factor on its part of the objective, > 0.
    pub weight: f64,
    /// Coefficient of friction of all contact pairs, instead of their own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Factor on the Young's moduli of all bodies, > 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub modulus_factor: Option<f64>,
    /// Factor on all prescribed motions, translation and angle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion_factor: Option<f64>,
    /// Factor on all loads.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load_factor: Option<f64>,
    /// Single contact pairs that differ.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pairs: Vec<PairInCase>,
    /// Single bodies that differ.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub bodies: Vec<BodyInCase>,
    /// Single motions that differ.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub motions: Vec<MotionInCase>,
    /// Single loads that differ.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub loads: Vec<LoadInCase>,
}

/// A contact pair in a load case.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PairInCase {
    /// Its slave surface.
    pub slave: String,
    /// Its coefficient of friction.
    pub friction: f64,
}

/// A body in a load case.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct BodyInCase {
    /// Its name.
    pub body: String,
    /// Translation at the start of the load path, after the rotation. \[L\]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset: Option<[f64; 3]>,
    /// Rotation at the start of the load path.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation: Option<Turn>,
    /// Factor on its Young's modulus, > 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub modulus_factor: Option<f64>,
}

/// A rotation about an axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Turn {
    /// A point on the axis. \[L\]
    pub point: [f64; 3],
    /// The direction of the axis; its length does not matter.
    pub direction: [f64; 3],
    /// Degrees, right-handed about the direction.
    pub angle: f64,
}

/// The motions of a set in a load case.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct MotionInCase {
    /// The set of one or more `[[dirichlet]]`.
    pub set: String,
    /// Factor on translation and angle.
    pub factor: f64,
}

/// The loads of a surface in a load case.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LoadInCase {
    /// The surface of one or more `[[load]]`.
    pub surface: String,
    /// Factor on their values.
    pub factor: f64,
}
