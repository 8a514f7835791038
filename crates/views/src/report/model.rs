//! The mesh for the page: whole for designed bodies, where a threshold hides elements, and for small
//! meshes, so that a section shows the inside; otherwise only the skin of the other bodies.

use serde::Serialize;
use slipstick_mesh::{Element, FacetNodes, Mesh, WEDGE_AS_HEX};

use super::pack::{Packed, floats, integers};
use slipstick_case::file::Case;

/// Points and elements of the page.
#[derive(Debug, Serialize)]
pub(super) struct Model {
    /// Coordinates, 3 per point.
    points: String,
    /// Points of the elements of whole bodies, 8 each: tetrahedra and wedges are stored as
    /// hexahedra with repeated corners.
    hexes: String,
    /// Points of the skin of the other bodies, 4 each: triangles repeat the last corner.
    quads: String,
    /// Points that are slave nodes, in the order of the contact fields.
    slaves: String,
    bodies: Vec<BodyPart>,
    /// Number of the first element of each body.
    elements: Vec<usize>,
    /// Density of the elements on the load path.
    path_density: Option<Packed>,
}

/// The elements and faces of a body.
#[derive(Debug, Serialize)]
struct BodyPart {
    name: String,
    designed: bool,
    hexes: [usize; 2],
    quads: [usize; 2],
}

/// The parts of the mesh that a page contains.
#[derive(Debug)]
pub(super) struct Layout {
    /// Mesh nodes that are points of the page, ascending.
    pub nodes: Vec<u32>,
    /// Elements that are on the page.
    pub elements: Vec<u32>,
    /// Nodes of slave surfaces; those of ties only if there is no other contact.
    pub slaves: Vec<u32>,
    quads: Vec<[u32; 4]>,
    /// The elements behind the faces of the skin.
    pub behind: Vec<u32>,
    bodies: Vec<BodyPart>,
}

impl Layout {
    /// Designed bodies whole; the others too if the mesh has at most `whole` elements, otherwise their
    /// skin.
    pub fn new(case: &Case, mesh: &Mesh, whole: usize) -> Self {
        let designed = |name: &str| case.design.as_ref().is_some_and(|design| design.bodies.iter().any(|b| b == name));
        let (mut elements, mut quads, mut behind, mut bodies) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let all = mesh.elements.len() <= whole;
        for (b, body) in mesh.bodies.iter().enumerate() {
            let (hexes, faces) = (elements.len(), quads.len());
            let designed = designed(&body.name);
            if designed || all {
                elements.extend(body.elements.clone().map(|e| e as u32));
            } else {
                let skin = mesh.boundary(b).facets;
                quads.extend(skin.iter().map(|facet| four(&facet.nodes)));
                behind.extend(skin.iter().map(|facet| facet.element));
            }
            let name = body.name.clone();
            bodies.push(BodyPart { name, designed, hexes: [hexes, elements.len()], quads: [faces, quads.len()] });
        }
        let of_elements = elements.iter().flat_map(|&e| mesh.elements[e as usize].nodes());
        let mut nodes: Vec<u32> = of_elements.chain(quads.iter().flatten()).copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let surfaces = case.shown_contacts().filter_map(|pair| mesh.surfaces.get(&pair.slave));
        let mut slaves: Vec<u32> = surfaces.flat_map(|surface| surface.nodes()).collect();
        slaves.sort_unstable();
        slaves.dedup();
        Self { nodes, elements, slaves, quads, behind, bodies }
    }

    /// Whether any body is designed.
    pub fn is_designed(&self) -> bool {
        self.bodies.iter().any(|body| body.designed)
    }

    /// Size before encoding. \[bytes\]
    pub fn bytes(&self) -> usize {
        12 * self.nodes.len() + 32 * self.elements.len() + 16 * self.quads.len()
    }

    /// The model as text.
    pub fn model(self, mesh: &Mesh, path_density: Option<Packed>) -> Model {
        // Every node of elements and faces is among the points.
        let point = |node: &u32| self.nodes.binary_search(node).unwrap_or(0) as u32;
        Model {
            points: floats(self.nodes.iter().flat_map(|&n| mesh.nodes[n as usize])),
            hexes: integers(self.elements.iter().flat_map(|&e| eight(&mesh.elements[e as usize])).map(|n| point(&n))),
            quads: integers(self.quads.iter().flatten().map(point)),
            slaves: integers(self.slaves.iter().map(point)),
            elements: mesh.bodies.iter().map(|body| body.elements.start).collect(),
            bodies: self.bodies,
            path_density,
        }
    }
}

/// An element as a hexahedron. For a wedge, two of its edges have no length; for a tetrahedron, one
/// edge and one face are degenerate.
fn eight(element: &Element) -> [u32; 8] {
    match *element {
        Element::Tet4([a, b, c, d]) => [a, b, c, c, d, d, d, d],
        Element::Wedge6(nodes) => WEDGE_AS_HEX.map(|corner| nodes[corner]),
        Element::Wedge18(nodes) => WEDGE_AS_HEX.map(|corner| nodes[corner]),
        Element::Hex8(nodes) => nodes,
        Element::Tet10([a, b, c, d, ..]) => [a, b, c, c, d, d, d, d],
        Element::Hex27(nodes) => std::array::from_fn(|corner| nodes[corner]),
    }
}

/// A facet as a quadrilateral; for a triangle, one of its edges has no length.
pub(super) fn four(facet: &FacetNodes) -> [u32; 4] {
    std::array::from_fn(|k| facet[k.min(facet.len() - 1)])
}
