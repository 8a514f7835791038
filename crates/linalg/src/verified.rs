//! Solves verified by their true residual.

use crate::csr::{largest, norm_on};
use crate::operator::Operator;
use crate::solver::Factorization;
use slipstick_ranks::Ranks;
use thiserror::Error;

/// Backward error at which a stalled iteration has reached the round-off of the residual itself: a
/// few units in the last place, since rows have a few hundred entries.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Number of iterations before the convergence is predicted, and how much faster than so far the
/// residual is expected to fall later: GMRES becomes faster once it has found the few directions in
/// which the factors are wrong.
const LEAST_SEEN: usize = 3;
const HOPE: f64 = 2.0;

/// Outcome of a verified solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveReport {
    /// ‖b − A x‖₂ / ‖b‖₂ of the returned solution, computed with the matrix in double precision.
    pub relative_residual: f64,
    /// ‖b − A x‖∞ / (‖A‖∞ ‖x‖∞ + ‖b‖∞): the relative change of A and b for which x is exact.
    pub backward_error: f64,
    /// Solves with the factors after the first one, or all of them if a start is given.
    pub iterations: usize,
}

/// Limits of a verified solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveOptions {
    /// Relative residual ‖b − A x‖₂ / ‖b‖₂ to reach.
    pub tolerance: f64,
    /// Maximum number of solves with the factors after the first one.
    pub max_iterations: usize,
    /// Directions kept before a restart. Each requires two vectors of memory.
    pub restart: usize,
    /// Whether to stop as soon as the residual falls too slowly to reach the tolerance within
    /// `max_iterations`.
    pub give_up_early: bool,
}

impl SolveOptions {
    /// The given tolerance, at most 100 iterations, a restart after 50, without giving up early.
    pub fn new(tolerance: f64) -> Self {
        Self { tolerance, max_iterations: 100, restart: 50, give_up_early: false }
    }
}

/// Why a verified solve failed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SolveError {
    /// Lengths do not match. With several ranks, they refer to the unknowns of this rank.
    #[error(
        "the matrix has {n} unknowns, but the factors, right-hand side and solution have \
         {factors}, {rhs} and {solution}"
    )]
    Dimension {
        /// Unknowns of the matrix.
        n: usize,
        /// Unknowns of the factorization.
        factors: usize,
        /// Length of the right-hand side.
        rhs: usize,
        /// Length of the solution.
        solution: usize,
    },
    /// The right-hand side has an entry that is NaN or infinite.
    #[error(
        "{} of the right-hand side is not finite; check the loads and the residual",
        .index.map_or("an entry".into(), |index| format!("entry {index}"))
    )]
    NonFiniteRightHandSide {
        /// The first such entry, on a single rank.
        index: Option<usize>,
    },
    /// The factors or the matrix produced a number that is not finite.
    #[error("the solve produced a number that is not finite; the matrix or its factors are unusable")]
    NonFinite,
    /// The residual stayed above the tolerance.
    #[error(
        "the linear solve stopped at a relative residual of {:e} after {} iterations, above the \
         tolerance {tolerance:e}; factorize the current matrix, in double precision if it was single",
        .report.relative_residual, .report.iterations
    )]
    NotConverged {
        /// The result reached; the solution vector holds the best iterate.
        report: SolveReport,
        /// The required tolerance.
        tolerance: f64,
    },
}

/// Solves A x = b, or Aᵀ x = b if `transpose` is set, to the relative residual `tolerance`.
///
/// The factors may be in single precision or of a nearby matrix: they precondition a flexible GMRES
/// on the double precision matrix `a`, and every convergence decision is based on the true
/// residual. The previous content of `x` is ignored. If round-off makes `tolerance` unreachable, a
/// solution counts as converged if its residual is at the level of round-off after all equations
/// have been scaled to the same size. Soft bodies next to stiff ones, and equations in small units,
/// are thus solved as accurately as the others; the report then refers to the scaled equations.
///
/// References: Saad, A flexible inner-outer preconditioned GMRES algorithm, SIAM J. Sci. Comput. 14
/// (1993); Rigal and Gaches, J. ACM 14 (1967) for the backward error.
///
/// # Errors
/// See [`SolveError`]; after `NotConverged`, `x` holds the best iterate.
pub fn solve_verified(
    a: &dyn Operator,
    f: &dyn Factorization,
    transpose: bool,
    rhs: &[f64],
    x: &mut [f64],
    tolerance: f64,
) -> Result<SolveReport, SolveError> {
    solve_with(a, f, transpose, rhs, x, &SolveOptions::new(tolerance))
}

