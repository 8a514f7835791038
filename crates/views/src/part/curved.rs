//! Puts the points of a part's outer faces onto the smooth surface for which the facets of the design
//! domain stand.
//!
//! A point between the nodes of a curved face lies on a facet, below the true surface by up to the
//! sagitta. It moves along the normal of the known shape onto it, or along that of its facet by the height of the
//! surface there ([`slipstick_mesh::smooth_surface`]). A point that also lies on flat faces moves
//! within their planes.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use nalgebra::Vector3;
use slipstick_contact::kinematics::height::FacetHeight;
use slipstick_mesh::{FacetNodes, Mesh, Shape, SmoothSurface};

use super::remesh::PatchedSurface;
use crate::crossings::{Near, cross};
use crate::vector::{dot, norm, subtract, unit, unit_normal};

/// The outer faces of a body, and the smooth surface for which they stand.
pub(super) struct Curved<'a> {
    mesh: &'a Mesh,
    facets: Vec<FacetNodes>,
    heights: Vec<Option<FacetHeight>>,
    shapes: Vec<Option<Shape>>,
    normals: Vec<[f64; 3]>,
    /// Two triangles for each facet.
    near: Near,
}

/// Where the elements of the part get points between those of its surface: the point of the surface's
/// triangles, and the one on the smooth surface. \[L\]
pub(super) type Moves = Vec<[[f64; 3]; 2]>;

/// Cosine of the largest angle between a triangle and the facet on which it lies (60°).
const ALONG: f64 = 0.5;

/// Faces closer to parallel than this cosine do not confine points to their plane (about 10°).
const TANGENT: f64 = 0.985;

