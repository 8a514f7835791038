//! Dense kernels of the fronts.
//!
//! Large operands are divided into tiles whose bounds depend only on their size. Threads share the
//! tiles, and one thread computes each tile, so the result does not depend on the number of threads.

mod product;
mod registers;
mod triangular;
mod view;

use super::scalar::Scalar;
use product::{Part, subtract};
use rayon::prelude::*;
pub(super) use registers::Register;
pub(super) use view::{View, ViewMut};

/// Rows or columns of a tile.
const TILE: usize = 256;

/// Number of operations from which tiling pays off.
const WORTH_TILING: usize = 8_000_000;

/// Entries that a thread scans at a time.
const SCAN: usize = 1 << 16;

/// Number of pivots up to which one thread factorizes a diagonal block.
const ONE_PANEL: usize = 256;

/// Columns of a panel in larger blocks.
const PANEL: usize = 128;

/// LU with partial pivoting of a square matrix, in place. Row i of the permuted matrix is row
/// `permutation[i]` of the given one.
pub(super) fn lu<T: Scalar>(mut a: ViewMut<'_, T>, permutation: &mut [u32]) {
    let n = a.rows();
    for (i, p) in permutation.iter_mut().enumerate() {
        *p = i as u32;
    }
    if n <= ONE_PANEL {
        panel_lu(a, permutation);
        return;
    }
    for k in (0..n).step_by(PANEL) {
        let w = PANEL.min(n - k);
        let (left, rest) = a.borrow().split_columns(k);
        let (panel, right) = rest.split_columns(w);
        let (mut panel, right) = (panel.split_rows(k).1, right.split_rows(k).1);
        let mut order: Vec<u32> = (0..(n - k) as u32).collect();
        panel_lu(panel.borrow(), &mut order);
        permute_rows(left.split_rows(k).1, &order);
        let (mut upper, lower) = {
            let mut right = right;
            permute_rows(right.borrow(), &order);
            right.split_rows(w)
        };
        let old: Vec<u32> = permutation[k..].to_vec();
        for (p, &source) in permutation[k..].iter_mut().zip(&order) {
            *p = old[source as usize];
        }
        let panel = panel.read();
        solve_unit_lower(panel.row_range(0, w), upper.borrow());
        subtract_product(lower, panel.row_range(w, n - k - w), upper.read());
    }
}

/// Permutes `order` as the rows.
fn panel_lu<T: Scalar>(a: ViewMut<'_, T>, order: &mut [u32]) {
    let mut swaps = vec![0u32; a.columns()];
    triangular::lu(a, &mut swaps);
    for (k, &row) in swaps.iter().enumerate() {
        order.swap(k, row as usize);
    }
}

/// A = L Lᵀ: replaces the lower triangle of A by L; entries above become undefined. `false` if A is
/// not positive definite.
pub(super) fn cholesky<T: Scalar>(mut a: ViewMut<'_, T>) -> bool {
    let n = a.rows();
    let panel = if n <= ONE_PANEL { n.max(1) } else { PANEL };
    for k in (0..n).step_by(panel) {
        let w = panel.min(n - k);
        let (columns, trailing) = a.borrow().split_columns(k).1.split_columns(w);
        let (mut diagonal, mut below) = columns.split_rows(k).1.split_rows(w);
        if !triangular::cholesky(diagonal.borrow()) {
            return false;
        }
        solve_upper_right(diagonal.read().transpose(), below.borrow());
        subtract_symmetric_product(trailing.split_rows(k + w).1, below.read());
    }
    true
}

/// C ← C − A Aᵀ, on and below the diagonal; entries above become undefined.
pub(super) fn subtract_symmetric_product<T: Scalar>(c: ViewMut<'_, T>, a: View<'_, T>) {
    let (n, k) = (c.rows(), a.columns());
    if n * n * k < WORTH_TILING {
        subtract(c, a, a.transpose(), Part::Lower);
        return;
    }
    c.column_blocks(TILE).into_par_iter().enumerate().for_each(|(tile, c)| {
        let (start, width) = (tile * TILE, c.columns());
        let (diagonal, below) = c.split_rows(start).1.split_rows(width);
        let rows = a.row_range(start, width).transpose();
        subtract(diagonal, a.row_range(start, width), rows, Part::Lower);
        subtract(below, a.row_range(start + width, n - start - width), rows, Part::Whole);
    });
}

