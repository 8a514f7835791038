//! When an optimization stops before its last iteration.

use super::IterationRecord;

/// The optimization stops early at the first design that meets all of the given criteria, if any
/// are given, but not before the last entry of the schedule.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StopCriteria {
    /// No variable changes by more than this in an update.
    pub change: Option<f64>,
    /// The norm of the optimality residual is at most this.
    pub optimality: Option<f64>,
    /// The discreteness is at most this.
    pub discreteness: Option<f64>,
}

impl StopCriteria {
    /// Whether this updated design meets all criteria, and there is one. `change` is the largest of
    /// its update, as it was made.
    pub(super) fn met(&self, record: &IterationRecord, change: Option<f64>) -> bool {
        let pairs = [
            (self.change, change),
            (self.optimality, record.optimality),
            (self.discreteness, Some(record.discreteness)),
        ];
        let given = || pairs.iter().filter_map(|(bound, value)| bound.map(|bound| (bound, *value)));
        given().next().is_some() && given().all(|(bound, value)| value.is_some_and(|value| value <= bound))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_given_criteria_must_be_met() {
        let record = IterationRecord { optimality: Some(1e-3), discreteness: 0.2, ..IterationRecord::default() };
        let met = |change, optimality, discreteness| {
            StopCriteria { change, optimality, discreteness }.met(&record, Some(0.01))
        };
        assert!(!met(None, None, None));
        assert!(met(Some(0.01), None, None) && !met(Some(0.009), None, None));
        assert!(met(None, Some(1e-3), Some(0.2)) && !met(None, Some(1e-3), Some(0.1)));
        assert!(!met(Some(0.1), Some(1e-4), Some(0.5)));
        assert!(!StopCriteria { change: Some(1.0), ..StopCriteria::default() }.met(&record, None));
    }
}
