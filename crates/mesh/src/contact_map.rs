//! The map from the nodes of a mesh to the points of its contact surfaces.

use crate::Mesh;

/// The points of the contact surfaces, x̂ = T x, as a constant map of the positions of the nodes.
///
/// Contact couples linear facets over all nodes of a face. If the element's own nodes were their
/// corners, a uniform pressure would not give the forces that balance a uniform stress. On a flat
/// triangle of area A, these forces are 0 at corners and A/3 at edge midpoints, but the four
/// triangles give A/12 and A/4. T leaves corners in place; for the other nodes,
///
/// ```text
/// x̂ = 4/3 x − 1/6 (x_a + x_b)                              middle of the edge from a to b
/// x̂ = 16/9 x − 2/9 Σ x_middle + 1/36 Σ x_corner            centre of a face with nine nodes
/// ```
///
/// and Tᵀ turns the forces of the facets into those of the element: A/12 − 2·(1/6)·A/4 = 0 and
/// (4/3) A/4 = A/3. The polygon through the points has the same mean as the parabola of the edge. T
/// reproduces linear fields, so contact forces keep their resultant and moment, and flat surfaces
/// stay flat. On a curved surface, the points of edge midpoints lie outside the surface by a third
/// of the sagitta.
///
/// Test: `uniaxial_strain_passes_through_quadratic_elements` (slipstick/tests/suite/patch.rs).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ContactMap {
    /// Nodes and weights of node n are `entries[offsets[n]..offsets[n + 1]]`; if there are no offsets,
    /// T = 1.
    offsets: Vec<usize>,
    entries: Vec<(u32, f64)>,
}

impl ContactMap {
    /// The map of a mesh.
    pub fn new(mesh: &Mesh) -> Self {
        if !mesh.has_second_order() {
            return Self::default();
        }
        let mut rows: Vec<Vec<(u32, f64)>> = (0..mesh.nodes.len() as u32).map(|node| vec![(node, 1.0)]).collect();
        for element in mesh.elements.iter().filter(|element| element.is_second_order()) {
            for face in (0..element.faces()).map(|face| element.face(face)) {
                let corners = if face.len() == 6 { 3 } else { 4 };
                for i in 0..corners {
                    let middle = face[corners + i];
                    let mut ends = [face[i], face[(i + 1) % corners]];
                    ends.sort_unstable();
                    rows[middle as usize] = vec![(middle, 4.0 / 3.0), (ends[0], -1.0 / 6.0), (ends[1], -1.0 / 6.0)];
                }
                if let [.., centre] = face[..]
                    && face.len() == 9
                {
                    let mut row = vec![(centre, 16.0 / 9.0)];
                    row.extend(face[4..8].iter().map(|&node| (node, -2.0 / 9.0)));
                    row.extend(face[..4].iter().map(|&node| (node, 1.0 / 36.0)));
                    row[1..].sort_unstable_by_key(|entry| entry.0);
                    rows[centre as usize] = row;
                }
            }
        }
        let mut out = Self { offsets: vec![0], entries: Vec::new() };
        for row in rows {
            out.entries.extend(row);
            out.offsets.push(out.entries.len());
        }
        out
    }

    /// Whether T = 1.
    #[inline]
    pub fn is_identity(&self) -> bool {
        self.offsets.is_empty()
    }

    /// Calls `each` with the nodes that the point of a node depends on, and their weights.
    #[inline]
    pub fn each(&self, node: u32, mut each: impl FnMut(u32, f64)) {
        match self.offsets.get(node as usize..node as usize + 2) {
            Some(&[start, end]) => self.entries[start..end].iter().for_each(|&(node, weight)| each(node, weight)),
            _ => each(node, 1.0),
        }
    }

    /// T v, for three entries per node; any further entries are unchanged.
    pub fn apply(&self, v: &[f64]) -> Vec<f64> {
        let mut out = v.to_vec();
        for node in 0..self.offsets.len().saturating_sub(1) {
            out[3 * node..3 * node + 3].fill(0.0);
            self.each(node as u32, |from, weight| {
                (0..3).for_each(|c| out[3 * node + c] += weight * v[3 * from as usize + c]);
            });
        }
        out
    }

    /// The contact points of nodes at these positions.
    pub fn points(&self, nodes: &[[f64; 3]]) -> Vec<[f64; 3]> {
        self.apply(nodes.as_flattened()).as_chunks().0.to_vec()
    }

    /// Tᵀ v.
    pub fn apply_transposed(&self, v: &[f64]) -> Vec<f64> {
        let mut out = v.to_vec();
        let nodes = self.offsets.len().saturating_sub(1);
        out[..3 * nodes].fill(0.0);
        for node in 0..nodes {
            self.each(node as u32, |to, weight| {
                (0..3).for_each(|c| out[3 * to as usize + c] += weight * v[3 * node + c]);
            });
        }
        out
    }

    /// The nodes that the points of some nodes depend on, ascending and unique.
    pub fn parents(&self, nodes: impl IntoIterator<Item = u32>) -> Vec<u32> {
        let mut out = Vec::new();
        nodes.into_iter().for_each(|node| self.each(node, |parent, _| out.push(parent)));
        out.sort_unstable();
        out.dedup();
        out
    }
}
