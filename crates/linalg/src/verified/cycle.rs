//! Iterations of one right-hand side: flexible GMRES.

use super::report::SolveOptions;
use super::solve::{Found, Solve};
use crate::csr::norm_on;
use crate::vectors::{dots, subtract};
use slipstick_ranks::Ranks;

/// One cycle of flexible GMRES from the residual of a solution.
pub(super) struct Cycle {
    basis: Vec<Vec<f64>>,
    /// Preconditioned directions.
    directions: Vec<Vec<f64>>,
    hessenberg: GivensLeastSquares,
    /// Norm of the residual at the start.
    beta: f64,
    /// Maximum number of directions.
    steps: usize,
    pub ended: bool,
    /// Ended because the residual falls too slowly.
    given_up: bool,
    /// Whether all numbers are finite.
    finite: bool,
}

impl Cycle {
    pub(super) fn new(solve: &Solve<'_>, options: &SolveOptions) -> Self {
        let beta = solve.matrix.norm_of(&solve.residual);
        let left = options.max_iterations.saturating_sub(solve.report.iterations);
        Self {
            basis: vec![solve.residual.iter().map(|r| r / beta).collect()],
            directions: Vec::new(),
            hessenberg: GivensLeastSquares::new(beta),
            beta,
            steps: left.min(options.restart.max(1)),
            ended: false,
            given_up: false,
            finite: true,
        }
    }

    /// The direction to be preconditioned next.
    pub(super) fn next(&self, solve: &Solve<'_>) -> Vec<f64> {
        let mut z = self.basis[self.directions.len()].clone();
        solve.unweigh(&mut z);
        z
    }

    /// Adds a preconditioned direction and its product with the matrix.
    pub(super) fn extend(&mut self, solve: &Solve<'_>, z: Vec<f64>, mut w: Vec<f64>, options: &SolveOptions) {
        solve.weigh(&mut w);
        self.directions.push(z);
        let column = orthogonalise(&mut w, &self.basis, solve.matrix.a.ranks());
        if !column.iter().all(|h| h.is_finite()) {
            (self.ended, self.finite) = (true, false);
            return;
        }
        let next = column[column.len() - 1];
        let estimate = self.hessenberg.push(column);
        let taken = self.directions.len();
        if estimate <= 0.5 * solve.target || next == 0.0 {
            self.ended = true;
            return;
        }
        let course = [self.beta, estimate, 0.5 * solve.target];
        if options.alternative.is_some_and(|other| other.beats(taken, course)) {
            (self.ended, self.given_up) = (true, true);
            return;
        }
        w.iter_mut().for_each(|w| *w /= next);
        self.basis.push(w);
        self.ended = taken == self.steps;
    }

    /// Adds the correction that leaves the least residual to the start `x`.
    pub(super) fn end(self, x: &[f64]) -> Found {
        let mut x = x.to_vec();
        if self.finite {
            let opposite: Vec<f64> = self.hessenberg.solution().iter().map(|coefficient| -coefficient).collect();
            subtract(&mut x, &opposite, &self.directions);
        }
        Found { x, taken: self.directions.len(), given_up: self.given_up, finite: self.finite }
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
        let mut components = dots(w, basis);
        ranks.sum(&mut components);
        subtract(w, &components, basis);
        column.iter_mut().zip(components).for_each(|(h, component)| *h += component);
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

    /// Coefficients of the minimizer. The coefficient for a zero pivot (an exactly singular
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
