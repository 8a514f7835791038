//! The surfaces of faces: planes, cylinders, cones and spheres.

use nalgebra::{DMatrix, DVector, Vector3};
use slipstick_mesh::Shape;

use super::seams::Frame;

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
    /// The surface of a shape; `None` for a torus, whose facets stay facets, and for numbers that are not finite.
    pub fn of(shape: &Shape) -> Option<Self> {
        let (found, numbers) = match *shape {
            Shape::Sphere { centre, radius } => (Self::Sphere { centre, radius }, [radius, 0.0, centre.sum(), 0.0]),
            Shape::Cone { point, axis, radius, slope } => {
                // the axis points to where the radius grows
                let (axis, steep) = match shape.is_cylinder() {
                    true => (axis, 0.0),
                    false => (axis * slope.signum(), slope.abs()),
                };
                (Self::Cone { point, axis, radius, slope: steep }, [radius, slope, point.sum(), axis.sum()])
            }
            Shape::Torus { .. } => return None,
        };
        numbers.iter().all(|number| number.is_finite()).then_some(found)
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

    /// The area within a closed loop of points, positive if counter-clockwise seen from where the normal points: in a
    /// plane twice the area \[L²\]; otherwise that of the angle about the axis of `frame` and the height along it, which
    /// ranks the loops of a face \[rad L\]. Test: `a_window_is_no_outer_loop`.
    pub fn enclosed(&self, frame: Frame, points: &[V]) -> f64 {
        let next = |k: usize| points[(k + 1) % points.len()];
        let sum = |of: &dyn Fn(V, V) -> f64| (0..points.len()).map(|k| of(points[k], next(k))).sum();
        let (through, axis) = match (self, self.axis(), frame) {
            (Self::Plane { normal, .. }, ..) => {
                return sum(&|p, q| (p - points[0]).cross(&(q - points[0])).dot(normal));
            }
            (_, Some((through, axis)), Some([of_frame, _])) => (through, axis.unwrap_or(of_frame)),
            _ => return 0.0,
        };
        sum(&|p, q| {
            let (p, q) = (p - through, q - through);
            // the angle between the meridians of both points
            let (height, across) = ([p, q].map(|x| x.dot(&axis)), [p, q].map(|x| x - axis * x.dot(&axis)));
            let angle = across[0].cross(&across[1]).dot(&axis).atan2(across[0].dot(&across[1]));
            -angle * (height[0] + height[1]) / 2.0
        })
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
