//! The surfaces of faces: planes, cylinders, cones, spheres, tori and bilinear ones.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector, Vector3};
use slipstick_mesh::Shape;

use super::seams::Frame;

pub(super) type V = Vector3<f64>;

/// How much larger than its tube the circle of a torus is at least.
const CLOSED: f64 = 1e-6;

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
    /// All points at `tube` from the circle of `radius` around `centre`, normal to the unit vector `axis`; the circle is larger
    /// than the tube.
    Torus { centre: V, axis: V, radius: f64, tube: f64 },
    /// Bilinear between four corners, counter-clockwise seen from where its normal points.
    Bilinear { corners: [V; 4] },
}

impl Surface {
    /// The surface of a shape; `None` for a torus that meets its axis, and for numbers that are not finite.
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
            Shape::Torus { radius, tube, .. } if !(radius > (1.0 + CLOSED) * tube) => return None,
            Shape::Torus { centre, axis, radius, tube } => {
                (Self::Torus { centre, axis, radius, tube }, [radius, tube, centre.sum(), axis.sum()])
            }
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
            Self::Torus { centre, axis, radius, tube } => {
                let along = (x - centre).dot(axis);
                ((x - centre - axis * along).norm() - radius).hypot(along) - tube
            }
            Self::Bilinear { corners } => (x - above(corners, x)).dot(&self.normal(x)),
        }
    }

    /// The gradient of the distance at a point: the unit normal, away from axis or centre, or from the circle within a torus; of
    /// a bilinear surface that of its diagonals.
    pub fn normal(&self, x: &V) -> V {
        match self {
            Self::Plane { normal, .. } => *normal,
            Self::Sphere { centre, .. } => (x - centre).try_normalize(0.0).unwrap_or_default(),
            Self::Cone { point, axis, slope, .. } => {
                let arm = x - point;
                let out = (arm - axis * arm.dot(axis)).try_normalize(0.0).unwrap_or_default();
                (out - axis * *slope) / (1.0 + slope * slope).sqrt()
            }
            Self::Torus { centre, axis, radius, .. } => {
                let arm = x - centre;
                let out = (arm - axis * arm.dot(axis)).try_normalize(0.0).unwrap_or_default();
                (arm - out * *radius).try_normalize(0.0).unwrap_or_default()
            }
            Self::Bilinear { corners: [a, b, c, d] } => (c - a).cross(&(d - b)).try_normalize(0.0).unwrap_or_default(),
        }
    }

    /// Whether its faces have straight sides.
    pub fn has_straight_sides(&self) -> bool {
        matches!(self, Self::Plane { .. } | Self::Bilinear { .. })
    }

    /// The centre and the radius of the circle in the half plane of a point; `None` for planes and cones.
    fn section(&self, x: &V) -> Option<(V, f64)> {
        match self {
            Self::Sphere { centre, radius } => Some((*centre, *radius)),
            Self::Torus { centre, axis, radius, tube } => {
                let arm = x - centre;
                let out = (arm - axis * arm.dot(axis)).try_normalize(0.0)?;
                Some((centre + out * *radius, *tube))
            }
            Self::Plane { .. } | Self::Cone { .. } | Self::Bilinear { .. } => None,
        }
    }

    /// The area within a closed loop of points, positive if counter-clockwise seen from where the normal points: in a
    /// plane twice the area \[L²\]; otherwise that of the angle about the axis of `frame` and the height along it \[rad L\], or of
    /// both angles of a torus, which ranks the loops of a face. Test: `a_window_is_no_outer_loop`.
    pub fn enclosed(&self, frame: Frame, points: &[V]) -> f64 {
        let next = |k: usize| points[(k + 1) % points.len()];
        let sum = |of: &dyn Fn(V, V) -> f64| (0..points.len()).map(|k| of(points[k], next(k))).sum();
        let (through, axis) = match (self, self.axis(), frame) {
            (Self::Plane { .. } | Self::Bilinear { .. }, ..) => {
                let normal = self.normal(&points[0]);
                return sum(&|p, q| (p - points[0]).cross(&(q - points[0])).dot(&normal));
            }
            (_, Some((through, axis)), Some([of_frame, _])) => (through, axis.unwrap_or(of_frame)),
            _ => return 0.0,
        };
        if let Self::Torus { radius, .. } = self {
            // the angle about the tube grows along the loop
            let angle = |x: &V| {
                let height = (x - through).dot(&axis);
                height.atan2((x - through - axis * height).norm() - radius)
            };
            let mut at = angle(&points[0]);
            return (0..points.len())
                .map(|k| {
                    let (p, q) = (points[k], next(k));
                    let by = (angle(&q) - angle(&p) + PI).rem_euclid(TAU) - PI;
                    at += by;
                    -turn(&(p - through), &(q - through), &axis) * (at - by / 2.0)
                })
                .sum();
        }
        sum(&|p, q| {
            let (p, q) = (p - through, q - through);
            -turn(&p, &q, &axis) * (p.dot(&axis) + q.dot(&axis)) / 2.0
        })
    }

    /// A point and the direction of the axis, if this is a surface of revolution; a sphere has every direction.
    pub fn axis(&self) -> Option<(V, Option<V>)> {
        match self {
            Self::Plane { .. } | Self::Bilinear { .. } => None,
            Self::Sphere { centre, .. } => Some((*centre, None)),
            Self::Cone { point, axis, .. } | Self::Torus { centre: point, axis, .. } => Some((*point, Some(*axis))),
        }
    }
}

