//! Connectivity of elements, nodes and faces.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use crate::vector::{norm, subtract};
use crate::{Body, Facet, FacetNodes, Mesh, MeshError, Surface};

/// The elements around each node, as compressed rows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NodeElements {
    /// Row n is `elements[offsets[n]..offsets[n + 1]]`; one more entry than nodes.
    pub offsets: Vec<usize>,
    /// Element numbers, ascending in each row.
    pub elements: Vec<u32>,
}

impl NodeElements {
    /// The elements around one node, ascending.
    pub fn of(&self, node: usize) -> &[u32] {
        &self.elements[self.offsets[node]..self.offsets[node + 1]]
    }
}

/// A face of an element, identified by its sorted nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Face {
    pub key: FacetNodes,
    pub element: u32,
    pub side: u8,
}

/// All faces with one key in a list sorted by key.
pub(crate) fn faces_of(faces: &[Face], key: FacetNodes) -> &[Face] {
    let start = faces.partition_point(|face| face.key < key);
    let end = start + faces[start..].partition_point(|face| face.key == key);
    &faces[start..end]
}

/// The faces in a list sorted by key that bound only one element.
pub(crate) fn single(faces: &[Face]) -> Vec<Face> {
    faces.chunk_by(|a, b| a.key == b.key).filter(|same| same.len() == 1).map(|same| same[0]).collect()
}

/// All faces in the given triples, as sorted nodes.
pub(crate) fn keys(divided: &[[FacetNodes; 3]]) -> BTreeSet<FacetNodes> {
    divided.iter().flatten().map(|face| face.sorted()).collect()
}

impl Mesh {
    /// Nodes of one side of an element, counter-clockwise seen from outside.
    pub(crate) fn side_nodes(&self, element: u32, side: usize) -> FacetNodes {
        self.elements[element as usize].side(side)
    }

    /// All faces of the given elements, sorted by key, so that the two copies of a face between two
    /// elements are adjacent.
    pub(crate) fn sorted_faces(&self, elements: Range<usize>) -> Vec<Face> {
        let mut faces: Vec<Face> = elements
            .flat_map(|element| (0..self.elements[element].sides()).map(move |side| (element as u32, side)))
            .map(|(element, side)| Face { key: self.side_nodes(element, side).sorted(), element, side: side as u8 })
            .collect();
        faces.sort_unstable();
        faces
    }

    /// All faces of a body that bound only one element, oriented outward, in the order of elements
    /// and their sides. A quadrilateral that is covered by two triangles does not belong to the
    /// boundary, nor do the triangles.
    ///
    /// # Panics
    /// If there is no body with this index or its elements are out of range (see [`Mesh::check`]).
    pub fn boundary(&self, body: usize) -> Surface {
        let mut faces = single(&self.sorted_faces(self.bodies[body].elements.clone()));
        let divided = keys(&self.divided_faces(&faces));
        faces.retain(|face| !divided.contains(&face.key));
        faces.sort_unstable_by_key(|face| (face.element, face.side));
        Surface { facets: faces.iter().map(|face| self.facet(face)).collect() }
    }

    fn facet(&self, face: &Face) -> Facet {
        Facet { nodes: self.side_nodes(face.element, face.side as usize), element: face.element }
    }

    /// Among faces that bound only one element, sorted by their nodes, finds each quadrilateral
    /// that is covered by two triangles, and these triangles in its winding, as at interfaces of
    /// hexahedra and tetrahedra.
    pub(crate) fn divided_faces(&self, faces: &[Face]) -> Vec<[FacetNodes; 3]> {
        let mut divided = Vec::new();
        if faces.iter().all(|face| face.key.len() == faces[0].key.len()) {
            return divided;
        }
        let is_face = |nodes: [u32; 3]| faces_of(faces, FacetNodes::from(nodes).sorted()).len() == 1;
        for face in faces.iter().filter(|face| face.key.len() == 4) {
            let nodes = self.side_nodes(face.element, face.side as usize);
            for [a, b, c, d] in [[0, 1, 2, 3], [1, 2, 3, 0]].map(|order| order.map(|i| nodes[i])) {
                let halves = [[a, b, c], [a, c, d]];
                if halves.into_iter().all(is_face) {
                    divided.push([nodes, halves[0].into(), halves[1].into()]);
                }
            }
        }
        divided
    }

