//! Compares an objective's derivatives with finite differences of its values.

use super::{Objective, StateDerivative, StateView};

/// Largest error of a directional derivative, relative to the size of the derivatives along the direction.
const TOLERANCE: f64 = 1e-6;

/// Steps of the differences, relative to the size of the varied argument: one of them must agree.
const STEPS: [f64; 4] = [1e-2, 1e-3, 1e-4, 1e-5];

/// Directions per argument.
const DIRECTIONS: u64 = 3;

/// An objective whose derivative does not match its value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "objective `{name}` at step {step}: its derivative with respect to the {argument} is {derivative:e} along a \
     direction in which differences of its value give {difference:e}; correct Objective::derivative, which adds ∂θ/∂d \
     at fixed forces and ∂θ/∂f at fixed displacements"
)]
pub struct WrongDerivative {
    /// The objective's name.
    pub name: String,
    /// User load step, from 1.
    pub step: usize,
    /// The varied argument: "displacements", "internal forces" or "external forces".
    pub argument: &'static str,
    /// Derivative along the direction, from [`Objective::derivative`].
    pub derivative: f64,
    /// Derivative along the direction, from [`Objective::value`]; the closest of several steps.
    pub difference: f64,
}

/// Compares [`Objective::derivative`] at a state with central differences (of order 4) of [`Objective::value`], with
/// respect to displacements, internal forces and, if there are any, external forces, along a few random directions.
///
/// The state should be a general one: if all displacements or forces are zero, an objective may have a kink, and there
/// is no scale for the steps.
///
/// # Errors
/// [`WrongDerivative`] for the first direction that no step size makes agree to 1e-6.
pub fn check_derivatives(objective: &dyn Objective, state: &StateView) -> Result<(), WrongDerivative> {
    let n = state.displacement.len();
    let [mut by_displacement, mut by_internal, mut by_external] = std::array::from_fn(|_| vec![0.0; n]);
    objective.derivative(
        state,
        &mut StateDerivative {
            displacement: &mut by_displacement,
            internal_force: &mut by_internal,
            external_force: &mut by_external,
        },
    );
    let wrong = |argument| {
        move |(derivative, difference)| WrongDerivative {
            name: objective.name().into(),
            step: state.step,
            argument,
            derivative,
            difference,
        }
    };
    let by = |d: &[f64]| objective.value(&StateView { displacement: d, ..*state });
    compare(state.displacement, &by_displacement, by).map_err(wrong("displacements"))?;
    let by = |f: &[f64]| objective.value(&StateView { internal_force: f, ..*state });
    compare(state.internal_force, &by_internal, by).map_err(wrong("internal forces"))?;
    if state.external_force.iter().all(|&f| f == 0.0) {
        return Ok(());
    }
    let by = |f: &[f64]| objective.value(&StateView { external_force: f, ..*state });
    compare(state.external_force, &by_external, by).map_err(wrong("external forces"))
}

/// Derivative and closest difference of the first direction that disagrees.
fn compare(at: &[f64], gradient: &[f64], value: impl Fn(&[f64]) -> f64) -> Result<(), (f64, f64)> {
    let largest = at.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
    let size = if largest > 0.0 { largest } else { 1.0 };
    for seed in 0..DIRECTIONS {
        let direction = direction(at.len(), seed);
        let derivative: f64 = gradient.iter().zip(&direction).map(|(g, v)| g * v).sum();
        let scale: f64 = gradient.iter().zip(&direction).map(|(g, v)| (g * v).abs()).sum();
        let along = |step: f64| {
            let moved: Vec<f64> = at.iter().zip(&direction).map(|(x, v)| x + step * v).collect();
            value(&moved)
        };
        let (mut nearest, mut error) = (f64::NAN, f64::INFINITY);
        for h in STEPS.map(|step| step * size) {
            let difference = (8.0 * (along(h) - along(-h)) - (along(2.0 * h) - along(-2.0 * h))) / (12.0 * h);
            // below the resolution of differences of values of this size
            let round_off = 10.0 * f64::EPSILON * along(0.0).abs() / h;
            let beyond = (difference - derivative).abs() - round_off;
            // NaN stays NaN
            let off = if beyond <= 0.0 { 0.0 } else { beyond / scale.max(f64::MIN_POSITIVE) };
            if nearest.is_nan() || off < error {
                (nearest, error) = (difference, off);
            }
        }
        if !(error <= TOLERANCE) {
            return Err((derivative, nearest));
        }
    }
    Ok(())
}

