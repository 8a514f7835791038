//! Solves verified by their true residual.

mod cycle;
mod shared;

use crate::csr::{largest, norm_on};
use crate::operator::Operator;
use crate::solver::Factorization;
use cycle::Cycle;
use shared::SharedCycle;
use thiserror::Error;

/// Backward error at which a stalled iteration has reached the round-off of the residual itself: a
/// few units in the last place, since rows have a few hundred entries.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Number of iterations before the convergence is predicted, and how much faster than so far the
/// residual is expected to fall later: GMRES becomes faster once it has found the few directions in
/// which the factors are wrong.
const LEAST_SEEN: usize = 3;
const HOPE: f64 = 2.0;

/// Maximum number of right-hand sides that share directions: each direction must be orthogonal to all
/// others, so the cost grows with the square of the number.
const SHARING: usize = 4;

/// Outcome of a verified solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveReport {
    /// ‖b − A x‖₂ / ‖b‖₂ of the returned solution, computed with the matrix in double precision.
    pub relative_residual: f64,
    /// ‖b − A x‖∞ / (‖A‖∞ ‖x‖∞ + ‖b‖∞): the relative change of A and b for which x is exact.
    pub backward_error: f64,
    /// ‖b − A x‖₂ / ‖b‖₂ of the start: 1 if none is given.
    pub initial_residual: f64,
    /// Solves with the factors after the first one, or all of them if a start is given.
    pub iterations: usize,
}

impl SolveReport {
    /// All solves with the factors.
    pub fn solves(&self) -> usize {
        self.iterations + usize::from(self.initial_residual == 1.0)
    }
}

/// Limits of a verified solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveOptions {
    /// Relative residual ‖b − A x‖₂ / ‖b‖₂ to reach.
    pub tolerance: f64,
    /// Maximum number of solves with the factors after the first one.
    pub max_iterations: usize,
    /// Iterations before a restart. Each keeps two vectors for every right-hand side.
    pub restart: usize,
    /// Stops as soon as the rest is expected to take more iterations than this way.
    pub alternative: Option<Alternative>,
}

/// What another way to the solution costs, such as new factors, in iterations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alternative {
    /// Before it starts.
    pub preparation: f64,
    /// For each decimal digit of the residual.
    pub per_digit: f64,
}

impl Alternative {
    /// For this number of decimal digits.
    pub fn cost(&self, digits: f64) -> f64 {
        self.preparation + self.per_digit * digits
    }

    /// Whether it costs less than to go on, after `taken` iterations since the residual was `start`.
    fn beats(&self, taken: usize, [start, now, wanted]: [f64; 3]) -> bool {
        let (found, left) = ((start / now).log10().max(0.0), (now / wanted).log10());
        taken >= LEAST_SEEN && left * taken as f64 > HOPE * found * self.cost(left)
    }
}

