//! Loops of the solves with one right-hand side, written so that the compiler vectorises them.
//!
//! Each is compiled for the instruction sets found at run time. Products and sums are separate
//! operations: `mul_add` would call a library routine in portable builds, and memory bandwidth
//! limits the speed anyway. Matrices are column-major without gaps. Large products are divided into
//! tiles that threads share; every entry of the result is computed in the same way for any tiling.

use super::scalar::Scalar;
use rayon::prelude::*;
use std::ops::Range;

/// Number of matrix entries from which tiling pays off.
const WORTH_TILING: usize = 200_000;

/// Rows of a tile of a product, and entries of a tile of a transposed product.
const TILE_ROWS: usize = 256;
const TILE_ENTRIES: usize = 100_000;

/// Columns of a panel of a large triangle, and of a tile of a transposed product with one.
const PANEL: usize = 128;
const TILE_COLUMNS: usize = 32;

/// y ← y − A x, A of y.len() rows.
pub(super) fn subtract_product<T: Scalar>(a: &[T], x: &[T], y: &mut [T]) {
    let m = y.len();
    if a.len() < WORTH_TILING {
        vectorized(
            #[inline(always)]
            || subtract_rows(a, m, 0..m, x, y),
        );
    } else {
        y.par_chunks_mut(TILE_ROWS).enumerate().for_each(|(tile, y)| {
            let rows = tile * TILE_ROWS..tile * TILE_ROWS + y.len();
            vectorized(
                #[inline(always)]
                || subtract_rows(a, m, rows, x, y),
            );
        });
    }
}

/// y ← y − Aᵀ x, A of x.len() rows.
pub(super) fn subtract_transposed_product<T: Scalar>(a: &[T], x: &[T], y: &mut [T]) {
    let m = x.len();
    if m == 0 {
        return;
    }
    if a.len() < WORTH_TILING {
        vectorized(
            #[inline(always)]
            || subtract_dots(a, x, y),
        );
    } else {
        let columns = TILE_ENTRIES.div_ceil(m);
        y.par_chunks_mut(columns).zip(a.par_chunks(columns * m)).for_each(|(y, a)| {
            vectorized(
                #[inline(always)]
                || subtract_dots(a, x, y),
            );
        });
    }
}

/// x ← L⁻¹ x with the unit lower triangle of a square matrix.
pub(super) fn solve_unit_lower<T: Scalar>(lu: &[T], x: &mut [T]) {
    let n = x.len();
    for panel in panels(n) {
        let (solved, rest) = x.split_at_mut(panel.end);
        let solved = &mut solved[panel.clone()];
        vectorized(
            #[inline(always)]
            || unit_lower(Triangle { lu, n, from: panel.start }, solved),
        );
        subtract_from_rows(&lu[panel.start * n..panel.end * n], n, panel.end, solved, rest);
    }
}

/// x ← U⁻¹ x with the upper triangle of a square matrix.
pub(super) fn solve_upper<T: Scalar>(lu: &[T], x: &mut [T]) {
    let n = x.len();
    for panel in panels(n).rev() {
        let (rest, solved) = x.split_at_mut(panel.start);
        let solved = &mut solved[..panel.len()];
        vectorized(
            #[inline(always)]
            || upper(Triangle { lu, n, from: panel.start }, solved),
        );
        subtract_from_rows(&lu[panel.start * n..panel.end * n], n, 0, solved, rest);
    }
}

/// x ← U⁻ᵀ x with the upper triangle of a square matrix.
pub(super) fn solve_upper_transposed<T: Scalar>(lu: &[T], x: &mut [T]) {
    let n = x.len();
    for panel in panels(n) {
        let (known, unsolved) = x.split_at_mut(panel.start);
        let unsolved = &mut unsolved[..panel.len()];
        subtract_column_dots(&lu[panel.start * n..panel.end * n], n, 0..panel.start, known, unsolved);
        vectorized(
            #[inline(always)]
            || upper_transposed(Triangle { lu, n, from: panel.start }, unsolved),
        );
    }
}

/// x ← L⁻ᵀ x with the unit lower triangle of a square matrix.
pub(super) fn solve_unit_lower_transposed<T: Scalar>(lu: &[T], x: &mut [T]) {
    let n = x.len();
    for panel in panels(n).rev() {
        let (unsolved, known) = x.split_at_mut(panel.end);
        let unsolved = &mut unsolved[panel.clone()];
        subtract_column_dots(&lu[panel.start * n..panel.end * n], n, panel.end..n, known, unsolved);
        vectorized(
            #[inline(always)]
            || unit_lower_transposed(Triangle { lu, n, from: panel.start }, unsolved),
        );
    }
}

