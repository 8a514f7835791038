//! A matrix with its factors, and a solution in progress.

use super::report::{SolveError, SolveReport};
use crate::csr::norm_on;
use crate::operator::Operator;
use crate::solver::Factorization;
use crate::vectors::largest;

/// A matrix with its factors, or their transposes.
pub(super) struct Matrix<'a> {
    pub(super) a: &'a dyn Operator,
    pub(super) f: &'a dyn Factorization,
    pub(super) transpose: bool,
    /// Infinity norm of the operator.
    pub(super) norm: f64,
}

impl Matrix<'_> {
    /// ‖v‖₂ over all ranks.
    pub(super) fn norm_of(&self, v: &[f64]) -> f64 {
        norm_on(v, self.a.ranks())
    }

    pub(super) fn precondition(&self, vectors: &mut [Vec<f64>]) {
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

    pub(super) fn products(&self, vectors: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut products: Vec<Vec<f64>> = vectors.iter().map(|v| vec![0.0; v.len()]).collect();
        if self.transpose {
            vectors.iter().zip(&mut products).for_each(|(v, product)| self.a.mul_transpose(v, product));
        } else {
            self.a.mul_many(vectors, &mut products);
        }
        products
    }

    /// Measures the present solutions.
    pub(super) fn assess(&self, solves: &mut [&mut Solve<'_>]) {
        let x: Vec<Vec<f64>> = solves.iter().map(|solve| solve.x.to_vec()).collect();
        for (solve, product) in solves.iter_mut().zip(self.products(&x)) {
            match solve.assessed(solve.x, product, solve.report.iterations) {
                Ok((report, residual)) => (solve.report, solve.residual) = (report, residual),
                Err(error) => solve.outcome = Some(Err(error)),
            }
        }
    }

    /// Takes over what cycles have found, where it is better.
    pub(super) fn take(&self, solves: &mut [&mut Solve<'_>], found: Vec<Found>) {
        let mut usable = Vec::with_capacity(found.len());
        for (solve, found) in solves.iter_mut().zip(found) {
            match found.finite {
                true => usable.push((solve, found)),
                false => solve.outcome = Some(Err(SolveError::NonFinite)),
            }
        }
        let x: Vec<Vec<f64>> = usable.iter_mut().map(|(_, found)| std::mem::take(&mut found.x)).collect();
        let products = self.products(&x);
        for (((solve, found), x), product) in usable.into_iter().zip(x).zip(products) {
            if let Err(error) = solve.take(&Found { x, ..found }, product) {
                solve.outcome = Some(Err(error));
            }
        }
    }
}

/// The solution for one right-hand side, in progress.
pub(super) struct Solve<'a> {
    pub(super) matrix: &'a Matrix<'a>,
    pub(super) rhs: &'a [f64],
    pub(super) x: &'a mut [f64],
    /// Factors by which the equations are multiplied before they are measured.
    pub(super) weights: Option<Vec<f64>>,
    /// Of `x`, multiplied by the weights.
    pub(super) residual: Vec<f64>,
    pub(super) report: SolveReport,
    /// The norm of the residual to reach.
    pub(super) target: f64,
    /// The last cycle stalled, or was given up.
    pub(super) stopped: bool,
    /// Set when nothing is left to do.
    pub(super) outcome: Option<Result<SolveReport, SolveError>>,
}

impl<'a> Solve<'a> {
    /// Checks the right-hand side; nothing is left to do if it is zero or unusable.
    pub(super) fn new(matrix: &'a Matrix<'a>, rhs: &'a [f64], x: &'a mut [f64]) -> Self {
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

    pub(super) fn weigh(&self, v: &mut [f64]) {
        if let Some(weights) = &self.weights {
            v.iter_mut().zip(weights).for_each(|(v, w)| *v *= w);
        }
    }

    pub(super) fn unweigh(&self, v: &mut [f64]) {
        if let Some(weights) = &self.weights {
            v.iter_mut().zip(weights).for_each(|(v, w)| *v /= w);
        }
    }

    /// ‖W (|A| |x| + |b|)‖₂: the size of the terms in the residual.
    pub(super) fn rounding(&self, x: &[f64]) -> f64 {
        let mut sizes = vec![0.0; x.len()];
        self.matrix.a.absolute_product(self.matrix.transpose, x, &mut sizes);
        sizes.iter_mut().zip(self.rhs).for_each(|(size, b)| *size += b.abs());
        self.weigh(&mut sizes);
        self.matrix.norm_of(&sizes)
    }

    /// Report and weighted residual of a vector with this product.
    fn assessed(&self, x: &[f64], product: Vec<f64>, iterations: usize) -> Result<(SolveReport, Vec<f64>), SolveError> {
        let Matrix { a, norm, .. } = *self.matrix;
        let mut residual = product;
        residual.iter_mut().zip(self.rhs).for_each(|(r, b)| *r = b - *r);
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
    fn take(&mut self, found: &Found, product: Vec<f64>) -> Result<(), SolveError> {
        let (improved, residual) = self.assessed(&found.x, product, self.report.iterations + found.taken)?;
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
pub(super) struct Found {
    pub(super) x: Vec<f64>,
    /// Iterations.
    pub(super) taken: usize,
    /// Ended because the residual falls too slowly.
    pub(super) given_up: bool,
    /// Whether all numbers are finite.
    pub(super) finite: bool,
}
