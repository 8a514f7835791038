//! Which steps of MMA go too far.
//!
//! MMA accepts every design. Where its approximations are poor, as those of stresses, of sharp projections
//! and of contact often are, designs can leave the bounds with every step. A step that does so is judged as
//! in GCMMA, and so are those of the next iterations; all others are those of MMA.

use super::IterationRecord;
use super::functions::Values;

/// Violation that a step may leave behind, relative to the bound.
const ALLOWED: f64 = super::FEASIBLE;

/// Violation that a rise of the sharpness may add, relative to the bound.
const BROKEN: f64 = 0.3;

/// Smallest relative rise of the objective that counts.
const RISE: f64 = 1e-3;

/// Whether a step from the design `last` to one with these values leaves the bounds further, or raises the
/// objective between designs that meet them.
pub(super) fn goes_too_far(last: &IterationRecord, values: &Values) -> bool {
    too_far([last.violation, values.violation()], [last.objective, values.objective()])
}

/// Whether a rise of the sharpness alone makes the design `last` violate a bound so much further that
/// approximations there say little about the way back.
pub(super) fn breaks_bounds(last: &IterationRecord, values: &Values) -> bool {
    values.violation() > last.violation + BROKEN
}

/// The same for violations and objectives before and after the step.
fn too_far([before, after]: [f64; 2], objectives: [f64; 2]) -> bool {
    if after > ALLOWED {
        return after > before;
    }
    before <= ALLOWED && objectives[1] > objectives[0] + RISE * objectives[0].abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_that_go_too_far() {
        // towards the bounds, even if the objective rises
        assert!(!too_far([0.5, 0.2], [1.0, 3.0]) && !too_far([0.02, 0.009], [1.0, 3.0]));
        // away from them, even if it falls
        assert!(too_far([0.2, 0.3], [3.0, 1.0]) && too_far([0.0, 0.002], [3.0, 1.0]));
        // between designs that nearly meet them, the objective counts
        assert!(too_far([0.0009, 0.0], [1.0, 1.002]) && !too_far([0.0, 0.0009], [1.0, 1.0009]));
        assert!(too_far([0.0, 0.0], [-1.0, -0.998]) && !too_far([0.0, 0.0], [-1.0, -0.9995]));
    }
}
