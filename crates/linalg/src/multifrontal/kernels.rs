//! Loops of the solves with one right-hand side, written so that the compiler vectorises them.
//!
//! All are inlined into a function that is compiled for the instruction sets found at run time.
//! Products and sums are separate operations: `mul_add` would call a library routine in portable builds, and
//! memory bounds the speed anyway. Matrices are column-major without gaps.

use super::scalar::Scalar;

/// y ← y − A x, A of y.len() rows.
#[inline(always)]
pub(super) fn subtract_product<T: Scalar>(a: &[T], x: &[T], y: &mut [T]) {
    let m = y.len();
    if m == 0 {
        return;
    }
    let (quads, _) = x.as_chunks::<4>();
    for (x, a) in quads.iter().zip(a.chunks_exact(4 * m)) {
        let (a0, a) = a.split_at(m);
        let (a1, a) = a.split_at(m);
        let (a2, a3) = a.split_at(m);
        for i in 0..m {
            y[i] -= (a0[i] * x[0] + a1[i] * x[1]) + (a2[i] * x[2] + a3[i] * x[3]);
        }
    }
    let done = 4 * quads.len();
    for (x, a) in x[done..].iter().zip(a[done * m..].chunks_exact(m)) {
        for i in 0..m {
            y[i] -= a[i] * *x;
        }
    }
}

/// y ← y − Aᵀ x, A of x.len() rows.
#[inline(always)]
pub(super) fn subtract_transposed_product<T: Scalar>(a: &[T], x: &[T], y: &mut [T]) {
    if x.is_empty() {
        return;
    }
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

/// x ← L⁻¹ x with the unit lower triangle of a square matrix.
#[inline(always)]
pub(super) fn solve_unit_lower<T: Scalar>(lu: &[T], x: &mut [T]) {
    let n = x.len();
    for j in 0..n {
        let xj = x[j];
        let column = &lu[j * n + j + 1..(j + 1) * n];
        for (x, l) in x[j + 1..].iter_mut().zip(column) {
            *x -= *l * xj;
        }
    }
}

/// x ← U⁻¹ x with the upper triangle of a square matrix.
#[inline(always)]
pub(super) fn solve_upper<T: Scalar>(lu: &[T], x: &mut [T]) {
    let n = x.len();
    for j in (0..n).rev() {
        let xj = x[j] / lu[j * n + j];
        x[j] = xj;
        for (x, u) in x[..j].iter_mut().zip(&lu[j * n..j * n + j]) {
            *x -= *u * xj;
        }
    }
}

/// x ← U⁻ᵀ x with the upper triangle of a square matrix.
#[inline(always)]
pub(super) fn solve_upper_transposed<T: Scalar>(lu: &[T], x: &mut [T]) {
    let n = x.len();
    for j in 0..n {
        let sum = dot(&lu[j * n..j * n + j], &x[..j]);
        x[j] = (x[j] - sum) / lu[j * n + j];
    }
}

/// x ← L⁻ᵀ x with the unit lower triangle of a square matrix.
#[inline(always)]
pub(super) fn solve_unit_lower_transposed<T: Scalar>(lu: &[T], x: &mut [T]) {
    let n = x.len();
    for j in (0..n).rev() {
        let sum = dot(&lu[j * n + j + 1..(j + 1) * n], &x[j + 1..]);
        x[j] -= sum;
    }
}
