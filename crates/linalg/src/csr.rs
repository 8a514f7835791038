//! Scalar sparse matrices by rows.

use crate::identity::PatternId;
use crate::operator::Operator;
use crate::solver::FactorizationError;
use crate::vectors;
use rayon::prelude::*;
use slipstick_ranks::{Alone, Ranks};
use std::ops::Range;
use std::sync::Arc;
use thiserror::Error;

/// Rows below which a product is not worth splitting among threads.
const ROWS_PER_TASK: usize = 1024;

/// Entries that a thread scans at a time.
const ENTRIES_PER_TASK: usize = 1 << 16;

/// Rows of a product with the transpose that are summed on their own, and the most parts that these
/// make.
const ROWS_PER_PART: usize = 1 << 15;
const MOST_PARTS: usize = 16;

/// Sparsity of a square scalar matrix, by rows. The constructor checks it; it is immutable.
#[derive(Debug, Clone)]
pub struct CsrPattern {
    id: PatternId,
    row_offsets: Vec<usize>,
    columns: Vec<u32>,
    groups: Vec<u32>,
    origins: Vec<u32>,
}

/// The arguments of [`CsrPattern::new`] contradict each other.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "the sparsity pattern of {n} rows is inconsistent: {n} + 1 offsets must ascend from 0 to the number of columns, \
     the columns of a row must ascend below {n}, and every row must have a group"
)]
pub struct PatternError {
    /// Number of rows, which is the number of groups.
    pub n: usize,
}

/// A square scalar sparse matrix by rows, in double precision or (for its products) in single
/// precision. Entries may be zero; the pattern stays.
#[derive(Debug, Clone)]
pub struct CsrMatrix<T = f64> {
    /// The sparsity.
    pub pattern: Arc<CsrPattern>,
    /// The entries, in the order of [`CsrPattern::columns`].
    pub values: Vec<T>,
}

impl CsrPattern {
    /// A pattern with a new identity. `groups` sets the number of rows, n.
    ///
    /// * `row_offsets` (n + 1 items): start of each row in `columns`, then the number of entries.
    /// * `columns`: column of each entry, ascending within each row.
    /// * `groups` (n items): see [`CsrPattern::groups`].
    /// * `origins` (n items, or none if no solver needs them): see [`CsrPattern::origins`].
    ///
    /// # Errors
    /// If a length, an offset or a column is inconsistent.
    pub fn new(
        row_offsets: Vec<usize>,
        columns: Vec<u32>,
        groups: Vec<u32>,
        origins: Vec<u32>,
    ) -> Result<Self, PatternError> {
        let n = groups.len();
        let consistent = row_offsets.len() == n + 1
            && (origins.is_empty() || origins.len() == n)
            && row_offsets[0] == 0
            && row_offsets[n] == columns.len()
            && row_offsets.windows(2).all(|w| {
                w[0] <= w[1] && w[1] <= columns.len() && {
                    let row = &columns[w[0]..w[1]];
                    row.windows(2).all(|c| c[0] < c[1]) && row.last().is_none_or(|&c| (c as usize) < n)
                }
            });
        let id = PatternId::mint();
        if consistent { Ok(Self { id, row_offsets, columns, groups, origins }) } else { Err(PatternError { n }) }
    }

    /// Number of rows and columns.
    pub fn n(&self) -> usize {
        self.groups.len()
    }

    /// Number of stored entries.
    pub fn entries(&self) -> usize {
        self.columns.len()
    }

    /// Identity, shared only by clones.
    pub fn id(&self) -> PatternId {
        self.id
    }

    /// Start of each row in [`CsrPattern::columns`], then the number of entries. n + 1 items.
    pub fn row_offsets(&self) -> &[usize] {
        &self.row_offsets
    }

    /// Column of each entry, ascending within a row.
    pub fn columns(&self) -> &[u32] {
        &self.columns
    }

    /// Positions of the entries of row `i` in [`CsrPattern::columns`].
    pub fn row_range(&self, i: usize) -> Range<usize> {
        self.row_offsets[i]..self.row_offsets[i + 1]
    }

    /// Columns of row `i`, ascending.
    pub fn row(&self, i: usize) -> &[u32] {
        &self.columns[self.row_range(i)]
    }

    /// Elimination group of each unknown, n items: a solver eliminates the unknowns of a group one
    /// after the other. A contact multiplier shares the group of its slave node, whose
    /// displacements come first: once they are eliminated, the multiplier's pivots are no longer
    /// zero. Group numbers are arbitrary.
    pub fn groups(&self) -> &[u32] {
        &self.groups
    }

