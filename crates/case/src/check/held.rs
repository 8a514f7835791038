//! Checks whether supports hold nodes of contact pairs where this falsifies something.

use std::collections::BTreeSet;

use super::{Notice, NoticeKind};
use crate::file::{Case, Contact, ObjectiveKind};
use slipstick_contact::ContactInterface;
use slipstick_mesh::{FacetNodes, Mesh};
use slipstick_model::words::counted;

/// Coordinates on one plane agree to this fraction of a surface's extent.
const EQUAL: f64 = 1e-6;

/// A notice if `[[dirichlet]]` tables hold nodes of both sides of a tie along the normal of a plane on which these nodes
/// lie. Nothing then determines the traction along the normal at the slave nodes on the plane, or it depends on the
/// meshes. A symmetry plane releases it; contact has no traction across such a plane.
pub(super) fn on_both_sides(
    interface: &ContactInterface,
    pair: usize,
    case: &Case,
    contact: &Contact,
    mesh: &Mesh,
) -> Option<Notice> {
    if !contact.tied {
        return None;
    }
    let [slave, master] = [interface.slave_facets(), interface.master_facets()].map(nodes_of);
    (0..3).find_map(|axis| {
        let held = held_along(case, mesh, axis);
        let of = |nodes: &BTreeSet<u32>| -> Vec<f64> {
            nodes.intersection(&held).map(|&node| mesh.nodes[node as usize][axis]).collect()
        };
        let (of_slave, of_master) = (of(&slave), of(&master));
        // sides that are held as a whole are driven, not supported on a plane
        if of_slave.len() == slave.len() || of_master.len() == master.len() {
            return None;
        }
        let near = EQUAL * extent(slave.union(&master), mesh, axis);
        let plane = *of_slave.iter().find(|at| of_master.iter().any(|other| (*at - other).abs() <= near))?;
        // 0 rather than round-off
        let plane = if plane.abs() <= near { 0.0 } else { plane };
        let slaves = of_slave.iter().filter(|at| (*at - plane).abs() <= near).count();
        Some(notice(pair, contact, axis, plane, slaves))
    })
}

fn notice(pair: usize, contact: &Contact, axis: usize, plane: f64, slaves: usize) -> Notice {
    let normal = ["x", "y", "z"][axis];
    // 1 rather than 0.9999999999999992
    let plane: f64 = format!("{plane:.10e}").parse().unwrap_or(plane);
    Notice {
        kind: NoticeKind::HeldTwice,
        path: format!("contact[{pair}]"),
        message: format!(
            "[[dirichlet]] tables hold {} of `{}` and the nodes of `{}` on the plane {normal} = {plane} along \
             {normal}: the traction along {normal} there is not determined",
            counted(slaves, "node"),
            contact.slave,
            contact.master
        ),
        help: format!(
            "if it is a plane of symmetry, use `[[symmetry]]` with `normal = \"{normal}\"` and `at = {plane}` instead \
             of the two tables; otherwise hold only one of the two sides there"
        ),
    }
}

/// A notice for each `[[dirichlet]]` table that holds slave nodes of a pair opposite its master, in `facing`, if the
/// objective is the sum of nodal contact forces: it leaves out forces on prescribed displacements.
pub(super) fn in_objective(case: &Case, contact: &Contact, facing: &BTreeSet<u32>, mesh: &Mesh) -> Vec<Notice> {
    if contact.tied || !case.objective.as_ref().is_some_and(|of| matches!(of.kind, ObjectiveKind::ContactForce { .. }))
    {
        return Vec::new();
    }
    let notice = |(number, table): (usize, &crate::file::Dirichlet)| {
        let held = mesh.set_nodes(&table.set)?.iter().filter(|&node| facing.contains(node)).count();
        (held > 0).then(|| Notice {
            kind: NoticeKind::HeldInObjective,
            path: format!("dirichlet[{number}].set"),
            message: format!(
                "`{}` holds or moves {held} of the {} of `{}` that face `{}`: the objective `contact_force` leaves out \
                 forces on prescribed displacements",
                table.set,
                counted(facing.len(), "node"),
                contact.slave,
                contact.master
            ),
            help: "hold nodes outside the contact surface, or maximise a quantity with `contact_force`, which counts \
                   all of the force"
                .into(),
        })
    };
    (0..).zip(&case.dirichlet).filter_map(notice).collect()
}

fn nodes_of(facets: &[FacetNodes]) -> BTreeSet<u32> {
    facets.iter().flatten().copied().collect()
}

/// Nodes that tables hold or move along an axis.
fn held_along(case: &Case, mesh: &Mesh, axis: usize) -> BTreeSet<u32> {
    let holds = |table: &&crate::file::Dirichlet| table.components.iter().any(|component| *component as usize == axis);
    let tables = case.dirichlet.iter().filter(holds);
    tables.filter_map(|table| mesh.set_nodes(&table.set)).flat_map(|nodes| nodes.to_vec()).collect()
}

/// Extent of nodes along an axis. \[L\]
fn extent<'n>(nodes: impl Iterator<Item = &'n u32>, mesh: &Mesh, axis: usize) -> f64 {
    let (low, high) = nodes.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &node| {
        let at = mesh.nodes[node as usize][axis];
        (low.min(at), high.max(at))
    });
    high - low
}
