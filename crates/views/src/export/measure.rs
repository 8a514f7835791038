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
//! Folds and points at which members touch do not count. Triangles are joined into connected patches, the
//! thinnest first, until a patch has at least half the area of an element's face (half the square of two
//! mean edges). The largest thickness in this patch is the result.
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

/// Area of the smallest patch that counts, in mean edges squared.
const PATCH: f64 = 2.0;

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
    /// The point halfway between the faces at the thinnest triangle of the patch. \[L\]
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
        let faces = Faces::new(mirrored(own.map(|t| surface.corners(t)).collect(), mirrors));
        let least = |side: f64| faces.least_of_a_patch(side).map(|(length, at)| Distance { length, at, body });
        let smaller = |known: Option<Distance>, found: Option<Distance>| match (known, found) {
            (Some(a), Some(b)) => Some(if b.length < a.length { b } else { a }),
            (a, b) => a.or(b),
        };
        all.member = smaller(all.member, least(1.0));
        all.gap = smaller(all.gap, least(-1.0));
    }
    all
}

/// The triangles and their mirror images, without those on a mirror; the originals come first. Also the
/// number of the originals.
fn mirrored(mut triangles: Vec<[[f64; 3]; 3]>, mirrors: &[MirrorPlane]) -> (Vec<[[f64; 3]; 3]>, usize) {
    let mut originals = triangles.len();
    for &(axis, at) in mirrors {
        let size = triangles.iter().flatten().map(|p| (p[axis] - at).abs()).fold(0.0, f64::max);
        let off = |corners: &[[f64; 3]; 3]| corners.iter().any(|p| (p[axis] - at).abs() > 1e-9 * size);
        originals = triangles[..originals].iter().filter(|corners| off(corners)).count();
        triangles.retain(off);
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
    (triangles, originals)
}

/// A point as bits, by which triangles share corners.
fn bits(p: [f64; 3]) -> [u64; 3] {
    p.map(|c| (c + 0.0).to_bits())
}

/// The edges at which faces meet at a small angle, inside or outside.
fn knives(simplices: &[Simplex]) -> ClosestPoint {
    let mut edges: BTreeMap<[[u64; 3]; 2], [f64; 3]> = BTreeMap::new();
    let mut found = Vec::new();
    for simplex in simplices {
        for k in 0..3 {
            let (a, b) = (simplex.corners[k], simplex.corners[(k + 1) % 3]);
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
    ClosestPoint::new(found)
}

/// Mean length of the edges of triangles. \[L\]
fn mean_edge(simplices: &[Simplex]) -> f64 {
    let edge = |of: &Simplex, k: usize| norm(subtract(of.corners[(k + 1) % 3], of.corners[k]));
    let total: f64 = simplices.iter().flat_map(|of| (0..3).map(move |k| edge(of, k))).sum();
    total / (3 * simplices.len()).max(1) as f64
}

/// A connected set of triangles.
struct PatchOfFaces {
    area: f64,
    /// The thinnest one: whether it is a mirror image, its thickness, and the point halfway.
    thinnest: (bool, f64, [f64; 3]),
}

struct Faces {
    simplices: Vec<Simplex>,
    tree: ClosestPoint,
    /// Number of the simplices that are no mirror images; these come first.
    originals: usize,
    knives: ClosestPoint,
    mean_edge: f64,
    /// Diameter of the largest ball to start from. \[L\]
    largest: f64,
}

impl Faces {
    fn new((triangles, originals): (Vec<[[f64; 3]; 3]>, usize)) -> Self {
        let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in triangles.iter().flatten() {
            (0..3).for_each(|c| (min[c], max[c]) = (min[c].min(p[c]), max[c].max(p[c])));
        }
        let whole = |corners: &[[f64; 3]; 3]| norm(area(*corners)) > 0.0;
        let originals = triangles[..originals].iter().filter(|corners| whole(corners)).count();
        let simplex = |corners| Simplex { corners, normal: unit_normal(corners) };
        let simplices: Vec<Simplex> = triangles.into_iter().filter(whole).map(simplex).collect();
        Self {
            tree: ClosestPoint::new(simplices.clone()),
            originals,
            knives: knives(&simplices),
            mean_edge: mean_edge(&simplices),
            simplices,
            largest: 2.0 * norm(subtract(max, min)),
        }
    }

    /// The smallest distance that a patch has inside (`side` 1) or outside (−1) the body, and a point
    /// halfway; without a patch that is large enough, the smallest distance of a triangle.
    fn least_of_a_patch(&self, side: f64) -> Option<(f64, [f64; 3])> {
        let thinnest = self.least(side)?;
        let mut limit = 2.0 * thinnest.0;
        loop {
            let of = |(number, simplex): (usize, &Simplex)| {
                self.distance(simplex, side, limit).map(|(length, at)| (length, number, at))
            };
            let mut measured: Vec<_> = self.simplices.iter().enumerate().filter_map(of).collect();
            measured.sort_unstable_by(|a, b| (a.0, a.1).partial_cmp(&(b.0, b.1)).unwrap_or(std::cmp::Ordering::Equal));
            if let Some(found) = self.first_patch(&measured) {
                return Some(found);
            }
            if limit >= self.largest {
                return Some(thinnest);
            }
            limit *= 2.0;
        }
    }

    /// Joins triangles that share corners, the thinnest first, until a patch is large enough: its
    /// largest distance, and the point halfway at its thinnest triangle.
    fn first_patch(&self, measured: &[(f64, usize, [f64; 3])]) -> Option<(f64, [f64; 3])> {
        let mut patches: BTreeMap<usize, PatchOfFaces> = BTreeMap::new();
        // the patch of a corner, or the one into which it was merged
        let mut of_corner: BTreeMap<[u64; 3], usize> = BTreeMap::new();
        let mut merged: Vec<usize> = (0..measured.len()).collect();
        for (own, &(length, number, at)) in measured.iter().enumerate() {
            let corners = self.simplices[number].corners;
            let mirror = number >= self.originals;
            let mut patch = PatchOfFaces { area: 0.5 * norm(area(corners)), thinnest: (mirror, length, at) };
            for corner in corners.map(bits) {
                let Some(mut other) = of_corner.insert(corner, own) else { continue };
                while merged[other] != other {
                    merged[other] = merged[merged[other]];
                    other = merged[other];
                }
                let Some(joined) = patches.remove(&other) else { continue };
                merged[other] = own;
                patch.area += joined.area;
                // a point of the body as given, rather than of its mirror image
                let first = |a: &(bool, f64, [f64; 3])| (a.0, a.1);
                if first(&joined.thinnest) < first(&patch.thinnest) {
                    patch.thinnest = joined.thinnest;
                }
            }
            if patch.area >= PATCH * self.mean_edge.powi(2) {
                return Some((length, patch.thinnest.2));
            }
            patches.insert(own, patch);
        }
        None
    }

    /// The smallest distance inside (`side` 1) or outside (−1) the body, and the point halfway; only
    /// balls smaller than the smallest one so far are looked for, which is fast.
    fn least(&self, side: f64) -> Option<(f64, [f64; 3])> {
        let mut best: Option<(f64, [f64; 3])> = None;
        for simplex in &self.simplices {
            let limit = best.map_or(self.largest, |(length, _)| length);
            best = self.distance(simplex, side, limit).or(best);
        }
        best
    }

    /// The distance at the centroid of a triangle, and the point halfway; `None` beside a knife edge, or
    /// if it is not below a limit.
    fn distance(&self, simplex: &Simplex, side: f64, limit: f64) -> Option<(f64, [f64; 3])> {
        let centroid = std::array::from_fn(|c| simplex.corners.iter().map(|p| p[c]).sum::<f64>() / 3.0);
        if self.knives.of(centroid, ([0.0; 3], 0.0), BESIDE * self.mean_edge).is_some() {
            return None;
        }
        self.smaller(centroid, simplex.normal.map(|c| side * c), simplex.normal, limit)
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
