//! Primal-dual interior-point solution of the subproblem.
//!
//! The optimality conditions, with each complementarity product set to ε instead of 0, are solved
//! by damped Newton steps for ε = 1, 0.1, … down to the tolerance. All unknowns except the
//! multipliers of the constraints and of `z` are eliminated, so a Newton step costs O(n m²) and
//! solves one system of size m + 1. Each rank has a part of the variables; the unknowns of the
//! constraints are replicated. Source: the notes, section on the primal-dual solution; the
//! treatment of slacks is our own.

use super::MmaError;
use super::dense::solve_dense;
use super::subproblem::{Subproblem, Variable};

/// Maximum number of Newton iterations for one ε.
const MOST_ITERATIONS: usize = 200;
/// Maximum number of halvings of a Newton step; if more are needed, round-off dominates.
const MOST_HALVINGS: usize = 50;
/// Residual, relative to the largest derivative or value, that is still acceptable if round-off
/// dominates.
const SUFFICIENT: f64 = 1e-6;

/// Solution of the subproblem; `x`, `xi`, `eta` are those of this rank's variables that can move.
pub(super) struct Solution {
    pub x: Vec<f64>,
    pub xi: Vec<f64>,
    pub eta: Vec<f64>,
    pub lambda: Vec<f64>,
    pub y: Vec<f64>,
    pub z: f64,
    pub mu: Vec<f64>,
    pub zeta: f64,
    pub slack: Vec<f64>,
    pub iterations: usize,
    pub residual: f64,
}

/// All unknowns, or their changes in a Newton step.
#[derive(Clone)]
pub(super) struct Point {
    pub x: Vec<f64>,
    pub xi: Vec<f64>,
    pub eta: Vec<f64>,
    pub lambda: Vec<f64>,
    pub y: Vec<f64>,
    pub mu: Vec<f64>,
    pub slack: Vec<f64>,
    pub z: f64,
    pub zeta: f64,
}

impl Point {
    /// `self = from + length · direction`.
    fn set_sum(&mut self, from: &Point, length: f64, direction: &Point) {
        let add = |to: &mut [f64], from: &[f64], change: &[f64]| {
            for ((to, from), change) in to.iter_mut().zip(from).zip(change) {
                *to = from + length * change;
            }
        };
        add(&mut self.x, &from.x, &direction.x);
        add(&mut self.xi, &from.xi, &direction.xi);
        add(&mut self.eta, &from.eta, &direction.eta);
        add(&mut self.lambda, &from.lambda, &direction.lambda);
        add(&mut self.y, &from.y, &direction.y);
        add(&mut self.mu, &from.mu, &direction.mu);
        add(&mut self.slack, &from.slack, &direction.slack);
        self.z = from.z + length * direction.z;
        self.zeta = from.zeta + length * direction.zeta;
    }
}

/// Size of the residual of the optimality conditions.
#[derive(Clone, Copy)]
pub(super) struct Residual {
    /// Sum of squares; not finite if any residual is not.
    pub squares: f64,
    /// Largest absolute residual. Ignores NaN: check `squares` first.
    pub max: f64,
}

impl Residual {
    fn add(&mut self, residual: f64) {
        self.squares += residual * residual;
        self.max = self.max.max(residual.abs());
    }

    fn is_finite(self) -> bool {
        self.squares.is_finite()
    }
}

