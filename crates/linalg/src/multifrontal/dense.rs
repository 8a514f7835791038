//! Dense kernels of the fronts.
//!
//! Large operands are divided into tiles whose bounds depend only on their size. Threads share the
//! tiles, and a sequential faer kernel computes each tile, so the result does not depend on the
//! number of threads.

use super::scalar::Scalar;
use dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor::{lu_in_place, lu_in_place_scratch};
use faer::linalg::matmul::matmul;
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

    #[test]
    fn a_hidden_nan_makes_the_largest_entry_infinite() {
        let mut values = vec![1.0f32; 100];
        values[97] = -3.0;
        assert_eq!(largest(&values), 3.0);
        values[40] = f32::NAN;
        assert_eq!(largest(&values), f64::INFINITY);
    }
}
