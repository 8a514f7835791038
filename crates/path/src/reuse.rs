//! How long the factors of a tangent precondition later ones.
//!
//! The further the tangent moves away, the more iterations a solve takes. Factors serve until a digit
//! of a solution costs more than the average digit since they were made, their own cost included: as
//! long as the cost rises with every use, new factors at this point give the lowest average (the
//! economic life of a machine). Within a solve, they are given up when new ones would cost less. All
//! this is based on the cost that factors report ([`slipstick_linalg::Cost`]), which follows from
//! counts and not from a clock, so that a run can be repeated bit for bit.

use crate::failure::StepFailureKind;
use slipstick_linalg::{Alternative, Cost, Factorization, Operator, SolveReport};
use slipstick_status::ContactStatus;
use std::sync::Arc;

/// Factors of an earlier tangent, a preconditioner for others with the same free unknowns.
pub(crate) struct KeptFactors {
    pub factors: Arc<dyn Factorization>,
    /// Whether they are factors of the transposed tangent.
    pub transposed: bool,
    pub fixed: Vec<bool>,
    pub active_set: Vec<ContactStatus>,
    /// If these factors are of the regularized matrix, the reason why the matrix itself has none.
    pub singular: Option<StepFailureKind>,
}

impl KeptFactors {
    /// Number of contact nodes whose status has changed since these were computed.
    pub fn changed_nodes(&self, active_set: &[ContactStatus]) -> usize {
        if self.active_set.len() != active_set.len() {
            return usize::MAX;
        }
        self.active_set.iter().zip(active_set).filter(|(before, now)| before != now).count()
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        self.factors.bytes()
    }
}

/// Fraction of the cost of new factors that the march saves by earlier ones: new ones also serve the
/// solves that follow. The sweep, which solves each tangent once, saves all of it. On a settled design
/// of the half-ball, the march costs a tenth more with 1, and the sweep a fifth more with 0.5.
const PATIENCE: f64 = 0.5;

/// Maximum number of contact nodes with changed status for which earlier factors are tried: each
/// adds a few directions that the iteration must find.
pub(crate) const MOST_CHANGED: usize = 4;

/// Fewer iterations than this are not worth an attempt.
pub(crate) const LEAST_BUDGET: usize = 3;

/// Maximum number of iterations that new factors are considered to be worth: each iteration stores two
/// vectors.
const MOST_BUDGET: f64 = 60.0;

/// Factors with the work that they have done.
#[derive(Clone)]
pub(crate) struct InUse {
    pub factors: Arc<KeptFactors>,
    /// Solves with the factors, each counted by its cost relative to one for a single right-hand side.
    solves: f64,
    /// Decimal digits by which these had to reduce the residuals, counted in the same way.
    digits: f64,
    /// Solves and digits of the last use.
    last: [f64; 2],
    /// Whether new factors are expected to cost less.
    pub outdated: bool,
}

impl InUse {
    pub fn new(factors: Arc<KeptFactors>) -> Self {
        Self { factors, solves: 0.0, digits: 0.0, last: [0.0; 2], outdated: false }
    }

    /// What new factors of a system, transposed or not, would cost instead of these, for `count`
    /// right-hand sides together; equal on all ranks. `None` if the factors report no cost. New factors
    /// of an iterative solver need iterations too.
    pub fn alternative(&self, matrix: &dyn Operator, transposed: bool, count: usize) -> Option<Alternative> {
        let cost = self.factors.factors.cost()?;
        let patience = if transposed { 1.0 } else { PATIENCE };
        let preparation = (patience * factorization(cost, matrix) / together(cost, count)).min(MOST_BUDGET);
        Some(Alternative { preparation, per_digit: cost.solves_per_digit })
    }

    /// Counts a solve with these reports, and decides whether the factors are outdated.
    pub fn count(&mut self, matrix: &dyn Operator, reports: &[SolveReport], tolerance: f64) {
        let Some(cost) = self.factors.factors.cost() else { return };
        let weight = together(cost, reports.len());
        let Some(longest) = reports.iter().max_by_key(|report| report.solves()) else { return };
        let solves = weight * longest.solves() as f64;
        let digits = weight * (longest.initial_residual / tolerance).log10().max(0.0);
        self.solves += solves;
        self.digits += digits;
        // Newton's method alternates between few digits, which cost more each, and many
        let [recent, recent_digits] = [self.last[0] + solves, self.last[1] + digits];
        self.last = [solves, digits];
        self.outdated = recent * self.digits > (factorization(cost, matrix) + self.solves) * recent_digits;
    }
}

