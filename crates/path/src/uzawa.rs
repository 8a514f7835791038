//! Accelerated Uzawa's iteration: Newton's method with held multipliers alternates with multiplier
//! updates.
//!
//! The plain update ẑ ← z(d; ẑ) is a fixed-point iteration that converges linearly, and slowly if ε
//! is small compared to the stiffness of the bodies. Its fixed point is the root of ẑ − z(d; ẑ)
//! together with the balance of forces. Newton's method finds it at the price of a few inner
//! solves: the second-order multiplier update (Bertsekas, Constrained Optimization and Lagrange
//! Multiplier Methods, 1982, 2.3.2). If that fails, Uzawa's iteration brings the state closer, with
//! Anderson's mixing of the last updates (the secant method in several unknowns). Its inner Newton
//! iteration is solved only as accurately as the current violation requires, and to the full
//! tolerances before the iteration ends.

use crate::failure::{StepFailure, StepFailureKind};
use crate::iterations::StepReport;
use crate::newton::{self, NewtonOptions, Start, Tolerance};
use crate::problem::{Attempt, Evaluated, Iteration, StepProblem, UzawaOptions};
use crate::solver::Solver;
use crate::unknowns::Held;
use nalgebra::{DMatrix, DVector};

/// Solves one (sub-)step by Uzawa's iteration over the multipliers `held`: those of the augmented
/// Lagrangian method, or all of them to rescue a step at which Newton's method fails. Returns the
/// unknowns and the last evaluation, which may contain the multipliers before their last update.
///
/// The inner Newton uses the augmented traction z(d; ẑ) and its tangent, then ẑ ← z, until the
/// contact conditions hold to the tolerance. Paper: (48)–(52), with the inner solve of the method, §4.
///
/// The rescue helps past a limit point, where the contact jumps to another equilibrium and stick,
/// slip and opening are mutually exclusive in every nearby state. With held multipliers the contact
/// has the compliance of its ε, so displacements and status can follow each other. Newton's method
/// ends the rescue, so that the state solves the step's own equations to its tolerances.
/// Test: `a_contact_that_jumps_is_followed` (crate slipstick).
pub(crate) fn solve<P: StepProblem>(
    solver: &mut Solver<'_, P>,
    step: &P::Step,
    start: Start<P>,
    target: &[f64],
    newton: &NewtonOptions,
    (attempt, uzawa): (Attempt, &UzawaOptions),
    report: &mut StepReport,
) -> Result<(Vec<f64>, Evaluated<P>), StepFailure> {
    let rescue = matches!(attempt, Attempt::Rescue(_));
    let held = if rescue { Held::All } else { Held::Augmented };
    let mut outer =
        Outer { solver, step, target, newton, uzawa, iteration: Iteration { attempt, held, at_start: false } };
    // a rescue begins after Newton's method has failed
    if !rescue
        && uzawa.memory > 0
        && let Some(at) = outer.second_order(start.clone(), report)?
    {
        return Ok((at.unknowns.clone(), at));
    }
    let (y, at) = outer.iterate(start, report)?;
    if !rescue {
        return Ok((y, at));
    }
    report.rescued = true;
    let start = Start::with_geometry(y, at.geometry);
    let at = newton::solve(solver, step, start, target, newton, Iteration { attempt, ..Iteration::default() }, report)?;
    Ok((at.unknowns.clone(), at))
}

/// Newton iterations after which a rescue is abandoned, relative to the maximum of a single solve.
const RESCUE: usize = 8;

/// Fraction of the current violation to which the inner Newton iteration is solved.
const FORCING: f64 = 1e-2;

/// The data of an Uzawa iteration.
struct Outer<'r, 's, P: StepProblem> {
    solver: &'r mut Solver<'s, P>,
    step: &'r P::Step,
    target: &'r [f64],
    newton: &'r NewtonOptions,
    uzawa: &'r UzawaOptions,
    iteration: Iteration,
}

