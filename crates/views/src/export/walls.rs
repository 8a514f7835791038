//! The planes of the design domain's outer faces, which points of a surface must not cross while they move.

use slipstick_mesh::{FacetNodes, Mesh};

use crate::crossings::Near;
use crate::vector::{cross, dot, norm, subtract, unit};

/// The plane of an outer face: its outward normal, and the product of the normal with its points. \[L\]
pub(super) type Wall = ([f64; 3], f64);

/// Cosine of the largest angle between triangles of the same plane (about a hundredth of a degree).
pub(super) const PLANE: f64 = 1.0 - 1e-8;

/// Sine of the angle to a plane below which a direction lies in it.
const ALONG: f64 = 1e-4;

/// The walls at the outer faces of bodies.
pub(super) struct Walls {
    /// Two triangles for each facet, with their bodies.
    triangles: Vec<([u32; 3], u32)>,
    near: Near,
    nodes: Vec<[f64; 3]>,
    /// The walls at each node.
    at: Vec<Vec<Wall>>,
}

impl Walls {
    /// The walls of these bodies.
    pub fn new(mesh: &Mesh, bodies: &[usize]) -> Self {
        let (mut at, mut triangles) = (vec![Vec::new(); mesh.nodes.len()], Vec::new());
        for &body in bodies {
            let facets: Vec<FacetNodes> = mesh.boundary(body).facets.iter().map(|facet| facet.nodes).collect();
            let mut around: Vec<(u32, usize)> =
                facets.iter().enumerate().flat_map(|(f, facet)| facet.iter().map(move |&n| (n, f))).collect();
            around.sort_unstable();
            for own in around.chunk_by(|a, b| a.0 == b.0) {
                let own_facets: Vec<&FacetNodes> = own.iter().map(|(_, f)| &facets[*f]).collect();
                at[own[0].0 as usize] = walls_at(mesh, own[0].0, &own_facets);
            }
            let halves = |f: &FacetNodes| [[f[0], f[1], f[2]], [f[0], f[2], f[f.len() - 1]]];
            triangles.extend(facets.iter().flat_map(halves).map(|triangle| (triangle, body as u32)));
        }
        let corners: Vec<[u32; 3]> = triangles.iter().map(|(triangle, _)| *triangle).collect();
        let near = Near::of(&mesh.nodes, &corners);
        Self { triangles, near, nodes: mesh.nodes.clone(), at }
    }

    /// The walls near a point of a body that it does not lie beyond; within the plane with the normal `face`, if
    /// there is one.
    pub fn beside(&mut self, x: [f64; 3], body: u32, face: Option<[f64; 3]>) -> Vec<Wall> {
        let mut walls: Vec<Wall> = Vec::new();
        let own = self.near.beside(x).iter().map(|&t| &self.triangles[t as usize]).filter(|(_, of)| *of == body);
        let own: Vec<&[u32; 3]> = own.map(|(corners, _)| corners).collect();
        let at_nodes = own.iter().flat_map(|corners| corners.iter()).flat_map(|&n| self.at[n as usize].iter().copied());
        // around a hollow, a plane is the end only below its own triangle
        let below = own.iter().filter_map(|corners| below(corners.map(|n| self.nodes[n as usize]), x));
        for (normal, level) in at_nodes.chain(below) {
            let known = |(other, at): &Wall| dot(normal, *other) >= PLANE && (at - level).abs() <= 1e-9 * level.abs();
            if dot(normal, x) <= level + 1e-12 * level.abs() && !walls.iter().any(known) {
                walls.push((normal, level));
            }
        }
        match face {
            None => walls,
            Some(face) => walls.into_iter().filter_map(|wall| within(wall, face, x)).collect(),
        }
    }
}

/// The planes of the facets at a node that no other facet there lies beyond: all at an outward edge or corner,
/// none at an inward one.
fn walls_at(mesh: &Mesh, node: u32, facets: &[&FacetNodes]) -> Vec<Wall> {
    let at = |n: u32| mesh.nodes[n as usize];
    let x = at(node);
    let mut walls: Vec<Wall> = Vec::new();
    for facet in facets {
        let normal = unit(match facet.len() {
            3 => cross(subtract(at(facet[1]), at(facet[0])), subtract(at(facet[2]), at(facet[0]))),
            _ => cross(subtract(at(facet[2]), at(facet[0])), subtract(at(facet[3]), at(facet[1]))),
        });
        let beyond = |n: &u32| {
            let way = subtract(at(*n), x);
            dot(normal, way) > ALONG * norm(way)
        };
        let known = walls.iter().any(|(other, _)| dot(normal, *other) >= PLANE);
        if !known && !facets.iter().any(|other| other.iter().any(beyond)) {
            walls.push((normal, dot(normal, x)));
        }
    }
    walls
}

/// The plane of a triangle if `x` lies on its inner side, nearer than it is long, and its foot within it.
fn below(corners: [[f64; 3]; 3], x: [f64; 3]) -> Option<Wall> {
    let [a, b, c] = corners;
    let (u, v) = (subtract(b, a), subtract(c, a));
    let (way, twice) = (subtract(x, a), cross(u, v));
    let normal = unit(twice);
    let (depth, area) = (-dot(way, normal), dot(twice, twice));
    let (s, t) = (dot(cross(way, v), twice) / area, dot(cross(u, way), twice) / area);
    let inside = s >= -ALONG && t >= -ALONG && s + t <= 1.0 + ALONG;
    (inside && depth >= 0.0 && depth <= norm(u).max(norm(v))).then(|| (normal, dot(normal, a)))
}

/// The line in the plane through `x` with the normal `face` at which a wall ends it; `None` if they are parallel.
fn within((normal, level): Wall, face: [f64; 3], x: [f64; 3]) -> Option<Wall> {
    let slant = dot(normal, face);
    let along: [f64; 3] = std::array::from_fn(|c| normal[c] - slant * face[c]);
    let length = norm(along);
    (length > ALONG).then(|| (along.map(|c| c / length), (level - slant * dot(face, x)) / length))
}

/// Moves a point back from beyond walls.
pub(super) fn stop(point: &mut [f64; 3], walls: &[Wall]) {
    for (normal, level) in walls {
        let beyond = (dot(*point, *normal) - level).max(0.0);
        (0..3).for_each(|c| point[c] -= beyond * normal[c]);
    }
}
