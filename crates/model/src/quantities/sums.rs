//! What the quantities of a path sum up since the start of a load case.

use std::sync::Arc;

use slipstick_design::quantity::{FrictionStep, Quantity};
use slipstick_mesh::Mesh;
use slipstick_path::{LoadTime, StepState};

use super::{Quantities, Slipped};
use crate::coarse_friction::CoarseSteps;
use crate::equations::{ByPoint, ContactModel, ContactResults, NodalContact};
use crate::losses::{ContactAt, Losses};

/// Work since the start of the load case. \[F L\]
#[derive(Debug, Default)]
pub(super) struct Sums {
    pub external: f64,
    pub offset: f64,
    pub thermal: f64,
    pub viscous: f64,
    pub holding: f64,
    /// Largest stored energy before the last state.
    pub largest: f64,
    pub contact: f64,
    /// Of each pair.
    pub friction: Vec<f64>,
    /// Of the case's own quantities that accumulate; the others are 0.
    pub own: Vec<f64>,
    /// As [`QuantityRow::slipped`].
    pub slipped: Vec<Slipped>,
    /// Sum of the magnitudes of the work of loads, supports and offsets in each (sub-)step.
    pub done: f64,
    pub lost: Losses,
    pub coarse: CoarseSteps,
    /// A state since then could not be evaluated.
    pub broken: bool,
}

impl Sums {
    /// Adds what the load case lost, or is coarse for, to the pairs that are reported, or replaces a smaller
    /// finding. Returns the part of `energy_balance` that these findings account for. \[F L\]
    pub fn report(&self, mesh: &Mesh, model: &ContactModel, to: &mut Quantities) -> f64 {
        let lost = self.lost.reported(model, &mesh.nodes, self.done);
        let losses: f64 = lost.iter().map(|loss| loss.work).sum();
        keep_largest(&mut to.losses, lost, |loss| (loss.pair, loss.fraction));
        let coarse = self.coarse.reported(model, &mesh.nodes, &self.friction, self.done);
        let errors: f64 = coarse.iter().map(|work| work.error).sum();
        keep_largest(&mut to.coarse_friction, coarse, |work| (work.pair, work.fraction));
        losses - errors
    }

    pub fn add_own(&mut self, own: &[Arc<dyn Quantity>], values: &[f64]) {
        for ((sum, quantity), value) in self.own.iter_mut().zip(own).zip(values) {
            *sum += if quantity.accumulates() { *value } else { 0.0 };
        }
    }

    pub fn add(
        &mut self,
        model: &ContactModel,
        (before, earlier, old): (&StepState, LoadTime, &ContactResults),
        (now, time, contact): (&StepState, LoadTime, &ContactResults),
        [earlier_stored, stored]: [&[ByPoint]; 2],
    ) {
        let [from, to] = [before, now].map(|state| model.contact_positions(&state.unknowns));
        self.lost.add(
            model,
            &ContactAt { positions: &from, results: old, time: earlier, stored: earlier_stored },
            &ContactAt { positions: &to, results: contact, time, stored },
        );
        for (i, (old, new)) in old.force.iter().zip(&contact.force).enumerate() {
            self.contact -= (old + new) * 0.5 * (now.unknowns[i] - before.unknowns[i]);
        }
    }

    /// Adds the slip of a (sub-)step, and the work that friction dissipates at each slave node.
    pub fn add_friction(
        &mut self,
        model: &ContactModel,
        [before, nodes]: [&[NodalContact]; 2],
        steps: impl Iterator<Item = FrictionStep>,
    ) {
        if self.slipped.is_empty() {
            self.slipped = model.slave_areas().map(|area| Slipped { area, ..Slipped::default() }).collect();
        }
        // where the master hardly covers a tie, it slips elastically, which dissipates nothing
        let bonded = model.by_pair(nodes).zip(model.interfaces());
        let bonded = bonded.flat_map(|(nodes, pair)| std::iter::repeat_n(pair.is_bonded(), nodes.len()));
        self.coarse.resize(nodes.len());
        let all = self.slipped.iter_mut().zip(nodes).zip(steps).zip(bonded).enumerate();
        for (j, (((slipped, at), step), _)) in all.filter(|(_, (_, bonded))| !bonded) {
            if at.status.is_closed() {
                slipped.distance += at.slip[0].hypot(at.slip[1]);
            }
            slipped.work += step.work;
            let slid = at.weighted_slip[0].hypot(at.weighted_slip[1]);
            let apart = before.get(j).is_none_or(|old| old.gap.is_none() || old.weighted_gap > 1e-6 * slid);
            self.coarse.add(j, step, apart);
        }
        self.friction = model.by_pair(&self.slipped).map(|nodes| nodes.iter().map(|node| node.work).sum()).collect();
    }
}

/// Adds findings of pairs to those known; of the same pair, the one with the larger fraction stays. `of` gives
/// pair and fraction.
fn keep_largest<T>(known: &mut Vec<T>, found: Vec<T>, of: impl Fn(&T) -> (usize, f64)) {
    for new in found {
        match known.iter_mut().find(|old| of(old).0 == of(&new).0) {
            Some(old) if of(old).1.abs() < of(&new).1.abs() => *old = new,
            Some(_) => {}
            None => known.push(new),
        }
    }
}