    /// Whether each unknown is a multiplier, n items: the unknowns of a group that do not directly
    /// follow its first one.
    pub(crate) fn multipliers(&self) -> Vec<bool> {
        let mut seen = std::collections::HashSet::new();
        let mut multiplier = false;
        let is_multiplier = |(i, group): (usize, &u32)| {
            if i == 0 || *group != self.groups[i - 1] {
                multiplier = !seen.insert(*group);
            }
            multiplier
        };
        self.groups.iter().enumerate().map(is_multiplier).collect()
    }

    /// Number of each unknown before prescribed ones were removed, three times its block row plus
    /// its component; n items, or none. Groups are named after block rows: an unknown whose block
    /// row differs from its group is a multiplier.
    pub fn origins(&self) -> &[u32] {
        &self.origins
    }
}

impl PartialEq for CsrPattern {
    /// Whether the content is equal. Only patterns with different identities are compared entry by
    /// entry.
    fn eq(&self, other: &Self) -> bool {
        let same_rows = || self.row_offsets == other.row_offsets && self.columns == other.columns;
        let same_unknowns = || self.groups == other.groups && self.origins == other.origins;
        self.id == other.id || same_rows() && same_unknowns()
    }
}

impl Eq for CsrPattern {}

impl<T: Copy + Into<f64> + Sync> CsrMatrix<T> {
    /// Number of rows and columns.
    pub fn n(&self) -> usize {
        self.pattern.n()
    }

