//! Removal of prescribed unknowns.

use crate::block::{BlockMatrix, BlockPattern};
use crate::csr::{CsrMatrix, CsrPattern};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

/// Marks a prescribed unknown in the full-to-reduced map.
const FIXED: u32 = u32::MAX;

/// Map from all unknowns (three per block row) to the free ones, built once per pattern and set of
/// prescribed unknowns.
#[derive(Debug, Clone)]
pub struct Reduction {
    blocks: Arc<BlockPattern>,
    /// Reduced index of each full unknown, or [`FIXED`].
    reduced: Vec<u32>,
    /// Full index of each free unknown, ascending.
    free: Vec<u32>,
    pattern: Arc<CsrPattern>,
    /// Position of the block (j, i) for each block (i, j), computed when first needed.
    mirror: OnceLock<Vec<u32>>,
}

impl Reduction {
    /// Prepares the removal of the unknowns marked in `fixed` (three per block row).
    ///
    /// `groups` contains an elimination group for each block row; the block row of a multiplier has
    /// the group of its slave node, which comes first in the group. If all displacements of that
    /// node are prescribed, the multiplier would remain alone with its zero diagonal; it then joins
    /// the group of a free node that it is coupled to.
    ///
    /// # Panics
    /// If a length does not match the pattern.
    pub fn new(pattern: &Arc<BlockPattern>, fixed: &[bool], groups: &[u32]) -> Self {
        let reduced = numbered(fixed);
        Self::of_part(pattern, fixed, &attach_lone_multipliers(pattern, &reduced, groups))
    }

    /// The same for one rank's part of a matrix: `groups` are not changed, since ranks have
    /// different couplings but must agree on the groups.
    ///
    /// # Panics
    /// If a length does not match the pattern.
    pub fn of_part(pattern: &Arc<BlockPattern>, fixed: &[bool], groups: &[u32]) -> Self {
        let rows = pattern.rows();
        assert!(
            fixed.len() == 3 * rows && groups.len() == rows,
            "{rows} block rows need {} fixed flags and {rows} groups, but got {} and {}",
            3 * rows,
            fixed.len(),
            groups.len()
        );
        assert!(3 * rows < FIXED as usize, "{rows} block rows exceed the index range");
        let free: Vec<u32> = (0..3 * rows as u32).filter(|&i| !fixed[i as usize]).collect();
        let reduced = numbered(fixed);
        let csr = Arc::new(reduced_pattern(pattern, &reduced, &free, groups));
        Self { blocks: Arc::clone(pattern), reduced, free, pattern: csr, mirror: OnceLock::new() }
    }

    /// Number of free unknowns.
    pub fn free(&self) -> usize {
        self.free.len()
    }

    /// Pattern of the reduced matrices.
    pub fn pattern(&self) -> &Arc<CsrPattern> {
        &self.pattern
    }

    /// Block row and component (0, 1, 2) of a reduced unknown, for messages.
    pub fn origin(&self, unknown: usize) -> (usize, usize) {
        let full = self.free[unknown] as usize;
        (full / 3, full % 3)
    }

    /// Rows and columns of the free unknowns of `a`.
    ///
    /// # Panics
    /// If `a` has a different pattern from this reduction.
    pub fn reduce(&self, a: &BlockMatrix) -> CsrMatrix {
        self.gather(a, |position, component, b| a.values()[position][3 * component + b])
    }

    /// The transpose of [`Reduction::reduce`], on the same pattern.
    ///
    /// # Panics
    /// If `a` has a different pattern from this reduction, or one that is not symmetric.
    pub fn reduce_transposed(&self, a: &BlockMatrix) -> CsrMatrix {
        let mirror = self.mirror.get_or_init(|| mirrored(&self.blocks));
        self.gather(a, |position, component, b| a.values()[mirror[position] as usize][3 * b + component])
    }

