//! What changes over the path at contact pairs: overlaps that close, and coefficients of friction.

use std::collections::HashMap;
use std::fmt::Write as _;

use slipstick_case::file::{Case, Contact};
use slipstick_mesh::{Mesh, facet_area_vector};
use slipstick_model::model::{FrictionPoint, OffsetPoint};

use super::Writer;
use super::history::bends;
use super::text::{number, numbers};

/// Factor on a coefficient of friction that is zero for a while: CalculiX refuses zero.
const NO_FRICTION: f64 = 1e-9;

/// An `offset` as a deck has it: slave nodes moved outward in the mesh. CalculiX closes overlaps over the first step.
struct Fit {
    /// How far. \[L\]
    moved: f64,
    /// Load steps over which the overlap closes; 0: from the start.
    closed: usize,
}

/// What becomes of the offset of a pair; `None`: a deck cannot hold it.
fn fit(contact: &Contact, steps: usize) -> Option<Fit> {
    let curve: Vec<f64> = (0..=steps).map(|n| OffsetPoint::at(&contact.offset, n as f64 / steps as f64)).collect();
    let (first, moved) = (curve[0], curve[steps]);
    let closed = match bends(&curve, 0..steps)[..] {
        [] if first == moved => 0,
        [] => steps,
        [n] if curve[n] == moved => n,
        _ => return None,
    };
    (moved >= first).then_some(Fit { moved, closed })
}

/// The mesh of a case with the slave surfaces of its press fits moved outward.
pub(super) fn pressed(case: &Case, mesh: &Mesh) -> Option<Mesh> {
    let mut moved: Option<Mesh> = None;
    for contact in case.contacts.iter().filter(|contact| !contact.offset.is_empty()) {
        let Some(fit) = fit(contact, case.load_path.steps).filter(|fit| fit.moved != 0.0) else { continue };
        let normals = normals(case, mesh, &contact.slave);
        let moved = moved.get_or_insert_with(|| mesh.clone());
        for (node, normal) in normals {
            (0..3).for_each(|c| moved.nodes[node as usize][c] += fit.moved * normal[c]);
        }
    }
    moved
}

/// Unit normals at the nodes of a surface, the means over its facets; on planes of symmetry, along the plane.
pub(super) fn normals(case: &Case, mesh: &Mesh, surface: &str) -> HashMap<u32, [f64; 3]> {
    let mut sums: HashMap<u32, [f64; 3]> = HashMap::new();
    for facet in mesh.surfaces.get(surface).map_or(&[][..], |of| &of.facets[..]) {
        let area = facet_area_vector(&mesh.facet_coordinates(facet));
        for &node in facet.nodes.sorted().iter() {
            let sum = sums.entry(node).or_default();
            (0..3).for_each(|c| sum[c] += area[c]);
        }
    }
    let size = mesh.bounding_box().map_or(1.0, |(low, high)| (0..3).map(|c| high[c] - low[c]).fold(0.0, f64::max));
    for (node, sum) in &mut sums {
        for plane in &case.symmetries {
            let axis = plane.normal.index();
            if (mesh.nodes[*node as usize][axis] - plane.at).abs() <= 1e-6 * size {
                sum[axis] = 0.0;
            }
        }
        let length = sum.iter().map(|n| n * n).sum::<f64>().sqrt();
        *sum = sum.map(|n| n / length.max(f64::MIN_POSITIVE));
    }
    sums
}

impl Writer<'_> {
    /// Notes what becomes of an offset, which [`pressed`] has moved the mesh by.
    pub(super) fn offset(&mut self, contact: &Contact, at: &dyn Fn(&str) -> String) {
        if contact.offset.is_empty() {
            return;
        }
        let Some(Fit { moved, closed }) = fit(contact, self.case.load_path.steps) else {
            let message = "in a deck, surfaces overlap from the start: only an offset that grows linearly from \
                           t = 0, and is then constant, is written";
            return self.refuse(at("offset"), message, "give it one waypoint");
        };
        if closed > 0 {
            self.history.change(closed, String::new());
        }
        let message = format!(
            "nodes of the slave are moved outward by {}: CalculiX closes the overlap over the first step, while slipstick, \
             from the deck, has all of it from the first load step on",
            number(moved)
        );
        self.warn(at("offset"), message, "nothing to do if friction hardly matters while the fit closes");
    }

    /// Notes offsets that CalculiX closes too early.
    pub(super) fn early_fits(&mut self) {
        let (case, first) = (self.case, self.history.ends()[0]);
        for (i, contact) in case.contacts.iter().enumerate().filter(|(_, contact)| !contact.offset.is_empty()) {
            let closed = fit(contact, case.load_path.steps).map_or(0, |fit| fit.closed);
            if closed > first {
                let message = format!(
                    "the first step of the deck ends at t = {}: by then CalculiX has closed the overlap, earlier than \
                     the case",
                    number(first as f64 / case.load_path.steps as f64)
                );
                self.warn(
                    format!("contact[{i}].offset"),
                    message,
                    "let motions and loads change direction only after the last waypoint of `offset`",
                );
            }
        }
    }

    /// The coefficient over the path, as the step that begins with each load step has it. Returns that of the first.
    pub(super) fn friction_over_path(&mut self, contact: &Contact, coefficient: f64, data: (&str, f64, &str)) -> f64 {
        let (name, slope, limit) = data;
        if contact.friction_path.is_empty() {
            return coefficient;
        }
        let steps = self.case.load_path.steps;
        let factor = |n: usize| FrictionPoint::at(&contact.friction_path, n as f64 / steps as f64);
        let at = |n: usize| coefficient * factor(n).max(NO_FRICTION);
        for n in 2..=steps {
            if at(n) != at(n - 1) {
                let law = numbers(&[at(n), slope]);
                let mut text = String::new();
                let _ = writeln!(text, "*CHANGE FRICTION, INTERACTION={name}\n*FRICTION{limit}\n{law}");
                self.history.change(n - 1, text);
            }
        }
        at(1)
    }
}
