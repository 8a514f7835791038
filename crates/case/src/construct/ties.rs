//! The mortar rows of ties, and the positions of slave nodes that agree with them.
//!
//! A tie requires Σ_s b_js u_s = 0 at each slave node, with the mortar row b_j of the undeformed
//! mesh. Rigid rotations satisfy this only if Σ_s b_js X_s = 0, which facets of different size do
//! not meet on a curved surface. The slave nodes are therefore moved by the smallest amounts, in the
//! sense of least squares, that meet these conditions; the rows remain those of the original
//! positions (Puso, Int. J. Numer. Meth. Engng 59 (2004), 315–336).

use super::mesh::open_mesh;
use super::symmetry::mirrored;
use super::{BuildError, bond, cross_points, interface_of, sides, tie_reach};
use crate::file::Case;
use nalgebra::Vector3;
use slipstick_contact::kinematics::NodeKinematics;
use slipstick_mesh::{ContactMap, Mesh, facet_area};
use std::collections::{BTreeMap, BTreeSet};

/// Larger gaps, as fractions of the size of the slave's elements, are taken as intended and remain.
const FARTHEST: f64 = 0.1;

/// Gaps that count as closed, as fractions of that size.
const CLOSED: f64 = 1e-13;

/// Number of repetitions at most, for ties that share nodes.
const REPETITIONS: usize = 30;

/// For each pair of the case its mortar rows, if it is tied.
pub(super) type Rows = Vec<Option<Vec<NodeKinematics>>>;

/// The rows of each tied pair, none for other pairs; moves the slave nodes of all ties onto the
/// master surfaces.
///
/// # Errors
/// [`BuildError`] of a symmetry plane, or of surfaces that do not exist, are folded or do not face
/// each other.
pub(super) fn close(case: &Case, mesh: &mut Mesh) -> Result<Rows, BuildError> {
    let mut ties: Rows = vec![None; case.contacts.len()];
    if case.contacts.iter().all(|contact| !contact.tied) {
        return Ok(ties);
    }
    let (map, mirrored) = (ContactMap::new(mesh), mirrored(case, mesh)?);
    let points = map.points(&mesh.nodes);
    let mut sizes = Vec::new();
    let mut taken = contact_nodes(case, mesh)?;
    for (i, contact) in case.contacts.iter().enumerate().filter(|(_, contact)| contact.tied) {
        let interface =
            interface_of(case, contact, i, mesh, &points, &mirrored, tie_reach(contact, i, mesh, &points)?)?;
        sizes.push(smallest(mesh, &contact.slave));
        let mut rows = bond(&interface, points.as_flattened(), i)?;
        cross_points::condense(&interface, &mut rows, &taken);
        ties[i] = Some(rows);
        taken.extend(interface.slave_facets().iter().chain(interface.master_facets()).flatten());
    }
    for _ in 0..REPETITIONS {
        let mut open: f64 = 0.0;
        for (rows, size) in ties.iter_mut().flatten().zip(&sizes) {
            let points = map.points(&mesh.nodes);
            rows.iter_mut().for_each(|row| row.relative = relative(row, &points));
            let closing = Closing { map: &map, mirrored: &mirrored, rows };
            let gap = closing.gap() / *size;
            if gap > CLOSED && gap <= FARTHEST && closing.apply(&mut mesh.nodes, FARTHEST * *size) {
                open = open.max(gap);
            }
        }
        if open <= CLOSED {
            break;
        }
    }
    Ok(ties)
}

/// The slave nodes of all contact pairs.
fn contact_nodes(case: &Case, mesh: &Mesh) -> Result<BTreeSet<u32>, BuildError> {
    let mut nodes = BTreeSet::new();
    for (i, contact) in case.contacts.iter().enumerate().filter(|(_, contact)| !contact.tied) {
        let [slave, _] = sides(contact, i, mesh)?;
        nodes.extend(slave.iter().flatten());
    }
    Ok(nodes)
}

/// How far closing the ties moves the slave nodes of each pair: the largest distance \[L\], and its
/// node; none for pairs that are not tied.
///
/// # Errors
/// As [`close`].
pub(crate) fn moves(case: &Case) -> Result<Vec<Option<(f64, u32)>>, BuildError> {
    let open = open_mesh(case)?;
    let mut closed = open.clone();
    let ties = close(case, &mut closed)?;
    let distance = |node: u32| {
        let [a, b] = [&open, &closed].map(|mesh| Vector3::from(mesh.nodes[node as usize]));
        (b - a).norm()
    };
    let farthest = |rows: Vec<NodeKinematics>| {
        let slaves = rows.iter().flat_map(|row| &row.support[..row.ring]);
        slaves.map(|&node| (distance(node), node)).max_by(|a, b| a.0.total_cmp(&b.0))
    };
    Ok(ties.into_iter().map(|rows| rows.and_then(farthest)).collect())
}

