//! Second-order elements: shape functions, volumes, mid-side nodes of first-order meshes, and the
//! map from nodes to the points of contact surfaces.

use std::collections::{BTreeMap, HashMap, HashSet};

use crate::vector::{cross, dot, norm};
use crate::{
    Element, FaceNodes, FacetNodes, HEX_EDGES, HEX_FACE_CENTRES, HEX_FACES, Mesh, MeshError, SUB_FACETS, Surface,
    TET_EDGES,
};

/// Shape functions and their derivatives with respect to the parent coordinates.
pub type Shapes<const N: usize> = ([f64; N], [[f64; 3]; N]);

/// Parent coordinates (ξ, η, ζ) of the nodes of a hex27.
pub const HEX27_NODES: [[f64; 3]; 27] = {
    let mut out = [[0.0; 3]; 27];
    let mut i = 0;
    while i < 8 {
        out[i] = crate::geometry::HEX_CORNERS[i];
        i += 1;
    }
    i = 0;
    while i < 12 {
        let [a, b] = HEX_EDGES[i];
        let mut c = 0;
        while c < 3 {
            out[8 + i][c] = 0.5 * (out[a][c] + out[b][c]);
            c += 1;
        }
        i += 1;
    }
    i = 0;
    while i < 6 {
        let [a, _, c, _] = HEX_FACES[i];
        let mut d = 0;
        while d < 3 {
            out[HEX_FACE_CENTRES[i]][d] = 0.5 * (out[a][d] + out[c][d]);
            d += 1;
        }
        i += 1;
    }
    out
};

/// Points and weights of the eight-point rule of tet10, exact for polynomials of degree 3, so that
/// curved elements pass the patch test. Four points would suffice for the rank of the stiffness,
/// but not for the patch test. Source: C. A. Felippa, Engrg. Comput. 21 (2004) 867–890.
pub const TET10_POINTS: [([f64; 3], f64); 8] = {
    const A: f64 = 0.328_163_302_516_381_7;
    const B: f64 = 0.108_047_249_898_428_6;
    const WA: f64 = 0.136_217_842_537_087_4 / 6.0;
    const WB: f64 = 0.113_782_157_462_912_6 / 6.0;
    const FAR_A: f64 = 1.0 - 3.0 * A;
    const FAR_B: f64 = 1.0 - 3.0 * B;
    [
        ([A, A, A], WA),
        ([FAR_A, A, A], WA),
        ([A, FAR_A, A], WA),
        ([A, A, FAR_A], WA),
        ([B, B, B], WB),
        ([FAR_B, B, B], WB),
        ([B, FAR_B, B], WB),
        ([B, B, FAR_B], WB),
    ]
};

/// Points and weights of the 3×3×3 Gauss rule of hex27, exact for polynomials of degree 5 in each
/// coordinate.
pub const HEX27_POINTS: [([f64; 3], f64); 27] = {
    const G: f64 = 0.774_596_669_241_483_4; // √(3/5)
    const LINE: [(f64, f64); 3] = [(-G, 5.0 / 9.0), (0.0, 8.0 / 9.0), (G, 5.0 / 9.0)];
    let mut out = [([0.0; 3], 0.0); 27];
    let mut i = 0;
    while i < 27 {
        let (x, y, z) = (LINE[i % 3], LINE[i / 3 % 3], LINE[i / 9]);
        out[i] = ([x.0, y.0, z.0], x.1 * y.1 * z.1);
        i += 1;
    }
    out
};

/// Abscissas and weights of the four-point Gauss rule on −1 … 1.
const FOUR: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];

