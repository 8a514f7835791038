//! Parameters of an optimization that change from iteration to iteration.

use schemars::JsonSchema;
use serde::Serialize;

/// Values of a parameter over the iterations: each entry is an iteration and the value from this
/// iteration on. Before the first entry, the parameter keeps its own value.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[serde(transparent)]
pub struct Steps(Vec<(usize, f64)>);

impl Steps {
    /// Entries with ascending iterations; `None` if they are not.
    pub fn new(entries: Vec<(usize, f64)>) -> Option<Self> {
        entries.is_sorted_by(|a, b| a.0 < b.0).then_some(Self(entries))
    }

    /// The entries.
    pub fn entries(&self) -> &[(usize, f64)] {
        &self.0
    }

    /// Whether the parameter keeps its own value.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The value at an iteration; `None` before the first entry.
    pub fn at(&self, iteration: usize) -> Option<f64> {
        self.0.iter().rev().find(|entry| entry.0 <= iteration).map(|entry| entry.1)
    }

    /// Whether the value may differ from that of the iteration before.
    fn changes_at(&self, iteration: usize) -> bool {
        iteration > 0 && self.0.iter().any(|entry| entry.0 == iteration)
    }

    /// The iteration of the last entry; 0 without entries.
    fn end(&self) -> usize {
        self.0.last().map_or(0, |entry| entry.0)
    }
}

/// Which parameters change over the iterations, and how. Iteration 0 is the start design.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Schedule {
    /// Sharpness of the projection.
    #[serde(skip_serializing_if = "Steps::is_empty")]
    pub sharpness: Steps,
    /// Penalization exponent.
    #[serde(skip_serializing_if = "Steps::is_empty")]
    pub p: Steps,
    /// Largest change of a variable in an update.
    #[serde(skip_serializing_if = "Steps::is_empty")]
    pub move_limit: Steps,
    /// Radius of the density filter. \[L\]
    #[serde(skip_serializing_if = "Steps::is_empty")]
    pub filter_radius: Steps,
    /// Bound on the volume fraction.
    #[serde(skip_serializing_if = "Steps::is_empty")]
    pub volume_fraction: Steps,
}

impl Schedule {
    /// Whether objective and constraints are other functions of the variables at this iteration
    /// than at the one before, so that their curvatures are others too.
    pub fn changes_functions_at(&self, iteration: usize) -> bool {
        [&self.sharpness, &self.p, &self.filter_radius].iter().any(|steps| steps.changes_at(iteration))
    }

    /// Whether their values cannot be compared with those at the iteration before: because the
    /// functions are others, or because their bound is.
    pub fn changes_values_at(&self, iteration: usize) -> bool {
        self.changes_functions_at(iteration) || self.volume_fraction.changes_at(iteration)
    }

    /// The iteration from which on nothing changes.
    pub fn end(&self) -> usize {
        self.all().iter().map(|steps| steps.end()).fold(0, usize::max)
    }

    /// The names of those whose last entry no update follows, with its iteration: after the last
    /// update, one more design is evaluated.
    pub fn late(&self, iterations: usize) -> Vec<(&'static str, usize)> {
        let Self { sharpness, p, move_limit, filter_radius, volume_fraction } = self;
        let all = [
            ("sharpness", sharpness),
            ("p", p),
            ("move_limit", move_limit),
            ("filter_radius", filter_radius),
            ("volume_fraction", volume_fraction),
        ];
        let last = all.into_iter().filter_map(|(key, steps)| Some((key, steps.entries().last()?.0)));
        last.filter(|&(_, last)| last >= iterations).collect()
    }

    /// Whether nothing changes.
    pub fn is_empty(&self) -> bool {
        self.all().iter().all(|steps| steps.is_empty())
    }

    fn all(&self) -> [&Steps; 5] {
        let Self { sharpness, p, move_limit, filter_radius, volume_fraction } = self;
        [sharpness, p, move_limit, filter_radius, volume_fraction]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_hold_until_the_next_entry() {
        let steps = Steps::new(vec![(2, 1.0), (5, 4.0)]).unwrap();
        let found: Vec<Option<f64>> = [0, 1, 2, 4, 5, 90].iter().map(|&iteration| steps.at(iteration)).collect();
        assert_eq!(found, [None, None, Some(1.0), Some(1.0), Some(4.0), Some(4.0)]);
        assert_eq!(Steps::default().at(3), None);
        assert!(Steps::new(vec![(2, 1.0), (2, 4.0)]).is_none());
    }

    #[test]
    fn limits_change_no_function() {
        let steps = |entries: &[(usize, f64)]| Steps::new(entries.to_vec()).unwrap();
        let schedule = Schedule {
            sharpness: steps(&[(0, 1.0), (4, 2.0)]),
            p: steps(&[(6, 3.0)]),
            move_limit: steps(&[(8, 0.05)]),
            filter_radius: steps(&[(0, 2.0), (3, 1.0)]),
            volume_fraction: steps(&[(0, 0.5), (7, 0.4)]),
        };
        let changes: Vec<usize> = (0..10).filter(|&k| schedule.changes_functions_at(k)).collect();
        assert_eq!((changes, schedule.end()), (vec![3, 4, 6], 8));
        let changes: Vec<usize> = (0..10).filter(|&k| schedule.changes_values_at(k)).collect();
        assert_eq!(changes, [3, 4, 6, 7]);
        assert!(Schedule::default().is_empty() && Schedule::default().end() == 0);
    }
}
