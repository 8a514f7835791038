//! Gives outer faces the areas that they had before: where the rim of the material is curved, the longer edges are
//! chords of it, which cut off a convex face and fill a concave one.
//!
//! All points on the rim of a face move by the same length within the face, outwards or inwards, until its area is
//! the original one.

use std::collections::{BTreeMap, BTreeSet};

use super::{Place, Remesh};
use crate::vector::{area, cross, dot, norm, subtract, unit};

/// How often points of rims move at most; some moves are not possible before their neighbours have moved.
const ROUNDS: usize = 8;

/// Relative difference of areas that is left.
const CLOSE: f64 = 1e-3;

/// Largest move of a round, relative to the target length; rims that need more get more points first.
const STEP: f64 = 0.1;

/// Largest distance of a moved point from the faces of the design domain, relative to its way: bends of
/// curved faces are less than that.
const BESIDE: f64 = 0.2;

/// Shortest edge of a rim that gets a point in its middle, relative to the target length.
const DIVIDED: f64 = 0.4;

impl Remesh<'_> {
    /// Moves the rims of the patches that are not `free` until these have their original areas. Points stay on the
    /// faces onto which `onto` projects, those of the design domain.
    pub(super) fn restore_areas(
        &mut self,
        free: &impl Fn(u32) -> bool,
        mut onto: impl FnMut([f64; 3], [f64; 3]) -> Option<[f64; 3]>,
    ) {
        for round in 0..ROUNDS {
            let missing = self.missing(free);
            let mut rims = self.rims(free);
            if round == 0 {
                let few = |(patch, missing): (&u32, &f64)| {
                    let points = rims.get(patch).into_iter().flatten();
                    let reached: f64 = points.map(|(n, way)| self.target[*n as usize] * norm(*way)).sum();
                    (missing.abs() > STEP * reached).then_some(*patch)
                };
                let few: BTreeSet<u32> = missing.iter().filter_map(few).collect();
                if !few.is_empty() {
                    self.divide_rims(&few, free);
                    rims = self.rims(free);
                }
            }
            if missing.is_empty() {
                return;
            }
            for (patch, missing) in missing {
                let Some(points) = rims.get(&patch) else { continue };
                let length: f64 = points.iter().map(|(_, way)| norm(*way)).sum();
                if length == 0.0 {
                    continue;
                }
                for &(n, way) in points {
                    let most = STEP * self.target[n as usize];
                    let by = (missing / length).clamp(-most, most);
                    let (x, normal, way) = (self.points[n as usize], self.normal_of(n, patch), unit(way));
                    // a point beyond the end of the face goes a shorter way
                    let to = [1.0, 0.5, 0.25, 0.125].iter().find_map(|part| {
                        let to: [f64; 3] = std::array::from_fn(|c| x[c] + part * by * way[c]);
                        let on = onto(to, normal)?;
                        (norm(subtract(on, to)) <= BESIDE * part * by.abs()).then_some(on)
                    });
                    if let Some(to) = to {
                        self.try_move(n, to);
                    }
                }
            }
            self.flip();
            self.relax(false);
        }
    }

    /// The areas that patches lack, those that are close left out.
    fn missing(&self, free: &impl Fn(u32) -> bool) -> BTreeMap<u32, f64> {
        let mut areas: BTreeMap<u32, f64> = BTreeMap::new();
        for t in (0..self.triangles.len() as u32).filter(|&t| self.is_alive(t) && !free(self.patch[t as usize])) {
            *areas.entry(self.patch[t as usize]).or_default() += 0.5 * norm(area(self.corners(t)));
        }
        let missing = |(patch, area): (u32, f64)| {
            let before = self.original.areas.get(&patch)?;
            ((area / before - 1.0).abs() > CLOSE).then_some((patch, before - area))
        };
        areas.into_iter().filter_map(missing).collect()
    }

    /// The points on the rim of each outer patch that may move, with the derivatives of its area within the patch.
    fn rims(&self, free: &impl Fn(u32) -> bool) -> BTreeMap<u32, Vec<(u32, [f64; 3])>> {
        let mut rims: BTreeMap<u32, Vec<(u32, [f64; 3])>> = BTreeMap::new();
        for n in (0..self.points.len() as u32).filter(|&n| !self.around[n as usize].is_empty()) {
            let patch = match self.places[n as usize] {
                Place::Border(p, q) if free(q) && !free(p) => p,
                Place::Border(p, q) if free(p) && !free(q) => q,
                _ => continue,
            };
            let mut way = [0.0; 3];
            for &t in self.around[n as usize].iter().filter(|t| self.patch[**t as usize] == patch) {
                let triangle = self.triangles[t as usize];
                let Some(k) = triangle.iter().position(|&m| m == n) else { continue };
                let at = |k: usize| self.points[triangle[k % 3] as usize];
                let part = cross(unit(area(self.corners(t))), subtract(at(k + 2), at(k + 1)));
                (0..3).for_each(|c| way[c] += 0.5 * part[c]);
            }
            let normal = self.normal_of(n, patch);
            let out = dot(way, normal);
            rims.entry(patch).or_default().push((n, std::array::from_fn(|c| way[c] - out * normal[c])));
        }
        rims
    }

    /// The normal of a patch at a point: the area-weighted mean over its triangles there.
    fn normal_of(&self, n: u32, patch: u32) -> [f64; 3] {
        let own = self.around[n as usize].iter().filter(|t| self.patch[**t as usize] == patch);
        let areas = own.map(|&t| area(self.corners(t)));
        unit(areas.fold([0.0; 3], |sum, part| std::array::from_fn(|c| sum[c] + part[c])))
    }

    /// Divides the edges on the rims of some patches.
    fn divide_rims(&mut self, patches: &BTreeSet<u32>, free: &impl Fn(u32) -> bool) {
        for [a, b] in self.edges() {
            let Some(pair) = self.at_edge(a, b) else { continue };
            let [p, q] = pair.map(|t| self.patch[t as usize]);
            let on_rim = free(p) != free(q) && (patches.contains(&p) || patches.contains(&q));
            if on_rim && self.length(a, b) > DIVIDED * self.target([a, b]) {
                self.split(a, b, pair);
            }
        }
    }
}
