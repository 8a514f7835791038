//! A surface of triangles.

use std::collections::HashMap;

use crate::crossings;
use crate::vector::area;

/// A surface of triangles with shared points.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TriangleSurface {
    /// Coordinates. \[L\]
    pub points: Vec<[f64; 3]>,
    /// Numbers of the points of each triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle, whether it lies on an outer face of its body.
    pub outer: Vec<bool>,
    /// For each triangle, the number of its body.
    pub bodies: Vec<u32>,
    /// For each triangle, the label of its outer face; 0 on faces without a label and inside.
    pub labels: Vec<u32>,
}

impl TriangleSurface {
    /// Corners of a triangle. \[L\]
    pub fn corners(&self, triangle: usize) -> [[f64; 3]; 3] {
        self.triangles[triangle].map(|n| self.points[n as usize])
    }

    /// Twice the vector area of a triangle, outward. \[L²\]
    pub(super) fn area_vector(&self, triangle: usize) -> [f64; 3] {
        area(self.corners(triangle))
    }

    /// The volume that the surface encloses, by the divergence theorem: ⅓ ∮ x · n dA, about a point
    /// of the surface. \[L³\]
    pub fn volume(&self) -> f64 {
        let Some(origin) = self.points.first() else { return 0.0 };
        let part = |t: usize| -> f64 {
            let (a, area) = (self.corners(t)[0], self.area_vector(t));
            (0..3).map(|c| (a[c] - origin[c]) * area[c]).sum::<f64>() / 6.0
        };
        (0..self.triangles.len()).map(part).sum()
    }

    /// The triangles for which `keep` holds, with the points they use, in the order of their first
    /// use.
    pub(crate) fn restricted(&self, keep: impl Fn(usize) -> bool) -> Self {
        let mut kept = Self::default();
        let mut numbers: HashMap<u32, u32> = HashMap::new();
        for t in (0..self.triangles.len()).filter(|&t| keep(t)) {
            kept.triangles.push(self.triangles[t].map(|n| {
                *numbers.entry(n).or_insert_with(|| {
                    kept.points.push(self.points[n as usize]);
                    kept.points.len() as u32 - 1
                })
            }));
            kept.outer.push(self.outer[t]);
            kept.bodies.push(self.bodies[t]);
            kept.labels.push(self.labels[t]);
        }
        kept
    }

    /// Number of edges that are not shared by exactly two triangles running along them in opposite
    /// directions: 0 for a closed, oriented surface.
    pub fn open_edges(&self) -> usize {
        let mut directed: HashMap<(u32, u32), u32> = HashMap::new();
        for t in &self.triangles {
            for k in 0..3 {
                *directed.entry((t[k], t[(k + 1) % 3])).or_default() += 1;
            }
        }
        directed.iter().filter(|((a, b), count)| **count != 1 || directed.get(&(*b, *a)) != Some(&1)).count()
    }

    /// Number of pairs of triangles of the same body that cross or touch each other beyond their common corners and
    /// edge, by exact predicates: 0 for a surface that bounds a solid.
    pub fn crossings(&self) -> usize {
        crossings::count(&self.points, &self.triangles, &self.bodies)
    }

    /// Number of connected surfaces: 1 for a single piece without cavities.
    pub fn pieces(&self) -> usize {
        self.shells().1
    }

    /// The number of the connected surface to which each triangle belongs, and how many there are.
    fn shells(&self) -> (Vec<u32>, usize) {
        let mut parent: Vec<u32> = (0..self.points.len() as u32).collect();
        fn root(parent: &mut [u32], mut n: u32) -> u32 {
            while parent[n as usize] != n {
                parent[n as usize] = parent[parent[n as usize] as usize];
                n = parent[n as usize];
            }
            n
        }
        for t in &self.triangles {
            let first = root(&mut parent, t[0]);
            for &n in t {
                let other = root(&mut parent, n);
                parent[other as usize] = first;
            }
        }
        let mut numbers: HashMap<u32, u32> = HashMap::new();
        let mut number = |t: &[u32; 3]| {
            let next = numbers.len() as u32;
            *numbers.entry(root(&mut parent, t[0])).or_insert(next)
        };
        let of: Vec<u32> = self.triangles.iter().map(&mut number).collect();
        (of, numbers.len())
    }

    /// The surface without connected surfaces that enclose less than a volume \[L³\], be they around
    /// material or around cavities.
    pub(super) fn without_shells_below(self, volume: f64) -> Self {
        let (shell, count) = self.shells();
        let mut volumes = vec![0.0; count];
        let mut origins = vec![None; count];
        for (t, &number) in shell.iter().enumerate() {
            let (corner, area) = (self.corners(t)[0], self.area_vector(t));
            let origin: &[f64; 3] = origins[number as usize].get_or_insert(corner);
            volumes[number as usize] += (0..3).map(|c| (corner[c] - origin[c]) * area[c]).sum::<f64>() / 6.0;
        }
        if volumes.iter().all(|v| v.abs() >= volume) {
            return self;
        }
        self.restricted(|t| volumes[shell[t] as usize].abs() >= volume)
    }
}
