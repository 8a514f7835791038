//! Conservative approximations: MMA with monotone progress.

use serde::{Deserialize, Serialize};
use slipstick_ranks::Ranks;

use super::error::{check_functions, check_point, check_vector};
use super::mma::is_zero;
use super::{Functions, Mma, MmaError, MmaParameters, MmaStep};

/// Smallest ρ at the start of an iteration. Notes, section on ρ.
const SMALLEST_RHO: f64 = 1e-6;

/// Of a [guarded](Gcmma::guarded) optimizer: the number of iterations that follow GCMMA after a step was
/// judged, and the share of the curvatures of an iteration with which the next one starts after that.
const STRICT: usize = 10;
const KEPT: f64 = 0.1;

/// GCMMA, the globally convergent method of moving asymptotes, for `n` variables and `m`
/// constraints `g_i ≤ 0`.
///
/// Iteration k minimizes the approximations of MMA at the design xᵏ, between the same asymptotes
/// and bounds, but with a curvature ρ_i for each function (`raa0` in MMA) that starts at
///
/// `ρ_i = max(1e-6, 0.1/n · Σ_j |∂f_i/∂x_j| (x_j^max − x_j^min))`
///
/// The solution x̂ is a *candidate*. It is accepted if the approximations are *conservative* there,
/// `f̃_i(x̂) ≥ f_i(x̂)` for objective and constraints. Otherwise, an inner iteration raises the
/// curvature of each function whose approximation is not conservative,
///
/// `ρ_i ← min(1.1 (ρ_i + δ_i), 10 ρ_i)`, where `δ_i = (f_i(x̂) − f̃_i(x̂))/d(x̂)`,
///
/// with the distance `d = ∂f̃_i/∂ρ_i`, which is the same for all functions, and solves the
/// subproblem again. An inner iteration needs the values of the functions at the candidate, not
/// their gradients. Once a design is feasible, all later ones are, and the objective decreases
/// monotonically: `f₀(x̂) ≤ f̃₀(x̂) ≤ f̃₀(xᵏ) = f₀(xᵏ)`. From an infeasible design, the objective
/// plus the penalties of the violations decreases.
///
/// Both hold up to the tolerances: an approximation counts as conservative if it is too low by no
/// more than `subproblem_tolerance · (1 + |f_i(xᵏ)|)`. They require exact gradients. With others,
/// such as filtered sensitivities, no curvature may suffice, hence the limit on inner iterations.
///
/// [`update`](Self::update) returns the first candidate of an iteration, and [`judge`](Self::judge)
/// accepts it or returns the next one. Like [`Mma`], this contains all data that one call passes to
/// the next, and continues bit for bit if it is written and read back.
///
/// Sources: K. Svanberg, SIAM J. Optim. 12 (2002) 555–573; the notes, sections on GCMMA. Tests:
/// `optimizer/tests/svanberg.rs`.
///
/// ```
/// use slipstick_design::{Functions, Gcmma, Judgement, MmaParameters};
/// use slipstick_ranks::Alone;
///
/// // min x² − cos 4x without constraints, from x = 1.5
/// let value = |x: f64| x * x - (4.0 * x).cos();
/// let slope = |x: f64| 2.0 * x + 4.0 * (4.0 * x).sin();
/// let mut gcmma = Gcmma::new(1, 0, MmaParameters::default(), 20);
/// let mut x = 1.5;
/// for _ in 0..30 {
///     let (before, gradient) = (value(x), [slope(x)]);
///     x = gcmma.update(&[x], [&[-2.0], &[2.0]], &Functions::new(before, &gradient, &[], &[]), &Alone)?.x[0];
///     while let Judgement::Rejected(next) = gcmma.judge(&[x], [&[-2.0], &[2.0]], value(x), &[], &Alone)? {
///         x = next.x[0];
///     }
///     assert!(value(x) <= before + 1e-6);
/// }
/// assert!(slope(x).abs() < 1e-2);
/// # Ok::<(), slipstick_design::MmaError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gcmma {
    mma: Mma,
    /// Maximum number of inner iterations per iteration.
    most_inner_iterations: usize,
    /// Whether only steps that go too far are judged: [`guarded`](Self::guarded).
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    guarded: bool,
    /// Iterations left in which all steps are judged nevertheless.
    #[serde(default, skip_serializing_if = "is_zero")]
    strict: usize,
    /// The approximations of the last iteration; `None` before the first.
    approximations: Option<Approximations>,
}

