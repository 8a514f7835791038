//! The normals of contact pairs at the edges of bodies.

use std::collections::HashSet;

use super::sides::{self, SIMILAR};
use crate::file;
use nalgebra::{Matrix3, Vector3};
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
/// 2. A curved slave surface of few facets has those of the master within the cones of its nodes: facets that meet at
///    15°, or at 10° if those of the master are larger.
/// 3. Curved surfaces that are inclined to each other have the master's at edges of the slave's body, and dual shapes.
/// 4. Surfaces that lie on each other in the mesh have averaged normals, unless the slave's edges dig in: its body is
///    stiffer than the master's, or rigid, or supports drive nodes of the slave surface along its normal.
/// 5. A slave surface has the master's where it ends at an edge or has a sharp kink, if one of the two is flat there.
///
/// `points`: positions of the contact surfaces' corners.
///
/// Facets on symmetry planes are inside the whole body, and facets that are held along their normal
/// may be, as the faces of a strip in plane strain: what lies in such a plane is not an edge. A face that is
/// driven along its normal is one of the body, whose edges may dig in.
pub(super) fn with_normals(
    interface: ContactInterface,
    contact: &file::Contact,
    bodies: &[file::Body],
    mesh: &Mesh,
    points: &[[f64; 3]],
    mirrored: &[[bool; 3]],
    held: &Held,
) -> ContactInterface {
    let feature_angle = contact.feature_angle.to_radians();
    let asked = contact.normals == Some(file::Normals::Touched);
    if !asked && (contact.normals.is_some() || interface.is_with_itself()) {
        return interface;
    }
    let x = points.as_flattened();
    let all_touched =
        asked || interface.is_coarse(x) || (interface.has_kinks(x) && has_larger_master(&interface, points));
    let both_curved = interface.heights().iter().all(|side| side.iter().any(Option::is_some));
    let seated = !has_stiffer_slave(&interface, bodies, mesh, points)
        && interface.is_seated(x, |node, along| held.is_driven(node, along));
    if !all_touched && !both_curved && seated {
        return interface;
    }
    let boundary = boundary_of(&interface, mesh, points, mirrored, |node, axis| held.unmoved[3 * node as usize + axis]);
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

/// What supports do over a path.
pub(super) struct Held {
    /// Displacements that are held and do not move, three per node.
    unmoved: Vec<bool>,
    /// For each node, Σ u uᵀ over the times, of the prescribed displacements u. \[L²\]
    driven: Vec<Matrix3<f64>>,
}

/// Sine of the angle to a surface below which nodes are driven along it.
const ALONG: f64 = 0.03;

impl Held {
    /// At all of the `times`.
    pub(super) fn over(prescribed: &Prescribed, times: &[LoadTime]) -> Self {
        let at = |time: LoadTime| {
            let mut d = vec![0.0; prescribed.fixed().len()];
            prescribed.apply(time, &mut d);
            d
        };
        let mut unmoved = prescribed.fixed().to_vec();
        let mut driven = vec![Matrix3::zeros(); unmoved.len() / 3];
        for &time in times {
            let both = at(LoadTime::start(time.case)).into_iter().zip(at(time));
            let change: Vec<f64> = both.map(|(from, to)| to - from).collect();
            // a rotation moves nodes along its axis by round-off
            let round_off = 1e-12 * change.iter().fold(0.0, |largest: f64, u| largest.max(u.abs()));
            unmoved.iter_mut().zip(&change).for_each(|(unmoved, u)| *unmoved &= u.abs() <= round_off);
            for (driven, u) in driven.iter_mut().zip(change.as_chunks::<3>().0) {
                let u = Vector3::from(*u);
                *driven += u * u.transpose();
            }
        }
        Self { unmoved, driven }
    }

    /// Whether a node is driven along the normal of a surface, and not only within it.
    fn is_driven(&self, node: u32, normal: &Vector3<f64>) -> bool {
        let squares = &self.driven[node as usize];
        normal.dot(&(squares * normal)) > ALONG * ALONG * squares.trace()
    }
}

/// Whether the facets of the master near the slave are larger than those of the slave near the master.
fn has_larger_master(interface: &ContactInterface, points: &[[f64; 3]]) -> bool {
    let (slave, master) = (interface.slave_facets(), interface.master_facets());
    let size =
        |of: &[FacetNodes], other: &[FacetNodes]| sides::median_size(&sides::close_to(of, other, points), points);
    size(master, slave) > SIMILAR * size(slave, master)
}

/// Ratio of the moduli of two bodies above which the edges of the stiffer one dig into the other one.
const STIFFER: f64 = 2.5;

/// Whether edges of the slave dig into the master because, where the two are close, one of its bodies is
/// stiffer than one of the master's by more than the factor [`STIFFER`]. A rigid body is stiffer than
/// every deformable one.
fn has_stiffer_slave(interface: &ContactInterface, bodies: &[file::Body], mesh: &Mesh, points: &[[f64; 3]]) -> bool {
    let (slave, master) = (interface.slave_facets(), interface.master_facets());
    let modulus = |body: &file::Body| if body.rigid.is_some() { f64::INFINITY } else { body.material.youngs_modulus() };
    let moduli = |of: &[FacetNodes], other: &[FacetNodes]| -> Vec<f64> {
        let bodies_there = bodies_of(&sides::close_to(of, other, points), mesh);
        bodies_there.into_iter().filter_map(|b| bodies.get(b)).map(modulus).collect()
    };
    let softest = moduli(master, slave).into_iter().fold(f64::INFINITY, f64::min);
    moduli(slave, master).into_iter().any(|slave| slave > STIFFER * softest)
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