impl<P: StepProblem> Outer<'_, '_, P> {
    /// Solves for displacements and multipliers together; returns the solution if it satisfies the
    /// contact conditions to the tolerance.
    fn second_order(&mut self, start: Start<P>, report: &mut StepReport) -> Result<Option<Evaluated<P>>, StepFailure> {
        let mut attempt = StepReport::default();
        let together = Iteration { held: Held::None, ..self.iteration };
        let result = newton::solve(self.solver, self.step, start, self.target, self.newton, together, &mut attempt);
        report.uzawa += 1;
        let at = match result {
            Ok(at) => at,
            Err(failure) if failure.kind == StepFailureKind::Mispredicted => return Err(failure),
            Err(mut failure) => {
                report.iterations.append(&mut failure.iterations);
                return Ok(None);
            }
        };
        report.iterations.append(&mut attempt.iterations);
        let Ok((_, violation)) = self.solver.problem.update_multipliers(self.step, &at) else { return Ok(None) };
        Ok((violation <= self.uzawa.tolerance).then(|| {
            report.rounded = attempt.rounded;
            at
        }))
    }

    fn iterate(
        &mut self,
        mut start: Start<P>,
        report: &mut StepReport,
    ) -> Result<(Vec<f64>, Evaluated<P>), StepFailure> {
        let (newton, uzawa, held) = (self.newton, self.uzawa, self.iteration.held);
        let problem = self.solver.problem;
        let split = problem.unknowns().displacements;
        let mut mixing = Anderson::new(uzawa.memory);
        let mut violation = f64::INFINITY;
        let mut finish = false;
        let mut iterations = 0;
        let most = if held == Held::All { RESCUE * newton.max_iterations } else { usize::MAX };
        for iteration in 1..=uzawa.max_iterations {
            if report.iterations.len() > most {
                break;
            }
            iterations = iteration;
            // without acceleration this is the textbook iteration, with full inner solves
            let tight = finish || uzawa.memory == 0 || FORCING * violation <= smallest(newton);
            let inner = if tight { *newton } else { loosened(newton, (FORCING * violation).min(1e-3)) };
            let at = newton::solve(self.solver, self.step, start, self.target, &inner, self.iteration, report)?;
            report.uzawa += 1;
            let updated = problem.update_multipliers(self.step, &at);
            let (mut y, now) = updated.map_err(|error| StepFailure {
                kind: error.into(),
                iterations: report.iterations.clone(),
                iterate: at.unknowns.clone(),
                at_start: false,
            })?;
            violation = now;
            if violation <= uzawa.tolerance {
                if tight {
                    return Ok((y, at));
                }
                // the contact conditions hold, but the balance of forces is not yet within its
                // tolerances: one more full solve
                mixing.clear();
                finish = true;
                start = Start::with_geometry(y, at.geometry);
                continue;
            }
            if uzawa.memory > 0 && iteration.is_power_of_two() {
                let trial = Start::with_geometry(y.clone(), at.geometry.clone());
                if let Some(at) = self.second_order(trial, report)? {
                    return Ok((at.unknowns.clone(), at));
                }
            }
            let mixed = mixing.mix(&at.unknowns[split..], &y[split..]);
            // the others are unknowns of the inner solve
            let held = &problem.unknowns().fixed(held)[split..];
            for ((y, mixed), held) in y[split..].iter_mut().zip(mixed).zip(held) {
                *y = if *held { mixed } else { *y };
            }
            start = Start::with_geometry(y, at.geometry);
        }
        Err(StepFailure {
            kind: StepFailureKind::Uzawa { iterations, violation, tolerance: uzawa.tolerance },
            iterations: std::mem::take(&mut report.iterations),
            iterate: start.unknowns,
            at_start: false,
        })
    }
}

/// The smallest relative tolerance. An absolute one cannot be compared with a violation: then all
/// solves are tight.
fn smallest(newton: &NewtonOptions) -> f64 {
    let t = &newton.tolerances;
    match (t.residual, t.displacement) {
        (Tolerance::Relative(a), Tolerance::Relative(b)) => a.min(b),
        _ => f64::INFINITY,
    }
}