/// The data that define the approximations of an iteration, apart from the design and the
/// asymptotes, which are those of the last step of [`Mma`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Approximations {
    objective: f64,
    objective_gradient: Vec<f64>,
    constraints: Vec<f64>,
    constraint_gradients: Vec<Vec<f64>>,
    /// [`Functions::largest_of`].
    #[serde(default, skip_serializing_if = "is_zero")]
    largest_of: usize,
    /// Curvatures ρ, the objective first.
    rho: Vec<f64>,
    /// Rejected candidates.
    inner_iterations: usize,
}

impl Approximations {
    fn functions(&self) -> Functions<'_> {
        Functions::new(self.objective, &self.objective_gradient, &self.constraints, &self.constraint_gradients)
            .minimising_the_largest_of(self.largest_of)
    }
}

/// The verdict on a candidate.
#[derive(Clone, Debug)]
pub enum Judgement {
    /// It is accepted: all approximations are conservative there.
    Conservative,
    /// It is accepted although an approximation is not conservative, because no inner iterations
    /// are left.
    Exhausted,
    /// It is rejected; this is the next candidate.
    Rejected(Box<MmaStep>),
}

impl Gcmma {
    /// An optimizer without history for `n` variables and `m` constraints, with at most
    /// `most_inner_iterations` in each iteration. `raa0` of the parameters is not used.
    pub fn new(n: usize, m: usize, parameters: MmaParameters, most_inner_iterations: usize) -> Self {
        let mma = Mma::new(n, m, parameters);
        Self { mma, most_inner_iterations, guarded: false, strict: 0, approximations: None }
    }

    /// MMA with a guard. As long as no step goes too far, which the caller decides, its steps are exactly
    /// those of [`Mma`]. The first one that does is [judged](Self::judge), as are all steps of the next ten
    /// iterations, which follow GCMMA. Later iterations start with a tenth of the curvatures of the last one.
    pub fn guarded(n: usize, m: usize, parameters: MmaParameters, most_inner_iterations: usize) -> Self {
        Self { guarded: true, ..Self::new(n, m, parameters, most_inner_iterations) }
    }

    /// Whether every step is to be judged.
    pub fn is_strict(&self) -> bool {
        !self.guarded || self.strict > 0
    }

    /// Designs and asymptotes of earlier iterations, and the parameters.
    pub fn memory(&self) -> &Mma {
        &self.mma
    }

    /// The same, to change its parameters or forget its history between iterations.
    pub(super) fn memory_mut(&mut self) -> &mut Mma {
        &mut self.mma
    }

    /// Inner iterations since the last [`update`](Self::update): candidates rejected.
    pub fn inner_iterations(&self) -> usize {
        self.approximations.as_ref().map_or(0, |of| of.inner_iterations)
    }

    /// Curvatures ρ of the current approximations, the objective first; empty before the first.
    pub fn curvatures(&self) -> &[f64] {
        self.approximations.as_ref().map_or(&[], |of| &of.rho)
    }

    /// Checks a history that was read back: that it is complete and belongs to `n` variables and
    /// `m` constraints.
    ///
    /// # Errors
    ///
    /// Those of [`Mma::check`], also for the approximations.
    pub fn check(&self, n: usize, m: usize) -> Result<(), MmaError> {
        self.mma.check(n, m)?;
        let what = "the list of approximations".to_owned();
        match &self.approximations {
            None if self.mma.iteration() > 0 => Err(MmaError::Length { what, expected: m + 1, found: 0 }),
            Some(of) if self.mma.iteration() == 0 => Err(MmaError::Length { what, expected: 0, found: of.rho.len() }),
            None => Ok(()),
            Some(of) => {
                check_functions(n, m, &of.functions())?;
                check_vector("the list of curvatures", &of.rho, m + 1)?;
                match of.rho.iter().find(|rho| !(**rho > 0.0)) {
                    Some(&value) => Err(MmaError::Parameter { name: "rho", value, range: "positive and finite" }),
                    None => Ok(()),
                }
            }
        }
    }

