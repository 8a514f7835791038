//! The normal at an edge: the direction that the master asks for, projected onto the normal cone.
//!
//! At an edge or a corner of its body, a slave node can touch along every direction of its normal
//! cone, which the normals g_p of the smooth patches that meet there span. Of these, the node's
//! normal is the one closest to m, which is opposite to the master facets that the node faces
//! ([`super::frame`]):
//!
//! ```text
//! n_j = p / ‖p‖,      p = argmin ‖p − m‖  over  p = Σ_p α_p g_p,  α_p ≥ 0
//! ```
//!
//! Where an edge touches a face, m is in the cone, and the normal is that of the face. Where the node's
//! own patch faces a master of another inclination that it cannot touch, the normal stays close to
//! that of the patch. The projection is continuous and piecewise smooth: it has kinks where m enters
//! the cone or passes from one of its faces to another.
//!
//! A flat patch that lies on a flat master has m = g, at the border of the cone. So that no kink is
//! in this most frequent state, and the normal there is that of the master on either side of it,
//! the cone is widened: its generators are turned away from each other,
//!
//! ```text
//! ĝ_p = v_p / ‖v_p‖,      v_p = g_p − w Σ_q (I − g_p g_pᵀ) g_q
//! ```
//!
//! which at right-angled edges is a turn by arctan w. And since the facets of the row face m only
//! obliquely where it is far from the normal of their own patch, m is first brought within 60° of that.

use super::frame::normalisation_slope;
use nalgebra::{Matrix3, Vector3};

/// Widening of the cone, w: 5° at right-angled edges.
pub const WIDENING: f64 = 0.087;

/// Sine of the angle between two generators, and their triple product, below which they span no
/// face and no interior.
const FLAT: f64 = 1e-6;

/// The generators of the face of the cone on which the projection lies, as positions in the list of
/// generators.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Face {
    Ray(usize),
    Fan(usize, usize),
    Interior,
}

/// Projection p of a vector m onto a cone, and its derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct Projection {
    /// p, not normalized; for a vector in the polar cone, the closest generator.
    pub value: Vector3<f64>,
    /// ∂p/∂m.
    pub by_vector: Matrix3<f64>,
    /// ∂p/∂g of the generators on which p depends, given by their positions.
    pub by_generator: Vec<(usize, Matrix3<f64>)>,
}

/// Cosine and sine of the largest angle between the normal and that of the own patch.
const LIMIT: [f64; 2] = [0.5, 0.866_025_403_784_438_6];

/// The unit vector `m`, or the one closest to it within the largest angle of `g`; its derivatives with
/// respect to m and g.
fn limited(m: &Vector3<f64>, g: &Vector3<f64>) -> (Vector3<f64>, Matrix3<f64>, Matrix3<f64>) {
    let [cos, sin] = LIMIT;
    let along = m.dot(g);
    let across = m - g * along;
    let length = across.norm();
    if along >= cos {
        return (*m, Matrix3::identity(), Matrix3::zeros());
    }
    if !(length > FLAT) {
        return (*g, Matrix3::zeros(), Matrix3::identity());
    }
    let unit = across / length;
    // δ(m − g (m·g)) = (I − g gᵀ) δm − (m·g + g mᵀ) δg
    let slope = normalisation_slope(&unit, length) * sin;
    let by_vector = slope * (Matrix3::identity() - g * g.transpose());
    let by_normal = Matrix3::identity() * cos - slope * (Matrix3::identity() * along + g * m.transpose());
    (g * cos + unit * sin, by_vector, by_normal)
}

impl Projection {
    /// Projects the unit vector `m`, brought close to the first of `normals`, onto the cone that these
    /// unit vectors span, widened by `widening`.
    ///
    /// Ours. Tests: `widens_by_hand`, `projection_gradient_matches_finite_differences`.
    pub fn onto_widened(m: &Vector3<f64>, normals: &[Vector3<f64>], widening: f64) -> Self {
        let all: Vector3<f64> = normals.iter().sum();
        let widened: Vec<Vector3<f64>> =
            normals.iter().map(|g| g * (1.0 + widening * g.dot(&all)) - all * widening).collect();
        let generators: Vec<Vector3<f64>> = widened.iter().map(|v| v.normalize()).collect();
        let (m, by_vector, by_own) = limited(m, &normals[0]);
        let mut projection = Self::new(&m, &generators);
        let mut by_normal = vec![Matrix3::zeros(); normals.len()];
        by_normal[0] = projection.by_vector * by_own;
        projection.by_vector *= by_vector;
        for (a, by) in std::mem::take(&mut projection.by_generator) {
            let g = &normals[a];
            let by = by * normalisation_slope(&generators[a], widened[a].norm());
            // δv = δg (1 + w g·s) + w g (s·δg) − w (I − g gᵀ) δs, s = Σ g
            by_normal[a] +=
                by * (Matrix3::identity() * (1.0 + widening * g.dot(&all)) + g * all.transpose() * widening);
            let by_sum = by * (g * g.transpose() - Matrix3::identity()) * widening;
            by_normal.iter_mut().for_each(|slope| *slope += by_sum);
        }
        projection.by_generator = by_normal.into_iter().enumerate().collect();
        projection
    }

