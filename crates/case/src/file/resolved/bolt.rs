//! Bolts: bodies that are cut and pulled together.

use schemars::JsonSchema;
use serde::Serialize;
pub use slipstick_model::model::{Keeps, PreloadPoint};

/// A body that is cut, so that a force pulls both parts together.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Bolt {
    /// Unique name; also a set, whose displacement x is the distance by which the parts overlap.
    pub name: String,
    /// The body.
    pub body: String,
    /// Where it is cut.
    pub section: BoltSection,
    /// Waypoints of the force, linear in between, from 0 at t = 0.
    pub force: Vec<PreloadPoint>,
    /// What happens after the last one.
    pub keeps: Keeps,
}

/// The plane along which a bolt is cut.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct BoltSection {
    /// A point in the plane. \[L\]
    pub point: [f64; 3],
    /// Its normal, along the bolt.
    pub normal: [f64; 3],
    /// Nodes farther from the point stay joined. \[L\]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
}
