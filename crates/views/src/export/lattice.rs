//! Divides bodies into tetrahedra with a density at each corner.

use std::collections::{BTreeMap, HashMap, HashSet};

use slipstick_mesh::{Element, FacetNodes, Mesh};

use super::thin::above;

/// Vertices (nodes, centres of faces, centres of elements) with densities, and the elements between
/// them.
#[derive(Debug)]
pub(super) struct Lattice {
    pub points: Vec<[f64; 3]>,
    pub values: Vec<f64>,
    /// Whether all elements at a vertex are tetrahedra.
    pub tetrahedral: Vec<bool>,
    pub cells: Vec<Cell>,
    /// The edges of bodies that are not only tetrahedra.
    pub edges: Vec<LatticeEdge>,
}

/// An edge of elements.
#[derive(Debug)]
pub(super) struct LatticeEdge {
    pub ends: [u32; 2],
    /// The smallest and the largest density of the elements around it.
    pub least: f64,
    /// See `least`.
    pub most: f64,
}

/// An element of the lattice.
#[derive(Debug)]
pub(super) struct Cell {
    pub body: u32,
    faces: Vec<CellFace>,
    /// None in a linear tetrahedron, which is not divided.
    centre: Option<u32>,
}

/// A face of an element, or one of the triangles that it is divided into.
#[derive(Debug)]
struct CellFace {
    /// Counter-clockwise seen from outside.
    nodes: FacetNodes,
    /// The centre of a quadrilateral; triangles are not divided.
    centre: Option<u32>,
    /// Whether no other element of the body has this face.
    outer: bool,
    label: u32,
}

/// A tetrahedron of positive orientation: its vertices 1, 2, 3 are counter-clockwise seen from the
/// opposite side of vertex 0.
pub(super) struct Tetrahedron {
    pub vertices: [u32; 4],
    /// Its triangles on the outside of the body, counter-clockwise seen from there, with the labels
    /// of their faces.
    pub outer: [Option<([u32; 3], u32)>; 4],
}

/// Relative difference below which volumes are the same, and the smallest range of thresholds with
/// the same volume whose middle is taken.
const SAME: f64 = 1e-4;
const WIDE: f64 = 0.1;

/// Distance from the threshold of a value that counts as above or below.
const BESIDE: f64 = 1e-9;

/// Labels of outer faces by their sorted nodes; faces that are not listed have the label 0.
pub type FaceLabels = HashMap<FacetNodes, u32>;

impl Cell {
    /// The tetrahedra between the centre of the element and the triangles of its faces: a triangular
    /// face itself, or the centre of a quadrilateral and two adjacent corners. A linear tetrahedron
    /// is itself the only one.
    pub fn tetrahedra(&self) -> impl Iterator<Item = Tetrahedron> + '_ {
        let whole = self.centre.is_none().then(|| self.whole());
        let divided = self.centre.into_iter().flat_map(move |centre| {
            self.faces.iter().flat_map(CellFace::triangles).map(move |(triangle, outer)| {
                let [a, b, c] = triangle;
                Tetrahedron {
                    vertices: [centre, a, b, c],
                    outer: [outer.map(|label| (triangle, label)), None, None, None],
                }
            })
        });
        whole.into_iter().chain(divided)
    }

    fn whole(&self) -> Tetrahedron {
        let mut outer = [None; 4];
        for (at, face) in outer.iter_mut().zip(&self.faces) {
            *at = face.outer.then(|| ([face.nodes[0], face.nodes[1], face.nodes[2]], face.label));
        }
        let base = self.faces[0].nodes;
        let apex = self.faces[1].nodes.iter().copied().find(|n| !base.contains(n)).unwrap_or(base[0]);
        Tetrahedron { vertices: [apex, base[0], base[1], base[2]], outer }
    }

    /// All vertices; those of several faces appear several times.
    fn vertices(&self) -> impl Iterator<Item = u32> + '_ {
        self.faces.iter().flat_map(|face| face.nodes.iter().copied().chain(face.centre)).chain(self.centre)
    }
}

impl CellFace {
    /// Its triangles; on the outside of the body with its label.
    fn triangles(&self) -> impl Iterator<Item = ([u32; 3], Option<u32>)> + '_ {
        let label = self.outer.then_some(self.label);
        let count = if self.centre.is_some() { self.nodes.len() } else { 1 };
        (0..count).map(move |k| {
            let next = (k + 1) % self.nodes.len();
            let triangle = match self.centre {
                Some(centre) => [centre, self.nodes[k], self.nodes[next]],
                None => [self.nodes[0], self.nodes[1], self.nodes[2]],
            };
            (triangle, label)
        })
    }
}

