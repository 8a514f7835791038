//! Dense kernels of the fronts.
//!
//! Large operands are divided into tiles whose bounds depend only on their size. Threads share the
//! tiles, and a sequential faer kernel computes each tile, so the result does not depend on the
//! number of threads.

use super::scalar::Scalar;
use dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::lu::partial_pivoting::factor::{lu_in_place, lu_in_place_scratch};
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_unit_lower_triangular_in_place};
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;

/// Rows or columns of a tile.
const TILE: usize = 256;

/// Number of operations from which tiling pays off.
const WORTH_TILING: usize = 8_000_000;

/// Entries that a thread scans at a time.
const SCAN: usize = 1 << 16;

/// Number of pivots up to which one faer call factorizes a diagonal block.
const ONE_PANEL: usize = 256;

/// Columns of a panel in larger blocks.
const PANEL: usize = 128;

/// LU with partial pivoting of a square matrix, in place. Row i of the permuted matrix is row
/// `permutation[i]` of the given one.
pub(super) fn lu<T: Scalar>(mut a: MatMut<'_, T>, permutation: &mut [u32]) {
    let n = a.nrows();
    for (i, p) in permutation.iter_mut().enumerate() {
        *p = i as u32;
    }
    if n <= ONE_PANEL {
        panel_lu(a, permutation);
        return;
    }
    for k in (0..n).step_by(PANEL) {
        let w = PANEL.min(n - k);
        let mut order = vec![0u32; n - k];
        panel_lu(a.rb_mut().submatrix_mut(k, k, n - k, w), &mut order);
        let (mut left, rest) = a.rb_mut().split_at_col_mut(k);
        permute_rows(left.rb_mut().subrows_mut(k, n - k), &order);
        let (panel, mut right) = rest.split_at_col_mut(w);
        permute_rows(right.rb_mut().subrows_mut(k, n - k), &order);
        let old: Vec<u32> = permutation[k..].to_vec();
        for (p, &source) in permutation[k..].iter_mut().zip(&order) {
            *p = old[source as usize];
        }
        let panel = panel.rb().subrows(k, n - k);
        let (mut upper, lower) = right.subrows_mut(k, n - k).split_at_row_mut(w);
        solve_unit_lower(panel.subrows(0, w), upper.rb_mut());
        subtract_product(lower, panel.subrows(w, n - k - w), upper.rb());
    }
}

fn panel_lu<T: Scalar>(a: MatMut<'_, T>, order: &mut [u32]) {
    let (rows, columns) = (a.nrows(), a.ncols());
    let mut inverse = vec![0u32; rows];
    let scratch = lu_in_place_scratch::<u32, T>(rows, columns, Par::Seq, Default::default());
    let mut memory = MemBuffer::new(scratch);
    let stack = MemStack::new(&mut memory);
    lu_in_place(a, order, &mut inverse, Par::Seq, stack, Default::default());
}

/// A = L Lᵀ: replaces the lower triangle of A by L and leaves the other entries. `false` if A is not
/// positive definite.
pub(super) fn cholesky<T: Scalar>(mut a: MatMut<'_, T>) -> bool {
    let n = a.nrows();
    let panel = if n <= ONE_PANEL { n.max(1) } else { PANEL };
    for k in (0..n).step_by(panel) {
        let w = panel.min(n - k);
        let (_, _, _, rest) = a.rb_mut().split_at_mut(k, k);
        let (mut diagonal, _, mut below, trailing) = rest.split_at_mut(w, w);
        let mut memory = MemBuffer::new(cholesky_in_place_scratch::<T>(w, Par::Seq, Default::default()));
        let stack = MemStack::new(&mut memory);
        let result = cholesky_in_place(diagonal.rb_mut(), Default::default(), Par::Seq, stack, Default::default());
        if result.is_err() {
            return false;
        }
        solve_upper_right(diagonal.rb().transpose(), below.rb_mut());
        subtract_symmetric_product(trailing, below.rb());
    }
    true
}