/// As [`solve_verified`], with limits on iterations and memory.
///
/// # Errors
/// See [`SolveError`].
pub fn solve_with(
    a: &dyn Operator,
    f: &dyn Factorization,
    transpose: bool,
    rhs: &[f64],
    x: &mut [f64],
    options: &SolveOptions,
) -> Result<SolveReport, SolveError> {
    x.fill(0.0);
    solve_from(a, f, transpose, rhs, x, options)
}

/// As [`solve_with`], from the initial guess in `x`, which may be any finite vector.
///
/// # Errors
/// See [`SolveError`].
pub fn solve_from(
    a: &dyn Operator,
    f: &dyn Factorization,
    transpose: bool,
    rhs: &[f64],
    x: &mut [f64],
    options: &SolveOptions,
) -> Result<SolveReport, SolveError> {
    let n = a.n();
    if f.n() != n || rhs.len() != n || x.len() != n {
        return Err(SolveError::Dimension { n, factors: f.n(), rhs: rhs.len(), solution: x.len() });
    }
    let size = norm_on(rhs, a.ranks());
    if !size.is_finite() {
        let index = rhs.iter().position(|b| !b.is_finite());
        let anywhere = a.ranks().any(index.is_some());
        // only its own rank knows the entry
        let index = index.filter(|_| a.ranks().size() == 1);
        return Err(if anywhere { SolveError::NonFiniteRightHandSide { index } } else { SolveError::NonFinite });
    }
    if size == 0.0 {
        x.fill(0.0);
        return Ok(SolveReport { relative_residual: 0.0, backward_error: 0.0, iterations: 0 });
    }
    let plain = System { a, f, transpose, rhs, norm: a.infinity_norm(transpose), weights: None };
    let mut residual = vec![0.0; n];
    if !a.ranks().any(x.iter().any(|x| *x != 0.0)) {
        x.copy_from_slice(rhs);
        plain.precondition(x);
    }
    let target = options.tolerance * size;
    let report = plain.assess(x, &mut residual, 0)?;
    let reaches = |report: &SolveReport| report.relative_residual <= options.tolerance;
    let enough = |report: &SolveReport| reaches(report) || report.backward_error <= f64::EPSILON;
    let report = plain.iterate(x, &mut residual, report, target, options, &enough)?;
    if reaches(&report) {
        return Ok(report);
    }
    if report.backward_error > ROUNDING {
        return Err(SolveError::NotConverged { report, tolerance: options.tolerance });
    }
    // Round-off in the stiffest rows hides the others, which must be solved as accurately.
    let level = System { weights: Some(a.row_weights(transpose)), ..plain };
    let report = level.assess(x, &mut residual, report.iterations)?;
    let target = ROUNDING * level.rounding(x);
    let exact = |report: &SolveReport| report.backward_error <= ROUNDING;
    let report = level.iterate(x, &mut residual, report, target, options, &exact)?;
    if exact(&report) { Ok(report) } else { Err(SolveError::NotConverged { report, tolerance: options.tolerance }) }
}

/// Accuracy of the factors, with residuals measured after the equations have been multiplied by
/// `weights`.
pub(crate) fn solve_weighted(
    a: &dyn Operator,
    f: &dyn Factorization,
    transpose: bool,
    rhs: &[f64],
    weights: &[f64],
    options: &SolveOptions,
) -> Result<SolveReport, SolveError> {
    if norm_on(rhs, a.ranks()) == 0.0 {
        return Ok(SolveReport { relative_residual: 0.0, backward_error: 0.0, iterations: 0 });
    }
    let system = System { a, f, transpose, rhs, norm: 0.0, weights: Some(weights.to_vec()) };
    let (mut x, mut residual) = (rhs.to_vec(), vec![0.0; rhs.len()]);
    system.precondition(&mut x);
    let report = system.assess(&x, &mut residual, 0)?;
    let mut sizes = rhs.to_vec();
    system.weigh(&mut sizes);
    let enough = |report: &SolveReport| report.relative_residual <= options.tolerance;
    system.iterate(&mut x, &mut residual, report, options.tolerance * system.norm_of(&sizes), options, &enough)
}

struct System<'a> {
    a: &'a dyn Operator,
    f: &'a dyn Factorization,
    transpose: bool,
    rhs: &'a [f64],
    /// Infinity norm of the operator.
    norm: f64,
    /// Factors by which the equations are multiplied before they are measured.
    weights: Option<Vec<f64>>,
}