impl SolveOptions {
    /// The given tolerance, at most 100 iterations, a restart after 50, without an alternative.
    pub fn new(tolerance: f64) -> Self {
        Self { tolerance, max_iterations: 100, restart: 50, alternative: None }
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
    let mut reports = solve_together(a, f, transpose, &[rhs], vec![x], options);
    reports.pop().expect("one right-hand side")
}

/// As [`solve_from`] for several right-hand sides, with an initial guess for each. The solves with
/// the factors are done together, which can cost less ([`Cost::further`](crate::Cost)), and groups of
/// right-hand sides share their directions, which takes fewer iterations. Each solution meets the
/// tolerance, but its digits beyond depend on the others.
///
/// # Panics
/// If the numbers of right-hand sides and guesses differ.
pub fn solve_many_from(
    a: &dyn Operator,
    f: &dyn Factorization,
    transpose: bool,
    rhs: &[&[f64]],
    x: &mut [Vec<f64>],
    options: &SolveOptions,
) -> Vec<Result<SolveReport, SolveError>> {
    assert_eq!(rhs.len(), x.len(), "each right-hand side needs an initial guess");
    solve_together(a, f, transpose, rhs, x.iter_mut().map(Vec::as_mut_slice).collect(), options)
}

fn solve_together(
    a: &dyn Operator,
    f: &dyn Factorization,
    transpose: bool,
    rhs: &[&[f64]],
    x: Vec<&mut [f64]>,
    options: &SolveOptions,
) -> Vec<Result<SolveReport, SolveError>> {
    let matrix = Matrix { a, f, transpose, norm: a.infinity_norm(transpose) };
    let of = |(rhs, x)| Solve::new(&matrix, rhs, x);
    let mut solves: Vec<Solve<'_>> = rhs.iter().copied().zip(x).map(of).collect();
    let without_guess = |solve: &Solve<'_>| !a.ranks().any(solve.x.iter().any(|x| *x != 0.0));
    let (mut cold, warm): (Vec<&mut Solve<'_>>, Vec<_>) =
        solves.iter_mut().filter(|solve| solve.outcome.is_none()).partition(|solve| without_guess(solve));
    let mut first: Vec<Vec<f64>> = cold.iter().map(|solve| solve.rhs.to_vec()).collect();
    matrix.precondition(&mut first);
    cold.iter_mut().zip(first).for_each(|(solve, first)| solve.x.copy_from_slice(&first));
    cold.into_iter().for_each(Solve::assess);
    for solve in warm {
        solve.assess();
        solve.report.initial_residual = solve.report.relative_residual;
    }
    for solve in &mut solves {
        solve.target = options.tolerance * norm_on(solve.rhs, a.ranks());
    }
    let reaches = |report: &SolveReport| report.relative_residual <= options.tolerance;
    iterate(&matrix, &mut solves, options, &|report| reaches(report) || report.backward_error <= f64::EPSILON);
    for solve in solves.iter_mut().filter(|solve| solve.outcome.is_none()) {
        if reaches(&solve.report) {
            solve.outcome = Some(Ok(solve.report));
        } else if solve.report.backward_error > ROUNDING {
            solve.outcome = Some(Err(SolveError::NotConverged { report: solve.report, tolerance: options.tolerance }));
        } else {
            // Round-off in the stiffest rows hides the others, which must be solved as accurately.
            solve.weights = Some(a.row_weights(transpose));
            solve.assess();
            solve.target = ROUNDING * solve.rounding(solve.x);
        }
    }
    let exact = |report: &SolveReport| report.backward_error <= ROUNDING;
    iterate(&matrix, &mut solves, options, &exact);
    let end = |solve: Solve<'_>| match solve.outcome {
        Some(outcome) => outcome,
        None if exact(&solve.report) => Ok(solve.report),
        None => Err(SolveError::NotConverged { report: solve.report, tolerance: options.tolerance }),
    };
    solves.into_iter().map(end).collect()
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
        return Ok(SolveReport { relative_residual: 0.0, backward_error: 0.0, initial_residual: 0.0, iterations: 0 });
    }
    let matrix = Matrix { a, f, transpose, norm: 0.0 };
    let mut x = vec![rhs.to_vec()];
    matrix.precondition(&mut x);
    let mut solve = Solve::new(&matrix, rhs, &mut x[0]);
    solve.weights = Some(weights.to_vec());
    solve.assess();
    let mut sizes = rhs.to_vec();
    solve.weigh(&mut sizes);
    solve.target = options.tolerance * matrix.norm_of(&sizes);
    let mut solves = [solve];
    iterate(&matrix, &mut solves, options, &|report| report.relative_residual <= options.tolerance);
    let [solve] = solves;
    solve.outcome.unwrap_or(Ok(solve.report))
}

/// A matrix with its factors, or their transposes.
struct Matrix<'a> {
    a: &'a dyn Operator,
    f: &'a dyn Factorization,
    transpose: bool,
    /// Infinity norm of the operator.
    norm: f64,
}

impl Matrix<'_> {
    /// ‖v‖₂ over all ranks.
    fn norm_of(&self, v: &[f64]) -> f64 {
        norm_on(v, self.a.ranks())
    }

    fn precondition(&self, vectors: &mut [Vec<f64>]) {
        match vectors {
            [] => {}
            [one] if self.transpose => self.f.solve_transpose(one),
            [one] => self.f.solve(one),
            several => {
                let mut together = several.concat();
                if self.transpose {
                    self.f.solve_transpose_many(&mut together);
                } else {
                    self.f.solve_many(&mut together);
                }
                let columns = together.chunks_exact(self.a.n().max(1));
                several.iter_mut().zip(columns).for_each(|(v, column)| v.copy_from_slice(column));
            }
        }
    }

    fn products(&self, vectors: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut products: Vec<Vec<f64>> = vectors.iter().map(|v| vec![0.0; v.len()]).collect();
        if self.transpose {
            vectors.iter().zip(&mut products).for_each(|(v, product)| self.a.mul_transpose(v, product));
        } else {
            self.a.mul_many(vectors, &mut products);
        }
        products
    }
}