    /// Projects `m` onto the cone that the unit vectors `generators` span.
    ///
    /// Ours. Tests: `projects_by_hand`, `the_projection_is_the_closest_point`.
    pub fn new(m: &Vector3<f64>, generators: &[Vector3<f64>]) -> Self {
        match closest(m, generators) {
            Face::Interior => Self { value: *m, by_vector: Matrix3::identity(), by_generator: Vec::new() },
            Face::Fan(a, b) => {
                let (first, second) = (generators[a], generators[b]);
                let cross = first.cross(&second);
                let length = cross.norm();
                let across = cross / length;
                let height = across.dot(m);
                let within = Matrix3::identity() - across * across.transpose();
                // δp = −(ν·m) δν − ν (m·δν), δν = (I − ν νᵀ) δ(g_a × g_b)/‖g_a × g_b‖
                let by_across = -(Matrix3::identity() * height + across * m.transpose()) * within / length;
                Self {
                    value: within * m,
                    by_vector: within,
                    by_generator: vec![(a, -by_across * second.cross_matrix()), (b, by_across * first.cross_matrix())],
                }
            }
            Face::Ray(a) => {
                Self { value: generators[a], by_vector: Matrix3::zeros(), by_generator: vec![(a, Matrix3::identity())] }
            }
        }
    }
}

/// The face with the closest point of the cone to `m`.
fn closest(m: &Vector3<f64>, generators: &[Vector3<f64>]) -> Face {
    let count = generators.len();
    for (a, b, c) in triples(count) {
        let basis = Matrix3::from_columns(&[generators[a], generators[b], generators[c]]);
        let weights = basis.try_inverse().filter(|_| basis.determinant().abs() > FLAT).map(|inverse| inverse * m);
        if weights.is_some_and(|weights| weights.iter().all(|&weight| weight >= 0.0)) {
            return Face::Interior;
        }
    }
    // squared length of the projection: the longer, the closer
    let rays = (0..count).map(|a| (generators[a].dot(m), Face::Ray(a)));
    let rays = rays.map(|(along, face)| (along.abs() * along, face));
    let fans = (0..count).flat_map(|b| (0..b).map(move |a| (a, b))).filter_map(|(a, b)| {
        let (first, second) = (generators[a], generators[b]);
        let cosine = first.dot(&second);
        let (u, v) = (first.dot(m), second.dot(m));
        let square = first.cross(&second).norm_squared();
        let (by_first, by_second) = (u - cosine * v, v - cosine * u);
        let inside = by_first > 0.0 && by_second > 0.0 && square > FLAT * FLAT;
        inside.then(|| ((by_first * u + by_second * v) / square, Face::Fan(a, b)))
    });
    let longest = rays.chain(fans).reduce(|best, next| if next.0 > best.0 { next } else { best });
    longest.map_or(Face::Interior, |(_, face)| face)
}