impl System<'_> {
    /// ‖v‖₂ over all ranks.
    fn norm_of(&self, v: &[f64]) -> f64 {
        norm_on(v, self.a.ranks())
    }

    fn precondition(&self, v: &mut [f64]) {
        if self.transpose {
            self.f.solve_transpose(v);
        } else {
            self.f.solve(v);
        }
    }

    fn apply(&self, v: &[f64], product: &mut [f64]) {
        if self.transpose {
            self.a.mul_transpose(v, product);
        } else {
            self.a.mul(v, product);
        }
    }

    fn weigh(&self, v: &mut [f64]) {
        if let Some(weights) = &self.weights {
            v.iter_mut().zip(weights).for_each(|(v, w)| *v *= w);
        }
    }

    fn unweigh(&self, v: &mut [f64]) {
        if let Some(weights) = &self.weights {
            v.iter_mut().zip(weights).for_each(|(v, w)| *v /= w);
        }
    }

    /// ‖W (|A| |x| + |b|)‖₂: the size of the terms in the residual.
    fn rounding(&self, x: &[f64]) -> f64 {
        let mut sizes = vec![0.0; x.len()];
        self.a.absolute_product(self.transpose, x, &mut sizes);
        sizes.iter_mut().zip(self.rhs).for_each(|(size, b)| *size += b.abs());
        self.weigh(&mut sizes);
        self.norm_of(&sizes)
    }

    /// True weighted residual of `x`, stored in `residual`.
    fn assess(&self, x: &[f64], residual: &mut [f64], iterations: usize) -> Result<SolveReport, SolveError> {
        self.a.residual(self.transpose, x, self.rhs, residual);
        let (relative_residual, backward_error) = if self.weights.is_some() {
            let mut rhs = self.rhs.to_vec();
            self.weigh(residual);
            self.weigh(&mut rhs);
            let size = self.norm_of(residual);
            (size / self.norm_of(&rhs), size / self.rounding(x))
        } else {
            let [residual_size, x_size, rhs_size] =
                [&*residual, x, self.rhs].map(|v| self.a.ranks().largest(largest(v)));
            let backward_error = residual_size / (self.norm * x_size + rhs_size);
            (self.norm_of(residual) / self.norm_of(self.rhs), backward_error)
        };
        if relative_residual.is_finite() && backward_error.is_finite() {
            Ok(SolveReport { relative_residual, backward_error, iterations })
        } else {
            Err(SolveError::NonFinite)
        }
    }

    /// Cycles of GMRES until `enough`, until they stall, or until none are left; `target` is the
    /// residual to reach.
    fn iterate(
        &self,
        x: &mut [f64],
        residual: &mut [f64],
        mut report: SolveReport,
        target: f64,
        options: &SolveOptions,
        enough: &dyn Fn(&SolveReport) -> bool,
    ) -> Result<SolveReport, SolveError> {
        while !enough(&report) {
            let left = options.max_iterations.saturating_sub(report.iterations);
            if left == 0 {
                break;
            }
            let mut candidate = x.to_vec();
            let steps = left.min(options.restart.max(1));
            let present = self.norm_of(residual);
            let hopeless = |fallen: f64, taken: usize| {
                let wanted = (0.5 * target / present).ln();
                options.give_up_early && taken >= LEAST_SEEN && HOPE * fallen.ln() * left as f64 > wanted * taken as f64
            };
            let (taken, given_up) = self.cycle(&mut candidate, residual, target, steps, &hopeless)?;
            let improved = self.assess(&candidate, residual, report.iterations + taken)?;
            let stalled = improved.relative_residual > 0.5 * report.relative_residual;
            if improved.relative_residual < report.relative_residual {
                x.copy_from_slice(&candidate);
                report = improved;
            } else {
                report.iterations = improved.iterations;
                self.assess(x, residual, report.iterations)?;
            }
            if stalled || given_up {
                break;
            }
        }
        Ok(report)
    }

    /// One cycle of flexible GMRES from the residual `r`: adds the correction to `x`, returns the
    /// number of preconditioned directions, and whether `hopeless` (a function of the remaining
    /// fraction of `r`, and of that number) ended it.
    fn cycle(
        &self,
        x: &mut [f64],
        r: &[f64],
        target: f64,
        steps: usize,
        hopeless: &dyn Fn(f64, usize) -> bool,
    ) -> Result<(usize, bool), SolveError> {
        let beta = self.norm_of(r);
        let mut basis = vec![r.iter().map(|r| r / beta).collect::<Vec<f64>>()];
        let mut directions: Vec<Vec<f64>> = Vec::new();
        let mut hessenberg = GivensLeastSquares::new(beta);
        while directions.len() < steps {
            let mut z = basis[directions.len()].clone();
            self.unweigh(&mut z);
            self.precondition(&mut z);
            let mut w = vec![0.0; z.len()];
            self.apply(&z, &mut w);
            self.weigh(&mut w);
            directions.push(z);
            let column = orthogonalise(&mut w, &basis, self.a.ranks());
            if !column.iter().all(|h| h.is_finite()) {
                return Err(SolveError::NonFinite);
            }
            let next = column[column.len() - 1];
            let estimate = hessenberg.push(column);
            if estimate <= 0.5 * target || next == 0.0 {
                break;
            }
            if hopeless(estimate / beta, directions.len()) {
                return Ok((directions.len(), true));
            }
            w.iter_mut().for_each(|w| *w /= next);
            basis.push(w);
        }
        for (coefficient, z) in hessenberg.solution().iter().zip(&directions) {
            x.iter_mut().zip(z).for_each(|(x, z)| *x += coefficient * z);
        }
        Ok((directions.len(), false))
    }
}

