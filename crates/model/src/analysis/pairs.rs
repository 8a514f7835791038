//! Total force and peak pressure of a contact pair.

use crate::equations::{ContactModel, ContactResults, ModelInterface, NodalContact};
use serde::Serialize;

/// Total force and peak pressure of a contact pair at a state.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct PairResult {
    /// Resultant of the contact forces on the slave, friction included; the master has the opposite
    /// one. Zero for a surface that touches itself, which is both. \[F\]
    pub force: [f64; 3],
    /// Largest contact pressure of the pair at a slave node, nodal force over nodal area, ≥ 0. \[F/L²\]
    pub peak_pressure: f64,
    /// The node with this pressure; `None` if no node is under pressure.
    pub peak_node: Option<u32>,
}

impl PairResult {
    /// Magnitude of the resultant. \[F\]
    pub fn force_size(&self) -> f64 {
        self.force.iter().map(|f| f * f).sum::<f64>().sqrt()
    }
}

/// Total force and peak pressure of each pair.
///
/// A node's multiplier acts on the slave with −b_js z_j over its row, and the slave part of the row
/// sums up to the covered area A_j, so that the resultant is −Σ_j A_j z_j. Paper: (17), (43). Test:
/// `forces_balance` (tests/suite/invariance.rs).
pub fn pair_results(model: &ContactModel, results: &ContactResults) -> Vec<PairResult> {
    let of = |(i, (nodes, interface)): (usize, (&[NodalContact], &ModelInterface))| {
        let (peak_pressure, peak_node) = results.peaks.get(i).copied().unwrap_or_default();
        let mut force = [0.0; 3];
        for at in nodes.iter().filter(|_| !interface.interface.is_with_itself()) {
            (0..3).for_each(|c| force[c] -= at.covered_area * at.global_multiplier[c]);
        }
        PairResult { force, peak_pressure, peak_node }
    };
    model.by_pair(&results.nodes).zip(model.interfaces()).enumerate().map(of).collect()
}
