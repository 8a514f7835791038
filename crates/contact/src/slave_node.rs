//! Slave nodes and the facets around them.

use crate::kinematics::frame::RingCorner;
use nalgebra::Vector3;
use slipstick_mesh::FacetNodes;

/// A slave node and the slave facets around it. At an edge sharper than the feature angle, each of
/// the smooth patches that meet there has its own entry, with the facets of that patch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SlaveNode {
    /// Global node number.
    pub node: u32,
    /// All nodes of the slave facets around it, ascending, including the node itself.
    pub ring: Vec<u32>,
    /// Its corners in these facets, as positions in the ring.
    pub corners: Vec<RingCorner>,
    /// Ring position of the neighbour that defines the material direction of the tangent.
    pub edge: usize,
    /// The facets around it: number of the slave facet, and the corner of the facet at this node.
    pub facets: Vec<(u32, u8)>,
    /// Coordinate axes normal to a symmetry plane through the node.
    pub mirrored: [bool; 3],
    /// Whether the node lies on a sharp edge, so that the facets are those of one patch and the
    /// frame uses the master's normal.
    pub sharp: bool,
    /// The facets of each smooth patch of the body's boundary that spans the node's normal cone, as
    /// corners in the ring, the own patch first; empty where there is no such cone
    /// ([`ContactInterface::with_touched_normals`](crate::ContactInterface::with_touched_normals)).
    pub cone: Vec<Vec<RingCorner>>,
}

impl SlaveNode {
    /// Whether the normal depends on the master's, not only on the slave's own facets.
    pub fn follows_master(&self) -> bool {
        if self.cone.is_empty() { self.sharp } else { self.cone.len() > 1 }
    }
}

/// The corners of each of `facets` slave facets whose normal depends on the master's.
pub(crate) fn following(slave_nodes: &[SlaveNode], facets: usize) -> Vec<[bool; 4]> {
    let mut corners = vec![[false; 4]; facets];
    for (facet, corner) in slave_nodes.iter().filter(|slave| slave.follows_master()).flat_map(|slave| &slave.facets) {
        corners[*facet as usize][usize::from(*corner)] = true;
    }
    corners
}

pub(crate) fn slave_topology(facets: &[FacetNodes], coordinates: &[f64], feature_angle: f64) -> Vec<SlaveNode> {
    let mut around: std::collections::BTreeMap<u32, Vec<(u32, u8)>> = std::collections::BTreeMap::new();
    for (f, facet) in facets.iter().enumerate() {
        for (corner, &node) in facet.iter().enumerate() {
            around.entry(node).or_default().push((f as u32, corner as u8));
        }
    }
    let normals: Vec<Vector3<f64>> = facets.iter().map(|facet| normal(facet, coordinates)).collect();
    let entry = |(node, touching): (u32, Vec<(u32, u8)>)| {
        let patches = patches(touching, &normals, feature_angle);
        let sharp = patches.len() > 1;
        patches.into_iter().map(move |patch| slave_node(node, patch, facets, sharp)).collect::<Vec<_>>()
    };
    around.into_iter().flat_map(entry).collect()
}

/// A node with the facets of one patch around it.
fn slave_node(node: u32, touching: Vec<(u32, u8)>, facets: &[FacetNodes], sharp: bool) -> SlaveNode {
    let mut ring: Vec<u32> = touching.iter().flat_map(|&(f, _)| &facets[f as usize]).copied().collect();
    ring.sort_unstable();
    ring.dedup();
    let at = |n: u32| ring.binary_search(&n).expect("the ring holds its facets' corners");
    let corners: Vec<RingCorner> = touching
        .iter()
        .map(|&(f, c)| {
            let (facet, c) = (&facets[f as usize], usize::from(c));
            let (next, previous) = ((c + 1) % facet.len(), (c + facet.len() - 1) % facet.len());
            RingCorner { own: at(node), next: at(facet[next]), previous: at(facet[previous]) }
        })
        .collect();
    // an edge along the quadrilateral's own ξ direction: from corner 0 to 1, or from 2 to 3
    let edge = if touching[0].1.is_multiple_of(2) { corners[0].next } else { corners[0].previous };
    SlaveNode { node, ring, corners, edge, facets: touching, mirrored: [false; 3], sharp, cone: Vec::new() }
}