/// Entries between −1 and 1, the same on every machine (Knuth's linear congruential generator).
fn direction(length: usize, seed: u64) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0xD1B5_4A32_D192_ED03;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    (0..length).map(|_| next()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::objective::{ContactForce, ObservedSteps, ReactionForce};

    /// θ = ½ Σ (d·f)², with a factor by which its derivatives are wrong.
    struct Work {
        by_displacement: f64,
        by_force: f64,
    }

    impl Objective for Work {
        fn name(&self) -> &str {
            "work"
        }

        fn observes(&self, _: usize, _: usize) -> bool {
            true
        }

        fn value(&self, state: &StateView) -> f64 {
            state.displacement.iter().zip(state.internal_force).map(|(d, f)| 0.5 * (d * f) * (d * f)).sum()
        }

        fn derivative(&self, state: &StateView, derivative: &mut StateDerivative) {
            for (i, (d, f)) in state.displacement.iter().zip(state.internal_force).enumerate() {
                derivative.displacement[i] += self.by_displacement * d * f * f;
                derivative.internal_force[i] += self.by_force * f * d * d;
            }
        }
    }

    const D: [f64; 6] = [1e-3, -2e-3, 5e-4, 0.0, 1e-3, -1e-4];
    const F: [f64; 6] = [30.0, -20.0, 7.0, 1.0, 11.0, -4.0];
    const LOADS: [f64; 6] = [0.0, 4.0, 1.0, 0.0, -2.0, 0.0];
    const STATE: StateView =
        StateView { step: 2, steps: 3, time: 0.6, displacement: &D, internal_force: &F, external_force: &LOADS };

    #[test]
    fn right_derivatives_pass() {
        check_derivatives(&Work { by_displacement: 1.0, by_force: 1.0 }, &STATE).unwrap();
        let contact = ContactForce::new(vec![0, 1], 2, ObservedSteps::Last, 0.0).unwrap();
        check_derivatives(&contact, &STATE).unwrap();
        let reaction = ReactionForce::new(vec![1], 2, [1.0, 2.0, -3.0], ObservedSteps::Last).unwrap();
        check_derivatives(&reaction, &STATE).unwrap();
        check_derivatives(&crate::Compliance::new(ObservedSteps::All), &STATE).unwrap();
    }

    /// A wrong sign, a forgotten part, and a part in 10⁵.
    #[test]
    fn wrong_derivatives_are_named() {
        for (by_displacement, by_force, argument) in [
            (-1.0, 1.0, "displacements"),
            (0.0, 1.0, "displacements"),
            (1.0 + 1e-5, 1.0, "displacements"),
            (1.0, -1.0, "internal forces"),
            (1.0, 0.0, "internal forces"),
        ] {
            let found = check_derivatives(&Work { by_displacement, by_force }, &STATE).unwrap_err();
            assert_eq!((found.argument, found.step, found.name.as_str()), (argument, 2, "work"));
            let factor = found.derivative / found.difference;
            let expected = if argument == "displacements" { by_displacement } else { by_force };
            assert!((factor - expected).abs() < 1e-8, "{factor} instead of {expected}");
        }
    }

    /// Computed by hand: differences of sin 10³ d with steps beyond its period are meaningless. One step that agrees is
    /// enough, and for a wrong slope the closest difference is reported.
    #[test]
    fn one_step_that_agrees_is_enough() {
        let at: [f64; 3] = [0.3, -1.0, 0.2];
        let wave = |x: &[f64]| x.iter().map(|x| (1e3 * x).sin()).sum::<f64>();
        let slope = at.map(|x: f64| 1e3 * (1e3 * x).cos());
        assert_eq!(compare(&at, &slope, wave), Ok(()));
        let (derivative, difference) = compare(&at, &slope.map(|s| 1.001 * s), wave).unwrap_err();
        assert!((derivative / difference - 1.001).abs() < 1e-4, "{derivative} {difference}");
    }

    /// NaN is never right.
    #[test]
    fn derivatives_that_are_not_finite_are_wrong() {
        let found = check_derivatives(&Work { by_displacement: f64::NAN, by_force: 1.0 }, &STATE);
        assert_eq!(found.unwrap_err().argument, "displacements");
    }
}
