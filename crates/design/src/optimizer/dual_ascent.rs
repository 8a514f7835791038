//! Solution of the subproblem via its dual, for subproblems on which the primal-dual iteration
//! stops.
//!
//! For given multipliers λ > 0 of the constraints, each unknown of the barrier problem
//!
//! `min f̃₀ + a₀z + Σ_i (c y_i + ½ d y_i²) − ε B`, with the barrier `B = Σ_j log (x_j − α_j)(β_j −
//! x_j) + Σ_i log y_i s_i + log z`,
//!
//! minimizes the Lagrangian on its own: `x_j` by bisection and Newton steps, the others in closed
//! form. The constraints `r_i(λ) = f̃_i(x) − a z − y_i + s_i` at these minimizers are the gradient
//! of the dual function, which is concave, so damped Newton steps in the m multipliers converge
//! from any start. The primal-dual iteration of [`interior_point`](super::interior_point) is
//! faster, but its line search makes hardly any progress if a violated constraint has a large
//! curvature and the step cannot remove the violation.

use super::dense::solve_dense;
use super::interior_point::{Point, Residual};
use super::subproblem::{Subproblem, Variable};

/// Maximum number of Newton steps for one ε.
const MOST_STEPS: usize = 200;
/// Maximum number of halvings of a Newton step.
const MOST_HALVINGS: usize = 60;
/// Maximum number of steps to the minimizer in one variable.
const MOST_IN_ONE: usize = 200;
/// Fraction of the distance to a bound of the multipliers that a step may cover.
const TO_BOUNDARY: f64 = 0.99;

/// The dual at some multipliers.
struct Dual {
    at: Point,
    /// r_i(λ), the gradient.
    gradient: Vec<f64>,
}

