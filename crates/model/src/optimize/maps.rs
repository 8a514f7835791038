//! The design map of every iteration.

use super::PrepareError;
use slipstick_design::{DensityMap, DesignVariables, MapParameter, Schedule};

/// Iterations from the first to the second half of a divided rise of the sharpness.
pub(super) const WAIT: usize = 2;

/// The maps that a schedule of sharpness and filter radius leads to.
pub(super) struct Maps {
    first: DensityMap,
    later: Vec<Change>,
}

/// A map that applies from an iteration on.
struct Change {
    from: usize,
    map: DensityMap,
    /// The map that comes first if the change is divided: its sharpness is the geometric mean of the one
    /// before and that of `map`.
    between: Option<DensityMap>,
}

impl Maps {
    /// All ranks call it.
    pub(super) fn new(first: DensityMap, schedule: &Schedule) -> Result<Self, PrepareError> {
        let (sharpness, radius) = (&schedule.sharpness, &schedule.filter_radius);
        let mut changes: Vec<usize> = sharpness.entries().iter().chain(radius.entries()).map(|entry| entry.0).collect();
        changes.sort_unstable();
        changes.dedup();
        let mut later: Vec<Change> = Vec::with_capacity(changes.len());
        for from in changes {
            let mut map = later.last().map_or(&first, |change| &change.map).clone();
            let before = map.parameter(MapParameter::Sharpness);
            if let Some(radius) = radius.at(from) {
                map = map.with(MapParameter::Radius, radius).map_err(PrepareError::FilterRadius)?;
            }
            let mut between = None;
            if let Some(sharpness) = sharpness.at(from) {
                if let Some(before) = before.filter(|before| sharpness > *before) {
                    let mean = map.with(MapParameter::Sharpness, (before * sharpness).sqrt());
                    between = Some(mean.map_err(PrepareError::Sharpness)?);
                }
                map = map.with(MapParameter::Sharpness, sharpness).map_err(PrepareError::Sharpness)?;
            }
            later.push(Change { from, map, between });
        }
        Ok(Self { first, later })
    }

    /// The map at an iteration, with these changes divided.
    pub(super) fn at(&self, iteration: usize, divided: &[usize]) -> &DensityMap {
        let Some(change) = self.later.iter().rev().find(|change| change.from <= iteration) else { return &self.first };
        let waits = divided.contains(&change.from) && iteration < change.from + WAIT;
        change.between.as_ref().filter(|_| waits).unwrap_or(&change.map)
    }

    /// Whether the sharpness rises at an iteration, and nothing else changes until the second half of the
    /// rise.
    pub(super) fn can_divide(&self, iteration: usize) -> bool {
        let mut from = self.later.iter().skip_while(|change| change.from < iteration);
        let rises = from.next().is_some_and(|change| change.from == iteration && change.between.is_some());
        rises && from.next().is_none_or(|next| next.from > iteration + WAIT)
    }

    /// The variables, the same for all iterations.
    pub(super) fn variables(&self) -> &DesignVariables {
        self.first.variables()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_design::{Projection, Steps};

    fn maps(sharpness: &[(usize, f64)], radius: &[(usize, f64)]) -> Maps {
        let projection = Projection::new(1.0, 0.5).unwrap();
        let map = DensityMap::new(DesignVariables::new(2, &[0, 1], &[], &[]).unwrap()).projected(projection);
        let steps = |entries: &[(usize, f64)]| Steps::new(entries.to_vec()).unwrap();
        let schedule = Schedule { sharpness: steps(sharpness), filter_radius: steps(radius), ..Schedule::default() };
        Maps::new(map, &schedule).unwrap()
    }

    #[test]
    fn a_divided_rise_passes_the_geometric_mean() {
        let maps = maps(&[(3, 4.0), (8, 16.0)], &[]);
        let sharpness = |divided: &[usize]| -> Vec<f64> {
            (0..12).map(|k| maps.at(k, divided).parameter(MapParameter::Sharpness).unwrap()).collect()
        };
        assert_eq!(sharpness(&[]), [1.0, 1.0, 1.0, 4.0, 4.0, 4.0, 4.0, 4.0, 16.0, 16.0, 16.0, 16.0]);
        assert_eq!(sharpness(&[3, 8]), [1.0, 1.0, 1.0, 2.0, 2.0, 4.0, 4.0, 4.0, 8.0, 8.0, 16.0, 16.0]);
    }

    #[test]
    fn only_rises_with_time_for_both_halves_are_divided() {
        let divisible = |maps: &Maps| -> Vec<usize> { (0..20).filter(|&k| maps.can_divide(k)).collect() };
        assert_eq!(divisible(&maps(&[(3, 4.0), (6, 16.0), (10, 2.0), (12, 8.0), (14, 16.0)], &[])), [3, 6, 14]);
        // the filter radius changes in between
        assert_eq!(divisible(&maps(&[(3, 4.0), (6, 16.0)], &[(5, 1.0)])), [6]);
    }
}
