//! Bodies as tetrahedra with a density at each corner.

use std::collections::HashMap;

use slipstick_mesh::{HEX_FACES, Mesh};

/// Vertices (nodes, centres of faces, centres of elements) with densities, and the hexahedra between them.
#[derive(Debug)]
pub(super) struct Lattice {
    pub points: Vec<[f64; 3]>,
    pub values: Vec<f64>,
    pub cells: Vec<Cell>,
}

/// A hexahedron of the lattice.
#[derive(Debug)]
pub(super) struct Cell {
    pub body: u32,
    corners: [u32; 8],
    faces: [u32; 6],
    centre: u32,
    /// Faces that no other element of the body has.
    outer: [bool; 6],
}

/// A tetrahedron of positive orientation: its first triangle (vertices 1, 2, 3) is counter-clockwise seen from outside and
/// lies in a face of the hexahedron, `outer` if that is on the outside of the body.
pub(super) struct Tetrahedron {
    pub vertices: [u32; 4],
    pub outer: bool,
}

impl Cell {
    /// The 24 tetrahedra: centre, centre of a face, and two corners beside each other on that face.
    pub fn tetrahedra(&self) -> impl Iterator<Item = Tetrahedron> + '_ {
        (0..6).flat_map(move |side| {
            (0..4).map(move |k| {
                let corner = |k: usize| self.corners[HEX_FACES[side][k % 4]];
                let vertices = [self.centre, self.faces[side], corner(k), corner(k + 1)];
                Tetrahedron { vertices, outer: self.outer[side] }
            })
        })
    }

    /// All 15 vertices.
    fn vertices(&self) -> impl Iterator<Item = u32> + '_ {
        self.corners.iter().chain(&self.faces).copied().chain([self.centre])
    }
}

impl Lattice {
    /// The lattice of some bodies. An element's centre has its density, the centre of a face the mean of its elements,
    /// a node the mean of its elements weighted by their volumes.
    pub fn new(mesh: &Mesh, bodies: &[usize], density: &[f64]) -> Self {
        let mut lattice = Self { points: mesh.nodes.clone(), values: vec![0.0; mesh.nodes.len()], cells: Vec::new() };
        let mut weights = vec![0.0; mesh.nodes.len()];
        for &body in bodies {
            // Per face, by its nodes: its vertex and the cell that had it first.
            let mut known: HashMap<[u32; 4], (u32, usize, usize)> = HashMap::new();
            for element in mesh.bodies[body].elements.clone() {
                let (corners, value) = (mesh.hexes[element], density[element]);
                let volume = mesh.element_volume(element);
                for node in corners {
                    lattice.values[node as usize] += volume * value;
                    weights[node as usize] += volume;
                }
                let number = lattice.cells.len();
                let mut cell = Cell { body: body as u32, corners, faces: [0; 6], centre: 0, outer: [true; 6] };
                cell.centre = lattice.add(mean(&mesh.nodes, &corners), value);
                for side in 0..6 {
                    let nodes = HEX_FACES[side].map(|k| corners[k]);
                    let mut key = nodes;
                    key.sort_unstable();
                    match known.remove(&key) {
                        Some((vertex, other, other_side)) => {
                            cell.faces[side] = vertex;
                            let at = &mut lattice.values[vertex as usize];
                            *at = 0.5 * (*at + value);
                            cell.outer[side] = false;
                            lattice.cells[other].outer[other_side] = false;
                        }
                        None => {
                            let vertex = lattice.add(mean(&mesh.nodes, &nodes), value);
                            known.insert(key, (vertex, number, side));
                            cell.faces[side] = vertex;
                        }
                    }
                }
                lattice.cells.push(cell);
            }
        }
        for (value, weight) in lattice.values.iter_mut().zip(weights).filter(|(_, weight)| *weight > 0.0) {
            *value /= weight;
        }
        lattice
    }

    fn add(&mut self, point: [f64; 3], value: f64) -> u32 {
        self.points.push(point);
        self.values.push(value);
        (self.points.len() - 1) as u32
    }

    /// The largest density of the cells.
    pub fn largest(&self) -> f64 {
        let values = self.cells.iter().flat_map(Cell::vertices).map(|v| self.values[v as usize]);
        values.fold(0.0, f64::max)
    }

    /// The threshold above which the part of the bodies has this volume, as closely as the densities allow. \[L³\]
    ///
    /// The volume falls with the threshold, so halving an interval finds it.
    pub fn threshold_of_volume(&self, volume: f64) -> f64 {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if self.volume_above(middle) > volume { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// Volume of the part where the density, linear in each tetrahedron, exceeds a threshold. \[L³\]
    fn volume_above(&self, threshold: f64) -> f64 {
        let of_cell = |cell: &Cell| -> f64 {
            let values = cell.vertices().map(|v| self.values[v as usize]);
            let (least, most) = values.fold((1.0f64, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
            if most <= threshold {
                return 0.0;
            }
            let part = |t: Tetrahedron| {
                let whole = self.volume(t.vertices);
                if least > threshold { whole } else { whole * self.fraction_above(t.vertices, threshold) }
            };
            cell.tetrahedra().map(part).sum()
        };
        self.cells.iter().map(of_cell).sum()
    }

    fn volume(&self, vertices: [u32; 4]) -> f64 {
        let [o, a, b, c] = vertices.map(|v| self.points[v as usize]);
        let edge = |p: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| p[k] - o[k]) };
        let (a, b, c) = (edge(a), edge(b), edge(c));
        let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        (a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]) / 6.0
    }

    /// Which part of a tetrahedron is above a threshold. Cutting a corner off leaves the product of the parts of its
    /// three edges; of two corners above, one minus what two cuts through the edges take.
    fn fraction_above(&self, vertices: [u32; 4], threshold: f64) -> f64 {
        let mut v = vertices.map(|v| self.values[v as usize]);
        v.sort_unstable_by(f64::total_cmp);
        let above = v.iter().filter(|&&value| value > threshold).count();
        let corner =
            |at: f64, others: [f64; 3]| -> f64 { others.map(|o| (threshold - at) / (o - at)).iter().product() };
        match above {
            0 => 0.0,
            1 => corner(v[3], [v[0], v[1], v[2]]),
            // The wedge between the edges that are cut, from the corner v₃: Σ of two tetrahedra and a prism part.
            2 => {
                let along = |from: f64, to: f64| (threshold - from) / (to - from);
                let (a, b) = (along(v[3], v[0]), along(v[3], v[1]));
                let (c, d) = (along(v[2], v[0]), along(v[2], v[1]));
                a * b + a * d * (1.0 - b) + c * d * (1.0 - a)
            }
            3 => 1.0 - corner(v[0], [v[1], v[2], v[3]]),
            _ => 1.0,
        }
    }
}

fn mean<const N: usize>(points: &[[f64; 3]], nodes: &[u32; N]) -> [f64; 3] {
    std::array::from_fn(|c| nodes.iter().map(|&n| points[n as usize][c]).sum::<f64>() / N as f64)
}
