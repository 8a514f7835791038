//! Scalar sparse matrices by rows.

use crate::operator::Operator;
use crate::ranks::{Alone, Ranks};
use rayon::prelude::*;
use std::sync::Arc;

/// Rows below which a product is not worth splitting among threads.
const ROWS_PER_TASK: usize = 1024;

/// Sparsity of a square scalar matrix, by rows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CsrPattern {
    /// Number of rows and columns.
    pub n: usize,
    /// Start of each row in `columns`, then the number of entries. `n + 1` items.
    pub row_offsets: Vec<usize>,
    /// Column of each entry, ascending within a row.
    pub columns: Vec<u32>,
    /// Elimination group of each unknown: unknowns of one group are eliminated one after the other. A
    /// contact multiplier shares the group of its slave node, whose displacements come first: once they
    /// are eliminated, its pivots are no longer zero. Any numbers will do. `n` items.
    pub groups: Vec<u32>,
    /// Number of each unknown before prescribed ones were removed: three times its block row plus its component. Block
    /// rows are named like groups: an unknown whose block row is not its group is a multiplier. `n` items, or none where
    /// nobody asks.
    pub origins: Vec<u32>,
}

/// A square scalar sparse matrix by rows. Entries may be zero; the pattern stays.
#[derive(Debug, Clone)]
pub struct CsrMatrix {
    /// The sparsity; solvers keep their analysis while this is the same allocation.
    pub pattern: Arc<CsrPattern>,
    /// The entries, in the order of `pattern.columns`.
    pub values: Vec<f64>,
}

impl CsrPattern {
    /// Number of stored entries.
    pub fn entries(&self) -> usize {
        self.columns.len()
    }

    /// Whether offsets, columns and groups have the lengths and ranges that the documentation of
    /// the fields states. Solvers refuse a pattern that is not.
    pub fn is_consistent(&self) -> bool {
        self.row_offsets.len() == self.n + 1
            && self.groups.len() == self.n
            && (self.origins.is_empty() || self.origins.len() == self.n)
            && self.row_offsets[0] == 0
            && self.row_offsets[self.n] == self.columns.len()
            && self.row_offsets.windows(2).all(|w| {
                w[0] <= w[1] && w[1] <= self.columns.len() && {
                    let row = &self.columns[w[0]..w[1]];
                    row.windows(2).all(|c| c[0] < c[1]) && row.last().is_none_or(|&c| (c as usize) < self.n)
                }
            })
    }
}

impl CsrMatrix {
    /// Number of rows and columns.
    pub fn n(&self) -> usize {
        self.pattern.n
    }

    /// Columns and values of row `i`.
    pub fn row(&self, i: usize) -> (&[u32], &[f64]) {
        let range = self.pattern.row_offsets[i]..self.pattern.row_offsets[i + 1];
        (&self.pattern.columns[range.clone()], &self.values[range])
    }

    /// `y = A x`, parallel over rows, with the same result for any number of threads.
    ///
    /// # Panics
    /// If a length differs from the number of rows.
    pub fn mul(&self, x: &[f64], y: &mut [f64]) {
        self.check_lengths(x, y);
        y.par_iter_mut().with_min_len(ROWS_PER_TASK).enumerate().for_each(|(i, y)| {
            let (columns, values) = self.row(i);
            *y = columns.iter().zip(values).map(|(&j, a)| a * x[j as usize]).sum();
        });
    }

    /// `y = Aᵀ x`. Sequential, since rows scatter into common entries.
    ///
    /// # Panics
    /// If a length differs from the number of rows.
    pub fn mul_transpose(&self, x: &[f64], y: &mut [f64]) {
        self.check_lengths(x, y);
        y.fill(0.0);
        for (i, &xi) in x.iter().enumerate() {
            let (columns, values) = self.row(i);
            for (&j, a) in columns.iter().zip(values) {
                y[j as usize] += a * xi;
            }
        }
    }

    /// ‖b − A x‖₂ (with `transpose`: of Aᵀ). NaN if anything is not finite.
    pub fn residual_norm(&self, transpose: bool, x: &[f64], b: &[f64]) -> f64 {
        let mut r = vec![0.0; self.n()];
        self.residual(transpose, x, b, &mut r);
        norm(&r)
    }

    /// ‖A‖∞, the largest absolute row sum; with `transpose` the largest absolute column sum.
    pub fn infinity_norm(&self, transpose: bool) -> f64 {
        self.absolute_sums(transpose).into_iter().fold(0.0, f64::max)
    }

