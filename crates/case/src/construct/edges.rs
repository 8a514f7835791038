//! The normals of contact pairs at the edges of bodies.

use crate::file;
use slipstick_contact::ContactInterface;
use slipstick_contact::kinematics::MultiplierShape;
use slipstick_mesh::{FacetNodes, Mesh, facet_area_vector};

/// Cosine of the angle between a facet's normal and an axis below which they are perpendicular.
const PERPENDICULAR: f64 = 0.03;

/// The interface with the normals that the pair asks for; by default those of the master if the slave is a
/// curved surface of few facets, or at edges on an inclined curved surface, where multipliers have dual shapes
/// by default; otherwise averaged ones. `points`: positions of the contact surfaces'
/// corners; `fixed`: prescribed displacements, three per node.
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
    let both_curved = interface.heights().iter().all(|side| side.iter().any(Option::is_some));
    let touched = match contact.normals {
        Some(normals) => normals == file::Normals::Touched,
        None => !interface.is_with_itself() && interface.is_coarse(points.as_flattened(), feature_angle),
    };
    let may_be_inclined = contact.normals.is_none() && both_curved && !interface.is_with_itself();
    if !touched && !may_be_inclined {
        return interface;
    }
    let slave = interface.slave_facets().iter().flat_map(|facet| facet.iter());
    let nodes: std::collections::HashSet<u32> = slave.copied().collect();
    let of_slave = |body: &usize| mesh.bodies[*body].nodes.clone().any(|node| nodes.contains(&(node as u32)));
    let mut boundary: Vec<FacetNodes> = Vec::new();
    for body in (0..mesh.bodies.len()).filter(of_slave) {
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
    if touched {
        return interface.with_touched_normals(&boundary, points.as_flattened(), feature_angle);
    }
    let at_edges = interface.clone().with_touched_edges(&boundary, points.as_flattened(), feature_angle);
    match (interface.is_inclined(&at_edges, points.as_flattened()), contact.multiplier_shape) {
        (true, None) => at_edges.with_shape(MultiplierShape::Dual),
        (true, Some(_)) => at_edges,
        (false, _) => interface,
    }
}
