//! Makes the triangles of a surface equilateral, with edges of given lengths, and keeps its patches.
//!
//! The corners where patches meet stay in place, bit for bit. Points on the border between two
//! patches move along this border; all other points move within their patch. Each pass splits long
//! edges, collapses short ones, flips edges to enlarge the smallest angle, and moves points to the
//! centroid of their triangles; moved points are projected onto the original surface. Finally, the rim of the
//! material on outer faces moves within them until they have their original areas. A change that
//! would make triangles cross or fold is not made, so an embedded surface stays embedded. Bends between points
//! that are to stay, as those between the facets of a curved face, stay too.
//!
//! Method: M. Botsch, L. Kobbelt, A remeshing approach to multiresolution modeling, SGP 2004.

mod operations;
mod rims;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

use super::lengths::Lengths;
use crate::closest::{ClosestPoint, Simplex};
use crate::crossings::{self, Near, cross};
use crate::vector::{area, dot, norm, shape, subtract, unit, unit_normal};

/// Edges longer than `LONGEST` or shorter than `SHORTEST` times the target length are split or
/// collapsed.
const LONGEST: f64 = 4.0 / 3.0;
const SHORTEST: f64 = 4.0 / 5.0;

/// Number of passes.
const PASSES: usize = 8;

/// Cosine of the largest angle between the normals of a triangle before and after a change (60°).
const TURN: f64 = 0.5;

/// Cosine of the angle between the normals of triangles that are folded onto each other (15° between
/// the triangles).
const FOLDED: f64 = -0.966;

/// One minus the cosine of the largest angle between triangles in one plane (0.01°).
const FLAT: f64 = 1e-8;

/// Cosine of the angle between two segments of a border between outer faces above which their common point
/// is a corner (5°). Points on straighter borders move along them, so that chords hardly change the faces.
const BEND: f64 = 0.9962;

/// A closed surface that is divided into patches.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct PatchedSurface {
    /// Coordinates. \[L\]
    pub points: Vec<[f64; 3]>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// The patch of each triangle.
    pub patch: Vec<u32>,
}

impl PatchedSurface {
    pub fn corners(&self, triangle: usize) -> [[f64; 3]; 3] {
        self.triangles[triangle].map(|n| self.points[n as usize])
    }

    /// Number of pairs of triangles that cross each other.
    pub fn crossings(&self) -> usize {
        crossings::count(&self.points, &self.triangles, &vec![0; self.triangles.len()])
    }

    /// The volume that the surface encloses. \[L³\]
    pub fn volume(&self) -> f64 {
        let Some(&origin) = self.points.first() else { return 0.0 };
        (0..self.triangles.len()).map(|t| dot(subtract(self.corners(t)[0], origin), area(self.corners(t))) / 6.0).sum()
    }
}

/// Two different patches, the smaller number first.
type Pair = (u32, u32);

/// Where a point may move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Place {
    /// Within this patch.
    Patch(u32),
    /// Along the border between these two patches, the smaller number first.
    Border(u32, u32),
    /// Nowhere.
    Corner,
}

/// A surface during remeshing. The numbers of removed triangles and points are not reused.
struct Remesh<'a> {
    lengths: &'a Lengths,
    points: Vec<[f64; 3]>,
    /// The target length at each point. \[L\]
    target: Vec<f64>,
    places: Vec<Place>,
    triangles: Vec<[u32; 3]>,
    patch: Vec<u32>,
    /// The triangles at each point.
    around: Vec<Vec<u32>>,
    near: Near,
    original: &'a Original,
}

/// The original patches and borders, for projections.
struct Original {
    patches: BTreeMap<u32, ClosestPoint>,
    borders: BTreeMap<Pair, ClosestPoint>,
    /// Areas of the patches. \[L²\]
    areas: BTreeMap<u32, f64>,
}

