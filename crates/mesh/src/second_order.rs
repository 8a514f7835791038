//! Second-order elements: shape functions, volumes, mid-side nodes of first-order meshes, and the
//! map from nodes to the points of contact surfaces.

use std::collections::{BTreeMap, HashMap, HashSet};

use crate::shapes::TRIANGLE_OF_WEDGE18;
pub use crate::shapes::{
    HEX27_NODES, HEX27_POINTS, Shapes, TET10_POINTS, WEDGE18_NODES, WEDGE18_POINTS, face_shapes, hex27_shapes,
    quadratic, tet10_shapes, wedge18_shapes,
};
use crate::vector::{cross, dot, norm};
use crate::{
    Element, FaceNodes, FacetNodes, HEX_EDGES, HEX_FACE_CENTRES, HEX_FACES, Mesh, MeshError, SUB_FACETS, Surface,
    TET_EDGES, WEDGE_EDGES, WEDGE_QUADRILATERALS,
};

/// Abscissas and weights of the four-point Gauss rule on −1 … 1.
const FOUR: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];

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

/// Volume of a wedge18 \[L³\] and first moment about its first node \[L⁴\]. The rule on the cube, collapsed to
/// a wedge, integrates degree 6 in the triangle and 7 along the axis exactly.
pub(crate) fn wedge18_moments(nodes: &[[f64; 3]; 18]) -> (f64, [f64; 3]) {
    let collapsed = cube().map(|([x, y, zeta], weight)| {
        let [u, v] = [x, y].map(|c| 0.5 * (1.0 + c));
        ([u, v * (1.0 - u), zeta], 0.25 * weight * (1.0 - u))
    });
    moments(nodes, collapsed, wedge18_shapes)
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

/// Jacobian determinants of a wedge18 at its nodes and integration points. \[L³\]
pub fn wedge18_jacobians(nodes: &[[f64; 3]; 18]) -> Vec<f64> {
    let points = WEDGE18_NODES.into_iter().chain(WEDGE18_POINTS.map(|(at, _)| at));
    points.map(|at| jacobian(nodes, &wedge18_shapes(at))).collect()
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

/// Smallest determinant of three unit tangents over the nodes of a wedge18: at corners of its triangles along
/// both edges and the axis, times 2/√3; at the middles of their edges along the edge, towards the opposite corner
/// and along the axis. That of a straight prism is the [scaled Jacobian](crate::wedge_scaled_jacobian) of its
/// corners. \[–\]
pub(crate) fn wedge18_scaled_jacobian(nodes: &[[f64; 3]; 18]) -> f64 {
    let at_node = |node: usize| {
        let place = WEDGE18_NODES[node];
        let [by_r, by_s, axial] = tangents(nodes, &wedge18_shapes(place).1);
        let towards = |corner: usize| -> [f64; 3] {
            let [r, s] = [0, 1].map(|c| WEDGE18_NODES[corner][c] - place[c]);
            std::array::from_fn(|c| r * by_r[c] + s * by_s[c])
        };
        match TRIANGLE_OF_WEDGE18[node] {
            corner @ 0..3 => {
                let edges = [1, 2].map(|step| towards((corner + step) % 3));
                2.0 / 3.0_f64.sqrt() * unit_determinant([edges[0], edges[1], axial])
            }
            middle => unit_determinant([towards((middle + 1) % 3), towards((middle + 2) % 3), axial]),
        }
    };
    least(&std::array::from_fn::<_, 18, _>(at_node))
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
    /// The mesh of one body with second-order elements instead of its linear ones. New
    /// nodes follow the existing ones; `place` computes the position of a node from those of its
    /// parents (the ends of its edge, or the corners of its face or element).
    ///
    /// The new nodes of a boundary face belong to a node set if all corners of the face are in the
    /// set. The new node of an edge also belongs to the set if both its ends do and neither lies on
    /// such a face.
    ///
    /// # Errors
    /// [`MeshError::Parameter`] if the mesh has second-order elements.
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
                Element::Wedge6(corners) => {
                    let mut nodes = [0; 18];
                    nodes[..6].copy_from_slice(corners);
                    for (edge, ends) in WEDGE_EDGES.into_iter().enumerate() {
                        nodes[6 + edge] = middle(&mut out, &ends.map(|corner| corners[corner]));
                    }
                    for (face, of) in WEDGE_QUADRILATERALS.into_iter().enumerate() {
                        nodes[15 + face] = middle(&mut out, &of.map(|corner| corners[corner]));
                    }
                    Element::Wedge18(nodes)
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
                Element::Tet10(_) | Element::Wedge18(_) | Element::Hex27(_) => {
                    let cure = "only linear elements can get mid-side nodes";
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
