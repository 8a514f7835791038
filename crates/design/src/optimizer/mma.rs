//! One step of the method of moving asymptotes.

use serde::{Deserialize, Serialize};
use slipstick_ranks::{Alone, Ranks, own_range};
use std::ops::Range;

use super::error::{check_functions, check_point, check_vector};
use super::kkt::residual_at_input;
use super::subproblem::{Subproblem, Variable};
use super::{Functions, KktResidual, MmaError, MmaParameters};

/// The method of moving asymptotes, version of 2007, for `n` variables and `m` constraints `g_i ≤
/// 0`.
///
/// Contains all data that one step passes to the next, so a copy that is written and read back
/// continues bit for bit; the floats must be preserved exactly (for JSON: `serde_json` with its
/// feature `float_roundtrip`).
///
/// Svanberg's cantilever: the lightest of five hollow beams whose tip moves by no more than 1.
///
/// ```
/// use slipstick_design::{Functions, Mma, MmaParameters};
///
/// let coefficients = [61.0, 37.0, 19.0, 7.0, 1.0];
/// let (lower, upper) = ([1.0; 5], [10.0; 5]);
/// let mut x = vec![5.0; 5];
/// let mut mma = Mma::new(5, 1, MmaParameters::default());
/// let mut weight = 0.0;
/// for _ in 0..15 {
///     weight = 0.0624 * x.iter().sum::<f64>();
///     let tip: f64 = (0..5).map(|j| coefficients[j] / x[j].powi(3)).sum();
///     let slopes = (0..5).map(|j| -3.0 * coefficients[j] / x[j].powi(4)).collect();
///     x = mma.update(&x, [&lower, &upper], &Functions::new(weight, &[0.0624; 5], &[tip - 1.0], &[slopes]))?.x;
/// }
/// assert!((weight - 1.33996).abs() < 1e-5);
/// # Ok::<(), slipstick_design::MmaError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mma {
    n: usize,
    m: usize,
    parameters: MmaParameters,
    /// Number of steps made.
    iteration: usize,
    /// How many of them were made before the last [`restart`](Self::restart).
    #[serde(default, skip_serializing_if = "is_zero")]
    before_restart: usize,
    /// `x` of one and of two steps ago; empty if there was no such step.
    x1: Vec<f64>,
    x2: Vec<f64>,
    /// Asymptotes of the last step; empty before the first.
    low: Vec<f64>,
    upp: Vec<f64>,
}

pub(super) fn is_zero(number: &usize) -> bool {
    *number == 0
}

/// Result of one step: the next design, and the solution of the subproblem with its multipliers.
#[derive(Clone, Debug)]
pub struct MmaStep {
    /// The next design, within the bounds and the move limit.
    pub x: Vec<f64>,
    /// Multipliers of the constraints. ≥ 0
    pub lambda: Vec<f64>,
    /// Multipliers of the lower and upper bounds of the variables. ≥ 0
    pub xi: Vec<f64>,
    /// See `xi`.
    pub eta: Vec<f64>,
    /// Elastic violation of each constraint. ≥ 0; clearly positive if no design within the move
    /// limit is feasible.
    pub y: Vec<f64>,
    /// The largest of the [functions whose largest is minimized](Functions::largest_of), as
    /// approximated at `x`; 0 without them.
    pub z: f64,
    /// Multipliers of `y ≥ 0`.
    pub mu: Vec<f64>,
    /// Multiplier of a lower bound on `z` that does not act with such functions; 1 without them.
    pub zeta: f64,
    /// Slack of each approximated constraint. ≥ 0
    pub slack: Vec<f64>,
    /// Newton iterations of the subproblem.
    pub subproblem_iterations: usize,
    /// Largest violation of the subproblem's optimality conditions.
    pub subproblem_residual: f64,
    /// Optimality residual of the design that was **passed in**, with the multipliers of this
    /// subproblem. Zero at an optimum.
    pub kkt_residual: KktResidual,
}

impl Mma {
    /// An optimizer without history for `n` variables and `m` constraints; `m = 0` is allowed.
    ///
    /// [`Self::update`] checks the parameters; call [`MmaParameters::check`] to check them earlier.
    pub fn new(n: usize, m: usize, parameters: MmaParameters) -> Self {
        let none = Vec::new;
        let (iteration, before_restart) = (0, 0);
        Self { n, m, parameters, iteration, before_restart, x1: none(), x2: none(), low: none(), upp: none() }
    }

    /// Forgets earlier designs and asymptotes, because the functions have changed: the next step
    /// starts with asymptotes as the first one did.
    pub fn restart(&mut self) {
        self.before_restart = self.iteration;
        for memory in [&mut self.x1, &mut self.x2, &mut self.low, &mut self.upp] {
            memory.clear();
        }
    }