/// Columns of a triangle of `n` that are solved at once; the remaining unknowns follow from
/// products that threads share.
fn panels(n: usize) -> impl DoubleEndedIterator<Item = Range<usize>> {
    let width = if n * n < WORTH_TILING { n.max(1) } else { PANEL };
    (0..n.div_ceil(width)).map(move |k| k * width..((k + 1) * width).min(n))
}

/// y ← y − (rows from `first` on) x, in columns of `n`.
fn subtract_from_rows<T: Scalar>(columns: &[T], n: usize, first: usize, x: &[T], y: &mut [T]) {
    let tile = |(tile, y): (usize, &mut [T])| {
        let begin = first + tile * TILE_ROWS;
        let rows = begin..begin + y.len();
        vectorized(
            #[inline(always)]
            || subtract_rows(columns, n, rows, x, y),
        );
    };
    if y.len() * x.len() < WORTH_TILING / 2 {
        y.chunks_mut(TILE_ROWS).enumerate().for_each(tile);
    } else {
        y.par_chunks_mut(TILE_ROWS).enumerate().for_each(tile);
    }
}

/// yⱼ ← yⱼ − (`rows` of column j) · x, in columns of `n`.
fn subtract_column_dots<T: Scalar>(columns: &[T], n: usize, rows: Range<usize>, x: &[T], y: &mut [T]) {
    let some = |(y, columns): (&mut [T], &[T])| {
        vectorized(
            #[inline(always)]
            || {
                for (y, column) in y.iter_mut().zip(columns.chunks_exact(n)) {
                    *y -= dot(&column[rows.clone()], x);
                }
            },
        );
    };
    if y.len() * x.len() < WORTH_TILING / 2 {
        some((y, columns));
    } else {
        y.par_chunks_mut(TILE_COLUMNS).zip(columns.par_chunks(TILE_COLUMNS * n)).for_each(some);
    }
}

fn vectorized(run: impl FnOnce()) {
    pulp::Arch::new().dispatch(run);
}

/// y ← y − (rows of A) x, A of m rows.
#[inline(always)]
fn subtract_rows<T: Scalar>(a: &[T], m: usize, rows: Range<usize>, x: &[T], y: &mut [T]) {
    if m == 0 {
        return;
    }
    let column = |k: usize| &a[k * m + rows.start..k * m + rows.end];
    let (quads, rest) = x.as_chunks::<4>();
    for (q, x) in quads.iter().enumerate() {
        let k = 4 * q;
        let columns = column(k).iter().zip(column(k + 1)).zip(column(k + 2)).zip(column(k + 3));
        for (y, (((a0, a1), a2), a3)) in y.iter_mut().zip(columns) {
            *y -= (*a0 * x[0] + *a1 * x[1]) + (*a2 * x[2] + *a3 * x[3]);
        }
    }
    for (k, x) in rest.iter().enumerate() {
        for (y, a) in y.iter_mut().zip(column(4 * quads.len() + k)) {
            *y -= *a * *x;
        }
    }
}

#[inline(always)]
fn subtract_dots<T: Scalar>(a: &[T], x: &[T], y: &mut [T]) {
    for (y, a) in y.iter_mut().zip(a.chunks_exact(x.len())) {
        *y -= dot(a, x);
    }
}

/// Sum of products in independent lanes.
#[inline(always)]
fn dot<T: Scalar>(a: &[T], b: &[T]) -> T {
    const LANES: usize = 16;
    let (a, a_rest) = a.as_chunks::<LANES>();
    let (b, b_rest) = b.as_chunks::<LANES>();
    let mut lanes = [T::ZERO; LANES];
    for (a, b) in a.iter().zip(b) {
        for l in 0..LANES {
            lanes[l] += a[l] * b[l];
        }
    }
    let mut sum = T::ZERO;
    for (a, b) in a_rest.iter().zip(b_rest) {
        sum += *a * *b;
    }
    let mut width = LANES / 2;
    while width > 0 {
        for l in 0..width {
            lanes[l] += lanes[l + width];
        }
        width /= 2;
    }
    lanes[0] + sum
}

/// Diagonal block, from the unknown `from` on, of a square matrix of `n` columns.
struct Triangle<'a, T> {
    lu: &'a [T],
    n: usize,
    from: usize,
}

