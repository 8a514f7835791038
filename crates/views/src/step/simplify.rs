//! Fewer triangles for the same surface, within a tolerance.

use std::collections::{BTreeSet, BinaryHeap};

use super::surface::V;

/// Cosine of the largest angle by which a triangle turns (25°).
const TURN: f64 = 0.9;

/// Smallest height of a triangle relative to its longest edge.
const FLAT: f64 = 0.15;

/// A closed surface of triangles, of which some points may be removed.
struct Surface {
    points: Vec<V>,
    triangles: Vec<[u32; 3]>,
    alive: Vec<bool>,
    /// The triangles at each point.
    around: Vec<Vec<u32>>,
    /// How far the original surface is from the triangles at each point. \[L\]
    off: Vec<f64>,
}

/// The triangles that remain if points that are `free` are moved into neighbours until the surface would leave the original by
/// `tolerance` \[L\] or its volume would change by `volume` \[L³\]. Each has its number before. Triangles turn by at
/// most 25°.
pub(crate) fn simplified(
    points: &[[f64; 3]],
    triangles: &[[u32; 3]],
    free: &[bool],
    (tolerance, volume): (f64, f64),
) -> Vec<(usize, [u32; 3])> {
    let mut surface = Surface {
        points: points.iter().map(|&x| x.into()).collect(),
        triangles: triangles.to_vec(),
        alive: vec![true; triangles.len()],
        around: vec![Vec::new(); points.len()],
        off: vec![0.0; points.len()],
    };
    for (t, corners) in (0..).zip(triangles) {
        corners.iter().for_each(|&n| surface.around[n as usize].push(t));
    }
    let mut changed = 0.0;
    let mut queue: BinaryHeap<Entry> =
        (0..points.len() as u32).filter(|&n| free[n as usize]).filter_map(|n| surface.entry(n, tolerance)).collect();
    while let Some(Entry { cost, point, into }) = queue.pop() {
        // what has changed since
        match surface.entry(point, tolerance) {
            Some(now) if now.cost <= cost * (1.0 + 1e-12) && now.into == into => {}
            Some(now) => {
                queue.push(now);
                continue;
            }
            None => continue,
        }
        let by = surface.volume_of(point, into);
        if (changed + by).abs() > volume {
            continue;
        }
        changed += by;
        for n in surface.collapse(point, into, cost) {
            if free[n as usize] {
                queue.extend(surface.entry(n, tolerance));
            }
        }
    }
    (0..triangles.len()).filter(|&t| surface.alive[t]).map(|t| (t, surface.triangles[t])).collect()
}

/// A point, the neighbour into which it may move, and how far the surface is then from the original.
#[derive(PartialEq)]
struct Entry {
    cost: f64,
    point: u32,
    into: u32,
}

impl Eq for Entry {}

impl Ord for Entry {
    /// The smallest cost first.
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        other.cost.total_cmp(&self.cost).then_with(|| other.point.cmp(&self.point))
    }
}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Surface {
    fn at(&self, n: u32) -> V {
        self.points[n as usize]
    }

    /// The neighbours of a point.
    fn ring(&self, n: u32) -> BTreeSet<u32> {
        let corners = self.around[n as usize].iter().flat_map(|&t| self.triangles[t as usize]);
        corners.filter(|&other| other != n).collect()
    }

    /// The triangles at a point after it has moved into a neighbour.
    fn moved(&self, point: u32, into: u32) -> impl Iterator<Item = ([u32; 3], [u32; 3])> + '_ {
        let corners = self.around[point as usize].iter().map(|&t| self.triangles[t as usize]);
        corners
            .filter(move |corners| !corners.contains(&into))
            .map(move |corners| (corners, corners.map(|n| if n == point { into } else { n })))
    }

    fn area(&self, [a, b, c]: [u32; 3]) -> V {
        (self.at(b) - self.at(a)).cross(&(self.at(c) - self.at(a)))
    }

    /// The cheapest move of a point, if one is within the tolerance.
    fn entry(&self, point: u32, tolerance: f64) -> Option<Entry> {
        let ring = self.ring(point);
        let costs = ring.iter().filter_map(|&into| Some((self.cost(point, into, &ring)?, into)));
        let (cost, into) = costs.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (cost <= tolerance).then_some(Entry { cost, point, into })
    }

    fn cost(&self, point: u32, into: u32, ring: &BTreeSet<u32>) -> Option<f64> {
        if self.ring(into).intersection(ring).count() != 2 || self.around[point as usize].is_empty() {
            return None;
        }
        let x = self.at(point);
        let mut nearest = f64::INFINITY;
        for (before, after) in self.moved(point, into) {
            let (old, new) = (self.area(before), self.area(after));
            let [a, b, c] = after.map(|n| self.at(n));
            let longest = [(b - a).norm(), (c - b).norm(), (a - c).norm()].into_iter().fold(0.0, f64::max);
            if new.norm() < FLAT * longest * longest || new.dot(&old) < TURN * new.norm() * old.norm() {
                return None;
            }
            // the point and the middles of its edges
            nearest = nearest.min(distance(&x, [a, b, c]));
        }
        let known = ring.iter().chain([&point]).map(|&n| self.off[n as usize]).fold(0.0, f64::max);
        Some(nearest + known)
    }

    /// How much the volume grows if a point moves into a neighbour. \[L³\]
    fn volume_of(&self, point: u32, into: u32) -> f64 {
        let by = self.at(into) - self.at(point);
        self.around[point as usize].iter().map(|&t| self.area(self.triangles[t as usize]).dot(&by) / 6.0).sum()
    }

    /// Moves a point into a neighbour; returns the points around.
    fn collapse(&mut self, point: u32, into: u32, cost: f64) -> BTreeSet<u32> {
        let ring = self.ring(point);
        for t in std::mem::take(&mut self.around[point as usize]) {
            let corners = self.triangles[t as usize];
            if corners.contains(&into) {
                self.alive[t as usize] = false;
                corners
                    .iter()
                    .filter(|&&n| n != point)
                    .for_each(|&n| self.around[n as usize].retain(|&other| other != t));
            } else {
                self.triangles[t as usize] = corners.map(|n| if n == point { into } else { n });
                self.around[into as usize].push(t);
            }
        }
        for &n in &ring {
            self.off[n as usize] = self.off[n as usize].max(cost);
        }
        ring
    }
}

/// Distance of a point from a triangle. \[L\]
fn distance(x: &V, [a, b, c]: [V; 3]) -> f64 {
    let normal = (b - a).cross(&(c - a));
    let inside = [(a, b), (b, c), (c, a)].iter().all(|(p, q)| normal.dot(&(q - p).cross(&(x - p))) >= 0.0);
    if inside {
        return (x - a).dot(&normal).abs() / normal.norm();
    }
    let to = |p: V, q: V| {
        let along = ((x - p).dot(&(q - p)) / (q - p).norm_squared()).clamp(0.0, 1.0);
        (x - p - (q - p) * along).norm()
    };
    to(a, b).min(to(b, c)).min(to(c, a))
}
