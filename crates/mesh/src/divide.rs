//! Hexahedra divided into tetrahedra.

use crate::{Body, Element, Facet, FacetNodes, HEX_FACES, Mesh, Surface};

impl Mesh {
    /// The mesh with the `chosen` hexahedra divided into six tetrahedra each, and with their facets in two triangles;
    /// the nodes stay.
    ///
    /// Every quadrilateral is divided from its lowest node on, so that neighbours agree. Source: J. Dompierre et al., How
    /// to subdivide pyramids, prisms, and hexahedra into tetrahedra, 8th Int. Meshing Roundtable (1999) 195–204.
    ///
    /// # Panics
    /// If a facet or body has an element out of range (see [`Mesh::check`]).
    pub fn divided(&self, chosen: impl Fn(usize) -> bool) -> Mesh {
        let mut elements = Vec::with_capacity(self.elements.len());
        // where the parts of each element begin
        let mut first = Vec::with_capacity(self.elements.len() + 1);
        for (number, element) in self.elements.iter().enumerate() {
            first.push(elements.len());
            match element {
                Element::Hex8(nodes) if chosen(number) => elements.extend(tetrahedra(nodes).map(Element::Tet4)),
                _ => elements.push(*element),
            }
        }
        first.push(elements.len());
        let parts = |facet: &Facet| -> Vec<Facet> {
            let inside = first[facet.element as usize]..first[facet.element as usize + 1];
            if inside.len() == 1 {
                return vec![Facet { element: inside.start as u32, ..*facet }];
            }
            let sides = inside.flat_map(|e| (0..4).map(move |side| (e, side)));
            sides
                .map(|(e, side)| Facet { nodes: elements[e].side(side), element: e as u32 })
                .filter(|part| part.nodes.iter().all(|node| facet.nodes.contains(node)))
                .collect()
        };
        let surfaces = self
            .surfaces
            .iter()
            .map(|(name, surface)| (name.clone(), Surface { facets: surface.facets.iter().flat_map(parts).collect() }));
        Mesh {
            nodes: self.nodes.clone(),
            surfaces: surfaces.collect(),
            bodies: self
                .bodies
                .iter()
                .map(|body| Body { elements: first[body.elements.start]..first[body.elements.end], ..body.clone() })
                .collect(),
            node_sets: self.node_sets.clone(),
            elements,
        }
    }
}

/// The lowest node with each half of the three faces that do not have it.
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
