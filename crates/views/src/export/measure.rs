//! The thinnest member and the narrowest gap of a surface.
//!
//! The thickness at a point p of the surface with outward normal n is the diameter of the largest
//! ball inside the body that touches the surface at p and is not crossed by an opposite face:
//!
//! ```text
//! t(p) = min |p − q|² / (n·(p − q))     over the points q of opposite faces, n·m < −cos 20°
//! ```
//!
//! where m is the normal at q. Between parallel faces this is their distance, in a round bar its
//! diameter. Faces at an edge or a corner are not opposite, so edges count only if they are sharper
//! than 20°. A gap is the same outside the body, with −n and −m, and between faces of the same body
//! only: a slot, a hole, the space between two members.
//!
//! At a knife edge, where faces meet at less than 35°, the thickness tends to zero; within one
//! element of such an edge (two edges of triangles) it is not measured, and neither is a gap.
//!
//! An extracted surface has slivers and folds far below the size of the elements; measure the regular
//! surface of [`crate::part::regular_surface`] instead.
//!
//! t is computed at the centroid of every triangle. Between plane faces it is exact. On curved ones
//! it is too small by up to a fifth of an edge of the triangles, because a ball that touches a plane
//! triangle beside its middle meets the neighbours of the opposite one. Symmetry planes mirror the
//! surface.
//!
//! Method: the balls of J. Ma, S. W. Bae, S. Choi, 3D medial axis point approximation using nearest
//! neighbors and the normal field, The Visual Computer 28 (2012) 7–19, with opposite faces only.

use std::collections::BTreeMap;

use serde::Serialize;

use super::TriangleSurface;
use crate::closest::{ClosestPoint, Simplex};
use crate::vector::{area, dot, norm, subtract, unit_normal};

/// Cosine of the angle by which opposite faces may deviate from parallel faces (20°).
const OPPOSITE: f64 = 0.939_692_620_785_908_4;

/// Cosine of the angle between the faces at a knife edge (35°).
const KNIFE: f64 = 0.819_152_044_288_991_8;

/// Distance from a knife edge within which nothing is measured, in mean edges.
const BESIDE: f64 = 2.0;

/// Number of times a ball may shrink.
const SHRINKS: usize = 60;

/// A plane about which a model is symmetric: its axis (0, 1, 2) and its coordinate. \[L\]
pub type MirrorPlane = (usize, f64);

/// The smallest distances of the bodies of a surface; `None` where no two faces are opposite.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Measures {
    /// The thinnest member.
    pub member: Option<Distance>,
    /// The narrowest gap between faces of one body.
    pub gap: Option<Distance>,
}

/// A distance between opposite faces.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Distance {
    /// The distance. \[L\]
    pub length: f64,
    /// The point halfway between the faces. \[L\]
    pub at: [f64; 3],
    /// The body, by its number.
    pub body: u32,
}

/// Measures each body of a surface; `mirrors` are the symmetry planes of the model.
pub fn measure(surface: &TriangleSurface, mirrors: &[MirrorPlane]) -> Measures {
    let mut bodies = surface.bodies.clone();
    bodies.sort_unstable();
    bodies.dedup();
    let mut all = Measures::default();
    for body in bodies {
        let own = (0..surface.triangles.len()).filter(|&t| surface.bodies[t] == body);
        let triangles = mirrored(own.map(|t| surface.corners(t)).collect(), mirrors);
        let faces = Faces::new(triangles);
        let least = |side: f64| faces.least(side).map(|(length, at)| Distance { length, at, body });
        let smaller = |known: Option<Distance>, found: Option<Distance>| match (known, found) {
            (Some(a), Some(b)) => Some(if b.length < a.length { b } else { a }),
            (a, b) => a.or(b),
        };
        all.member = smaller(all.member, least(1.0));
        all.gap = smaller(all.gap, least(-1.0));
    }
    all
}

/// The triangles and their mirror images, without those on a mirror; the originals come first.
fn mirrored(mut triangles: Vec<[[f64; 3]; 3]>, mirrors: &[MirrorPlane]) -> Vec<[[f64; 3]; 3]> {
    for &(axis, at) in mirrors {
        let size = triangles.iter().flatten().map(|p| (p[axis] - at).abs()).fold(0.0, f64::max);
        triangles.retain(|corners| corners.iter().any(|p| (p[axis] - at).abs() > 1e-9 * size));
        let image = |corners: &[[f64; 3]; 3]| {
            let [a, b, c] = corners.map(|mut p| {
                p[axis] = 2.0 * at - p[axis];
                p
            });
            [a, c, b]
        };
        let images: Vec<_> = triangles.iter().map(image).collect();
        triangles.extend(images);
    }
    triangles
}

