//! Couplings of faces to reference points, as linear equations.
//!
//! ```text
//! distributing    u_r = ū + θ × (X_r − X̄),    θ = J⁻¹ Σ w_i r_i × u_i
//! kinematic       u_i = u_r + θ × (X_i − X_r)
//! ```
//!
//! with the mean displacement ū = Σ w_i u_i and centre X̄ = Σ w_i X_i of the face, r_i = X_i − X̄ and
//! J = Σ w_i (r_i·r_i 1 − r_i r_iᵀ). The unknowns of the reference point are u_r and L θ.

use super::BuildError;
use crate::file::{self, Case, CouplingKind};
use nalgebra::{Matrix3, Vector3};
use slipstick_mesh::{Coupling, Mesh};
use slipstick_model::model::linear::LinearEquation;
use slipstick_solid::load::nodal_areas;

/// Eigenvalues of J below this fraction of the largest leave a rotation undetermined.
const LINE: f64 = 1e-8;

/// Adds the equations of all couplings of the case, with numbers from `first`.
pub(super) fn add_equations(
    case: &Case,
    mesh: &Mesh,
    first: usize,
    equations: &mut Vec<LinearEquation>,
) -> Result<(), BuildError> {
    for (k, (coupling, reference)) in case.couplings.iter().zip(&mesh.couplings).enumerate() {
        let path = format!("coupling[{k}].set");
        let nodes = super::equations::nodes_in_equations(mesh, &coupling.set, &path)?;
        let own = match coupling.kind {
            CouplingKind::Distributing => distributing(coupling, mesh, &nodes, reference, &path)?,
            CouplingKind::Kinematic => kinematic(&coupling.set, mesh, &nodes, reference, &path)?,
        };
        equations.extend(own.into_iter().map(|terms| LinearEquation { terms, number: first + k }));
    }
    Ok(())
}

/// Factors on the displacement of a node and on L θ, for each component of a displacement.
fn kinematic(
    set: &str,
    mesh: &Mesh,
    nodes: &[u32],
    of: &Coupling,
    path: &str,
) -> Result<Vec<Vec<(u32, f64)>>, BuildError> {
    let point = Vector3::from(mesh.nodes[of.reference as usize]);
    let arms: Vec<_> = nodes.iter().map(|&node| (1.0, Vector3::from(mesh.nodes[node as usize]) - point)).collect();
    inertia(&arms).ok_or_else(|| on_a_line(set, path))?;
    let mut all = Vec::with_capacity(3 * nodes.len());
    for &node in nodes {
        let arm = Vector3::from(mesh.nodes[node as usize]) - point;
        // θ × a = −[a]× θ
        let by_rotation = -arm.cross_matrix() / of.length;
        for c in 0..3 {
            let mut terms = vec![(3 * node + c as u32, -1.0), (3 * of.reference + c as u32, 1.0)];
            terms.extend(row(of.rotation(), &by_rotation, c));
            all.push(terms);
        }
    }
    Ok(all)
}

/// J⁻¹ of weighted arms; `None` if these lie on a line.
fn inertia(arms: &[(f64, Vector3<f64>)]) -> Option<Matrix3<f64>> {
    let of = |(weight, r): &(f64, Vector3<f64>)| *weight * (Matrix3::identity() * r.norm_squared() - r * r.transpose());
    let sum: Matrix3<f64> = arms.iter().map(of).sum();
    let eigenvalues = sum.symmetric_eigenvalues();
    sum.try_inverse().filter(|_| eigenvalues.min() > LINE * eigenvalues.max())
}

fn on_a_line(set: &str, path: &str) -> BuildError {
    let message = format!("the nodes of `{set}` lie on a line, so a rotation about it is not determined");
    BuildError::new(path, message, "couple a face, or use an [[equation]]")
}

fn distributing(
    coupling: &file::Coupling,
    mesh: &Mesh,
    nodes: &[u32],
    of: &Coupling,
    path: &str,
) -> Result<Vec<Vec<(u32, f64)>>, BuildError> {
    let mut weights: Vec<(u32, f64)> = match mesh.surfaces.get(&coupling.set) {
        Some(surface) => nodal_areas(&mesh.faces_of_surface(surface), mesh.nodes.as_flattened()),
        None => nodes.iter().map(|&node| (node, 1.0)).collect(),
    };
    let sum: f64 = weights.iter().map(|(_, weight)| weight).sum();
    weights.iter_mut().for_each(|(_, weight)| *weight /= sum);
    weights.retain(|(_, weight)| weight.abs() > 1e-12);
    let place = |node: u32| Vector3::from(mesh.nodes[node as usize]);
    let centre: Vector3<f64> = weights.iter().map(|&(node, weight)| weight * place(node)).sum();
    let arms: Vec<(f64, Vector3<f64>)> = weights.iter().map(|&(node, weight)| (weight, place(node) - centre)).collect();
    let inverse = inertia(&arms).ok_or_else(|| on_a_line(&coupling.set, path))?;
    let arm = place(of.reference) - centre;
    let mut all = vec![Vec::new(); 6];
    for c in 0..3 {
        all[c].push((3 * of.reference + c as u32, -1.0));
        all[3 + c].push((3 * of.rotation() + c as u32, -1.0));
    }
    for &(node, weight) in &weights {
        // θ by u_i
        let turn = weight * inverse * (place(node) - centre).cross_matrix();
        let shift = Matrix3::identity() * weight - arm.cross_matrix() * turn;
        for c in 0..3 {
            all[c].extend(row(node, &shift, c));
            all[3 + c].extend(row(node, &(turn * of.length), c));
        }
    }
    Ok(all)
}

/// Row c of a matrix on the unknowns of a node.
fn row(node: u32, matrix: &Matrix3<f64>, c: usize) -> Vec<(u32, f64)> {
    let largest = matrix.amax();
    let terms = (0..3).filter(|&d| matrix[(c, d)].abs() > 1e-14 * largest);
    terms.map(|d| (3 * node + d as u32, matrix[(c, d)])).collect()
}
