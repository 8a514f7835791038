//! The design map of every iteration.

use super::PrepareError;
use slipstick_design::{DensityMap, DesignVariables, Schedule};

/// The maps that a schedule of sharpness and filter radius leads to.
pub(super) struct Maps {
    first: DensityMap,
    /// Each with the iteration from which on it applies.
    later: Vec<(usize, DensityMap)>,
}

impl Maps {
    /// All ranks call it.
    pub(super) fn new(first: DensityMap, schedule: &Schedule) -> Result<Self, PrepareError> {
        let (sharpness, radius) = (&schedule.sharpness, &schedule.filter_radius);
        let mut changes: Vec<usize> = sharpness.entries().iter().chain(radius.entries()).map(|entry| entry.0).collect();
        changes.sort_unstable();
        changes.dedup();
        let mut later: Vec<(usize, DensityMap)> = Vec::with_capacity(changes.len());
        for from in changes {
            let mut map = later.last().map_or(&first, |(_, map)| map).clone();
            if let Some(radius) = radius.at(from) {
                map = map.with_radius(radius).map_err(PrepareError::FilterRadius)?;
            }
            if let Some(sharpness) = sharpness.at(from) {
                map = map.with_sharpness(sharpness).map_err(PrepareError::Sharpness)?;
            }
            later.push((from, map));
        }
        Ok(Self { first, later })
    }

    pub(super) fn at(&self, iteration: usize) -> &DensityMap {
        self.later.iter().rev().find(|(from, _)| *from <= iteration).map_or(&self.first, |(_, map)| map)
    }

    /// The variables, the same for all iterations.
    pub(super) fn variables(&self) -> &DesignVariables {
        self.first.variables()
    }
}
