//! Friction work of pairs whose pressures change so much within load steps that the steps are coarse for it.
//!
//! `friction_work` takes the mean friction bound of each (sub-)step
//! ([`FrictionWork`](slipstick_design::quantity::FrictionWork)). With the work per pressure q and the changes of
//! pressure Δp of two consecutive steps, one step instead of both would change it by
//! D = ½ (Δp₂ q₁ − Δp₁ q₂), of which Richardson's extrapolation expects a third as the error of the two; as every
//! step counts in two such pairs, a sixth. A node that closes within a step slides without pressure for an
//! unknown part of it, half on average, and the error is that part of its work.
//! Test: `friction_of_coarse_steps_is_judged` (tests/suite/losses.rs).

use std::fmt;

use serde::Serialize;

use slipstick_design::quantity::FrictionStep;

use crate::equations::ContactModel;
use crate::losses::counted_parts;
use crate::words::quantity;

/// Friction work of a contact pair for which load steps are coarse: its error is about more than
/// [a fraction](crate::losses::COUNTED_LOSS) of what loads, supports and offsets do.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CoarseFriction {
    /// Number of the pair.
    pub pair: usize,
    /// Names of slave and master.
    pub surfaces: [String; 2],
    /// Its `friction_work`. \[F L\]
    pub work: f64,
    /// Estimate of its error, positive if the work is too large. \[F L\]
    pub error: f64,
    /// The error as a fraction of the work done on the bodies, as a sum of magnitudes over the steps.
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
            "load steps are coarse for the friction work of `{slave}` with `{master}`, {}: its error is about {}, \
             most of it at node {} of `{slave}`, [{x}, {y}, {z}]",
            quantity(self.work),
            quantity(self.error),
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

/// Estimates of the error of the friction work of every slave node since the start of the path.
#[derive(Debug, Default)]
pub(crate) struct CoarseSteps {
    /// \[F L\]
    errors: Vec<f64>,
    /// The last step of each node.
    last: Vec<FrictionStep>,
}

impl CoarseSteps {
    /// Estimated error of the friction work of all nodes. \[F L\]
    pub fn total(&self) -> f64 {
        self.errors.iter().sum()
    }

    /// Makes room for this many slave nodes.
    pub fn resize(&mut self, nodes: usize) {
        self.errors.resize(nodes, 0.0);
        self.last.resize(nodes, FrictionStep::default());
    }

    /// Adds a (sub-)step of a slave node, which was `apart` from the master at its start or not.
    pub fn add(&mut self, j: usize, step: FrictionStep, apart: bool) {
        let before = std::mem::replace(&mut self.last[j], step);
        let change = |step: FrictionStep| step.pressures[1] - step.pressures[0];
        self.errors[j] += match step.pressures {
            [0.0, now] if now > 0.0 && apart => 0.5 * step.work,
            [_, now] if now > 0.0 && before.pressures[1] > 0.0 => {
                (change(step) * before.rate - change(before) * step.rate) / 12.0
            }
            _ => 0.0,
        };
    }

    /// Pairs whose friction work, `work`, has an error of more than [a fraction](crate::losses::COUNTED_LOSS) of the
    /// work done on the bodies, `done`. \[F L\]
    pub fn reported(
        &self,
        model: &ContactModel,
        reference: &[[f64; 3]],
        work: &[f64],
        done: f64,
    ) -> Vec<CoarseFriction> {
        let interfaces = model.interfaces();
        let parts = counted_parts(&self.errors, model, done).filter(|part| !interfaces[part.pair].is_bonded());
        let found = parts.map(|part| CoarseFriction {
            pair: part.pair,
            surfaces: interfaces[part.pair].surfaces.clone(),
            work: work[part.pair],
            error: part.work,
            fraction: part.fraction,
            node: part.node,
            position: reference.get(part.node as usize).copied().unwrap_or_default(),
        });
        found.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pressure p = t and slip t² in 16 steps: ∫ p ds = 2/3, and the trapezoidal rule misses a part that is estimated.
    #[test]
    fn the_error_of_mean_pressures_is_estimated() {
        let steps = 16;
        let (mut coarse, mut work) = (CoarseSteps::default(), 0.0);
        coarse.resize(1);
        for n in 0..steps {
            let [from, to] = [n, n + 1].map(|n| f64::from(n) / f64::from(steps));
            let rate = to * to - from * from;
            let step = FrictionStep { work: 0.5 * (from + to) * rate, pressures: [from, to], rate };
            work += step.work;
            coarse.add(0, step, false);
        }
        let error = work - 2.0 / 3.0;
        assert!(error < 0.0 && (coarse.errors[0] / error - 1.0).abs() < 0.1, "{} for {error}", coarse.errors[0]);
    }
}