    /// Begins an iteration: approximates the functions at the design `x`, between the `bounds`,
    /// lower and upper, and returns the first candidate. The subproblem is distributed over the
    /// ranks, which all call this with the same arguments and get the same result.
    ///
    /// # Errors
    ///
    /// Those of [`Mma::update`]. The history is then unchanged.
    pub fn update(
        &mut self,
        x: &[f64],
        bounds: [&[f64]; 2],
        functions: &Functions<'_>,
        ranks: &dyn Ranks,
    ) -> Result<MmaStep, MmaError> {
        let &Functions { objective, objective_gradient, constraints, constraint_gradients, largest_of } = functions;
        let gradients = [objective_gradient].into_iter().chain(constraint_gradients.iter().map(Vec::as_slice));
        let raa0 = self.mma.parameters().raa0;
        let rho: Vec<f64> = match &self.approximations {
            _ if self.is_strict() => gradients.map(|gradient| first_rho(gradient, bounds)).collect(),
            Some(last) => last.rho.iter().map(|rho| (KEPT * rho).max(raa0)).collect(),
            None => vec![raa0; constraints.len() + 1],
        };
        let step = self.mma.update_with(x, bounds, functions, &rho, ranks)?;
        self.strict = self.strict.saturating_sub(1);
        self.approximations = Some(Approximations {
            objective,
            objective_gradient: objective_gradient.to_vec(),
            constraints: constraints.to_vec(),
            constraint_gradients: constraint_gradients.to_vec(),
            largest_of,
            rho,
            inner_iterations: 0,
        });
        Ok(step)
    }

    /// Accepts or rejects a candidate with these values of objective and constraints; `bounds` are
    /// those of [`update`](Self::update), which all ranks call alike, too.
    ///
    /// `x` is the result of a step or, if the functions could not be evaluated there, a design
    /// between it and that of the iteration. Before the first iteration, every design is accepted.
    ///
    /// # Errors
    ///
    /// If lengths are wrong, a value is not finite, `x` is outside its bounds or the asymptotes, or
    /// the subproblem cannot be solved. The history is then unchanged.
    pub fn judge(
        &mut self,
        x: &[f64],
        bounds: [&[f64]; 2],
        objective: f64,
        constraints: &[f64],
        ranks: &dyn Ranks,
    ) -> Result<Judgement, MmaError> {
        if self.approximations.is_some() && !self.is_strict() {
            self.strict = STRICT;
        }
        let Some(of) = &self.approximations else { return Ok(Judgement::Conservative) };
        self.check_candidate(x, bounds, objective, constraints)?;
        let functions = of.functions();
        let (changes, distance) = self.mma.approximated_changes(x, bounds, &functions, &of.rho, ranks);
        let found = [objective].into_iter().chain(constraints.iter().copied());
        let first = [of.objective].into_iter().chain(of.constraints.iter().copied());
        let tolerance = self.mma.parameters().subproblem_tolerance;
        let mut rho = of.rho.clone();
        let mut conservative = true;
        let gradients = [&of.objective_gradient].into_iter().chain(&of.constraint_gradients);
        let each = rho.iter_mut().zip(gradients).zip(found).zip(first).zip(changes);
        for ((((rho, gradient), found), first), approximated) in each {
            let excess = found - first - approximated;
            if excess > tolerance * (1.0 + first.abs()) {
                conservative = false;
                // from the curvature of MMA, ten times as much would be too little
                let least = if self.guarded { first_rho(gradient, bounds) } else { 0.0 };
                *rho = (1.1 * (*rho + excess / distance)).min((10.0 * *rho).max(least));
            }
        }
        if conservative {
            return Ok(Judgement::Conservative);
        }
        if of.inner_iterations >= self.most_inner_iterations {
            return Ok(Judgement::Exhausted);
        }
        let step = self.mma.solve_again(bounds, &functions, &rho, ranks)?;
        if let Some(of) = &mut self.approximations {
            of.rho = rho;
            of.inner_iterations += 1;
        }
        Ok(Judgement::Rejected(Box::new(step)))
    }

    fn check_candidate(
        &self,
        x: &[f64],
        bounds: [&[f64]; 2],
        objective: f64,
        constraints: &[f64],
    ) -> Result<(), MmaError> {
        let (low, upp) = self.mma.asymptotes();
        check_point(low.len(), x, bounds)?;
        let found = self.approximations.as_ref().map_or(0, |of| of.constraints.len());
        check_vector("the objective", &[objective], 1)?;
        check_vector("the list of constraint values", constraints, found)?;
        match (0..x.len()).find(|&j| bounds[0][j] < bounds[1][j] && !(low[j] < x[j] && x[j] < upp[j])) {
            Some(index) => Err(MmaError::Asymptotes { index, value: x[index], lower: low[index], upper: upp[index] }),
            None => Ok(()),
        }
    }
}

/// ρ at the start of an iteration. Notes, section on ρ.
fn first_rho(gradient: &[f64], [lower, upper]: [&[f64]; 2]) -> f64 {
    let ranges = lower.iter().zip(upper).map(|(lower, upper)| upper - lower);
    let sum: f64 = gradient.iter().zip(ranges).map(|(slope, range)| slope.abs() * range).sum();
    (0.1 / gradient.len().max(1) as f64 * sum).max(SMALLEST_RHO)
}
