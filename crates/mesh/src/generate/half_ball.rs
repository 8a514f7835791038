//! The solid half-ball, a block of elements under the flat face, wrapped in shells up to the sphere;
//! and the ball, of two of them.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_4;

use super::{at_least, named, positive};
use crate::error::count32;
use crate::vector::norm;
use crate::{Body, Element, Mesh, MeshError, Surface};

/// A solid half-ball with its flat face on y = 0, centred at the origin, and its dome pointing
/// down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfBallShape {
    /// Radius of the sphere. \[L\]
    pub radius: f64,
    /// \[n, h, m\]: the block has n × n elements under the flat face and h in depth; m shells
    /// surround it. Each at least 1.
    ///
    /// In total n·n·h + m·(n·n + 4·n·h) elements; h = n/2 makes them most uniform.
    pub elements: [usize; 3],
}

/// Share of a rounded cube in the block's shape; the rest is a straight cube. It distributes the
/// angles evenly around the block's edges.
const ROUNDING: f64 = 0.5;

/// A half-ball of hexahedra. Surfaces: `{name}_flat`, `{name}_dome`.
///
/// The nodes of the dome lie on the sphere, so volume and areas converge from below with second
/// order. The smallest scaled Jacobian is 0.74 for (n, h, m) = (10, 5, 8) and never below 0.57.
///
/// # Errors
/// [`MeshError::Parameter`] if the radius or a number of elements is not positive and finite;
/// [`MeshError::TooLarge`] if the numbers do not fit 32 bits.
pub fn half_ball(name: &str, shape: &HalfBallShape) -> Result<Mesh, MeshError> {
    named(name)?;
    positive("radius", shape.radius)?;
    let n = at_least(1, "elements[0] (n)", shape.elements[0])?;
    let h = at_least(1, "elements[1] (h)", shape.elements[1])?;
    let m = at_least(1, "elements[2] (m)", shape.elements[2])?;
    let grid = Grid { n, h, m };
    count32("nodes", grid.node_bound())?;

    let skin = grid.skin();
    let mut nodes = grid.block_nodes();
    for layer in 1..=m {
        let t = layer as f64 / m as f64;
        for &index in &skin.indices {
            let cube = grid.cube_point(index);
            let (inner, outer) = (grid.block_point(cube), on_sphere(cube));
            nodes.push(std::array::from_fn(|c| (1.0 - t) * inner[c] + t * outer[c]));
        }
    }
    for x in &mut nodes {
        *x = x.map(|c| c * shape.radius);
    }
    let mut elements: Vec<Element> = grid.block_hexes().into_iter().map(Element::Hex8).collect();
    let node_of = |layer: usize, corner: usize| match layer {
        0 => grid.block_number(skin.indices[corner]),
        _ => (grid.block_count() + (layer - 1) * skin.indices.len() + corner) as u32,
    };
    for layer in 0..m {
        for &[a, b, c, d] in &skin.quads {
            // The third natural direction points outward.
            let (low, high) = ([a, b, c, d].map(|k| node_of(layer, k)), [a, b, c, d].map(|k| node_of(layer + 1, k)));
            elements.push([low[0], low[1], low[2], low[3], high[0], high[1], high[2], high[3]].into());
        }
    }
    let body = Body { name: name.to_owned(), elements: 0..elements.len(), nodes: 0..nodes.len() };
    let mut mesh = Mesh { nodes, elements, bodies: vec![body], ..Mesh::default() };
    mesh.surfaces = flat_and_dome(name, &mesh);
    Ok(mesh)
}

/// A solid ball, centred at the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BallShape {
    /// Radius of the sphere. \[L\]
    pub radius: f64,
    /// \[n, h, m\]: those of each half below and above the plane y = 0, see [`HalfBallShape`].
    pub elements: [usize; 3],
}

/// A ball of hexahedra: a half-ball and its mirror image. Surface: `{name}_side`.
///
/// # Errors
/// Those of [`half_ball`].
pub fn ball(name: &str, shape: &BallShape) -> Result<Mesh, MeshError> {
    let BallShape { radius, elements } = *shape;
    let mut mesh = half_ball(name, &HalfBallShape { radius, elements })?;
    count32("nodes", mesh.nodes.len().checked_mul(2))?;
    let lower = mesh.nodes.len();
    let mut image: Vec<u32> = Vec::with_capacity(lower);
    for node in 0..lower {
        let [x, y, z] = mesh.nodes[node];
        if y == 0.0 {
            image.push(node as u32);
        } else {
            image.push(mesh.nodes.len() as u32);
            mesh.nodes.push([x, -y, z]);
        }
    }
    for element in 0..mesh.elements.len() {
        let hex = mesh.elements[element].as_hex().expect("hexahedra");
        // a mirror image has its layers in the opposite order
        mesh.elements.push(Element::Hex8(std::array::from_fn(|k| image[hex[(k + 4) % 8] as usize])));
    }
    mesh.bodies[0].elements.end = mesh.elements.len();
    mesh.bodies[0].nodes.end = mesh.nodes.len();
    mesh.surfaces = BTreeMap::from([(format!("{name}_side"), mesh.boundary(0))]);
    Ok(mesh)
}

/// The boundary, split into its two parts: the generator puts the flat face exactly on y = 0.
fn flat_and_dome(name: &str, mesh: &Mesh) -> BTreeMap<String, Surface> {
    let (flat, dome) = mesh
        .boundary(0)
        .facets
        .into_iter()
        .partition(|facet| facet.nodes.iter().all(|&n| mesh.nodes[n as usize][1] == 0.0));
    BTreeMap::from([
        (format!("{name}_flat"), Surface { facets: flat }),
        (format!("{name}_dome"), Surface { facets: dome }),
    ])
}