impl<'a> Curved<'a> {
    pub fn new(mesh: &'a Mesh, facets: Vec<FacetNodes>, smooth: SmoothSurface) -> Self {
        let corner = |n: &u32| Vector3::from(mesh.nodes[*n as usize]);
        let mut shapes = vec![None; facets.len()];
        for patch in &smooth.patches {
            patch.facets.iter().for_each(|&f| shapes[f as usize] = patch.shape);
        }
        let of = |(facet, heights): (&FacetNodes, Option<_>)| -> Option<FacetHeight> {
            Some(FacetHeight::new(heights?, &facet.iter().map(corner).collect::<Vec<_>>()))
        };
        let heights = facets.iter().zip(smooth.heights.into_iter().chain(std::iter::repeat(None))).map(of).collect();
        let at = |n: u32| mesh.nodes[n as usize];
        let normal = |facet: &FacetNodes| match facet.len() {
            3 => unit_normal([at(facet[0]), at(facet[1]), at(facet[2])]),
            _ => unit(crate::vector::cross(subtract(at(facet[2]), at(facet[0])), subtract(at(facet[3]), at(facet[1])))),
        };
        let triangles: Vec<[u32; 3]> =
            facets.iter().flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[f.len() - 1]]]).collect();
        let (near, normals) = (Near::of(&mesh.nodes, &triangles), facets.iter().map(normal).collect());
        Self { mesh, facets, heights, shapes, normals, near }
    }

    /// The coordinates of the nodes on curved faces, bit for bit.
    pub fn nodes(&self) -> HashSet<[u64; 3]> {
        let curved = self.facets.iter().zip(&self.heights).filter(|(_, heights)| heights.is_some());
        curved.flat_map(|(facet, _)| facet.iter().map(|&n| bits(self.mesh.nodes[n as usize]))).collect()
    }

    /// Where a point lies on a facet: the facet's shape functions, the point, and the distance.
    fn on_facet(&self, facet: usize, x: [f64; 3]) -> ([f64; 4], [f64; 3], f64) {
        let nodes = &self.facets[facet];
        let corners: Vec<Vector3<f64>> = nodes.iter().map(|&n| Vector3::from(self.mesh.nodes[n as usize])).collect();
        let x = Vector3::from(x);
        let shape = |u: f64, v: f64| match corners.len() {
            3 => [1.0 - u - v, u, v, 0.0],
            _ => [(1.0 - u) * (1.0 - v), u * (1.0 - v), u * v, (1.0 - u) * v],
        };
        let point = |shape: &[f64; 4]| -> Vector3<f64> { corners.iter().zip(shape).map(|(c, s)| c * *s).sum() };
        let (mut u, mut v) = if corners.len() == 3 { (0.3, 0.3) } else { (0.5, 0.5) };
        // Gauss-Newton; a triangle needs one step.
        for _ in 0..6 {
            let off = x - point(&shape(u, v));
            let (du, dv) = match corners.len() {
                3 => (corners[1] - corners[0], corners[2] - corners[0]),
                _ => (
                    (corners[1] - corners[0]) * (1.0 - v) + (corners[2] - corners[3]) * v,
                    (corners[3] - corners[0]) * (1.0 - u) + (corners[2] - corners[1]) * u,
                ),
            };
            let (a, b, c) = (du.dot(&du), du.dot(&dv), dv.dot(&dv));
            let (p, q, whole) = (off.dot(&du), off.dot(&dv), a * c - b * b);
            if !(whole > 0.0) {
                break;
            }
            u = (u + (c * p - b * q) / whole).clamp(-0.5, 1.5);
            v = (v + (a * q - b * p) / whole).clamp(-0.5, 1.5);
        }
        let (mut u, mut v) = (u.clamp(0.0, 1.0), v.clamp(0.0, 1.0));
        if corners.len() == 3 && u + v > 1.0 {
            let beyond = 0.5 * (u + v - 1.0);
            (u, v) = ((u - beyond).clamp(0.0, 1.0), (v - beyond).clamp(0.0, 1.0));
        }
        let shape = shape(u, v);
        let found = point(&shape);
        (shape, found.into(), (x - found).norm())
    }

    /// The facet nearest to a point among those that face this way, curved ones only if so asked.
    fn nearest(&mut self, x: [f64; 3], facing: [f64; 3], curved: bool) -> Option<usize> {
        let candidates: BTreeSet<usize> = self.near.beside(x).iter().map(|&t| t as usize / 2).collect();
        let suits = |f: &usize| dot(self.normals[*f], facing) > ALONG && !(curved && self.heights[*f].is_none());
        let distances = candidates.into_iter().filter(suits).map(|f| (self.on_facet(f, x).2, f));
        distances.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, f)| f)
    }

    /// The point of the facets that is nearest to one near a face which faces this way.
    pub fn onto_facets(&mut self, x: [f64; 3], facing: [f64; 3]) -> Option<[f64; 3]> {
        let facet = self.nearest(x, facing, false)?;
        Some(self.on_facet(facet, x).1)
    }

    /// The point of the smooth surface above a point on or near a curved facet; it stays in planes
    /// with the normals `walls`.
    fn lifted(&mut self, x: [f64; 3], facing: [f64; 3], walls: &[[f64; 3]]) -> Option<[f64; 3]> {
        let facet = self.nearest(x, facing, true)?;
        let (weights, on, _) = self.on_facet(facet, x);
        let corners = self.facets[facet].iter().map(|&n| self.mesh.nodes[n as usize]);
        let size = corners.map(|p| norm(subtract(p, on))).fold(0.0, f64::max);
        // facets of tetrahedra are inclined to a shape: along their normals, a point would leave the end of a bore
        let normal = match self.shapes[facet] {
            Some(shape) => {
                let normal: [f64; 3] = shape.normal(&x.into(), 1e-3 * size).into();
                normal.map(|c| c * dot(normal, self.normals[facet]).signum())
            }
            None => self.normals[facet],
        };
        let mut along = normal;
        let mut known: Vec<[f64; 3]> = Vec::new();
        for &wall in walls.iter().filter(|wall| dot(**wall, normal).abs() < TANGENT) {
            if known.iter().all(|other| dot(*other, wall) < TANGENT) {
                known.push(wall);
                let out = dot(along, wall);
                along = unit(std::array::from_fn(|c| along[c] - out * wall[c]));
            }
        }
        let steep = dot(along, normal);
        if known.len() > 1 || steep < 0.3 {
            return None;
        }
        let height = self.heights[facet]?.value(self.facets[facet].len(), &weights);
        let moved = |from: [f64; 3], by: f64| std::array::from_fn(|c| from[c] + by * along[c]);
        match self.shapes[facet] {
            Some(shape) => Some(moved(x, shape.along(&x.into(), &along.into(), size)?)),
            None => Some(moved(on, height / steep)),
        }
    }

    /// Whether a triangle of the surface lies on a curved face.
    fn is_curved(&mut self, corners: [[f64; 3]; 3]) -> bool {
        let centre = std::array::from_fn(|c| corners.iter().map(|p| p[c]).sum::<f64>() / 3.0);
        let facet = self.nearest(centre, unit_normal(corners), false);
        facet.is_some_and(|facet| self.heights[facet].is_some())
    }

    /// The shape of the face on which a triangle of the surface lies, if it is a known one.
    pub fn shape(&mut self, corners: [[f64; 3]; 3]) -> Option<Shape> {
        let centre = std::array::from_fn(|c| corners.iter().map(|p| p[c]).sum::<f64>() / 3.0);
        let facet = self.nearest(centre, unit_normal(corners), false)?;
        self.shapes[facet]
    }

    /// Moves the points of a surface that are not nodes onto the smooth surface, where `outer` says of its triangles that
    /// they lie on outer faces; returns the moves of the points in the middle of its edges and
    /// triangles.
    pub fn lift(&mut self, surface: &mut PatchedSurface, outer: impl Fn(usize) -> bool) -> Moves {
        if self.heights.iter().all(Option::is_none) {
            return Moves::new();
        }
        let (flat, nodes) = (surface.clone(), self.nodes());
        let count = flat.triangles.len();
        let curved: Vec<bool> = (0..count).map(|t| outer(t) && self.is_curved(flat.corners(t))).collect();
        let normals: Vec<[f64; 3]> = (0..count).map(|t| unit_normal(flat.corners(t))).collect();
        // The flat faces at each point and at each edge.
        let mut at_point: BTreeMap<u32, Vec<[f64; 3]>> = BTreeMap::new();
        let mut at_edge: BTreeMap<[u32; 2], Vec<[f64; 3]>> = BTreeMap::new();
        for t in (0..count).filter(|&t| outer(t) && !curved[t]) {
            for k in 0..3 {
                let (a, b) = (flat.triangles[t][k], flat.triangles[t][(k + 1) % 3]);
                at_point.entry(a).or_default().push(normals[t]);
                at_edge.entry([a.min(b), a.max(b)]).or_default().push(normals[t]);
            }
        }
        let mut done: BTreeSet<u32> = BTreeSet::new();
        for t in (0..count).filter(|&t| curved[t]) {
            for n in flat.triangles[t] {
                let walls = at_point.get(&n).map_or(&[][..], Vec::as_slice);
                let x = flat.points[n as usize];
                if done.insert(n)
                    && !nodes.contains(&bits(x))
                    && let Some(to) = self.lifted(x, normals[t], walls)
                {
                    surface.points[n as usize] = to;
                }
            }
        }
        put_back(surface, &flat);
        let mut moves = Moves::new();
        let mut seen: BTreeSet<[u32; 2]> = BTreeSet::new();
        for t in (0..count).filter(|&t| curved[t]) {
            let corners = flat.triangles[t];
            let mean = |of: &PatchedSurface, nodes: &[u32]| -> [f64; 3] {
                std::array::from_fn(|c| {
                    nodes.iter().map(|&n| of.points[n as usize][c]).sum::<f64>() / nodes.len() as f64
                })
            };
            let edges = (0..3).map(|k| [corners[k], corners[(k + 1) % 3]]).map(|[a, b]| [a.min(b), a.max(b)]);
            for edge in edges.filter(|&edge| seen.insert(edge)) {
                let walls = at_edge.get(&edge).map_or(&[][..], Vec::as_slice);
                let to = self.lifted(mean(&flat, &edge), normals[t], walls);
                moves.extend(to.map(|to| [mean(surface, &edge), to]));
            }
            let to = self.lifted(mean(&flat, &corners), normals[t], &[]);
            moves.extend(to.map(|to| [mean(surface, &corners), to]));
        }
        moves
    }
}

/// Moves the points of triangles that cross others back, as often as necessary.
fn put_back(surface: &mut PatchedSurface, before: &PatchedSurface) {
    loop {
        let mut near = Near::of(&surface.points, &surface.triangles);
        let mut back: BTreeSet<u32> = BTreeSet::new();
        for (t, triangle) in (0..).zip(&surface.triangles) {
            for &other in near.around(&surface.points, triangle).iter().filter(|&&other| other < t) {
                let corners = surface.triangles[other as usize];
                if cross(&surface.points, triangle, &corners) {
                    back.extend(triangle.iter().chain(&corners));
                }
            }
        }
        back.retain(|&n| surface.points[n as usize] != before.points[n as usize]);
        if back.is_empty() {
            return;
        }
        back.into_iter().for_each(|n| surface.points[n as usize] = before.points[n as usize]);
    }
}

pub(super) fn bits(point: [f64; 3]) -> [u64; 3] {
    // +0 and −0 are the same place
    point.map(|c| (c + 0.0).to_bits())
}
