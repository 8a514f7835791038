//! The design map of every iteration.

use slipstick_design::{DensityMap, DesignVariables, FilterError, Steps};

/// The maps that a schedule of the sharpness leads to.
pub(super) struct Maps {
    first: DensityMap,
    /// Each with the iteration from which on it applies.
    later: Vec<(usize, DensityMap)>,
}

impl Maps {
    pub(super) fn new(first: DensityMap, sharpness: &Steps) -> Result<Self, FilterError> {
        let entries = sharpness.entries().iter();
        let later = entries.map(|&(from, sharpness)| Ok((from, first.with_sharpness(sharpness)?)));
        Ok(Self { later: later.collect::<Result<_, FilterError>>()?, first })
    }

    pub(super) fn at(&self, iteration: usize) -> &DensityMap {
        self.later.iter().rev().find(|(from, _)| *from <= iteration).map_or(&self.first, |(_, map)| map)
    }

    /// The variables, the same for all iterations.
    pub(super) fn variables(&self) -> &DesignVariables {
        self.first.variables()
    }
}