fn triples(count: usize) -> impl Iterator<Item = (usize, usize, usize)> {
    (0..count).flat_map(move |c| (0..c).flat_map(move |b| (0..b).map(move |a| (a, b, c))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A right-angled corner: the normals of its faces are the axes.
    #[test]
    fn projects_by_hand() {
        let corner = [Vector3::x(), Vector3::y(), Vector3::z()];
        let at = |m: [f64; 3], generators: &[Vector3<f64>]| Projection::new(&m.into(), generators).value.normalize();
        let unit = |v: [f64; 3]| Vector3::from(v).normalize();
        // inside, beside a fan, and beyond a ray
        for (m, n) in [
            ([1.0, 2.0, 3.0], [1.0, 2.0, 3.0]),
            ([1.0, 2.0, -3.0], [1.0, 2.0, 0.0]),
            ([-1.0, 2.0, -3.0], [0.0, 1.0, 0.0]),
            ([-3.0, -2.0, -1.0], [0.0, 0.0, 1.0]),
        ] {
            assert!((at(m, &corner) - unit(n)).norm() < 1e-15, "{m:?}");
        }
        // an edge, and a face
        assert!((at([1.0, 2.0, 3.0], &corner[..2]) - unit([1.0, 2.0, 0.0])).norm() < 1e-15);
        assert!((at([1.0, -2.0, 3.0], &corner[..2]) - Vector3::x()).norm() < 1e-15);
        assert_eq!(at([1.0, 2.0, 3.0], &corner[..1]), Vector3::x());
    }

    /// The cone of a right-angled edge, widened by arctan w: a vector just beyond the normal of a face is
    /// inside, one far beyond it is projected onto the border. The normal is within 60° of that of the
    /// first face.
    #[test]
    fn widens_by_hand() {
        let edge = [Vector3::x(), Vector3::y()];
        let at = |degrees: f64| Vector3::new(degrees.to_radians().cos(), degrees.to_radians().sin(), 0.0);
        for (degrees, expected) in [(45.0, 45.0), (-5.0, -5.0), (-40.0, -15.0), (60.0, 60.0), (100.0, 60.0)] {
            let projection = Projection::onto_widened(&at(degrees), &edge, f64::tan(f64::to_radians(15.0)));
            assert!((projection.value.normalize() - at(expected)).norm() < 1e-14, "{degrees}");
        }
    }

    fn vector() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0f64..1.0).prop_filter_map("too short", |v| {
            let v = Vector3::from(v);
            (v.norm() > 0.1).then(|| v.normalize())
        })
    }

    /// Generators within 80 degrees of an axis, as the normals around a node of a body.
    fn scenes() -> impl Strategy<Value = (Vector3<f64>, Vec<Vector3<f64>>)> {
        (vector(), vector(), prop::collection::vec(vector(), 1..5)).prop_map(|(m, axis, mut generators)| {
            for g in &mut generators {
                let along = g.dot(&axis);
                *g = (*g + axis * (0.2 - along).max(0.0)).normalize();
            }
            (m, generators)
        })
    }

    proptest! {
        /// The conditions of the closest point p of a cone: it lies in it, (m − p) · p = 0, and
        /// (m − p) · g ≤ 0 for all generators.
        #[test]
        fn the_projection_is_the_closest_point((m, generators) in scenes()) {
            prop_assume!(generators.iter().any(|g| g.dot(&m) > 0.0));
            let projection = Projection::new(&m, &generators);
            let mut p = projection.value;
            if projection.by_vector == Matrix3::zeros() {
                p *= p.dot(&m);
            }
            prop_assert!((m - p).dot(&p).abs() < 1e-12);
            for g in &generators {
                prop_assert!((m - p).dot(g) < 1e-5, "{g:?}");
            }
        }

        /// Away from its kinks, the projection has the derivatives of its differences.
        #[test]
        fn projection_gradient_matches_finite_differences((m, generators) in scenes(), widening in 0.0f64..0.3) {
            let project = |m: &Vector3<f64>, generators: &[Vector3<f64>]| {
                let p = Projection::onto_widened(m, generators, widening);
                let kept = limited(m, &generators[0]).0;
                let widened = Projection::new(&kept, generators).by_generator.len();
                let kind = (kept == *m, p.by_vector.rank(1e-6), widened);
                (p, kind)
            };
            let (exact, face) = project(&m, &generators);
            for (which, c) in (0..=generators.len()).flat_map(|which| (0..3).map(move |c| (which, c))) {
                let moved = |h: f64| {
                    let (mut m, mut generators) = (m, generators.clone());
                    let target = if which == 0 { &mut m } else { &mut generators[which - 1] };
                    target[c] += h;
                    let (p, face) = project(&m, &generators);
                    (p.value, face)
                };
                let [p1, m1, p2, m2] = [1e-4, -1e-4, 2e-4, -2e-4].map(moved);
                if [p1.1, m1.1, p2.1, m2.1].iter().any(|other| *other != face) {
                    continue;
                }
                let difference = (8.0 * (p1.0 - m1.0) - (p2.0 - m2.0)) / 12e-4;
                let slope = match which {
                    0 => exact.by_vector.column(c).into_owned(),
                    _ => exact.by_generator.iter().filter(|by| by.0 == which - 1).map(|by| by.1.column(c).into_owned()).sum(),
                };
                let scale = 1.0 + exact.by_generator.iter().map(|by| by.1.norm()).fold(0.0, f64::max).powi(4);
                prop_assert!((difference - slope).norm() < 1e-10 * scale, "{which} {c}: {difference} {slope}");
            }
        }
    }
}
