//! The facets of a surface, and the angles at which they meet.

use crate::{FacetNodes, facet_area};
use nalgebra::Vector3;
use std::collections::{BTreeMap, BTreeSet};

/// Facets whose normals differ by less than this angle lie in one plane. \[rad\]
pub(super) const FLAT: f64 = 1e-4;
/// An edge between two facets, and the angle between their normals \[rad\]; an edge in a symmetry
/// plane lies between a facet and its own mirror image.
pub(super) struct Bend {
    pub(super) facets: [u32; 2],
    pub(super) angle: f64,
}

pub(super) struct Facets<'a> {
    pub(super) facets: &'a [FacetNodes],
    pub(super) nodes: &'a [[f64; 3]],
    pub(super) normals: Vec<Vector3<f64>>,
    pub(super) bends: BTreeMap<[u32; 2], Bend>,
    pub(super) feature_angle: f64,
    pub(super) mirrored: &'a dyn Fn(u32) -> [bool; 3],
}

/// Unit normal of a facet at its centre; zero for a collapsed facet.
pub(super) fn normal(facet: &FacetNodes, nodes: &[[f64; 3]]) -> Vector3<f64> {
    let at = |i: usize| Vector3::from(nodes[facet[i] as usize]);
    let cross = match facet.len() {
        3 => (at(1) - at(0)).cross(&(at(2) - at(0))),
        _ => (at(2) - at(0)).cross(&(at(3) - at(1))),
    };
    cross.try_normalize(0.0).unwrap_or_default()
}

pub(super) fn edges(facet: &FacetNodes) -> impl Iterator<Item = [u32; 2]> + '_ {
    (0..facet.len()).map(|i| {
        let (a, b) = (facet[i], facet[(i + 1) % facet.len()]);
        [a.min(b), a.max(b)]
    })
}

fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}
impl<'a> Facets<'a> {
    pub(super) fn new(
        facets: &'a [FacetNodes],
        nodes: &'a [[f64; 3]],
        feature_angle: f64,
        mirrored: &'a dyn Fn(u32) -> [bool; 3],
    ) -> Self {
        let normals: Vec<_> = facets.iter().map(|facet| normal(facet, nodes)).collect();
        let mut around: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
        for (number, facet) in facets.iter().enumerate() {
            edges(facet).for_each(|edge| around.entry(edge).or_default().push(number as u32));
        }
        let bend = |(edge, around): ([u32; 2], Vec<u32>)| match around[..] {
            [f, g] => Some((edge, Bend { facets: [f, g], angle: angle(&normals[f as usize], &normals[g as usize]) })),
            [f] => {
                let [a, b] = edge.map(mirrored);
                let axis = (0..3).find(|&c| a[c] && b[c])?;
                let angle = 2.0 * normals[f as usize][axis].abs().min(1.0).asin();
                Some((edge, Bend { facets: [f, f], angle }))
            }
            _ => None,
        };
        let bends = around.into_iter().filter_map(bend).collect();
        Self { facets, nodes, normals, bends, feature_angle, mirrored }
    }

    pub(super) fn position(&self, node: u32) -> Vector3<f64> {
        Vector3::from(self.nodes[node as usize])
    }

    /// The facets of a set that edges of a kind connect.
    pub(super) fn components(&self, of: &BTreeSet<u32>, connects: impl Fn(&Bend) -> bool) -> Vec<BTreeSet<u32>> {
        let mut left = of.clone();
        let mut out = Vec::new();
        while let Some(first) = left.pop_first() {
            let mut component = BTreeSet::from([first]);
            let mut queue = vec![first];
            while let Some(facet) = queue.pop() {
                for bend in edges(&self.facets[facet as usize]).filter_map(|edge| self.bends.get(&edge)) {
                    let next = bend.facets[usize::from(bend.facets[0] == facet)];
                    if connects(bend) && left.remove(&next) {
                        component.insert(next);
                        queue.push(next);
                    }
                }
            }
            out.push(component);
        }
        out
    }

    /// The facets in flat regions. A strip of coplanar facets, as along a cylinder, does not count:
    /// in a flat region, at least one facet has three neighbours in its plane.
    pub(super) fn flat(&self, patch: &BTreeSet<u32>) -> BTreeSet<u32> {
        let coplanar = |bend: &Bend| bend.angle <= FLAT;
        let inner = |facet: &u32| {
            let bends = edges(&self.facets[*facet as usize]).filter_map(|edge| self.bends.get(&edge));
            bends.filter(|bend| coplanar(bend)).count() >= 3
        };
        let planes = self.components(patch, coplanar);
        planes.into_iter().filter(|plane| plane.iter().any(inner)).flatten().collect()
    }

    /// Size of a facet: the square root of its area. \[L\]
    pub(super) fn size(&self, facet: u32) -> f64 {
        facet_area(&self.facets[facet as usize].corners(self.nodes)).sqrt()
    }
}
