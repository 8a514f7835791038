//! Taubin's smoothing: two Laplacian steps of opposite sign, which remove ripples and preserve the
//! volume.
//!
//! Method: G. Taubin, A signal processing approach to fair surface design, SIGGRAPH 1995.

use super::restore::restore;
use super::surface::TriangleSurface;
use super::walls::{PLANE, Wall, Walls, stop};
use crate::crossings::{Near, cross};
use crate::vector::{dot, shape, unit};

/// Step towards the mean of the neighbours, and step away from it: ripples are damped by
/// (1 − λk)(1 − μk); frequencies k below 1/λ + 1/μ = 0.11 (of at most 2) pass.
const STEPS: [f64; 2] = [0.5, -0.53];

/// Smallest share of its move that a point keeps if its triangles would cross others.
const LEAST: f64 = 0.125;

/// Quality of a triangle, 1 if equilateral, below which it counts as flat if moves made it so.
const FLAT: f64 = 0.01;

/// Options of smoothing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rules {
    pub passes: usize,
    /// Points on outer faces stay on them: those on plane parts move within the plane, and the rim
    /// of the material moves along itself; edges, corners, curved faces and the borders between
    /// labels stay.
    pub keep_outer: bool,
}

/// The surface with moved points and the same triangles. If it keeps outer faces, no point crosses `walls`.
pub(super) fn smoothed(mut surface: TriangleSurface, rules: &Rules, walls: &mut Walls) -> TriangleSurface {
    if rules.passes == 0 || surface.triangles.is_empty() {
        return surface;
    }
    let before = surface.points.clone();
    let (mut neighbours, walls) =
        if rules.keep_outer { kept(&surface, walls) } else { (all(&surface), vec![Vec::new(); surface.points.len()]) };
    loop {
        surface.points = moved(&before, &neighbours, &walls, rules.passes);
        restore(&mut surface, &before, &neighbours, &walls, rules.keep_outer);
        // An outer triangle that is flipped would overlap others, and one that a wall makes flat has no
        // normal, so the points of both are reset. Each pass of this loop fixes more points, so it ends.
        let over = turned_over(&surface, &before, rules);
        let mut held = 0;
        for n in over {
            held += usize::from(!neighbours[n as usize].is_empty());
            neighbours[n as usize].clear();
        }
        if held == 0 {
            separate(&mut surface, &before);
            return surface;
        }
    }
}

/// Moves the points of triangles that cross others back towards their places before, where none do.
fn separate(surface: &mut TriangleSurface, before: &[[f64; 3]]) {
    let after = surface.points.clone();
    let mut share = vec![1.0; after.len()];
    let mut near = Near::of(&surface.points, &surface.triangles);
    let mut open: Vec<u32> = (0..surface.triangles.len() as u32).collect();
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); after.len()];
    for (t, triangle) in (0..).zip(&surface.triangles) {
        triangle.iter().for_each(|&n| around[n as usize].push(t));
    }
    while !open.is_empty() {
        let mut crossing: Vec<u32> = Vec::new();
        for &t in &open {
            let triangle = surface.triangles[t as usize];
            let body = surface.bodies[t as usize];
            let same = |other: &&u32| **other != t && surface.bodies[**other as usize] == body;
            for &other in near.around(&surface.points, &triangle).iter().filter(same) {
                let corners = surface.triangles[other as usize];
                if cross(&surface.points, &triangle, &corners) {
                    crossing.extend(triangle.into_iter().chain(corners));
                }
            }
        }
        crossing.sort_unstable();
        crossing.dedup();
        // Each pass moves points back by a share of at least LEAST, so there is a last one.
        crossing.retain(|&n| share[n as usize] > 0.0);
        open.clear();
        for n in crossing.into_iter().map(|n| n as usize) {
            share[n] = if share[n] > LEAST { 0.5 * share[n] } else { 0.0 };
            let point = |c: usize| before[n][c] + share[n] * (after[n][c] - before[n][c]);
            surface.points[n] = if share[n] > 0.0 { std::array::from_fn(point) } else { before[n] };
            open.extend(&around[n]);
        }
        open.sort_unstable();
        open.dedup();
        for &t in &open {
            near.insert(&surface.points, t, &surface.triangles[t as usize]);
        }
    }
}

fn moved(before: &[[f64; 3]], neighbours: &[Vec<u32>], walls: &[Vec<Wall>], passes: usize) -> Vec<[f64; 3]> {
    let mut points = before.to_vec();
    let mut next = points.clone();
    for step in (0..passes).flat_map(|_| STEPS) {
        for (n, around) in neighbours.iter().enumerate().filter(|(_, around)| !around.is_empty()) {
            for c in 0..3 {
                // Sum differences, so that a common coordinate stays the same bit for bit.
                let pull: f64 = around.iter().map(|&m| points[m as usize][c] - points[n][c]).sum();
                next[n][c] = points[n][c] + step * pull / around.len() as f64;
            }
            stop(&mut next[n], &walls[n]);
        }
        std::mem::swap(&mut points, &mut next);
    }
    points
}

