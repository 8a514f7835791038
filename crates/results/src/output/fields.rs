//! Writes states of the load path as fields for ParaView.

use std::borrow::Cow;
use std::path::Path;

use super::OutputError;
use super::vtu::{Values, Vtu};
use slipstick_case::file::Dimension;
use slipstick_design::ElementValues;
use slipstick_mesh::Mesh;
use slipstick_model::model::{ContactResults, ElementFields};
use slipstick_model::quantities::Slipped;

/// A state of the load path.
#[derive(Debug, Clone, Copy)]
pub struct State<'a> {
    /// Displacement, three components per node. \[L\]
    pub displacement: &'a [f64],
    /// Results of contact.
    pub contact: &'a ContactResults,
    /// Density of every element.
    pub density: &'a ElementValues,
    /// Stress, energy and deformation of every element, and reactions; empty: 0.
    pub elements: &'a ElementFields,
    /// Slip of every slave node of all pairs; empty: unknown.
    pub slipped: &'a [Slipped],
    /// `contact_gap` where no master facet is opposite a slave node. \[L\]
    pub no_gap: f64,
}

/// A field of a state, on the nodes or in the elements of its mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Field<'a> {
    /// Its name in files.
    pub name: &'static str,
    /// Where it is.
    pub place: Place,
    /// Values per node or element: 1, 3 or 6.
    pub components: usize,
    values: Stored<'a>,
}

/// Where a field has its values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// At the nodes.
    Points,
    /// In the elements.
    Cells,
}

#[derive(Debug, Clone, PartialEq)]
enum Stored<'a> {
    F64(Cow<'a, [f64]>),
    I64(Vec<i64>),
}

impl Field<'_> {
    /// Its values, node by node or element by element.
    pub fn values(&self) -> Values<'_> {
        match &self.values {
            Stored::F64(values) => Values::F64(values),
            Stored::I64(values) => Values::I64(values),
        }
    }
}

impl Place {
    /// `points` or `cells`, as in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Points => "points",
            Self::Cells => "cells",
        }
    }
}

impl<'a> From<&'a [f64]> for Stored<'a> {
    fn from(values: &'a [f64]) -> Self {
        Self::F64(values.into())
    }
}

impl From<Vec<f64>> for Stored<'_> {
    fn from(values: Vec<f64>) -> Self {
        Self::F64(values.into())
    }
}

impl From<Vec<i64>> for Stored<'_> {
    fn from(values: Vec<i64>) -> Self {
        Self::I64(values)
    }
}

/// The fields of a state, in the order in which files list them: displacement, reaction and contact
/// fields at the nodes; density, body, determinant, stress and energy in the elements, and
/// their plastic strain if a law has one
/// ([`ElementFields`]).
///
/// Point fields of contact are 0 away from contact surfaces. `contact_status` marks slave nodes: −1
/// for other nodes, 0 open, 1 stick, 2 slip. `contact_force` acts on the nodes of both surfaces;
/// `contact_traction` and `contact_pressure` act on the slave, per current area;
/// `contact_multiplier` is z, only on the covered part of the slave ([`ContactResults`]). If no
/// master facet lies opposite a slave node, its `contact_gap` is `no_gap`. The units of all fields:
/// [`field_dimension`].
pub fn of_state<'a>(mesh: &Mesh, state: &State<'a>) -> Vec<Field<'a>> {
    let &State { displacement, contact, density, elements, slipped, no_gap } = state;
    let nodes = mesh.nodes.len();
    let all = |values: &'a [f64], items: usize| match values.len() {
        0 => Stored::from(vec![0.0; items]),
        _ => Stored::from(values),
    };
    let (mut multiplier, mut gap, mut slip) = (vec![0.0; 3 * nodes], vec![0.0; nodes], vec![0.0; nodes]);
    let mut status = vec![-1i64; nodes];
    for at in &contact.nodes {
        let n = at.node as usize;
        let now = i64::from(at.status.code());
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
    let (point, cell) = (
        |name, components, values| Field { name, place: Place::Points, components, values },
        |name, components, values| Field { name, place: Place::Cells, components, values },
    );
    let cells = mesh.elements.len();
    let mut displacement = Cow::Borrowed(&displacement[..3 * nodes]);
    for rigid in &mesh.rigid {
        // the rotation has no place of its own; both nodes move with the reference point
        let [from, to] = [rigid.reference, rigid.rotation()].map(|node| 3 * node as usize);
        displacement.to_mut().copy_within(from..from + 3, to);
    }
    let mut fields = vec![
        point("displacement", 3, Stored::F64(displacement)),
        point("contact_force", 3, all(&contact.force, 3 * nodes)),
        point("contact_traction", 3, all(&contact.traction, 3 * nodes)),
        point("contact_pressure", 1, all(&contact.pressure, nodes)),
        point("contact_multiplier", 3, multiplier.into()),
        point("contact_gap", 1, gap.into()),
        point("slip_increment", 1, slip.into()),
        point("accumulated_slip", 1, distance.into()),
        point("friction_work", 1, work.into()),
        point("contact_status", 1, status.into()),
        point("reaction", 3, all(&elements.reaction, 3 * nodes)),
        cell("density", 1, Stored::from(&density[..])),
        cell("body", 1, body_numbers(mesh).into()),
        cell("smallest_determinant", 1, Stored::from(&elements.determinants[..])),
        cell("cauchy_stress", 6, all(&elements.stress, 6 * cells)),
        cell("von_mises_stress", 1, all(&elements.von_mises, cells)),
        cell("strain_energy_density", 1, all(&elements.energy_density, cells)),
    ];
    if !elements.plastic_strain.is_empty() {
        fields.push(cell("plastic_strain", 1, Stored::from(&elements.plastic_strain[..])));
    }
    fields
}