/// The cost of new factors, in iterations for one right-hand side.
fn factorization(cost: Cost, matrix: &dyn Operator) -> f64 {
    cost.factorization / (cost.substitution + matrix.product_cost())
}

/// The cost of an iteration for `count` right-hand sides together, relative to that for one.
fn together(cost: Cost, count: usize) -> f64 {
    1.0 + cost.further * (count.max(1) - 1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_linalg::{CsrMatrix, CsrPattern, Precision};

    /// Factors that only have a cost, or not even that.
    struct Costly(Option<Cost>);

    impl Factorization for Costly {
        fn solve(&self, _: &mut [f64]) {}

        fn solve_transpose(&self, _: &mut [f64]) {}

        fn n(&self) -> usize {
            1
        }

        fn bytes(&self) -> usize {
            0
        }

        fn precision(&self) -> Precision {
            Precision::F64
        }

        fn cost(&self) -> Option<Cost> {
            self.0
        }
    }

    fn in_use(cost: Option<Cost>) -> InUse {
        let (fixed, active_set) = (vec![false], Vec::new());
        let factors = Arc::new(Costly(cost));
        InUse::new(Arc::new(KeptFactors { factors, transposed: false, fixed, active_set, singular: None }))
    }

    /// A matrix of one entry, with which a product costs 12.
    fn matrix() -> CsrMatrix {
        let pattern = CsrPattern::new(vec![0, 1], vec![0], vec![0], vec![]).unwrap();
        CsrMatrix { pattern: Arc::new(pattern), values: vec![1.0] }
    }

    /// By hand: with a solve of cost 88, an iteration costs 100, and for six right-hand sides together
    /// three times as much if each further one costs 0.4. New factors are worth the break-even number of iterations to the
    /// transposed system, half of it to the other, at most 60, and nothing is known without a cost. If
    /// an iterative solver needs three solves per digit, four digits take 12 with new factors.
    #[test]
    fn earlier_factors_are_given_what_new_ones_cost() {
        let matrix = matrix();
        let of = |factorization, substitution| {
            let cost = Cost { factorization, substitution, solves_per_digit: 0.0, further: 0.4 };
            in_use(Some(cost)).alternative(&matrix, false, 1).unwrap().cost(10.0)
        };
        assert_eq!((of(2000.0, 88.0), of(2000.0, 38.0), of(2e6, 88.0), of(0.0, 88.0)), (10.0, 20.0, 60.0, 0.0));
        assert_eq!(in_use(None).alternative(&matrix, true, 1), None);
        let cost = Cost { factorization: 2000.0, substitution: 88.0, solves_per_digit: 0.0, further: 0.4 };
        assert_eq!(in_use(Some(cost)).alternative(&matrix, true, 1).unwrap().cost(10.0), 20.0);
        let of_six = in_use(Some(cost)).alternative(&matrix, true, 6).unwrap().cost(10.0);
        assert!((of_six - 20.0 / 3.0).abs() < 1e-14, "{of_six}");
        let iterative = Cost { solves_per_digit: 3.0, ..cost };
        assert_eq!(in_use(Some(iterative)).alternative(&matrix, false, 1).unwrap().cost(4.0), 12.0 + 10.0);
    }

    /// By hand: new factors cost 20 solves, and uses for four digits each take 8, 10, … of them. With
    /// the mean of the last two uses, a digit costs 30/8 at the fifth, less than the 80/20 of all so
    /// far, and 34/8 at the sixth, more than 98/24. Two right-hand sides together share the cost of
    /// the factors: the fifth use takes 1.4 · 30 solves for 1.4 · 8 digits, more than the average of
    /// (20 + 1.4 · 60) for 1.4 · 20.
    #[test]
    fn factors_serve_until_digits_cost_more_than_on_average() {
        let cost = Cost { factorization: 2000.0, substitution: 88.0, solves_per_digit: 0.0, further: 0.4 };
        let uses = |reports: usize| {
            let mut in_use = in_use(Some(cost));
            let mut solves = 6;
            while !in_use.outdated {
                solves += 2;
                let [relative_residual, initial_residual] = [1e-10, 1e-6];
                let report =
                    SolveReport { relative_residual, backward_error: 0.0, initial_residual, iterations: solves };
                in_use.count(&matrix(), &vec![report; reports], 1e-10);
            }
            (solves - 6) / 2
        };
        assert_eq!((uses(1), uses(2)), (6, 5));
    }
}
