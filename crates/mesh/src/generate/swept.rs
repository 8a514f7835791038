//! Solid bodies with a round cross-section: a disc moved along an axis, the cone and cylinder, or
//! around one, the torus.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_4, PI};

use super::{at_least, named, positive};
use crate::error::count32;
use crate::{Body, Element, Mesh, MeshError, Surface};

/// A truncated cone about the y axis, from y = 0 to `height`; with equal radii, a cylinder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConeShape {
    /// Radius at y = 0. \[L\]
    pub bottom_radius: f64,
    /// Radius at y = `height`. \[L\]
    pub top_radius: f64,
    /// Height along y. \[L\]
    pub height: f64,
    /// \[n, m, k\]: a core of n × n elements in m rings, in k layers along the axis. Each at least 1.
    ///
    /// In total (n·n + 4·n·m)·k elements.
    pub elements: [usize; 3],
}

/// A torus about the y axis, centred at the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorusShape {
    /// Distance of the tube's centre from the axis. \[L\]
    pub radius: f64,
    /// Radius of the tube, less than `radius`. \[L\]
    pub tube_radius: f64,
    /// \[n, m, k\]: a core of n × n elements in m rings (each at least 1), k (at least 3) times around
    /// the axis.
    ///
    /// In total (n·n + 4·n·m)·k elements.
    pub elements: [usize; 3],
}

/// A truncated cone of hexahedra. Surfaces: `{name}_bottom`, `{name}_top`, `{name}_side`, whose nodes
/// lie on the cone.
///
/// # Errors
/// [`MeshError::Parameter`] if a size or number of elements is out of range;
/// [`MeshError::TooLarge`] if the numbers do not fit 32 bits.
pub fn cone(name: &str, shape: &ConeShape) -> Result<Mesh, MeshError> {
    named(name)?;
    positive("bottom_radius", shape.bottom_radius)?;
    positive("top_radius", shape.top_radius)?;
    positive("height", shape.height)?;
    let disc = Disc::new(shape.elements)?;
    let layers = at_least(1, "elements[2] (axial)", shape.elements[2])?;
    let mesh = disc.swept(name, layers, false, |[u, v], layer| {
        let t = layer as f64 / layers as f64;
        let radius = shape.bottom_radius + t * (shape.top_radius - shape.bottom_radius);
        [radius * v, t * shape.height, radius * u]
    })?;
    let at = |nodes: &[[f64; 3]], y: f64| nodes.iter().all(|x| x[1] == y);
    Ok(with_surfaces(mesh, |nodes| match nodes {
        nodes if at(nodes, 0.0) => "bottom",
        nodes if at(nodes, shape.height) => "top",
        _ => "side",
    }))
}

/// A torus of hexahedra. Surface: `{name}_side`, whose nodes lie on the torus.
///
/// # Errors
/// [`MeshError::Parameter`] if a size or number of elements is out of range;
/// [`MeshError::TooLarge`] if the numbers do not fit 32 bits.
pub fn torus(name: &str, shape: &TorusShape) -> Result<Mesh, MeshError> {
    named(name)?;
    positive("radius", shape.radius)?;
    positive("tube_radius", shape.tube_radius)?;
    if shape.tube_radius >= shape.radius {
        let cure = format!("must be less than radius = {}", shape.radius);
        return Err(MeshError::parameter("tube_radius", shape.tube_radius, cure));
    }
    let disc = Disc::new(shape.elements)?;
    let around = at_least(3, "elements[2] (around)", shape.elements[2])?;
    let mesh = disc.swept(name, around, true, |[u, v], layer| {
        // from x to −z, as in the hollow cylinder; u along y, v outward
        let (sine, cosine) = (2.0 * PI * layer as f64 / around as f64).sin_cos();
        let radius = shape.radius + shape.tube_radius * v;
        [radius * cosine, shape.tube_radius * u, -radius * sine]
    })?;
    Ok(with_surfaces(mesh, |_| "side"))
}

/// The mesh with its boundary divided by `face`, which names the one of a facet from its nodes.
fn with_surfaces(mut mesh: Mesh, face: impl Fn(&[[f64; 3]]) -> &'static str) -> Mesh {
    let mut surfaces: BTreeMap<String, Surface> = BTreeMap::new();
    for facet in mesh.boundary(0).facets {
        let nodes: Vec<[f64; 3]> = facet.nodes.iter().map(|&n| mesh.nodes[n as usize]).collect();
        surfaces.entry(format!("{}_{}", mesh.bodies[0].name, face(&nodes))).or_default().facets.push(facet);
    }
    mesh.surfaces = surfaces;
    mesh
}

