//! Symmetry planes of a case: finds the nodes on each plane and checks that all others lie on one
//! side of it.

use super::BuildError;
use super::select::default_tolerance;
use crate::file::Case;
use slipstick_mesh::Mesh;

/// For every node, which of its components are normal to a symmetry plane that it lies on.
///
/// # Errors
/// [`BuildError`] at a plane that contains no node, or that has bodies on both sides.
pub(crate) fn mirrored(case: &Case, mesh: &Mesh) -> Result<Vec<[bool; 3]>, BuildError> {
    let mut mirrored = vec![[false; 3]; mesh.nodes.len()];
    let tolerance = default_tolerance(mesh);
    for (s, symmetry) in case.symmetries.iter().enumerate() {
        let axis = symmetry.normal.index();
        let letter = ["x", "y", "z"][axis];
        let fail = |message: String, help: &str| Err(BuildError::new(format!("symmetry[{s}].at"), message, help));
        let mut sides = [None; 2];
        let mut count = 0;
        let bodies = mesh.bodies.iter().flat_map(|body| body.nodes.clone());
        for (node, x) in bodies.map(|node| (node, &mesh.nodes[node])) {
            let distance = x[axis] - symmetry.at;
            if distance.abs() <= tolerance {
                mirrored[node][axis] = true;
                count += 1;
            } else {
                sides[usize::from(distance > 0.0)].get_or_insert((node, x[axis]));
            }
        }
        if count == 0 {
            let message = format!("no node lies within {tolerance:.3e} of the plane {letter} = {}", symmetry.at);
            return fail(message, "give the coordinate at which the bodies were cut");
        }
        if let [Some((below, low)), Some((above, high))] = sides {
            let message = format!(
                "bodies lie on both sides of the plane {letter} = {}: node {below} at {letter} = {low}, node {above} at {high}",
                symmetry.at
            );
            return fail(message, "mesh one half of the bodies only");
        }
        // a rigid body on the plane moves in it and turns about its normal
        for rigid in &mesh.rigid {
            if mesh.bodies[rigid.body].nodes.clone().any(|node| mirrored[node][axis]) {
                mirrored[rigid.reference as usize][axis] = true;
                (0..3).filter(|&c| c != axis).for_each(|c| mirrored[rigid.rotation() as usize][c] = true);
            }
        }
    }
    Ok(mirrored)
}
