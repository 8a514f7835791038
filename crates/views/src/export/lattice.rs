//! Divides bodies into tetrahedra with a density at each corner.

use std::collections::HashMap;

use slipstick_mesh::{FacetNodes, Mesh};

/// Vertices (nodes, centres of faces, centres of elements) with densities, and the elements between
/// them.
#[derive(Debug)]
pub(super) struct Lattice {
    pub points: Vec<[f64; 3]>,
    pub values: Vec<f64>,
    pub cells: Vec<Cell>,
}

/// An element of the lattice.
#[derive(Debug)]
pub(super) struct Cell {
    pub body: u32,
    faces: Vec<CellFace>,
    centre: u32,
}

/// A face of an element, or one of the triangles that it is divided into.
#[derive(Debug)]
struct CellFace {
    /// Counter-clockwise seen from outside.
    nodes: FacetNodes,
    centre: u32,
    /// Whether no other element of the body has this face.
    outer: bool,
    label: u32,
}

/// A tetrahedron of positive orientation: its first triangle (vertices 1, 2, 3) is
/// counter-clockwise seen from outside and lies in a face of the element, `outer` if that is on the
/// outside of the body.
pub(super) struct Tetrahedron {
    pub vertices: [u32; 4],
    pub outer: bool,
    /// The label of that face.
    pub label: u32,
}

/// Labels of outer faces by their sorted nodes; faces that are not listed have the label 0.
pub type FaceLabels = HashMap<FacetNodes, u32>;

impl Cell {
    /// The tetrahedra: centre of the element, centre of a face, and two adjacent corners of that
    /// face.
    pub fn tetrahedra(&self) -> impl Iterator<Item = Tetrahedron> + '_ {
        self.faces.iter().flat_map(move |face| {
            (0..face.nodes.len()).map(move |k| {
                let next = (k + 1) % face.nodes.len();
                let vertices = [self.centre, face.centre, face.nodes[k], face.nodes[next]];
                Tetrahedron { vertices, outer: face.outer, label: face.label }
            })
        })
    }

    /// All vertices; those of several faces appear several times.
    fn vertices(&self) -> impl Iterator<Item = u32> + '_ {
        self.faces.iter().flat_map(|face| face.nodes.iter().copied().chain([face.centre])).chain([self.centre])
    }
}

impl Lattice {
    /// The lattice of some bodies. The centre of an element gets the element's density, the centre
    /// of a face the mean of its elements, a node the volume-weighted mean of its elements.
    pub fn new(mesh: &Mesh, bodies: &[usize], density: &[f64], labels: &FaceLabels) -> Self {
        let mut lattice = Self { points: mesh.nodes.clone(), values: vec![0.0; mesh.nodes.len()], cells: Vec::new() };
        let mut weights = vec![0.0; mesh.nodes.len()];
        for &body in bodies {
            let divided: HashMap<FacetNodes, [FacetNodes; 2]> =
                mesh.divided_quadrilaterals(body).into_iter().map(|[whole, a, b]| (whole.sorted(), [a, b])).collect();
            // Per face, by its nodes: its vertex and the first cell that has it.
            let mut known: HashMap<FacetNodes, (u32, usize, usize)> = HashMap::new();
            for number in mesh.bodies[body].elements.clone() {
                let (element, value) = (&mesh.elements[number], density[number]);
                let volume = mesh.element_volume(number);
                for &node in element.nodes() {
                    lattice.values[node as usize] += volume * value;
                    weights[node as usize] += volume;
                }
                let centre = lattice.add(mean(&mesh.nodes, element.nodes()), value);
                let mut cell = Cell { body: body as u32, faces: Vec::with_capacity(element.sides()), centre };
                let whole = (0..element.sides()).map(|side| element.side(side));
                for nodes in whole.flat_map(|side| parts(side, &divided)) {
                    let key = nodes.sorted();
                    let (centre, outer) = match known.remove(&key) {
                        Some((vertex, other, place)) => {
                            let at = &mut lattice.values[vertex as usize];
                            *at = 0.5 * (*at + value);
                            lattice.cells[other].faces[place].outer = false;
                            (vertex, false)
                        }
                        None => {
                            let vertex = lattice.add(mean(&mesh.nodes, &nodes), value);
                            known.insert(key, (vertex, lattice.cells.len(), cell.faces.len()));
                            (vertex, true)
                        }
                    };
                    let label = labels.get(&key).copied().unwrap_or(0);
                    cell.faces.push(CellFace { nodes, centre, outer, label });
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

    /// The threshold at which the part above it has this volume, as closely as the densities
    /// allow. \[L³\]
    ///
    /// The volume decreases with the threshold, so bisection finds it.
    pub fn threshold_of_volume(&self, volume: f64) -> f64 {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if self.volume_above(middle) > volume { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// Volume of the part where the density, linear in each tetrahedron, exceeds a
    /// threshold. \[L³\]
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

    /// The fraction of a tetrahedron that is above a threshold. If one corner is cut off, it is the
    /// product of the fractions of its three edges; if two corners are above, it is one minus the
    /// volumes of two cuts through the edges.
    fn fraction_above(&self, vertices: [u32; 4], threshold: f64) -> f64 {
        let mut v = vertices.map(|v| self.values[v as usize]);
        v.sort_unstable_by(f64::total_cmp);
        let above = v.iter().filter(|&&value| value > threshold).count();
        let corner =
            |at: f64, others: [f64; 3]| -> f64 { others.map(|o| (threshold - at) / (o - at)).iter().product() };
        match above {
            0 => 0.0,
            1 => corner(v[3], [v[0], v[1], v[2]]),
            // The wedge between the edges that are cut, from the corner v₃: Σ of two tetrahedra and
            // a prism part.
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

/// A face, or the triangles of neighbours that cover it.
fn parts(face: FacetNodes, divided: &HashMap<FacetNodes, [FacetNodes; 2]>) -> Vec<FacetNodes> {
    match (face.len(), divided.get(&face.sorted())) {
        (4, Some(triangles)) => triangles.to_vec(),
        _ => vec![face],
    }
}

fn mean(points: &[[f64; 3]], nodes: &[u32]) -> [f64; 3] {
    std::array::from_fn(|c| nodes.iter().map(|&n| points[n as usize][c]).sum::<f64>() / nodes.len() as f64)
}
