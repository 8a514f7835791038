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
    /// The walls at each node, and the longest edge there. None at and beside inward edges, beyond which planes
    /// continue inside the body.
    at: Vec<(Vec<Wall>, f64)>,
}

impl Walls {
    /// The walls of these bodies.
    pub fn new(mesh: &Mesh, bodies: &[usize]) -> Self {
        let (mut at, mut triangles) = (vec![(Vec::new(), 0.0); mesh.nodes.len()], Vec::new());
        let mut inward: Vec<u32> = Vec::new();
        for &body in bodies {
            let facets: Vec<FacetNodes> = mesh.boundary(body).facets.iter().map(|facet| facet.nodes).collect();
            let mut around: Vec<(u32, usize)> =
                facets.iter().enumerate().flat_map(|(f, facet)| facet.iter().map(move |&n| (n, f))).collect();
            around.sort_unstable();
            for own in around.chunk_by(|a, b| a.0 == b.0) {
                let own_facets: Vec<&FacetNodes> = own.iter().map(|(_, f)| &facets[*f]).collect();
                match walls_at(mesh, own[0].0, &own_facets) {
                    Some(walls) => at[own[0].0 as usize] = walls,
                    None => inward.extend(own_facets.iter().flat_map(|facet| facet.iter())),
                }
            }
            let halves = |f: &FacetNodes| [[f[0], f[1], f[2]], [f[0], f[2], f[f.len() - 1]]];
            triangles.extend(facets.iter().flat_map(halves).map(|triangle| (triangle, body as u32)));
        }
        inward.into_iter().for_each(|n| at[n as usize].0.clear());
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
        let mut nodes: Vec<u32> = own.iter().flat_map(|corners| corners.iter().copied()).collect();
        nodes.sort_unstable();
        nodes.dedup();
        // a plane is an end near its facets, and around a hollow only below its own triangle
        let at_nodes = nodes.into_iter().flat_map(|n| {
            let (walls, reach) = &self.at[n as usize];
            let way = subtract(x, self.nodes[n as usize]);
            let near = move |(normal, _): &&Wall| dot(way, way) - dot(way, *normal).powi(2) <= reach * reach;
            walls.iter().filter(near).copied()
        });
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

/// The planes of the facets at a node, and the longest edge there; `None` at an inward edge or corner, where a facet lies
/// beyond the plane of another.
fn walls_at(mesh: &Mesh, node: u32, facets: &[&FacetNodes]) -> Option<(Vec<Wall>, f64)> {
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
        if walls.iter().any(|(other, _)| dot(normal, *other) >= PLANE) {
            continue;
        }
        if facets.iter().any(|other| other.iter().any(beyond)) {
            return None;
        }
        walls.push((normal, dot(normal, x)));
    }
    let edges = facets.iter().flat_map(|facet| facet.iter()).map(|&n| norm(subtract(at(n), x)));
    Some((walls, edges.fold(0.0, f64::max)))
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

/// How often a point moves back from each wall: between two that meet at 60°, a quarter of the distance is left each time.
const ROUNDS: usize = 20;

/// Moves a point back from beyond walls.
pub(super) fn stop(point: &mut [f64; 3], walls: &[Wall]) {
    for _ in 0..ROUNDS {
        let mut moved = false;
        for (normal, level) in walls {
            let beyond = dot(*point, *normal) - level;
            if beyond > 0.0 {
                (0..3).for_each(|c| point[c] -= beyond * normal[c]);
                moved = true;
            }
        }
        if !moved {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_mesh::{BoxShape, box_mesh};

    /// Two walls that meet at 60°: the nearest point between them is on their edge, the origin.
    #[test]
    fn a_point_beyond_two_walls_ends_between_them() {
        let (sine, cosine) = f64::to_radians(60.0).sin_cos();
        let walls = [([0.0, -1.0, 0.0], 0.0), ([-sine, cosine, 0.0], 0.0)];
        let mut point = [-0.1, 0.05, 0.0];
        stop(&mut point, &walls);
        assert!(walls.iter().all(|(normal, level)| dot(point, *normal) - level < 1e-12), "{point:?}");
        assert!(norm(point) < 1e-6, "{point:?}");
    }

    /// A box cut from another leaves an L: a point in the upright may rise past the level of the step, one below the
    /// step may not, and neither leaves the outside.
    #[test]
    fn planes_end_at_inward_edges() {
        let shape = BoxShape { min: [0.0; 3], max: [6.0, 4.0, 2.0], elements: [12, 8, 4], grading: [1.0; 3] };
        let mut mesh = box_mesh("angle", &shape).expect("a box");
        let keep: Vec<usize> = (0..mesh.elements.len())
            .filter(|&e| {
                let [x, y, _] = mesh.centroid(e);
                x < 2.0 || y < 2.0
            })
            .collect();
        mesh.elements = keep.iter().map(|&e| mesh.elements[e]).collect();
        mesh.bodies[0].elements = 0..mesh.elements.len();
        let mut walls = Walls::new(&mesh, &[0]);
        let mut moved = |from: [f64; 3], by: [f64; 3]| {
            let mut point: [f64; 3] = std::array::from_fn(|c| from[c] + by[c]);
            stop(&mut point, &walls.beside(from, 0, None));
            point
        };
        for x in [0.3, 0.9, 1.4, 1.8] {
            assert_eq!(moved([x, 1.9, 1.1], [0.0, 0.3, 0.0]), [x, 2.1999999999999997, 1.1], "in the upright at {x}");
        }
        for x in [2.2, 3.0, 5.9] {
            assert!((moved([x, 1.9, 1.1], [0.0, 0.3, 0.0])[1] - 2.0).abs() < 1e-12, "below the step at {x}");
        }
        assert!((moved([0.1, 3.9, 1.1], [-0.3, 0.3, 0.0])[0]).abs() < 1e-12);
    }
}
