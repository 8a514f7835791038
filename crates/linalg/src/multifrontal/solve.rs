//! Forward and backward substitution along the fronts.
//!
//! With P A Q = L U, rows are read in the order of the pivot rows and columns in the order of the
//! pivot columns; for the transposed system, rows and columns swap roles, and so do the two
//! triangles.

use super::Numeric;
use super::scalar::Scalar;

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
        let columns = rhs.len() / n;
        let mut units = Vec::with_capacity(columns);
        let mut x = vec![T::ZERO; rhs.len()];
        for (j, column) in rhs.chunks_exact_mut(n).enumerate() {
            column.iter_mut().zip(before).for_each(|(b, scale)| *b *= scale);
            let unit = power_of_two_near(crate::vectors::largest(column));
            for (x, &i) in x.chunks_exact_mut(columns).zip(&self.structure.permutation) {
                x[j] = T::from_f64(column[i as usize] / unit);
            }
            units.push(unit);
        }
        self.sweep(transpose, columns, &mut x);
        for ((j, column), unit) in rhs.chunks_exact_mut(n).enumerate().zip(units) {
            for (&i, x) in self.structure.permutation.iter().zip(x.chunks_exact(columns)) {
                column[i as usize] = x[j].to_f64() * unit * after[i as usize];
            }
        }
    }
}

/// Unit for a right-hand side, so that single precision neither overflows nor underflows.
fn power_of_two_near(largest: f64) -> f64 {
    if largest.is_normal() { largest.log2().floor().clamp(-1000.0, 1000.0).exp2() } else { 1.0 }
}