    /// Columns and values of row `i`.
    pub fn row(&self, i: usize) -> (&[u32], &[T]) {
        let range = self.pattern.row_range(i);
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
            *y = columns.iter().zip(values).map(|(&j, &a)| a.into() * x[j as usize]).sum();
        });
    }

    /// `y = Aᵀ x`, with the same result for any number of threads: the parts of a large matrix, whose
    /// rows scatter into common entries, are summed in parallel, and then added up in their order. The
    /// parts depend only on the number of rows.
    ///
    /// # Panics
    /// If a length differs from the number of rows.
    pub fn mul_transpose(&self, x: &[f64], y: &mut [f64]) {
        self.check_lengths(x, y);
        let n = self.n();
        let parts = (n / ROWS_PER_PART).clamp(1, MOST_PARTS);
        if parts == 1 {
            y.fill(0.0);
            self.scatter(0..n, x, 0, y);
            return;
        }
        let size = n.div_ceil(parts);
        let part = |k: usize| {
            let rows = k * size..((k + 1) * size).min(n);
            let columns = rows.clone().map(|i| self.pattern.row(i)).filter(|row| !row.is_empty());
            let (first, end) = columns.fold((n, 0), |(first, end), row| {
                (first.min(row[0] as usize), end.max(row[row.len() - 1] as usize + 1))
            });
            let mut sums = vec![0.0; end.saturating_sub(first)];
            self.scatter(rows, x, first, &mut sums);
            (first, sums)
        };
        let sums: Vec<(usize, Vec<f64>)> = (0..parts).into_par_iter().with_max_len(1).map(part).collect();
        y.par_chunks_mut(ROWS_PER_TASK).enumerate().for_each(|(k, y)| {
            y.fill(0.0);
            let start = k * ROWS_PER_TASK;
            for (first, sums) in &sums {
                let low = start.max(*first);
                let high = (start + y.len()).min(first + sums.len());
                if low < high {
                    let terms = &sums[low - first..high - first];
                    y[low - start..high - start].iter_mut().zip(terms).for_each(|(y, term)| *y += term);
                }
            }
        });
    }

    /// Adds the products of `rows` with their entries of x to `y`, which starts at column `first`.
    fn scatter(&self, rows: Range<usize>, x: &[f64], first: usize, y: &mut [f64]) {
        for i in rows {
            let (columns, values) = self.row(i);
            for (&j, &a) in columns.iter().zip(values) {
                y[j as usize - first] += a.into() * x[i];
            }
        }
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

impl CsrMatrix {
    /// The matrix in single precision.
    pub(crate) fn rounded(&self) -> CsrMatrix<f32> {
        CsrMatrix { pattern: self.pattern.clone(), values: self.values.par_iter().map(|&value| value as f32).collect() }
    }

    /// `Y = A X` for several vectors: entries are read once for a few of them. Each product is the
    /// one of [`CsrMatrix::mul`], bit for bit.
    ///
    /// # Panics
    /// If a length differs from the number of rows, or the numbers of vectors differ.
    pub fn mul_many(&self, x: &[Vec<f64>], y: &mut [Vec<f64>]) {
        assert_eq!(x.len(), y.len(), "each vector needs a product");
        for (x, y) in x.chunks(8).zip(y.chunks_mut(8)) {
            match (x, &mut *y) {
                ([x], [y]) => self.mul(x, y),
                _ if x.len() <= 4 => self.mul_together::<4>(x, y),
                _ => self.mul_together::<8>(x, y),
            }
        }
    }

    /// The products with at most `WIDTH` vectors, whose entries are interleaved.
    fn mul_together<const WIDTH: usize>(&self, x: &[Vec<f64>], y: &mut [Vec<f64>]) {
        let mut together = vec![[0.0; WIDTH]; self.n()];
        for (c, (x, y)) in x.iter().zip(&*y).enumerate() {
            self.check_lengths(x, y);
            together.iter_mut().zip(x).for_each(|(to, x)| to[c] = *x);
        }
        let product = |i: usize| {
            let (columns, values) = self.row(i);
            // the neutral element of a sum
            let mut sums = [-0.0; WIDTH];
            for (&j, a) in columns.iter().zip(values) {
                sums.iter_mut().zip(&together[j as usize]).for_each(|(sum, x)| *sum += a * x);
            }
            sums
        };
        let products: Vec<[f64; WIDTH]> =
            (0..self.n()).into_par_iter().with_min_len(ROWS_PER_TASK).map(product).collect();
        for (c, y) in y.iter_mut().enumerate() {
            y.iter_mut().zip(&products).for_each(|(y, products)| *y = products[c]);
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
            let sum = |i: usize| self.row(i).1.iter().map(|a| a.abs()).sum();
            (0..self.n()).into_par_iter().with_min_len(ROWS_PER_TASK).map(sum).collect()
        }
    }

    /// max |aᵢⱼ| of every row.
    pub fn largest_in_rows(&self) -> Vec<f64> {
        (0..self.n()).map(|i| self.row(i).1.iter().fold(0.0, |m: f64, x| m.max(x.abs()))).collect()
    }

    /// Checks that every entry of the pattern has a finite value.
    ///
    /// # Errors
    /// [`FactorizationError::Values`] or [`FactorizationError::NonFinite`].
    pub fn check(&self) -> Result<(), FactorizationError> {
        let (values, entries) = (self.values.len(), self.pattern.entries());
        if values != entries {
            return Err(FactorizationError::Values { values, entries });
        }
        match self.first_non_finite() {
            Some((row, column)) => Err(FactorizationError::NonFinite { row, column }),
            None => Ok(()),
        }
    }

    /// Row and column of the first entry that is not finite.
    pub fn first_non_finite(&self) -> Option<(usize, usize)> {
        // 0·a is NaN unless a is finite; the lanes become vector instructions
        let is_unusable = |values: &[f64]| {
            let (chunks, rest) = values.as_chunks::<8>();
            let mut lanes = [0.0; 8];
            for chunk in chunks {
                lanes.iter_mut().zip(chunk).for_each(|(lane, a)| *lane += 0.0 * a);
            }
            lanes.iter().chain(rest).any(|a| !a.is_finite())
        };
        let chunk = self.values.par_chunks(ENTRIES_PER_TASK).position_first(is_unusable)?;
        let start = chunk * ENTRIES_PER_TASK;
        let k = start + self.values[start..].iter().position(|a| !a.is_finite())?;
        let row = self.pattern.row_offsets.partition_point(|&offset| offset <= k) - 1;
        Some((row, self.pattern.columns[k] as usize))
    }
}

/// ‖v‖₂, summed in a fixed order, scaled so that neither overflow nor underflow spoils it. NaN if
/// an entry is NaN.
pub(crate) fn norm(v: &[f64]) -> f64 {
    norm_on(v, &Alone)
}

/// ‖v‖₂ of a vector that is distributed over the ranks; the same on all of them.
pub(crate) fn norm_on(v: &[f64], ranks: &dyn Ranks) -> f64 {
    let sum_over_ranks = |here: f64| {
        let mut sum = [here];
        ranks.sum(&mut sum);
        sum[0]
    };
    let sum = sum_over_ranks(vectors::square(v));
    if sum.is_normal() && sum > 1e-280 {
        return sum.sqrt();
    }
    let largest = ranks.largest(vectors::largest(v));
    if largest == 0.0 || !largest.is_finite() {
        return largest;
    }
    largest * sum_over_ranks(v.iter().map(|x| (x / largest) * (x / largest)).sum()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> CsrMatrix {
        // [ 2 0 -1 ; 0 3 0 ; 4 5 0 ]
        let pattern = CsrPattern::new(vec![0, 2, 3, 5], vec![0, 2, 1, 0, 1], vec![0, 1, 2], vec![]);
        CsrMatrix { pattern: Arc::new(pattern.unwrap()), values: vec![2.0, -1.0, 3.0, 4.0, 5.0] }
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

    /// By definition, ⟨A x, y⟩ = ⟨x, Aᵀ y⟩, for a matrix whose rows are summed in parts, and the same bits
    /// with one thread and with three.
    #[test]
    fn products_with_the_transpose_in_parts() {
        let n = 3 * ROWS_PER_PART + 5;
        let row = |i: usize| {
            let mut row = vec![i as u32 / 2, i as u32, (i + 40).min(n - 1) as u32, (i * 7919 % n) as u32];
            row.sort_unstable();
            row.dedup();
            row
        };
        let columns: Vec<Vec<u32>> = (0..n).map(row).collect();
        let mut offsets = vec![0];
        columns.iter().for_each(|row| offsets.push(offsets[offsets.len() - 1] + row.len()));
        let pattern = CsrPattern::new(offsets, columns.concat(), vec![0; n], vec![]).unwrap();
        let vector = |n: usize, k: f64| (0..n).map(|i| (k * (i * i) as f64).sin()).collect::<Vec<f64>>();
        let values = vector(pattern.entries(), 0.3);
        let a = CsrMatrix { pattern: Arc::new(pattern), values };
        let (x, y) = (vector(n, 0.7), vector(n, 1.1));
        let (mut ax, mut aty) = (vec![0.0; n], vec![f64::NAN; n]);
        a.mul(&x, &mut ax);
        let products = [1, 3].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| a.mul_transpose(&y, &mut aty));
            aty.clone()
        });
        assert_eq!(products[0], products[1]);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        assert!((dot(&ax, &y) - dot(&x, &aty)).abs() < 1e-13 * norm(&ax) * norm(&y));
    }

    #[test]
    fn inconsistent_patterns_are_refused() {
        let new = |offsets: &[usize], columns: &[u32], groups: &[u32], origins: &[u32]| {
            CsrPattern::new(offsets.to_vec(), columns.to_vec(), groups.to_vec(), origins.to_vec())
        };
        assert!(new(&[0, 2, 3], &[0, 1, 1], &[5, 5], &[]).is_ok());
        assert!(new(&[0], &[], &[], &[]).is_ok());
        for (offsets, columns, groups, origins) in [
            (&[0, 2, 3][..], &[1, 0, 1][..], &[5, 5][..], &[][..]), // columns descend
            (&[0, 2, 3], &[1, 1, 1], &[5, 5], &[]),                 // a column appears twice
            (&[0, 2, 3], &[0, 2, 1], &[5, 5], &[]),                 // a column does not exist
            (&[0, 2, 2], &[0, 1, 1], &[5, 5], &[]),                 // the last entry belongs to no row
            (&[1, 2, 3], &[0, 1, 1], &[5, 5], &[]),                 // the first entry belongs to no row
            (&[0, 9, 3], &[0, 1, 1], &[5, 5], &[]),                 // a row ends beyond the last entry
            (&[0, 3], &[0, 1, 1], &[5, 5], &[]),                    // fewer rows than groups
            (&[0, 2, 3], &[0, 1, 1], &[5, 5], &[0]),                // fewer origins than rows
        ] {
            let n = groups.len();
            assert_eq!(new(offsets, columns, groups, origins), Err(PatternError { n }), "{offsets:?} {columns:?}");
        }
        assert!(new(&[], &[], &[], &[]).is_err());
    }

    /// Clones share an identity; a second pattern with the same content is equal but has a
    /// different one.
    #[test]
    fn patterns_are_told_apart() {
        let (one, other) = (example().pattern, example().pattern);
        assert!((*one).clone().id() == one.id() && one.id() != other.id());
        assert_eq!(one, other);
        let others = CsrPattern::new(vec![0, 2, 3, 5], vec![0, 2, 1, 0, 1], vec![0, 1, 1], vec![]).unwrap();
        assert_ne!(*one, others);
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