/// Copies the lower triangle of a square matrix of `n` rows to the upper one.
pub(super) fn mirror<T: Scalar>(a: &mut [T], n: usize) {
    /// Rows and columns that fit into the cache together.
    const BLOCK: usize = 32;
    for first_column in (0..n).step_by(BLOCK) {
        for first_row in (first_column..n).step_by(BLOCK) {
            for j in first_column..(first_column + BLOCK).min(n) {
                for i in first_row.max(j + 1)..(first_row + BLOCK).min(n) {
                    a[j + i * n] = a[i + j * n];
                }
            }
        }
    }
}

/// Row i is replaced by the previous row `order[i]`.
pub(super) fn permute_rows<T: Scalar>(a: ViewMut<'_, T>, order: &[u32]) {
    let moved: Vec<(usize, usize)> = order
        .iter()
        .enumerate()
        .filter(|&(i, &source)| i != source as usize)
        .map(|(i, &source)| (i, source as usize))
        .collect();
    if moved.is_empty() || a.columns() == 0 {
        return;
    }
    a.column_blocks(TILE).into_par_iter().for_each(|mut tile| {
        let mut values = vec![T::ZERO; moved.len()];
        for j in 0..tile.columns() {
            let column = tile.column(j);
            for (value, &(_, source)) in values.iter_mut().zip(&moved) {
                *value = column[source];
            }
            for (value, &(target, _)) in values.iter().zip(&moved) {
                column[target] = *value;
            }
        }
    });
}

/// B ← L⁻¹ B with the unit lower triangle of `l`.
pub(super) fn solve_unit_lower<T: Scalar>(l: View<'_, T>, b: ViewMut<'_, T>) {
    if l.rows() * l.rows() * b.columns() < WORTH_TILING {
        triangular::solve_unit_lower(l, b);
    } else {
        b.column_blocks(TILE).into_par_iter().for_each(|tile| triangular::solve_unit_lower(l, tile));
    }
}

/// B ← B U⁻¹ with the upper triangle of `u`.
pub(super) fn solve_upper_right<T: Scalar>(u: View<'_, T>, b: ViewMut<'_, T>) {
    if u.rows() * u.rows() * b.rows() < WORTH_TILING {
        triangular::solve_upper_right(u, b);
    } else {
        b.row_blocks(TILE).into_par_iter().for_each(|tile| triangular::solve_upper_right(u, tile));
    }
}

/// C ← C − A B.
pub(super) fn subtract_product<T: Scalar>(c: ViewMut<'_, T>, a: View<'_, T>, b: View<'_, T>) {
    if 2 * c.rows() * c.columns() * a.columns() < WORTH_TILING {
        subtract(c, a, b, Part::Whole);
    } else {
        c.column_blocks(TILE).into_par_iter().enumerate().for_each(|(tile, c)| {
            let columns = c.columns();
            subtract(c, a, b.block(0, tile * TILE, b.rows(), columns), Part::Whole);
        });
    }
}

/// Largest absolute entry; infinite if an entry is NaN.
pub(super) fn largest<T: Scalar>(values: &[T]) -> f64 {
    let sequential = |values: &[T]| {
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || largest_by_lanes(values),
        )
    };
    if values.len() <= SCAN {
        sequential(values)
    } else {
        values.par_chunks(SCAN).map(sequential).reduce(|| 0.0, f64::max)
    }
}

/// Independent lanes, which the compiler turns into vector instructions.
#[inline(always)]
fn largest_by_lanes<T: Scalar>(values: &[T]) -> f64 {
    const LANES: usize = 32;
    let mut lanes = [T::ZERO; LANES];
    // x·0 is NaN if x is NaN or infinite, and remains NaN in a sum.
    let mut poison = [T::ZERO; LANES];
    let (chunks, rest) = values.as_chunks::<LANES>();
    for chunk in chunks {
        for l in 0..LANES {
            let x = chunk[l].absolute();
            lanes[l] = if x > lanes[l] { x } else { lanes[l] };
            poison[l] += chunk[l] * T::ZERO;
        }
    }
    for (l, value) in rest.iter().enumerate() {
        let x = value.absolute();
        lanes[l] = if x > lanes[l] { x } else { lanes[l] };
        poison[l] += *value * T::ZERO;
    }
    if poison.iter().any(|p| p.to_f64().is_nan()) {
        return f64::INFINITY;
    }
    lanes.iter().fold(0.0, |m, x| m.max(x.to_f64()))
}

#[cfg(test)]
mod tests;