/// Writes a state at pseudo-time `time` with its fields ([`of_state`]). If `pieces` gives the piece
/// of every element, the same data are also written in pieces, next to the file
/// ([`Vtu::save_pieces`]).
///
/// # Errors
/// If the file cannot be written, or a value is not finite.
pub fn write_state(
    path: &Path,
    mesh: &Mesh,
    time: f64,
    fields: &[Field<'_>],
    pieces: Option<&[u32]>,
) -> Result<(), OutputError> {
    let mut file = Vtu::new(&mesh.nodes, &mesh.elements)?;
    file.time(time)?;
    for field in fields {
        match field.place {
            Place::Points => file.point_field(field.name, field.components, field.values())?,
            Place::Cells => file.cell_field(field.name, field.components, field.values())?,
        };
    }
    save(&file, path, pieces)
}

/// The dimension of a field of [`of_state`] or [`write_design`]; `None` for plain numbers, and
/// for derivatives, whose dimension depends on the objective.
pub fn field_dimension(name: &str) -> Option<Dimension> {
    match name {
        "displacement" | "contact_gap" | "slip_increment" | "accumulated_slip" => Some(Dimension::LENGTH),
        "contact_force" | "reaction" => Some(Dimension::FORCE),
        "contact_traction" | "contact_pressure" | "contact_multiplier" => Some(Dimension::STRESS),
        "cauchy_stress" | "von_mises_stress" | "strain_energy_density" => Some(Dimension::STRESS),
        "friction_work" => Some(Dimension::of(1, -1)),
        _ => None,
    }
}

/// A design in an iteration.
#[derive(Debug, Clone, Copy)]
pub struct DesignFields<'a> {
    /// The iteration.
    pub iteration: usize,
    /// Density of every element.
    pub density: &'a ElementValues,
    /// dθ/dφ of every element.
    pub derivative: Option<&'a ElementValues>,
    /// Design variable of every element; `None`: the densities are the variables.
    pub variables: Option<&'a ElementValues>,
}

/// Writes a design in the elements of the undeformed mesh; `pieces` as in [`write_state`].
///
/// # Errors
/// If the file cannot be written, or a value is not finite.
pub fn write_design(
    path: &Path,
    mesh: &Mesh,
    design: &DesignFields<'_>,
    pieces: Option<&[u32]>,
) -> Result<(), OutputError> {
    let body = body_numbers(mesh);
    let mut file = Vtu::new(&mesh.nodes, &mesh.elements)?;
    file.time(design.iteration as f64)?;
    file.cell_field("density", 1, Values::F64(design.density))?;
    for (name, values) in [("objective_derivative", design.derivative), ("design_variable", design.variables)] {
        if let Some(values) = values {
            file.cell_field(name, 1, Values::F64(values))?;
        }
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