    /// Σ|aᵢⱼ| of every row; with `transpose` of every column.
    pub(crate) fn absolute_sums(&self, transpose: bool) -> Vec<f64> {
        if transpose {
            let mut sums = vec![0.0; self.n()];
            for (&j, a) in self.pattern.columns.iter().zip(&self.values) {
                sums[j as usize] += a.abs();
            }
            sums
        } else {
            (0..self.n()).map(|i| self.row(i).1.iter().map(|a| a.abs()).sum()).collect()
        }
    }

    /// max |aᵢⱼ| of every row.
    pub fn largest_in_rows(&self) -> Vec<f64> {
        (0..self.n()).map(|i| self.row(i).1.iter().fold(0.0, |m: f64, x| m.max(x.abs()))).collect()
    }

    /// Row and column of the first entry that is not finite.
    pub fn first_non_finite(&self) -> Option<(usize, usize)> {
        let k = self.values.iter().position(|a| !a.is_finite())?;
        let row = self.pattern.row_offsets.partition_point(|&offset| offset <= k) - 1;
        Some((row, self.pattern.columns[k] as usize))
    }

    fn check_lengths(&self, x: &[f64], y: &[f64]) {
        let n = self.n();
        assert!(
            x.len() == n && y.len() == n,
            "the matrix has {n} rows, but the vectors have {} and {} entries",
            x.len(),
            y.len()
        );
    }
}

/// ‖v‖₂, summed in a fixed order, scaled so that neither overflow nor underflow spoils it.
/// NaN if an entry is.
pub(crate) fn norm(v: &[f64]) -> f64 {
    norm_on(v, &Alone)
}

/// ‖v‖₂ of a vector of which each rank has a part: the same on all of them.
pub(crate) fn norm_on(v: &[f64], ranks: &dyn Ranks) -> f64 {
    let sum_over_ranks = |here: f64| {
        let mut sum = [here];
        ranks.sum(&mut sum);
        sum[0]
    };
    let sum = sum_over_ranks(v.iter().map(|x| x * x).sum());
    if sum.is_normal() && sum > 1e-280 {
        return sum.sqrt();
    }
    let largest = ranks.largest(largest(v));
    if largest == 0.0 || !largest.is_finite() {
        return largest;
    }
    largest * sum_over_ranks(v.iter().map(|x| (x / largest) * (x / largest)).sum()).sqrt()
}

/// max |vᵢ|, or NaN if an entry is NaN.
pub(crate) fn largest(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |m: f64, x| if x.is_nan() || m.is_nan() { f64::NAN } else { m.max(x.abs()) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> CsrMatrix {
        // [ 2 0 -1 ; 0 3 0 ; 4 5 0 ]
        let (row_offsets, columns) = (vec![0, 2, 3, 5], vec![0, 2, 1, 0, 1]);
        let pattern = CsrPattern { n: 3, row_offsets, columns, groups: vec![0, 1, 2], origins: Vec::new() };
        CsrMatrix { pattern: Arc::new(pattern), values: vec![2.0, -1.0, 3.0, 4.0, 5.0] }
    }

    #[test]
    fn products_and_norms_by_hand() {
        let a = example();
        let (x, mut y) = ([1.0, 2.0, 3.0], [0.0; 3]);
        a.mul(&x, &mut y);
        assert_eq!(y, [-1.0, 6.0, 14.0]);
        a.mul_transpose(&x, &mut y);
        assert_eq!(y, [14.0, 21.0, -1.0]);
        assert_eq!(a.infinity_norm(false), 9.0);
        assert_eq!(a.infinity_norm(true), 8.0);
        assert_eq!(a.residual_norm(false, &x, &[2.0, 6.0, 10.0]), 5.0);
    }

    #[test]
    fn consistency_is_checked() {
        let a = example();
        assert!(a.pattern.is_consistent());
        let mut unsorted = (*a.pattern).clone();
        unsorted.columns.swap(0, 1);
        assert!(!unsorted.is_consistent());
    }

    #[test]
    fn non_finite_entries_are_located() {
        let mut a = example();
        assert_eq!(a.first_non_finite(), None);
        a.values[3] = f64::NAN;
        assert_eq!(a.first_non_finite(), Some((2, 0)));
    }

    #[test]
    fn norms_survive_extreme_scales() {
        assert!((norm(&[3e-200, 4e-200]) / 5e-200 - 1.0).abs() < 1e-15);
        assert!((norm(&[3e200, 4e200]) / 5e200 - 1.0).abs() < 1e-15);
        assert!(norm(&[1.0, f64::NAN]).is_nan());
    }
}
