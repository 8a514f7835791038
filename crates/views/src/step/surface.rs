//! The surfaces of faces: planes, cylinders, cones and spheres.

use nalgebra::{DMatrix, DVector, Vector3};
use slipstick_mesh::Shape;

pub(super) type V = Vector3<f64>;

/// A surface on which faces lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Surface {
    /// Through `origin`, with a unit normal.
    Plane { origin: V, normal: V },
    /// The radius at a distance `s` along the unit vector `axis` from `point` is `radius` + `slope` s; a cylinder has
    /// the slope zero.
    Cone { point: V, axis: V, radius: f64, slope: f64 },
    /// All points at `radius` from `centre`.
    Sphere { centre: V, radius: f64 },
}

impl Surface {
    /// The surface of a shape; `None` for a torus, whose facets stay facets.
    pub fn of(shape: &Shape) -> Option<Self> {
        match *shape {
            Shape::Sphere { centre, radius } => Some(Self::Sphere { centre, radius }),
            Shape::Cone { point, axis, radius, .. } if shape.is_cylinder() => {
                Some(Self::Cone { point, axis, radius, slope: 0.0 })
            }
            // the axis points to where the radius grows
            Shape::Cone { point, axis, radius, slope } => {
                Some(Self::Cone { point, axis: axis * slope.signum(), radius, slope: slope.abs() })
            }
            Shape::Torus { .. } => None,
        }
    }

    /// Distance of a point from the surface, positive on the side of its normal. \[L\]
    pub fn distance(&self, x: &V) -> f64 {
        match self {
            Self::Plane { origin, normal } => (x - origin).dot(normal),
            Self::Sphere { centre, radius } => (x - centre).norm() - radius,
            Self::Cone { point, axis, radius, slope } => {
                let along = (x - point).dot(axis);
                let from = (x - point - axis * along).norm();
                (from - radius - slope * along) / (1.0 + slope * slope).sqrt()
            }
        }
    }

    /// The gradient of the distance at a point: the unit normal, away from axis or centre.
    pub fn normal(&self, x: &V) -> V {
        match self {
            Self::Plane { normal, .. } => *normal,
            Self::Sphere { centre, .. } => (x - centre).try_normalize(0.0).unwrap_or_default(),
            Self::Cone { point, axis, slope, .. } => {
                let arm = x - point;
                let out = (arm - axis * arm.dot(axis)).try_normalize(0.0).unwrap_or_default();
                (out - axis * *slope) / (1.0 + slope * slope).sqrt()
            }
        }
    }

    /// A point and the direction of the axis, if this is a surface of revolution; a sphere has every direction.
    pub fn axis(&self) -> Option<(V, Option<V>)> {
        match self {
            Self::Plane { .. } => None,
            Self::Sphere { centre, .. } => Some((*centre, None)),
            Self::Cone { point, axis, .. } => Some((*point, Some(*axis))),
        }
    }
}

/// The point of all these surfaces near `x`, by Newton's method with the shortest steps; `None` if it is farther than
/// `reach` or not within `tolerance` of them.
pub(super) fn onto(x: &V, surfaces: &[Surface], reach: f64, tolerance: f64) -> Option<V> {
    let mut at = *x;
    let off = |at: &V| surfaces.iter().map(|s| s.distance(at).abs()).fold(0.0, f64::max);
    let (mut best, mut least) = (at, off(&at));
    for _ in 0..20 {
        if least == 0.0 {
            break;
        }
        let normals: Vec<V> = surfaces.iter().map(|s| s.normal(&at)).collect();
        let gram = DMatrix::from_fn(surfaces.len(), surfaces.len(), |i, j| normals[i].dot(&normals[j]));
        let residual = DVector::from_fn(surfaces.len(), |i, _| surfaces[i].distance(&at));
        // surfaces that touch, and repeated planes, leave the matrix singular
        let Ok(factors) = gram.svd(true, true).solve(&residual, 1e-6) else { break };
        at -= normals.iter().zip(factors.iter()).map(|(n, f)| n * *f).sum::<V>();
        let now = off(&at);
        if now < least {
            (best, least) = (at, now);
        } else if now > 0.9 * least && least <= tolerance {
            break;
        }
    }
    (least <= tolerance && (best - x).norm() <= reach).then_some(best)
}

/// A unit vector normal to a direction.
pub(super) fn across(direction: &V) -> V {
    let least = direction.iamin();
    direction.cross(&V::ith(least, 1.0)).normalize()
}