/// The same settings with relative tolerances of at least `bound`.
pub(crate) fn loosened(newton: &NewtonOptions, bound: f64) -> NewtonOptions {
    let loosen = |t: Tolerance| match t {
        Tolerance::Relative(own) => Tolerance::Relative(own.max(bound)),
        absolute @ Tolerance::Absolute(_) => absolute,
    };
    let mut out = *newton;
    out.tolerances.residual = loosen(out.tolerances.residual);
    out.tolerances.displacement = loosen(out.tolerances.displacement);
    out
}

/// Anderson's mixing of a fixed-point iteration x ← g(x).
///
/// With f_k = g(x_k) − x_k, the next x is g(x_k) − Σ γ_i (g_{i+1} − g_i), γ minimizing ‖f_k − Σ γ_i
/// (f_{i+1} − f_i)‖. Reference: Walker and Ni, SIAM J. Numer. Anal. 49 (2011) 1715–1735.
struct Anderson {
    memory: usize,
    /// (g_i, f_i), oldest first.
    past: Vec<(Vec<f64>, Vec<f64>)>,
}

/// Growth of ‖f‖ in one iteration beyond which the memory is cleared: the iteration has left the
/// region that it describes.
const RESTART: f64 = 2.0;

impl Anderson {
    fn new(memory: usize) -> Self {
        Self { memory, past: Vec::new() }
    }

    fn clear(&mut self) {
        self.past.clear();
    }

    /// The next iterate from x and g(x).
    fn mix(&mut self, x: &[f64], g: &[f64]) -> Vec<f64> {
        if self.memory == 0 {
            return g.to_vec();
        }
        let f: Vec<f64> = g.iter().zip(x).map(|(g, x)| g - x).collect();
        let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        if self.past.last().is_some_and(|(_, last)| norm(&f) > RESTART * norm(last)) {
            self.clear();
        }
        self.past.push((g.to_vec(), f));
        if self.past.len() > self.memory + 1 {
            self.past.remove(0);
        }
        let m = self.past.len() - 1;
        if m == 0 {
            return g.to_vec();
        }
        let n = g.len();
        let differences = DMatrix::from_fn(n, m, |r, c| self.past[c + 1].1[r] - self.past[c].1[r]);
        let rhs = DVector::from_column_slice(&self.past[m].1);
        // truncated SVD: nearly dependent differences carry no information
        let svd = differences.svd(true, true);
        let cut = 1e-8 * svd.singular_values.max();
        let Ok(gamma) = svd.solve(&rhs, cut) else { return g.to_vec() };
        let mut next = g.to_vec();
        for (i, gamma) in gamma.iter().enumerate() {
            for (r, value) in next.iter_mut().enumerate() {
                *value -= gamma * (self.past[i + 1].0[r] - self.past[i].0[r]);
            }
        }
        if next.iter().all(|v| v.is_finite()) { next } else { g.to_vec() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For a linear iteration of dimension n, Anderson's mixing with full memory ends in n + 2
    /// steps (it is GMRES).
    #[test]
    fn mixing_solves_a_linear_iteration_in_dimension_plus_two_steps() {
        let a = [[0.9, 0.3, 0.0], [-0.2, 0.8, 0.1], [0.05, 0.0, 0.95]];
        let b = [1.0, -2.0, 0.5];
        let g =
            |x: &[f64]| -> Vec<f64> { (0..3).map(|i| b[i] + (0..3).map(|j| a[i][j] * x[j]).sum::<f64>()).collect() };
        let mut mixing = Anderson::new(5);
        let mut x = vec![0.0; 3];
        for _ in 0..5 {
            let next = g(&x);
            x = mixing.mix(&x, &next);
        }
        let error = g(&x).iter().zip(&x).map(|(g, x)| (g - x).abs()).fold(0.0, f64::max);
        assert!(error < 1e-9, "{error}");
    }
}
