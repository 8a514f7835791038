//! The nodes that supports and motions hold.

use super::{BuildError, select};
use crate::file::Dirichlet;
use slipstick_mesh::Mesh;
use slipstick_model::model::prescribed::Moved;

/// What a motion moves.
pub(super) fn moved(mesh: &Mesh, dirichlet: &Dirichlet, path: &str) -> Result<Moved, BuildError> {
    let help = |body: &str| format!("prescribe the motion of the body: set = \"{body}\"");
    let moved = match mesh.reference_of(&dirichlet.set) {
        Some(reference) => Moved::Body(reference),
        None => Moved::Nodes(select::deformable_nodes(mesh, &dirichlet.set, path, help)?),
    };
    check_temporary(mesh, dirichlet, &moved, path)?;
    Ok(moved)
}

/// Refuses supports that begin or end within the path on anything but nodes of deformable bodies.
fn check_temporary(mesh: &Mesh, dirichlet: &Dirichlet, moved: &Moved, path: &str) -> Result<(), BuildError> {
    let of_body = |node: &u32| mesh.bodies.iter().any(|body| body.nodes.contains(&(*node as usize)));
    let solid = matches!(moved, Moved::Nodes(nodes) if nodes.iter().all(of_body));
    if dirichlet.is_permanent() || solid {
        return Ok(());
    }
    let message = "only supports of nodes of deformable bodies can begin or end within the path";
    let help = "tie the rigid body or the point to a deformable body, and hold that one; or omit `from` and `until`";
    Err(BuildError::new(path.to_owned(), message, help))
}
