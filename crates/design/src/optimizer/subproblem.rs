//! The separable convex subproblem of MMA.
//!
//! Minimize `f̃₀(x) + z + Σ_i (c y_i + ½ d y_i²)` subject to `f̃_i(x) − a_i z − y_i ≤ 0`, `α ≤ x ≤
//! β`, `y, z ≥ 0`, where
//!
//! `f̃_i(x) = f_i(x⁰) + Σ_j [ p_ij/(u_j − x_j) + q_ij/(x_j − l_j) ] − [ the same at x⁰ ]`.
//!
//! Internally, each `x_j` is shifted and scaled, see [`Variable`]. MMA and GCMMA differ only in the
//! curvature ρ_i that is added to each function. Source: the notes, section on the subproblem.

use super::{Functions, MmaParameters};
use slipstick_ranks::Ranks;

/// A variable `t = (x − x⁰)/(upper − lower)` that can move in this step; it starts at 0.
///
/// It is shifted so that distances to close bounds stay accurate for any position of the bounds,
/// and scaled so that the iteration does not depend on units.
pub(super) struct Variable {
    /// Its number among all variables.
    pub index: usize,
    /// Its upper minus its lower bound, in units of `x`.
    pub range: f64,
    /// Its asymptotes, `low < 0 < upp`.
    pub low: f64,
    /// See `low`.
    pub upp: f64,
    /// Its bounds in this step, `low < α ≤ 0 ≤ β < upp`.
    pub alpha: f64,
    /// See `alpha`.
    pub beta: f64,
}

impl Variable {
    /// Whether there is room between the bounds and to the asymptotes; false if the range is zero.
    pub fn can_move(&self) -> bool {
        self.range > 0.0 && self.alpha < self.beta && self.low < self.alpha && self.beta < self.upp
    }

    /// `(p_j, q_j)` of a function with derivative `slope = ∂f/∂x_j`, for `t`.
    fn approximation(&self, slope: f64, rho: f64) -> (f64, f64) {
        let slope = slope * self.range;
        let (rising, falling) = (slope.max(0.0), (-slope).max(0.0));
        let both = 0.001 * (rising + falling) + rho;
        (self.upp.powi(2) * (rising + both), self.low.powi(2) * (falling + both))
    }
}

/// The subproblem, or this rank's part of its variables. Coefficients of constraint `i` and
/// variable `j` are at `j·m + i`.
pub(super) struct Subproblem<'a> {
    pub parameters: &'a MmaParameters,
    pub variables: &'a [Variable],
    p0: Vec<f64>,
    q0: Vec<f64>,
    p: Vec<f64>,
    q: Vec<f64>,
    /// `f_i(x⁰)`, for `a_i > 0` minus [`shift`](Self::shift).
    pub values: Vec<f64>,
    /// Coefficients `a_i` of z.
    pub a: Vec<f64>,
    /// Added to z, it gives the largest of the functions with `a_i > 0`. It is so low that z ≥ 0
    /// never acts.
    pub shift: f64,
    /// Largest derivative (with respect to `t`) or value, at least 1.
    pub scale: f64,
    /// The ranks over which the variables are distributed.
    pub ranks: &'a dyn Ranks,
}

impl<'a> Subproblem<'a> {
    /// Approximates functions with these values and gradients at the variables' `x`. Only
    /// `variables` can move. `rho` is the curvature of each function, the objective first.
    pub fn new(
        parameters: &'a MmaParameters,
        variables: &'a [Variable],
        functions: &Functions<'a>,
        rho: &[f64],
        ranks: &'a dyn Ranks,
    ) -> Self {
        let &Functions { objective_gradient, constraints, constraint_gradients, largest_of, .. } = functions;
        let (p0, q0) = variables.iter().map(|v| v.approximation(objective_gradient[v.index], rho[0])).unzip();
        let gradients = || constraint_gradients.iter();
        let with_rho = || gradients().zip(&rho[1..]);
        let of_variable = |v: &'a Variable| with_rho().map(|(gradient, &rho)| v.approximation(gradient[v.index], rho));
        let (p, q) = variables.iter().flat_map(of_variable).unzip();
        let a: Vec<f64> = (0..constraints.len()).map(|i| if i < largest_of { 1.0 } else { 0.0 }).collect();
        let shift = lowest(&constraints[..largest_of], &constraint_gradients[..largest_of], variables, ranks);
        let values: Vec<f64> = constraints.iter().zip(&a).map(|(value, a)| value - a * shift).collect();
        let mut scale = constraints.iter().fold(1.0, |scale: f64, value| scale.max(value.abs()));
        for variable in variables {
            let slopes = gradients().map(|gradient| gradient[variable.index]);
            for slope in slopes.chain([objective_gradient[variable.index]]) {
                scale = scale.max((slope * variable.range).abs());
            }
        }
        let scale = ranks.largest(scale);
        Self { parameters, variables, p0, q0, p, q, values, a, shift, scale, ranks }
    }

