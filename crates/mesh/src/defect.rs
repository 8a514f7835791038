//! Defects of a mesh, as [`Mesh::check`](crate::Mesh::check) reports them.

/// One kind of defect with all its places. Node, element and facet numbers count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshDefect {
    /// A body's ranges of elements or nodes are invalid.
    #[error("body `{body}` {reason}")]
    BodyRange {
        /// The body.
        body: String,
        /// What is wrong with its ranges.
        reason: String,
    },
    /// Elements that belong to no body.
    #[error("element(s) {} belong to no body: give each body its range of elements", few(elements))]
    ElementsWithoutBody {
        /// The elements.
        elements: Vec<u32>,
    },
    /// Elements with a node number that the mesh does not have.
    #[error(
        "body `{body}`: element(s) {} have node numbers beyond the {nodes} nodes of the mesh: renumber them",
        few(elements)
    )]
    NodeOutOfRange {
        /// The body.
        body: String,
        /// The elements.
        elements: Vec<u32>,
        /// How many nodes the mesh has.
        nodes: usize,
    },
    /// Nodes with a coordinate that is infinite or not a number.
    #[error("node(s) {} have coordinates that are not finite: correct them", few(nodes))]
    NotFinite {
        /// The nodes.
        nodes: Vec<u32>,
    },
    /// Elements that contain a node twice, such as wedges and pyramids written as hexahedra.
    #[error(
        "body `{body}`: element(s) {} contain a node twice: only genuine tetrahedra, wedges and hexahedra are \
         supported",
        few(elements)
    )]
    RepeatedNode {
        /// The body.
        body: String,
        /// The elements.
        elements: Vec<u32>,
    },
    /// Elements whose Jacobian determinant is not positive at a corner or Gauss point.
    #[error(
        "body `{body}`: element(s) {} are inverted or degenerate (smallest Jacobian determinant {worst:.3e}): \
         correct their numbering or shape",
        few(elements)
    )]
    Inverted {
        /// The body.
        body: String,
        /// The elements.
        elements: Vec<u32>,
        /// The smallest Jacobian determinant of all of them. \[L³\]
        worst: f64,
    },
    /// Elements that share a face with more than one other element, or lie on the same side of it.
    #[error("element(s) {} overlap at a shared face: remove duplicate elements", few(elements))]
    OverlappingFaces {
        /// The elements.
        elements: Vec<u32>,
    },
    /// Nodes that belong to no element: they would have no stiffness.
    #[error("node(s) {} belong to no element: remove them", few(nodes))]
    UnusedNodes {
        /// The nodes.
        nodes: Vec<u32>,
    },
    /// Nodes that elements of two bodies share: bodies may only interact through contact.
    #[error("bodies `{}` and `{}` share node(s) {}: give each body its own nodes", bodies[0], bodies[1], few(nodes))]
    SharedNodes {
        /// The two bodies.
        bodies: [String; 2],
        /// The nodes.
        nodes: Vec<u32>,
    },
    /// Nodes that a body's elements use, but that lie outside its range of nodes.
    #[error("body `{body}` uses node(s) {} outside its range of nodes: number the nodes body by body", few(nodes))]
    NodesOutsideBody {
        /// The body.
        body: String,
        /// The nodes.
        nodes: Vec<u32>,
    },
    /// A node set with numbers that the mesh does not have.
    #[error("node set `{set}` has node(s) {} that the mesh does not have: remove them", few(nodes))]
    SetOutOfRange {
        /// The node set.
        set: String,
        /// The nodes.
        nodes: Vec<u32>,
    },
    /// A node set that is not ascending and unique.
    #[error("node set `{set}` is not ascending and unique: sort it and remove repetitions")]
    SetNotSorted {
        /// The node set.
        set: String,
    },
    /// Facets that are not faces of their element (or whose nodes are in crosswise order).
    #[error(
        "surface `{surface}`: facet(s) {} are not faces of their elements: correct their nodes or element",
        few(facets)
    )]
    StrayFacets {
        /// The surface.
        surface: String,
        /// Positions in the surface.
        facets: Vec<u32>,
    },
    /// Facets whose nodes are clockwise seen from outside.
    #[error("surface `{surface}`: facet(s) {} face inward: reverse their nodes (`orient_facets` does)", few(facets))]
    InwardFacets {
        /// The surface.
        surface: String,
        /// Positions in the surface.
        facets: Vec<u32>,
    },
    /// Facets between two elements.
    #[error(
        "surface `{surface}`: facet(s) {} lie between two elements: a surface must be on the boundary",
        few(facets)
    )]
    InteriorFacets {
        /// The surface.
        surface: String,
        /// Positions in the surface.
        facets: Vec<u32>,
    },
    /// Facets that are already in the surface.
    #[error("surface `{surface}`: facet(s) {} repeat earlier ones: remove them", few(facets))]
    RepeatedFacets {
        /// The surface.
        surface: String,
        /// Positions in the surface.
        facets: Vec<u32>,
    },
}

/// The first few numbers, and the total if there are more.
fn few(numbers: &[u32]) -> String {
    const SHOWN: usize = 8;
    let shown: Vec<String> = numbers.iter().take(SHOWN).map(u32::to_string).collect();
    let rest = if numbers.len() > SHOWN { format!(", … ({} in all)", numbers.len()) } else { String::new() };
    shown.join(", ") + &rest
}
