//! Pairs of constraints that bound one function from both sides, as an equality does.
//!
//! The approximations of `h ≤ 0` and of `−h − w ≤ 0` are both convex, so their sum is positive
//! everywhere but at the current design, up to the width w of the band. If the band is narrow, no
//! step but a tiny one meets both, although the designs with `h = 0` form a whole surface: the
//! optimizer stalls. Such a pair is recognized by opposed gradients, a narrow band, and multipliers that
//! are both positive in the solution of the subproblem. Then only the side against which the
//! objective pushes is kept, and its bound is relaxed by the curvature of its approximation at the
//! solution, so that the *linearization* of h, on which both sides agree, meets the band there. A
//! function that is linear in the variables, such as a volume, keeps its value exactly; for others,
//! the error is of second order in the step, as that of Newton's method, and the next step removes
//! it. The curvature still regularizes the step, through the Lagrangian.
//!
//! Tests: `optimizer/tests/equality.rs`.

use super::interior_point::Solution;
use super::subproblem::{Subproblem, Variable};
use super::{Functions, MmaError};

/// Largest sine of the angle between gradients that count as opposed.
const OPPOSED: f64 = 1e-6;
/// Largest width of a band that is narrow, relative to the largest change of the function in a step.
const NARROW: f64 = 0.1;
/// Smallest ratio of the multipliers of two sides that both act.
const BOTH_ACT: f64 = 1e-3;
/// Maximum number of solutions with changed relaxations.
const MOST_SOLUTIONS: usize = 20;
/// Largest error of the linearization, relative to its change if all variables cross their range.
const TOLERANCE: f64 = 1e-8;

/// A pair of opposed constraints of which one side is kept.
struct Pair {
    kept: usize,
    dropped: usize,
    swapped: bool,
    /// How much the bound of the kept side is relaxed. ≥ 0
    relaxation: f64,
    /// Relaxation and error of the solution before, for a secant step.
    before: Option<(f64, f64)>,
}

impl Pair {
    fn keeping(kept: usize, dropped: usize, swapped: bool) -> Self {
        Self { kept, dropped, swapped, relaxation: 0.0, before: None }
    }

    /// Chooses the next relaxation from the error of the last one, the linearization of the kept
    /// side minus its bound. The error rises with the relaxation, at a rate of 1 if the curvature at
    /// the solution does not change.
    fn relax(&mut self, error: f64) {
        let rate = match self.before {
            Some((relaxation, before)) if relaxation != self.relaxation => {
                ((error - before) / (self.relaxation - relaxation)).clamp(0.1, 10.0)
            }
            _ => 1.0,
        };
        self.before = Some((self.relaxation, error));
        self.relaxation = (self.relaxation - error / rate).max(0.0);
    }
}

