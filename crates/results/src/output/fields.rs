//! Writes states of the load path as fields for ParaView.

use std::path::Path;

use super::OutputError;
use super::vtu::{Values, Vtu};
use slipstick_case::case::Dimension;
use slipstick_contact::friction::Status;
use slipstick_design::ElementValues;
use slipstick_mesh::Mesh;
use slipstick_model::model::{ContactResults, ElementFields};
use slipstick_model::quantities::Slipped;

/// A state of the load path.
#[derive(Debug, Clone, Copy)]
pub struct State<'a> {
    /// Pseudo-time.
    pub time: f64,
    /// Displacement, three components per node. \[L\]
    pub displacement: &'a [f64],
    /// Results of contact.
    pub contact: &'a ContactResults,
    /// Density of every element.
    pub density: &'a ElementValues,
    /// Stress, energy and deformation of every element, and reactions.
    pub elements: &'a ElementFields,
    /// Slip of every slave node of all pairs; empty: unknown.
    pub slipped: &'a [Slipped],
    /// `contact_gap` where no master facet is opposite a slave node. \[L\]
    pub no_gap: f64,
}

/// Writes a state: displacement, reaction and contact fields at the nodes; density, body,
/// determinant, stress and energy in the elements ([`ElementFields`]).
///
/// Point fields of contact are 0 away from contact surfaces. `contact_status` marks slave nodes: −1
/// for other nodes, 0 open, 1 stick, 2 slip. `contact_force` acts on the nodes of both surfaces;
/// `contact_traction` and `contact_pressure` act on the slave, per current area;
/// `contact_multiplier` is z, only on the covered part of the slave ([`ContactResults`]). If no
/// master facet lies opposite a slave node, its `contact_gap` is `no_gap`. If `pieces` gives the
/// piece of every element, the same data are also written in pieces, next to the file
/// ([`Vtu::save_pieces`]).
///
/// # Errors
/// If the file cannot be written, or a value is not finite.
pub fn write_state(path: &Path, mesh: &Mesh, state: &State<'_>, pieces: Option<&[u32]>) -> Result<(), OutputError> {
    let &State { time, displacement, contact, density, elements, slipped, no_gap } = state;
    let nodes = mesh.nodes.len();
    let nodal = |values: &[f64], components: usize| match values.len() {
        0 => vec![0.0; components * nodes],
        _ => values.to_vec(),
    };
    let (force, traction) = (nodal(&contact.force, 3), nodal(&contact.traction, 3));
    let pressure = nodal(&contact.pressure, 1);
    let (mut multiplier, mut gap, mut slip) = (vec![0.0; 3 * nodes], vec![0.0; nodes], vec![0.0; nodes]);
    let mut status = vec![-1i64; nodes];
    for at in &contact.nodes {
        let n = at.node as usize;
        let now = match at.status {
            Status::Inactive => 0,
            Status::Stick => 1,
            Status::Slip => 2,
        };
        let (own_gap, own_slip) = (at.gap.unwrap_or(no_gap), at.slip[0].hypot(at.slip[1]));
        // among the patches that meet at a sharp edge, use the one closest to contact
        if status[n] >= 0 && (now == 0) >= (status[n] == 0) && own_gap >= gap[n] {
            continue;
        }
        multiplier[3 * n..3 * n + 3].copy_from_slice(&at.global_multiplier);
        (gap[n], slip[n], status[n]) = (own_gap, own_slip, now);
    }
    // a node at a sharp edge belongs to several patches: their work is summed, and so are their areas
    let mut total = vec![Slipped::default(); nodes];
    for (at, slipped) in contact.nodes.iter().zip(slipped) {
        let total = &mut total[at.node as usize];
        total.distance = total.distance.max(slipped.distance);
        total.work += slipped.work;
        total.area += slipped.area;
    }
    let distance: Vec<f64> = total.iter().map(|at| at.distance).collect();
    let work: Vec<f64> = total.iter().map(|at| if at.area > 0.0 { at.work / at.area } else { 0.0 }).collect();
    let reaction = nodal(&elements.reaction, 3);
    let of_elements = |values: &[f64], components: usize| match values.len() {
        0 => vec![0.0; components * mesh.elements.len()],
        _ => values.to_vec(),
    };
    let (stress, von_mises) = (of_elements(&elements.stress, 6), of_elements(&elements.von_mises, 1));
    let energy = of_elements(&elements.energy_density, 1);
    let body = body_numbers(mesh);
    let mut file = Vtu::new(&mesh.nodes, &mesh.elements)?;
    file.time(time)?;
    file.point_field("displacement", 3, Values::F64(&displacement[..3 * nodes]))?;
    file.point_field("contact_force", 3, Values::F64(&force))?;
    file.point_field("contact_traction", 3, Values::F64(&traction))?;
    file.point_field("contact_pressure", 1, Values::F64(&pressure))?;
    file.point_field("contact_multiplier", 3, Values::F64(&multiplier))?;
    file.point_field("contact_gap", 1, Values::F64(&gap))?;
    file.point_field("slip_increment", 1, Values::F64(&slip))?;
    file.point_field("accumulated_slip", 1, Values::F64(&distance))?;
    file.point_field("friction_work", 1, Values::F64(&work))?;
    file.point_field("contact_status", 1, Values::I64(&status))?;
    file.point_field("reaction", 3, Values::F64(&reaction))?;
    file.cell_field("density", 1, Values::F64(density))?;
    file.cell_field("body", 1, Values::I64(&body))?;
    file.cell_field("smallest_determinant", 1, Values::F64(&elements.determinants))?;
    file.cell_field("cauchy_stress", 6, Values::F64(&stress))?;
    file.cell_field("von_mises_stress", 1, Values::F64(&von_mises))?;
    file.cell_field("strain_energy_density", 1, Values::F64(&energy))?;
    save(&file, path, pieces)
}

/// The dimension of a field of [`write_state`] or [`write_design`]; `None` for plain numbers, and
/// for derivatives, whose dimension depends on the objective.
pub fn field_dimension(name: &str) -> Option<Dimension> {
    match name {
        "displacement" | "contact_gap" | "slip_increment" | "accumulated_slip" => Some(Dimension::LENGTH),
        "contact_force" | "reaction" => Some(Dimension::FORCE),
        "contact_traction" | "contact_pressure" | "contact_multiplier" => Some(Dimension::STRESS),
        "cauchy_stress" | "von_mises_stress" | "strain_energy_density" => Some(Dimension::STRESS),
        "friction_work" => Some(Dimension { force: 1, length: -1 }),
        _ => None,
    }
}

/// Writes a design: density (and a derivative, if given) in the elements of the undeformed mesh;
/// `pieces` as in [`write_state`].
///
/// # Errors
/// If the file cannot be written, or a value is not finite.
pub fn write_design(
    path: &Path,
    mesh: &Mesh,
    iteration: usize,
    density: &ElementValues,
    derivative: Option<&ElementValues>,
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
