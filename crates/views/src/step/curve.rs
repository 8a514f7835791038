//! The curves of edges: where two surfaces meet.

use super::surface::{Surface, V, onto};

/// Cosine between plane and axis below which the plane is parallel to the axis.
const PARALLEL: f64 = 1e-9;

/// Cosine between the normal of a plane and the axis of a cylinder below which their ellipse is so long that it is
/// written as a spline.
const LONG: f64 = 0.05;

/// Points of an arc that must lie on its surfaces.
const SAMPLES: usize = 16;

/// How many tolerances a spline may be from its surfaces between its points: with fewer, it needs twice as many, and
/// files become a tenth larger.
const SPLINED: f64 = 20.0;

/// Most bisections of a segment of a spline.
const BISECTIONS: usize = 5;

/// A curve from one vertex to another.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Curve {
    /// The straight line.
    Line,
    /// Counter-clockwise about `normal`; `semi` are the half axes along `major` and normal to it, equal for a circle.
    Conic { centre: V, normal: V, major: V, semi: [f64; 2] },
    /// A cubic spline through points with unit tangents; its parameter grows by the distance between points.
    Spline { points: Vec<V>, tangents: Vec<V> },
}

/// The curve along which two surfaces meet, through `points`, which lie on both: its first and its last point, and
/// those in between. Within `tolerance` \[L\] of both surfaces, splines within [`SPLINED`] times it.
pub(super) fn meeting(surfaces: [&Surface; 2], points: &[V], tolerance: f64) -> Curve {
    let (first, last) = (points[0], points[points.len() - 1]);
    let conic = |centre: V, normal: V, major: V, semi: [f64; 2]| {
        let curve = Curve::Conic { centre, normal, major, semi };
        match curve.turn(points) > 0.0 {
            true => curve,
            false => Curve::Conic { centre, normal: -normal, major, semi },
        }
    };
    let circle = |centre: V, normal: V| {
        let arm = first - centre;
        conic(centre, normal, arm.normalize(), [arm.norm(); 2])
    };
    if surfaces.iter().all(|surface| surface.has_straight_sides()) {
        return Curve::Line;
    }
    match surfaces {
        [Surface::Cone { point, axis, .. }, Surface::Cone { .. }] if surfaces[0] == surfaces[1] => {
            within(surfaces[0], (*point, *axis), points, tolerance)
        }
        [Surface::Sphere { centre, .. }, Surface::Sphere { .. }] if surfaces[0] == surfaces[1] => {
            circle(*centre, (first - centre).cross(&(points[1] - centre)).normalize())
        }
        [Surface::Plane { normal, origin }, Surface::Sphere { centre, .. }]
        | [Surface::Sphere { centre, .. }, Surface::Plane { normal, origin }] => {
            circle(centre - normal * (centre - origin).dot(normal), *normal)
        }
        [Surface::Plane { normal, origin }, Surface::Cone { point, axis, radius, slope }]
        | [Surface::Cone { point, axis, radius, slope }, Surface::Plane { normal, origin }] => {
            let along = normal.dot(axis);
            let side = (point - origin).dot(normal);
            if along.abs() > 1.0 - 1e-14 || normal.cross(axis).norm() < PARALLEL {
                circle(point + axis * (first - point).dot(axis), *axis)
            } else if along.abs() < PARALLEL && (*slope == 0.0 || side.abs() < tolerance) {
                Curve::Line
            } else if *slope == 0.0 && along.abs() > LONG {
                let centre = point - axis * (side / along);
                let major = (axis - normal * along).normalize();
                conic(centre, *normal, major, [radius / along.abs(), *radius])
            } else {
                spline(surfaces, points, tolerance)
            }
        }
        [Surface::Plane { normal, .. }, Surface::Torus { centre, axis, .. }]
        | [Surface::Torus { centre, axis, .. }, Surface::Plane { normal, .. }]
            if normal.cross(axis).norm() < PARALLEL =>
        {
            circle(centre + axis * (first - centre).dot(axis), *axis)
        }
        _ if (last - first).norm() == 0.0 => Curve::Line,
        _ if surfaces[0] == surfaces[1] => {
            arc(surfaces, points, tolerance).unwrap_or_else(|| spline(surfaces, points, tolerance))
        }
        _ => match common_axis(surfaces, tolerance) {
            Some((point, axis)) => circle(point + axis * (first - point).dot(&axis), axis),
            None => arc(surfaces, points, tolerance).unwrap_or_else(|| spline(surfaces, points, tolerance)),
        },
    }
}

/// The curve between two faces on one cylinder or cone: a line or a circle if the points lie on one; otherwise, between
/// two points, the section with the plane through them along the normal.
fn within(surface: &Surface, (point, axis): (V, V), points: &[V], tolerance: f64) -> Curve {
    let (first, last) = (points[0], points[points.len() - 1]);
    let height = (first - point).dot(&axis);
    if points.iter().all(|x| ((x - point).dot(&axis) - height).abs() < tolerance) {
        let plane = Surface::Plane { origin: first, normal: axis };
        return meeting([&plane, surface], points, tolerance);
    }
    let middle = (first + last) / 2.0;
    if points.len() > 2 || surface.distance(&middle).abs() < tolerance {
        return Curve::Line;
    }
    match (last - first).cross(&surface.normal(&middle)).try_normalize(0.0) {
        Some(normal) => meeting([&Surface::Plane { origin: first, normal }, surface], points, tolerance),
        None => Curve::Line,
    }
}

