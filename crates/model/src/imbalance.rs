//! Energies of a path that do not balance, although no other finding says why.
//!
//! In equilibrium, with Lagrange multipliers and Coulomb's law, the work of loads, supports and offsets is stored
//! or dissipated. It is integrated by the trapezoidal rule over the (sub-)steps, and friction work with the
//! tractions at the ends of steps: where a force rises by a large part within a step, both are inaccurate.

use std::fmt;

use serde::Serialize;

use crate::losses::COUNTED_LOSS;
use crate::quantities::Quantities;
use crate::words::quantity;

/// `energy_balance` at the end of a load case, if it is more than [a fraction](COUNTED_LOSS) of the work done.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Imbalance {
    /// `energy_balance`: positive if work is missing that was done. \[F L\]
    pub balance: f64,
    /// Its magnitude as a fraction of the work done on the bodies, as a sum of magnitudes over the load steps.
    pub fraction: f64,
    /// The load step that adds most, counted through all load cases.
    pub step: usize,
    /// What it adds. \[F L\]
    pub at_step: f64,
}

impl fmt::Display for Imbalance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { balance, fraction, step, at_step } = self;
        write!(
            f,
            "the energies of the load path do not balance: `energy_balance` is {} at its end, {:.1} % of the work done on \
             the bodies; load step {step} adds most, {}",
            quantity(*balance),
            100.0 * fraction,
            quantity(*at_step),
        )
    }
}

impl Imbalance {
    /// The remedy.
    pub fn help(&self) -> String {
        "work is summed over load steps, and forces change much within them; the states are not affected: use more load \
         steps (`load_path.steps`) if you need `external_work`"
            .into()
    }

    /// That of the load case with the largest one that is more than `round_off` \[F L\]. Work without these columns
    /// counts as zero.
    pub(crate) fn of(found: &Quantities, round_off: f64) -> Option<Self> {
        let balance = found.get("energy_balance")?;
        let sources: Vec<Vec<f64>> =
            ["external_work", "offset_work", "thermal_work"].iter().filter_map(|name| found.get(name)).collect();
        let cases = found.rows.chunk_by(|a, b| a.time.case == b.time.case);
        let mut first = 0;
        let each = cases.filter_map(|rows| {
            let own = first..first + rows.len();
            first = own.end;
            let change = |of: &[f64], row: usize| of[row] - if row > own.start { of[row - 1] } else { 0.0 };
            let done: f64 = sources.iter().flat_map(|of| own.clone().map(|row| change(of, row).abs())).sum();
            let last = balance[own.end - 1];
            let added = |row: &usize| change(&balance, *row) * last.signum();
            let largest = own.clone().max_by(|a, b| added(a).total_cmp(&added(b)))?;
            let fraction = last.abs() / done;
            (fraction > COUNTED_LOSS && fraction.is_finite() && last.abs() > round_off).then(|| Self {
                balance: last,
                fraction,
                step: found.rows[largest].step,
                at_step: change(&balance, largest),
            })
        });
        each.max_by(|a, b| a.fraction.total_cmp(&b.fraction))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantities::{QuantityName, QuantityRow, Subject};
    use slipstick_path::LoadTime;

    /// A path with these values of `external_work` and `energy_balance` at the ends of steps, each with the number of
    /// its load case.
    fn path(states: &[(usize, f64, f64)]) -> Quantities {
        let name =
            |name: &str| QuantityName { subject: Subject::Whole, what: name.into(), name: name.into(), unit: "F L" };
        let row = |(step, &(case, work, balance)): (usize, &(usize, f64, f64))| QuantityRow {
            step,
            time: LoadTime { case, t: 1.0 },
            values: vec![work, balance],
            slipped: Vec::new(),
        };
        Quantities {
            names: ["external_work", "energy_balance"].map(name).to_vec(),
            rows: states.iter().enumerate().map(row).collect(),
            ..Quantities::default()
        }
    }

    /// By hand: a force rises from 0 to F within the second step, in which it moves by s: the trapezoidal rule gives
    /// F s/2, friction takes F s, and F s/2 is missing; in the third step both are F s.
    #[test]
    fn a_jump_of_the_force_within_a_step_is_noticed() {
        let found = Imbalance::of(&path(&[(0, 0.0, 0.0), (0, 0.1, 0.0), (0, 0.6, -0.5), (0, 1.6, -0.5)]), 0.0);
        let expected = Imbalance { balance: -0.5, fraction: 0.5 / 1.6, step: 2, at_step: -0.5 };
        assert_eq!(found, Some(expected));
    }

    /// 1.9 % is not reported, 2.1 % is, also if work is given back: 2 + 1 were done. The worst load case counts, each
    /// from its own start.
    #[test]
    fn the_worst_load_case_counts() {
        assert_eq!(Imbalance::of(&path(&[(0, 0.0, 0.0), (0, 1.0, 0.019)]), 0.0), None);
        assert!(Imbalance::of(&path(&[(0, 0.0, 0.0), (0, 1.0, 0.021)]), 0.0).is_some());
        assert_eq!(Imbalance::of(&path(&[(0, 0.0, 0.0), (0, 1.0, 0.021)]), 0.022), None);
        let cases = [(0, 0.0, 0.0), (0, 1.0, 0.03), (1, 2.0, 0.03), (1, 1.0, 0.3)];
        let found = Imbalance::of(&path(&cases), 0.0).expect("an imbalance");
        assert_eq!((found.balance, found.fraction, found.step), (0.3, 0.3 / 3.0, 3));
        assert_eq!(Imbalance::of(&path(&[]), 0.0), None);
    }
}
