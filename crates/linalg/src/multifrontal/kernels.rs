//! Loops of the solves with one right-hand side, written so that the compiler vectorises them.
//!
//! Each is compiled for the instruction sets found at run time. Products and sums are separate operations: `mul_add`
//! would call a library routine in portable builds, and memory bounds the speed anyway. Matrices are column-major
//! without gaps. Large products are cut into tiles that threads share; every entry of the result is computed in the
//! same way whatever the tiles.

use super::scalar::Scalar;
use rayon::prelude::*;
use std::ops::Range;

/// Entries of a matrix that are worth a tiling.
const WORTH_TILING: usize = 200_000;

/// Rows of a tile of a product, and entries of a tile of a transposed product.
const TILE_ROWS: usize = 256;
const TILE_ENTRIES: usize = 100_000;

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
    vectorized(
        #[inline(always)]
        || unit_lower(lu, x),
    );
}

/// x ← U⁻¹ x with the upper triangle of a square matrix.
pub(super) fn solve_upper<T: Scalar>(lu: &[T], x: &mut [T]) {
    vectorized(
        #[inline(always)]
        || upper(lu, x),
    );
}

/// x ← U⁻ᵀ x with the upper triangle of a square matrix.
pub(super) fn solve_upper_transposed<T: Scalar>(lu: &[T], x: &mut [T]) {
    vectorized(
        #[inline(always)]
        || upper_transposed(lu, x),
    );
}

/// x ← L⁻ᵀ x with the unit lower triangle of a square matrix.
pub(super) fn solve_unit_lower_transposed<T: Scalar>(lu: &[T], x: &mut [T]) {
    vectorized(
        #[inline(always)]
        || unit_lower_transposed(lu, x),
    );
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

#[inline(always)]
fn unit_lower<T: Scalar>(lu: &[T], x: &mut [T]) {
    let n = x.len();
    for j in 0..n {
        let xj = x[j];
        let column = &lu[j * n + j + 1..(j + 1) * n];
        for (x, l) in x[j + 1..].iter_mut().zip(column) {
            *x -= *l * xj;
        }
    }
}

#[inline(always)]
fn upper<T: Scalar>(lu: &[T], x: &mut [T]) {
    let n = x.len();
    for j in (0..n).rev() {
        let xj = x[j] / lu[j * n + j];
        x[j] = xj;
        for (x, u) in x[..j].iter_mut().zip(&lu[j * n..j * n + j]) {
            *x -= *u * xj;
        }
    }
}

#[inline(always)]
fn upper_transposed<T: Scalar>(lu: &[T], x: &mut [T]) {
    let n = x.len();
    for j in 0..n {
        let sum = dot(&lu[j * n..j * n + j], &x[..j]);
        x[j] = (x[j] - sum) / lu[j * n + j];
    }
}

#[inline(always)]
fn unit_lower_transposed<T: Scalar>(lu: &[T], x: &mut [T]) {
    let n = x.len();
    for j in (0..n).rev() {
        let sum = dot(&lu[j * n + j + 1..(j + 1) * n], &x[j + 1..]);
        x[j] -= sum;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Products of a matrix large enough for tiles, with remainders in both directions, entry by entry.
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
}