/// Shape functions of a tet10 at the parent coordinates of its corners 1, 2 and 3.
pub fn tet10_shapes([x, y, z]: [f64; 3]) -> Shapes<10> {
    let corner = [1.0 - x - y - z, x, y, z];
    let slope = [[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let (mut values, mut slopes) = ([0.0; 10], [[0.0; 3]; 10]);
    for i in 0..4 {
        values[i] = corner[i] * (2.0 * corner[i] - 1.0);
        slopes[i] = slope[i].map(|s| (4.0 * corner[i] - 1.0) * s);
    }
    for (edge, [a, b]) in TET_EDGES.into_iter().enumerate() {
        values[4 + edge] = 4.0 * corner[a] * corner[b];
        slopes[4 + edge] = std::array::from_fn(|c| 4.0 * (corner[a] * slope[b][c] + corner[b] * slope[a][c]));
    }
    (values, slopes)
}

/// Quadratic shape function of the node at −1, 0 or 1, and its derivative.
pub fn quadratic(node: f64, x: f64) -> (f64, f64) {
    if node == 0.0 { (1.0 - x * x, -2.0 * x) } else { (0.5 * x * (x + node), x + 0.5 * node) }
}

/// Shape functions of a hex27 in the parent cube.
pub fn hex27_shapes(at: [f64; 3]) -> Shapes<27> {
    let (mut values, mut slopes) = ([0.0; 27], [[0.0; 3]; 27]);
    for (i, node) in HEX27_NODES.iter().enumerate() {
        let [x, y, z] = [0, 1, 2].map(|c| quadratic(node[c], at[c]));
        values[i] = x.0 * y.0 * z.0;
        slopes[i] = [x.1 * y.0 * z.0, x.0 * y.1 * z.0, x.0 * y.0 * z.1];
    }
    (values, slopes)
}

/// Shape functions of a face and their derivatives with respect to its two parent coordinates: a
/// triangle with three or six nodes, or a quadrilateral with four or nine.
pub fn face_shapes(nodes: usize, [x, y]: [f64; 2]) -> Vec<(f64, [f64; 2])> {
    const CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let triangle = [(1.0 - x - y, [-1.0, -1.0]), (x, [1.0, 0.0]), (y, [0.0, 1.0])];
    match nodes {
        3 => triangle.to_vec(),
        4 => {
            let bilinear = |[a, b]: [f64; 2]| {
                let (along, across) = (1.0 + a * x, 1.0 + b * y);
                (0.25 * along * across, [0.25 * a * across, 0.25 * along * b])
            };
            CORNERS.map(bilinear).to_vec()
        }
        6 => {
            let corner = triangle.map(|(l, s)| (l * (2.0 * l - 1.0), s.map(|s| (4.0 * l - 1.0) * s)));
            let middle = [(0, 1), (1, 2), (2, 0)].map(|(a, b)| {
                let ((la, sa), (lb, sb)) = (triangle[a], triangle[b]);
                (4.0 * la * lb, [0, 1].map(|c| 4.0 * (la * sb[c] + lb * sa[c])))
            });
            corner.into_iter().chain(middle).collect()
        }
        _ => {
            let node = |at: [f64; 2]| {
                let [along, across] = [0, 1].map(|c| quadratic(at[c], [x, y][c]));
                (along.0 * across.0, [along.1 * across.0, along.0 * across.1])
            };
            let middle = |i: usize| [0, 1].map(|c| 0.5 * (CORNERS[i][c] + CORNERS[(i + 1) % 4][c]));
            CORNERS.into_iter().chain((0..4).map(middle)).chain([[0.0; 2]]).map(node).collect()
        }
    }
}

/// Tangents ∂X/∂ξ_β at a point. \[L\]
fn tangents<const N: usize>(nodes: &[[f64; 3]; N], slopes: &[[f64; 3]; N]) -> [[f64; 3]; 3] {
    let along = |beta: usize, c: usize| nodes.iter().zip(slopes).map(|(x, slope)| x[c] * slope[beta]).sum();
    std::array::from_fn(|beta| std::array::from_fn(|c| along(beta, c)))
}

fn jacobian<const N: usize>(nodes: &[[f64; 3]; N], (_, slopes): &Shapes<N>) -> f64 {
    let [a, b, c] = tangents(nodes, slopes);
    dot(a, cross(b, c))
}

/// Volume and first moment about node 0.
fn moments<const N: usize>(
    nodes: &[[f64; 3]; N],
    points: impl Iterator<Item = ([f64; 3], f64)>,
    shapes: impl Fn([f64; 3]) -> Shapes<N>,
) -> (f64, [f64; 3]) {
    let local = nodes.map(|x| crate::vector::subtract(x, nodes[0]));
    let (mut volume, mut moment) = (0.0, [0.0; 3]);
    for (at, weight) in points {
        let shapes = shapes(at);
        let weight = weight * jacobian(&local, &shapes);
        volume += weight;
        for (x, shape) in local.iter().zip(shapes.0) {
            (0..3).for_each(|c| moment[c] += weight * shape * x[c]);
        }
    }
    (volume, moment)
}

/// The tensor-product four-point rule, exact for degree 7 in each coordinate.
fn cube() -> impl Iterator<Item = ([f64; 3], f64)> {
    (0..64).map(|i| {
        let [x, y, z] = [i % 4, i / 4 % 4, i / 16].map(|i| FOUR[i]);
        ([x.0, y.0, z.0], x.1 * y.1 * z.1)
    })
}

/// Volume of a tet10 \[L³\] and first moment about its first node \[L⁴\]. The rule on the cube,
/// collapsed to a tetrahedron, integrates degree 5 exactly.
pub(crate) fn tet10_moments(nodes: &[[f64; 3]; 10]) -> (f64, [f64; 3]) {
    let collapsed = cube().map(|(at, weight)| {
        let [u, v, w] = at.map(|c| 0.5 * (1.0 + c));
        ([u, v * (1.0 - u), w * (1.0 - u) * (1.0 - v)], 0.125 * weight * (1.0 - u) * (1.0 - u) * (1.0 - v))
    });
    moments(nodes, collapsed, tet10_shapes)
}

/// Volume of a hex27 \[L³\] and first moment about its first node \[L⁴\]. The integrands have degree
/// 5 and 7 in each coordinate.
pub(crate) fn hex27_moments(nodes: &[[f64; 3]; 27]) -> (f64, [f64; 3]) {
    moments(nodes, cube(), hex27_shapes)
}

/// Parent coordinates of the nodes of a tet10.
fn tet10_nodes() -> [[f64; 3]; 10] {
    let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    std::array::from_fn(|i| match i.checked_sub(4) {
        None => corners[i],
        Some(edge) => {
            let [a, b] = TET_EDGES[edge];
            std::array::from_fn(|c| 0.5 * (corners[a][c] + corners[b][c]))
        }
    })
}

/// Jacobian determinants of a tet10 at its nodes and integration points. \[L³\]
pub fn tet10_jacobians(nodes: &[[f64; 3]; 10]) -> Vec<f64> {
    let points = tet10_nodes().into_iter().chain(TET10_POINTS.map(|(at, _)| at));
    points.map(|at| jacobian(nodes, &tet10_shapes(at))).collect()
}

/// Jacobian determinants of a hex27 at its nodes and integration points. \[L³\]
pub fn hex27_jacobians(nodes: &[[f64; 3]; 27]) -> Vec<f64> {
    let points = HEX27_NODES.into_iter().chain(HEX27_POINTS.map(|(at, _)| at));
    points.map(|at| jacobian(nodes, &hex27_shapes(at))).collect()
}

/// The smallest of several numbers; NaN if any is NaN.
pub(crate) fn least(values: &[f64]) -> f64 {
    values.iter().fold(f64::INFINITY, |least, &value| if value.is_nan() || value < least { value } else { least })
}

/// Determinant of three unit vectors in these directions; 0 if one has no length.
fn unit_determinant([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let lengths = norm(a) * norm(b) * norm(c);
    if lengths == 0.0 { 0.0 } else { dot(a, cross(b, c)) / lengths }
}

/// Smallest determinant of the unit tangents of a hex27 over its nodes. \[–\]
pub(crate) fn hex27_scaled_jacobian(nodes: &[[f64; 3]; 27]) -> f64 {
    least(&HEX27_NODES.map(|at| unit_determinant(tangents(nodes, &hex27_shapes(at).1))))
}

/// Smallest of √2 times the determinants of the unit tangents along the edges at the corners of a
/// tet10, and of the Jacobian determinants at the middles of its edges relative to the mean over its
/// corners. That of a straight element is the [scaled Jacobian](crate::tet_scaled_jacobian) of its
/// corners. \[–\]
pub(crate) fn tet10_scaled_jacobian(nodes: &[[f64; 3]; 10]) -> f64 {
    let places = tet10_nodes();
    let at_corner = |corner: usize| {
        let along = tangents(nodes, &tet10_shapes(places[corner]).1);
        // towards the other three corners, in an order of positive determinant
        let towards = |to: usize| -> [f64; 3] {
            let step: [f64; 3] = std::array::from_fn(|c| places[to][c] - places[corner][c]);
            std::array::from_fn(|c| (0..3).map(|beta| step[beta] * along[beta][c]).sum())
        };
        let [a, b, c] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]][corner].map(towards);
        std::f64::consts::SQRT_2 * unit_determinant([a, b, c])
    };
    let corners = least(&[0, 1, 2, 3].map(at_corner));
    let determinants = places.map(|at| jacobian(nodes, &tet10_shapes(at)));
    let mean = 0.25 * determinants[..4].iter().sum::<f64>();
    let middles = least(&determinants[4..]);
    if middles >= mean || mean <= 0.0 { corners } else { corners.min(middles / mean) }
}

/// The parents of each node that is not a corner: the end nodes of its edge, or the corners of its
/// face or element.
type Parents = BTreeMap<Vec<u32>, u32>;

impl Mesh {
    /// The mesh of one body with second-order elements instead of its tetrahedra and hexahedra. New
    /// nodes follow the existing ones; `place` computes the position of a node from those of its
    /// parents (the ends of its edge, or the corners of its face or element).
    ///
    /// The new nodes of a boundary face belong to a node set if all corners of the face are in the
    /// set. The new node of an edge also belongs to the set if both its ends do and neither lies on
    /// such a face.
    ///
    /// # Errors
    /// [`MeshError::Parameter`] if the mesh has wedges or second-order elements.
    pub fn second_order(&self, place: impl Fn(&[[f64; 3]]) -> [f64; 3]) -> Result<Mesh, MeshError> {
        let mut out = self.clone();
        let mut parents = Parents::new();
        let mut middle = |out: &mut Mesh, of: &[u32]| -> u32 {
            let mut key = of.to_vec();
            key.sort_unstable();
            *parents.entry(key).or_insert_with_key(|key| {
                let corners: Vec<[f64; 3]> = key.iter().map(|&n| self.nodes[n as usize]).collect();
                out.nodes.push(place(&corners));
                (out.nodes.len() - 1) as u32
            })
        };
        for (number, element) in self.elements.iter().enumerate() {
            out.elements[number] = match element {
                Element::Tet4(corners) => {
                    let mut nodes = [0; 10];
                    nodes[..4].copy_from_slice(corners);
                    for (edge, ends) in TET_EDGES.into_iter().enumerate() {
                        nodes[4 + edge] = middle(&mut out, &ends.map(|corner| corners[corner]));
                    }
                    Element::Tet10(nodes)
                }
                Element::Hex8(corners) => {
                    let mut nodes = [0; 27];
                    nodes[..8].copy_from_slice(corners);
                    for (edge, ends) in HEX_EDGES.into_iter().enumerate() {
                        nodes[8 + edge] = middle(&mut out, &ends.map(|corner| corners[corner]));
                    }
                    for (face, of) in HEX_FACES.into_iter().enumerate() {
                        nodes[HEX_FACE_CENTRES[face]] = middle(&mut out, &of.map(|corner| corners[corner]));
                    }
                    nodes[26] = middle(&mut out, corners);
                    Element::Hex27(nodes)
                }
                Element::Wedge6(_) | Element::Tet10(_) | Element::Hex27(_) => {
                    let cure = "only linear tetrahedra and hexahedra can get mid-side nodes";
                    return Err(MeshError::parameter("order", 2, cure));
                }
            };
        }
        crate::error::count32("nodes", Some(out.nodes.len()))?;
        for body in &mut out.bodies {
            body.nodes.end = out.nodes.len();
        }
        for surface in out.surfaces.values_mut() {
            let refine = |facet: &crate::Facet| -> Vec<crate::Facet> {
                let key = facet.nodes.sorted();
                let old = &self.elements[facet.element as usize];
                let face = (0..old.sides()).find(|&side| old.side(side).sorted() == key);
                let new = &out.elements[facet.element as usize];
                let parts = face.map_or(0..0, |face| new.sides_of(face));
                parts.map(|side| crate::Facet { nodes: new.side(side), element: facet.element }).collect()
            };
            *surface = Surface { facets: surface.facets.iter().flat_map(refine).collect() };
        }
        let boundary: Vec<FaceNodes> = out.bodies.iter().enumerate().flat_map(|(b, _)| out.boundary_faces(b)).collect();
        for set in out.node_sets.values_mut() {
            grow(set, &boundary, &parents);
        }
        Ok(out)
    }

    /// Whether the mesh has second-order elements.
    pub fn has_second_order(&self) -> bool {
        self.elements.iter().any(Element::is_second_order)
    }

    /// The faces of a body's boundary with all their nodes.
    fn boundary_faces(&self, body: usize) -> Vec<FaceNodes> {
        self.faces_of_surface(&self.boundary(body))
    }

    /// The faces that form a surface, with all their nodes. If a face of a second-order element is
    /// only partly on the surface, each of its facets there counts as a separate face.
    ///
    /// # Panics
    /// If an element is out of range (see [`Mesh::check`]).
    pub fn faces_of_surface(&self, surface: &Surface) -> Vec<FaceNodes> {
        // the facets of each second-order element, by key
        let mut seen: HashMap<(u32, usize), usize> = HashMap::new();
        let place = |facet: &crate::Facet| {
            let element = &self.elements[facet.element as usize];
            let key = facet.nodes.sorted();
            let side =
                element.is_second_order().then(|| (0..element.sides()).find(|&s| element.side(s).sorted() == key));
            side.flatten().map(|side| (facet.element, side / SUB_FACETS))
        };
        let places: Vec<_> = surface.facets.iter().map(place).collect();
        places.iter().flatten().for_each(|&place| *seen.entry(place).or_default() += 1);
        let mut out = Vec::new();
        for (facet, place) in surface.facets.iter().zip(places) {
            match place {
                Some(place) if seen.get(&place) == Some(&SUB_FACETS) => {
                    out.push(self.elements[place.0 as usize].face(place.1));
                    seen.insert(place, 0);
                }
                Some(place) if seen.get(&place) == Some(&0) => {}
                _ => out.push(facet.nodes.into()),
            }
        }
        out
    }
}

impl Mesh {
    /// The facets of a surface, without those of second-order faces that are only partly on it.
    ///
    /// # Panics
    /// If an element is out of range (see [`Mesh::check`]).
    pub fn whole_faces(&self, surface: Surface) -> Surface {
        if !self.has_second_order() {
            return surface;
        }
        let whole: HashSet<FacetNodes> = self
            .faces_of_surface(&surface)
            .iter()
            .filter(|face| face.len() > 4)
            .flat_map(|face| face.facets())
            .map(FacetNodes::sorted)
            .collect();
        let linear = |facet: &crate::Facet| !self.elements[facet.element as usize].is_second_order();
        let facets = surface.facets.into_iter().filter(|f| linear(f) || whole.contains(&f.nodes.sorted()));
        Surface { facets: facets.collect() }
    }
}

/// Adds the new nodes of a set.
fn grow(set: &mut Vec<u32>, boundary: &[FaceNodes], parents: &Parents) {
    let has = |nodes: &[u32]| nodes.iter().all(|node| set.binary_search(node).is_ok());
    let corners = |face: &FaceNodes| if face.len() == 6 { 3 } else { 4 };
    let mut new: Vec<u32> = Vec::new();
    let mut on_face: Vec<u32> = Vec::new();
    for face in boundary.iter().filter(|face| face.len() > 4 && has(&face[..corners(face)])) {
        on_face.extend(&face[..corners(face)]);
        new.extend(&face[corners(face)..]);
    }
    on_face.sort_unstable();
    let free = |node: &u32| on_face.binary_search(node).is_err();
    new.extend(parents.iter().filter(|(of, _)| of.len() == 2 && has(of) && of.iter().all(free)).map(|(_, &node)| node));
    set.extend(new);
    set.sort_unstable();
    set.dedup();
}

/// The points of the contact surfaces, x̂ = T x, as a constant map of the positions of the nodes.
///
/// Contact couples linear facets over all nodes of a face. If the element's own nodes were their
/// corners, a uniform pressure would not give the forces that balance a uniform stress. On a flat
/// triangle of area A, these forces are 0 at corners and A/3 at edge midpoints, but the four
/// triangles give A/12 and A/4. T leaves corners in place; for the other nodes,
///
/// ```text
/// x̂ = 4/3 x − 1/6 (x_a + x_b)                              middle of the edge from a to b
/// x̂ = 16/9 x − 2/9 Σ x_middle + 1/36 Σ x_corner            centre of a face with nine nodes
/// ```
///
/// and Tᵀ turns the forces of the facets into those of the element: A/12 − 2·(1/6)·A/4 = 0 and
/// (4/3) A/4 = A/3. The polygon through the points has the same mean as the parabola of the edge. T
/// reproduces linear fields, so contact forces keep their resultant and moment, and flat surfaces
/// stay flat. On a curved surface, the points of edge midpoints lie outside the surface by a third
/// of the sagitta.
///
/// Test: `uniaxial_strain_passes_through_quadratic_elements` (slipstick/tests/suite/patch.rs).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ContactMap {
    /// Nodes and weights of node n are `entries[offsets[n]..offsets[n + 1]]`; if there are no offsets,
    /// T = 1.
    offsets: Vec<usize>,
    entries: Vec<(u32, f64)>,
}

