//! Spheres, cylinders, cones and tori, and their fit to the nodes of a surface.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Vector3, Vector6};
use std::fmt;

/// A surface of revolution that a mesh often approximates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// All points at `radius` from `centre`.
    Sphere {
        /// \[L\]
        centre: Vector3<f64>,
        /// \[L\]
        radius: f64,
    },
    /// All points whose distance from the axis through `point` along the unit vector `axis` is
    /// `radius` + `slope` · (position along the axis from `point`): a cylinder if the slope is zero.
    Cone {
        /// A point on the axis. \[L\]
        point: Vector3<f64>,
        /// Unit vector.
        axis: Vector3<f64>,
        /// Radius at `point`. \[L\]
        radius: f64,
        /// Change of the radius along the axis.
        slope: f64,
    },
    /// All points at `tube` from the circle of `radius` around `centre`, in the plane normal to the
    /// unit vector `axis`.
    Torus {
        /// \[L\]
        centre: Vector3<f64>,
        /// Unit vector.
        axis: Vector3<f64>,
        /// Radius of the circle. \[L\]
        radius: f64,
        /// Radius of the tube. \[L\]
        tube: f64,
    },
}

impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Sphere { radius, .. } => write!(f, "sphere of radius {}", short(radius)),
            Self::Cone { radius, .. } if self.is_cylinder() => {
                write!(f, "cylinder of radius {}", short(radius))
            }
            Self::Cone { slope, .. } => {
                write!(f, "cone with a half angle of {}°", short(slope.abs().atan().to_degrees()))
            }
            Self::Torus { radius, tube, .. } => write!(f, "torus of radii {} and {}", short(radius), short(tube)),
        }
    }
}