impl Subproblem<'_> {
    /// Solves the subproblem; if the iteration stops far from a solution, by its
    /// [dual](super::dual_ascent).
    ///
    /// # Errors
    ///
    /// [`MmaError::Subproblem`] if rounding or overflow stops the iteration far from a solution.
    pub fn solve(&self) -> Result<Solution, MmaError> {
        let mut at = self.start();
        let mut iterations = 0;
        let mut epsilon = 1.0;
        let mut residual = loop {
            let residual = self.centre(&mut at, epsilon, &mut iterations);
            if epsilon <= self.parameters.subproblem_tolerance {
                break residual;
            }
            epsilon = (0.1 * epsilon).max(self.parameters.subproblem_tolerance);
        };
        let sufficient = self.parameters.subproblem_tolerance.max(SUFFICIENT * self.scale);
        let solves = |residual: Residual| residual.is_finite() && residual.max <= sufficient;
        if !solves(residual) {
            (at, residual) = self.solve_dual(&mut iterations);
        }
        if !solves(residual) {
            return Err(MmaError::Subproblem { residual: residual.squares.sqrt() });
        }
        let residual = residual.max;
        let Point { x, xi, eta, lambda, y, mu, slack, z, zeta } = at;
        Ok(Solution { x, xi, eta, lambda, y, z, mu, zeta, slack, iterations, residual })
    }

    /// The starting point of the notes: the middle of the bounds, and everything else of order 1.
    pub(super) fn start(&self) -> Point {
        let m = self.values.len();
        let of_variables = |value: fn(&Variable) -> f64| self.variables.iter().map(value).collect::<Vec<f64>>();
        Point {
            x: of_variables(|v| 0.5 * (v.alpha + v.beta)),
            xi: of_variables(|v| (2.0 / (v.beta - v.alpha)).max(1.0)),
            eta: of_variables(|v| (2.0 / (v.beta - v.alpha)).max(1.0)),
            lambda: vec![1.0; m],
            y: vec![1.0; m],
            mu: vec![(0.5 * self.parameters.c).max(1.0); m],
            slack: vec![1.0; m],
            z: self.values.iter().zip(&self.a).fold(1.0, |z: f64, (value, a)| z.max(a * value)),
            zeta: 1.0,
        }
    }

    /// Newton iteration for one ε, until no residual is above 0.9 ε or round-off stops it.
    pub(super) fn centre(&self, at: &mut Point, epsilon: f64, iterations: &mut usize) -> Residual {
        let mut residual = self.residual_with_free_slack(at, epsilon);
        let mut next = at.clone();
        let mut direction = at.clone();
        for _ in 0..MOST_ITERATIONS {
            if residual.max <= 0.9 * epsilon || !residual.is_finite() {
                break;
            }
            if !self.newton_direction(at, epsilon, &mut direction) {
                break;
            }
            *iterations += 1;
            let mut length = self.longest_step(at, &direction);
            let decreased = (0..MOST_HALVINGS).find_map(|_| {
                next.set_sum(at, length, &direction);
                length *= 0.5;
                let trial = self.residual_with_free_slack(&mut next, epsilon);
                (trial.squares < residual.squares).then_some(trial)
            });
            let Some(trial) = decreased else { break };
            residual = trial;
            std::mem::swap(at, &mut next);
        }
        residual
    }

    /// Residual of the optimality conditions at `at`, after adjusting slacks to reduce it.
    ///
    /// The slack of an inactive constraint can follow the curved constraint exactly, at almost no
    /// cost in complementarity. Without this, Newton steps would have to be so short that the
    /// linearization of the constraint is accurate, which an inactive constraint does not need, and
    /// the iteration would be very slow.
    pub(super) fn residual_with_free_slack(&self, at: &mut Point, epsilon: f64) -> Residual {
        let p = self.parameters;
        let mut residual = Residual { squares: 0.0, max: 0.0 };
        let mut values = self.first_values();
        for (j, variable) in self.variables.iter().enumerate() {
            let (x, xi, eta) = (at.x[j], at.xi[j], at.eta[j]);
            let (to_upp, to_low) = (1.0 / (variable.upp - x), 1.0 / (x - variable.low));
            let (rising, falling) = self.combined(j, &at.lambda);
            residual.add(rising * to_upp * to_upp - falling * to_low * to_low - xi + eta);
            residual.add(xi * (x - variable.alpha) - epsilon);
            residual.add(eta * (variable.beta - x) - epsilon);
            self.add_values(j, x, to_upp, to_low, &mut values);
        }
        values.push(residual.squares);
        self.ranks.sum(&mut values);
        residual = Residual { squares: values[at.y.len()], max: self.ranks.largest(residual.max) };
        values.truncate(at.y.len());
        for (i, value) in values.iter().enumerate() {
            residual.add(p.c + p.d * at.y[i] - at.mu[i] - at.lambda[i]);
            let a = self.a[i];
            let violation = value - a * at.z - at.y[i] + at.slack[i];
            let (free, lambda) = (a * at.z + at.y[i] - value, at.lambda[i]);
            let kept = violation.powi(2) + (lambda * at.slack[i] - epsilon).powi(2);
            if free > 0.0 && (lambda * free - epsilon).powi(2) < kept {
                at.slack[i] = free;
            } else {
                residual.add(violation);
            }
            residual.add(at.mu[i] * at.y[i] - epsilon);
            residual.add(at.lambda[i] * at.slack[i] - epsilon);
        }
        residual.add(1.0 - at.zeta - self.bounding(&at.lambda));
        residual.add(at.zeta * at.z - epsilon);
        residual
    }

    /// Newton direction at `at`; `false` if the reduced system is singular or not finite.
    fn newton_direction(&self, at: &Point, epsilon: f64, direction: &mut Point) -> bool {
        let p = self.parameters;
        let m = at.lambda.len();
        let size = m + 1;
        let mut matrix = vec![0.0; size * size];
        let mut right = vec![0.0; size];
        let mut values = self.first_values();
        let mut slopes = vec![0.0; m];
        for j in 0..self.variables.len() {
            let terms = self.linearise(j, at, epsilon, &mut slopes);
            self.add_values(j, at.x[j], terms.to_upp, terms.to_low, &mut values);
            for i in 0..m {
                right[i] -= slopes[i] * terms.gradient / terms.curvature;
                for k in 0..=i {
                    matrix[i * size + k] += slopes[i] * slopes[k] / terms.curvature;
                }
            }
        }
        let mut sums = [&*matrix, &right, &values].concat();
        self.ranks.sum(&mut sums);
        matrix.copy_from_slice(&sums[..size * size]);
        right.copy_from_slice(&sums[size * size..][..size]);
        values.copy_from_slice(&sums[size * (size + 1)..]);
        for i in 0..m {
            let curvature_y = p.d + at.mu[i] / at.y[i];
            let gradient_y = p.c + p.d * at.y[i] - at.lambda[i] - epsilon / at.y[i];
            right[i] += values[i] - self.a[i] * at.z - at.y[i] + epsilon / at.lambda[i] + gradient_y / curvature_y;
            matrix[i * size + i] += at.slack[i] / at.lambda[i] + 1.0 / curvature_y;
            for k in 0..i {
                matrix[k * size + i] = matrix[i * size + k];
            }
            matrix[i * size + m] = self.a[i];
            matrix[m * size + i] = self.a[i];
        }
        matrix[m * size + m] = -at.zeta / at.z;
        right[m] = 1.0 - self.bounding(&at.lambda) - epsilon / at.z;
        if !solve_dense(&mut matrix, &mut right) {
            return false;
        }
        self.back_substitute(at, epsilon, &right, direction);
        true
    }

    /// Gradient and curvature of the barrier Lagrangian in `x_j`, and `slopes[i] = ∂f̃_i/∂x_j`.
    fn linearise(&self, j: usize, at: &Point, epsilon: f64, slopes: &mut [f64]) -> Terms {
        let (variable, x) = (&self.variables[j], at.x[j]);
        let (to_upp, to_low) = (1.0 / (variable.upp - x), 1.0 / (x - variable.low));
        let (upp2, low2) = (to_upp * to_upp, to_low * to_low);
        let (to_alpha, to_beta) = (1.0 / (x - variable.alpha), 1.0 / (variable.beta - x));
        let (rising, falling) = self.combined(j, &at.lambda);
        self.slopes(j, upp2, low2, slopes);
        Terms {
            gradient: rising * upp2 - falling * low2 - epsilon * to_alpha + epsilon * to_beta,
            curvature: 2.0 * (rising * upp2 * to_upp + falling * low2 * to_low)
                + at.xi[j] * to_alpha
                + at.eta[j] * to_beta,
            to_upp,
            to_low,
            to_alpha,
            to_beta,
        }
    }

    /// Computes all other changes from those of the multipliers and of `z`.
    fn back_substitute(&self, at: &Point, epsilon: f64, reduced: &[f64], direction: &mut Point) {
        let p = self.parameters;
        let m = at.lambda.len();
        direction.lambda.copy_from_slice(&reduced[..m]);
        direction.z = reduced[m];
        direction.zeta = epsilon / at.z - at.zeta - at.zeta * direction.z / at.z;
        let mut slopes = vec![0.0; m];
        for j in 0..self.variables.len() {
            let terms = self.linearise(j, at, epsilon, &mut slopes);
            let coupling: f64 = slopes.iter().zip(&direction.lambda).map(|(slope, change)| slope * change).sum();
            let dx = -(terms.gradient + coupling) / terms.curvature;
            direction.x[j] = dx;
            direction.xi[j] = (epsilon - at.xi[j] * dx) * terms.to_alpha - at.xi[j];
            direction.eta[j] = (epsilon + at.eta[j] * dx) * terms.to_beta - at.eta[j];
        }
        for i in 0..m {
            let curvature_y = p.d + at.mu[i] / at.y[i];
            let gradient_y = p.c + p.d * at.y[i] - at.lambda[i] - epsilon / at.y[i];
            direction.y[i] = (direction.lambda[i] - gradient_y) / curvature_y;
            direction.mu[i] = (epsilon - at.mu[i] * direction.y[i]) / at.y[i] - at.mu[i];
            direction.slack[i] = (epsilon - at.slack[i] * direction.lambda[i]) / at.lambda[i] - at.slack[i];
        }
    }

    /// Longest step, at most 1, that covers at most 1/1.01 of the distance to any bound.
    fn longest_step(&self, at: &Point, direction: &Point) -> f64 {
        let mut inverse: f64 = 1.0;
        let mut shrink = |values: &[f64], changes: &[f64]| {
            for (value, change) in values.iter().zip(changes) {
                inverse = inverse.max(-1.01 * change / value);
            }
        };
        shrink(&at.xi, &direction.xi);
        shrink(&at.eta, &direction.eta);
        shrink(&at.lambda, &direction.lambda);
        shrink(&at.y, &direction.y);
        shrink(&at.mu, &direction.mu);
        shrink(&at.slack, &direction.slack);
        shrink(&[at.z, at.zeta], &[direction.z, direction.zeta]);
        for (j, variable) in self.variables.iter().enumerate() {
            let change = 1.01 * direction.x[j];
            inverse = inverse.max(-change / (at.x[j] - variable.alpha)).max(change / (variable.beta - at.x[j]));
        }
        1.0 / self.ranks.largest(inverse)
    }
}