/// Smallest length or thickness of the elements behind a surface. \[L\]
fn smallest(mesh: &Mesh, surface: &str) -> f64 {
    let volumes = mesh.element_volumes();
    let mut areas: BTreeMap<u32, f64> = BTreeMap::new();
    for facet in mesh.surfaces.get(surface).map_or(&[][..], |surface| &surface.facets) {
        *areas.entry(facet.element).or_default() += facet_area(&facet.nodes.corners(&mesh.nodes));
    }
    let of = |(element, area): (u32, f64)| area.sqrt().min(volumes[element as usize] / area);
    areas.into_iter().map(of).fold(f64::INFINITY, f64::min)
}

/// Σ_s b_js x_s.
fn relative(row: &NodeKinematics, points: &[[f64; 3]]) -> Vector3<f64> {
    row.support.iter().zip(&row.coefficient).map(|(&s, b)| *b * Vector3::from(points[s as usize])).sum()
}

/// The conditions Σ_s b_js (X_s + v_s)/A_j = 0 for changes v of the positions of slave nodes, in
/// their plane for nodes on symmetry planes.
struct Closing<'a> {
    map: &'a ContactMap,
    mirrored: &'a [[bool; 3]],
    rows: &'a [NodeKinematics],
}

impl Closing<'_> {
    /// The largest gap ‖w_j‖/A_j in the directions of conditions. \[L\]
    fn gap(&self) -> f64 {
        let size = |row: &NodeKinematics| {
            let squares = (0..3).filter(|&c| self.has(row, c)).map(|c| (row.relative[c] / row.area).powi(2));
            squares.sum::<f64>().sqrt()
        };
        self.rows.iter().map(size).fold(0.0, f64::max)
    }

    /// Adds the smallest changes that meet all conditions: v = Bᵀ y with B Bᵀ y = −w, by conjugate
    /// gradients. Adds nothing, and returns false, if a node would move further than `farthest`.
    fn apply(&self, nodes: &mut [[f64; 3]], farthest: f64) -> bool {
        let count = nodes.len();
        let part = |row: &NodeKinematics| -> [f64; 3] {
            std::array::from_fn(|c| if self.has(row, c) { -row.relative[c] / row.area } else { 0.0 })
        };
        let mut residual: Vec<[f64; 3]> = self.rows.iter().map(part).collect();
        let mut change = vec![[0.0; 3]; count];
        let mut direction = residual.clone();
        let mut size = product(&residual, &residual);
        let enough = 1e-30 * size;
        for _ in 0..3 * self.rows.len() {
            let along = self.transposed(&direction, count);
            let curvature = product(&along, &along);
            if size <= enough || curvature <= 0.0 {
                break;
            }
            let step = size / curvature;
            add(&mut change, step, &along);
            add(&mut residual, -step, &self.times(&along));
            let next = product(&residual, &residual);
            let previous = std::mem::replace(&mut size, next);
            for (d, r) in direction.iter_mut().zip(&residual) {
                (0..3).for_each(|c| d[c] = r[c] + size / previous * d[c]);
            }
        }
        let near = change.iter().all(|v| v.iter().map(|v| v * v).sum::<f64>() <= farthest * farthest);
        if near {
            add(nodes, 1.0, &change);
        }
        near
    }

    /// Whether a row has a condition along an axis: no traction acts along the normal of a symmetry
    /// plane at nodes on it.
    fn has(&self, row: &NodeKinematics, c: usize) -> bool {
        row.area > 0.0 && !self.mirrored[row.node as usize][c]
    }

    /// B v.
    fn times(&self, v: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut out = vec![[0.0; 3]; self.rows.len()];
        for (out, row) in out.iter_mut().zip(self.rows) {
            self.each(row, |node, c, weight| out[c] += weight * v[node][c]);
        }
        out
    }

    /// Bᵀ y.
    fn transposed(&self, y: &[[f64; 3]], count: usize) -> Vec<[f64; 3]> {
        let mut out = vec![[0.0; 3]; count];
        for (y, row) in y.iter().zip(self.rows) {
            self.each(row, |node, c, weight| out[node][c] += weight * y[c]);
        }
        out
    }

    /// Calls `each` with the nodes and components that may move, and their weights in a condition.
    fn each(&self, row: &NodeKinematics, mut each: impl FnMut(usize, usize, f64)) {
        let conditions = [0, 1, 2].map(|c| self.has(row, c));
        if conditions == [false; 3] {
            return;
        }
        for (&point, b) in row.support.iter().zip(&row.coefficient).take(row.ring) {
            self.map.each(point, |node, weight| {
                let fixed = self.mirrored[node as usize];
                for c in (0..3).filter(|&c| conditions[c] && !fixed[c]) {
                    each(node as usize, c, weight * b / row.area);
                }
            });
        }
    }
}

fn product(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| a * b).sum()
}

fn add(to: &mut [[f64; 3]], factor: f64, from: &[[f64; 3]]) {
    to.as_flattened_mut().iter_mut().zip(from.as_flattened()).for_each(|(to, from)| *to += factor * from);
}
