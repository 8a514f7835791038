//! The energy that pressures at integration points store.

use crate::equations::{ContactModel, Design, ModelInterface};
use slipstick_contact::enforcement::soft::Weight;
use slipstick_contact::kinematics::NodeKinematics;
use slipstick_path::LoadTime;
use std::iter::repeat_n;

/// Derivatives of an energy with respect to the positions of points of the contact surfaces. \[F\]
pub(crate) type ByPoint = Vec<(u32, [f64; 3])>;

impl Design {
    /// ∂E_j/∂x at unknowns `y`, with E_j = ∫ N_j w(g) dA of every slave node j and the energy per area w that the
    /// pressure at the points stores; empty for nodes of other pairs, and if the state cannot be evaluated. \[F\]
    ///
    /// Test: `points_that_dig_in_lose_work` (tests/suite/losses.rs).
    pub(crate) fn stored_slopes(&self, y: &[f64], time: LoadTime) -> Vec<ByPoint> {
        let model = &*self.model;
        let offsets = model.point_offsets(time, false);
        if offsets.is_empty() {
            return Vec::new();
        }
        let x = model.contact_positions(&y[..model.displacement_count()]);
        let pairs = model.by_pair(&offsets).zip(model.interfaces());
        let rows = pairs.flat_map(|(offsets, pair)| match model.stored_rows(pair, &x, offsets) {
            Some(rows) => rows.iter().map(by_point).collect(),
            None => repeat_n(ByPoint::new(), offsets.len()).collect::<Vec<_>>(),
        });
        let scaled = rows.zip(&self.stiffness).zip(&model.slaves).map(|((mut row, stiffness), slave)| {
            // the law of a stiffness of 1
            if model.pair(slave).pressure.is_none() {
                row.iter_mut().for_each(|(_, slope)| slope.iter_mut().for_each(|s| *s *= stiffness.normal));
            }
            row
        });
        scaled.collect()
    }
}

impl ContactModel {
    /// The rows of a pair whose loads are the energies around the slave nodes.
    fn stored_rows(&self, pair: &ModelInterface, x: &[f64], offsets: &[f64]) -> Option<Vec<NodeKinematics>> {
        let weight = Weight::Energy(pair.point_law()?);
        let (mut workspace, mut rows) = (pair.interface.workspace(|_| true), Vec::new());
        pair.interface.evaluate_pressed(x, true, Some((weight, offsets)), &mut workspace, &mut rows).ok()?;
        Some(rows)
    }
}

fn by_point(row: &NodeKinematics) -> ByPoint {
    let slopes = row.pressed.iter().flat_map(|pressed| pressed.load_gradient.chunks_exact(3));
    let points = row.support.iter().zip(slopes).map(|(&point, slope)| (point, [slope[0], slope[1], slope[2]]));
    points.filter(|(_, slope)| *slope != [0.0; 3]).collect()
}
