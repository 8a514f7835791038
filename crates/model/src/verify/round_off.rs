//! Estimates the round-off of the objective from analyses of nearby designs.

use super::function::{Function, VerifyError, set_tolerance};
use super::kinks::{changes, same_steps};
use super::options::VerifyOptions;
use super::stencil::inwards;
use crate::analysis::Forward;
use slipstick_design::ElementValues;
use slipstick_path::{Guide, MarchObserver};

/// Safety factor on the round-off estimated from a few samples.
const SAMPLES_SHORT: f64 = 4.0;

/// Largest distance in density between the samples of round-off.
const LARGEST_SPACING: f64 = 1e-5;

/// Estimates the error of θ due to round-off and the tolerance of the iterations.
///
/// Neither |θ| nor the tolerance predicts this error: a stiff body next to a soft one, or
/// coordinates that are large compared to the body, cost many digits. The error is therefore
/// measured.
pub(super) fn round_off(
    function: &mut Function<'_>,
    density: &ElementValues,
    free: &[u32],
    base: &Forward,
    options: &VerifyOptions,
    observer: &mut dyn MarchObserver,
) -> Result<f64, VerifyError> {
    set_tolerance(function.analysis, 10.0 * options.forward_tolerance);
    let loose = function.forward(density, observer);
    set_tolerance(function.analysis, options.forward_tolerance);
    let loose = loose?;
    // A path with different steps is a different function and gives no information.
    let by_tolerance = if same_steps(base, &loose) { (loose.value - base.value).abs() } else { 0.0 };
    // from here on, the path at φ provides the initial guesses
    function.analysis.guide = Some(Guide::of(&base.path, function.analysis.linear.ranks()).holding_steps());
    let spacing = (options.step * 0.5f64.powi(options.halvings as i32)).min(LARGEST_SPACING);
    let (mut by_digits, smooth) = noise(function, density, free, base, spacing, observer)?;
    if !smooth {
        // The contribution of a kink decreases with the spacing, that of round-off does not.
        by_digits = by_digits.min(noise(function, density, free, base, 0.01 * spacing, observer)?.0);
    }
    let by_digits = if by_digits.is_finite() { by_digits } else { 0.0 };
    let least = f64::EPSILON * base.step_values.iter().map(|value| value.abs()).sum::<f64>();
    Ok(SAMPLES_SHORT * by_digits.max(by_tolerance).max(least))
}

/// Standard deviation of θ's round-off from its third and fourth differences at nine equally spaced
/// densities, in which the smooth part of θ cancels; infinite if the paths there have different
/// steps. Also returns whether all paths have the same statuses.
///
/// J. J. Moré, S. M. Wild: Estimating computational noise. SIAM J. Sci. Comput. 33 (2011)
/// 1292–1314, (3.4).
fn noise(
    function: &mut Function<'_>,
    density: &ElementValues,
    free: &[u32],
    base: &Forward,
    spacing: f64,
    observer: &mut dyn MarchObserver,
) -> Result<(f64, bool), VerifyError> {
    let mut values = [base.value; 9];
    let (mut smooth, mut same) = (true, true);
    let along: Vec<f64> = (0..free.len()).map(|k| if k % 2 == 0 { spacing } else { -0.7 * spacing }).collect();
    // on both sides of the density, or inwards from it if there is no room
    let room = free.iter().zip(&along).all(|(&e, along)| {
        let reach = 4.0 * along.abs();
        (reach..=1.0 - reach).contains(&density[e as usize])
    });
    let (along, first) = if room {
        (along, -4i32)
    } else {
        let turned = |(&e, along): (&u32, f64)| inwards(density[e as usize], 8.0 * along.abs()) * along.abs();
        (free.iter().zip(along).map(turned).collect(), 0)
    };
    for (value, place) in values.iter_mut().zip(first..).filter(|(_, place)| *place != 0) {
        let mut moved = density.clone();
        for (&e, along) in free.iter().zip(&along) {
            moved[e as usize] = (moved[e as usize] + f64::from(place) * along).clamp(0.0, 1.0);
        }
        let at = function.forward(&moved, observer)?;
        same &= same_steps(base, &at);
        smooth &= same && changes(base, [&at, &at], function.analysis).is_empty();
        *value = at.value;
    }
    if !same {
        return Ok((f64::INFINITY, false));
    }
    let third: Vec<f64> = values.windows(4).map(|v| (v[3] - v[0]) - 3.0 * (v[2] - v[1])).collect();
    let fourth: Vec<f64> = third.windows(2).map(|v| v[1] - v[0]).collect();
    // variances of differences of independent numbers: sums of squared binomial coefficients,
    // C(6, 3) and C(8, 4)
    let deviation = |differences: &[f64], variance: f64| {
        (differences.iter().map(|x| x * x).sum::<f64>() / (differences.len() as f64 * variance)).sqrt()
    };
    Ok((deviation(&third, 20.0).max(deviation(&fourth, 70.0)), smooth))
}
