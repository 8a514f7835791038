//! Compares MMA steps with another solution of the same subproblem.

use super::large::springs;
use super::*;

/// The asymptotes and the approximation of the notes, implemented independently for one constraint:
/// the minimizer of the Lagrangian for given λ in closed form, and λ by bisection on the
/// approximated constraint.
struct Dual {
    low: Vec<f64>,
    upp: Vec<f64>,
    history: Vec<Vec<f64>>,
}

impl Dual {
    fn move_asymptotes(&mut self, x: &[f64], range: f64) {
        for j in 0..x.len() {
            let k = self.history.len();
            if k < 2 {
                (self.low[j], self.upp[j]) = (x[j] - 0.5 * range, x[j] + 0.5 * range);
                continue;
            }
            let (last, before) = (self.history[k - 1][j], self.history[k - 2][j]);
            let factor = match (x[j] - last) * (last - before) {
                turn if turn > 0.0 => 1.2,
                turn if turn < 0.0 => 0.7,
                _ => 1.0,
            };
            let low = x[j] - factor * (last - self.low[j]);
            let upp = x[j] + factor * (self.upp[j] - last);
            self.low[j] = low.max(x[j] - 10.0 * range).min(x[j] - 0.01 * range);
            self.upp[j] = upp.min(x[j] + 10.0 * range).max(x[j] + 0.01 * range);
        }
        self.history.push(x.to_vec());
    }

    fn step(&mut self, x: &[f64], bounds: (f64, f64), functions: &Evaluated) -> (Vec<f64>, f64) {
        let range = bounds.1 - bounds.0;
        self.move_asymptotes(x, range);
        let (low, upp) = (&self.low, &self.upp);
        let pq = |slope: f64, j: usize| {
            let extra = 0.001 * slope.abs() + 1e-5 / range;
            ((upp[j] - x[j]).powi(2) * (slope.max(0.0) + extra), (x[j] - low[j]).powi(2) * ((-slope).max(0.0) + extra))
        };
        let minimiser = |lambda: f64, j: usize| {
            let ((p0, q0), (p1, q1)) = (pq(functions.1[j], j), pq(functions.3[0][j], j));
            let (p, q) = ((p0 + lambda * p1).sqrt(), (q0 + lambda * q1).sqrt());
            let alpha = bounds.0.max(0.9 * low[j] + 0.1 * x[j]).max(x[j] - 0.5 * range);
            let beta = bounds.1.min(0.9 * upp[j] + 0.1 * x[j]).min(x[j] + 0.5 * range);
            ((p * low[j] + q * upp[j]) / (p + q)).clamp(alpha, beta)
        };
        let constraint = |lambda: f64| {
            let change = |j: usize| {
                let ((p, q), y) = (pq(functions.3[0][j], j), minimiser(lambda, j));
                p / (upp[j] - y) + q / (y - low[j]) - p / (upp[j] - x[j]) - q / (x[j] - low[j])
            };
            functions.2[0] + (0..x.len()).map(change).sum::<f64>()
        };
        let (mut below, mut above) = (0.0, 1000.0);
        for _ in 0..200 {
            let middle = 0.5 * (below + above);
            if constraint(middle) > 0.0 { below = middle } else { above = middle }
        }
        ((0..x.len()).map(|j| minimiser(below, j)).collect(), below)
    }
}

/// Functions, start and bounds.
type Problem<'a> = (&'a dyn Fn(&[f64]) -> Evaluated, Vec<f64>, (f64, f64));

/// Compares each of the first steps with bisection of the dual, from the same designs.
#[test]
fn steps_agree_with_bisection_of_the_dual() {
    let (springs, _) = springs(300);
    let problems: [Problem; 2] = [(&cantilever, vec![5.0; 5], (1.0, 10.0)), (&springs, vec![0.3; 300], (0.05, 1.0))];
    for (functions, start, bounds) in problems {
        let n = start.len();
        let mut mma = Mma::new(n, 1, tight());
        let mut dual = Dual { low: vec![0.0; n], upp: vec![0.0; n], history: Vec::new() };
        let mut x = start;
        for _ in 0..12 {
            let mut values = functions(&x);
            // No multiplier is close to the penalty c = 1000 of a violation, which the dual does
            // not include.
            let size = values.1.iter().fold(0.0, |size: f64, value| size.max(value.abs()));
            values.1.iter_mut().for_each(|value| *value /= size);
            let bound_vectors = (vec![bounds.0; n], vec![bounds.1; n]);
            let step = mma
                .update(
                    &x,
                    [&bound_vectors.0, &bound_vectors.1],
                    &Functions::new(values.0 / size, &values.1, &values.2, &values.3),
                )
                .unwrap();
            let (expected, lambda) = dual.step(&x, bounds, &values);
            for j in 0..n {
                assert!((step.x[j] - expected[j]).abs() < 1e-8, "{} {}", step.x[j], expected[j]);
            }
            assert!((step.lambda[0] / lambda - 1.0).abs() < 1e-6, "{} {lambda}", step.lambda[0]);
            x = step.x;
        }
    }
}