/// Cosines that differ by less than this belong to the same angle, so edges at exactly the feature
/// angle are smooth regardless of round-off.
pub(crate) const SAME_COSINE: f64 = 1e-9;

/// Divides the facets around a node into patches: facets whose normals differ by at most the
/// feature angle belong together, and so do chains of such facets.
pub(crate) fn patches(facets: Vec<(u32, u8)>, normals: &[Vector3<f64>], feature_angle: f64) -> Vec<Vec<(u32, u8)>> {
    let least = feature_angle.cos() - SAME_COSINE;
    let smooth = |a: &(u32, u8), b: &(u32, u8)| {
        let (a, b) = (normals[a.0 as usize], normals[b.0 as usize]);
        a.dot(&b) >= least || a == Vector3::zeros() || b == Vector3::zeros()
    };
    let mut patches: Vec<Vec<(u32, u8)>> = Vec::new();
    for facet in facets {
        let (joined, apart): (Vec<_>, Vec<_>) =
            patches.into_iter().partition(|patch| patch.iter().any(|other| smooth(other, &facet)));
        let mut patch: Vec<(u32, u8)> = joined.into_iter().flatten().chain([facet]).collect();
        patch.sort_unstable();
        patches = apart;
        patches.push(patch);
    }
    patches.sort_unstable();
    patches
}

/// Unit normal of a facet at its centre; zero for a collapsed facet.
pub(crate) fn normal(facet: &FacetNodes, x: &[f64]) -> Vector3<f64> {
    let at = |corner: usize| {
        let node = 3 * facet[corner] as usize;
        Vector3::new(x[node], x[node + 1], x[node + 2])
    };
    let [a, b] = if facet.len() == 3 { [at(1) - at(0), at(2) - at(0)] } else { [at(2) - at(0), at(3) - at(1)] };
    let cross = a.cross(&b);
    cross.try_normalize(0.0).unwrap_or(cross)
}
#[cfg(test)]
mod tests {
    use super::*;

    /// Two unit squares that share the edge of nodes 1 and 2, folded by an angle: patches meet
    /// there only if the angle is larger than the feature angle.
    #[test]
    fn nodes_at_sharp_edges_have_a_patch_for_each_side() {
        let folded = |degrees: f64, feature: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let x = [
                [0.0, 0.0, 0.0],
                [1.0, 0.0, 0.0],
                [1.0, 1.0, 0.0],
                [0.0, 1.0, 0.0],
                [1.0 + cos, 0.0, sin],
                [1.0 + cos, 1.0, sin],
            ];
            slave_topology(&[[0, 1, 2, 3].into(), [1, 4, 5, 2].into()], x.as_flattened(), f64::to_radians(feature))
        };
        for (degrees, feature) in [(44.0, 45.0), (-44.0, 45.0), (45.0, 45.0), (-60.0, 60.0), (90.0, 91.0)] {
            let nodes = folded(degrees, feature);
            assert_eq!(nodes.iter().map(|slave| slave.node).collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5]);
            assert!(nodes.iter().all(|slave| !slave.sharp));
        }
        for (degrees, feature) in [(46.0, 45.0), (-90.0, 45.0), (179.0, 90.0)] {
            let nodes = folded(degrees, feature);
            assert_eq!(nodes.iter().map(|slave| slave.node).collect::<Vec<_>>(), [0, 1, 1, 2, 2, 3, 4, 5]);
            for slave in nodes {
                assert_eq!(slave.sharp, [1, 2].contains(&slave.node));
                assert_eq!(slave.facets.len(), 1);
                assert_eq!(slave.ring.len(), 4);
            }
        }
    }
}