impl Lattice {
    /// The lattice of some bodies. A node gets the volume-weighted mean of its elements; one on an outer face, of
    /// those with an outer face there, so that a solid skin stays whole. The centre
    /// of a quadrilateral the mean of its elements, the centre of a hexahedron or a wedge the
    /// element's own density. Tetrahedra have no values of their own, only those of their nodes:
    /// there are five or six for each node, and their scatter would be ripples of the surface.
    pub fn new(mesh: &Mesh, bodies: &[usize], density: &[f64], labels: &FaceLabels) -> Self {
        let count = mesh.nodes.len();
        let (values, tetrahedral) = (vec![0.0; count], vec![true; count]);
        let mut lattice =
            Self { points: mesh.nodes.clone(), values, tetrahedral, cells: Vec::new(), edges: Vec::new() };
        let mut weights = vec![0.0; mesh.nodes.len()];
        // Centres of quadratic tetrahedra, which get the mean of their nodes.
        let mut between: Vec<(u32, usize)> = Vec::new();
        // by their ends, in a fixed order
        let mut edges: BTreeMap<[u32; 2], (f64, f64)> = BTreeMap::new();
        for &body in bodies {
            let divided: HashMap<FacetNodes, [FacetNodes; 2]> =
                mesh.divided_quadrilaterals(body).into_iter().map(|[whole, a, b]| (whole.sorted(), [a, b])).collect();
            let facets = mesh.boundary(body).facets;
            let at_facets = facets.iter().flat_map(|facet| facet.nodes.iter().map(|&n| (n, facet.element)));
            let mut skin: Vec<(u32, u32)> = at_facets.collect();
            skin.sort_unstable();
            skin.dedup();
            let on_skin: HashSet<u32> = skin.iter().map(|(n, _)| *n).collect();
            let counts = |n: u32, e: usize| !on_skin.contains(&n) || skin.binary_search(&(n, e as u32)).is_ok();
            // Per face, by its nodes: its vertex and the first cell that has it.
            let mut known: HashMap<FacetNodes, (Option<u32>, usize, usize)> = HashMap::new();
            let is_tetrahedron = |e: usize| matches!(mesh.elements[e], Element::Tet4(_) | Element::Tet10(_));
            let undivided = mesh.bodies[body].elements.clone().all(is_tetrahedron);
            for number in mesh.bodies[body].elements.clone() {
                let (element, value) = (&mesh.elements[number], density[number]);
                let volume = mesh.element_volume(number);
                let tetrahedron = is_tetrahedron(number);
                for &node in element.nodes() {
                    lattice.tetrahedral[node as usize] &= tetrahedron;
                    if counts(node, number) {
                        lattice.values[node as usize] += volume * value;
                        weights[node as usize] += volume;
                    }
                }
                let centre = match element {
                    Element::Tet4(_) => None,
                    _ => Some(lattice.add(mean(&mesh.nodes, element.nodes()), value, tetrahedron)),
                };
                if matches!(element, Element::Tet10(_)) {
                    between.extend(centre.map(|centre| (centre, number)));
                }
                let mut cell = Cell { body: body as u32, faces: Vec::with_capacity(element.sides()), centre };
                let whole = (0..element.sides()).map(|side| element.side(side));
                for nodes in whole.flat_map(|side| parts(side, &divided)) {
                    for k in 0..if undivided { 0 } else { nodes.len() } {
                        let (a, b) = (nodes[k], nodes[(k + 1) % nodes.len()]);
                        let around = edges.entry([a.min(b), a.max(b)]).or_insert((value, value));
                        *around = (around.0.min(value), around.1.max(value));
                    }
                    let key = nodes.sorted();
                    let (centre, outer) = match known.remove(&key) {
                        Some((vertex, other, place)) => {
                            if let Some(vertex) = vertex {
                                let at = &mut lattice.values[vertex as usize];
                                *at = 0.5 * (*at + value);
                            }
                            lattice.cells[other].faces[place].outer = false;
                            (vertex, false)
                        }
                        None => {
                            let vertex =
                                (nodes.len() > 3).then(|| lattice.add(mean(&mesh.nodes, &nodes), value, false));
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
        let edge = |(ends, (least, most))| LatticeEdge { ends, least, most };
        let only_tetrahedra = |edge: &LatticeEdge| edge.ends.iter().all(|&n| lattice.tetrahedral[n as usize]);
        lattice.edges = edges.into_iter().map(edge).filter(|edge| !only_tetrahedra(edge)).collect();
        for (centre, number) in between {
            let nodes = mesh.elements[number].nodes();
            let sum: f64 = nodes.iter().map(|&n| lattice.values[n as usize]).sum();
            lattice.values[centre as usize] = sum / nodes.len() as f64;
        }
        lattice
    }

    fn add(&mut self, point: [f64; 3], value: f64, tetrahedral: bool) -> u32 {
        self.tetrahedral.push(tetrahedral);
        self.points.push(point);
        self.values.push(value);
        (self.points.len() - 1) as u32
    }

    /// Mean volume of the elements. \[L³\]
    pub fn mean_volume(&self) -> f64 {
        let all = self.cells.iter().flat_map(Cell::tetrahedra).map(|t| self.volume(t.vertices));
        all.sum::<f64>() / self.cells.len().max(1) as f64
    }

    /// The largest density of the cells.
    pub fn largest(&self) -> f64 {
        let values = self.cells.iter().flat_map(Cell::vertices).map(|v| self.values[v as usize]);
        values.fold(0.0, f64::max)
    }

    /// The threshold at which the part above it has this volume, as closely as the densities
    /// allow. \[L³\]
    ///
    /// The volume decreases with the threshold, except for jumps where nodes of thin walls and gaps change
    /// sides, so bisection finds it or such a jump. Where it hardly changes over a
    /// wide range of thresholds, as that of a solid body, this is the middle of the range.
    pub fn threshold_of_volume(&self, volume: f64) -> f64 {
        let last = |above: f64| {
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                if self.volume_above(middle) > above { low = middle } else { high = middle }
            }
            0.5 * (low + high)
        };
        let [from, to] = [1.0 + SAME, 1.0 - SAME].map(|factor| last(volume * factor));
        if to - from > WIDE { 0.5 * (from + to) } else { last(volume) }
    }

    /// Volume of the part where the density, linear in each tetrahedron, exceeds a
    /// threshold. \[L³\]
    fn volume_above(&self, threshold: f64) -> f64 {
        // beside thin walls and gaps, the surface is next to the nodes
        let counts = |(&value, above): (&f64, bool)| match above {
            true => f64::max(value, threshold + BESIDE),
            false => f64::min(value, threshold - BESIDE),
        };
        let counted: Vec<f64> = self.values.iter().zip(above(self, threshold)).map(counts).collect();
        let of_cell = |cell: &Cell| -> f64 {
            let values = cell.vertices().map(|v| counted[v as usize]);
            let (least, most) = values.fold((1.0f64, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
            if most <= threshold {
                return 0.0;
            }
            let part = |t: Tetrahedron| {
                let whole = self.volume(t.vertices);
                if least > threshold {
                    whole
                } else {
                    whole * fraction_above(t.vertices.map(|v| counted[v as usize]), threshold)
                }
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
}

/// The fraction of a tetrahedron with these values at its corners that is above a threshold. If one corner
/// is cut off, it is the product of the fractions of its three edges; if two corners are above, it is one
/// minus the volumes of two cuts through the edges.
fn fraction_above(mut v: [f64; 4], threshold: f64) -> f64 {
    v.sort_unstable_by(f64::total_cmp);
    let above = v.iter().filter(|&&value| value > threshold).count();
    let corner = |at: f64, others: [f64; 3]| -> f64 { others.map(|o| (threshold - at) / (o - at)).iter().product() };
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

#[cfg(test)]
mod tests {
    use crate::export::{ExportOptions, design_surface};
    use crate::vector::{cross, dot, norm, subtract};
    use slipstick_mesh::{BoxShape, Element, box_mesh};

    /// Tetrahedra with a face on the top of a box are solid, others void: the top has no holes, although the mean over
    /// all tetrahedra at its nodes is far below the threshold. Only at its rim, of 24 nodes, void sides take a little.
    #[test]
    fn a_solid_skin_of_tetrahedra_has_no_holes() {
        let shape = BoxShape { min: [0.0; 3], max: [6.0, 4.0, 6.0], elements: [6, 4, 6], grading: [1.0; 3] };
        let mut mesh = box_mesh("block", &shape).expect("a box");
        // six tetrahedra around the diagonal from the first to the opposite corner
        let cut = [[0, 1, 2, 6], [0, 1, 5, 6], [0, 3, 2, 6], [0, 3, 7, 6], [0, 4, 5, 6], [0, 4, 7, 6]];
        let mut elements = Vec::new();
        for element in &mesh.elements {
            for mut corners in cut.map(|of| of.map(|k| element.nodes()[k])) {
                let [a, b, c, d] = corners.map(|n| mesh.nodes[n as usize]);
                if dot(cross(subtract(b, a), subtract(c, a)), subtract(d, a)) < 0.0 {
                    corners.swap(1, 2);
                }
                elements.push(Element::Tet4(corners));
            }
        }
        mesh.bodies[0].elements = 0..elements.len();
        mesh.elements = elements;
        mesh.surfaces.clear();
        let top = |n: &u32| mesh.nodes[*n as usize][1] == 4.0;
        let solid = |e: &Element| e.nodes().iter().filter(|n| top(n)).count() == 3;
        let density: Vec<f64> = mesh.elements.iter().map(|e| f64::from(u8::from(solid(e)))).collect();
        let options = ExportOptions { threshold: Some(0.5), smoothing: 0, ..ExportOptions::default() };
        let surface = design_surface(&mesh, &density, &options).expect("a surface").surface;
        let on_top = |t: &usize| surface.corners(*t).iter().all(|x| x[1] == 4.0);
        let area = |t: usize| 0.5 * norm(surface.area_vector(t));
        let found: f64 = (0..surface.triangles.len()).filter(on_top).map(area).sum();
        assert!((35.5..36.0).contains(&found), "{found}");
        assert_eq!(surface.open_edges(), 0);
    }
}
