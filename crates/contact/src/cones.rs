//! The normal cones of slave nodes at edges of their body.

use crate::kinematics::frame::RingCorner;
use crate::slave_node::{SlaveNode, normal, patches};
use nalgebra::Vector3;
use slipstick_mesh::FacetNodes;
use std::collections::{BTreeMap, HashSet};

/// Sine of the angle by which a facet must fall away from a patch for the edge between them to be
/// convex.
const CONVEX: f64 = 1e-3;

/// Angle between facets of one patch above which one averaged normal does not represent them. Below it, the
/// averaged normal is within the widening of the cone. \[rad\]
pub(crate) const KINK: f64 = std::f64::consts::PI / 18.0;

/// Angle between facets of one patch from which on its averaged normal is off by more than 15°. \[rad\]
pub(crate) const SHARP_KINK: f64 = std::f64::consts::PI / 6.0;

/// Which slave nodes get cones.
pub(crate) struct Wanted<'a> {
    /// Those at kinks within a patch too, if its facets meet at more than this angle. \[rad\]
    pub kinks: Option<f64>,
    /// Only these.
    pub at: &'a dyn Fn(&SlaveNode) -> bool,
}

/// Gives the slave nodes that are `wanted` their cones: the facets of `boundary` around each, divided into smooth
/// patches. Patches that the node's own patch meets at a re-entrant edge do not count, since only
/// both of them together could touch there. With kinks, where the own patch is convex and bent by more than
/// the given angle between facets, the parts on both sides span the cone too: it is a kink of flat facets, or a curved
/// surface of so few facets that the face which touches it chooses the direction within their normals.
/// `coordinates`: 3 per node, of the reference configuration.
pub(crate) fn add(
    slave_nodes: &mut [SlaveNode],
    slave_facets: &[FacetNodes],
    boundary: &[FacetNodes],
    coordinates: &[f64],
    feature_angle: f64,
    wanted: &Wanted<'_>,
) {
    let on_slave: HashSet<Vec<u32>> = slave_facets.iter().map(sorted).collect();
    // slave facets first, so that they have the numbers that slave nodes know
    let beyond = boundary.iter().filter(|facet| !on_slave.contains(&sorted(facet)));
    let facets: Vec<FacetNodes> = slave_facets.iter().chain(beyond).copied().collect();
    let normals: Vec<Vector3<f64>> = facets.iter().map(|facet| normal(facet, coordinates)).collect();
    let mut around: BTreeMap<u32, Vec<(u32, u8)>> = slave_nodes.iter().map(|slave| (slave.node, Vec::new())).collect();
    for (number, facet) in (0_u32..).zip(&facets) {
        for (corner, node) in (0_u8..).zip(facet.iter()) {
            if let Some(around) = around.get_mut(node) {
                around.push((number, corner));
            }
        }
    }
    for slave in slave_nodes.iter_mut().filter(|slave| (wanted.at)(slave)) {
        let own: Vector3<f64> = slave.facets.iter().map(|&(facet, _)| normals[facet as usize]).sum();
        let falls_away = |patch: &Vec<(u32, u8)>| {
            let slope = |&(facet, corner): &(u32, u8)| slope(&facets[facet as usize], corner, coordinates).dot(&own);
            patch.iter().map(slope).sum::<f64>() < -CONVEX * patch.len() as f64 * own.norm()
        };
        let all = patches(around[&slave.node].clone(), &normals, feature_angle);
        let others = all.into_iter().filter(|patch| patch.iter().all(|facet| !slave.facets.contains(facet)));
        let mut others: Vec<Vec<(u32, u8)>> = others.filter(falls_away).collect();
        let kink = wanted.kinks.unwrap_or(feature_angle).min(feature_angle);
        let parts = patches(slave.facets.clone(), &normals, kink);
        if wanted.kinks.is_some() && parts.len() > 1 && parts.iter().all(falls_away) {
            others.extend(parts);
        }
        if others.is_empty() && !slave.sharp {
            continue;
        }
        slave.cone = vec![slave.corners.clone()];
        for patch in others {
            let mut corners = Vec::with_capacity(patch.len());
            for (facet, corner) in patch {
                let facet = &facets[facet as usize];
                let [own, next, previous] = [0, 1, facet.len() - 1].map(|step| {
                    let node = facet[(usize::from(corner) + step) % facet.len()];
                    slave.ring.iter().position(|&known| known == node).unwrap_or_else(|| {
                        slave.ring.push(node);
                        slave.ring.len() - 1
                    })
                });
                corners.push(RingCorner { own, next, previous });
            }
            slave.cone.push(corners);
        }
    }
}

fn sorted(facet: &FacetNodes) -> Vec<u32> {
    let mut nodes = facet.to_vec();
    nodes.sort_unstable();
    nodes
}

/// Mean of the unit vectors along the two edges of a facet that leave a corner.
fn slope(facet: &FacetNodes, corner: u8, x: &[f64]) -> Vector3<f64> {
    let at = |step: usize| {
        let node = 3 * facet[(usize::from(corner) + step) % facet.len()] as usize;
        Vector3::new(x[node], x[node + 1], x[node + 2])
    };
    let along = |step: usize| (at(step) - at(0)).try_normalize(0.0).unwrap_or_default();
    0.5 * (along(1) + along(facet.len() - 1))
}