/// The solution for one right-hand side, in progress.
struct Solve<'a> {
    matrix: &'a Matrix<'a>,
    rhs: &'a [f64],
    x: &'a mut [f64],
    /// Factors by which the equations are multiplied before they are measured.
    weights: Option<Vec<f64>>,
    /// Of `x`, multiplied by the weights.
    residual: Vec<f64>,
    report: SolveReport,
    /// The norm of the residual to reach.
    target: f64,
    /// The last cycle stalled, or was given up.
    stopped: bool,
    /// Set when nothing is left to do.
    outcome: Option<Result<SolveReport, SolveError>>,
}

impl<'a> Solve<'a> {
    /// Checks the right-hand side; nothing is left to do if it is zero or unusable.
    fn new(matrix: &'a Matrix<'a>, rhs: &'a [f64], x: &'a mut [f64]) -> Self {
        let (n, factors) = (matrix.a.n(), matrix.f.n());
        let report = SolveReport { relative_residual: 0.0, backward_error: 0.0, initial_residual: 1.0, iterations: 0 };
        let outcome = if factors != n || rhs.len() != n || x.len() != n {
            Some(Err(SolveError::Dimension { n, factors, rhs: rhs.len(), solution: x.len() }))
        } else {
            let ranks = matrix.a.ranks();
            let size = norm_on(rhs, ranks);
            if !size.is_finite() {
                let index = rhs.iter().position(|b| !b.is_finite());
                let anywhere = ranks.any(index.is_some());
                // only its own rank knows the entry
                let index = index.filter(|_| ranks.size() == 1);
                let unusable = SolveError::NonFiniteRightHandSide { index };
                Some(Err(if anywhere { unusable } else { SolveError::NonFinite }))
            } else if size == 0.0 {
                x.fill(0.0);
                Some(Ok(SolveReport { initial_residual: 0.0, ..report }))
            } else {
                None
            }
        };
        let residual = vec![0.0; rhs.len()];
        Self { matrix, rhs, x, weights: None, residual, report, target: 0.0, stopped: false, outcome }
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
        self.matrix.a.absolute_product(self.matrix.transpose, x, &mut sizes);
        sizes.iter_mut().zip(self.rhs).for_each(|(size, b)| *size += b.abs());
        self.weigh(&mut sizes);
        self.matrix.norm_of(&sizes)
    }

    /// Measures the present solution.
    fn assess(&mut self) {
        match self.assessed(self.x, self.report.iterations) {
            Ok((report, residual)) => (self.report, self.residual) = (report, residual),
            Err(error) => self.outcome = Some(Err(error)),
        }
    }

    /// Report and weighted residual of a vector.
    fn assessed(&self, x: &[f64], iterations: usize) -> Result<(SolveReport, Vec<f64>), SolveError> {
        let Matrix { a, transpose, norm, .. } = *self.matrix;
        let mut residual = vec![0.0; x.len()];
        a.residual(transpose, x, self.rhs, &mut residual);
        let (relative_residual, backward_error) = if self.weights.is_some() {
            let mut rhs = self.rhs.to_vec();
            self.weigh(&mut residual);
            self.weigh(&mut rhs);
            let size = norm_on(&residual, a.ranks());
            (size / norm_on(&rhs, a.ranks()), size / self.rounding(x))
        } else {
            let [residual_size, x_size, rhs_size] = [&residual, x, self.rhs].map(|v| a.ranks().largest(largest(v)));
            let backward_error = residual_size / (norm * x_size + rhs_size);
            (norm_on(&residual, a.ranks()) / norm_on(self.rhs, a.ranks()), backward_error)
        };
        if relative_residual.is_finite() && backward_error.is_finite() {
            let initial_residual = self.report.initial_residual;
            Ok((SolveReport { relative_residual, backward_error, initial_residual, iterations }, residual))
        } else {
            Err(SolveError::NonFinite)
        }
    }

    /// Takes over what a cycle has found, if it is better.
    fn take(&mut self, found: Found) -> Result<(), SolveError> {
        if !found.finite {
            return Err(SolveError::NonFinite);
        }
        let (improved, residual) = self.assessed(&found.x, self.report.iterations + found.taken)?;
        let stalled = improved.relative_residual > 0.5 * self.report.relative_residual;
        if improved.relative_residual < self.report.relative_residual {
            self.x.copy_from_slice(&found.x);
            (self.report, self.residual) = (improved, residual);
        } else {
            self.report.iterations = improved.iterations;
        }
        self.stopped = stalled || found.given_up;
        Ok(())
    }
}