    /// Steps that the memory knows of.
    fn remembered(&self) -> usize {
        self.iteration.saturating_sub(self.before_restart)
    }

    /// Sets the largest change of a variable, relative to its range, from the next step on.
    pub fn set_move_limit(&mut self, move_limit: f64) {
        self.parameters.move_limit = move_limit;
    }

    /// Number of steps made.
    pub fn iteration(&self) -> usize {
        self.iteration
    }

    /// The parameters.
    pub fn parameters(&self) -> &MmaParameters {
        &self.parameters
    }

    /// Lower and upper asymptotes of the last step; empty before the first.
    pub fn asymptotes(&self) -> (&[f64], &[f64]) {
        (&self.low, &self.upp)
    }

    /// Checks a history that was read back: that it is complete and belongs to `n` variables and
    /// `m` constraints.
    ///
    /// # Errors
    ///
    /// [`MmaError::Length`], [`MmaError::NotFinite`], [`MmaError::Bounds`] of an earlier design
    /// between its asymptotes, [`MmaError::Parameter`].
    pub fn check(&self, n: usize, m: usize) -> Result<(), MmaError> {
        for (what, expected, found) in [("variables", n, self.n), ("constraints", m, self.m)] {
            if expected != found {
                return Err(MmaError::Length { what: format!("the optimizer's list of {what}"), expected, found });
            }
        }
        self.parameters.check()?;
        self.check_memory()
    }

    /// Checks the lengths and entries of the history.
    fn check_memory(&self) -> Result<(), MmaError> {
        let after = |steps: usize| if self.remembered() < steps { 0 } else { self.n };
        check_vector("the design one step ago", &self.x1, after(1))?;
        check_vector("the design two steps ago", &self.x2, after(2))?;
        check_vector("the list of lower asymptotes", &self.low, after(1))?;
        check_vector("the list of upper asymptotes", &self.upp, after(1))?;
        let asymptotes = self.low.iter().zip(&self.upp).zip(&self.x1);
        match asymptotes.enumerate().find(|(_, ((low, upp), x))| !(low <= x && x <= upp)) {
            Some((index, ((&lower, &upper), &value))) => Err(MmaError::Bounds { index, value, lower, upper }),
            None => Ok(()),
        }
    }

    /// Computes the next design from the design `x` with its functions, between the `bounds`, lower
    /// and upper. A variable whose bounds are equal does not move.
    ///
    /// # Errors
    ///
    /// If a parameter is out of range, lengths are wrong (including those of the history), an entry
    /// is not finite, the design is outside its bounds, or the subproblem cannot be solved. The
    /// history is then unchanged.
    pub fn update(&mut self, x: &[f64], bounds: [&[f64]; 2], functions: &Functions<'_>) -> Result<MmaStep, MmaError> {
        self.update_on(x, bounds, functions, &Alone)
    }

    /// Like [`update`](Self::update), with the subproblem distributed over ranks, which all call it
    /// with the same arguments and get the same result.
    ///
    /// # Errors
    ///
    /// Those of [`update`](Self::update), on all ranks.
    pub fn update_on(
        &mut self,
        x: &[f64],
        bounds: [&[f64]; 2],
        functions: &Functions<'_>,
        ranks: &dyn Ranks,
    ) -> Result<MmaStep, MmaError> {
        self.update_with(x, bounds, functions, &vec![self.parameters.raa0; self.m + 1], ranks)
    }

    /// Like [`update_on`](Self::update_on), with the curvature of each function, the objective
    /// first.
    pub(super) fn update_with(
        &mut self,
        x: &[f64],
        bounds: [&[f64]; 2],
        functions: &Functions<'_>,
        rho: &[f64],
        ranks: &dyn Ranks,
    ) -> Result<MmaStep, MmaError> {
        self.parameters.check()?;
        self.check_memory()?;
        check_point(self.n, x, bounds)?;
        check_functions(self.n, self.m, functions)?;
        let (low, upp) = self.moved_asymptotes(x, bounds, own_range(self.n, ranks));
        let step = self.solve(x, bounds, functions, rho, [&low, &upp], ranks)?;

        self.x2 = std::mem::replace(&mut self.x1, x.to_vec());
        self.low = ranks.join(&low);
        self.upp = ranks.join(&upp);
        self.iteration += 1;
        Ok(step)
    }

    /// Solves the subproblem of the last step again, with other curvatures.
    pub(super) fn solve_again(
        &self,
        bounds: [&[f64]; 2],
        functions: &Functions<'_>,
        rho: &[f64],
        ranks: &dyn Ranks,
    ) -> Result<MmaStep, MmaError> {
        let own = own_range(self.n, ranks);
        self.solve(&self.x1, bounds, functions, rho, [&self.low[own.clone()], &self.upp[own]], ranks)
    }