/// The circle through points, if its arc between the first and the last lies on both surfaces.
fn arc(surfaces: [&Surface; 2], points: &[V], tolerance: f64) -> Option<Curve> {
    let (a, b) = (points[0], points[points.len() - 1]);
    let middle = match points.len() {
        2 => onto(&((a + b) / 2.0), &surfaces.map(|s| *s), (b - a).norm(), tolerance)?,
        count => points[count / 2],
    };
    let (p, q) = (middle - a, b - a);
    let normal = p.cross(&q);
    let to = (q * p.norm_squared() - p * q.norm_squared()).cross(&normal) / (2.0 * normal.norm_squared());
    if !(to.norm() < 1e3 * q.norm()) {
        return None;
    }
    let curve =
        Curve::Conic { centre: a + to, normal: normal.normalize(), major: -to.normalize(), semi: [to.norm(); 2] };
    let turn = curve.turn(&[a, middle, b]);
    let at = |k: usize| {
        let (sin, cos) = (turn * k as f64 / SAMPLES as f64).sin_cos();
        a + to - to * cos - normal.normalize().cross(&to) * sin
    };
    let lies = |x: V| surfaces.iter().all(|s| s.distance(&x).abs() < tolerance);
    (turn > 0.0 && (1..SAMPLES).all(|k| lies(at(k)))).then_some(curve)
}

/// The axis that two surfaces of revolution have in common.
fn common_axis(surfaces: [&Surface; 2], tolerance: f64) -> Option<(V, V)> {
    let [(p, a), (q, b)] = [surfaces[0].axis()?, surfaces[1].axis()?];
    let axis = match (a, b) {
        (Some(a), Some(b)) => (a.cross(&b).norm() < PARALLEL).then_some(a)?,
        (Some(a), None) | (None, Some(a)) => a,
        (None, None) => (q - p).try_normalize(tolerance)?,
    };
    let apart = q - p - axis * (q - p).dot(&axis);
    (apart.norm() < tolerance).then_some((p, axis))
}

/// A spline through points of both surfaces, as many as it needs.
fn spline(surfaces: [&Surface; 2], points: &[V], tolerance: f64) -> Curve {
    let both = surfaces.map(|s| *s);
    let mut on = points.to_vec();
    for _ in 0..BISECTIONS {
        let Some(tangents) = tangents(&both, &on) else { return Curve::Line };
        let middle = |k: usize| {
            let chord = (on[k + 1] - on[k]).norm();
            (on[k] + on[k + 1]) / 2.0 + (tangents[k] - tangents[k + 1]) * (chord / 8.0)
        };
        let off = |x: V| both.iter().map(|s| s.distance(&x).abs()).fold(0.0, f64::max);
        if (0..on.len() - 1).all(|k| off(middle(k)) < SPLINED * tolerance) {
            return Curve::Spline { points: on, tangents };
        }
        let mut finer = vec![on[0]];
        for pair in on.windows(2) {
            let chord = (pair[1] - pair[0]).norm();
            let Some(middle) = onto(&((pair[0] + pair[1]) / 2.0), &both, chord, tolerance) else { return Curve::Line };
            finer.extend([middle, pair[1]]);
        }
        on = finer;
    }
    match tangents(&both, &on) {
        Some(tangents) => Curve::Spline { points: on, tangents },
        None => Curve::Line,
    }
}

/// The unit tangents at the points of a curve, along it: where the surfaces touch, between the points beside.
fn tangents(both: &[Surface; 2], points: &[V]) -> Option<Vec<V>> {
    let last = points.len() - 1;
    (0..points.len())
        .map(|k| {
            let around = points[(k + 1).min(last)] - points[k.saturating_sub(1)];
            let normals = both.map(|surface| surface.normal(&points[k]));
            match normals[0].cross(&normals[1]).try_normalize(1e-3) {
                Some(direction) => Some(direction * direction.dot(&around).signum()),
                None => (around - normals[0] * around.dot(&normals[0])).try_normalize(0.0),
            }
        })
        .collect()
}

impl Curve {
    /// The angle through which points turn about a conic, positive if counter-clockwise; segments turn by less than π.
    pub fn turn(&self, points: &[V]) -> f64 {
        let Self::Conic { centre, normal, major, semi } = self else { return 0.0 };
        let minor = normal.cross(major);
        let angle = |x: &V| ((x - centre).dot(&minor) / semi[1]).atan2((x - centre).dot(major) / semi[0]);
        let (half, whole) = (std::f64::consts::PI, std::f64::consts::TAU);
        let step = |pair: &[V]| (angle(&pair[1]) - angle(&pair[0]) + half).rem_euclid(whole) - half;
        points.windows(2).map(step).sum()
    }

    /// Whether points lie on a conic within a tolerance; other curves pass through their points.
    pub fn passes(&self, points: &[V], tolerance: f64) -> bool {
        let Self::Conic { centre, normal, major, semi } = self else { return true };
        let minor = normal.cross(major);
        points.iter().all(|x| {
            let arm = x - centre;
            let radius = (arm.dot(major) / semi[0]).hypot(arm.dot(&minor) / semi[1]);
            arm.dot(normal).abs() < tolerance && (radius - 1.0).abs() * semi[1] < tolerance
        })
    }
}
