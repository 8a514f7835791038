//! The elements of regions that a case names.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use slipstick_mesh::{FacetNodes, FacetTree, Mesh};

use crate::file::Region;

type Point = Vector3<f64>;

/// Finds the elements of regions among those of the design.
pub(crate) struct Regions<'a> {
    mesh: &'a Mesh,
    domain: &'a [u32],
    centroids: Vec<[f64; 3]>,
}

impl<'a> Regions<'a> {
    /// `domain`: the elements of the design bodies.
    pub fn new(mesh: &'a Mesh, domain: &'a [u32]) -> Self {
        Self { mesh, domain, centroids: mesh.centroids() }
    }

    /// The elements of each region.
    pub fn each(&self, regions: &[Region]) -> Vec<Vec<u32>> {
        regions.iter().map(|region| self.elements(region)).collect()
    }

    fn elements(&self, region: &Region) -> Vec<u32> {
        let own = |inside: &dyn Fn(u32) -> bool| self.domain.iter().copied().filter(|&e| inside(e)).collect();
        match region {
            Region::NearSurface { surface, within } => {
                let facets = self.mesh.surfaces.get(surface);
                let facets: Vec<FacetNodes> = facets.iter().flat_map(|s| &s.facets).map(|facet| facet.nodes).collect();
                self.near(&facets, &[], *within)
            }
            Region::NearSet { set, within } => {
                let nodes = self.mesh.set_nodes(set).unwrap_or_default();
                let mut inside = vec![false; self.mesh.nodes.len()];
                nodes.iter().for_each(|&node| inside[node as usize] = true);
                let facets = (0..self.mesh.bodies.len()).flat_map(|body| self.mesh.boundary(body).facets);
                let facets = facets.map(|facet| facet.nodes);
                let facets: Vec<FacetNodes> =
                    facets.filter(|facet| facet.iter().all(|&node| inside[node as usize])).collect();
                self.near(&facets, &nodes, *within)
            }
            Region::Part { part } => {
                let members = self.mesh.element_sets.get(part);
                own(&|e| members.is_some_and(|members| members.binary_search(&e).is_ok()))
            }
            Region::Body { body } => {
                let elements = self.mesh.body(body).map_or(0..0, |body| body.elements.clone());
                own(&|e| elements.contains(&(e as usize)))
            }
            Region::Box { .. } | Region::Cylinder { .. } | Region::EndlessCylinder { .. } | Region::Ball { .. } => {
                own(&|e| region.contains(self.centroids[e as usize]) == Some(true))
            }
        }
    }

    /// The elements of the design with a facet on a surface, ascending, and how far their centroids are from it.
    /// \[L\]
    pub fn at_surface(&self, surface: &str) -> Vec<(u32, f64)> {
        let at = |node: u32| Point::from(self.mesh.nodes[node as usize]);
        let mut nearest: BTreeMap<u32, f64> = BTreeMap::new();
        for facet in self.mesh.surfaces.get(surface).iter().flat_map(|surface| &surface.facets) {
            let element = facet.element;
            if self.domain.binary_search(&element).is_ok() {
                let far = to_facet(&self.centroids[element as usize].into(), &facet.nodes, at);
                nearest.entry(element).and_modify(|known| *known = known.min(far)).or_insert(far);
            }
        }
        nearest.into_iter().collect()
    }

    /// The elements with centroids within a distance \[L\] of facets or nodes.
    fn near(&self, facets: &[FacetNodes], nodes: &[u32], within: f64) -> Vec<u32> {
        let at = |node: u32| Point::from(self.mesh.nodes[node as usize]);
        let tree = FacetTree::build(facets, self.mesh.nodes.as_flattened());
        let mut hits = Vec::new();
        let mut inside = |&element: &u32| {
            let centroid = self.centroids[element as usize];
            hits.clear();
            tree.query(centroid.map(|x| x - within), centroid.map(|x| x + within), &mut hits);
            let centroid = Point::from(centroid);
            let close = |distance: f64| distance <= within;
            hits.iter().any(|&hit| close(to_facet(&centroid, &facets[hit as usize], at)))
                || nodes.iter().any(|&node| close((centroid - at(node)).norm()))
        };
        self.domain.iter().copied().filter(|element| inside(element)).collect()
    }
}

/// Distance from a point to a facet; a quadrilateral is represented by the four triangles around its
/// centre. \[L\]
pub(super) fn to_facet(p: &Point, facet: &FacetNodes, at: impl Fn(u32) -> Point) -> f64 {
    let corners: Vec<Point> = facet.iter().map(|&node| at(node)).collect();
    if let [a, b, c] = corners[..] {
        return to_triangle(p, [a, b, c]);
    }
    let centre = corners.iter().sum::<Point>() / corners.len() as f64;
    let triangle = |k: usize| to_triangle(p, [corners[k], corners[(k + 1) % corners.len()], centre]);
    (0..corners.len()).map(triangle).fold(f64::INFINITY, f64::min)
}

/// Distance from a point to a triangle: to its plane over its interior, or to an edge. \[L\]
fn to_triangle(p: &Point, corners: [Point; 3]) -> f64 {
    let edges: [[Point; 2]; 3] = std::array::from_fn(|k| [corners[k], corners[(k + 1) % 3]]);
    let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
    if normal.norm() > 0.0 && edges.iter().all(|[a, b]| normal.dot(&(b - a).cross(&(p - a))) >= 0.0) {
        return (p - corners[0]).dot(&normal).abs() / normal.norm();
    }
    let to_edge = |[a, b]: &[Point; 2]| {
        let along = b - a;
        let share = ((p - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        (p - (a + share * along)).norm()
    };
    edges.iter().map(to_edge).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_from_a_triangle() {
        let triangle = [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]].map(Point::from);
        let to = |p: [f64; 3]| to_triangle(&p.into(), triangle);
        assert_eq!(to([0.5, 0.5, -3.0]), 3.0);
        assert_eq!(to([1.0, -1.0, 0.0]), 1.0);
        assert_eq!(to([-3.0, -4.0, 0.0]), 5.0);
        assert!((to([2.0, 2.0, 1.0]) - 3.0_f64.sqrt()).abs() < 1e-15);
    }
}
