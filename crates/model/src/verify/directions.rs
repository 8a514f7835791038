//! The directions along which differences are taken.

use super::options::VerifyOptions;
use super::stencil::{Stencil, inwards};
use slipstick_design::ElementValues;

/// The elements that may vary: those inside (0, 1) in both directions, those at a bound only
/// inwards.
pub(super) struct Varied {
    within: Vec<u32>,
    at_bounds: Vec<u32>,
}

impl Varied {
    pub(super) fn of(designed: &[u32], density: &ElementValues, step: f64) -> Self {
        let phi = |e: &u32| density[*e as usize];
        let (within, others): (Vec<u32>, Vec<u32>) =
            designed.iter().partition(|e| (step..=1.0 - step).contains(&phi(e)));
        let has_room = |e: &u32| (0.0..=1.0).contains(&(phi(e) + 2.0 * step * inwards(phi(e), 2.0 * step)));
        Self { within, at_bounds: others.into_iter().filter(has_room).collect() }
    }

    /// All of them, ascending.
    pub(super) fn all(&self) -> Vec<u32> {
        let mut all = [&self.within[..], &self.at_bounds].concat();
        all.sort_unstable();
        all
    }

    /// Random directions over the elements within the bounds, others over those at a bound, and
    /// single elements, preferably within the bounds.
    pub(super) fn directions(
        &self,
        density: &ElementValues,
        options: &VerifyOptions,
    ) -> Vec<(String, Vec<f64>, Stencil)> {
        let step = options.step;
        let inwards = |e: u32| inwards(density[e as usize], 2.0 * step);
        let mut all = Vec::new();
        for k in (0..options.directions).filter(|_| !self.within.is_empty()) {
            let mut direction = vec![0.0; density.len()];
            for (&e, v) in self.within.iter().zip(random(k)) {
                direction[e as usize] = v;
            }
            all.push((format!("random direction {}", k + 1), direction, Stencil::Central));
        }
        for k in (0..options.directions).filter(|_| !self.at_bounds.is_empty()) {
            let mut direction = vec![0.0; density.len()];
            for (&e, v) in self.at_bounds.iter().zip(random(k)) {
                direction[e as usize] = v.abs() * inwards(e);
            }
            all.push((format!("random direction {} off the bounds", k + 1), direction, Stencil::OneSided));
        }
        // at 0 the stiffness has zero slope, so such an element gives no information
        let single = if self.within.is_empty() { &self.at_bounds } else { &self.within };
        let stencil = if self.within.is_empty() { Stencil::OneSided } else { Stencil::Central };
        let count = options.elements.min(single.len());
        for k in 0..count {
            let e = single[(2 * k + 1) * single.len() / (2 * count)];
            let mut direction = vec![0.0; density.len()];
            direction[e as usize] = if stencil == Stencil::OneSided { inwards(e) } else { 1.0 };
            all.push((format!("element {e}"), direction, stencil));
        }
        all
    }
}

/// A fixed sequence of signs and magnitudes in [−1, 1] (SplitMix64), so that a report is
/// reproducible.
fn random(number: usize) -> impl Iterator<Item = f64> {
    let mut state = 0x9E37_79B9_7F4A_7C15u64.wrapping_mul(number as u64 + 1);
    std::iter::from_fn(move || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        Some((z ^ (z >> 31)) as f64 / u64::MAX as f64 * 2.0 - 1.0)
    })
}
