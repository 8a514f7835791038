//! The design that an optimization returns.
//!
//! With MMA, the last design need not be the best one, nor meet its constraints. The best design that
//! meets them is kept, and is the result if the last one is clearly worse.

use serde::{Deserialize, Serialize};
use slipstick_design::VariableValues;

use super::{IterationRecord, OptimizationState};

/// Largest violation of a constraint, relative to its bound, with which a design still meets it.
pub const FEASIBLE: f64 = 1e-3;

/// How much worse the objective of the last design may be than that of the best one, relative to its
/// magnitude.
const WORSE: f64 = 1e-3;

/// The best design that meets all constraints, since objective and constraints have last changed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Best {
    /// Its iteration.
    pub iteration: usize,
    /// Its design variables.
    pub x: VariableValues,
}

/// The constraint that a design violates most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MostViolated<'a> {
    /// Its name.
    pub name: &'a str,
    /// The value that violates its bound.
    pub value: f64,
    /// Whether that is the extreme for which a smooth value stands, because the smooth one hides a
    /// violation; `history.csv` has it under the name with `_extreme`.
    pub of_extreme: bool,
    /// The violation, relative to the bound.
    pub violation: f64,
}

impl OptimizationState {
    /// Keeps the design of this record if it is the best so far. `changed`: its values cannot be
    /// compared with those of the designs before. Call it before the record joins the history.
    pub(super) fn keep_best(&mut self, record: &IterationRecord, x: &VariableValues, changed: bool) {
        if changed {
            self.best = None;
        }
        let better = |best: &IterationRecord| record.objective < best.objective;
        if record.violation <= FEASIBLE && self.best_record().is_none_or(better) {
            self.best = Some(Best { iteration: record.iteration, x: x.clone() });
        }
    }

    fn best_record(&self) -> Option<&IterationRecord> {
        self.best.as_ref().and_then(|best| self.history.get(best.iteration))
    }

    /// The record of the design that an optimization that ends now returns: the last one, unless it
    /// violates a constraint, or is clearly worse than the best design that does not. `None` before
    /// the first design.
    pub fn result(&self) -> Option<&IterationRecord> {
        let last = self.history.last()?;
        let better = |best: &IterationRecord| {
            last.violation > FEASIBLE || best.objective < last.objective - WORSE * last.objective.abs()
        };
        Some(self.best_record().filter(|best| better(best)).unwrap_or(last))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_design::{Method, MmaParameters, Optimizer};

    fn state() -> OptimizationState {
        OptimizationState {
            iteration: 0,
            x: vec![0.5].into(),
            x_before: None,
            optimizer: Optimizer::new(Method::Mma, 1, 0, MmaParameters::default()),
            scaling: None,
            parts: Vec::new(),
            constraints: Vec::new(),
            dilated_limit: None,
            shifts: Vec::new(),
            extremes: Vec::new(),
            best: None,
            interpolation: None,
            divided: Vec::new(),
            history: Vec::new(),
        }
    }

    fn add(state: &mut OptimizationState, objective: f64, violation: f64, changed: bool) {
        let iteration = state.history.len();
        let record = IterationRecord { iteration, objective, violation, ..IterationRecord::default() };
        state.keep_best(&record, &vec![iteration as f64].into(), changed);
        state.history.push(record);
    }

    fn result(designs: &[(f64, f64)]) -> usize {
        let mut state = state();
        designs.iter().for_each(|&(objective, violation)| add(&mut state, objective, violation, false));
        state.result().unwrap().iteration
    }

    #[test]
    fn the_best_design_that_meets_the_constraints_is_the_result() {
        // the last one, if it meets them and is at most 0.1 % worse
        assert_eq!(result(&[(3.0, 0.0), (2.0, 0.0), (1.9995, 0.0), (2.0, 0.0009)]), 3);
        assert_eq!(result(&[(-3.0, 0.0), (-3.002, 0.0), (-3.0, 0.0)]), 2);
        // a better one
        assert_eq!(result(&[(3.0, 0.0), (1.9, 0.0), (2.0, 0.0)]), 1);
        assert_eq!(result(&[(-3.0, 0.0), (-3.1, 0.0), (-3.0, 0.0)]), 1);
        // the last one violates a constraint
        assert_eq!(result(&[(3.0, 0.0), (2.5, 0.0), (2.6, 0.0), (2.0, 0.008)]), 1);
        // none meets them
        assert_eq!(result(&[(3.0, 0.1), (2.0, 0.2)]), 1);
    }

    #[test]
    fn designs_of_other_functions_do_not_count() {
        let mut state = state();
        add(&mut state, 1.0, 0.0, false);
        add(&mut state, 2.0, 0.01, true);
        assert_eq!((state.result().unwrap().iteration, state.best.as_ref()), (1, None));
        add(&mut state, 2.5, 0.0, false);
        add(&mut state, 2.0, 0.01, false);
        assert_eq!(state.result().unwrap().iteration, 2);
        assert_eq!(state.best.as_ref().unwrap().x[0], 2.0);
    }
}
