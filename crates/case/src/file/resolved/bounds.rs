//! The single bounds that the `[[constraint]]` tables of a case amount to.

pub use slipstick_design::{Bound, extreme_of};

use super::Case;

/// A bound on a quantity at one load step of one load case.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedBound {
    /// Its name, that of its column in `history.csv`.
    pub name: String,
    /// Number of its `[[constraint]]` table, from 0.
    pub constraint: usize,
    /// The bounded quantity.
    pub quantity: String,
    /// The bound.
    pub bound: Bound,
    /// Number of the load case, from 0.
    pub load_case: usize,
    /// The load step within its load case, from 1.
    pub step: usize,
    /// Whether the bound holds for the extreme itself where a smooth measure errs on the unsafe side.
    pub corrected: bool,
}

impl Case {
    /// A bound for every number in `max` and `min`, every load step at which it holds, and every load
    /// case. One on a quantity that does not depend on the state holds once, at the end of the first
    /// load case.
    pub fn bounds(&self) -> Vec<NamedBound> {
        let steps = self.load_path.steps;
        let cases = self.load_case_names();
        let mut all = Vec::new();
        for (number, constraint) in self.constraints.iter().enumerate() {
            let bounds = [constraint.max.map(Bound::AtMost), constraint.min.map(Bound::AtLeast)];
            let known = self.quantities.iter().find(|quantity| quantity.name == constraint.quantity);
            let on_state = known.is_none_or(|quantity| quantity.kind.depends_on_state());
            let observed: Vec<usize> = match on_state {
                true => (1..=steps).filter(|&step| constraint.steps.contains(step, steps)).collect(),
                false => vec![steps],
            };
            // a quantity that several tables bound needs names that tell its bounds apart
            let others = self.constraints.iter().filter(|other| other.quantity == constraint.quantity);
            let several = others.count() > 1;
            for bound in bounds.into_iter().flatten() {
                for load_case in 0..if on_state { cases.len().max(1) } else { 1 } {
                    for &step in &observed {
                        let mut name = constraint.quantity.clone();
                        if several || constraint.max.is_some() && constraint.min.is_some() {
                            name += if matches!(bound, Bound::AtMost(_)) { "_max" } else { "_min" };
                        }
                        if (several || observed.len() > 1) && on_state {
                            name += &format!("_{step}");
                        }
                        if cases.len() > 1 && on_state {
                            name += &format!("_{}", cases[load_case]);
                        }
                        let (quantity, corrected) = (constraint.quantity.clone(), constraint.corrected);
                        all.push(NamedBound { name, constraint: number, quantity, bound, load_case, step, corrected });
                    }
                }
            }
        }
        all
    }
}