/// The angle about an axis through the origin from one meridian to another. \[rad\]
fn turn(from: &V, to: &V, axis: &V) -> f64 {
    let [p, q] = [from, to].map(|x| x - axis * x.dot(axis));
    p.cross(&q).dot(axis).atan2(p.dot(&q))
}

/// The point of a bilinear surface whose projection along its normal is that of `x`, by Newton's method.
fn above([a, b, c, d]: &[V; 4], x: &V) -> V {
    let normal = (c - a).cross(&(d - b));
    let (mut u, mut v) = (0.5, 0.5);
    let at = |u: f64, v: f64| a * ((1.0 - u) * (1.0 - v)) + b * (u * (1.0 - v)) + c * (u * v) + d * ((1.0 - u) * v);
    for _ in 0..20 {
        let (along, across) = ((b - a) * (1.0 - v) + (c - d) * v, (d - a) * (1.0 - u) + (c - b) * u);
        let (off, size) = (x - at(u, v), along.cross(&across).dot(&normal));
        if size == 0.0 {
            break;
        }
        u += off.cross(&across).dot(&normal) / size;
        v += along.cross(&off).dot(&normal) / size;
    }
    at(u, v)
}

/// The point of all these surfaces near `x`, by Newton's method with the shortest steps; `None` if it is farther than
/// `reach` or not within `tolerance` of them.
pub(super) fn onto(x: &V, surfaces: &[Surface], reach: f64, tolerance: f64) -> Option<V> {
    let mut at = *x;
    let off = |at: &V| surfaces.iter().map(|s| s.distance(at).abs()).fold(0.0, f64::max);
    let (mut best, mut least) = (at, off(&at));
    for _ in 0..40 {
        if least == 0.0 {
            break;
        }
        let normals: Vec<V> = surfaces.iter().map(|s| s.normal(&at)).collect();
        let gram = DMatrix::from_fn(surfaces.len(), surfaces.len(), |i, j| normals[i].dot(&normals[j]));
        let residual = DVector::from_fn(surfaces.len(), |i, _| surfaces[i].distance(&at));
        // repeated planes leave the matrix singular; where surfaces touch, it becomes so, and each step halves the way
        let Ok(factors) = gram.svd(true, true).solve(&residual, 1e-13) else { break };
        at -= normals.iter().zip(factors.iter()).map(|(n, f)| n * *f).sum::<V>();
        let now = off(&at);
        if now < least {
            (best, least) = (at, now);
        } else if now > 0.9 * least && least <= tolerance {
            break;
        }
    }
    let at = touching(surfaces, &best, tolerance).unwrap_or(best);
    (least <= tolerance && (at - x).norm() <= reach).then_some(at)
}

/// Largest sine between the normals of surfaces that touch.
const TOUCHING: f64 = 1e-2;

/// How often a point on such a circle is moved onto further surfaces, at most.
const ROUNDS: usize = 60;

/// The point of surfaces near `x` if two of them touch. Newton's method finds where surfaces touch only to the square root
/// of the tolerance.
pub(super) fn touching(surfaces: &[Surface], x: &V, tolerance: f64) -> Option<V> {
    let pairs = (0..surfaces.len()).flat_map(|i| (0..i).map(move |j| [j, i]));
    pairs.into_iter().find_map(|[i, j]| {
        let others: Vec<&Surface> = (0..surfaces.len()).filter(|k| ![i, j].contains(k)).map(|k| &surfaces[k]).collect();
        let mut at = on_circle([&surfaces[i], &surfaces[j]], x, tolerance)?;
        for _ in 0..ROUNDS {
            let off: V = others.iter().map(|surface| surface.normal(&at) * surface.distance(&at)).sum();
            if off.norm() <= 1e-3 * tolerance {
                break;
            }
            at = on_circle([&surfaces[i], &surfaces[j]], &(at - off), tolerance)?;
        }
        others.iter().all(|surface| surface.distance(&at).abs() <= tolerance).then_some(at)
    })
}

/// The point near `x` of the circle along which a sphere or torus touches another surface.
fn on_circle(surfaces: [&Surface; 2], x: &V, tolerance: f64) -> Option<V> {
    let [first, second] = surfaces;
    if first.normal(x).cross(&second.normal(x)).norm() > TOUCHING {
        return None;
    }
    // the foot of the centre of one section on the other surface, or on the line to the centre of its section
    let beside = |round: &Surface, other: &Surface| {
        let (centre, radius) = round.section(x)?;
        match other.section(x) {
            Some((of_other, _)) => {
                let along = (of_other - centre).try_normalize(tolerance)?;
                Some(centre + along * (radius * (x - centre).dot(&along).signum()))
            }
            None => Some(centre - other.normal(x) * other.distance(&centre)),
        }
    };
    // the straight continuation of a bend
    let at_end = |torus: &Surface, cylinder: &Surface| match (torus, cylinder) {
        (Surface::Torus { centre, axis, radius, tube }, Surface::Cone { axis: along, slope: 0.0, .. }) => {
            let out = axis.cross(along);
            let middle = centre + out * (radius * (x - centre).dot(&out).signum());
            let arm = x - middle;
            Some(middle + (arm - along * arm.dot(along)).try_normalize(0.0)? * *tube)
        }
        _ => None,
    };
    let on_both = |at: &V| surfaces.iter().all(|surface| surface.distance(at).abs() <= tolerance);
    [beside(first, second), beside(second, first), at_end(first, second), at_end(second, first)]
        .into_iter()
        .flatten()
        .find(on_both)
}

/// A unit vector normal to a direction.
pub(super) fn across(direction: &V) -> V {
    let least = direction.iamin();
    direction.cross(&V::ith(least, 1.0)).normalize()
}