impl Subproblem<'_> {
    /// Solves the subproblem for ε = 1, 0.1, … down to the tolerance. Counts Newton steps.
    pub(super) fn solve_dual(&self, iterations: &mut usize) -> (Point, Residual) {
        let tolerance = self.parameters.subproblem_tolerance;
        let mut at = self.start();
        let mut epsilon = 1.0;
        loop {
            at = self.maximise(at, epsilon, iterations);
            if epsilon <= tolerance {
                // z = ε/(1 − Σ a λ), and y = ε/(c − λ) for d = 0, lose digits if they are not
                // small. The primal-dual iteration, for which they are unknowns, restores them.
                let residual = self.centre(&mut at, epsilon, iterations);
                return (at, residual);
            }
            epsilon = (0.1 * epsilon).max(tolerance);
        }
    }

    /// Maximizes the dual for one ε, from the multipliers of `start`.
    fn maximise(&self, mut start: Point, epsilon: f64, iterations: &mut usize) -> Point {
        let p = self.parameters;
        let m = start.lambda.len();
        // the domain of the dual: λ < c if the penalty is linear, Σ a λ < 1
        let sum = self.bounding(&start.lambda);
        let shrink = if sum < 1.0 { 1.0 } else { 0.5 / sum };
        let most = if p.d > 0.0 { f64::INFINITY } else { 0.5 * p.c };
        start.lambda.iter_mut().for_each(|lambda| *lambda = (shrink * *lambda).min(most));
        let mut dual = self.dual(start, epsilon);
        for _ in 0..MOST_STEPS {
            if dual.gradient.iter().all(|r| r.abs() <= 0.5 * epsilon) {
                break;
            }
            let mut direction = dual.gradient.clone();
            if m == 0 || !solve_dense(&mut self.curvature(&dual.at, epsilon), &mut direction) {
                break;
            }
            *iterations += 1;
            let dot = |gradient: &[f64]| gradient.iter().zip(&direction).map(|(a, b)| a * b).sum::<f64>();
            let slope = dot(&dual.gradient);
            let mut length = self.longest(&dual.at.lambda, &direction);
            let found = (0..MOST_HALVINGS).find_map(|_| {
                let mut next = dual.at.clone();
                next.lambda.iter_mut().zip(&direction).for_each(|(lambda, change)| *lambda += length * change);
                length *= 0.5;
                let next = self.dual(next, epsilon);
                // The slope decreases along a line: if it is not far below zero, the step is not
                // far beyond the maximum.
                (dot(&next.gradient).abs() <= 0.9 * slope || dot(&next.gradient) > 0.0).then_some(next)
            });
            match found {
                Some(next) => dual = next,
                None => break,
            }
        }
        dual.at
    }

    /// All unknowns and the gradient for the multipliers `at.lambda`.
    fn dual(&self, mut at: Point, epsilon: f64) -> Dual {
        let (p, m) = (self.parameters, at.lambda.len());
        let mut gradient = self.first_values();
        for (j, variable) in self.variables.iter().enumerate() {
            let (rising, falling) = self.combined(j, &at.lambda);
            let x = minimiser(variable, rising, falling, epsilon, at.x[j]);
            let (to_upp, to_low) = (1.0 / (variable.upp - x), 1.0 / (x - variable.low));
            let slope = rising * to_upp * to_upp - falling * to_low * to_low;
            // Close to a bound, its multiplier is more accurate from the slope than from the
            // distance.
            let (below, above) = (x - variable.alpha, variable.beta - x);
            (at.xi[j], at.eta[j]) = if below < above {
                ((slope + epsilon / above).max(f64::MIN_POSITIVE), epsilon / above)
            } else {
                (epsilon / below, (epsilon / below - slope).max(f64::MIN_POSITIVE))
            };
            at.x[j] = x;
            self.add_values(j, x, to_upp, to_low, &mut gradient);
        }
        self.ranks.sum(&mut gradient);
        at.zeta = 1.0 - self.bounding(&at.lambda);
        at.z = epsilon / at.zeta;
        for i in 0..m {
            // (c + d y − λ) y = ε, without cancellation
            let free = p.c - at.lambda[i];
            let root = (free * free + 4.0 * p.d * epsilon).sqrt();
            at.y[i] = if free >= 0.0 { 2.0 * epsilon / (free + root) } else { (root - free) / (2.0 * p.d) };
            at.mu[i] = epsilon / at.y[i];
            at.slack[i] = epsilon / at.lambda[i];
            gradient[i] += at.slack[i] - self.a[i] * at.z - at.y[i];
        }
        Dual { at, gradient }
    }

    /// Minus the Hessian of the dual, by rows.
    fn curvature(&self, at: &Point, epsilon: f64) -> Vec<f64> {
        let (p, m) = (self.parameters, at.lambda.len());
        let mut matrix = vec![0.0; m * m];
        let mut slopes = vec![0.0; m];
        for (j, variable) in self.variables.iter().enumerate() {
            let x = at.x[j];
            let (to_upp, to_low) = (1.0 / (variable.upp - x), 1.0 / (x - variable.low));
            let (upp2, low2) = (to_upp * to_upp, to_low * to_low);
            let (rising, falling) = self.combined(j, &at.lambda);
            let curvature = 2.0 * (rising * upp2 * to_upp + falling * low2 * to_low)
                + at.xi[j] / (x - variable.alpha)
                + at.eta[j] / (variable.beta - x);
            self.slopes(j, upp2, low2, &mut slopes);
            for i in 0..m {
                for k in 0..m {
                    matrix[i * m + k] += slopes[i] * slopes[k] / curvature;
                }
            }
        }
        self.ranks.sum(&mut matrix);
        for i in 0..m {
            for k in 0..m {
                matrix[i * m + k] += self.a[i] * self.a[k] * at.z / at.zeta;
            }
            matrix[i * m + i] += epsilon / at.lambda[i].powi(2) + 1.0 / (p.d + at.mu[i] / at.y[i]);
        }
        matrix
    }

    /// Longest step, at most 1, that stays inside the domain of the dual.
    fn longest(&self, lambda: &[f64], direction: &[f64]) -> f64 {
        let p = self.parameters;
        let mut length: f64 = 1.0;
        let mut keep = |distance: f64, approach: f64| {
            if approach > 0.0 {
                length = length.min(TO_BOUNDARY * distance / approach);
            }
        };
        for (lambda, change) in lambda.iter().zip(direction) {
            keep(*lambda, -change);
            if p.d == 0.0 {
                keep(p.c - lambda, *change);
            }
        }
        keep(1.0 - self.bounding(lambda), self.bounding(direction));
        length
    }
}