    /// Quadrilateral faces that are covered by two triangular faces of other elements, as between
    /// hexahedra and tetrahedra, each with these triangles, oriented outward from the element of
    /// the quadrilateral. Displacements agree on the edges of the quadrilateral, but on the
    /// diagonal only at its ends.
    ///
    /// # Panics
    /// If there is no body with this index or its elements are out of range (see [`Mesh::check`]).
    pub fn divided_quadrilaterals(&self, body: usize) -> Vec<[FacetNodes; 3]> {
        let faces = single(&self.sorted_faces(self.bodies[body].elements.clone()));
        self.divided_faces(&faces)
    }

    /// The surface that consists of the given facets, in their order: each facet is assigned its
    /// element and oriented outward.
    ///
    /// For mesh readers: mesh files give facets by their nodes, in any winding.
    ///
    /// # Errors
    /// [`MeshError::NotOnBoundary`] if one is not the face of exactly one element.
    pub fn surface_of_facets(&self, facets: &[FacetNodes]) -> Result<Surface, MeshError> {
        Ok(Surface { facets: self.facets_on_boundary(facets).into_iter().collect::<Result<_, _>>()? })
    }

    /// Like [`Self::surface_of_facets`], with an error for each facet that is not on the boundary.
    pub fn facets_on_boundary(&self, facets: &[FacetNodes]) -> Vec<Result<Facet, MeshError>> {
        let faces = self.sorted_faces(0..self.elements.len());
        let divided = keys(&self.divided_faces(&single(&faces)));
        let facets = facets.iter().enumerate().map(|(facet, &nodes)| match faces_of(&faces, nodes.sorted()) {
            [face] if !divided.contains(&face.key) => Ok(self.facet(face)),
            [] => Err(MeshError::NotOnBoundary { facet, nodes, reason: "is not a face of any element" }),
            _ => Err(MeshError::NotOnBoundary { facet, nodes, reason: "lies between two elements" }),
        });
        facets.collect()
    }

    /// The part of all bodies' boundaries whose facets have all their nodes in `nodes` (in any
    /// order).
    pub fn surface_of_nodes(&self, nodes: &[u32]) -> Surface {
        let mut chosen = vec![false; self.nodes.len()];
        for &node in nodes {
            if let Some(mark) = chosen.get_mut(node as usize) {
                *mark = true;
            }
        }
        let mut facets = Vec::new();
        for body in 0..self.bodies.len() {
            let outer = self.boundary(body).facets;
            facets.extend(outer.into_iter().filter(|facet| facet.nodes.iter().all(|&n| chosen[n as usize])));
        }
        Surface { facets }
    }

    /// The nodes of each connected part of a body, ascending; parts in the order of their first
    /// nodes.
    ///
    /// # Panics
    /// If there is no body with this index or its elements are out of range (see [`Mesh::check`]).
    pub fn connected_parts(&self, body: usize) -> Vec<Vec<u32>> {
        let Body { elements, nodes, .. } = &self.bodies[body];
        // Each node points to an earlier one of its part; the first one points to itself.
        let mut earlier: Vec<usize> = (0..nodes.len()).collect();
        fn first(earlier: &mut [usize], mut node: usize) -> usize {
            while earlier[node] != node {
                earlier[node] = earlier[earlier[node]];
                node = earlier[node];
            }
            node
        }
        for element in &self.elements[elements.clone()] {
            let mut root = first(&mut earlier, element.nodes()[0] as usize - nodes.start);
            for &node in &element.nodes()[1..] {
                let other = first(&mut earlier, node as usize - nodes.start);
                earlier[root.max(other)] = root.min(other);
                root = root.min(other);
            }
        }
        let mut parts: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        for node in 0..nodes.len() {
            parts.entry(first(&mut earlier, node)).or_default().push((nodes.start + node) as u32);
        }
        parts.into_values().collect()
    }