impl Subproblem<'_> {
    /// Solves the subproblem; pairs of opposed constraints do not block each other.
    pub(super) fn solve_with_opposed(&mut self, functions: &Functions<'_>) -> Result<Solution, MmaError> {
        let mut solution = self.solve()?;
        let mut pairs = blocking(functions, &solution);
        pairs.retain(|pair| self.is_narrow(pair, functions));
        if pairs.is_empty() {
            return Ok(solution);
        }
        let bounds = self.values.clone();
        let gradient = |i: usize| &functions.constraint_gradients[i];
        let mut iterations = solution.iterations;
        for _ in 0..MOST_SOLUTIONS {
            self.values.clone_from(&bounds);
            for pair in &pairs {
                self.values[pair.kept] -= pair.relaxation;
                self.values[pair.dropped] = -1.0 - self.largest_rise(pair.dropped);
            }
            solution = self.solve()?;
            iterations += solution.iterations;
            let mut settled = true;
            for pair in &mut pairs {
                let [kept, dropped] = [pair.kept, pair.dropped].map(|i| {
                    let (change, size) = self.linear_change(gradient(i), &solution.x);
                    (bounds[i] + change, TOLERANCE * size)
                });
                // otherwise, its bound does not determine the step
                let acts = solution.lambda[pair.kept] > solution.slack[pair.kept];
                let unmet = pair.relaxation == 0.0 && kept.0 > 0.0;
                if !acts && dropped.0 > dropped.1 && !pair.swapped {
                    // the objective pushes against the other side
                    *pair = Pair::keeping(pair.dropped, pair.kept, true);
                    settled = false;
                } else if acts && !unmet && kept.0.abs() > kept.1 {
                    pair.relax(kept.0);
                    settled = false;
                }
            }
            if settled {
                break;
            }
        }
        for pair in &pairs {
            // slacks of the bounds as given
            for i in [pair.kept, pair.dropped] {
                solution.slack[i] = (solution.slack[i] + self.values[i] - bounds[i]).max(0.0);
            }
        }
        self.values = bounds;
        Ok(Solution { iterations, ..solution })
    }

    /// Whether the band between opposed bounds is narrow. Gradients of different functions may be
    /// opposed at a design by chance.
    fn is_narrow(&self, pair: &Pair, functions: &Functions<'_>) -> bool {
        let gradients = [pair.kept, pair.dropped].map(|i| &functions.constraint_gradients[i]);
        let reach = |v: &Variable| gradients.map(|gradient| (gradient[v.index] * v.range).abs() * (v.beta - v.alpha));
        let mut reaches = self.variables.iter().map(reach).fold([0.0; 2], |sum, of| [sum[0] + of[0], sum[1] + of[1]]);
        self.ranks.sum(&mut reaches);
        // the gradients may have different scales
        let [of_kept, of_dropped] = reaches;
        let band = -self.values[pair.kept] / of_kept - self.values[pair.dropped] / of_dropped;
        band <= 0.5 * NARROW
    }

    /// Change of a linearized function over a step, and the change if all variables cross their
    /// range in its direction.
    fn linear_change(&self, gradient: &[f64], step: &[f64]) -> (f64, f64) {
        let slopes = || self.variables.iter().map(|v| gradient[v.index] * v.range);
        let change = slopes().zip(step).map(|(slope, t)| slope * t).sum::<f64>();
        let mut sums = [change, slopes().map(f64::abs).sum::<f64>()];
        self.ranks.sum(&mut sums);
        (sums[0], sums[1])
    }

    /// An upper bound on the change of an approximated constraint within the bounds of this step: a
    /// convex function of one variable is largest at an end.
    fn largest_rise(&self, i: usize) -> f64 {
        let m = self.values.len();
        let at = |(j, v): (usize, &Variable), t: f64| {
            let (p, q) = self.coefficients(j * m + i);
            p * t / ((v.upp - t) * v.upp) + q * t / ((t - v.low) * v.low)
        };
        let rise = |of: (usize, &Variable)| at(of, of.1.alpha).max(at(of, of.1.beta));
        let mut rise = [self.variables.iter().enumerate().map(rise).sum::<f64>()];
        self.ranks.sum(&mut rise);
        rise[0]
    }
}

/// The pairs of opposed constraints that both act, each with the side to keep: the one with the
/// larger multiplier. Every constraint is in one pair at most.
fn blocking(functions: &Functions<'_>, solution: &Solution) -> Vec<Pair> {
    let &Functions { constraints, constraint_gradients, largest_of, .. } = functions;
    let (lambda, slack) = (&solution.lambda, &solution.slack);
    let mut taken = vec![false; constraints.len()];
    let mut pairs = Vec::new();
    for i in largest_of..constraints.len() {
        for k in i + 1..constraints.len() {
            let (kept, dropped) = if lambda[k] > lambda[i] { (k, i) } else { (i, k) };
            let act = lambda[dropped] > (BOTH_ACT * lambda[kept]).max(slack[dropped]);
            if act && !taken[i] && !taken[k] && opposed(&constraint_gradients[i], &constraint_gradients[k]) {
                (taken[i], taken[k]) = (true, true);
                pairs.push(Pair::keeping(kept, dropped, false));
            }
        }
    }
    pairs
}

/// Whether two gradients point in opposite directions.
fn opposed(a: &[f64], b: &[f64]) -> bool {
    let size = |x: &[f64]| x.iter().fold(0.0, |largest: f64, slope| largest.max(slope.abs()));
    let (of_a, of_b) = (size(a), size(b));
    of_a > 0.0 && of_b > 0.0 && a.iter().zip(b).all(|(a, b)| (a / of_a + b / of_b).abs() <= OPPOSED)
}