impl<T> Triangle<'_, T> {
    /// Rows of column j of the block.
    #[inline(always)]
    fn column(&self, j: usize, rows: Range<usize>) -> &[T] {
        let begin = (self.from + j) * self.n + self.from;
        &self.lu[begin + rows.start..begin + rows.end]
    }
}

#[inline(always)]
fn unit_lower<T: Scalar>(lu: Triangle<'_, T>, x: &mut [T]) {
    let n = x.len();
    for j in 0..n {
        let xj = x[j];
        for (x, l) in x[j + 1..].iter_mut().zip(lu.column(j, j + 1..n)) {
            *x -= *l * xj;
        }
    }
}

#[inline(always)]
fn upper<T: Scalar>(lu: Triangle<'_, T>, x: &mut [T]) {
    for j in (0..x.len()).rev() {
        let xj = x[j] / lu.column(j, j..j + 1)[0];
        x[j] = xj;
        for (x, u) in x[..j].iter_mut().zip(lu.column(j, 0..j)) {
            *x -= *u * xj;
        }
    }
}

#[inline(always)]
fn upper_transposed<T: Scalar>(lu: Triangle<'_, T>, x: &mut [T]) {
    for j in 0..x.len() {
        let sum = dot(lu.column(j, 0..j), &x[..j]);
        x[j] = (x[j] - sum) / lu.column(j, j..j + 1)[0];
    }
}

#[inline(always)]
fn unit_lower_transposed<T: Scalar>(lu: Triangle<'_, T>, x: &mut [T]) {
    let n = x.len();
    for j in (0..n).rev() {
        let sum = dot(lu.column(j, j + 1..n), &x[j + 1..]);
        x[j] -= sum;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Products of a matrix large enough for tiles, with remainders in both directions, entry by
    /// entry.
    #[test]
    fn tiled_products_agree_with_their_definition() {
        let (m, n) = (2 * TILE_ROWS + 37, 403);
        assert!(m * n >= WORTH_TILING);
        let wave = |count: usize, pitch: f64| (0..count).map(|i| (i as f64 * pitch).sin()).collect::<Vec<f64>>();
        let (a, x, z) = (wave(m * n, 0.618), wave(n, 0.37), wave(m, 0.73));
        let (mut y, mut w) = (vec![1.0; m], vec![1.0; n]);
        subtract_product(&a, &x, &mut y);
        subtract_transposed_product(&a, &z, &mut w);
        for i in 0..m {
            let sum: f64 = (0..n).map(|j| a[i + j * m] * x[j]).sum();
            assert!((y[i] - (1.0 - sum)).abs() < 1e-11);
        }
        for j in 0..n {
            let sum: f64 = (0..m).map(|i| a[i + j * m] * z[i]).sum();
            assert!((w[j] - (1.0 - sum)).abs() < 1e-11);
        }
    }

    /// Triangles below and above the size that is divided into panels: multiplying the solutions by
    /// the matrices reproduces the right-hand sides.
    #[test]
    fn triangular_solves_invert_products() {
        for n in [7, 300, 3 * PANEL + 100] {
            assert!((n * n >= WORTH_TILING) == (n > 300));
            let lu: Vec<f64> =
                (0..n * n).map(|k| if k % n == k / n { 2.0 } else { (k as f64 * 0.618).sin() / n as f64 }).collect();
            let b: Vec<f64> = (0..n).map(|i| (i as f64 * 0.37).cos()).collect();
            let lower = |i: usize, j: usize| if i == j { 1.0 } else { lu[i + j * n] * f64::from(i > j) };
            let upper = |i: usize, j: usize| lu[i + j * n] * f64::from(i <= j);
            type Solve = fn(&[f64], &mut [f64]);
            type Entry<'a> = &'a dyn Fn(usize, usize) -> f64;
            let solves: [(Solve, Entry<'_>); 4] = [
                (solve_unit_lower, &lower),
                (solve_upper, &upper),
                (solve_upper_transposed, &|i, j| upper(j, i)),
                (solve_unit_lower_transposed, &|i, j| lower(j, i)),
            ];
            for (solve, entry) in solves {
                let mut x = b.clone();
                solve(&lu, &mut x);
                for i in 0..n {
                    let product: f64 = (0..n).map(|j| entry(i, j) * x[j]).sum();
                    assert!((product - b[i]).abs() < 1e-12, "n = {n}, row {i}: {product} for {}", b[i]);
                }
            }
        }
    }
}