/// The surface with edges of about these lengths; `free` returns whether a patch is not an
/// outer face; bends of the borders of such patches are not corners. Points that `fixed` accepts stay,
/// except beside the rim of the material on an outer face. `onto` returns the point of the outer faces of the design
/// domain nearest to a point near one with a normal; rims do not leave these faces.
pub(super) fn remeshed(
    surface: &PatchedSurface,
    lengths: &Lengths,
    free: impl Fn(u32) -> bool,
    fixed: impl Fn([f64; 3]) -> bool,
    onto: impl FnMut([f64; 3], [f64; 3]) -> Option<[f64; 3]>,
) -> PatchedSurface {
    let borders = borders(surface);
    let original = Original::new(surface, &borders);
    let mut around = vec![Vec::new(); surface.points.len()];
    for (t, triangle) in (0..).zip(&surface.triangles) {
        triangle.iter().for_each(|&n| around[n as usize].push(t));
    }
    let mut places = places(surface, &borders, &free);
    // Points beside the rim of the material would leave slivers if they could not move.
    let rim: BTreeSet<u32> =
        borders.iter().filter(|(_, pair)| free(pair.0) != free(pair.1)).flat_map(|(edge, _)| *edge).collect();
    for (n, &point) in (0..).zip(&surface.points) {
        let beside = |t: &u32| surface.triangles[*t as usize].iter().any(|m| rim.contains(m));
        if fixed(point) && !around[n as usize].iter().any(beside) {
            places[n as usize] = Place::Corner;
        }
    }
    let mut remesh = Remesh {
        lengths,
        points: surface.points.clone(),
        target: surface.points.iter().map(|&point| lengths.at(point)).collect(),
        places,
        triangles: surface.triangles.clone(),
        patch: surface.patch.clone(),
        around,
        near: Near::default(),
        original: &original,
    };
    for _ in 0..PASSES {
        remesh.split_long();
        remesh.near = Near::of(&remesh.points, &remesh.alive());
        remesh.collapse_short();
        remesh.flip();
        remesh.relax(true);
        remesh.target = remesh.points.iter().map(|&point| lengths.at(point)).collect();
    }
    remesh.flip();
    remesh.restore_areas(&free, onto);
    remesh.finish()
}

/// Edges between different patches, keyed by their points in ascending order, with the two patches.
fn borders(surface: &PatchedSurface) -> BTreeMap<[u32; 2], Pair> {
    let mut first: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    let mut borders = BTreeMap::new();
    for (t, &patch) in surface.triangles.iter().zip(&surface.patch) {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            let edge = [a.min(b), a.max(b)];
            match first.remove(&edge) {
                Some(other) if other != patch => {
                    borders.insert(edge, (other.min(patch), other.max(patch)));
                }
                Some(_) => {}
                None => {
                    first.insert(edge, patch);
                }
            }
        }
    }
    borders
}

fn places(surface: &PatchedSurface, borders: &BTreeMap<[u32; 2], Pair>, free: &impl Fn(u32) -> bool) -> Vec<Place> {
    let mut places = vec![Place::Corner; surface.points.len()];
    for (t, &patch) in surface.triangles.iter().zip(&surface.patch) {
        t.iter().for_each(|&n| places[n as usize] = Place::Patch(patch));
    }
    let mut along: BTreeMap<u32, Vec<(u32, Pair)>> = BTreeMap::new();
    for (&[a, b], &pair) in borders {
        along.entry(a).or_default().push((b, pair));
        along.entry(b).or_default().push((a, pair));
    }
    for (n, edges) in along {
        let direction = |to: u32| unit(subtract(surface.points[to as usize], surface.points[n as usize]));
        places[n as usize] = match edges[..] {
            [(a, pair), (b, other)] if pair == other => {
                let straight = -dot(direction(a), direction(b));
                let bends = straight < BEND && !free(pair.0) && !free(pair.1);
                if bends { Place::Corner } else { Place::Border(pair.0, pair.1) }
            }
            _ => Place::Corner,
        };
    }
    places
}

impl Original {
    fn new(surface: &PatchedSurface, borders: &BTreeMap<[u32; 2], Pair>) -> Self {
        let mut triangles: BTreeMap<u32, Vec<Simplex>> = BTreeMap::new();
        let mut areas: BTreeMap<u32, f64> = BTreeMap::new();
        for (t, &patch) in surface.patch.iter().enumerate() {
            let corners = surface.corners(t);
            *areas.entry(patch).or_default() += 0.5 * norm(area(corners));
            triangles.entry(patch).or_default().push(Simplex { corners, normal: unit_normal(corners) });
        }
        let mut segments: BTreeMap<Pair, Vec<Simplex>> = BTreeMap::new();
        for (edge, &pair) in borders {
            let [a, b] = edge.map(|n| surface.points[n as usize]);
            segments.entry(pair).or_default().push(Simplex { corners: [a, b, b], normal: [0.0; 3] });
        }
        let patches = triangles.into_iter().map(|(patch, all)| (patch, ClosestPoint::new(all))).collect();
        let borders = segments.into_iter().map(|(pair, all)| (pair, ClosestPoint::new(all))).collect();
        Self { patches, borders, areas }
    }

