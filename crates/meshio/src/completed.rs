//! Hexahedra of 20 nodes and wedges of 15 with the nodes that they lack.

use std::collections::HashMap;

use crate::file_mesh::FileMesh;

/// A node at the centre of a face or of a hexahedron.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Centre {
    /// Its position in [`FileMesh::points`].
    pub node: u32,
    /// The four or eight corners around it.
    pub corners: Vec<u32>,
    /// The nodes between them.
    pub middles: Vec<u32>,
}

impl FileMesh {
    /// Makes hexahedra of 27 nodes of those of 20, and wedges of 18 nodes of those of 15: nodes at the centres of
    /// quadrilaterals and hexahedra, on the serendipity shape, come after all others, and have greater numbers. Sets
    /// of nodes that have all other nodes of a face or of a hexahedron get its centre. Returns the new nodes.
    pub fn complete_centres(&mut self) -> Vec<Centre> {
        let mut known: HashMap<Vec<u32>, u32> = HashMap::new();
        let mut centres: Vec<Centre> = Vec::new();
        let mut number = self.point_numbers.iter().copied().max().unwrap_or(0);
        let (mut offsets, mut all) = (vec![0], Vec::new());
        for cell in 0..self.cells.len() {
            let (kind, nodes) = (self.cells.kind(cell), self.cells.nodes(cell).to_vec());
            let first = all.len();
            all.extend(&nodes);
            if let Some(completed) = kind.completed() {
                self.cells.kinds[cell] = completed;
                all.resize(first + completed.node_count(), u32::MAX);
                for place in kind.centres() {
                    let new = self.points.len() as u32;
                    let node = *known.entry(place.key(&nodes)).or_insert(new);
                    if node == new {
                        number += 1;
                        self.points.push(place.position(&nodes, |node| self.points[node as usize]));
                        self.point_numbers.push(number);
                        let of = |local: &[usize]| local.iter().map(|&local| nodes[local]).collect();
                        centres.push(Centre { node, corners: of(&place.corners), middles: of(&place.middles) });
                    }
                    all[first + place.node] = node;
                }
            }
            offsets.push(all.len());
        }
        (self.cells.offsets, self.cells.nodes) = (offsets, all);
        for set in self.node_sets.values_mut() {
            let has = |node: &u32| set.binary_search(node).is_ok();
            let whole = |centre: &&Centre| centre.corners.iter().chain(&centre.middles).all(has);
            let new: Vec<u32> = centres.iter().filter(whole).map(|centre| centre.node).collect();
            set.extend(new);
        }
        centres
    }
}
