//! Work dissipated by friction.

use super::{ContactNode, Dimension, Patch, Quantity, Reads, StateDerivative, StateView};

/// Work that friction dissipates on a patch, summed over all (sub-)steps since the start of the load case.
/// \[F L\]
///
/// In a step, a node in contact dissipates ½ (1 + r) ζ_τ·ũ_τ with r = μ_before ζ_n,before/(μ ζ_n): slip happens at the
/// friction bound, and the trapezoidal rule takes the mean bound of the step. r counts from 0 to 3, and a node that
/// opens dissipates nothing in that step: pressures that vanish in a jump to another equilibrium do no friction work.
/// Under a bound on the shear stress, which may hold at constant traction, and on ties, the traction at the end of the
/// step counts. ũ_τ is the objective slip increment of the paper, (24), which depends on the previous state. Tests:
/// `pair_quantities_by_hand`, `friction_of_coarse_steps_is_judged` (tests/suite/losses.rs).
#[derive(Clone, Debug)]
pub struct FrictionWork {
    name: String,
    patch: Patch,
}

impl FrictionWork {
    /// The work dissipated on a patch.
    pub fn new(name: impl Into<String>, patch: Patch) -> Self {
        Self { name: name.into(), patch }
    }
}

impl Quantity for FrictionWork {
    fn name(&self) -> &str {
        &self.name
    }

    fn dimension(&self) -> Dimension {
        Dimension::WORK
    }

    fn reads(&self) -> Reads {
        Reads { contact: true, previous: true, ..Reads::default() }
    }

    fn accumulates(&self) -> bool {
        true
    }

    fn needs_contact(&self) -> bool {
        true
    }

    fn value(&self, state: &StateView) -> f64 {
        self.patch.of(state.contact).map(|(j, at)| FrictionStep::of(at, before(state, j)).work).sum()
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        for (j, at) in self.patch.of(state.contact).filter(|(_, at)| at.status.is_closed()) {
            let old = before(state, j)[0];
            let (mean, work) = (mean_pressure(at, old), along(at.multiplier, at.slip));
            for c in 0..2 {
                to.contact[j].multiplier[1 + c] += weight * mean * at.slip[c];
                to.contact[j].slip[c] += weight * mean * at.multiplier[1 + c];
            }
            let ratio = ratio(at, old);
            if at.follows_pressure && ratio > 0.0 && ratio < MOST {
                let by_ratio = 0.5 * weight * work / at.multiplier[0];
                to.contact[j].multiplier[0] -= by_ratio * ratio;
                to.previous.multiplier[j][0] += by_ratio * at.friction_ratio;
            }
        }
    }
}

/// Largest ratio of the friction bounds at the start and the end of a step that counts.
const MOST: f64 = 3.0;

/// ζ of a slave node at the start of the step.
fn before(state: &StateView, j: usize) -> [f64; 3] {
    state.previous.multiplier.get(j).copied().unwrap_or_default()
}

/// Friction at a slave node in a (sub-)step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrictionStep {
    /// Work that it dissipates. \[F L\]
    pub work: f64,
    /// Pressures at the start, with the coefficient of friction at the end, and at the end; 0 at an open node.
    /// \[F/L²\]
    pub pressures: [f64; 2],
    /// Work per pressure, of a traction that follows the pressure; 0 if it does not. \[L³\]
    pub rate: f64,
}

impl FrictionStep {
    /// From the state at the end of the step, and the multiplier at its start.
    pub fn of(at: &ContactNode, before: [f64; 3]) -> Self {
        let pressures = [(at.friction_ratio * before[0]).max(0.0), at.pressure().max(0.0)];
        if !at.status.is_closed() {
            return Self { work: 0.0, pressures, rate: 0.0 };
        }
        let work = along(at.multiplier, at.slip);
        let rate = if at.follows_pressure && at.multiplier[0] > 0.0 { work / at.multiplier[0] } else { 0.0 };
        Self { work: mean_pressure(at, before[0]) * work, pressures, rate }
    }
}

/// ζ_τ·ũ_τ.
fn along(multiplier: [f64; 3], slip: [f64; 2]) -> f64 {
    multiplier[1] * slip[0] + multiplier[2] * slip[1]
}

/// The friction bound at the start of a step over that at its end, from 0 to the largest that counts.
fn ratio(at: &ContactNode, before: f64) -> f64 {
    if at.multiplier[0] > 0.0 { (at.friction_ratio * before / at.multiplier[0]).clamp(0.0, MOST) } else { 1.0 }
}

/// The mean bound of a step over that at its end.
fn mean_pressure(at: &ContactNode, before: f64) -> f64 {
    if at.follows_pressure { 0.5 * (1.0 + ratio(at, before)) } else { 1.0 }
}