/// Four significant digits.
fn short(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// Distance from an axis, and the position along it.
fn cylindrical(x: &Vector3<f64>, point: &Vector3<f64>, axis: &Vector3<f64>) -> (f64, f64) {
    let arm = x - point;
    let along = arm.dot(axis);
    ((arm - axis * along).norm(), along)
}

impl Shape {
    /// Whether this is a cone whose radius does not change along its axis.
    pub fn is_cylinder(&self) -> bool {
        matches!(self, Self::Cone { slope, .. } if slope.abs() < 1e-9)
    }

    /// Distance of a point from the surface, with a sign that changes across it. \[L\]
    pub fn distance(&self, x: &Vector3<f64>) -> f64 {
        match self {
            Self::Sphere { centre, radius } => (x - centre).norm() - radius,
            Self::Cone { point, axis, radius, slope } => {
                let (from, along) = cylindrical(x, point, axis);
                (from - radius - slope * along) / (1.0 + slope * slope).sqrt()
            }
            Self::Torus { centre, axis, radius, tube } => {
                let (from, along) = cylindrical(x, centre, axis);
                (from - radius).hypot(along) - tube
            }
        }
    }

    /// Unit vector in which [`Self::distance`] grows at a point, by central differences over `step` \[L\]; zero where
    /// it grows in no direction, as at a centre.
    pub fn normal(&self, x: &Vector3<f64>, step: f64) -> Vector3<f64> {
        let slope = |c: usize| {
            let step = Vector3::ith(c, step);
            self.distance(&(x + step)) - self.distance(&(x - step))
        };
        Vector3::from_fn(|c, _| slope(c)).try_normalize(0.0).unwrap_or_default()
    }

    /// How far `x` is from the surface along the unit vector `along`, by the secant method; `None`
    /// if it is farther than `reach`.
    pub fn along(&self, x: &Vector3<f64>, along: &Vector3<f64>, reach: f64) -> Option<f64> {
        let (mut before, mut at) = (0.0, 1e-3 * reach);
        let (mut d_before, mut d_at) = (self.distance(x), self.distance(&(x + along * at)));
        for _ in 0..50 {
            if d_before == d_at || d_at.abs() <= 1e-15 * reach {
                break;
            }
            let next = at - d_at * (at - before) / (d_at - d_before);
            (before, d_before) = (at, d_at);
            at = next;
            if !(at.abs() <= reach) {
                return None;
            }
            d_at = self.distance(&(x + along * at));
        }
        (d_at.abs() <= 1e-9 * reach).then_some(at)
    }

    fn parameters(&self) -> Vec<f64> {
        match self {
            Self::Sphere { centre, radius } => vec![centre.x, centre.y, centre.z, *radius],
            Self::Cone { point: p, axis: a, radius: r, slope: s }
            | Self::Torus { centre: p, axis: a, radius: r, tube: s } => vec![p.x, p.y, p.z, a.x, a.y, a.z, *r, *s],
        }
    }

    /// The shape of the same kind with other parameters; `None` if its axis vanishes.
    fn with(&self, v: &[f64]) -> Option<Self> {
        let vector = |i: usize| Vector3::new(v[i], v[i + 1], v[i + 2]);
        Some(match self {
            Self::Sphere { .. } => Self::Sphere { centre: vector(0), radius: v[3] },
            Self::Cone { .. } => {
                Self::Cone { point: vector(0), axis: vector(3).try_normalize(1e-6)?, radius: v[6], slope: v[7] }
            }
            Self::Torus { .. } => {
                Self::Torus { centre: vector(0), axis: vector(3).try_normalize(1e-6)?, radius: v[6], tube: v[7] }
            }
        })
    }

    /// Largest distance of points from the surface. \[L\]
    pub fn residual(&self, points: &[Vector3<f64>]) -> f64 {
        points.iter().map(|x| self.distance(x).abs()).fold(0.0, f64::max)
    }

    /// The shape of this kind nearest to points of unit size, in the sense of least squares, by the
    /// method of Levenberg and Marquardt.
    fn refined(self, points: &[Vector3<f64>]) -> Option<Self> {
        let residuals = |shape: &Self| DVector::from_iterator(points.len(), points.iter().map(|x| shape.distance(x)));
        let (mut shape, mut damping) = (self, 1e-6);
        let mut residual = residuals(&shape);
        for _ in 0..60 {
            let parameters = shape.parameters();
            let mut jacobian = DMatrix::zeros(points.len(), parameters.len());
            for (i, value) in parameters.iter().enumerate() {
                let moved = |step: f64| {
                    let mut parameters = parameters.clone();
                    parameters[i] = value + step;
                    Some(residuals(&shape.with(&parameters)?))
                };
                jacobian.set_column(i, &((moved(1e-6)? - moved(-1e-6)?) / 2e-6));
            }
            let (normal, slope) = (jacobian.tr_mul(&jacobian), jacobian.tr_mul(&residual));
            let size = normal.diagonal().max();
            let damped = &normal + DMatrix::identity(parameters.len(), parameters.len()) * (damping * size);
            let step = damped.cholesky()?.solve(&slope);
            let next = shape.with(&parameters.iter().zip(&step).map(|(p, s)| p - s).collect::<Vec<_>>())?;
            let found = residuals(&next);
            if found.norm() < residual.norm() {
                let gained = residual.norm() - found.norm();
                (shape, residual, damping) = (next, found, (0.1 * damping).max(1e-14));
                if gained < 1e-15 {
                    break;
                }
            } else if damping > 1e3 {
                break;
            } else {
                damping *= 10.0;
            }
        }
        Some(shape)
    }

    /// The shape after the motion x ↦ turn x + shift.
    pub fn moved(self, turn: &Matrix3<f64>, shift: &Vector3<f64>) -> Self {
        let to = |x: Vector3<f64>| turn * x + shift;
        match self {
            Self::Sphere { centre, radius } => Self::Sphere { centre: to(centre), radius },
            Self::Cone { point, axis, radius, slope } => {
                Self::Cone { point: to(point), axis: turn * axis, radius, slope }
            }
            Self::Torus { centre, axis, radius, tube } => {
                Self::Torus { centre: to(centre), axis: turn * axis, radius, tube }
            }
        }
    }

    /// The shape scaled and moved: x ↦ centre + size x.
    fn placed(self, centre: &Vector3<f64>, size: f64) -> Self {
        let move_to = |x: Vector3<f64>| centre + x * size;
        match self {
            Self::Sphere { centre, radius } => Self::Sphere { centre: move_to(centre), radius: radius * size },
            Self::Cone { point, axis, radius, slope } => {
                Self::Cone { point: move_to(point), axis, radius: radius * size, slope }
            }
            Self::Torus { centre, axis, radius, tube } => {
                Self::Torus { centre: move_to(centre), axis, radius: radius * size, tube: tube * size }
            }
        }
    }
}

/// Fewest lines parallel to the axis that show that a surface is a cylinder: four lines, as of a
/// face between two equal chamfers, always lie on one.
const FEWEST_LINES: usize = 5;

/// The simplest shape that passes within `tolerance` of all points, the nodes of a surface whose
/// facets have the given centres and unit normals. \[L\] Only if it may be `doubly_curved`, it can be a
/// sphere or a torus.
///
/// Tests: `shapes_are_found_from_their_nodes`, `a_single_row_of_facets_is_no_sphere`.
pub fn fit(
    points: &[Vector3<f64>],
    facets: &[(Vector3<f64>, Vector3<f64>)],
    tolerance: f64,
    doubly_curved: bool,
) -> Option<Shape> {
    let centre = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let size = points.iter().map(|x| (x - centre).norm()).fold(0.0, f64::max);
    if !(size > 0.0) {
        return None;
    }
    let unit: Vec<Vector3<f64>> = points.iter().map(|x| (x - centre) / size).collect();
    let facets: Vec<_> = facets.iter().map(|(x, n)| ((x - centre) / size, *n)).collect();
    for (guess, doubly) in [(sphere as Guess, true), (cylinder, false), (cone, false), (torus, true)] {
        if doubly && !doubly_curved {
            continue;
        }
        let fitted = guess(&unit, &facets).and_then(|shape| shape.refined(&unit));
        // farther away than this, a surface is flat
        let sensible = fitted.filter(|shape| shape.parameters().iter().all(|p| p.abs() < 1e3));
        let Some(shape) = sensible.filter(|shape| size * shape.residual(&unit) <= tolerance) else { continue };
        if shape.is_determined_by(&unit, tolerance / size) {
            return Some(shape.straightened(&unit, tolerance / size).placed(&centre, size));
        }
    }
    None
}

/// Centre and unit normal of a facet.
type Facet = (Vector3<f64>, Vector3<f64>);

/// Finds a shape of one kind through points, from which its fit starts.
type Guess = fn(&[Vector3<f64>], &[Facet]) -> Option<Shape>;

impl Shape {
    /// Whether points show this shape, rather than happen to lie on it.
    fn is_determined_by(&self, points: &[Vector3<f64>], tolerance: f64) -> bool {
        let Self::Cone { point, axis, .. } = self else { return points.len() >= self.parameters().len() + 3 };
        let Some(across) = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).try_normalize(0.0) else { return false };
        let other = axis.cross(&across);
        let mut angles: Vec<f64> = points
            .iter()
            .map(|x| {
                let arm = x - point;
                arm.dot(&other).atan2(arm.dot(&across))
            })
            .collect();
        angles.sort_by(f64::total_cmp);
        let apart = 1e-4_f64.max(tolerance);
        let lines = 1 + angles.windows(2).filter(|pair| pair[1] - pair[0] > apart).count();
        lines >= FEWEST_LINES
    }

    /// A cylinder instead of a cone whose slope is only round-off.
    fn straightened(self, points: &[Vector3<f64>], tolerance: f64) -> Self {
        match self {
            Self::Cone { point, axis, radius, .. } => {
                let straight = Self::Cone { point, axis, radius, slope: 0.0 };
                if straight.residual(points) <= tolerance.min(1e-7) { straight } else { self }
            }
            _ => self,
        }
    }
}