    /// The point of a patch or border nearest to `x`; `normal` is the surface normal at `x`.
    fn project(&self, place: Place, x: [f64; 3], normal: [f64; 3]) -> Option<[f64; 3]> {
        match place {
            Place::Patch(patch) => self.patches.get(&patch)?.of(x, (normal, 0.0), f64::INFINITY),
            Place::Border(p, q) => self.borders.get(&(p, q))?.of(x, (normal, 0.0), f64::INFINITY),
            Place::Corner => None,
        }
    }
}

impl Remesh<'_> {
    /// The target length of the edge between two points. \[L\]
    fn target(&self, [a, b]: [u32; 2]) -> f64 {
        0.5 * (self.target[a as usize] + self.target[b as usize])
    }

    fn length(&self, a: u32, b: u32) -> f64 {
        norm(subtract(self.points[b as usize], self.points[a as usize]))
    }

    fn corners(&self, t: u32) -> [[f64; 3]; 3] {
        self.triangles[t as usize].map(|n| self.points[n as usize])
    }

    /// The two triangles at an edge, beginning with the one in which the edge runs from `a` to `b`;
    /// `None` if there is no such edge.
    fn at_edge(&self, a: u32, b: u32) -> Option<[u32; 2]> {
        let runs = |t: &u32, a: u32, b: u32| {
            let corners = self.triangles[*t as usize];
            (0..3).any(|k| corners[k] == a && corners[(k + 1) % 3] == b)
        };
        let find = |a: u32, b: u32| self.around[a as usize].iter().find(|t| runs(t, a, b)).copied();
        Some([find(a, b)?, find(b, a)?])
    }

    fn opposite(&self, t: u32, a: u32, b: u32) -> u32 {
        let corners = self.triangles[t as usize];
        corners.into_iter().find(|&n| n != a && n != b).unwrap_or(a)
    }

    /// Whether the edge between two adjacent triangles lies between patches.
    fn is_border(&self, [s, t]: [u32; 2]) -> bool {
        self.patch[s as usize] != self.patch[t as usize]
    }

    /// Whether an edge between fixed points is a bend, as those between the facets of a curved face.
    fn is_crease(&self, [a, b]: [u32; 2], [s, t]: [u32; 2]) -> bool {
        let fixed = |n: u32| self.places[n as usize] == Place::Corner;
        let normal = |t: u32| unit_normal(self.corners(t));
        fixed(a) && fixed(b) && dot(normal(s), normal(t)) < 1.0 - FLAT
    }

    /// Whether points `a` and `b` have an edge that lies between patches.
    fn joined_by_border(&self, a: u32, b: u32) -> bool {
        self.at_edge(a, b).is_some_and(|pair| self.is_border(pair))
    }

    /// All edges, each once, by ascending numbers of their points.
    fn edges(&self) -> BTreeSet<[u32; 2]> {
        let alive = (0..self.triangles.len()).filter(|&t| self.is_alive(t as u32)).map(|t| self.triangles[t]);
        alive.flat_map(|t| (0..3).map(move |k| [t[k].min(t[(k + 1) % 3]), t[k].max(t[(k + 1) % 3])])).collect()
    }

    /// Whether a triangle still exists; the three corners of a removed triangle are equal.
    fn is_alive(&self, t: u32) -> bool {
        let [a, b, _] = self.triangles[t as usize];
        a != b
    }

    /// The triangles; those that were removed are replaced by the first one.
    fn alive(&self) -> Vec<[u32; 3]> {
        let some = (0..self.triangles.len()).find(|&t| self.is_alive(t as u32)).unwrap_or(0);
        let of = |t: usize| self.triangles[if self.is_alive(t as u32) { t } else { some }];
        (0..self.triangles.len()).map(of).collect()
    }

    /// Whether triangles with these numbers and corners would cross others, or each other. The
    /// triangles of `removed` will not exist.
    fn would_cross(&mut self, changed: &[(u32, [u32; 3])], removed: &[u32]) -> bool {
        let Self { near, points, triangles, .. } = self;
        changed.iter().any(|(t, corners)| {
            near.around(points, corners).iter().any(|other| {
                if other == t || removed.contains(other) {
                    return false;
                }
                let with = changed.iter().find(|(k, _)| k == other).map_or(triangles[*other as usize], |(_, c)| *c);
                with[0] != with[1] && cross(points, corners, &with)
            })
        })
    }

    /// The number of edges at which triangles with these numbers and corners, and those next to them
    /// that are not `removed`, are folded onto each other.
    fn folds(&self, changed: &[(u32, [u32; 3])], removed: &[u32]) -> usize {
        let normal = |corners: &[u32; 3]| unit_normal(corners.map(|n| self.points[n as usize]));
        let has = |corners: &[u32; 3], n: u32| corners.contains(&n);
        let mut found = 0;
        for (t, corners) in changed {
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                let across = |(other, of): &&(u32, [u32; 3])| other != t && has(of, a) && has(of, b);
                let unchanged = |other: &&u32| {
                    let of = &self.triangles[**other as usize];
                    has(of, a) && has(of, b) && !removed.contains(other) && changed.iter().all(|(c, _)| c != *other)
                };
                let next = changed.iter().find(across).map(|(_, of)| *of);
                let next = next.or_else(|| {
                    let mut around = self.around[a as usize].iter();
                    around.find(unchanged).map(|&other| self.triangles[other as usize])
                });
                found += usize::from(next.is_some_and(|next| dot(normal(corners), normal(&next)) < FOLDED));
            }
        }
        found
    }

    /// Finds changed triangles at their new places.
    fn found_again(&mut self, triangles: &[u32]) {
        for &t in triangles {
            self.near.insert(&self.points, t, &self.triangles[t as usize]);
        }
    }

    /// Points adjacent to a point, ascending.
    fn neighbours(&self, n: u32) -> Vec<u32> {
        let all = self.around[n as usize].iter().flat_map(|&t| self.triangles[t as usize]);
        let mut all: Vec<u32> = all.filter(|&m| m != n).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// The surface normal at a point: the area-weighted mean over its triangles.
    fn normal(&self, n: u32) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for &t in &self.around[n as usize] {
            let part = area(self.corners(t));
            (0..3).for_each(|c| sum[c] += part[c]);
        }
        unit(sum)
    }

    /// Moves a point, unless this would flip one of its triangles, make it much thinner, fold it
    /// onto another, or make it cross others.
    fn try_move(&mut self, n: u32, to: [f64; 3]) {
        let from = self.points[n as usize];
        let around = self.around[n as usize].clone();
        let changed: Vec<(u32, [u32; 3])> = around.iter().map(|&t| (t, self.triangles[t as usize])).collect();
        let folds = self.folds(&changed, &[]);
        let before: Vec<([f64; 3], f64)> = self.around[n as usize].iter().map(|&t| shape(self.corners(t))).collect();
        self.points[n as usize] = to;
        let worst = before.iter().map(|(_, quality)| *quality).fold(1.0, f64::min);
        let good = self.around[n as usize].iter().zip(&before).all(|(&t, (normal, _))| {
            let (now, quality) = shape(self.corners(t));
            dot(now, *normal) > TURN && quality >= worst.min(0.3)
        });
        if !good || self.folds(&changed, &[]) > folds || self.would_cross(&changed, &[]) {
            self.points[n as usize] = from;
        } else {
            self.found_again(&around);
        }
    }

    /// The surface, renumbered without removed triangles and points.
    fn finish(self) -> PatchedSurface {
        let mut numbers = vec![u32::MAX; self.points.len()];
        let mut surface = PatchedSurface::default();
        for t in (0..self.triangles.len()).filter(|&t| self.is_alive(t as u32)) {
            let triangle = self.triangles[t].map(|n| {
                let number = &mut numbers[n as usize];
                if *number == u32::MAX {
                    *number = surface.points.len() as u32;
                    surface.points.push(self.points[n as usize]);
                }
                *number
            });
            surface.triangles.push(triangle);
            surface.patch.push(self.patch[t]);
        }
        surface
    }
}
