//! Hexahedra of 20 nodes with the nodes that they lack.

use std::collections::HashMap;

use slipstick_mesh::{HEX_EDGES, HEX_FACES};

use crate::CellKind;
use crate::file_mesh::FileMesh;
use crate::hexahedra::{keys, serendipity_centres};

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
    /// Makes hexahedra of 27 nodes of those of 20: nodes at the centres of faces and of elements, on the serendipity
    /// shape, come after all others, and have greater numbers. Sets of nodes that have all other nodes of a face or
    /// of a hexahedron get its centre. Returns the new nodes.
    pub fn complete_hexahedra(&mut self) -> Vec<Centre> {
        let mut known: HashMap<Vec<u32>, u32> = HashMap::new();
        let mut centres: Vec<Centre> = Vec::new();
        let mut number = self.point_numbers.iter().copied().max().unwrap_or(0);
        let (mut offsets, mut all) = (vec![0], Vec::new());
        for cell in 0..self.cells.len() {
            let nodes = self.cells.nodes(cell).to_vec();
            all.extend(&nodes);
            if self.cells.kind(cell) == CellKind::Hex20 {
                self.cells.kinds[cell] = CellKind::Hex27;
                let positions = serendipity_centres(&nodes, |node| self.points[node as usize]);
                for (place, (key, position)) in keys(&nodes).into_iter().zip(positions).enumerate() {
                    let new = self.points.len() as u32;
                    let node = *known.entry(key).or_insert(new);
                    if node == new {
                        number += 1;
                        self.points.push(position);
                        self.point_numbers.push(number);
                        centres.push(Centre::new(
                            node,
                            &nodes,
                            HEX_FACES.get(place).map_or(&[0, 1, 2, 3, 4, 5, 6, 7], |face| &face[..]),
                        ));
                    }
                    all.push(node);
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

impl Centre {
    /// The node at the centre of some corners of a hexahedron.
    fn new(node: u32, nodes: &[u32], corners: &[usize]) -> Self {
        let on = |edge: &[usize; 2]| edge.iter().all(|corner| corners.contains(corner));
        let middles = (0..12).filter(|&edge| on(&HEX_EDGES[edge])).map(|edge| nodes[8 + edge]).collect();
        Self { node, corners: corners.iter().map(|&corner| nodes[corner]).collect(), middles }
    }
}
