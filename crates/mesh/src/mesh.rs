//! The mesh of all bodies: nodes, elements, bodies, named sets and surfaces.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::{Coupling, Cut, Element, FacetNodes, Rigid, facet_corner_areas};

/// A face of an element on a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Facet {
    /// Global node numbers, counter-clockwise seen from outside the body.
    pub nodes: FacetNodes,
    /// The element that the facet bounds.
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
        let mut nodes: Vec<u32> = self.facets.iter().flat_map(|f| &f.nodes).copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// The nodes, ascending, each with the part of the surface's area that belongs to it, ∫ N dA,
    /// for nodes at these positions. Test: `node_areas_add_up_to_the_area`. \[L²\]
    pub fn node_areas(&self, positions: &[[f64; 3]]) -> Vec<(u32, f64)> {
        let mut areas: BTreeMap<u32, f64> = BTreeMap::new();
        for facet in &self.facets {
            let corners = facet.nodes.corners(positions);
            for (&node, area) in facet.nodes.iter().zip(facet_corner_areas(&corners)) {
                *areas.entry(node).or_default() += area;
            }
        }
        areas.into_iter().collect()
    }
}

/// One deformable body: contiguous ranges of the mesh's elements and nodes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Body {
    /// Its name in the case file.
    pub name: String,
    /// Its elements, of one or several types.
    pub elements: Range<usize>,
    /// Its nodes. Bodies share no nodes.
    pub nodes: Range<usize>,
}

/// The mesh of all bodies in one numbering.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Reference coordinates X. \[L\]
    pub nodes: Vec<[f64; 3]>,
    /// The elements by their nodes.
    pub elements: Vec<Element>,
    /// The bodies, in the order of their elements.
    pub bodies: Vec<Body>,
    /// Named node sets, each ascending and unique.
    pub node_sets: BTreeMap<String, Vec<u32>>,
    /// Named surfaces.
    pub surfaces: BTreeMap<String, Surface>,
    /// Named sets of elements, each ascending and unique.
    pub element_sets: BTreeMap<String, Vec<u32>>,
    /// Bodies that do not deform.
    pub rigid: Vec<Rigid>,
    /// Couplings of nodes to reference points.
    pub couplings: Vec<Coupling>,
    /// Sections at which bodies are cut.
    pub cuts: Vec<Cut>,
}

impl Mesh {
    /// Coordinates of several nodes, for instance of an element's corners. \[L\]
    ///
    /// # Panics
    /// If there is no such node.
    pub fn coordinates<const N: usize>(&self, nodes: &[u32; N]) -> [[f64; 3]; N] {
        nodes.map(|n| self.nodes[n as usize])
    }
}
