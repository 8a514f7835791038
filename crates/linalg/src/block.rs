//! Matrices of 3×3 blocks on a node-to-node sparsity pattern.

use crate::identity::PatternId;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// Rows below which a product is not worth splitting among threads.
const ROWS_PER_TASK: usize = 512;

/// Sparsity of a square matrix of 3×3 blocks.
///
/// A block row per mesh node, followed by a block row per contact-multiplier node. Columns ascend
/// within each row. It is immutable.
#[derive(Debug, Clone)]
pub struct BlockPattern {
    id: PatternId,
    row_offsets: Vec<usize>,
    columns: Vec<u32>,
}

impl BlockPattern {
    /// Builds the pattern from the block columns of each block row, in any order and with
    /// repetitions.
    ///
    /// # Panics
    /// If a column is not smaller than the number of rows: the pattern is square.
    pub fn from_rows(rows: &[Vec<u32>]) -> Self {
        let sorted: Vec<Vec<u32>> = rows
            .par_iter()
            .map(|row| {
                let mut row = row.clone();
                row.sort_unstable();
                row.dedup();
                row
            })
            .collect();
        let mut row_offsets = Vec::with_capacity(rows.len() + 1);
        let mut columns = Vec::with_capacity(sorted.iter().map(Vec::len).sum());
        row_offsets.push(0);
        for (i, row) in sorted.iter().enumerate() {
            if let Some(&last) = row.last() {
                assert!(
                    (last as usize) < rows.len(),
                    "block row {i} has column {last}, but the pattern has only {} block rows",
                    rows.len()
                );
            }
            columns.extend_from_slice(row);
            row_offsets.push(columns.len());
        }
        Self { id: PatternId::mint(), row_offsets, columns }
    }

    /// Identity, shared only by clones.
    pub fn id(&self) -> PatternId {
        self.id
    }

    /// Number of block rows, which is the number of block columns.
    pub fn rows(&self) -> usize {
        self.row_offsets.len() - 1
    }

    /// Block columns of block row `i`, ascending.
    pub fn row(&self, i: usize) -> &[u32] {
        &self.columns[self.row_range(i)]
    }

    /// Positions of the blocks of block row `i` in [`BlockMatrix::values`].
    pub fn row_range(&self, i: usize) -> Range<usize> {
        self.row_offsets[i]..self.row_offsets[i + 1]
    }

    /// Position of block (`row`, `col`), or `None` outside the pattern.
    pub fn find(&self, row: usize, col: usize) -> Option<usize> {
        let column = u32::try_from(col).ok()?;
        let at = self.row(row).binary_search(&column).ok()?;
        Some(self.row_offsets[row] + at)
    }

    /// Number of stored blocks.
    pub fn blocks(&self) -> usize {
        self.columns.len()
    }
}

impl PartialEq for BlockPattern {
    /// Whether the content is equal. Only patterns with different identities are compared entry by
    /// entry.
    fn eq(&self, other: &Self) -> bool {
        self.id == other.id || (&self.row_offsets, &self.columns) == (&other.row_offsets, &other.columns)
    }
}

impl Eq for BlockPattern {}

/// A square sparse matrix of 3×3 blocks, each stored row by row.
#[derive(Debug, Clone)]
pub struct BlockMatrix {
    pattern: Arc<BlockPattern>,
    values: Vec<[f64; 9]>,
}

impl BlockMatrix {
    /// The zero matrix on `pattern`.
    pub fn new(pattern: Arc<BlockPattern>) -> Self {
        let values = vec![[0.0; 9]; pattern.blocks()];
        Self { pattern, values }
    }

    /// The sparsity pattern.
    pub fn pattern(&self) -> &Arc<BlockPattern> {
        &self.pattern
    }

    /// Sets every entry to zero, keeping the pattern.
    pub fn set_zero(&mut self) {
        self.values.fill([0.0; 9]);
    }

    /// Adds a 3×3 block, row by row, at block row `row` and block column `col`.
    ///
    /// # Panics
    /// If the block lies outside the pattern: the pattern was built for other couplings.
    pub fn add(&mut self, row: usize, col: usize, block: &[f64; 9]) {
        match self.pattern.find(row, col) {
            Some(position) => self.add_at(position, block),
            None => panic!(
                "block ({row}, {col}) is outside the sparsity pattern of {} block rows; \
                 list column {col} in row {row} when building the pattern",
                self.pattern.rows()
            ),
        }
    }

    /// Adds a 3×3 block at a position obtained from [`BlockPattern::find`] or
    /// [`BlockPattern::row_range`].
    pub fn add_at(&mut self, position: usize, block: &[f64; 9]) {
        for (entry, term) in self.values[position].iter_mut().zip(block) {
            *entry += term;
        }
    }

