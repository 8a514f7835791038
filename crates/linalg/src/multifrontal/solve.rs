//! Forward and backward substitution along the fronts.
//!
//! With P A Q = L U, rows are read in the order of the pivot rows and columns in the order of the
//! pivot columns; for the transposed system, rows and columns exchange roles, and so do the two
//! triangles.

use super::Numeric;
use super::front::Front;
use super::scalar::Scalar;
use faer::linalg::triangular_solve as triangular;
use faer::{Accum, MatMut, MatRef, Par};

/// Number of right-hand sides treated together.
const BLOCK: usize = 32;

impl<T: Scalar> Numeric<T> {
    /// Overwrites the right-hand sides, one after the other in `rhs`, with the solutions.
    pub fn solve(&self, transpose: bool, rhs: &mut [f64]) {
        if self.structure.n == 0 {
            return;
        }
        for block in rhs.chunks_mut(self.structure.n * BLOCK) {
            self.solve_block(transpose, block);
        }
    }

    fn solve_block(&self, transpose: bool, rhs: &mut [f64]) {
        let n = self.structure.n;
        let (before, after) = if transpose {
            (&self.scaling.columns, &self.scaling.rows)
        } else {
            (&self.scaling.rows, &self.scaling.columns)
        };
        let mut units = Vec::with_capacity(rhs.len() / n);
        let mut x: Vec<T> = Vec::with_capacity(rhs.len());
        for column in rhs.chunks_exact_mut(n) {
            column.iter_mut().zip(before).for_each(|(b, scale)| *b *= scale);
            let unit = power_of_two_near(crate::csr::largest(column));
            let permuted = self.structure.permutation.iter();
            x.extend(permuted.map(|&i| T::from_f64(column[i as usize] / unit)));
            units.push(unit);
        }
        if units.len() == 1 {
            self.sweep(transpose, &mut x);
        } else {
            self.sweep_block(transpose, &mut x);
        }
        for ((column, x), unit) in rhs.chunks_exact_mut(n).zip(x.chunks_exact(n)).zip(units) {
            for (&i, x) in self.structure.permutation.iter().zip(x) {
                column[i as usize] = x.to_f64() * unit * after[i as usize];
            }
        }
    }

    /// Rows (forward) and columns (backward) of a front beyond its pivots.
    pub(super) fn beyond<'a>(&'a self, k: usize, delayed: &'a [u32]) -> impl Iterator<Item = usize> + 'a {
        delayed.iter().chain(&self.structure.supernodes[k].rows).map(|&i| i as usize)
    }

    /// Several right-hand sides at once, with matrix products.
    fn sweep_block(&self, transpose: bool, x: &mut [T]) {
        let n = self.structure.n;
        let mut stages: Vec<Vec<T>> = Vec::with_capacity(self.fronts.len());
        for (k, front) in self.fronts.iter().enumerate() {
            let (pivots, delayed) = if transpose {
                (&front.pivot_columns, &front.delayed_columns)
            } else {
                (&front.pivot_rows, &front.delayed_rows)
            };
            let mut w = gather(x, n, || pivots.iter().map(|&i| i as usize));
            let rows = delayed.len() + self.structure.supernodes[k].rows.len();
            let update = front.forward_block(transpose, &mut w, rows, x.len() / n);
            for (x, update) in x.chunks_exact_mut(n).zip(update.chunks_exact(rows.max(1))) {
                for (i, u) in self.beyond(k, delayed).zip(update) {
                    x[i] += *u;
                }
            }
            stages.push(w);
        }
        for (k, (front, mut w)) in self.fronts.iter().zip(stages).enumerate().rev() {
            let (pivots, delayed) = if transpose {
                (&front.pivot_rows, &front.delayed_rows)
            } else {
                (&front.pivot_columns, &front.delayed_columns)
            };
            let known = gather(x, n, || self.beyond(k, delayed));
            front.backward_block(transpose, &mut w, &known, x.len() / n);
            for (x, w) in x.chunks_exact_mut(n).zip(w.chunks_exact(pivots.len().max(1))) {
                for (&i, w) in pivots.iter().zip(w) {
                    x[i as usize] = *w;
                }
            }
        }
    }
}

impl<T: Scalar> Front<T> {
    /// Solves with L11 (U11ᵀ) and returns the negative update −L21 w (−U12ᵀ w) of `rows` rows.
    fn forward_block(&self, transpose: bool, w: &mut [T], rows: usize, columns: usize) -> Vec<T> {
        let q = self.pivot_rows.len();
        let lu = MatRef::from_column_major_slice(&self.lu, q, q);
        let mut w = MatMut::from_column_major_slice_mut(w, q, columns);
        let mut update = vec![T::ZERO; rows * columns];
        let target = MatMut::from_column_major_slice_mut(&mut update, rows, columns);
        if transpose {
            let upper = MatRef::from_column_major_slice(&self.upper, q, rows).transpose();
            triangular::solve_lower_triangular_in_place(lu.transpose(), w.as_mut(), Par::Seq);
            faer::linalg::matmul::matmul(target, Accum::Add, upper, w.as_ref(), -T::ONE, Par::Seq);
        } else {
            let lower = MatRef::from_column_major_slice(&self.lower, rows, q);
            triangular::solve_unit_lower_triangular_in_place(lu, w.as_mut(), Par::Seq);
            faer::linalg::matmul::matmul(target, Accum::Add, lower, w.as_ref(), -T::ONE, Par::Seq);
        }
        update
    }

    /// w ← U11⁻¹ (w − U12 known), transposed L11⁻ᵀ (w − L21ᵀ known).
    fn backward_block(&self, transpose: bool, w: &mut [T], known: &[T], columns: usize) {
        let q = self.pivot_rows.len();
        let rows = known.len() / columns;
        let lu = MatRef::from_column_major_slice(&self.lu, q, q);
        let mut w = MatMut::from_column_major_slice_mut(w, q, columns);
        let known = MatRef::from_column_major_slice(known, rows, columns);
        if transpose {
            let lower = MatRef::from_column_major_slice(&self.lower, rows, q).transpose();
            faer::linalg::matmul::matmul(w.as_mut(), Accum::Add, lower, known, -T::ONE, Par::Seq);
            triangular::solve_unit_upper_triangular_in_place(lu.transpose(), w, Par::Seq);
        } else {
            let upper = MatRef::from_column_major_slice(&self.upper, q, rows);
            faer::linalg::matmul::matmul(w.as_mut(), Accum::Add, upper, known, -T::ONE, Par::Seq);
            triangular::solve_upper_triangular_in_place(lu, w, Par::Seq);
        }
    }
}

/// Entries at `places` of each column of `n` entries.
fn gather<T: Copy, I: Iterator<Item = usize>>(x: &[T], n: usize, places: impl Fn() -> I) -> Vec<T> {
    x.chunks_exact(n).flat_map(|column| places().map(|i| column[i])).collect()
}

/// Unit for a right-hand side, so that single precision neither overflows nor underflows.
fn power_of_two_near(largest: f64) -> f64 {
    if largest.is_normal() { largest.log2().floor().clamp(-1000.0, 1000.0).exp2() } else { 1.0 }
}