/// The linearization in one variable, with the inverse distances to asymptotes and bounds.
struct Terms {
    gradient: f64,
    curvature: f64,
    to_upp: f64,
    to_low: f64,
    to_alpha: f64,
    to_beta: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimizer::Functions;
    use crate::optimizer::MmaParameters;
    use slipstick_ranks::Alone;

    /// Computed by hand: a constraint of −2 with z = 0.5 of weight 0.5 and y = 0.25 leaves a slack
    /// of 2.5. It is used if it costs less in complementarity than the violation of the constraint,
    /// and not with a multiplier of 100.
    #[test]
    fn slack_is_moved_where_that_costs_little() {
        let parameters = MmaParameters::default();
        let variables = [Variable { index: 0, range: 1.0, low: -0.5, upp: 0.5, alpha: -0.4, beta: 0.4 }];
        let slopes = [vec![0.0]];
        let functions = Functions::new(0.0, &[0.0], &[-2.0], &slopes);
        let mut subproblem = Subproblem::new(&parameters, &variables, &functions, &[1e-5; 2], &Alone);
        subproblem.a = vec![0.5];
        for (lambda, slack) in [(1e-3, 2.5), (100.0, 1.0)] {
            let mut at = Point { z: 0.5, y: vec![0.25], lambda: vec![lambda], slack: vec![1.0], ..subproblem.start() };
            let found = subproblem.residual_with_free_slack(&mut at, 1e-3);
            assert_eq!((at.slack[0], at.x[0]), (slack, 0.0));
            // two bounds of the variable, y, the constraint, whose violation is what the slack leaves,
            // μ y, λ s, z and ζ z; ε is 1e-3
            let of_y = parameters.c + parameters.d * 0.25 - at.mu[0] - lambda;
            let of_z = 1.0 - at.zeta - 0.5 * lambda;
            let all = [
                at.xi[0] * 0.4 - 1e-3,
                at.eta[0] * 0.4 - 1e-3,
                of_y,
                2.5 - slack,
                0.25 * at.mu[0] - 1e-3,
                lambda * slack - 1e-3,
                of_z,
                0.5 * at.zeta - 1e-3,
            ];
            let squares: f64 = all.iter().map(|r| r * r).sum();
            assert!((found.squares / squares - 1.0).abs() < 1e-12, "{} {squares}", found.squares);
        }
    }
}