/// The unit disc in quadrilaterals: a square core in rings.
struct Disc {
    points: Vec<[f64; 2]>,
    /// Counter-clockwise.
    quads: Vec<[usize; 4]>,
}

/// Share of a disc in the shape of the core; the rest is a square.
const ROUNDING: f64 = 0.5;

impl Disc {
    fn new([n, m, _]: [usize; 3]) -> Result<Self, MeshError> {
        let n = at_least(1, "elements[0] (n)", n)?;
        let m = at_least(1, "elements[1] (m)", m)?;
        let count = |n: usize| n.checked_add(1)?.checked_mul(n.checked_add(1)?);
        let rings = |n: usize| n.checked_mul(4)?.checked_mul(m);
        count32("nodes", count(n).and_then(|core| core.checked_add(rings(n)?)))?;
        // half width for which core and rings have elements of equal size, within bounds that
        // preserve their angles
        let half_width = (n as f64 / (n + 2 * m) as f64).clamp(0.3, 0.6);
        let across = |i: usize| (2.0 * i as f64 - n as f64) / n as f64;
        let core = |[x, y]: [f64; 2]| {
            let round = [x * (1.0 - 0.5 * y * y).sqrt(), y * (1.0 - 0.5 * x * x).sqrt()];
            [
                half_width * ((1.0 - ROUNDING) * x + ROUNDING * round[0]),
                half_width * ((1.0 - ROUNDING) * y + ROUNDING * round[1]),
            ]
        };
        let mut points: Vec<[f64; 2]> =
            (0..(n + 1) * (n + 1)).map(|p| core([across(p % (n + 1)), across(p / (n + 1))])).collect();
        let mut quads: Vec<[usize; 4]> = (0..n * n)
            .map(|q| {
                let p = q % n + (n + 1) * (q / n);
                [p, p + 1, p + n + 2, p + n + 1]
            })
            .collect();
        // the edge of the core, counter-clockwise
        let edge: Vec<[usize; 2]> = (0..n)
            .map(|i| [i, 0])
            .chain((0..n).map(|i| [n, i]))
            .chain((0..n).map(|i| [n - i, n]))
            .chain((0..n).map(|i| [0, n - i]))
            .collect();
        let mut inner: Vec<usize> = edge.iter().map(|[i, j]| i + (n + 1) * j).collect();
        for ring in 1..=m {
            let t = ring as f64 / m as f64;
            let first = points.len();
            for &[i, j] in &edge {
                let square = [across(i), across(j)];
                // at equal angles along the sides of the square
                let tangents = square.map(|c| (FRAC_PI_4 * c).tan());
                let length = tangents[0].hypot(tangents[1]);
                let from = core(square);
                points.push([0, 1].map(|c| (1.0 - t) * from[c] + t * tangents[c] / length));
            }
            let outer: Vec<usize> = (first..points.len()).collect();
            for k in 0..4 * n {
                let next = (k + 1) % (4 * n);
                quads.push([inner[k], outer[k], outer[next], inner[next]]);
            }
            inner = outer;
        }
        Ok(Self { points, quads })
    }

    /// The body that the disc sweeps in `layers` steps; `position` maps a point of the disc in a layer,
    /// with a positive Jacobian. A closed sweep ends where it begins.
    fn swept(
        &self,
        name: &str,
        layers: usize,
        closed: bool,
        position: impl Fn([f64; 2], usize) -> [f64; 3],
    ) -> Result<Mesh, MeshError> {
        let (points, quads) = (self.points.len(), self.quads.len());
        let sections = if closed { layers } else { layers + 1 };
        count32("elements", quads.checked_mul(layers))?;
        count32("nodes", points.checked_mul(sections))?;
        let nodes: Vec<[f64; 3]> = (0..sections)
            .flat_map(|layer| self.points.iter().map(move |&at| (at, layer)))
            .map(|(at, layer)| position(at, layer))
            .collect();
        let elements: Vec<Element> = (0..layers)
            .flat_map(|layer| self.quads.iter().map(move |quad| (quad, layer)))
            .map(|(quad, layer)| {
                let at = |layer: usize, k: usize| (quad[k] + points * (layer % sections)) as u32;
                Element::Hex8(std::array::from_fn(|k| at(layer + k / 4, k % 4)))
            })
            .collect();
        let body = Body { name: name.to_owned(), elements: 0..elements.len(), nodes: 0..nodes.len() };
        Ok(Mesh { nodes, elements, bodies: vec![body], ..Mesh::default() })
    }
}
