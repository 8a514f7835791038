//! The centres of hexahedra of 20 nodes, and of faces of these and of wedges of 15, which follow from the other
//! nodes.

use super::{BuildError, sides};
use crate::file::{Case, Enforcement};
use slipstick_mesh::{Element, HEX_FACE_CENTRES, Mesh, SerendipityCentre};
use slipstick_model::model::linear::LinearEquation;
use std::collections::BTreeSet;

/// The number of the equations of centres.
pub(super) const NUMBER: usize = usize::MAX;

/// Moves all centres of serendipity bodies to the positions that the other nodes give them.
pub(super) fn place(case: &Case, mesh: &mut Mesh) {
    let centres = of_bodies(case, mesh, &BTreeSet::new());
    mesh.place_centres(&centres);
}

/// The centres that follow from other nodes: not those of faces whose contact has multipliers. With nine
/// multipliers each, these faces need nine displacements.
///
/// # Errors
/// [`BuildError`] at a pair without surfaces.
pub(super) fn dependent(case: &Case, mesh: &Mesh) -> Result<Vec<SerendipityCentre>, BuildError> {
    Ok(of_bodies(case, mesh, &free(case, mesh)?))
}

fn of_bodies(case: &Case, mesh: &Mesh, free: &BTreeSet<u32>) -> Vec<SerendipityCentre> {
    let bodies = case.bodies.iter().zip(&mesh.bodies);
    let bodies = bodies.filter(|(body, _)| !body.shape_functions.are_lagrange() && body.rigid.is_none());
    bodies.flat_map(|(_, of)| mesh.serendipity_centres(of.elements.clone(), free)).collect()
}

/// The nodes of slave surfaces with multipliers.
fn free(case: &Case, mesh: &Mesh) -> Result<BTreeSet<u32>, BuildError> {
    let mut free = BTreeSet::new();
    for (i, contact) in case.contacts.iter().enumerate() {
        if contact.tied || !matches!(contact.enforcement, Enforcement::Penalty { .. }) {
            let [slave, _] = sides(contact, i, mesh)?;
            free.extend(slave.iter().flatten());
        }
    }
    Ok(free)
}

/// The hexahedra of a serendipity body with free centres of faces.
pub(super) fn enriched(case: &Case, mesh: &Mesh, body: usize) -> Result<Vec<u32>, BuildError> {
    let free = free(case, mesh)?;
    let has = |e: &u32| match &mesh.elements[*e as usize] {
        Element::Hex27(nodes) => HEX_FACE_CENTRES.iter().any(|&centre| free.contains(&nodes[centre])),
        _ => false,
    };
    Ok(mesh.bodies[body].elements.clone().map(|e| e as u32).filter(has).collect())
}

/// x_d − Σ wᵢ xᵢ = 0 for each component of each centre.
pub(super) fn equations(centres: &[SerendipityCentre]) -> impl Iterator<Item = LinearEquation> + '_ {
    centres.iter().flat_map(|centre| {
        (0..3).map(move |c| {
            let terms = centre.terms.iter().map(|&(node, weight)| (3 * node + c, -weight));
            LinearEquation { terms: [(3 * centre.node + c, 1.0)].into_iter().chain(terms).collect(), number: NUMBER }
        })
    })
}
