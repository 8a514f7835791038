//! The mesh of all bodies: nodes, hexahedra, bodies, named sets and surfaces.

use std::collections::BTreeMap;
use std::ops::Range;

/// Local node numbers of the six faces of a hex8, each counter-clockwise seen from outside.
///
/// Hex8 numbering: 0–3 counter-clockwise on the face ζ = −1 seen from inside (ζ > −1), 4–7 above them.
pub const HEX_FACES: [[usize; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

/// A quadrilateral face of a hexahedron on a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Facet {
    /// Global node numbers, counter-clockwise seen from outside of the body.
    pub nodes: [u32; 4],
    /// The hexahedron that the facet bounds.
    pub element: u32,
}

/// A named, oriented set of facets.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Surface {
    /// The facets, in a fixed order.
    pub facets: Vec<Facet>,
}

impl Surface {
    /// The nodes of the surface, ascending and unique.
    pub fn nodes(&self) -> Vec<u32> {
        let mut nodes: Vec<u32> = self.facets.iter().flat_map(|f| f.nodes).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }
}

/// One deformable body: contiguous ranges of the mesh's elements and nodes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Body {
    /// The name that the case file uses.
    pub name: String,
    /// Its hexahedra.
    pub elements: Range<usize>,
    /// Its nodes. Bodies share no nodes.
    pub nodes: Range<usize>,
}

/// The mesh of all bodies in one numbering.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Reference coordinates X. \[L\]
    pub nodes: Vec<[f64; 3]>,
    /// Node numbers of each hex8 (numbering as in VTK, see [`HEX_FACES`]).
    pub hexes: Vec<[u32; 8]>,
    /// The bodies, in the order of their elements.
    pub bodies: Vec<Body>,
    /// Named node sets, each ascending and unique.
    pub node_sets: BTreeMap<String, Vec<u32>>,
    /// Named surfaces.
    pub surfaces: BTreeMap<String, Surface>,
}

impl Mesh {
    /// Corner coordinates of one hexahedron.
    pub fn hex_coordinates(&self, element: usize) -> [[f64; 3]; 8] {
        self.hexes[element].map(|n| self.nodes[n as usize])
    }
}
