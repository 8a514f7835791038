//! The largest or smallest value itself, for which a smooth measure stands.

use std::fmt;
use std::sync::Arc;

use super::{Dimension, Quantity, Reads, StateDerivative, StateView};

/// The extreme of the values that a smooth measure combines. It has kinks, so only its value may be
/// used: it has no derivatives.
#[derive(Clone)]
pub struct Extreme<Q> {
    name: String,
    of: Q,
    value: fn(&Q, &StateView) -> f64,
}

impl<Q: Quantity + 'static> Extreme<Q> {
    /// The extreme for which a quantity stands: [`extreme_of`].
    pub(super) fn of(of: Q, value: fn(&Q, &StateView) -> f64) -> Arc<dyn Quantity> {
        Arc::new(Self { name: extreme_of(of.name()), of, value })
    }
}

/// The column of the extreme for which a quantity of this name stands.
pub fn extreme_of(name: &str) -> String {
    format!("{name}_extreme")
}

impl<Q> fmt::Debug for Extreme<Q> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}

impl<Q: Quantity> Quantity for Extreme<Q> {
    fn name(&self) -> &str {
        &self.name
    }

    fn dimension(&self) -> Dimension {
        self.of.dimension()
    }

    fn reads(&self) -> Reads {
        self.of.reads()
    }

    fn needs_contact(&self) -> bool {
        self.of.needs_contact()
    }

    fn value(&self, state: &StateView) -> f64 {
        (self.value)(&self.of, state)
    }

    fn pull_back(&self, _: &StateView, _: f64, _: &mut StateDerivative) {}
}

/// The largest of some values and of 0; what is not a number stays so.
pub(super) fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |largest: f64, x| if x.is_nan() || largest.is_nan() { f64::NAN } else { largest.max(x) })
}

/// The smallest of some values, infinite without any; what is not a number stays so.
pub(super) fn smallest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(
        f64::INFINITY,
        |smallest: f64, x| if x.is_nan() || smallest.is_nan() { f64::NAN } else { smallest.min(x) },
    )
}