    /// Rows of the free unknowns; `entry` returns an entry from the position of its block, its
    /// component there and its column's.
    fn gather(&self, a: &BlockMatrix, entry: impl Fn(usize, usize, usize) -> f64 + Sync) -> CsrMatrix {
        assert!(
            **a.pattern() == *self.blocks,
            "the reduction was built for a different sparsity pattern from the matrix's"
        );
        let mut values = vec![0.0; self.pattern.entries()];
        let mut rest = values.as_mut_slice();
        let mut rows = Vec::with_capacity(self.free.len());
        for window in self.pattern.row_offsets().windows(2) {
            let (row, tail) = rest.split_at_mut(window[1] - window[0]);
            rows.push(row);
            rest = tail;
        }
        rows.into_par_iter().with_min_len(512).enumerate().for_each(|(k, row)| {
            let (i, component) = self.origin(k);
            let mut entries = row.iter_mut();
            for (position, &column) in self.blocks.row_range(i).zip(self.blocks.row(i)) {
                for b in 0..3 {
                    if self.reduced[3 * column as usize + b] != FIXED
                        && let Some(target) = entries.next()
                    {
                        *target = entry(position, component, b);
                    }
                }
            }
        });
        CsrMatrix { pattern: Arc::clone(&self.pattern), values }
    }

    /// Free entries of a full vector.
    ///
    /// # Panics
    /// If the length is not three per block row.
    pub fn restrict(&self, full: &[f64]) -> Vec<f64> {
        assert_eq!(full.len(), self.reduced.len(), "a full vector has three entries per block row");
        self.free.iter().map(|&i| full[i as usize]).collect()
    }

    /// Writes the free entries into a full vector; prescribed entries are left unchanged.
    ///
    /// # Panics
    /// If a length does not match.
    pub fn prolong(&self, reduced: &[f64], full: &mut [f64]) {
        assert_eq!(reduced.len(), self.free.len(), "a reduced vector has one entry per free unknown");
        assert_eq!(full.len(), self.reduced.len(), "a full vector has three entries per block row");
        for (&i, value) in self.free.iter().zip(reduced) {
            full[i as usize] = *value;
        }
    }
}

/// Numbers of the free unknowns.
fn numbered(fixed: &[bool]) -> Vec<u32> {
    let mut next = 0;
    let number = |&fixed: &bool| {
        if fixed {
            return FIXED;
        }
        next += 1;
        next - 1
    };
    fixed.iter().map(number).collect()
}

/// Position of the block (j, i) for each block (i, j).
fn mirrored(pattern: &BlockPattern) -> Vec<u32> {
    let mirror = |i: usize, j: u32| pattern.find(j as usize, i).expect("the pattern is symmetric") as u32;
    (0..pattern.rows()).flat_map(|i| pattern.row(i).iter().map(move |&j| mirror(i, j))).collect()
}

/// Number of free components of block row `i`.
fn free_components(reduced: &[u32], i: usize) -> usize {
    reduced[3 * i..3 * i + 3].iter().filter(|&&k| k != FIXED).count()
}

/// Moves each block row whose group leader (first row of the group) is entirely prescribed to the
/// group of the coupled leader with the most free components, in case of a tie the lowest-numbered
/// one.
fn attach_lone_multipliers(pattern: &BlockPattern, reduced: &[u32], groups: &[u32]) -> Vec<u32> {
    let mut leaders: HashMap<u32, usize> = HashMap::new();
    for (i, &group) in groups.iter().enumerate() {
        leaders.entry(group).or_insert(i);
    }
    let mut attached = groups.to_vec();
    for i in 0..pattern.rows() {
        let leader = leaders[&groups[i]];
        if leader == i || free_components(reduced, i) == 0 || free_components(reduced, leader) > 0 {
            continue;
        }
        let host = pattern
            .row(i)
            .iter()
            .map(|&j| j as usize)
            .filter(|&j| leaders[&groups[j]] == j && free_components(reduced, j) > 0)
            .max_by_key(|&j| (free_components(reduced, j), std::cmp::Reverse(j)));
        if let Some(host) = host {
            attached[i] = groups[host];
        }
    }
    attached
}