    /// Pairs of a body's nodes with a distance of at most `tolerance` \[L\], ascending: the
    /// elements around them are not connected there. If more than two nodes coincide, some pairs
    /// may be left out, but each node is in a pair.
    ///
    /// # Panics
    /// As [`Mesh::connected_parts`].
    pub fn coincident_nodes(&self, body: usize, tolerance: f64) -> Vec<[u32; 2]> {
        let nodes = self.bodies[body].nodes.clone();
        // For two points that close, at least one of eight grids, shifted by half a cell, has both
        // in the same cell.
        let size = 4.0 * tolerance.max(f64::MIN_POSITIVE);
        let mut pairs = BTreeSet::new();
        for shift in 0..8 {
            let shifts: [f64; 3] = std::array::from_fn(|c| if shift >> c & 1 == 1 { 0.5 } else { 0.0 });
            let cell = |node: usize| -> [i64; 3] {
                std::array::from_fn(|c| (self.nodes[node][c] / size + shifts[c]).floor() as i64)
            };
            let mut cells: Vec<([i64; 3], usize)> = nodes.clone().map(|node| (cell(node), node)).collect();
            cells.sort_unstable();
            for same in cells.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() > 1) {
                for (i, &(_, a)) in same.iter().enumerate() {
                    let near = |b: usize| norm(subtract(self.nodes[a], self.nodes[b])) <= tolerance;
                    if let Some(&(_, b)) = same[i + 1..].iter().find(|&&(_, b)| near(b)) {
                        pairs.insert([a as u32, b as u32]);
                    }
                }
            }
        }
        pairs.into_iter().collect()
    }

    /// The elements around each node.
    ///
    /// # Panics
    /// If an element has a node number out of range (see [`Mesh::check`]); so do the other
    /// functions built on it.
    pub fn node_elements(&self) -> NodeElements {
        let mut offsets = vec![0_usize; self.nodes.len() + 1];
        for &node in self.elements.iter().flat_map(|element| element.nodes()) {
            offsets[node as usize + 1] += 1;
        }
        for n in 0..self.nodes.len() {
            offsets[n + 1] += offsets[n];
        }
        let mut next = offsets.clone();
        let mut elements = vec![0; offsets[self.nodes.len()]];
        for (number, element) in (0_u32..).zip(&self.elements) {
            for &node in element.nodes() {
                elements[next[node as usize]] = number;
                next[node as usize] += 1;
            }
        }
        NodeElements { offsets, elements }
    }

    /// For each node, the node itself and all nodes that share an element with it, ascending: the
    /// rows of a nodal sparsity pattern.
    pub fn node_neighbours(&self) -> Vec<Vec<u32>> {
        let mut rows = self.node_neighbours_in(|_| true);
        // a node without elements has only itself
        rows.iter_mut().zip(0..).filter(|(row, _)| row.is_empty()).for_each(|(row, node)| row.push(node));
        rows
    }

    /// The same for some of the elements; rows of nodes without such elements are empty.
    pub fn node_neighbours_in(&self, has: impl Fn(usize) -> bool) -> Vec<Vec<u32>> {
        let around = self.node_elements();
        let mut seen = vec![u32::MAX; self.nodes.len()];
        (0..self.nodes.len())
            .map(|node| {
                let mark = node as u32;
                let mut row = Vec::new();
                let elements = around.of(node).iter().filter(|&&e| has(e as usize));
                for &neighbour in elements.flat_map(|&e| self.elements[e as usize].nodes()) {
                    if seen[neighbour as usize] != mark {
                        seen[neighbour as usize] = mark;
                        row.push(neighbour);
                    }
                }
                row.sort_unstable();
                row
            })
            .collect()
    }

    /// A colouring of the elements: elements of one colour share no nodes, so they can be assembled
    /// in parallel.
    ///
    /// It is greedy in the order of the elements, so it depends only on the mesh; elements are
    /// ascending in each colour.
    pub fn element_colours(&self) -> Vec<Vec<u32>> {
        let around = self.node_elements();
        let mut colours: Vec<Vec<u32>> = Vec::new();
        let mut colour_of = vec![usize::MAX; self.elements.len()];
        // `taken[c] == element`: a neighbour of the element has colour c.
        let mut taken: Vec<usize> = Vec::new();
        for element in 0..self.elements.len() {
            for &neighbour in self.elements[element].nodes().iter().flat_map(|&node| around.of(node as usize)) {
                if let Some(mark) = taken.get_mut(colour_of[neighbour as usize]) {
                    *mark = element;
                }
            }
            let colour = taken.iter().position(|&mark| mark != element).unwrap_or(taken.len());
            if colour == taken.len() {
                taken.push(usize::MAX);
                colours.push(Vec::new());
            }
            colour_of[element] = colour;
            colours[colour].push(element as u32);
        }
        colours
    }
}
