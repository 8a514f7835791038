//! The changes that a pass makes: splits, collapses, flips and moves.

use std::collections::BinaryHeap;

use super::{LONGEST, Place, Remesh, SHORTEST, TURN};
use crate::vector::{area, dot, norm, shape};

impl Remesh<'_> {
    /// Splits edges at their middle until none is too long, the longest first: in any other order,
    /// thin triangles could be split forever.
    pub(super) fn split_long(&mut self) {
        let long = |remesh: &Self, [a, b]: [u32; 2]| {
            let length = remesh.length(a, b);
            // lengths are positive, so their bits have the same order
            (length > LONGEST * remesh.target([a, b])).then_some((length.to_bits(), [a, b]))
        };
        let mut open: BinaryHeap<(u64, [u32; 2])> =
            self.edges().into_iter().filter_map(|edge| long(self, edge)).collect();
        while let Some((_, [a, b])) = open.pop() {
            let Some(pair) = self.at_edge(a, b) else { continue };
            let [c, d] = pair.map(|t| self.opposite(t, a, b));
            let middle = self.split(a, b, pair);
            open.extend([a, b, c, d].into_iter().filter_map(|end| long(self, [end, middle])));
        }
    }

    /// Inserts a point in the middle of an edge; returns its number.
    pub(super) fn split(&mut self, a: u32, b: u32, pair: [u32; 2]) -> u32 {
        let [p, q] = pair.map(|t| self.patch[t as usize]);
        let place = match p == q {
            true if self.is_crease([a, b], pair) => Place::Corner,
            true => Place::Patch(p),
            false => Place::Border(p.min(q), p.max(q)),
        };
        let (from, to) = (self.points[a as usize], self.points[b as usize]);
        let middle = self.points.len() as u32;
        let point = std::array::from_fn(|c| from[c] + 0.5 * (to[c] - from[c]));
        self.points.push(point);
        self.target.push(self.lengths.at(point));
        self.places.push(place);
        self.around.push(Vec::new());
        for t in pair {
            // the old triangle keeps `a`, a new one gets `b`
            let added = self.triangles.len() as u32;
            let old = self.triangles[t as usize];
            self.triangles.push(old.map(|n| if n == a { middle } else { n }));
            self.patch.push(self.patch[t as usize]);
            self.triangles[t as usize] = old.map(|n| if n == b { middle } else { n });
            self.around[b as usize].retain(|&other| other != t);
            self.around[b as usize].push(added);
            let opposite = old.into_iter().find(|&n| n != a && n != b);
            self.around[opposite.unwrap_or(a) as usize].push(added);
            self.around[middle as usize].extend([t, added]);
        }
        middle
    }

    /// Collapses short edges where this keeps patches, borders and orientation, and crosses nothing.
    pub(super) fn collapse_short(&mut self) {
        let mut edges: Vec<(f64, [u32; 2])> = self.edges().into_iter().map(|e| (self.length(e[0], e[1]), e)).collect();
        edges.retain(|(length, edge)| *length < SHORTEST * self.target(*edge));
        edges.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        for (_, [a, b]) in edges {
            // the edge may have changed since
            let short = self.at_edge(a, b).is_some() && self.length(a, b) < SHORTEST * self.target([a, b]);
            if short && !self.try_collapse(a, b) {
                self.try_collapse(b, a);
            }
        }
    }

    /// Moves point `gone` onto point `kept` and removes the edge between them, if that is possible.
    fn try_collapse(&mut self, gone: u32, kept: u32) -> bool {
        let Some(pair) = self.at_edge(gone, kept) else { return false };
        let allowed = match self.places[gone as usize] {
            Place::Corner => false,
            Place::Border(..) => self.is_border(pair),
            Place::Patch(_) => true,
        };
        if !allowed {
            return false;
        }
        let opposite = pair.map(|t| self.opposite(t, gone, kept));
        // The two ends may have no other common neighbours, otherwise the surface would be pinched.
        let others = self.neighbours(kept);
        let common = self.neighbours(gone).into_iter().filter(|n| others.binary_search(n).is_ok()).count();
        let folds = |&x: &u32| self.joined_by_border(gone, x) && self.joined_by_border(kept, x);
        if common != 2 || opposite[0] == opposite[1] || opposite.iter().any(folds) {
            return false;
        }
        // Three triangles around a point of the surface must remain.
        if opposite.iter().any(|&n| self.around[n as usize].len() <= 3) {
            return false;
        }
        let target = self.points[kept as usize];
        let staying: Vec<u32> = self.around[gone as usize].iter().copied().filter(|t| !pair.contains(t)).collect();
        for &t in &staying {
            let corners = self.triangles[t as usize];
            let (normal, quality) = shape(self.corners(t));
            let moved = corners.map(|n| if n == gone { target } else { self.points[n as usize] });
            let (now, then) = shape(moved);
            let mut ends = corners.iter().filter(|&&n| n != gone && n != kept);
            let long = ends.any(|&n| self.length(n, kept) > LONGEST * self.target([n, kept]));
            let degenerate = then < 0.1 && then < quality;
            // slivers have no reliable normal
            if long || degenerate || quality > 0.01 && dot(normal, now) < TURN {
                return false;
            }
        }
        let onto = |n: u32| if n == gone { kept } else { n };
        let changed: Vec<(u32, [u32; 3])> =
            staying.iter().map(|&t| (t, self.triangles[t as usize].map(onto))).collect();
        let whole: Vec<(u32, [u32; 3])> =
            self.around[gone as usize].iter().map(|&t| (t, self.triangles[t as usize])).collect();
        if self.folds(&changed, &pair) > self.folds(&whole, &[]) || self.would_cross(&changed, &pair) {
            return false;
        }
        for &t in &staying {
            self.triangles[t as usize] = self.triangles[t as usize].map(|n| if n == gone { kept } else { n });
            self.around[kept as usize].push(t);
        }
        self.found_again(&staying);
        for t in pair {
            self.triangles[t as usize] = [u32::MAX; 3];
            for n in opposite.into_iter().chain([kept]) {
                self.around[n as usize].retain(|&other| other != t);
            }
        }
        self.around[gone as usize].clear();
        true
    }

    /// Replaces the diagonal of two triangles by the other one where this enlarges their smallest
    /// quality.
    pub(super) fn flip(&mut self) {
        for [a, b] in self.edges() {
            let Some(pair) = self.at_edge(a, b) else { continue };
            if self.is_border(pair) || self.is_crease([a, b], pair) {
                continue;
            }
            let [s, t] = pair;
            let (c, d) = (self.opposite(s, a, b), self.opposite(t, a, b));
            if c == d || self.neighbours(c).binary_search(&d).is_ok() {
                continue;
            }
            let new = [[a, d, c], [d, b, c]];
            let corners = new.map(|triangle| triangle.map(|n| self.points[n as usize]));
            let (before, after) = ([shape(self.corners(s)), shape(self.corners(t))], corners.map(shape));
            let least = |of: [([f64; 3], f64); 2]| of[0].1.min(of[1].1);
            let sum: [f64; 3] = {
                let (u, v) = (area(self.corners(s)), area(self.corners(t)));
                std::array::from_fn(|c| u[c] + v[c])
            };
            let length = norm(sum);
            let upright = after.iter().all(|(normal, _)| dot(*normal, sum) > 0.866 * length);
            let changed = [(s, new[0]), (t, new[1])];
            let folds = self.folds(&[(s, self.triangles[s as usize]), (t, self.triangles[t as usize])], &[]);
            let better = least(after) > least(before) * 1.001;
            if better && upright && self.folds(&changed, &[]) <= folds && !self.would_cross(&changed, &[]) {
                self.triangles[s as usize] = new[0];
                self.triangles[t as usize] = new[1];
                self.around[b as usize].retain(|&other| other != s);
                self.around[a as usize].retain(|&other| other != t);
                self.around[c as usize].push(t);
                self.around[d as usize].push(s);
                self.found_again(&pair);
            }
        }
    }

    /// Moves points within the surface towards the centroid of their triangles, and points on
    /// borders, if these are to move, towards the middle of their two neighbours there; then projects them.
    pub(super) fn relax(&mut self, borders: bool) {
        for n in 0..self.points.len() as u32 {
            let place = self.places[n as usize];
            let stays = place == Place::Corner || !borders && matches!(place, Place::Border(..));
            if self.around[n as usize].is_empty() || stays {
                continue;
            }
            let (x, normal) = (self.points[n as usize], self.normal(n));
            let goal = match place {
                Place::Border(..) => {
                    let ends = self.neighbours(n).into_iter().filter(|&m| self.joined_by_border(n, m));
                    let ends: Vec<[f64; 3]> = ends.map(|m| self.points[m as usize]).collect();
                    let [a, b] = ends[..] else { continue };
                    std::array::from_fn(|c| x[c] + 0.25 * ((a[c] - x[c]) + (b[c] - x[c])))
                }
                _ => {
                    let (mut sum, mut weight) = ([0.0; 3], 0.0);
                    for &t in &self.around[n as usize] {
                        let corners = self.corners(t);
                        let size = norm(area(corners));
                        weight += size;
                        for c in 0..3 {
                            sum[c] += size * corners.iter().map(|p| p[c] - x[c]).sum::<f64>() / 3.0;
                        }
                    }
                    if weight == 0.0 {
                        continue;
                    }
                    let pull = sum.map(|c| c / weight);
                    let out = dot(pull, normal);
                    std::array::from_fn(|c| x[c] + (pull[c] - out * normal[c]))
                }
            };
            if let Some(to) = self.original.project(place, goal, normal) {
                self.try_move(n, to);
            }
        }
    }
}
