//! Divides hexahedra into tetrahedra or wedges.

use crate::{Body, Element, Facet, FacetNodes, HEX_FACES, Mesh, Surface};

/// Corners of the face of a hex8 at ξ, η or ζ = −1, counter-clockwise seen from inside, and the
/// corners opposite to them.
const ALONG: [[[usize; 4]; 2]; 3] =
    [[[0, 3, 7, 4], [1, 2, 6, 5]], [[0, 4, 5, 1], [3, 7, 6, 2]], [[0, 1, 2, 3], [4, 5, 6, 7]]];

impl Mesh {
    /// The mesh with each of the `chosen` hexahedra divided into six tetrahedra, and their facets
    /// into two triangles; the nodes stay the same.
    ///
    /// Every quadrilateral is divided at its lowest-numbered node, so neighbours agree. Source: J.
    /// Dompierre et al., How to subdivide pyramids, prisms, and hexahedra into tetrahedra, 8th Int.
    /// Meshing Roundtable (1999) 195–204.
    ///
    /// # Panics
    /// If a facet or body has an element out of range (see [`Mesh::check`]).
    pub fn divided(&self, chosen: impl Fn(usize) -> bool) -> Mesh {
        self.with_parts(|number, hex, parts| {
            if chosen(number) {
                parts.extend(tetrahedra(hex).map(Element::Tet4));
            }
        })
    }

    /// The mesh with each hexahedron divided into two wedges; the nodes stay the same. The axis of
    /// the wedges is the parent direction `along` (0, 1 or 2 for ξ, η, ζ); `None` leaves the
    /// hexahedron undivided.
    ///
    /// The faces at both ends of the axis become two triangles each, divided at the lowest-numbered
    /// node of the face at −1. In a mesh of [`box_mesh`](crate::box_mesh), neighbours along the
    /// axis agree, and so do the tetrahedra of [`divided`](Self::divided).
    ///
    /// # Panics
    /// If a facet or body has an element out of range (see [`Mesh::check`]), or if the direction
    /// does not exist.
    pub fn divided_into_wedges(&self, along: impl Fn(usize) -> Option<usize>) -> Mesh {
        self.with_parts(|number, hex, parts| {
            if let Some(along) = along(number) {
                parts.extend(wedges(hex, along).map(Element::Wedge6));
            }
        })
    }

    /// The mesh with hexahedra replaced by their parts. `divide` receives the number and nodes of
    /// each hexahedron and adds its parts to the list, or nothing if it stays whole.
    fn with_parts(&self, divide: impl Fn(usize, &[u32; 8], &mut Vec<Element>)) -> Mesh {
        let mut elements = Vec::with_capacity(self.elements.len());
        // first part of each element
        let mut first = Vec::with_capacity(self.elements.len() + 1);
        for (number, element) in self.elements.iter().enumerate() {
            first.push(elements.len());
            if let Element::Hex8(nodes) = element {
                divide(number, nodes, &mut elements);
            }
            if first[number] == elements.len() {
                elements.push(*element);
            }
        }
        first.push(elements.len());
        let parts = |facet: &Facet| -> Vec<Facet> {
            let inside = first[facet.element as usize]..first[facet.element as usize + 1];
            if inside.len() == 1 {
                return vec![Facet { element: inside.start as u32, ..*facet }];
            }
            let sides = inside.flat_map(|e| (0..elements[e].sides()).map(move |side| (e, side)));
            sides
                .map(|(e, side)| Facet { nodes: elements[e].side(side), element: e as u32 })
                .filter(|part| part.nodes.iter().all(|node| facet.nodes.contains(node)))
                .collect()
        };
        let surfaces = self
            .surfaces
            .iter()
            .map(|(name, surface)| (name.clone(), Surface { facets: surface.facets.iter().flat_map(parts).collect() }));
        let element_sets = self.element_sets.iter().map(|(name, set)| {
            let parts = set.iter().flat_map(|&e| first[e as usize] as u32..first[e as usize + 1] as u32);
            (name.clone(), parts.collect())
        });
        Mesh {
            nodes: self.nodes.clone(),
            surfaces: surfaces.collect(),
            bodies: self
                .bodies
                .iter()
                .map(|body| Body { elements: first[body.elements.start]..first[body.elements.end], ..body.clone() })
                .collect(),
            node_sets: self.node_sets.clone(),
            element_sets: element_sets.collect(),
            elements,
            rigid: self.rigid.clone(),
            couplings: self.couplings.clone(),
            cuts: self.cuts.clone(),
        }
    }
}

/// Two wedges between opposite faces, divided at the lowest-numbered node of the first face.
fn wedges(hex: &[u32; 8], along: usize) -> [[u32; 6]; 2] {
    let [mut start, mut end] = ALONG[along].map(|face| face.map(|corner| hex[corner]));
    let lowest = (0..4).min_by_key(|&corner| start[corner]).unwrap_or(0);
    start.rotate_left(lowest);
    end.rotate_left(lowest);
    let half = |corners: [usize; 3]| {
        let [a, b, c] = corners.map(|corner| start[corner]);
        let [d, e, f] = corners.map(|corner| end[corner]);
        [a, b, c, d, e, f]
    };
    [half([0, 1, 2]), half([0, 2, 3])]
}

/// The lowest-numbered node combined with each half of the three faces that do not contain it.
fn tetrahedra(hex: &[u32; 8]) -> [[u32; 4]; 6] {
    let apex = *hex.iter().min().unwrap_or(&hex[0]);
    let mut out = [[0; 4]; 6];
    let opposite =
        HEX_FACES.map(|face| face.map(|corner| hex[corner])).into_iter().filter(|face| !face.contains(&apex));
    for (face, halves) in opposite.zip(out.as_chunks_mut::<2>().0) {
        let lowest = *face.iter().min().unwrap_or(&face[0]);
        let turned = FacetNodes::from(face).starting_at(lowest).unwrap_or(face.into());
        // seen from the apex, the face runs clockwise
        *halves = [[turned[0], turned[2], turned[1], apex], [turned[0], turned[3], turned[2], apex]];
    }
    out
}