impl ContactMap {
    /// The map of a mesh.
    pub fn new(mesh: &Mesh) -> Self {
        if !mesh.has_second_order() {
            return Self::default();
        }
        let mut rows: Vec<Vec<(u32, f64)>> = (0..mesh.nodes.len() as u32).map(|node| vec![(node, 1.0)]).collect();
        for element in mesh.elements.iter().filter(|element| element.is_second_order()) {
            for face in (0..element.faces()).map(|face| element.face(face)) {
                let corners = if face.len() == 6 { 3 } else { 4 };
                for i in 0..corners {
                    let middle = face[corners + i];
                    let mut ends = [face[i], face[(i + 1) % corners]];
                    ends.sort_unstable();
                    rows[middle as usize] = vec![(middle, 4.0 / 3.0), (ends[0], -1.0 / 6.0), (ends[1], -1.0 / 6.0)];
                }
                if let [.., centre] = face[..]
                    && face.len() == 9
                {
                    let mut row = vec![(centre, 16.0 / 9.0)];
                    row.extend(face[4..8].iter().map(|&node| (node, -2.0 / 9.0)));
                    row.extend(face[..4].iter().map(|&node| (node, 1.0 / 36.0)));
                    row[1..].sort_unstable_by_key(|entry| entry.0);
                    rows[centre as usize] = row;
                }
            }
        }
        let mut out = Self { offsets: vec![0], entries: Vec::new() };
        for row in rows {
            out.entries.extend(row);
            out.offsets.push(out.entries.len());
        }
        out
    }

