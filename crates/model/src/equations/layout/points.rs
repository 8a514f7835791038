//! The points of the contact surfaces, and their relation to the nodes.

use crate::equations::dependent::Dependent;
use crate::equations::{ContactModel, NodeState};
use slipstick_mesh::ContactMap;
use std::borrow::Cow;

/// The points of the contact surfaces: x̂ = T x of the nodes' positions, [`ContactMap`].
#[derive(Debug, Clone)]
pub(in crate::equations) struct ContactPoints {
    /// T.
    pub map: ContactMap,
    /// Which coordinates of the points are prescribed; empty: those of the nodes.
    fixed: Vec<bool>,
}

impl ContactPoints {
    /// A point is prescribed along an axis if all nodes that it depends on are.
    pub fn new(map: ContactMap, dependent: &Dependent, fixed: &[bool]) -> Self {
        if map.is_identity() && dependent.is_empty() {
            return Self { map, fixed: Vec::new() };
        }
        let of_nodes = &dependent.point_is_fixed(fixed);
        let mut fixed = of_nodes.clone();
        for node in 0..of_nodes.len() / 3 {
            map.each(node as u32, |parent, _| {
                (0..3).for_each(|c| fixed[3 * node + c] &= of_nodes[3 * parent as usize + c]);
            });
        }
        Self { map, fixed }
    }
}

impl ContactModel {
    /// Current positions x̂ = T x of the points of the contact surfaces, [`ContactMap`].
    pub(crate) fn contact_positions(&self, y: &[f64]) -> Vec<f64> {
        let x = self.positions(y);
        if self.points.map.is_identity() { x } else { self.points.map.apply(&x) }
    }

    /// T v of a nodal vector, or of unknowns.
    pub(in crate::equations) fn contact_vector<'a>(&self, v: &'a [f64]) -> Cow<'a, [f64]> {
        if self.points.map.is_identity() { Cow::Borrowed(v) } else { Cow::Owned(self.points.map.apply(v)) }
    }

    /// Adds to `out` what `add` adds to the entries of the points of the contact surfaces: Tᵀ of it.
    pub(in crate::equations) fn add_from_contact(&self, out: &mut [f64], add: impl FnOnce(&mut [f64])) {
        if self.points.map.is_identity() {
            return add(out);
        }
        let mut part = vec![0.0; out.len()];
        add(&mut part);
        out.iter_mut().zip(self.points.map.apply_transposed(&part)).for_each(|(to, part)| *to += part);
    }

    /// Replaces derivatives with respect to the points of the contact surfaces by those with respect
    /// to the nodes.
    pub(in crate::equations) fn pull_to_nodes(&self, v: &mut Vec<f64>) {
        if !self.points.map.is_identity() {
            *v = self.points.map.apply_transposed(v);
        }
    }

    /// The nodes that the row of a slave node reaches.
    pub(in crate::equations) fn support_of<'a>(&self, node: Option<&'a NodeState>) -> Cow<'a, [u32]> {
        let support = node.map_or(&[][..], |node| &node.step.support);
        if self.points.map.is_identity() && self.dependent.is_empty() {
            return Cow::Borrowed(support);
        }
        let mut nodes = self.points.map.parents(support.iter().copied());
        self.dependent.add_sources(&mut nodes);
        Cow::Owned(nodes)
    }

    /// Which coordinates of the points of the contact surfaces are prescribed.
    pub fn contact_fixed(&self) -> &[bool] {
        if self.points.fixed.is_empty() { self.prescribed.fixed() } else { &self.points.fixed }
    }
}
