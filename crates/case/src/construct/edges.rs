//! The normals of contact pairs at the edges of bodies.

use std::collections::HashSet;

use crate::file;
use slipstick_contact::ContactInterface;
use slipstick_contact::kinematics::MultiplierShape;
use slipstick_mesh::{FacetNodes, Mesh, facet_area_vector};
use slipstick_model::model::LoadTime;
use slipstick_model::model::prescribed::Prescribed;

/// Cosine of the angle between a facet's normal and an axis below which they are perpendicular.
const PERPENDICULAR: f64 = 0.03;

/// The interface with the normals that the pair asks for. By default, the first of these that holds:
///
/// 1. A surface in contact with itself has averaged normals.
/// 2. A curved slave surface of few facets has those of the master within the cones of its nodes.
/// 3. Curved surfaces that are inclined to each other have the master's at edges of the slave's body, and dual shapes.
/// 4. Surfaces that lie on each other in the mesh have averaged normals.
/// 5. A slave surface has the master's where it ends at an edge or has a sharp kink, if one of the two is flat there.
///
/// `points`: positions of the contact surfaces' corners; `unmoved`: displacements, three per node, that supports
/// hold over the whole path.
///
/// Facets on symmetry planes are inside the whole body, and facets that are held along their normal
/// may be, as the faces of a strip in plane strain: what lies in such a plane is not an edge. A face that is
/// driven along its normal is one of the body, whose edges may dig in.
pub(super) fn with_normals(
    interface: ContactInterface,
    contact: &file::Contact,
    mesh: &Mesh,
    points: &[[f64; 3]],
    mirrored: &[[bool; 3]],
    unmoved: &[bool],
) -> ContactInterface {
    let feature_angle = contact.feature_angle.to_radians();
    let asked = contact.normals == Some(file::Normals::Touched);
    if !asked && (contact.normals.is_some() || interface.is_with_itself()) {
        return interface;
    }
    let x = points.as_flattened();
    let all_touched = asked || interface.is_coarse(x);
    let both_curved = interface.heights().iter().all(|side| side.iter().any(Option::is_some));
    let seated = interface.is_seated(x);
    if !all_touched && !both_curved && seated {
        return interface;
    }
    let boundary = boundary_of(&interface, mesh, points, mirrored, |node, axis| unmoved[3 * node as usize + axis]);
    if all_touched {
        return interface.with_touched_normals(&boundary, x, feature_angle);
    }
    if both_curved {
        let at_edges = interface.clone().with_touched_edges(&boundary, x, feature_angle);
        if interface.is_inclined(&at_edges, x) {
            return match contact.multiplier_shape {
                None => at_edges.with_shape(MultiplierShape::Dual),
                Some(_) => at_edges,
            };
        }
    }
    if seated { interface } else { interface.with_touched_flat_edges(&boundary, x, feature_angle) }
}

/// Which displacements supports hold, and do not move at any of the `times`.
pub(super) fn unmoved(prescribed: &Prescribed, times: &[LoadTime]) -> Vec<bool> {
    let at = |time: LoadTime| {
        let mut d = vec![0.0; prescribed.fixed().len()];
        prescribed.apply(time, &mut d);
        d
    };
    let mut unmoved = prescribed.fixed().to_vec();
    for &time in times {
        let change = at(LoadTime::start(time.case)).into_iter().zip(at(time));
        unmoved.iter_mut().zip(change).for_each(|(unmoved, (from, to))| *unmoved &= from == to);
    }
    unmoved
}

/// Whether both sides of a pair are curved, and the slave ends at an edge of its body on an inclined master
/// ([`ContactInterface::is_inclined`]).
pub(super) fn is_inclined(
    interface: &ContactInterface,
    contact: &file::Contact,
    mesh: &Mesh,
    points: &[[f64; 3]],
    mirrored: &[[bool; 3]],
) -> bool {
    let boundary = boundary_of(interface, mesh, points, mirrored, |_, _| false);
    let x = points.as_flattened();
    let touched = interface.clone().with_touched_edges(&boundary, x, contact.feature_angle.to_radians());
    interface.is_inclined(&touched, x)
}

/// The facets of the boundary of the slave's bodies, without those that symmetry or supports hold in their plane.
/// `unmoved` says whether a support holds a displacement of a node over the whole path.
fn boundary_of(
    interface: &ContactInterface,
    mesh: &Mesh,
    points: &[[f64; 3]],
    mirrored: &[[bool; 3]],
    unmoved: impl Fn(u32, usize) -> bool,
) -> Vec<FacetNodes> {
    let mut boundary: Vec<FacetNodes> = Vec::new();
    for body in bodies_of(interface.slave_facets(), mesh) {
        let rigid = mesh.rigid.iter().any(|rigid| rigid.body == body);
        let held = |facet: &FacetNodes| {
            let area = facet_area_vector(&facet.corners(points));
            let size = area.iter().map(|a| a * a).sum::<f64>().sqrt();
            let is_held = |axis: usize, node: u32| mirrored[node as usize][axis] || (!rigid && unmoved(node, axis));
            let all_held = |axis: usize| facet.iter().all(|&node| is_held(axis, node));
            (0..3).all(|axis| area[axis].abs() < PERPENDICULAR * size || all_held(axis))
        };
        boundary.extend(mesh.boundary(body).facets.iter().map(|facet| facet.nodes).filter(|facet| !held(facet)));
    }
    boundary
}

/// The bodies with nodes of these facets.
fn bodies_of(facets: &[FacetNodes], mesh: &Mesh) -> Vec<usize> {
    let nodes: HashSet<u32> = facets.iter().flat_map(|facet| facet.iter()).copied().collect();
    let has_some = |body: &usize| mesh.bodies[*body].nodes.clone().any(|node| nodes.contains(&(node as u32)));
    (0..mesh.bodies.len()).filter(has_some).collect()
}