    /// Whether T = 1.
    #[inline]
    pub fn is_identity(&self) -> bool {
        self.offsets.is_empty()
    }

    /// Calls `each` with the nodes that the point of a node depends on, and their weights.
    #[inline]
    pub fn each(&self, node: u32, mut each: impl FnMut(u32, f64)) {
        match self.offsets.get(node as usize..node as usize + 2) {
            Some(&[start, end]) => self.entries[start..end].iter().for_each(|&(node, weight)| each(node, weight)),
            _ => each(node, 1.0),
        }
    }

    /// T v, for three entries per node; any further entries are unchanged.
    pub fn apply(&self, v: &[f64]) -> Vec<f64> {
        let mut out = v.to_vec();
        for node in 0..self.offsets.len().saturating_sub(1) {
            out[3 * node..3 * node + 3].fill(0.0);
            self.each(node as u32, |from, weight| {
                (0..3).for_each(|c| out[3 * node + c] += weight * v[3 * from as usize + c]);
            });
        }
        out
    }

    /// The contact points of nodes at these positions.
    pub fn points(&self, nodes: &[[f64; 3]]) -> Vec<[f64; 3]> {
        self.apply(nodes.as_flattened()).as_chunks().0.to_vec()
    }

    /// Tᵀ v.
    pub fn apply_transposed(&self, v: &[f64]) -> Vec<f64> {
        let mut out = v.to_vec();
        let nodes = self.offsets.len().saturating_sub(1);
        out[..3 * nodes].fill(0.0);
        for node in 0..nodes {
            self.each(node as u32, |to, weight| {
                (0..3).for_each(|c| out[3 * to as usize + c] += weight * v[3 * node + c]);
            });
        }
        out
    }

    /// The nodes that the points of some nodes depend on, ascending and unique.
    pub fn parents(&self, nodes: impl IntoIterator<Item = u32>) -> Vec<u32> {
        let mut out = Vec::new();
        nodes.into_iter().for_each(|node| self.each(node, |parent, _| out.push(parent)));
        out.sort_unstable();
        out.dedup();
        out
    }
}
