//! How much of a surface is in contact.

use super::{Dimension, Patch, Quantity, Reads, StateDerivative, StateView};

/// Share of a patch that carries the contact force: (Σ A_j ζ_nj)² / (Σ A_j · Σ A_j ζ_nj²), between
/// 0 and 1.
///
/// With uniform pressure on a part of the patch, this is the part's share of the area (the
/// participation ratio of the pressure); unlike the area of the nodes in contact, it has no jumps.
/// The areas A_j are those that face the master. Test: `pair_quantities_by_hand`.
#[derive(Clone, Debug)]
pub struct ContactShare {
    name: String,
    patch: Patch,
}

impl ContactShare {
    /// The share of a patch.
    pub fn new(name: impl Into<String>, patch: Patch) -> Self {
        Self { name: name.into(), patch }
    }

    /// Σ A, Σ A ζ, Σ A ζ².
    fn moments(&self, state: &StateView) -> [f64; 3] {
        let mut sums = [0.0; 3];
        for (_, at) in self.patch.of(state.contact) {
            let pressure = at.pressure();
            let terms = [at.area, at.area * pressure, at.area * pressure * pressure];
            sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
        }
        sums
    }
}

impl Quantity for ContactShare {
    fn name(&self) -> &str {
        &self.name
    }

    fn dimension(&self) -> Dimension {
        Dimension::NONE
    }

    fn reads(&self) -> Reads {
        Reads { contact: true, ..Reads::default() }
    }

    fn needs_contact(&self) -> bool {
        true
    }

    fn value(&self, state: &StateView) -> f64 {
        let [whole, force, square] = self.moments(state);
        if square == 0.0 { 0.0 } else { force * force / (whole * square) }
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        let [whole, force, square] = self.moments(state);
        if square == 0.0 {
            return;
        }
        let (value, slope) = (force * force / (whole * square), 2.0 * force / (whole * square));
        let by = [-value / whole, slope, -value / square].map(|by| weight * by);
        for (j, at) in self.patch.of(state.contact) {
            let pressure = at.pressure();
            to.contact[j].area += by[0] + by[1] * pressure + by[2] * pressure * pressure;
            if at.status.is_closed() {
                to.contact[j].multiplier[0] += at.area * (by[1] + 2.0 * by[2] * pressure);
            }
        }
    }
}
