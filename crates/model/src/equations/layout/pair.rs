//! A contact pair: its geometry, and how its surfaces interact along the load path.

use crate::equations::{Enforcement, LoadTime};
use schemars::JsonSchema;
use serde::Serialize;
use slipstick_contact::enforcement::soft::PressureLaw;
use slipstick_contact::friction::Friction;
use slipstick_contact::kinematics::NodeKinematics;
use slipstick_contact::{ContactInterface, InterfaceError};
use std::sync::Arc;

/// An interface with the data that the model adds to its geometry.
#[derive(Debug, Clone)]
pub struct ModelInterface {
    /// Names of the slave and the master surface.
    pub surfaces: [String; 2],
    /// Geometry.
    pub interface: ContactInterface,
    /// Coefficient of friction μ.
    pub friction: f64,
    /// Factors on μ along the load path; empty: 1.
    pub friction_path: Vec<FrictionPoint>,
    /// Largest shear stress that friction transmits; infinite: no bound. \[F/L²\]
    pub shear_limit: f64,
    /// Distance by which the surfaces touch before their meshes do, along the load path.
    pub offset: Vec<OffsetPoint>,
    /// For each slave node, the mean gap between surfaces at unit distance
    /// ([`ContactInterface::slants`]); empty: 1.
    pub slants: Vec<f64>,
    /// For each slave node, the initial gap between the offset surfaces that counts as closed; empty:
    /// none does. \[L\]
    pub adjusted: Vec<f64>,
    /// Pseudo-times from and to which the surfaces interact.
    pub active: [f64; 2],
    /// The fixed mortar rows of bonded surfaces; `None`: the surfaces may separate and slide.
    pub bond: Option<Arc<Vec<NodeKinematics>>>,
    /// Fraction of the area around a slave node below which its contact condition is compliant,
    /// [`compliance`](slipstick_contact::enforcement::NodeMeasures::compliance).
    pub edge_cover: f64,
    /// How contact and friction are enforced.
    pub enforcement: Enforcement,
    /// The pressure of the penalty method; `None`: in proportion to the penetration.
    pub pressure: Option<PressureLaw>,
    /// Whether this pressure depends on the gap at each integration point, not on the mean gap of a node.
    pub at_points: bool,
}

/// A waypoint of the offset of a contact pair.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct OffsetPoint {
    /// Pseudo-time, 0 ≤ t ≤ 1, increasing.
    pub t: f64,
    /// Distance by which the surfaces touch before their meshes do; below 0, the meshes may overlap
    /// by this much before they touch. \[L\]
    pub offset: f64,
}

impl OffsetPoint {
    /// The offset at a pseudo-time: linear between the waypoints, from 0 at t = 0 if the first is
    /// later, and constant after the last. \[L\]
    pub fn at(points: &[Self], t: f64) -> f64 {
        let mut last = Self { t: 0.0, offset: 0.0 };
        for &next in points {
            if t < next.t {
                return last.offset + (t - last.t) / (next.t - last.t) * (next.offset - last.offset);
            }
            last = next;
        }
        last.offset
    }
}

/// A waypoint of the factor on the coefficient of friction of a contact pair.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct FrictionPoint {
    /// Pseudo-time, 0 ≤ t ≤ 1, increasing.
    pub t: f64,
    /// Factor ≥ 0.
    pub factor: f64,
}

impl FrictionPoint {
    /// The factor at a pseudo-time: linear between the waypoints, constant before and after them, and 1
    /// without any.
    pub fn at(points: &[Self], t: f64) -> f64 {
        let next = points.partition_point(|point| point.t <= t);
        match (next.checked_sub(1).and_then(|last| points.get(last)), points.get(next)) {
            (Some(last), Some(next)) => last.factor + (t - last.t) / (next.t - last.t) * (next.factor - last.factor),
            (Some(only), None) | (None, Some(only)) => only.factor,
            (None, None) => 1.0,
        }
    }
}

/// Pseudo-times that differ by less are equal.
const SAME_TIME: f64 = 1e-12;

impl ModelInterface {
    /// The rows of a bond, at the reference `coordinates` (3 per node).
    ///
    /// # Errors
    /// If the surfaces are folded.
    pub fn bond_of(interface: &ContactInterface, coordinates: &[f64]) -> Result<Vec<NodeKinematics>, InterfaceError> {
        let mut rows = Vec::new();
        interface.evaluate(coordinates, false, &mut interface.workspace(|_| true), &mut rows)?;
        Ok(rows)
    }

    /// For each slave node, the gap at the reference `coordinates` (3 per node) between surfaces with
    /// this offset, if there is one; negative: penetration. \[L\]
    ///
    /// # Errors
    /// If the surfaces are folded.
    pub fn gaps_of(
        interface: &ContactInterface,
        coordinates: &[f64],
        offset: f64,
        slants: &[f64],
    ) -> Result<Vec<Option<f64>>, InterfaceError> {
        let rows = Self::bond_of(interface, coordinates)?;
        let offset = |j: usize| offset * slants.get(j).unwrap_or(&1.0);
        let gap = |(j, row): (usize, &NodeKinematics)| (row.area > 0.0).then(|| row.gap() / row.area - offset(j));
        Ok(rows.iter().enumerate().map(gap).collect())
    }

    /// The law of the pressure at each integration point, if there is one.
    pub(in crate::equations) fn point_law(&self) -> Option<&PressureLaw> {
        self.at_points.then(|| self.pressure.as_ref().unwrap_or(&PressureLaw::Proportional))
    }

    /// Whether the surfaces are bonded.
    pub fn is_bonded(&self) -> bool {
        self.bond.is_some()
    }

    /// Coulomb's law with the bound of the shear stress, in a load step that ends at a time.
    pub(in crate::equations) fn law(&self, time: LoadTime) -> Friction {
        Friction { coefficient: self.friction * self.friction_factor(time), shear_limit: self.shear_limit }
    }

    /// The factor on the coefficient of friction at a time, [`FrictionPoint::at`].
    pub(in crate::equations) fn friction_factor(&self, time: LoadTime) -> f64 {
        FrictionPoint::at(&self.friction_path, time.t)
    }

    /// The offset at a time, [`OffsetPoint::at`]. \[L\]
    pub fn offset_at(&self, time: LoadTime) -> f64 {
        OffsetPoint::at(&self.offset, time.t)
    }

    /// Whether the surfaces interact in a load step that ends at a time, and, if they do from the start,
    /// at rest.
    pub(crate) fn is_active(&self, LoadTime { t, .. }: LoadTime) -> bool {
        let [from, to] = self.active;
        (from == 0.0 || t > from + SAME_TIME) && t <= to + SAME_TIME
    }
}

#[cfg(test)]
mod tests {
    use super::FrictionPoint;

    #[test]
    fn factors_are_linear_between_waypoints_and_constant_outside() {
        let path = [FrictionPoint { t: 0.25, factor: 2.0 }, FrictionPoint { t: 0.75, factor: 4.0 }];
        let found = [0.0, 0.25, 0.5, 0.75, 1.0].map(|t| FrictionPoint::at(&path, t));
        assert_eq!(found, [2.0, 2.0, 3.0, 4.0, 4.0]);
        assert_eq!(FrictionPoint::at(&[], 0.5), 1.0);
    }
}