/// Centre and radius of the sphere through points: |x|² = 2 c·x + const, by least squares.
fn sphere(points: &[Vector3<f64>], _: &[Facet]) -> Option<Shape> {
    let rows = DMatrix::from_fn(points.len(), 4, |i, c| if c < 3 { 2.0 * points[i][c] } else { 1.0 });
    let squares = DVector::from_iterator(points.len(), points.iter().map(Vector3::norm_squared));
    let found = rows.svd(true, true).solve(&squares, 1e-9).ok()?;
    let centre = Vector3::new(found[0], found[1], found[2]);
    Some(Shape::Sphere { centre, radius: (found[3] + centre.norm_squared()).max(0.0).sqrt() })
}

/// A cylinder: its axis is normal to all normals, and all lines along normals meet it.
fn cylinder(points: &[Vector3<f64>], facets: &[Facet]) -> Option<Shape> {
    let spread: Matrix3<f64> = facets.iter().map(|(_, n)| n * n.transpose()).sum();
    let eigen = spread.symmetric_eigen();
    let axis: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into();
    let point = on_axis(&axis, facets)?;
    let radius = points.iter().map(|x| cylindrical(x, &point, &axis).0).sum::<f64>() / points.len() as f64;
    Some(Shape::Cone { point, axis, radius, slope: 0.0 })
}

