//! The normals of contact pairs at the edges of bodies.

use std::collections::HashSet;

use crate::file;
use slipstick_contact::ContactInterface;
use slipstick_contact::kinematics::MultiplierShape;
use slipstick_mesh::{FacetNodes, Mesh, facet_area_vector};

/// Cosine of the angle between a facet's normal and an axis below which they are perpendicular.
const PERPENDICULAR: f64 = 0.03;

/// The interface with the normals that the pair asks for. By default, a curved slave surface of few facets has those of
/// the master; pairs of curved surfaces that are inclined to each other have those of the master at edges of the slave's
/// body, and dual multiplier shapes; other pairs have those of the master where a flat slave surface ends at an edge or has a sharp kink,
/// unless the bodies lie on each other at the start. A body in contact with itself has averaged normals. `points`: positions of
/// the contact surfaces' corners; `fixed`: prescribed displacements, three per node.
///
/// Facets on symmetry planes are inside the whole body, and facets that are held along their normal
/// may be, as the faces of a strip in plane strain: what lies in such a plane is not an edge.
pub(super) fn with_normals(
    interface: ContactInterface,
    contact: &file::Contact,
    mesh: &Mesh,
    points: &[[f64; 3]],
    mirrored: &[[bool; 3]],
    fixed: &[bool],
) -> ContactInterface {
    let feature_angle = contact.feature_angle.to_radians();
    let asked = contact.normals == Some(file::Normals::Touched);
    if !asked && (contact.normals.is_some() || interface.is_with_itself()) {
        return interface;
    }
    let [slaves, masters] = [interface.slave_facets(), interface.master_facets()].map(|facets| bodies_of(facets, mesh));
    let mut boundary: Vec<FacetNodes> = Vec::new();
    for &body in &slaves {
        let rigid = mesh.rigid.iter().any(|rigid| rigid.body == body);
        let held = |facet: &FacetNodes| {
            let area = facet_area_vector(&facet.corners(points));
            let size = area.iter().map(|a| a * a).sum::<f64>().sqrt();
            let is_held =
                |axis: usize, node: u32| mirrored[node as usize][axis] || (!rigid && fixed[3 * node as usize + axis]);
            let all_held = |axis: usize| facet.iter().all(|&node| is_held(axis, node));
            (0..3).all(|axis| area[axis].abs() < PERPENDICULAR * size || all_held(axis))
        };
        boundary.extend(mesh.boundary(body).facets.iter().map(|facet| facet.nodes).filter(|facet| !held(facet)));
    }
    let points = points.as_flattened();
    if asked || interface.is_coarse(points, feature_angle) {
        return interface.with_touched_normals(&boundary, points, feature_angle);
    }
    if interface.heights().iter().all(|side| side.iter().any(Option::is_some)) {
        let at_edges = interface.clone().with_touched_edges(&boundary, points, feature_angle);
        if interface.is_inclined(&at_edges, points) {
            return match contact.multiplier_shape {
                None => at_edges.with_shape(MultiplierShape::Dual),
                Some(_) => at_edges,
            };
        }
    }
    if slaves.iter().any(|body| masters.contains(body)) {
        return interface;
    }
    let at_edges = interface.clone().with_touched_flat_edges(&boundary, points, feature_angle);
    if interface.is_seated(&at_edges, points) { interface } else { at_edges }
}

/// The bodies with nodes of these facets.
fn bodies_of(facets: &[FacetNodes], mesh: &Mesh) -> Vec<usize> {
    let nodes: HashSet<u32> = facets.iter().flat_map(|facet| facet.iter()).copied().collect();
    let has_some = |body: &usize| mesh.bodies[*body].nodes.clone().any(|node| nodes.contains(&(node as u32)));
    (0..mesh.bodies.len()).filter(has_some).collect()
}