/// Minimizer of `p/(u − x) + q/(x − l) − ε log(x − α)(β − x)` between α and β: Newton steps from
/// `start`, with bisection where they leave the interval or do not halve the previous step.
fn minimiser(variable: &Variable, p: f64, q: f64, epsilon: f64, start: f64) -> f64 {
    let (mut below, mut above) = (variable.alpha, variable.beta);
    let mut x = if below < start && start < above { start } else { 0.5 * (below + above) };
    let mut last = above - below;
    for _ in 0..MOST_IN_ONE {
        let (to_upp, to_low) = (1.0 / (variable.upp - x), 1.0 / (x - variable.low));
        let (to_alpha, to_beta) = (1.0 / (x - variable.alpha), 1.0 / (variable.beta - x));
        let slope = p * to_upp * to_upp - q * to_low * to_low - epsilon * to_alpha + epsilon * to_beta;
        let curvature =
            2.0 * (p * to_upp.powi(3) + q * to_low.powi(3)) + epsilon * (to_alpha * to_alpha + to_beta * to_beta);
        if slope > 0.0 {
            above = x
        } else {
            below = x
        }
        let newton = x - slope / curvature;
        let inside = below < newton && newton < above && (newton - x).abs() <= 0.5 * last;
        let next = if inside { newton } else { 0.5 * (below + above) };
        last = (next - x).abs();
        if slope == 0.0 || next == x || !(variable.alpha < next && next < variable.beta) {
            break;
        }
        x = next;
        if last <= f64::EPSILON * (variable.beta - variable.alpha).min(x - variable.alpha).min(variable.beta - x) {
            break;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use crate::optimizer::subproblem::{Subproblem, Variable};
    use crate::optimizer::{Functions, MmaParameters};
    use slipstick_ranks::Alone;

    /// Both iterations solve the same subproblems: 0 to 3 constraints, active, inactive and
    /// violated, with elastic variables of every kind.
    #[test]
    fn the_dual_gives_the_primal_dual_solution() {
        let tight = MmaParameters { subproblem_tolerance: 1e-10, ..MmaParameters::default() };
        let all = [
            (tight, 0.0),
            (tight, 1.0),
            (MmaParameters { c: 2.0, d: 0.0, ..tight }, 0.0),
            (MmaParameters { c: 0.5, d: 3.0, ..tight }, 0.3),
        ];
        let number = |k: usize| ((k * 7919 + 13) % 1009) as f64 / 504.5 - 1.0;
        for (kind, (parameters, a)) in all.iter().enumerate() {
            for m in 0..4 {
                let variable = |index: usize| {
                    let (low, upp) = (-0.5 - 0.1 * number(index), 0.6 + 0.1 * number(index + 3));
                    Variable { index, range: 1.0, low, upp, alpha: 0.9 * low, beta: 0.4 * upp }
                };
                let variables: Vec<Variable> = (0..12).map(variable).collect();
                let gradient = |i: usize| (0..12).map(|j| number(17 * i + j)).collect::<Vec<f64>>();
                let (objective, slopes) = (gradient(9 + kind), (0..m).map(gradient).collect::<Vec<_>>());
                let values = [0.3, -4.0, 5.0];
                let functions = Functions::new(0.0, &objective, &values[..m], &slopes);
                let rho = [1e-2, 1e-5, 1e-1, 1e-3];
                let mut subproblem = Subproblem::new(parameters, &variables, &functions, &rho[..=m], &Alone);
                subproblem.a = vec![*a; m];
                let expected = subproblem.solve().unwrap();
                let mut iterations = 0;
                let (found, residual) = subproblem.solve_dual(&mut iterations);
                assert!(residual.max < 1e-9 && (iterations > 0) == (m > 0), "{kind} {m}: {:e}", residual.max);
                let pairs = [(&found.x, &expected.x), (&found.lambda, &expected.lambda), (&found.y, &expected.y)];
                for (found, expected) in pairs {
                    for (a, b) in found.iter().zip(expected) {
                        assert!((a - b).abs() < 1e-6 * (1.0 + b.abs()), "{kind} {m}: {found:?} {expected:?}");
                    }
                }
                assert!((found.z - expected.z).abs() < 1e-6);
            }
        }
    }
}