/// The point nearest to the origin on the axis of this direction that lines along the normals meet.
fn on_axis(axis: &Vector3<f64>, facets: &[Facet]) -> Option<Vector3<f64>> {
    let across = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).try_normalize(0.0)?;
    let basis = [across, axis.cross(&across)];
    let rows = DMatrix::from_fn(facets.len(), 2, |i, c| facets[i].1.cross(axis).dot(&basis[c]));
    let right = DVector::from_iterator(facets.len(), facets.iter().map(|(x, n)| n.cross(axis).dot(x)));
    let found = rows.svd(true, true).solve(&right, 1e-9).ok()?;
    Some(basis[0] * found[0] + basis[1] * found[1])
}

/// The axis that all lines along the normals meet, from their Plücker coordinates (Pottmann and
/// Randrup, Computing 60 (1998), 307–322).
fn revolution_axis(facets: &[Facet]) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let mut sum = Matrix6::zeros();
    for (x, n) in facets {
        let moment = x.cross(n);
        let line = Vector6::new(moment.x, moment.y, moment.z, n.x, n.y, n.z);
        sum += line * line.transpose();
    }
    let eigen = sum.symmetric_eigen();
    let found = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let axis = Vector3::new(found[0], found[1], found[2]).try_normalize(1e-6)?;
    Some((on_axis(&axis, facets)?, axis))
}

/// A cone: around the axis that the normals meet, the radius is linear along it.
fn cone(points: &[Vector3<f64>], facets: &[Facet]) -> Option<Shape> {
    let (point, axis) = revolution_axis(facets)?;
    let profile: Vec<(f64, f64)> = points.iter().map(|x| cylindrical(x, &point, &axis)).collect();
    let rows = DMatrix::from_fn(profile.len(), 2, |i, c| if c == 0 { 1.0 } else { profile[i].1 });
    let radii = DVector::from_iterator(profile.len(), profile.iter().map(|p| p.0));
    let found = rows.svd(true, true).solve(&radii, 1e-9).ok()?;
    Some(Shape::Cone { point, axis, radius: found[0], slope: found[1] })
}