    /// `∂f̃₀/∂x_j + Σ_i λ_i ∂f̃_i/∂x_j` from its parts: `p_j + Σ λ_i p_ij` and `q_j + Σ λ_i q_ij`.
    pub fn combined(&self, j: usize, lambda: &[f64]) -> (f64, f64) {
        let m = lambda.len();
        let (mut p, mut q) = (self.p0[j], self.q0[j]);
        for i in 0..m {
            p += lambda[i] * self.p[j * m + i];
            q += lambda[i] * self.q[j * m + i];
        }
        (p, q)
    }

    /// The coefficients `p_ij` and `q_ij` at a place.
    pub fn coefficients(&self, at: usize) -> (f64, f64) {
        (self.p[at], self.q[at])
    }

    /// Σ a_i λ_i.
    pub fn bounding(&self, lambda: &[f64]) -> f64 {
        self.a.iter().zip(lambda).map(|(a, lambda)| a * lambda).sum()
    }

    /// Initial values of the sums over all variables on this rank: the values of the constraints
    /// are added only once.
    pub fn first_values(&self) -> Vec<f64> {
        if self.ranks.rank() == 0 { self.values.clone() } else { vec![0.0; self.values.len()] }
    }

    /// Adds `f̃_i(t) − f_i(0)` of variable `j` to `values`, as a product with `t`, which avoids
    /// cancellation.
    pub fn add_values(&self, j: usize, x: f64, to_upp: f64, to_low: f64, values: &mut [f64]) {
        let (variable, m) = (&self.variables[j], values.len());
        let upper = x * to_upp / variable.upp;
        let lower = x * to_low / -variable.low;
        for i in 0..m {
            values[i] += self.p[j * m + i] * upper - self.q[j * m + i] * lower;
        }
    }

    /// Changes `f̃_i(t) − f_i(0)` of objective and constraints, the objective first, and the
    /// distance `d(t) = Σ_j t²(u_j − l_j)/((u_j − t)(t − l_j))`, which is `∂f̃_i/∂ρ_i`. Notes,
    /// section on the update of ρ. Test: `distance_is_the_slope_in_rho`.
    pub fn changes(&self, t: &[f64]) -> (Vec<f64>, f64) {
        let m = self.values.len();
        let mut constraints = vec![0.0; m];
        let (mut objective, mut distance) = (0.0, 0.0);
        for (j, (variable, &t)) in self.variables.iter().zip(t).enumerate() {
            let (to_upp, to_low) = (1.0 / (variable.upp - t), 1.0 / (t - variable.low));
            objective += self.p0[j] * t * to_upp / variable.upp + self.q0[j] * t * to_low / variable.low;
            distance += t * t * (variable.upp - variable.low) * to_upp * to_low;
            self.add_values(j, t, to_upp, to_low, &mut constraints);
        }
        let mut sums = [&[objective], &*constraints, &[distance]].concat();
        self.ranks.sum(&mut sums);
        let distance = sums.pop().unwrap_or(0.0);
        (sums, distance)
    }

    /// `slopes[i] = ∂f̃_i/∂x_j` from `1/(u_j − x_j)²` and `1/(x_j − l_j)²`.
    pub fn slopes(&self, j: usize, upp2: f64, low2: f64, slopes: &mut [f64]) {
        let m = slopes.len();
        for i in 0..m {
            slopes[i] = self.p[j * m + i] * upp2 - self.q[j * m + i] * low2;
        }
    }
}

/// A number that is below the largest of some functions everywhere between the bounds of this step,
/// by at least 1: the approximations are convex, so they are nowhere below their linearizations. 0
/// without functions.
fn lowest(values: &[f64], gradients: &[Vec<f64>], variables: &[Variable], ranks: &dyn Ranks) -> f64 {
    let Some(first) = (0..values.len()).max_by(|&a, &b| values[a].total_cmp(&values[b])) else { return 0.0 };
    let fall = |v: &Variable| {
        let slope = gradients[first][v.index] * v.range;
        if slope > 0.0 { slope * -v.alpha } else { -slope * v.beta }
    };
    let mut fall = [variables.iter().map(fall).sum::<f64>()];
    ranks.sum(&mut fall);
    values[first] - fall[0] - 1.0
}