    /// Changes of all approximated functions between the design of the last step and `x`, the
    /// objective first, and the distance of `x`: see [`Subproblem::changes`].
    pub(super) fn approximated_changes(
        &self,
        x: &[f64],
        bounds: [&[f64]; 2],
        functions: &Functions<'_>,
        rho: &[f64],
        ranks: &dyn Ranks,
    ) -> (Vec<f64>, f64) {
        let own = own_range(self.n, ranks);
        let asymptotes = [&self.low[own.clone()], &self.upp[own.clone()]];
        let variables = self.variables(&self.x1, bounds, asymptotes, own);
        let scaled = |v: &Variable| (x[v.index] - self.x1[v.index]) / v.range;
        let t: Vec<f64> = variables.iter().map(scaled).collect();
        Subproblem::new(&self.parameters, &variables, functions, rho, ranks).changes(&t)
    }

    /// Solves the subproblem at `x` between these asymptotes, those of this rank's variables.
    fn solve(
        &self,
        x: &[f64],
        bounds: [&[f64]; 2],
        functions: &Functions<'_>,
        rho: &[f64],
        asymptotes: [&[f64]; 2],
        ranks: &dyn Ranks,
    ) -> Result<MmaStep, MmaError> {
        let [lower, upper] = bounds;
        let own = own_range(self.n, ranks);
        let variables = self.variables(x, bounds, asymptotes, own.clone());
        let mut subproblem = Subproblem::new(&self.parameters, &variables, functions, rho, ranks);
        let solution = subproblem.solve_with_opposed(functions)?;

        let mut step = MmaStep {
            x: x[own.clone()].to_vec(),
            lambda: solution.lambda,
            xi: vec![0.0; own.len()],
            eta: vec![0.0; own.len()],
            y: solution.y,
            z: solution.z + subproblem.shift,
            mu: solution.mu,
            zeta: solution.zeta,
            slack: solution.slack,
            subproblem_iterations: solution.iterations,
            subproblem_residual: solution.residual,
            kkt_residual: KktResidual { norm: 0.0, max: 0.0 },
        };
        for (k, variable) in variables.iter().enumerate() {
            let (j, t, range) = (variable.index, solution.x[k], variable.range);
            // Round-off must not move the sum beyond a bound.
            let at = j - own.start;
            step.x[at] = (x[j] + t * range).clamp(lower[j], upper[j]);
            step.xi[at] = solution.xi[k] / range;
            step.eta[at] = solution.eta[k] / range;
        }
        for values in [&mut step.x, &mut step.xi, &mut step.eta] {
            *values = ranks.join(values);
        }
        step.kkt_residual = residual_at_input(&self.parameters, x, bounds, functions, &step);
        Ok(step)
    }

    /// Asymptotes `l_j < x_j < u_j` of this step for some of the variables. Notes, section on the
    /// asymptotes: at `asyinit` of the range for two steps, then closer if a variable oscillates
    /// and farther if it keeps moving in the same direction.
    fn moved_asymptotes(&self, x: &[f64], bounds: [&[f64]; 2], own: Range<usize>) -> (Vec<f64>, Vec<f64>) {
        let (p, [lower, upper]) = (&self.parameters, bounds);
        let distances = |j: usize| -> (f64, f64) {
            let range = upper[j] - lower[j];
            if self.remembered() < 2 {
                return (p.asyinit * range, p.asyinit * range);
            }
            let turn = (x[j] - self.x1[j]) * (self.x1[j] - self.x2[j]);
            let factor = if turn > 0.0 {
                p.asyincr
            } else if turn < 0.0 {
                p.asydecr
            } else {
                1.0
            };
            let limited = |distance: f64| (factor * distance).clamp(p.asymin * range, p.asymax * range);
            (limited(self.x1[j] - self.low[j]), limited(self.upp[j] - self.x1[j]))
        };
        own.map(|j| {
            let (below, above) = distances(j);
            (x[j] - below, x[j] + above)
        })
        .unzip()
    }

    /// The movable ones among some variables between their asymptotes, with the bounds `α ≤ x ≤ β`
    /// of this step.
    fn variables(
        &self,
        x: &[f64],
        [lower, upper]: [&[f64]; 2],
        [low, upp]: [&[f64]; 2],
        own: Range<usize>,
    ) -> Vec<Variable> {
        let p = &self.parameters;
        let variable = |j: usize| {
            let range = upper[j] - lower[j];
            let scaled = |bound: f64| (bound - x[j]) / range;
            let (below, above) = (scaled(low[j - own.start]), scaled(upp[j - own.start]));
            let alpha = scaled(lower[j]).max((1.0 - p.albefa) * below).max(-p.move_limit);
            let beta = scaled(upper[j]).min((1.0 - p.albefa) * above).min(p.move_limit);
            Variable { index: j, range, low: below, upp: above, alpha, beta }
        };
        own.clone().map(variable).filter(Variable::can_move).collect()
    }
}