/// What a cycle has found for one right-hand side.
struct Found {
    x: Vec<f64>,
    /// Iterations.
    taken: usize,
    /// Ended because the residual falls too slowly.
    given_up: bool,
    /// Whether all numbers are finite.
    finite: bool,
}

/// Cycles for all solves together, each until `enough`, until it stalls, or until no iteration is
/// left.
fn iterate(
    matrix: &Matrix<'_>,
    solves: &mut [Solve<'_>],
    options: &SolveOptions,
    enough: &dyn Fn(&SolveReport) -> bool,
) {
    solves.iter_mut().for_each(|solve| solve.stopped = false);
    loop {
        let goes_on = |solve: &&mut Solve<'_>| {
            let left = options.max_iterations > solve.report.iterations;
            solve.outcome.is_none() && !solve.stopped && left && !enough(&solve.report)
        };
        let mut running: Vec<&mut Solve<'_>> = solves.iter_mut().filter(goes_on).collect();
        if running.is_empty() {
            return;
        }
        let found: Vec<Found> = {
            let all: Vec<&Solve<'_>> = running.iter().map(|solve| &**solve).collect();
            // weights differ from one right-hand side to the next, and with them the equations
            let size = if all.iter().any(|solve| solve.weights.is_some()) { 1 } else { SHARING };
            let mut groups: Vec<Group<'_>> = all.chunks(size).map(|group| Group::new(group, options)).collect();
            loop {
                let next: Vec<Vec<Vec<f64>>> = groups.iter().map(Group::next).collect();
                let counts: Vec<usize> = next.iter().map(Vec::len).collect();
                let mut directions = next.concat();
                if directions.is_empty() {
                    break;
                }
                matrix.precondition(&mut directions);
                let products = matrix.products(&directions);
                let mut found = directions.into_iter().zip(products);
                for (group, count) in groups.iter_mut().zip(counts).filter(|(_, count)| *count > 0) {
                    group.extend(found.by_ref().take(count), options);
                }
            }
            groups.into_iter().flat_map(Group::end).collect()
        };
        for (solve, found) in running.iter_mut().zip(found) {
            if let Err(error) = solve.take(found) {
                solve.outcome = Some(Err(error));
            }
        }
    }
}

/// Solves that share their directions.
enum Group<'s> {
    Alone(Cycle, &'s Solve<'s>),
    Shared(SharedCycle, &'s [&'s Solve<'s>]),
}

impl<'s> Group<'s> {
    fn new(solves: &'s [&'s Solve<'s>], options: &SolveOptions) -> Self {
        match solves {
            [alone] => Self::Alone(Cycle::new(alone, options), alone),
            several => Self::Shared(SharedCycle::new(several, options), several),
        }
    }

    /// The directions to be preconditioned next; none at the end.
    fn next(&self) -> Vec<Vec<f64>> {
        match self {
            Self::Alone(cycle, _) if cycle.ended => Vec::new(),
            Self::Alone(cycle, solve) => vec![cycle.next(solve)],
            Self::Shared(cycle, _) => cycle.next(),
        }
    }

    /// Adds preconditioned directions and their products with the matrix.
    fn extend(&mut self, mut found: impl Iterator<Item = (Vec<f64>, Vec<f64>)>, options: &SolveOptions) {
        match self {
            Self::Alone(cycle, solve) => {
                let (z, w) = found.next().expect("a direction");
                cycle.extend(solve, z, w, options);
            }
            Self::Shared(cycle, solves) => cycle.extend(solves, found, options),
        }
    }

    fn end(self) -> Vec<Found> {
        match self {
            Self::Alone(cycle, solve) => vec![cycle.end(solve.x)],
            Self::Shared(cycle, _) => cycle.end(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: after four iterations that found two of seven digits, five digits are left. At twice
    /// that pace they take five iterations, less than an alternative with a preparation of 6 or with
    /// 1.1 per digit, but not of 4 or with 0.9. Nothing is decided before the third iteration, and
    /// without any progress every alternative is better.
    #[test]
    fn an_alternative_is_compared_with_what_is_left() {
        let course = [1.0, 1e-2, 1e-7];
        let beats = |preparation, per_digit| Alternative { preparation, per_digit }.beats(4, course);
        assert!(!beats(6.0, 0.0) && !beats(0.0, 1.1) && beats(4.0, 0.0) && beats(0.0, 0.9));
        let costly = Alternative { preparation: 1e3, per_digit: 0.0 };
        assert!(!costly.beats(2, [1.0, 1.0, 1e-7]) && costly.beats(3, [1.0, 1.0, 1e-7]));
    }
}
