//! The distance between two surfaces.

use nalgebra::Vector3;
use slipstick_mesh::{FacetNodes, FacetTree, Mesh, facet_area};

type Point = Vector3<f64>;

/// Two surfaces in space, each given by its facets.
pub(super) struct SurfacePair<'a> {
    facets: [&'a [FacetNodes]; 2],
    nodes: [Vec<u32>; 2],
}

/// Smallest and largest displacement of a surface in each direction. \[L\]
pub(super) type Displacements = [[f64; 2]; 3];

impl<'a> SurfacePair<'a> {
    pub fn new(facets: [&'a [FacetNodes]; 2]) -> Self {
        let nodes = facets.map(|facets| {
            let mut nodes: Vec<u32> = facets.iter().flatten().copied().collect();
            nodes.sort_unstable();
            nodes.dedup();
            nodes
        });
        Self { facets, nodes }
    }

    /// Side of the smallest facet in the reference configuration. \[L\]
    pub fn smallest_facet(&self, mesh: &Mesh) -> f64 {
        let areas = self.facets.iter().flat_map(|facets| facets.iter().map(|f| facet_area(&f.corners(&mesh.nodes))));
        areas.fold(f64::INFINITY, f64::min).sqrt()
    }

    /// The range of displacements of a surface from positions `from` to `to` (3 per node).
    pub fn displacements(&self, surface: usize, from: &[f64], to: &[f64]) -> Displacements {
        let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        for &node in &self.nodes[surface] {
            for (c, [low, high]) in range.iter_mut().enumerate() {
                let at = 3 * node as usize + c;
                (*low, *high) = (low.min(to[at] - from[at]), high.max(to[at] - from[at]));
            }
        }
        range
    }

    /// Distance between the surfaces at positions `x` (3 per node), if they do not intersect;
    /// `None` without facets. Each quadrilateral is represented by four triangles around its
    /// centre. \[L\]
    pub fn distance(&self, x: &[f64]) -> Option<f64> {
        let at = |node: u32| Point::from_column_slice(&x[3 * node as usize..][..3]);
        let [first, second] = &self.nodes;
        let mut best = (at(*first.first()?) - at(*second.first()?)).norm();
        let tree = FacetTree::build(self.facets[1], x);
        let mut hits = Vec::new();
        for facet in self.facets[0] {
            let own = triangles(facet, at);
            let bound = |pick: fn(f64, f64) -> f64, start: f64, c: usize| {
                facet.iter().map(|&node| at(node)[c]).fold(start, pick)
            };
            let low = std::array::from_fn(|c| bound(f64::min, f64::INFINITY, c) - best);
            let high = std::array::from_fn(|c| bound(f64::max, f64::NEG_INFINITY, c) + best);
            hits.clear();
            tree.query(low, high, &mut hits);
            for &hit in &hits {
                for other in triangles(&self.facets[1][hit as usize], at) {
                    best = own.iter().fold(best, |best, own| best.min(between_triangles(own, &other)));
                }
            }
        }
        Some(best)
    }
}

/// Largest difference between a displacement of one surface and a displacement of the other. \[L\]
pub(super) fn largest_difference(a: Displacements, b: Displacements) -> f64 {
    let in_direction = |c: usize| f64::max(a[c][1] - b[c][0], b[c][1] - a[c][0]);
    (0..3).map(|c| in_direction(c).powi(2)).sum::<f64>().sqrt()
}

fn triangles(facet: &FacetNodes, at: impl Fn(u32) -> Point) -> Vec<[Point; 3]> {
    let corners: Vec<Point> = facet.iter().map(|&node| at(node)).collect();
    if let [a, b, c] = corners[..] {
        return vec![[a, b, c]];
    }
    let centre = corners.iter().sum::<Point>() / corners.len() as f64;
    (0..corners.len()).map(|k| [corners[k], corners[(k + 1) % corners.len()], centre]).collect()
}

/// Distance between two triangles that do not intersect: from a corner to a face, or between two
/// edges.
fn between_triangles(a: &[Point; 3], b: &[Point; 3]) -> f64 {
    let mut best = f64::INFINITY;
    for k in 0..3 {
        best = best.min(to_triangle(&a[k], b)).min(to_triangle(&b[k], a));
        for l in 0..3 {
            best = best.min(between_segments([&a[k], &a[(k + 1) % 3]], [&b[l], &b[(l + 1) % 3]]));
        }
    }
    best
}

/// Distance from a point to a triangle if the point projects onto its interior; otherwise infinite,
/// because the tests of the edges cover that case.
fn to_triangle(p: &Point, [a, b, c]: &[Point; 3]) -> f64 {
    let normal = (b - a).cross(&(c - a));
    let inside = |from: &Point, to: &Point| normal.dot(&(to - from).cross(&(p - from))) >= 0.0;
    if inside(a, b) && inside(b, c) && inside(c, a) && normal.norm() > 0.0 {
        (p - a).dot(&normal).abs() / normal.norm()
    } else {
        f64::INFINITY
    }
}

/// Distance between two segments. C. Ericson: Real-Time Collision Detection (2005), 5.1.9.
fn between_segments([p, p_end]: [&Point; 2], [q, q_end]: [&Point; 2]) -> f64 {
    let (d, e, r) = (p_end - p, q_end - q, p - q);
    let (dd, ee, de) = (d.dot(&d), e.dot(&e), d.dot(&e));
    let (dr, er) = (d.dot(&r), e.dot(&r));
    let apart = dd * ee - de * de;
    // for parallel segments, any point of the first one will do
    let mut s = if apart > 1e-14 * dd * ee { ((de * er - dr * ee) / apart).clamp(0.0, 1.0) } else { 0.0 };
    let mut t = if ee > 0.0 { (de * s + er) / ee } else { 0.0 };
    if !(0.0..=1.0).contains(&t) {
        t = t.clamp(0.0, 1.0);
        s = if dd > 0.0 { ((de * t - dr) / dd).clamp(0.0, 1.0) } else { 0.0 };
    }
    (r + d * s - e * t).norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points<const N: usize>(list: [[f64; 3]; N]) -> [Point; N] {
        list.map(Point::from)
    }

    /// Computed by hand: face over face, corner over corner, crossing edges, parallel edges.
    #[test]
    fn distances_by_hand() {
        let a = points([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        for (b, expected) in [
            (points([[0.2, 0.2, 0.3], [0.3, 0.2, 0.5], [0.2, 0.3, 0.5]]), 0.3),
            (points([[-3.0, -4.0, 0.0], [-4.0, -4.0, 0.0], [-3.0, -5.0, 0.0]]), 5.0),
            (points([[0.5, -0.2, 1.0], [0.5, 0.2, 1.0], [0.5, 0.0, 2.0]]), 1.0),
            (points([[0.0, -0.7, 0.0], [1.0, -0.7, 0.0], [0.0, -1.7, 0.0]]), 0.7),
        ] {
            assert!((between_triangles(&a, &b) - expected).abs() < 1e-15, "{b:?}");
            assert!((between_triangles(&b, &a) - expected).abs() < 1e-15, "{b:?}");
        }
    }

    /// Compared with the smallest distance of many points on both triangles.
    #[test]
    fn distances_of_triangles_agree_with_samples() {
        let mut state = 7u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / (1u64 << 31) as f64
        };
        for _ in 0..50 {
            let mut triangle = |shift: f64| -> [Point; 3] {
                std::array::from_fn(|_| Point::new(random() + shift, random(), random()))
            };
            let (a, b) = (triangle(0.0), triangle(1.2));
            const N: usize = 60;
            let samples = |t: &[Point; 3]| -> Vec<Point> {
                let weights = (0..=N).flat_map(|i| (0..=N - i).map(move |j| (i, j)));
                weights
                    .map(|(i, j)| (t[0] * i as f64 + t[1] * j as f64 + t[2] * (N - i - j) as f64) / N as f64)
                    .collect()
            };
            let (of_a, of_b) = (samples(&a), samples(&b));
            let sampled = of_a.iter().flat_map(|p| of_b.iter().map(move |q| (p - q).norm()));
            let sampled = sampled.fold(f64::INFINITY, f64::min);
            let found = between_triangles(&a, &b);
            assert!(found <= sampled + 1e-14 && found > sampled - 0.04, "{found} {sampled}");
        }
    }
}
