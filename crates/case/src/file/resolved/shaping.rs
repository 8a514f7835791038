//! Passive regions, and what makes a design symmetric, repeated, extruded or printable.

use std::fmt;

use schemars::JsonSchema;
use serde::Serialize;
use slipstick_model::words::{quantity, vector};

use super::{BoxRegion, Component, Cylinder};

/// A direction: an axis, or a vector whose length does not matter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Direction {
    /// Along an axis.
    Axis(Component),
    /// A vector, not zero.
    Vector([f64; 3]),
}

impl Direction {
    /// The direction as a vector.
    pub fn vector(self) -> [f64; 3] {
        match self {
            Self::Axis(axis) => std::array::from_fn(|k| if k == axis.index() { 1.0 } else { 0.0 }),
            Self::Vector(vector) => vector,
        }
    }
}

/// A part of the design bodies: the elements whose centroids lie in it, at their reference positions
/// after placement, bounds included. \[L\]
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Region {
    /// An axis-aligned box.
    Box {
        /// Lowest corner.
        min: [f64; 3],
        /// Highest corner; at or above `min` in every direction.
        max: [f64; 3],
    },
    /// A solid cylinder.
    Cylinder {
        /// One end of its axis.
        start: [f64; 3],
        /// The other end.
        end: [f64; 3],
        /// Its radius.
        radius: f64,
    },
    /// A solid cylinder without ends.
    EndlessCylinder {
        /// Direction of its axis.
        axis: Direction,
        /// A point on the axis.
        #[schemars(default)]
        through: [f64; 3],
        /// Its radius.
        radius: f64,
    },
    /// A ball.
    Ball {
        /// Its centre.
        centre: [f64; 3],
        /// Its radius.
        radius: f64,
    },
    /// All points close to a surface.
    NearSurface {
        /// Name of the surface.
        surface: String,
        /// Largest distance.
        within: f64,
    },
    /// All points close to a node set: to its nodes, and to the boundary facets whose nodes all
    /// belong to it.
    NearSet {
        /// Name of the set.
        set: String,
        /// Largest distance.
        within: f64,
    },
    /// A set of elements of a mesh file.
    Part {
        /// Name of the set, as `{body}_{set}`.
        part: String,
    },
    /// A whole body.
    Body {
        /// Its name.
        body: String,
    },
}

impl Region {
    /// Whether a point lies in the region; `None` if that depends on the mesh.
    pub fn contains(&self, point: [f64; 3]) -> Option<bool> {
        let near = |centre: [f64; 3], radius: f64| squared(difference(point, centre)) <= radius * radius;
        match *self {
            Self::Box { min, max } => Some(BoxRegion { min, max }.contains(point)),
            Self::Cylinder { start, end, radius } => {
                Some(Cylinder { start, end, radius, tolerance: None }.contains(point))
            }
            Self::EndlessCylinder { axis, through, radius } => {
                let (along, from) = (axis.vector(), difference(point, through));
                let share = dot(from, along) / squared(along);
                Some(near(std::array::from_fn(|k| through[k] + share * along[k]), radius))
            }
            Self::Ball { centre, radius } => Some(near(centre, radius)),
            Self::NearSurface { .. } | Self::NearSet { .. } | Self::Part { .. } | Self::Body { .. } => None,
        }
    }
}

/// In words: `box from [0, 0, 0] to [1, 1, 1]`.
impl fmt::Display for Region {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Box { min, max } => write!(f, "box from {} to {}", vector(*min), vector(*max)),
            Self::Cylinder { start, end, radius } => {
                write!(f, "cylinder from {} to {}, radius {}", vector(*start), vector(*end), quantity(*radius))
            }
            Self::EndlessCylinder { axis, through, radius } => {
                let (axis, through) = (vector(axis.vector()), vector(*through));
                write!(f, "cylinder along {axis} through {through}, radius {}", quantity(*radius))
            }
            Self::Ball { centre, radius } => write!(f, "ball around {}, radius {}", vector(*centre), quantity(*radius)),
            Self::NearSurface { surface, within } => write!(f, "within {} of `{surface}`", quantity(*within)),
            Self::NearSet { set, within } => write!(f, "within {} of `{set}`", quantity(*within)),
            Self::Part { part } => write!(f, "part `{part}`"),
            Self::Body { body } => write!(f, "body `{body}`"),
        }
    }
}

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

fn squared(a: [f64; 3]) -> f64 {
    dot(a, a)
}

