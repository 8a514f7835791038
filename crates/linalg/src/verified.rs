//! Solves verified by their true residual.

mod cycle;
mod report;
mod shared;
mod solve;

use crate::csr::norm_on;
use crate::operator::Operator;
use crate::solver::Factorization;
use cycle::Cycle;
pub use report::{Alternative, SolveError, SolveOptions, SolveReport};
use shared::SharedCycle;
use solve::{Found, Matrix, Solve};

/// Backward error at which a stalled iteration has reached the round-off of the residual itself: a
/// few units in the last place, since rows have a few hundred entries.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Maximum number of right-hand sides that share directions: each direction must be orthogonal to all
/// others, so the cost grows with the square of the number.
const SHARING: usize = 4;

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
    let (mut cold, mut warm): (Vec<&mut Solve<'_>>, Vec<_>) =
        solves.iter_mut().filter(|solve| solve.outcome.is_none()).partition(|solve| without_guess(solve));
    let mut first: Vec<Vec<f64>> = cold.iter().map(|solve| solve.rhs.to_vec()).collect();
    matrix.precondition(&mut first);
    cold.iter_mut().zip(first).for_each(|(solve, first)| solve.x.copy_from_slice(&first));
    matrix.assess(&mut cold);
    matrix.assess(&mut warm);
    warm.into_iter().for_each(|solve| solve.report.initial_residual = solve.report.relative_residual);
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
            matrix.assess(&mut [&mut *solve]);
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
    matrix.assess(&mut [&mut solve]);
    let mut sizes = rhs.to_vec();
    solve.weigh(&mut sizes);
    solve.target = options.tolerance * matrix.norm_of(&sizes);
    let mut solves = [solve];
    iterate(&matrix, &mut solves, options, &|report| report.relative_residual <= options.tolerance);
    let [solve] = solves;
    solve.outcome.unwrap_or(Ok(solve.report))
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
        matrix.take(&mut running, found);
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
