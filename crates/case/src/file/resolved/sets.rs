//! Surfaces and node sets that a case defines.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::Serialize;

use super::BoxRegion;

/// A surface: the boundary facets of a body that meet all conditions. At least one condition is
/// given.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
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
    /// Only facets with all nodes in this cylinder or on its mantle; on a mantle, only those whose
    /// normal is at least 45° from the axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cylinder: Option<Cylinder>,
    /// Only facets with all nodes in this ball or on its sphere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sphere: Option<Sphere>,
    /// Of the facets that meet the other conditions, those of one smooth face.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub connected: Option<Connected>,
}

/// The smooth face nearest to a point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Connected {
    /// The point. \[L\]
    pub to: [f64; 3],
    /// The face ends at edges at which the normals of two facets differ by more than this angle.
    pub degrees: f64,
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
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct NodeSet {
    /// Unique name, different from the names of all surfaces.
    pub name: String,
    /// Only nodes of this body; `None`: of all bodies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// Only nodes of this surface or earlier set; `None`: no condition.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub within: Option<String>,
    /// Only nodes in one of these boxes, bounds included; empty: no condition.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub boxes: Vec<BoxRegion>,
    /// Only nodes on this plane.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plane: Option<Plane>,
    /// Only nodes in this cylinder, or on its mantle.
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

/// A cylinder, ends and mantle included. \[L\]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Cylinder {
    /// One end of its axis.
    pub start: [f64; 3],
    /// The other end.
    pub end: [f64; 3],
    /// Its radius.
    pub radius: f64,
    /// Largest distance from the mantle, and beyond the ends; `None`: the solid cylinder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
}

impl Cylinder {
    /// Whether a point is in the solid cylinder or, with a tolerance, on the mantle.
    pub fn contains(&self, x: [f64; 3]) -> bool {
        let (along, across) = self.place(x);
        match self.tolerance {
            None => (0.0..=1.0).contains(&along) && across.norm_squared() <= self.radius * self.radius,
            Some(tolerance) => {
                let length = self.axis().norm();
                let (on, beyond) = ((across.norm() - self.radius).abs(), (-along).max(along - 1.0) * length);
                on <= tolerance && beyond <= tolerance
            }
        }
    }

    pub(crate) fn axis(&self) -> Vector3<f64> {
        Vector3::from(self.end) - Vector3::from(self.start)
    }

    /// Position along the axis, from 0 to 1 between its ends, and arm from the axis.
    fn place(&self, x: [f64; 3]) -> (f64, Vector3<f64>) {
        let (axis, arm) = (self.axis(), Vector3::from(x) - Vector3::from(self.start));
        let along = arm.dot(&axis) / axis.norm_squared();
        (along, arm - along * axis)
    }
}

/// A sphere. \[L\]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Sphere {
    /// Its centre.
    pub centre: [f64; 3],
    /// Its radius.
    pub radius: f64,
    /// Largest distance from the sphere; `None`: the whole ball.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
}

impl Sphere {
    /// Whether a point is in the ball or, with a tolerance, on the sphere.
    pub fn contains(&self, x: [f64; 3]) -> bool {
        let distance = (Vector3::from(x) - Vector3::from(self.centre)).norm() - self.radius;
        distance <= self.tolerance.unwrap_or(0.0) && self.tolerance.is_none_or(|tolerance| distance >= -tolerance)
    }
}