/// The lattice of the block: i along x, j from the lowest layer up to the flat face, k along z.
struct Grid {
    n: usize,
    h: usize,
    m: usize,
}

/// The block's surface without the flat face: lattice indices of its points, and its quadrilaterals
/// (positions in `indices`, counter-clockwise seen from outside).
struct Skin {
    indices: Vec<[usize; 3]>,
    quads: Vec<[usize; 4]>,
}

impl Grid {
    /// A bound on the number of nodes and elements.
    fn node_bound(&self) -> Option<usize> {
        let across = self.n.checked_add(1)?;
        let down = self.h.checked_add(1)?;
        let layer = across.checked_mul(across)?.checked_add(across.checked_mul(down)?.checked_mul(4)?)?;
        across.checked_mul(across)?.checked_mul(down)?.checked_add(self.m.checked_mul(layer)?)
    }

    fn block_count(&self) -> usize {
        (self.n + 1) * (self.h + 1) * (self.n + 1)
    }

    fn block_number(&self, [i, j, k]: [usize; 3]) -> u32 {
        (i + (self.n + 1) * (j + (self.h + 1) * k)) as u32
    }

    fn block_index(&self, number: usize) -> [usize; 3] {
        let (across, up) = (self.n + 1, self.h + 1);
        [number % across, number / across % up, number / (across * up)]
    }

    fn block_nodes(&self) -> Vec<[f64; 3]> {
        (0..self.block_count()).map(|number| self.block_point(self.cube_point(self.block_index(number)))).collect()
    }

    fn block_hexes(&self) -> Vec<[u32; 8]> {
        let (n, h) = (self.n, self.h);
        (0..n * n * h)
            .map(|element| {
                let [i, j, k] = [element % n, element / n % h, element / (n * h)];
                crate::geometry::HEX_CORNERS.map(|sign| {
                    let step = |d: usize| usize::from(sign[d] > 0.0);
                    self.block_number([i + step(0), j + step(1), k + step(2)])
                })
            })
            .collect()
    }

    /// Lattice point on the lower half of the cube [−1, 1]³; opposite points mirror each other to
    /// the last bit.
    fn cube_point(&self, [i, j, k]: [usize; 3]) -> [f64; 3] {
        let across = |i: usize| (2.0 * i as f64 - self.n as f64) / self.n as f64;
        [across(i), -((self.h - j) as f64) / self.h as f64, across(k)]
    }

    /// The block in the unit ball: between a cube and a ball.
    fn block_point(&self, cube: [f64; 3]) -> [f64; 3] {
        // Half width for which block and shells have elements of equal size, within bounds that
        // preserve their angles.
        let half_width = (self.n as f64 / (self.n + 2 * self.m) as f64).clamp(0.3, 0.6);
        let round = ball_of_cube(cube);
        std::array::from_fn(|c| half_width * ((1.0 - ROUNDING) * cube[c] + ROUNDING * round[c]))
    }

    fn skin(&self) -> Skin {
        let (n, h) = (self.n, self.h);
        let is_skin = |[i, j, k]: [usize; 3]| j == 0 || i == 0 || i == n || k == 0 || k == n;
        let indices: Vec<[usize; 3]> =
            (0..self.block_count()).map(|number| self.block_index(number)).filter(|&index| is_skin(index)).collect();
        let mut place = vec![usize::MAX; self.block_count()];
        for (position, &index) in indices.iter().enumerate() {
            place[self.block_number(index) as usize] = position;
        }
        let at = |index| place[self.block_number(index) as usize];
        let mut quads = Vec::with_capacity(n * n + 4 * n * h);
        for i in 0..n {
            for k in 0..n {
                quads.push([at([i, 0, k]), at([i + 1, 0, k]), at([i + 1, 0, k + 1]), at([i, 0, k + 1])]);
            }
            for j in 0..h {
                quads.push([at([0, j, i]), at([0, j, i + 1]), at([0, j + 1, i + 1]), at([0, j + 1, i])]);
                quads.push([at([n, j, i]), at([n, j + 1, i]), at([n, j + 1, i + 1]), at([n, j, i + 1])]);
                quads.push([at([i, j, 0]), at([i, j + 1, 0]), at([i + 1, j + 1, 0]), at([i + 1, j, 0])]);
                quads.push([at([i, j, n]), at([i + 1, j, n]), at([i + 1, j + 1, n]), at([i, j + 1, n])]);
            }
        }
        Skin { indices, quads }
    }
}

/// Point of the unit sphere for a point of the cube's surface, at equal angles along its edges.
fn on_sphere(cube: [f64; 3]) -> [f64; 3] {
    let gnomonic = cube.map(|c| (FRAC_PI_4 * c).tan());
    let length = norm(gnomonic);
    gnomonic.map(|c| c / length)
}

/// A smooth map of the cube [−1, 1]³ onto the unit ball (the cube's surface goes to the sphere).
fn ball_of_cube([x, y, z]: [f64; 3]) -> [f64; 3] {
    let squeeze = |a: f64, b: f64| (1.0 - 0.5 * (a * a + b * b) + a * a * b * b / 3.0).sqrt();
    [x * squeeze(y, z), y * squeeze(z, x), z * squeeze(x, y)]
}
