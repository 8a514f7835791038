//! The share of a contact force that acts on the material of a part.

use slipstick_mesh::Mesh;

use super::PartBody;
use crate::closest::{ClosestPoint, Simplex};

/// Contact forces of the design on a face, as sums of the magnitudes of the nodal forces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touching {
    /// On the whole face. \[F\]
    pub force: f64,
    /// The share on nodes where the part has this face, 0 … 1.
    pub kept: f64,
}

/// Distance from a face, relative to the edges of the part, within which a node lies on it: the rim of the
/// material does not run along nodes.
const ON_FACE: f64 = 0.5;

/// Directions do not matter: every triangle faces along x.
const FACING: [f64; 3] = [1.0, 0.0, 0.0];

impl PartBody {
    /// The contact force of the design on a face of this body, with three components of `forces` per node of its
    /// mesh. `None` without a force or such a face.
    pub fn touching(&self, mesh: &Mesh, face: &str, forces: &[f64]) -> Option<Touching> {
        let patches = &self.faces.iter().find(|known| known.name == face)?.patches;
        let own = (0..self.surface.triangles.len()).filter(|&t| patches.contains(&(self.surface.patch[t] + 1)));
        let triangles = own.map(|t| Simplex { corners: self.surface.corners(t), normal: FACING }).collect();
        let left = ClosestPoint::new(triangles);
        let of_body = &mesh.body(&self.name)?.nodes;
        let (mut force, mut kept) = (0.0, 0.0);
        for node in mesh.set_nodes(face)?.iter().map(|&node| node as usize).filter(|node| of_body.contains(node)) {
            let of_node = forces.get(3 * node..3 * node + 3)?.iter().map(|f| f * f).sum::<f64>().sqrt();
            force += of_node;
            if of_node > 0.0 && left.of(mesh.nodes[node], (FACING, 0.0), ON_FACE * self.size).is_some() {
                kept += of_node;
            }
        }
        (force > 0.0).then(|| Touching { force, kept: kept / force })
    }
}