/// A motion that maps the design onto itself. \[L\]
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum DesignSymmetry {
    /// Reflection at a plane normal to an axis.
    Plane {
        /// The axis normal to the plane.
        normal: Component,
        /// Its coordinate along that axis.
        #[schemars(default)]
        at: f64,
        /// The body; `None`: all design bodies together.
        #[serde(skip_serializing_if = "Option::is_none")]
        body: Option<String>,
    },
    /// Reflection at any plane.
    InclinedPlane {
        /// The normal of the plane.
        normal: [f64; 3],
        /// A point on it.
        #[schemars(default)]
        through: [f64; 3],
        /// The body; `None`: all design bodies together.
        #[serde(skip_serializing_if = "Option::is_none")]
        body: Option<String>,
    },
    /// Rotation about an axis.
    Rotation {
        /// Direction of the axis.
        axis: Direction,
        /// A point on it.
        #[schemars(default)]
        through: [f64; 3],
        /// Number of equal sectors, at least 2.
        folds: usize,
        /// The body; `None`: all design bodies together.
        #[serde(skip_serializing_if = "Option::is_none")]
        body: Option<String>,
    },
}

impl DesignSymmetry {
    /// The body that has the symmetry; `None`: all design bodies together.
    pub fn body(&self) -> Option<&String> {
        match self {
            Self::Plane { body, .. } | Self::InclinedPlane { body, .. } | Self::Rotation { body, .. } => body.as_ref(),
        }
    }
}

/// Equal cells of a design.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Pattern {
    /// From each cell to the next; not zero. \[L\]
    pub step: [f64; 3],
    /// Number of cells, at least 2.
    pub count: usize,
    /// The body; `None`: all design bodies together.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
}

/// Overhang filter for additive manufacturing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Overhang {
    /// Direction in which the layers are stacked.
    pub direction: BuildDirection,
}

/// Direction in which the layers of a printed part are stacked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub enum BuildDirection {
    /// Along x.
    #[serde(rename = "x")]
    X,
    /// Along y.
    #[serde(rename = "y")]
    Y,
    /// Along z.
    #[serde(rename = "z")]
    Z,
    /// Against x.
    #[serde(rename = "-x")]
    MinusX,
    /// Against y.
    #[serde(rename = "-y")]
    MinusY,
    /// Against z.
    #[serde(rename = "-z")]
    MinusZ,
}

impl BuildDirection {
    /// The axis: 0, 1 or 2.
    pub fn axis(self) -> usize {
        match self {
            Self::X | Self::MinusX => 0,
            Self::Y | Self::MinusY => 1,
            Self::Z | Self::MinusZ => 2,
        }
    }

    /// Whether the layers are stacked against the axis.
    pub fn is_downwards(self) -> bool {
        matches!(self, Self::MinusX | Self::MinusY | Self::MinusZ)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_in_regions() {
        let inside = |region: &Region, points: &[[f64; 3]]| -> Vec<bool> {
            points.iter().map(|&point| region.contains(point).unwrap()).collect()
        };
        let cylinder = Region::Cylinder { start: [0.0; 3], end: [0.0, 0.0, 2.0], radius: 1.0 };
        let points = [[0.0; 3], [1.0, 0.0, 2.0], [0.8, 0.7, 1.0], [0.0, 0.0, 2.1], [0.5, 0.0, -0.1]];
        assert_eq!(inside(&cylinder, &points), [true, true, false, false, false]);
        let axis = Direction::Axis(Component::Z);
        let endless = Region::EndlessCylinder { axis, through: [0.0, 0.0, 9.0], radius: 1.0 };
        assert_eq!(inside(&endless, &points), [true, true, false, true, true]);
        let inclined =
            Region::EndlessCylinder { axis: Direction::Vector([1.0, 1.0, 0.0]), through: [0.0; 3], radius: 0.1 };
        assert_eq!(inside(&inclined, &[[5.0, 5.0, 0.05], [5.0, 4.8, 0.0]]), [true, false]);
        let ball = Region::Ball { centre: [1.0; 3], radius: 0.5 };
        assert_eq!(inside(&ball, &[[1.0, 1.5, 1.0], [1.4, 1.4, 1.0]]), [true, false]);
        let cuboid = Region::Box { min: [0.0; 3], max: [1.0; 3] };
        assert_eq!(inside(&cuboid, &[[1.0; 3], [1.1, 0.5, 0.5]]), [true, false]);
        assert_eq!(Region::Body { body: "plate".into() }.contains([0.0; 3]), None);
    }
}