/// A torus: around the axis that the normals meet, the profile is a circle.
fn torus(points: &[Vector3<f64>], facets: &[Facet]) -> Option<Shape> {
    let (point, axis) = revolution_axis(facets)?;
    let profile: Vec<(f64, f64)> = points.iter().map(|x| cylindrical(x, &point, &axis)).collect();
    let rows = DMatrix::from_fn(profile.len(), 3, |i, c| [2.0 * profile[i].0, 2.0 * profile[i].1, 1.0][c]);
    let squares = DVector::from_iterator(profile.len(), profile.iter().map(|p| p.0 * p.0 + p.1 * p.1));
    let found = rows.svd(true, true).solve(&squares, 1e-9).ok()?;
    let tube = (found[2] + found[0] * found[0] + found[1] * found[1]).max(0.0).sqrt();
    Some(Shape::Torus { centre: point + axis * found[1], axis, radius: found[0], tube })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nodes and facets of a grid on the surface x(u, v).
    fn grid(n: [usize; 2], x: impl Fn(f64, f64) -> Vector3<f64>) -> (Vec<Vector3<f64>>, Vec<Facet>) {
        let at = |i: usize, j: usize| x(i as f64 / n[0] as f64, (j as f64 / n[1] as f64).powf(1.2));
        let nodes = (0..=n[0]).flat_map(|i| (0..=n[1]).map(move |j| (i, j))).map(|(i, j)| at(i, j)).collect();
        let facets = (0..n[0]).flat_map(|i| (0..n[1]).map(move |j| (i, j))).map(|(i, j)| {
            let p = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            (p.iter().sum::<Vector3<f64>>() / 4.0, (p[2] - p[0]).cross(&(p[3] - p[1])).normalize())
        });
        (nodes, facets.collect())
    }

    /// Points of known shapes, at a distance from the origin and around an inclined axis.
    #[test]
    fn shapes_are_found_from_their_nodes() {
        let axis = Vector3::new(1.0, 2.0, -0.5).normalize();
        let across = axis.cross(&Vector3::x()).normalize();
        let other = axis.cross(&across);
        let centre = Vector3::new(30.0, -20.0, 7.0);
        let at = move |radius: f64, angle: f64, along: f64| {
            centre + (across * angle.cos() + other * angle.sin()) * radius + axis * along
        };
        let tolerance = 1e-6;
        let found = |x: &dyn Fn(f64, f64) -> Vector3<f64>| {
            let (nodes, facets) = grid([6, 4], x);
            fit(&nodes, &facets, tolerance, true)
        };
        let Some(Shape::Sphere { centre: c, radius }) =
            found(&|u, v| at(5.0 * (0.3 + v).sin(), 2.0 * u, 5.0 * (0.3 + v).cos()))
        else {
            panic!("a sphere")
        };
        assert!((c - centre).norm() < 1e-9 && (radius - 5.0).abs() < 1e-9);
        let Some(Shape::Cone { axis: a, radius, slope, .. }) = found(&|u, v| at(5.0, 1.1 * u, 8.0 * v)) else {
            panic!("a cylinder")
        };
        assert!(a.cross(&axis).norm() < 1e-9 && (radius - 5.0).abs() < 1e-8 && slope == 0.0);
        let Some(Shape::Cone { axis: a, slope, .. }) = found(&|u, v| at(5.0 + 2.4 * v, 1.5 * u, 8.0 * v)) else {
            panic!("a cone")
        };
        assert!(a.cross(&axis).norm() < 1e-8 && (slope.abs() - 0.3).abs() < 1e-8);
        let Some(Shape::Torus { centre: c, radius, tube, .. }) =
            found(&|u, v| at(5.0 + (0.4 + 1.1 * v).cos(), 1.5 * u, (0.4 + 1.1 * v).sin()))
        else {
            panic!("a torus")
        };
        assert!((c - centre).norm() < 1e-7 && (radius - 5.0).abs() < 1e-7 && (tube - 1.0).abs() < 1e-7);
        // an ellipsoid is none of these, nor is a plane, nor two planes
        assert_eq!(found(&|u, v| at(5.0 * (0.3 + v).sin(), 2.0 * u, 4.0 * (0.3 + v).cos())), None);
        assert_eq!(found(&|u, v| at(u, 0.0, v)), None);
        assert_eq!(found(&|u, v| at(3.0 + (u - 0.5).abs(), 0.3 * u, v)), None);
        // points on a cone, along a line 3 from its axis
        let cone = Shape::Cone { point: centre, axis, radius: 5.0, slope: 0.3 };
        let to = cone.along(&at(3.0, 0.2, 1.0), &(across * 0.2f64.cos() + other * 0.2f64.sin()), 10.0).unwrap();
        assert!((to - 2.3).abs() < 1e-12);
    }
}