    /// The blocks, in the order of the pattern.
    pub fn values(&self) -> &[[f64; 9]] {
        &self.values
    }

    /// The blocks, in the order of the pattern, for assembly by rows in parallel.
    pub fn values_mut(&mut self) -> &mut [[f64; 9]] {
        &mut self.values
    }

    /// `y = A x`; both have three entries per block row. Parallel over rows, with the same result
    /// for any number of threads.
    ///
    /// # Panics
    /// If a length differs from three times the block rows.
    pub fn mul(&self, x: &[f64], y: &mut [f64]) {
        self.check_lengths(x, y);
        y.par_chunks_exact_mut(3).with_min_len(ROWS_PER_TASK).enumerate().for_each(|(i, y)| {
            let mut sum = [0.0; 3];
            for k in self.pattern.row_range(i) {
                let b = &self.values[k];
                let x = &x[3 * self.pattern.columns[k] as usize..][..3];
                for a in 0..3 {
                    sum[a] += b[3 * a] * x[0] + b[3 * a + 1] * x[1] + b[3 * a + 2] * x[2];
                }
            }
            y.copy_from_slice(&sum);
        });
    }

    /// `y = Aᵀ x`; both have three entries per block row. Sequential, since rows scatter into
    /// common entries.
    ///
    /// # Panics
    /// If a length differs from three times the block rows.
    pub fn mul_transpose(&self, x: &[f64], y: &mut [f64]) {
        self.check_lengths(x, y);
        y.fill(0.0);
        for (i, x) in x.chunks_exact(3).enumerate() {
            for k in self.pattern.row_range(i) {
                let b = &self.values[k];
                let y = &mut y[3 * self.pattern.columns[k] as usize..][..3];
                for a in 0..3 {
                    y[a] += b[a] * x[0] + b[3 + a] * x[1] + b[6 + a] * x[2];
                }
            }
        }
    }

    fn check_lengths(&self, x: &[f64], y: &[f64]) {
        let n = 3 * self.pattern.rows();
        assert!(
            x.len() == n && y.len() == n,
            "the matrix has {n} rows, but the vectors have {} and {} entries",
            x.len(),
            y.len()
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> BlockMatrix {
        let pattern = BlockPattern::from_rows(&[vec![2, 0, 2], vec![1], vec![0, 1, 2]]);
        let mut a = BlockMatrix::new(Arc::new(pattern));
        for (k, block) in a.values_mut().iter_mut().enumerate() {
            *block = std::array::from_fn(|l| (1 + k * 9 + l) as f64);
        }
        a
    }

    #[test]
    fn rows_are_sorted_and_unique() {
        let a = example();
        assert_eq!(a.pattern().row(0), &[0, 2]);
        assert_eq!(a.pattern().blocks(), 6);
        assert_eq!(a.pattern().find(2, 1), Some(4));
        assert_eq!(a.pattern().find(1, 0), None);
    }

    /// ⟨w, A v⟩ = ⟨Aᵀ w, v⟩ and a row worked out by hand.
    #[test]
    fn products_agree_with_their_definition() {
        let a = example();
        let v: Vec<f64> = (0..9).map(|i| (i as f64 * 0.7).sin()).collect();
        let w: Vec<f64> = (0..9).map(|i| (i as f64 * 1.3).cos()).collect();
        let (mut av, mut atw) = (vec![0.0; 9], vec![0.0; 9]);
        a.mul(&v, &mut av);
        a.mul_transpose(&w, &mut atw);
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        assert!((dot(&w, &av) - dot(&atw, &v)).abs() < 1e-12 * dot(&w, &av).abs());
        // Block (1, 1) is the third block: its entries are 19..=27.
        let expected = 19.0 * v[3] + 20.0 * v[4] + 21.0 * v[5];
        assert!((av[3] - expected).abs() < 1e-13);
    }

    /// Clones share an identity; a second pattern with the same content is equal but has a
    /// different one.
    #[test]
    fn patterns_are_told_apart() {
        let (one, other) = (BlockPattern::from_rows(&[vec![0], vec![1]]), BlockPattern::from_rows(&[vec![0], vec![1]]));
        assert!(one.clone().id() == one.id() && one.id() != other.id());
        assert_eq!(one, other);
        assert_ne!(one, BlockPattern::from_rows(&[vec![0, 1], vec![1]]));
    }

    #[test]
    #[should_panic(expected = "outside the sparsity pattern")]
    fn adding_outside_of_the_pattern_is_refused() {
        example().add(1, 0, &[0.0; 9]);
    }
}
