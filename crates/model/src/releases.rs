//! Stored energy that disappears in a load step although neither loads and supports nor friction take it.
//!
//! Work is summed over the accepted (sub-)steps by the trapezoidal rule, so a difference is either its error, where the
//! step is too large for it, or a jump to another equilibrium, in which real bodies would swing: a snap, or a coarse
//! ball that rolls off its node. More load steps show which: they cure the first.
//! [`crate::losses`] judges what contact takes while it is closed, which does not depend on the steps.
//! Test: `a_coarse_ball_that_rolls_off_its_node_releases_energy` (tests/suite/losses.rs).

use crate::equations::{ContactModel, NodalContact};
use crate::words::quantity;
use serde::Serialize;
use std::fmt;

/// Part of the largest stored energy so far above which a release in one step is reported.
pub const COUNTED_RELEASE: f64 = 0.1;

/// The largest release of stored energy in a load step, if it is more than [a fraction](COUNTED_RELEASE) of the largest
/// stored energy before.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReleasedEnergy {
    /// The load step, counted through all load cases.
    pub step: usize,
    /// Energy that disappears. \[F L\]
    pub energy: f64,
    /// The same as a fraction of the largest stored energy before.
    pub fraction: f64,
    /// Number of the contact pair whose force changes most at a node.
    pub pair: usize,
    /// Names of slave and master.
    pub surfaces: [String; 2],
    /// That node.
    pub node: u32,
    /// Its position in the reference configuration. \[L\]
    pub position: [f64; 3],
}

impl fmt::Display for ReleasedEnergy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [slave, master] = &self.surfaces;
        let [x, y, z] = self.position.map(quantity);
        write!(
            f,
            "in load step {}, stored energy of {} disappears, {:.0} % of the largest so far, which neither the work of \
             loads and supports nor friction accounts for; contact of `{slave}` with `{master}` changes most at node \
             {} of `{slave}`, [{x}, {y}, {z}]: the bodies jump to another equilibrium, or the step is too large",
            self.step,
            quantity(self.energy),
            100.0 * self.fraction,
            self.node,
        )
    }
}

impl ReleasedEnergy {
    /// The remedy.
    pub fn help(&self) -> String {
        "use more load steps (`load_path.steps`): what still disappears is a jump; where a curved surface of few facets \
         rolls or slides off its nodes, refine it"
            .into()
    }

    /// What is released from a state with the stored energy `before` to one with `now`, between which loads, supports
    /// and offsets do the work `done` and friction and the like take `taken`; `largest` is the largest stored energy so
    /// far. Not where the stored energy rises: the trapezoidal rule is least accurate where contact begins. \[F L\]
    pub(crate) fn between(
        model: &ContactModel,
        reference: &[[f64; 3]],
        step: usize,
        [before, now, largest]: [f64; 3],
        [done, taken]: [f64; 2],
        [old, new]: [&[NodalContact]; 2],
    ) -> Option<Self> {
        let energy = before - now + done - taken;
        if now >= before || !(energy > COUNTED_RELEASE * largest) || old.len() != new.len() {
            return None;
        }
        let force = |at: &NodalContact| at.covered_area * at.multiplier[0];
        let changes: Vec<f64> = old.iter().zip(new).map(|(old, new)| (force(old) - force(new)).abs()).collect();
        let pairs = model.by_pair(&changes).zip(model.interfaces()).enumerate();
        let largest_of = |(pair, (changes, of)): (usize, (&[f64], _))| {
            let at = (0..changes.len()).max_by(|&a, &b| changes[a].total_cmp(&changes[b]))?;
            Some((changes[at], pair, at, of))
        };
        let found = pairs.filter_map(largest_of).max_by(|a, b| a.0.total_cmp(&b.0));
        let (_, pair, at, of) = found.filter(|(change, ..)| *change > 0.0)?;
        let node = of.interface.slave_nodes().get(at)?.node;
        Some(Self {
            step,
            energy,
            fraction: energy / largest,
            pair,
            surfaces: of.surfaces.clone(),
            node,
            position: reference.get(node as usize).copied().unwrap_or_default(),
        })
    }
}
