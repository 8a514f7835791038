//! Triangles that cross each other, found with exact predicates.
//!
//! Two triangles cross if they have a point in common that is not on their common corners and edge;
//! touching counts. The predicates are exact (J. R. Shewchuk, Adaptive precision floating-point
//! arithmetic and fast robust geometric predicates, Discrete Comput. Geom. 18 (1997) 305–363), so a
//! surface without crossings is embedded, not only up to round-off.

use std::collections::HashMap;

use robust::{Coord, Coord3D, orient2d, orient3d};

use crate::vector::area;

/// The number of pairs of triangles of the same body that cross each other.
pub(crate) fn count(points: &[[f64; 3]], triangles: &[[u32; 3]], bodies: &[u32]) -> usize {
    let mut near = Near::of(points, triangles);
    let mut found = 0;
    for (t, triangle) in (0..).zip(triangles) {
        let same = |other: &u32| *other < t && bodies[*other as usize] == bodies[t as usize];
        let others = near.around(points, triangle).iter().copied().filter(same);
        found += others.filter(|&other| cross(points, triangle, &triangles[other as usize])).count();
    }
    found
}

/// Triangles by the cells of a lattice that their bounding boxes meet.
#[derive(Debug, Default)]
pub(crate) struct Near {
    size: f64,
    cells: HashMap<[i32; 3], Vec<u32>>,
    found: Vec<u32>,
}

impl Near {
    /// All triangles of a surface, in cells as large as the mean triangle's box.
    pub fn of(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Self {
        let longest = |triangle: &[u32; 3]| {
            let [min, max] = bounds(points, triangle);
            (0..3).map(|c| max[c] - min[c]).fold(0.0, f64::max)
        };
        let mean = triangles.iter().map(longest).sum::<f64>() / triangles.len().max(1) as f64;
        let mut near = Self { size: if mean > 0.0 { mean } else { 1.0 }, ..Self::default() };
        (0..).zip(triangles).for_each(|(t, triangle)| near.insert(points, t, triangle));
        near
    }

    /// Adds a triangle, or one that was changed; where it was before, it is found still.
    pub fn insert(&mut self, points: &[[f64; 3]], number: u32, triangle: &[u32; 3]) {
        for cell in cells(self.size, bounds(points, triangle)) {
            let inside = self.cells.entry(cell).or_default();
            if !inside.contains(&number) {
                inside.push(number);
            }
        }
    }

    /// The triangles that may meet a triangle, ascending; more than do, but never fewer.
    pub fn around(&mut self, points: &[[f64; 3]], triangle: &[u32; 3]) -> &[u32] {
        self.found.clear();
        for cell in cells(self.size, bounds(points, triangle)) {
            self.found.extend(self.cells.get(&cell).into_iter().flatten());
        }
        self.found.sort_unstable();
        self.found.dedup();
        &self.found
    }
}

impl Near {
    /// The triangles in the cell of a point and in the 26 around it, ascending.
    pub fn beside(&mut self, x: [f64; 3]) -> &[u32] {
        self.found.clear();
        for cell in cells(self.size, [x.map(|c| c - self.size), x.map(|c| c + self.size)]) {
            self.found.extend(self.cells.get(&cell).into_iter().flatten());
        }
        self.found.sort_unstable();
        self.found.dedup();
        &self.found
    }
}

fn cells(size: f64, [min, max]: [[f64; 3]; 2]) -> impl Iterator<Item = [i32; 3]> {
    let at = move |x: f64| (x / size).floor() as i32;
    let (from, to) = (min.map(at), max.map(at));
    let along = move |c: usize| from[c]..=to[c];
    along(0).flat_map(move |i| along(1).flat_map(move |j| along(2).map(move |k| [i, j, k])))
}

/// The lowest and highest corners of the bounding box of a triangle.
fn bounds(points: &[[f64; 3]], triangle: &[u32; 3]) -> [[f64; 3]; 2] {
    let at = triangle.map(|n| points[n as usize]);
    let of = |pick: fn(f64, f64) -> f64| std::array::from_fn(|c| pick(pick(at[0][c], at[1][c]), at[2][c]));
    [of(f64::min), of(f64::max)]
}

/// Whether two different triangles of a surface cross.
pub(crate) fn cross(points: &[[f64; 3]], s: &[u32; 3], t: &[u32; 3]) -> bool {
    let (a, b) = (bounds(points, s), bounds(points, t));
    if (0..3).any(|c| a[1][c] < b[0][c] || b[1][c] < a[0][c]) {
        return false;
    }
    let at = |triangle: &[u32; 3]| triangle.map(|n| points[n as usize]);
    let common = s.iter().filter(|n| t.contains(n)).count();
    match common {
        0 => edges(at(s)).any(|e| meets(e, at(t))) || edges(at(t)).any(|e| meets(e, at(s))),
        1 => {
            let (u, v) = (first(s, |n| t.contains(&n)), first(t, |n| s.contains(&n)));
            let (u, v) = (u.map(|n| points[n as usize]), v.map(|n| points[n as usize]));
            meets([u[1], u[2]], v) || meets([v[1], v[2]], u)
        }
        2 => {
            // in one plane, and on the same side of the common edge
            let (u, v) = (first(s, |n| !t.contains(&n)), first(t, |n| !s.contains(&n)));
            let [c, a, b, d] = [u[0], u[1], u[2], v[0]].map(|n| points[n as usize]);
            let [c2, a2, b2, d2] = in_plane(&[c, a, b], [c, a, b, d]);
            space([c, a, b], d) == 0.0 && plane(a2, b2, c2) * plane(a2, b2, d2) >= 0.0
        }
        _ => true,
    }
}

/// The corners of a triangle in the same order, beginning with the one that `begins`.
fn first(triangle: &[u32; 3], begins: impl Fn(u32) -> bool) -> [u32; 3] {
    let k = (0..3).find(|&k| begins(triangle[k])).unwrap_or(0);
    [triangle[k], triangle[(k + 1) % 3], triangle[(k + 2) % 3]]
}

fn edges(corners: [[f64; 3]; 3]) -> impl Iterator<Item = [[f64; 3]; 2]> {
    (0..3).map(move |k| [corners[k], corners[(k + 1) % 3]])
}

/// Six times the volume of a tetrahedron over a triangle, with the exact sign.
fn space([a, b, c]: [[f64; 3]; 3], d: [f64; 3]) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|[x, y, z]| Coord3D { x, y, z });
    orient3d(a, b, c, d)
}

