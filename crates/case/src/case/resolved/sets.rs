//! Surfaces and node sets that a case defines.

use schemars::JsonSchema;
use serde::Serialize;

use super::BoxRegion;

/// A surface: the boundary facets of a body that meet all conditions. At least one condition is
/// given.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SurfaceSet {
    /// Unique name, different from the names of all other surfaces and sets.
    pub name: String,
    /// The body; `None`: `of` lists surfaces, of any bodies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// The surfaces of which this one consists, without a body.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub of: Vec<String>,
    /// Only facets of this surface of the body; `None`: of its whole boundary.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub within: Option<String>,
    /// Only facets with all nodes in one of these boxes, bounds included; empty: no condition.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub boxes: Vec<BoxRegion>,
    /// Only facets whose outward normal is close to a direction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub normal: Option<NormalCone>,
}

/// Directions close to a given one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct NormalCone {
    /// The direction; need not be a unit vector, is not zero.
    pub direction: [f64; 3],
    /// Largest angle to it, between 0 and 180.
    pub degrees: f64,
}

/// A node set: the nodes that meet all conditions. At least one condition is given.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct NodeSet {
    /// Unique name, different from the names of all surfaces.
    pub name: String,
    /// Only nodes of this surface or earlier set; `None`: of all bodies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub within: Option<String>,
    /// Only nodes in one of these boxes, bounds included; empty: no condition.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub boxes: Vec<BoxRegion>,
    /// Only nodes on this plane.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plane: Option<Plane>,
    /// Only nodes in this solid cylinder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cylinder: Option<Cylinder>,
    /// Of the nodes that meet the other conditions, the one nearest to this point. \[L\]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nearest: Option<[f64; 3]>,
}

/// A plane with a tolerance. \[L\]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Plane {
    /// A point on it.
    pub point: [f64; 3],
    /// Its normal; need not be a unit vector, is not zero.
    pub normal: [f64; 3],
    /// Largest distance of a node from it; `None`: a millionth of the size of all bodies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
}

/// A solid cylinder, ends and mantle included. \[L\]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Cylinder {
    /// One end of its axis.
    pub start: [f64; 3],
    /// The other end.
    pub end: [f64; 3],
    /// Its radius.
    pub radius: f64,
}
