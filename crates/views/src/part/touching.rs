//! The share of a contact force that acts on the material of a part.

use std::collections::HashMap;

use slipstick_mesh::Mesh;

use super::PartBody;
use crate::closest::ClosestPoint;
use crate::vector::{norm, subtract};

/// Contact forces of the design on a face, as sums of the magnitudes of the nodal forces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touching {
    /// On the whole face. \[F\]
    pub force: f64,
    /// The share on nodes where the part has this face, 0 … 1.
    pub kept: f64,
}

impl Touching {
    /// Those on two bodies together.
    pub fn with(self, other: Self) -> Self {
        let force = self.force + other.force;
        Self { force, kept: (self.force * self.kept + other.force * other.kept) / force }
    }
}

/// Distance from a face within which a node lies on it, relative to the edges of the design's facets there: the rim of
/// the material does not run along nodes.
const ON_FACE: f64 = 0.25;

impl PartBody {
    /// The contact force of the design on a face of this body, with three components of `forces` per node of its
    /// mesh. `None` without a force or such a face.
    pub fn touching(&self, mesh: &Mesh, face: &str, forces: &[f64]) -> Option<Touching> {
        let patches = &self.faces.iter().find(|known| known.name == face)?.patches;
        let own = (0..self.surface.triangles.len()).filter(|&t| patches.contains(&(self.surface.patch[t] + 1)));
        let left = ClosestPoint::of_triangles(own.map(|t| self.surface.corners(t)));
        let of_body = &mesh.body(&self.name)?.nodes;
        let edges = edges(mesh, mesh.bodies.iter().position(|body| body.name == self.name)?);
        let (mut force, mut kept) = (0.0, 0.0);
        for node in mesh.set_nodes(face)?.iter().map(|&node| node as usize).filter(|node| of_body.contains(node)) {
            let of_node = forces.get(3 * node..3 * node + 3)?.iter().map(|f| f * f).sum::<f64>().sqrt();
            force += of_node;
            let near = ON_FACE * edges.get(&(node as u32)).copied().unwrap_or(self.size);
            if of_node > 0.0 && left.nearest(mesh.nodes[node], near).is_some() {
                kept += of_node;
            }
        }
        (force > 0.0).then(|| Touching { force, kept: kept / force })
    }
}

/// Mean length of the edges of outer facets at each node of a body. \[L\]
fn edges(mesh: &Mesh, body: usize) -> HashMap<u32, f64> {
    let mut sums: HashMap<u32, (f64, f64)> = HashMap::new();
    for facet in mesh.boundary(body).facets {
        let nodes: Vec<u32> = facet.nodes.iter().copied().collect();
        for (k, &a) in nodes.iter().enumerate() {
            let b = nodes[(k + 1) % nodes.len()];
            let length = norm(subtract(mesh.nodes[a as usize], mesh.nodes[b as usize]));
            for n in [a, b] {
                let (sum, count) = sums.entry(n).or_default();
                (*sum, *count) = (*sum + length, *count + 1.0);
            }
        }
    }
    sums.into_iter().map(|(n, (sum, count))| (n, sum / count)).collect()
}
