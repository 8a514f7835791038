//! Extracts the surface of the part of a lattice that is above a threshold.

use std::collections::HashMap;

use super::lattice::{Lattice, Tetrahedron};
use super::surface::TriangleSurface;
use super::thin::above;

/// Smallest distance between a point of the surface and a vertex of the lattice, as a fraction of
/// the edge: between vertices of hexahedra or wedges, so that points stay distinct, and between those
/// of tetrahedra. Closer points would make slivers and knife edges there, and smoothing removes the
/// steps; layers of hexahedra would become thicker or thinner instead.
pub(super) const NEAREST: [f64; 2] = [0.02, 0.12];

/// Even permutations that put the one or two vertices above the threshold first.
const ONE: [[usize; 4]; 4] = [[0, 1, 2, 3], [1, 0, 3, 2], [2, 0, 1, 3], [3, 0, 2, 1]];
const TWO: [[usize; 4]; 6] = [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 2, 0], [2, 3, 0, 1]];

/// The closed, outward-oriented surface around everything above the threshold; without triangles if
/// nothing is above it. Its points keep off the vertices of the lattice by fractions `nearest`
/// of the edges, as [`NEAREST`].
pub(super) fn extract(lattice: &Lattice, threshold: f64, nearest: [f64; 2]) -> TriangleSurface {
    let mut extraction = Extraction {
        lattice,
        threshold,
        nearest,
        above: above(lattice, threshold),
        points: HashMap::new(),
        surface: TriangleSurface::default(),
    };
    for cell in &lattice.cells {
        for tetrahedron in cell.tetrahedra() {
            let before = extraction.surface.triangles.len();
            extraction.crossing(&tetrahedron);
            let inside = extraction.surface.triangles.len() - before;
            extraction.surface.outer.extend(std::iter::repeat_n(false, inside));
            extraction.surface.labels.extend(std::iter::repeat_n(0, inside));
            for (triangle, label) in tetrahedron.outer.into_iter().flatten() {
                let before = extraction.surface.triangles.len();
                extraction.cap(triangle);
                let added = extraction.surface.triangles.len() - before;
                extraction.surface.outer.extend(std::iter::repeat_n(true, added));
                extraction.surface.labels.extend(std::iter::repeat_n(label, added));
            }
            let added = extraction.surface.triangles.len() - before;
            extraction.surface.bodies.extend(std::iter::repeat_n(cell.body, added));
        }
    }
    extraction.surface
}

struct Extraction<'a> {
    lattice: &'a Lattice,
    threshold: f64,
    nearest: [f64; 2],
    above: Vec<bool>,
    /// Points of the surface by the lattice edge on which they lie; (v, v) is the vertex v itself.
    points: HashMap<(u32, u32), u32>,
    surface: TriangleSurface,
}

impl Extraction<'_> {
    /// The point on the edge from `a`, above the threshold, to `b`, not above; if both are the
    /// same, the vertex `a`.
    fn point(&mut self, a: u32, b: u32) -> u32 {
        let Self { lattice, threshold, nearest, points, surface, .. } = self;
        *points.entry((a, b)).or_insert_with(|| {
            let (at, to) = (a as usize, b as usize);
            let along = if a == b {
                0.0
            } else {
                // vertices of thin walls and gaps count as above or below although their values are not
                let (from, to) = (lattice.values[at].max(*threshold), lattice.values[to].min(*threshold));
                let nearest = nearest[usize::from(lattice.tetrahedral[a as usize] && lattice.tetrahedral[b as usize])];
                let along = if from > to { (from - *threshold) / (from - to) } else { 0.5 };
                along.clamp(nearest, 1.0 - nearest)
            };
            let (p, q) = (lattice.points[at], lattice.points[to]);
            // The vertex itself, bit for bit.
            surface.points.push(std::array::from_fn(|c| if a == b { p[c] } else { p[c] + along * (q[c] - p[c]) }));
            (surface.points.len() - 1) as u32
        })
    }

    fn triangle(&mut self, corners: [(u32, u32); 3]) {
        let triangle = corners.map(|(a, b)| self.point(a, b));
        self.surface.triangles.push(triangle);
    }

    fn quadrilateral(&mut self, [a, b, c, d]: [(u32, u32); 4]) {
        self.triangle([a, b, c]);
        self.triangle([a, c, d]);
    }

    /// The polygon in which the surface crosses the tetrahedron; its corners are counter-clockwise
    /// seen from the side below the threshold.
    fn crossing(&mut self, Tetrahedron { vertices, .. }: &Tetrahedron) {
        let above = vertices.map(|v| self.above[v as usize]);
        let ordered = |order: &[usize; 4]| order.map(|k| vertices[k]);
        match above.iter().filter(|&&is| is).count() {
            1 => {
                let [p, q, r, s] = ordered(&ONE[above.iter().position(|&is| is).unwrap_or(0)]);
                self.triangle([(p, q), (p, r), (p, s)]);
            }
            2 => {
                let order = TWO.iter().find(|order| above[order[0]] && above[order[1]]);
                let [p, q, r, s] = ordered(order.unwrap_or(&TWO[0]));
                self.quadrilateral([(p, r), (p, s), (q, s), (q, r)]);
            }
            3 => {
                let [p, q, r, s] = ordered(&ONE[above.iter().position(|&is| !is).unwrap_or(0)]);
                self.triangle([(q, p), (s, p), (r, p)]);
            }
            _ => {}
        }
    }

    /// The part of an outer triangle of the body that is above the threshold.
    fn cap(&mut self, triangle: [u32; 3]) {
        let above = triangle.map(|v| self.above[v as usize]);
        let turned = |k: usize| [triangle[k], triangle[(k + 1) % 3], triangle[(k + 2) % 3]];
        match above.iter().filter(|&&is| is).count() {
            1 => {
                let [p, q, r] = turned(above.iter().position(|&is| is).unwrap_or(0));
                self.triangle([(p, p), (p, q), (p, r)]);
            }
            2 => {
                let [p, q, r] = turned(above.iter().position(|&is| !is).unwrap_or(0));
                self.quadrilateral([(q, q), (r, r), (r, p), (q, p)]);
            }
            3 => self.triangle(triangle.map(|v| (v, v))),
            _ => {}
        }
    }
}