/// Twice the area of a plane triangle, with the exact sign.
fn plane(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let [a, b, c] = [a, b, c].map(|[x, y]| Coord { x, y });
    orient2d(a, b, c)
}

/// Whether a segment and a triangle have a point in common.
fn meets([p, q]: [[f64; 3]; 2], triangle: [[f64; 3]; 3]) -> bool {
    let sides = [space(triangle, p), space(triangle, q)];
    if sides.iter().all(|&s| s > 0.0) || sides.iter().all(|&s| s < 0.0) {
        return false;
    }
    if sides == [0.0; 2] {
        return meets_in_plane([p, q], triangle);
    }
    let [a, b, c] = triangle;
    let around = [[a, b], [b, c], [c, a]].map(|[u, v]| space([p, q, u], v));
    around.iter().all(|&s| s >= 0.0) || around.iter().all(|&s| s <= 0.0)
}

/// Points without the coordinate along which a triangle has the largest area.
fn in_plane<const N: usize>(triangle: &[[f64; 3]; 3], points: [[f64; 3]; N]) -> [[f64; 2]; N] {
    let normal = area(*triangle).map(f64::abs);
    let along = (0..3).max_by(|&a, &b| normal[a].total_cmp(&normal[b])).unwrap_or(0);
    points.map(|p| [p[(along + 1) % 3], p[(along + 2) % 3]])
}

fn meets_in_plane([p, q]: [[f64; 3]; 2], triangle: [[f64; 3]; 3]) -> bool {
    let [p, q, a, b, c] = in_plane(&triangle, [p, q, triangle[0], triangle[1], triangle[2]]);
    let around = [[a, b], [b, c], [c, a]];
    let of_p = around.map(|[u, v]| plane(u, v, p));
    let inside = of_p.iter().all(|&s| s >= 0.0) || of_p.iter().all(|&s| s <= 0.0);
    inside || around.iter().any(|&[u, v]| segments_meet([p, q], [u, v]))
}

fn segments_meet([p, q]: [[f64; 2]; 2], [u, v]: [[f64; 2]; 2]) -> bool {
    let apart = |c: usize| p[c].max(q[c]) < u[c].min(v[c]) || u[c].max(v[c]) < p[c].min(q[c]);
    let beside = |a: f64, b: f64| a > 0.0 && b > 0.0 || a < 0.0 && b < 0.0;
    !(apart(0) || apart(1) || beside(plane(p, q, u), plane(p, q, v)) || beside(plane(u, v, p), plane(u, v, q)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLAT: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    /// Whether the triangle FLAT and one with other corners cross.
    fn with(other: [[f64; 3]; 3]) -> bool {
        let points = [FLAT, other].concat();
        let crossing = cross(&points, &[0, 1, 2], &[3, 4, 5]);
        assert_eq!(crossing, cross(&points, &[4, 5, 3], &[2, 1, 0]), "in any order");
        assert_eq!(count(&points, &[[0, 1, 2], [3, 4, 5]], &[0, 0]), usize::from(crossing));
        crossing
    }

    #[test]
    fn separate_triangles() {
        assert!(with([[0.2, 0.2, -1.0], [0.3, 0.2, 1.0], [0.2, 0.3, 1.0]]), "through");
        assert!(with([[0.2, 0.2, 0.0], [0.3, 0.2, 1.0], [0.2, 0.3, 1.0]]), "a corner touches");
        assert!(!with([[0.2, 0.2, 1e-300], [0.3, 0.2, 1.0], [0.2, 0.3, 1.0]]), "by a hair above");
        assert!(!with([[0.6, 0.6, -1.0], [0.7, 0.6, 1.0], [0.6, 0.7, 1.0]]), "beside");
        assert!(with([[0.1, 0.1, 0.0], [0.2, 0.1, 0.0], [0.1, 0.2, 0.0]]), "inside, in the same plane");
        assert!(!with([[0.6, 0.6, 0.0], [1.0, 0.6, 0.0], [0.6, 1.0, 0.0]]), "beside, in the same plane");
    }

    #[test]
    fn neighbours() {
        let of = |x: [f64; 3], y: [f64; 3], s: &[u32; 3]| cross(&[&FLAT[..], &[x, y]].concat(), &[0, 1, 2], s);
        assert!(!of([1.0, 1.0, 0.0], [0.0; 3], &[2, 1, 3]), "continue in their plane");
        assert!(of([0.1, 0.2, 0.0], [0.0; 3], &[2, 1, 3]), "folded onto each other");
        assert!(!of([0.1, 0.2, 1e-300], [0.0; 3], &[2, 1, 3]), "almost folded");
        assert!(!of([-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], &[0, 3, 4]), "one common corner");
        assert!(of([0.5, 0.5, 1.0], [0.5, 0.5, -1.0], &[0, 3, 4]), "through, from a common corner");
        assert!(of([0.9, 0.0, 0.0], [0.0, -1.0, 0.0], &[0, 3, 4]), "an edge along an edge");
    }
}