/// Points of outer triangles whose orientation has flipped, or of which moves left no more than a line.
fn turned_over(surface: &TriangleSurface, before: &[[f64; 3]], rules: &Rules) -> Vec<u32> {
    if !rules.keep_outer {
        return Vec::new();
    }
    let original = TriangleSurface { points: before.to_vec(), ..surface.clone() };
    let outer = (0..surface.triangles.len()).filter(|&t| surface.outer[t]);
    let over = outer.filter(|&t| {
        let [(normal, quality), (earlier, before)] = [surface, &original].map(|of| shape(of.corners(t)));
        dot(normal, earlier) <= 0.0 || quality < FLAT.min(before)
    });
    over.flat_map(|t| surface.triangles[t]).collect()
}

/// Neighbours along all edges, in a fixed order.
fn all(surface: &TriangleSurface) -> Vec<Vec<u32>> {
    let mut neighbours = vec![Vec::new(); surface.points.len()];
    for t in &surface.triangles {
        for k in 0..3 {
            // On a closed surface each edge occurs once in each direction.
            neighbours[t[k] as usize].push(t[(k + 1) % 3]);
        }
    }
    neighbours
}

/// The neighbours that each point follows if outer faces are kept: all neighbours for points inside
/// the body and within plane faces, the two adjacent points for points on the rim of the material
/// on such a face, none elsewhere. Also the walls beside each point.
fn kept(surface: &TriangleSurface, domain: &mut Walls) -> (Vec<Vec<u32>>, Vec<Vec<Wall>>) {
    let mut kinds = vec![Kind::default(); surface.points.len()];
    for (t, triangle) in surface.triangles.iter().enumerate() {
        let face = surface.outer[t].then(|| (unit(surface.area_vector(t)), surface.labels[t]));
        triangle.iter().for_each(|&n| kinds[n as usize].meet(face));
    }
    let mut neighbours = all(surface);
    let mut rims: Vec<Vec<u32>> = vec![Vec::new(); surface.points.len()];
    let mut edges: Vec<([u32; 2], bool)> = Vec::with_capacity(3 * surface.triangles.len());
    for (triangle, &outer) in surface.triangles.iter().zip(&surface.outer) {
        for k in 0..3 {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            edges.push(([a.min(b), a.max(b)], outer));
        }
    }
    edges.sort_unstable();
    for pair in edges.chunk_by(|a, b| a.0 == b.0) {
        let ([a, b], outer) = pair[0];
        if pair.iter().any(|edge| edge.1 != outer) {
            rims[a as usize].push(b);
            rims[b as usize].push(a);
        }
    }
    let mut body = vec![0; surface.points.len()];
    for (triangle, &of) in surface.triangles.iter().zip(&surface.bodies) {
        triangle.iter().for_each(|&n| body[n as usize] = of);
    }
    let mut walls = vec![Vec::new(); surface.points.len()];
    for (n, kind) in kinds.iter().enumerate() {
        walls[n] = domain.beside(surface.points[n], body[n], kind.plane.map(|(normal, _)| normal));
        match kind {
            Kind { plane: None, .. } => {}
            Kind { bent: true, .. } => neighbours[n].clear(),
            Kind { plane: Some(_), inside: true, .. } if rims[n].len() == 2 => neighbours[n].clone_from(&rims[n]),
            Kind { plane: Some(_), inside: true, .. } => neighbours[n].clear(),
            _ => {}
        }
    }
    (neighbours, walls)
}

/// The triangles at a point.
#[derive(Debug, Clone, Copy, Default)]
struct Kind {
    /// Normal and label of its outer triangles.
    plane: Option<([f64; 3], u32)>,
    /// Whether the outer triangles lie in several planes or have several labels.
    bent: bool,
    /// Whether there are inner triangles.
    inside: bool,
}

impl Kind {
    fn meet(&mut self, face: Option<([f64; 3], u32)>) {
        match (face, self.plane) {
            (None, _) => self.inside = true,
            (Some(face), None) => self.plane = Some(face),
            (Some((normal, label)), Some((other, known))) => self.bent |= dot(normal, other) < PLANE || label != known,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::{ExportOptions, design_surface};
    use slipstick_mesh::{HollowCylinderShape, hollow_cylinder};

    /// Random densities of a tube with 16 facets around: at the edges between these, walls stop points, which must not
    /// leave triangles without an area. The triangles are those of the surface before it was smoothed.
    #[test]
    fn outer_triangles_do_not_become_flat() {
        let tube = HollowCylinderShape { inner_radius: 3.0, outer_radius: 10.0, height: 10.0, elements: [4, 16, 6] };
        let mesh = hollow_cylinder("tube", &tube).expect("a tube");
        for seed in 1..4u64 {
            let mut state = seed;
            let mut next = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1u64 << 53) as f64
            };
            let density: Vec<f64> = mesh.elements.iter().map(|_| next()).collect();
            let surface = |smoothing| {
                let options = ExportOptions { threshold: Some(0.5), smoothing, ..ExportOptions::default() };
                design_surface(&mesh, &density, &options).expect("a surface").surface
            };
            let (before, after) = (surface(0), surface(10));
            assert_eq!(before.triangles, after.triangles);
            let outer = (0..after.triangles.len()).filter(|&t| after.outer[t]);
            let quality = |of: &TriangleSurface, t: usize| shape(of.corners(t)).1;
            let flat = outer.filter(|&t| quality(&after, t) < 0.999 * FLAT.min(quality(&before, t))).count();
            assert_eq!(flat, 0, "seed {seed}");
        }
    }
}
