//! Prescribed rotations move a node by an amount that depends on its reference position.

use super::{Entry, Prescribed, What};
use crate::equations::LoadTime;
use nalgebra::{Rotation3, Unit, Vector3};

impl Prescribed {
    /// The same motions of nodes at other reference positions, three entries each.
    pub(in crate::equations) fn at_positions(&self, x: &[f64]) -> Self {
        let mut out = self.clone();
        for Entry { dof, what, .. } in &mut out.entries {
            if let What::Position(place) = what {
                *place = std::array::from_fn(|c| x[*dof as usize / 3 * 3 + c]);
            }
        }
        out
    }

    /// Adds (∂d/∂X)ᵀ μ at a time: with the rotation R, d = (R − 1)(X − p) + u.
    pub(in crate::equations) fn pull_back_positions(
        &self,
        LoadTime { case, t: time }: LoadTime,
        by_prescribed: &[f64],
        out: &mut [f64],
    ) {
        for &Entry { dof, component, motion, what } in &self.entries {
            let (moved, own) = (&self.motions[motion as usize], self.cases[motion as usize]);
            let (What::Position(_), Some(axis), true) = (what, moved.rotation, own.is_none_or(|own| own == case))
            else {
                continue;
            };
            let direction = Unit::new_normalize(Vector3::from(axis.direction));
            let rotation = Rotation3::from_axis_angle(&direction, moved.at(time).1.to_radians());
            let (node, c) = (dof as usize / 3, usize::from(component));
            for b in 0..3 {
                let slope = rotation[(c, b)] - f64::from(u8::from(c == b));
                out[3 * node + b] += slope * by_prescribed[dof as usize];
            }
        }
    }
}