/// The edges at which faces meet at a small angle, inside or outside, and their reach.
fn knives(simplices: &[Simplex]) -> (ClosestPoint, f64) {
    let bits = |p: [f64; 3]| p.map(|c| (c + 0.0).to_bits());
    let mut edges: BTreeMap<[[u64; 3]; 2], [f64; 3]> = BTreeMap::new();
    let (mut found, mut total, mut count) = (Vec::new(), 0.0, 0);
    for simplex in simplices {
        for k in 0..3 {
            let (a, b) = (simplex.corners[k], simplex.corners[(k + 1) % 3]);
            (total, count) = (total + norm(subtract(b, a)), count + 1);
            let (p, q) = (bits(a), bits(b));
            match edges.remove(&[p.min(q), p.max(q)]) {
                Some(other) if dot(other, simplex.normal) < -KNIFE => {
                    found.push(Simplex { corners: [a, b, b], normal: [0.0; 3] });
                }
                Some(_) => {}
                None => {
                    edges.insert([p.min(q), p.max(q)], simplex.normal);
                }
            }
        }
    }
    (ClosestPoint::new(found), BESIDE * total / f64::from(count.max(1)))
}

struct Faces {
    simplices: Vec<Simplex>,
    tree: ClosestPoint,
    /// Knife edges, and how far from them to measure. \[L\]
    knives: (ClosestPoint, f64),
    /// Diameter of the largest ball to start from. \[L\]
    largest: f64,
}

impl Faces {
    fn new(triangles: Vec<[[f64; 3]; 3]>) -> Self {
        let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in triangles.iter().flatten() {
            (0..3).for_each(|c| (min[c], max[c]) = (min[c].min(p[c]), max[c].max(p[c])));
        }
        let whole = triangles.into_iter().filter(|corners| norm(area(*corners)) > 0.0);
        let simplices: Vec<Simplex> = whole.map(|corners| Simplex { corners, normal: unit_normal(corners) }).collect();
        Self {
            tree: ClosestPoint::new(simplices.clone()),
            knives: knives(&simplices),
            simplices,
            largest: 2.0 * norm(subtract(max, min)),
        }
    }

    /// The smallest distance inside (`side` 1) or outside (−1) the body, and the point halfway; only
    /// balls smaller than the smallest one so far are looked for, which is fast.
    fn least(&self, side: f64) -> Option<(f64, [f64; 3])> {
        let mut best: Option<(f64, [f64; 3])> = None;
        for simplex in &self.simplices {
            let centroid = std::array::from_fn(|c| simplex.corners.iter().map(|p| p[c]).sum::<f64>() / 3.0);
            if self.knives.0.of(centroid, ([0.0; 3], 0.0), self.knives.1).is_some() {
                continue;
            }
            let limit = best.map_or(self.largest, |(length, _)| length);
            let found = self.smaller(centroid, simplex.normal.map(|c| side * c), simplex.normal, limit);
            best = found.or(best);
        }
        best
    }

    /// Diameter of the largest ball on the side of −`out` that touches the surface at `p`, and the
    /// point halfway to the face that it meets; `None` if the diameter is not below a limit. `normal`
    /// is that of the surface.
    fn smaller(&self, p: [f64; 3], out: [f64; 3], normal: [f64; 3], limit: f64) -> Option<(f64, [f64; 3])> {
        let opposite = (normal.map(|c| -c), OPPOSITE);
        let mut met: Option<[f64; 3]> = None;
        let mut diameter = limit;
        for _ in 0..SHRINKS {
            let centre: [f64; 3] = std::array::from_fn(|c| p[c] - 0.5 * diameter * out[c]);
            let Some(q) = self.tree.of(centre, opposite, 0.5 * diameter * (1.0 - 1e-12)) else { break };
            let away = subtract(p, q);
            diameter = dot(away, away) / dot(out, away);
            met = Some(q);
        }
        let q = met.filter(|&q| !self.tree.crosses(p, q))?;
        Some((diameter, std::array::from_fn(|c| 0.5 * (p[c] + q[c]))))
    }
}