/// Removes the components of `w` along `basis`, twice for full orthogonality. Returns the
/// coefficients followed by the norm of the remainder.
///
/// All components of a pass are computed at once, so that ranks communicate once per pass.
/// Reference: Giraud, Langou, Rozložník and van den Eshof, Rounding error analysis of the classical
/// Gram–Schmidt orthogonalization process, Numer. Math. 101 (2005).
fn orthogonalise(w: &mut [f64], basis: &[Vec<f64>], ranks: &dyn Ranks) -> Vec<f64> {
    let mut column = vec![0.0; basis.len() + 1];
    for _ in 0..2 {
        let mut components: Vec<f64> = basis.iter().map(|v| w.iter().zip(v).map(|(w, v)| w * v).sum()).collect();
        ranks.sum(&mut components);
        for ((h, v), component) in column.iter_mut().zip(basis).zip(components) {
            w.iter_mut().zip(v).for_each(|(w, v)| *w -= component * v);
            *h += component;
        }
    }
    column[basis.len()] = norm_on(w, ranks);
    column
}

/// min ‖β e₁ − H y‖ for a growing Hessenberg matrix, by Givens rotations.
struct GivensLeastSquares {
    columns: Vec<Vec<f64>>,
    rotations: Vec<(f64, f64)>,
    rhs: Vec<f64>,
}

impl GivensLeastSquares {
    fn new(beta: f64) -> Self {
        Self { columns: Vec::new(), rotations: Vec::new(), rhs: vec![beta] }
    }

    /// Appends a column (one entry longer than the last one) and returns the residual norm.
    fn push(&mut self, mut column: Vec<f64>) -> f64 {
        let k = self.rotations.len();
        for (i, &(c, s)) in self.rotations.iter().enumerate() {
            let (upper, lower) = (column[i], column[i + 1]);
            column[i] = c * upper + s * lower;
            column[i + 1] = c * lower - s * upper;
        }
        let length = column[k].hypot(column[k + 1]);
        let (c, s) = if length == 0.0 { (1.0, 0.0) } else { (column[k] / length, column[k + 1] / length) };
        column[k] = length;
        column.truncate(k + 1);
        let last = self.rhs[k];
        self.rhs[k] = c * last;
        self.rhs.push(-s * last);
        self.rotations.push((c, s));
        self.columns.push(column);
        (s * last).abs()
    }

    /// Coefficients of the minimiser. The coefficient for a zero pivot (an exactly singular
    /// operator) is zero.
    fn solution(&self) -> Vec<f64> {
        let k = self.columns.len();
        let mut y = self.rhs[..k].to_vec();
        for j in (0..k).rev() {
            y[j] = if self.columns[j][j] == 0.0 { 0.0 } else { y[j] / self.columns[j][j] };
            for i in 0..j {
                y[i] -= self.columns[j][i] * y[j];
            }
        }
        y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the normal equations: the remainder of β e₁ is orthogonal to all columns, and its norm is
    /// the one that was returned.
    #[test]
    fn least_squares_leave_what_is_perpendicular() {
        let columns = [vec![0.8, 1.1], vec![-0.4, 0.7, 0.9], vec![0.3, -1.2, 0.5, 0.6]];
        let beta = 1.7;
        let mut least = GivensLeastSquares::new(beta);
        for count in 1..=3 {
            let norm = least.push(columns[count - 1].clone());
            let y = least.solution();
            let rest: Vec<f64> = (0..=count)
                .map(|i| {
                    let product: f64 = (0..count).map(|j| columns[j].get(i).unwrap_or(&0.0) * y[j]).sum();
                    if i == 0 { beta - product } else { -product }
                })
                .collect();
            assert!((rest.iter().map(|r| r * r).sum::<f64>().sqrt() - norm).abs() < 1e-15, "{count}: {norm}");
            for column in &columns[..count] {
                let along: f64 = column.iter().zip(&rest).map(|(h, r)| h * r).sum();
                assert!(along.abs() < 1e-15, "{count}: {along}");
            }
        }
    }
}
