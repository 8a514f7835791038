//! Checks whether the averaged normals of a slave surface are close to the normals of its facets.
//!
//! A slave node has one normal, averaged over the facets around it, unless it lies on an edge that
//! is sharper than the feature angle. If the averaged normal is far from the normal of a facet,
//! contact pushes in a wrong direction there, and normal and friction forces mix: an edge whose
//! normals are off by δ and that slides on a flat face appears to have the coefficient of friction
//! tan(arctan μ + δ).

use super::{Notice, NoticeKind};
use crate::file::Contact;
use nalgebra::Vector3;
use slipstick_contact::{ContactInterface, SlaveNode};
use slipstick_mesh::Mesh;
use slipstick_model::words::{counted, quantity, vector};

/// Largest acceptable angle between an averaged normal and the normal of a facet: that of a curved
/// surface with six elements over half a turn, as in the coarsest meshes of practical
/// use. \[degrees\]
const LARGEST: f64 = 15.0;

/// The same next to a plane: a larger angle there means an edge between planes, not a curved
/// surface. \[degrees\]
const LARGEST_BESIDE_PLANE: f64 = 5.0;

/// A facet belongs to a plane if the angle at another of its nodes is smaller than this fraction of
/// the angle at the node.
const PLANE: f64 = 0.1;

/// Angles that differ by less count as equal. \[degrees\]
const ROUNDING: f64 = 1e-6;

/// Slave nodes whose averaged normal is far from the normal of a facet.
pub(super) struct Averaged {
    /// Number of such nodes.
    count: usize,
    /// The worst one, and its angle. \[degrees\]
    worst: u32,
    angle: f64,
}

/// The largest angle between the normal of a node and the normals of its facets at that node, in
/// the reference configuration; 0 at a sharp edge, since normals are not averaged over
/// it. \[degrees\]
fn angle(slave: &SlaveNode, mesh: &Mesh) -> f64 {
    if slave.sharp {
        return 0.0;
    }
    let at = |position: usize| Vector3::from(mesh.nodes[slave.ring[position] as usize]);
    let normals = slave.corners.iter().filter_map(|corner| {
        let own = at(corner.own);
        (at(corner.next) - own).cross(&(at(corner.previous) - own)).try_normalize(0.0)
    });
    let normals: Vec<Vector3<f64>> = normals.collect();
    let mut mean: Vector3<f64> = normals.iter().sum();
    (0..3).filter(|&c| slave.mirrored[c]).for_each(|c| mean[c] = 0.0);
    normals.iter().map(|normal| normal.angle(&mean).to_degrees()).fold(0.0, f64::max)
}

/// Whether slave facets surround a node, that is, whether it does not lie on the boundary of the
/// surface.
fn inner(slave: &SlaveNode) -> bool {
    let mut neighbours: Vec<usize> = slave.corners.iter().flat_map(|corner| [corner.next, corner.previous]).collect();
    neighbours.sort_unstable();
    neighbours.dedup();
    neighbours.len() == slave.corners.len()
}

/// The slave nodes of an interface whose averaged normals are off by more than [`LARGEST`], or next
/// to a plane by more than [`LARGEST_BESIDE_PLANE`].
pub(super) fn averaged(interface: &ContactInterface, mesh: &Mesh) -> Option<Averaged> {
    let slaves = interface.slave_nodes();
    let angles: Vec<f64> = slaves.iter().map(|slave| angle(slave, mesh)).collect();
    // the smallest angle at an inner node of each facet
    let mut flattest = vec![f64::INFINITY; interface.slave_facets().len()];
    for (slave, &angle) in slaves.iter().zip(&angles).filter(|(slave, _)| inner(slave)) {
        slave.facets.iter().for_each(|&(f, _)| flattest[f as usize] = angle.min(flattest[f as usize]));
    }
    let too_far = |slave: &SlaveNode, angle: f64| {
        let beside_plane = slave.facets.iter().any(|&(f, _)| flattest[f as usize] < PLANE * angle);
        angle > ROUNDING + if beside_plane { LARGEST_BESIDE_PLANE } else { LARGEST }
    };
    let far = slaves.iter().zip(&angles).filter(|&(slave, &angle)| !slave.follows_master() && too_far(slave, angle));
    let far: Vec<(f64, u32)> = far.map(|(slave, &angle)| (angle, slave.node)).collect();
    // of equally bad nodes, the first
    let (angle, worst) =
        far.iter().rev().max_by(|a, b| (a.0 * 1e6).round().total_cmp(&(b.0 * 1e6).round())).copied()?;
    Some(Averaged { count: far.len(), worst, angle })
}

impl Averaged {
    /// As a notice.
    pub fn notice(&self, pair: usize, contact: &Contact, mesh: &Mesh) -> Notice {
        let Self { count, worst, angle } = *self;
        let place = vector(mesh.nodes[worst as usize]);
        let degrees = |angle: f64| quantity((10.0 * angle).round() / 10.0);
        Notice {
            kind: NoticeKind::AveragedNormals,
            path: format!("contact[{pair}].slave"),
            message: format!(
                "`{}`, the slave of `{}`, has {} whose averaged normal differs from a facet's by up to {}°, at node \
                 {worst}, {place}: contact pushes in a wrong direction there, and the apparent friction is tan(arctan \
                 μ ± that angle)",
                contact.slave,
                contact.master,
                counted(count, "node"),
                degrees(angle),
            ),
            help: format!(
                "refine the mesh if the surface is curved there; set `feature_angle` below {} if there is an edge; or \
                 exchange slave and master",
                degrees(2.0 * angle)
            ),
        }
    }
}