/// C ← C − A Aᵀ, on and below the diagonal.
pub(super) fn subtract_symmetric_product<T: Scalar>(c: MatMut<'_, T>, a: MatRef<'_, T>) {
    let (n, k) = (c.nrows(), a.ncols());
    if n == 0 || k == 0 {
        return;
    }
    let triangle = |c: MatMut<'_, T>, a: MatRef<'_, T>| {
        let (whole, half) = (BlockStructure::Rectangular, BlockStructure::TriangularLower);
        triangular::matmul(c, half, Accum::Add, a, whole, a.transpose(), whole, -T::ONE, Par::Seq);
    };
    if n * n * k < WORTH_TILING {
        triangle(c, a);
        return;
    }
    c.par_col_chunks_mut(TILE).enumerate().for_each(|(tile, c)| {
        let (start, width) = (tile * TILE, c.ncols());
        let (_, c) = c.split_at_row_mut(start);
        let (diagonal, below) = c.split_at_row_mut(width);
        let rows = a.subrows(start, width);
        triangle(diagonal, rows);
        if below.nrows() > 0 {
            matmul(below, Accum::Add, a.subrows(start + width, n - start - width), rows.transpose(), -T::ONE, Par::Seq);
        }
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
pub(super) fn permute_rows<T: Scalar>(a: MatMut<'_, T>, order: &[u32]) {
    let moved: Vec<(usize, usize)> = order
        .iter()
        .enumerate()
        .filter(|&(i, &source)| i != source as usize)
        .map(|(i, &source)| (i, source as usize))
        .collect();
    if moved.is_empty() || a.ncols() == 0 {
        return;
    }
    a.par_col_chunks_mut(TILE).for_each(|mut tile| {
        let mut values = vec![T::ZERO; moved.len()];
        for j in 0..tile.ncols() {
            for (value, &(_, source)) in values.iter_mut().zip(&moved) {
                *value = tile[(source, j)];
            }
            for (value, &(target, _)) in values.iter().zip(&moved) {
                tile[(target, j)] = *value;
            }
        }
    });
}

/// B ← L⁻¹ B with the unit lower triangle of `l`.
pub(super) fn solve_unit_lower<T: Scalar>(l: MatRef<'_, T>, b: MatMut<'_, T>) {
    if b.ncols() == 0 || b.nrows() == 0 {
        return;
    }
    if l.nrows() * l.nrows() * b.ncols() < WORTH_TILING {
        solve_unit_lower_triangular_in_place(l, b, Par::Seq);
    } else {
        b.par_col_chunks_mut(TILE).for_each(|tile| solve_unit_lower_triangular_in_place(l, tile, Par::Seq));
    }
}

/// B ← B U⁻¹ with the upper triangle of `u`.
pub(super) fn solve_upper_right<T: Scalar>(u: MatRef<'_, T>, b: MatMut<'_, T>) {
    if b.ncols() == 0 || b.nrows() == 0 {
        return;
    }
    let transposed = u.transpose();
    if u.nrows() * u.nrows() * b.nrows() < WORTH_TILING {
        solve_lower_triangular_in_place(transposed, b.transpose_mut(), Par::Seq);
    } else {
        b.par_row_chunks_mut(TILE).for_each(|tile| {
            solve_lower_triangular_in_place(transposed, tile.transpose_mut(), Par::Seq);
        });
    }
}

/// C ← C − A B.
pub(super) fn subtract_product<T: Scalar>(c: MatMut<'_, T>, a: MatRef<'_, T>, b: MatRef<'_, T>) {
    if c.nrows() == 0 || c.ncols() == 0 || a.ncols() == 0 {
        return;
    }
    let multiply = |c: MatMut<'_, T>, b: MatRef<'_, T>| {
        matmul(c, Accum::Add, a, b, -T::ONE, Par::Seq);
    };
    if 2 * c.nrows() * c.ncols() * a.ncols() < WORTH_TILING {
        multiply(c, b);
    } else {
        c.par_col_chunks_mut(TILE).zip(b.par_col_chunks(TILE)).for_each(|(c, b)| multiply(c, b));
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
mod tests {
    use super::*;
    use faer::Mat;

    fn pseudo_random(m: usize, n: usize) -> Mat<f64> {
        Mat::from_fn(m, n, |i, j| ((i * 7919 + j * 104_729 + i * j) as f64 * 0.618).sin())
    }

    /// P A = L U for a size beyond one panel, entry by entry.
    #[test]
    fn panelled_factorization_restores_the_matrix() {
        let n = 2 * ONE_PANEL + 37;
        let a = pseudo_random(n, n);
        let mut factors = a.clone();
        let mut order = vec![0u32; n];
        lu(factors.as_mut(), &mut order);
        let lower = Mat::from_fn(n, n, |i, j| match i.cmp(&j) {
            std::cmp::Ordering::Greater => factors[(i, j)],
            std::cmp::Ordering::Equal => 1.0,
            std::cmp::Ordering::Less => 0.0,
        });
        let upper = Mat::from_fn(n, n, |i, j| if i <= j { factors[(i, j)] } else { 0.0 });
        let product = &lower * &upper;
        let mut error = 0.0f64;
        for i in 0..n {
            for j in 0..n {
                error = error.max((product[(i, j)] - a[(order[i] as usize, j)]).abs());
            }
        }
        assert!(error < 1e-11, "largest difference {error:e}");
    }

    /// Tiled kernels against faer's own product.
    #[test]
    fn tiled_solves_and_products_agree_with_their_definition() {
        let (n, m) = (150, 700);
        let triangle =
            Mat::from_fn(n, n, |i, j| if i == j { 2.0 } else { ((i * 31 + j * 17) as f64).sin() / n as f64 });
        let b = pseudo_random(m, n);
        let mut x = b.clone();
        solve_upper_right(triangle.as_ref(), x.as_mut());
        let upper = Mat::from_fn(n, n, |i, j| if i <= j { triangle[(i, j)] } else { 0.0 });
        subtract_product(x.as_mut().get_mut(.., ..0), b.as_ref(), upper.as_ref().get(.., ..0));
        let mut rest = b.clone();
        subtract_product(rest.as_mut(), x.as_ref(), upper.as_ref());
        assert!(rest.norm_max() < 1e-13);
        let c = pseudo_random(n, m);
        let mut y = c.clone();
        solve_unit_lower(triangle.as_ref(), y.as_mut());
        let lower = Mat::from_fn(n, n, |i, j| match i.cmp(&j) {
            std::cmp::Ordering::Greater => triangle[(i, j)],
            std::cmp::Ordering::Equal => 1.0,
            std::cmp::Ordering::Less => 0.0,
        });
        let mut rest = c;
        subtract_product(rest.as_mut(), lower.as_ref(), y.as_ref());
        assert!(rest.norm_max() < 1e-13);
    }

    /// Sizes of one panel, of several, and of several tiles: L Lᵀ restores the matrix, entry by
    /// entry; its upper triangle is not read. An indefinite matrix is noticed in any panel.
    #[test]
    fn cholesky_restores_the_matrix() {
        for n in [9, ONE_PANEL, 2 * ONE_PANEL + 37] {
            let b = pseudo_random(n, n);
            let mut a = Mat::from_fn(n, n, |i, j| if i == j { n as f64 } else { 0.0 });
            subtract_product(a.as_mut(), b.as_ref(), (-1.0 * &b).transpose());
            let mut factor = Mat::from_fn(n, n, |i, j| if i < j { f64::NAN } else { a[(i, j)] });
            assert!(cholesky(factor.as_mut()));
            let lower = Mat::from_fn(n, n, |i, j| if i < j { 0.0 } else { factor[(i, j)] });
            let mut rest = a.clone();
            subtract_symmetric_product(rest.as_mut(), lower.as_ref());
            let error = (0..n).flat_map(|j| (j..n).map(move |i| (i, j))).fold(0.0f64, |m, at| m.max(rest[at].abs()));
            assert!(error < 1e-10, "{n}: {error:e}");
            let last = n - 1;
            a[(last, last)] = -1.0;
            assert!(!cholesky(a.as_mut()), "{n}");
        }
    }

    /// Entry by entry, for a size beyond one block.
    #[test]
    fn mirrored_matrices_are_symmetric() {
        let n = 75;
        let mut a: Vec<f64> = (0..n * n).map(|k| if k % n >= k / n { k as f64 } else { f64::NAN }).collect();
        mirror(&mut a, n);
        assert!((0..n * n).all(|k| a[k] == (k % n).max(k / n) as f64 + ((k % n).min(k / n) * n) as f64));
    }

    #[test]
    fn a_hidden_nan_makes_the_largest_entry_infinite() {
        let mut values = vec![1.0f32; 100];
        values[97] = -3.0;
        assert_eq!(largest(&values), 3.0);
        values[40] = f32::NAN;
        assert_eq!(largest(&values), f64::INFINITY);
    }
}
