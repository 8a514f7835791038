//! A state of the load path as fields that ParaView opens.

use std::path::Path;

use super::OutputError;
use super::vtu::{Values, Vtu};
use crate::analysis::NodalContact;
use crate::case::Dimension;
use slipstick_contact::friction::Status;
use slipstick_mesh::Mesh;

/// Writes a state: displacement, contact fields at the nodes; density, body and determinant in the elements.
///
/// Point fields of contact are 0 away from the slave surfaces; `contact_status` tells them apart: −1 no slave node, 0 open,
/// 1 stick, 2 slip. `contact_traction` is the traction that acts on the slave, −z. Where nothing lies opposite of a slave
/// node its `contact_gap` is `no_gap`. With `pieces`, the piece of every element, the same is written in pieces too, beside it
/// ([`Vtu::save_pieces`]).
///
/// # Errors
/// If the file cannot be written, or a value is not finite.
pub fn write_state(
    path: &Path,
    mesh: &Mesh,
    time: f64,
    displacement: &[f64],
    contact: &[NodalContact],
    density: &[f64],
    determinants: &[f64],
    no_gap: f64,
    pieces: Option<&[u32]>,
) -> Result<(), OutputError> {
    let nodes = mesh.nodes.len();
    let (mut traction, mut pressure, mut gap, mut slip) =
        (vec![0.0; 3 * nodes], vec![0.0; nodes], vec![0.0; nodes], vec![0.0; nodes]);
    let mut status = vec![-1i64; nodes];
    for at in contact {
        let n = at.node as usize;
        for c in 0..3 {
            traction[3 * n + c] = -at.global_traction[c];
        }
        pressure[n] = at.traction[0];
        gap[n] = at.gap.unwrap_or(no_gap);
        slip[n] = at.slip[0].hypot(at.slip[1]);
        status[n] = match at.status {
            Status::Inactive => 0,
            Status::Stick => 1,
            Status::Slip => 2,
        };
    }
    let body = body_numbers(mesh);
    let mut file = Vtu::new(&mesh.nodes, &mesh.elements)?;
    file.time(time)?;
    file.point_field("displacement", 3, Values::F64(&displacement[..3 * nodes]))?;
    file.point_field("contact_traction", 3, Values::F64(&traction))?;
    file.point_field("contact_pressure", 1, Values::F64(&pressure))?;
    file.point_field("contact_gap", 1, Values::F64(&gap))?;
    file.point_field("slip_increment", 1, Values::F64(&slip))?;
    file.point_field("contact_status", 1, Values::I64(&status))?;
    file.cell_field("density", 1, Values::F64(density))?;
    file.cell_field("body", 1, Values::I64(&body))?;
    file.cell_field("smallest_determinant", 1, Values::F64(determinants))?;
    save(&file, path, pieces)
}

/// What a field of [`write_state`] or [`write_design`] is measured in; `None` of plain numbers, and of
/// derivatives, which depend on the objective.
pub fn field_dimension(name: &str) -> Option<Dimension> {
    match name {
        "displacement" | "contact_gap" | "slip_increment" => Some(Dimension::LENGTH),
        "contact_traction" | "contact_pressure" => Some(Dimension::STRESS),
        _ => None,
    }
}

/// Writes a design: density (and a derivative, if there is one) in the elements of the undeformed mesh; with `pieces` as in
/// [`write_state`].
///
/// # Errors
/// If the file cannot be written, or a value is not finite.
pub fn write_design(
    path: &Path,
    mesh: &Mesh,
    iteration: usize,
    density: &[f64],
    derivative: Option<&[f64]>,
    pieces: Option<&[u32]>,
) -> Result<(), OutputError> {
    let body = body_numbers(mesh);
    let mut file = Vtu::new(&mesh.nodes, &mesh.elements)?;
    file.time(iteration as f64)?;
    file.cell_field("density", 1, Values::F64(density))?;
    if let Some(derivative) = derivative {
        file.cell_field("objective_derivative", 1, Values::F64(derivative))?;
    }
    file.cell_field("body", 1, Values::I64(&body))?;
    save(&file, path, pieces)
}

fn save(file: &Vtu<'_>, path: &Path, pieces: Option<&[u32]>) -> Result<(), OutputError> {
    if let Some(pieces) = pieces {
        file.save_pieces(&path.with_extension("pvtu"), pieces)?;
    }
    file.save(path)
}

fn body_numbers(mesh: &Mesh) -> Vec<i64> {
    let mut numbers = vec![0; mesh.elements.len()];
    for (b, body) in mesh.bodies.iter().enumerate() {
        numbers[body.elements.clone()].fill(b as i64);
    }
    numbers
}