fn reduced_pattern(pattern: &BlockPattern, reduced: &[u32], free: &[u32], groups: &[u32]) -> CsrPattern {
    let mut row_offsets = Vec::with_capacity(free.len() + 1);
    let mut columns = Vec::with_capacity(9 * pattern.blocks());
    row_offsets.push(0);
    for &full in free {
        for &j in pattern.row(full as usize / 3) {
            let components = &reduced[3 * j as usize..3 * j as usize + 3];
            columns.extend(components.iter().filter(|&&k| k != FIXED));
        }
        row_offsets.push(columns.len());
    }
    columns.shrink_to_fit();
    let groups = free.iter().map(|&full| groups[full as usize / 3]).collect();
    CsrPattern::new(row_offsets, columns, groups, free.to_vec())
        .expect("columns of a block row ascend below the number of rows, and free unknowns are numbered in their order")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> BlockMatrix {
        let pattern = BlockPattern::from_rows(&[vec![0, 2], vec![1, 2], vec![0, 1, 2]]);
        let mut a = BlockMatrix::new(Arc::new(pattern));
        for (k, block) in a.values_mut().iter_mut().enumerate() {
            *block = std::array::from_fn(|l| ((k * 9 + l) as f64 * 0.37).sin());
        }
        a
    }

    /// The reduced product equals the full product with zeros at the prescribed unknowns.
    #[test]
    fn reduced_rows_and_columns_are_those_of_the_free_unknowns() {
        let a = example();
        let fixed = [false, true, false, true, true, true, false, false, true];
        let reduction = Reduction::new(a.pattern(), &fixed, &[0, 1, 2]);
        assert_eq!(reduction.free(), 4);
        assert_eq!(reduction.origin(2), (2, 0));
        let reduced = reduction.reduce(&a);
        let x = [0.3, -1.0, 0.5, 2.0];
        let (mut full, mut product, mut y) = ([0.0; 9], [0.0; 9], [0.0; 4]);
        reduction.prolong(&x, &mut full);
        a.mul(&full, &mut product);
        reduced.mul(&x, &mut y);
        for (y, expected) in y.iter().zip(reduction.restrict(&product)) {
            assert!((y - expected).abs() < 1e-15);
        }
    }

    /// Compared with the product with the transpose of the reduced matrix.
    #[test]
    fn the_transposed_reduction_is_the_transpose_of_the_reduced() {
        let a = example();
        let fixed = [false, true, false, true, true, true, false, false, true];
        let reduction = Reduction::new(a.pattern(), &fixed, &[0, 1, 2]);
        let x = [0.3, -1.0, 0.5, 2.0];
        let (mut y, mut expected) = ([0.0; 4], [0.0; 4]);
        reduction.reduce_transposed(&a).mul(&x, &mut y);
        reduction.reduce(&a).mul_transpose(&x, &mut expected);
        for (y, expected) in y.iter().zip(expected) {
            assert!((y - expected).abs() < 1e-15);
        }
    }

    #[test]
    fn prescribed_entries_stay_untouched() {
        let a = example();
        let mut fixed = [false; 9];
        fixed[4] = true;
        let reduction = Reduction::new(a.pattern(), &fixed, &[0, 1, 2]);
        let mut full = [7.0; 9];
        reduction.prolong(&[1.0; 8], &mut full);
        assert_eq!(full, [1.0, 1.0, 1.0, 1.0, 7.0, 1.0, 1.0, 1.0, 1.0]);
    }

    /// Block row 2 is a multiplier of node 1; with node 1 prescribed it joins node 0.
    #[test]
    fn a_multiplier_of_a_prescribed_node_joins_a_free_neighbour() {
        let a = example();
        let mut fixed = [false; 9];
        fixed[3..6].fill(true);
        let reduction = Reduction::new(a.pattern(), &fixed, &[0, 1, 1]);
        assert_eq!(reduction.pattern().groups(), vec![0; 6]);
        let free_node = Reduction::new(a.pattern(), &[false; 9], &[0, 1, 1]);
        assert_eq!(free_node.pattern().groups(), vec![0, 0, 0, 1, 1, 1, 1, 1, 1]);
        // ranks with different couplings would not agree
        let part = Reduction::of_part(a.pattern(), &fixed, &[0, 1, 1]);
        assert_eq!(part.pattern().groups(), vec![0, 0, 0, 1, 1, 1]);
    }
}
