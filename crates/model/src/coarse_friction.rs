//! Friction work of pairs whose pressures change so much within load steps that the steps are coarse for it.
//!
//! `friction_work` is Σ_j ζ_τj·ũ_τj over the (sub-)steps, with the tractions at the end of each: it converges
//! with the first order of the step. Coulomb's law bounds these tractions by the pressure, so that the mean of
//! the pressures at both ends of a step, instead of the last, gives a better value,
//! Σ_j ½ (1 + ζ_nj,n−1/ζ_nj) ζ_τj·ũ_τj, and Σ_j ½ ζ_τj,n−1·ũ_τj at nodes that open. The difference of the two
//! estimates the error.
//! Test: `friction_of_coarse_steps_is_judged` (tests/suite/losses.rs).

use std::fmt;

use serde::Serialize;

use crate::equations::{ContactModel, NodalContact};
use crate::losses::counted_parts;
use crate::words::quantity;

/// Friction work of a contact pair for which load steps are coarse: the mean pressure changes it by more than
/// [a fraction](crate::losses::COUNTED_LOSS) of what loads, supports and offsets do.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CoarseFriction {
    /// Number of the pair.
    pub pair: usize,
    /// Names of slave and master.
    pub surfaces: [String; 2],
    /// Its `friction_work`. \[F L\]
    pub work: f64,
    /// The same with the mean pressure of each step. \[F L\]
    pub with_mean_pressure: f64,
    /// The difference as a fraction of the work done on the bodies, as a sum of magnitudes over the steps.
    pub fraction: f64,
    /// Slave node with the largest part of it.
    pub node: u32,
    /// Position of that node in the reference configuration. \[L\]
    pub position: [f64; 3],
}

impl fmt::Display for CoarseFriction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [slave, master] = &self.surfaces;
        let [x, y, z] = self.position.map(quantity);
        write!(
            f,
            "load steps are coarse for the friction work of `{slave}` with `{master}`, {}: the mean pressure of each \
             step, instead of that at its end, gives {}; they differ most at node {} of `{slave}`, [{x}, {y}, {z}]",
            quantity(self.work),
            quantity(self.with_mean_pressure),
            self.node,
        )
    }
}

impl CoarseFriction {
    /// The remedy.
    pub fn help(&self) -> String {
        "use more load steps (`load_path.steps`) if you need this work or the energy balance".into()
    }
}

/// What the mean pressure takes from the friction work of every slave node since the start of the path.
/// \[F L\]
#[derive(Debug, Default)]
pub(crate) struct CoarseSteps {
    nodes: Vec<f64>,
}

impl CoarseSteps {
    /// Adds a (sub-)step between two neighbouring states of all slave nodes.
    pub fn add(&mut self, before: &[NodalContact], now: &[NodalContact]) {
        self.nodes.resize(now.len(), 0.0);
        let work = |tractions: &NodalContact, at: &NodalContact| {
            tractions.multiplier[1] * at.weighted_slip[0] + tractions.multiplier[2] * at.weighted_slip[1]
        };
        for ((sum, old), at) in self.nodes.iter_mut().zip(before).zip(now) {
            let [earlier, pressure] = [old, at].map(|at| if at.status as u8 == 0 { 0.0 } else { at.multiplier[0] });
            *sum += match pressure > 0.0 {
                true => 0.5 * (1.0 - earlier.max(0.0) / pressure) * work(at, at),
                // opened: it has no traction now
                false if earlier > 0.0 => -0.5 * work(old, at).max(0.0),
                false => 0.0,
            };
        }
    }

    /// Pairs whose friction work, `work`, changes by more than [a fraction](crate::losses::COUNTED_LOSS) of the work done on
    /// the bodies. \[F L\]
    pub fn reported(
        &self,
        model: &ContactModel,
        reference: &[[f64; 3]],
        work: &[f64],
        done: f64,
    ) -> Vec<CoarseFriction> {
        let interfaces = model.interfaces();
        let parts = counted_parts(&self.nodes, model, done).filter(|part| !interfaces[part.pair].is_bonded());
        let found = parts.map(|part| CoarseFriction {
            pair: part.pair,
            surfaces: interfaces[part.pair].surfaces.clone(),
            work: work[part.pair],
            with_mean_pressure: work[part.pair] - part.work,
            fraction: part.fraction,
            node: part.node,
            position: reference.get(part.node as usize).copied().unwrap_or_default(),
        });
        found.collect()
    }
}
