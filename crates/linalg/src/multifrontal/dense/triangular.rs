//! Solves with triangular matrices, and factorizations, by one thread.
//!
//! All of them divide the matrix into halves, so that most operations are products, until eight
//! columns are left.

use super::super::scalar::Scalar;
use super::product::{Part, subtract};
use super::registers::{Kernel, Register, run};
use super::view::{View, ViewMut};

/// Columns that are treated one by one.
const SMALL: usize = 8;

/// Rows that are solved for together, so that they stay in the cache.
const ROWS: usize = 192;

/// Columns before the middle.
fn half(n: usize) -> usize {
    (n / 2).next_multiple_of(SMALL)
}

/// B ← B U⁻¹ with the upper triangle of `u`.
pub fn solve_upper_right<T: Scalar>(u: View<'_, T>, b: ViewMut<'_, T>) {
    if b.rows() <= ROWS {
        return right(u, b);
    }
    b.row_blocks(ROWS).into_iter().for_each(|rows| right(u, rows));
}

fn right<T: Scalar>(u: View<'_, T>, b: ViewMut<'_, T>) {
    let n = b.columns();
    if n == 0 || b.rows() == 0 {
        return;
    }
    if n <= SMALL {
        return run(Right { u, b });
    }
    let h = half(n);
    let (mut first, mut second) = b.split_columns(h);
    right(u.block(0, 0, h, h), first.borrow());
    subtract(second.borrow(), first.read(), u.block(0, h, h, n - h), Part::Whole);
    right(u.block(h, h, n - h, n - h), second);
}

/// B ← B U⁻¹ for at most [`SMALL`] columns.
struct Right<'a, T> {
    u: View<'a, T>,
    b: ViewMut<'a, T>,
}

impl<T: Scalar> Kernel<T> for Right<'_, T> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<R: Register<T>, const N: usize, const H: usize>(mut self) {
        let (rows, n, stride) = (self.b.rows(), self.b.columns(), self.b.stride());
        let mut u = [[T::ZERO; SMALL]; SMALL];
        let mut inverse = [T::ONE; SMALL];
        for j in 0..n {
            (0..j).for_each(|k| u[k][j] = self.u.get(k, j));
            inverse[j] = T::ONE / self.u.get(j, j);
        }
        let first = self.b.pointer();
        for i in (0..rows).step_by(R::LANES) {
            let rest = rows - i;
            // SAFETY: columns beyond the last are neither read nor written.
            unsafe {
                let at = |j: usize| first.add(i + j.min(n - 1) * stride);
                let mut x: [R; SMALL] =
                    std::array::from_fn(|j| if rest >= R::LANES { R::load(at(j)) } else { R::load_part(at(j), rest) });
                for j in 0..SMALL {
                    for k in 0..j {
                        x[j] = x[j].minus_product(x[k], R::splat(u[k][j]));
                    }
                    x[j] = x[j].times(R::splat(inverse[j]));
                }
                for (j, &x) in x.iter().enumerate() {
                    if j < n && rest >= R::LANES {
                        x.store(at(j));
                    } else if j < n {
                        x.store_part(at(j), rest);
                    }
                }
            }
        }
    }
}

/// B ← L⁻¹ B with the unit lower triangle of `l`.
pub fn solve_unit_lower<T: Scalar>(l: View<'_, T>, b: ViewMut<'_, T>) {
    let n = b.rows();
    if n == 0 || b.columns() == 0 {
        return;
    }
    if n <= SMALL {
        return run(Left { l, b });
    }
    let h = half(n);
    let (mut first, mut second) = b.split_rows(h);
    solve_unit_lower(l.block(0, 0, h, h), first.borrow());
    subtract(second.borrow(), l.block(h, 0, n - h, h), first.read(), Part::Whole);
    solve_unit_lower(l.block(h, h, n - h, n - h), second);
}

/// B ← L⁻¹ B for at most [`SMALL`] rows.
struct Left<'a, T> {
    l: View<'a, T>,
    b: ViewMut<'a, T>,
}

impl<T: Scalar> Kernel<T> for Left<'_, T> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<R: Register<T>, const N: usize, const H: usize>(mut self) {
        let n = self.b.rows();
        let mut l = [[T::ZERO; SMALL]; SMALL];
        for k in 0..n {
            (k + 1..n).for_each(|i| l[k][i] = self.l.get(i, k));
        }
        for j in 0..self.b.columns() {
            let column = self.b.column(j);
            let mut x = [T::ZERO; SMALL];
            x[..n].copy_from_slice(column);
            for k in 0..SMALL {
                let factor = x[k];
                for i in 0..SMALL {
                    x[i] -= l[k][i] * factor;
                }
            }
            column.copy_from_slice(&x[..n]);
        }
    }
}

/// A = L Lᵀ in the lower triangle, with undefined entries above. `false` if A is not positive definite.
pub fn cholesky<T: Scalar>(a: ViewMut<'_, T>) -> bool {
    let n = a.rows();
    if n <= SMALL {
        return small_cholesky(a);
    }
    let h = half(n);
    let (left, right) = a.split_columns(h);
    let (mut diagonal, mut below) = left.split_rows(h);
    let (_, mut rest) = right.split_rows(h);
    if !cholesky(diagonal.borrow()) {
        return false;
    }
    solve_upper_right(diagonal.read().transpose(), below.borrow());
    subtract(rest.borrow(), below.read(), below.read().transpose(), Part::Lower);
    cholesky(rest)
}

fn small_cholesky<T: Scalar>(mut a: ViewMut<'_, T>) -> bool {
    let n = a.rows();
    let mut l = [[T::ZERO; SMALL]; SMALL];
    for j in 0..n {
        l[j][j..n].copy_from_slice(&a.column(j)[j..]);
    }
    for j in 0..n {
        let pivot = l[j][j];
        // written so that NaN fails
        if !(pivot > T::ZERO) {
            return false;
        }
        l[j][j] = pivot.square_root();
        let inverse = T::ONE / l[j][j];
        (j + 1..n).for_each(|i| l[j][i] *= inverse);
        for k in j + 1..n {
            let factor = l[j][k];
            for i in k..n {
                l[k][i] -= l[j][i] * factor;
            }
        }
        a.column(j)[j..].copy_from_slice(&l[j][j..n]);
    }
    true
}

/// P A = L U in place with partial pivoting, for at least as many rows as columns. At step k, rows k
/// and `swaps[k]` are interchanged.
pub fn lu<T: Scalar>(a: ViewMut<'_, T>, swaps: &mut [u32]) {
    let (m, n) = (a.rows(), a.columns());
    if n <= SMALL {
        return run(SmallLu { a, swaps });
    }
    let h = half(n);
    let (mut left, mut right) = a.split_columns(h);
    let (of_left, of_right) = swaps.split_at_mut(h);
    lu(left.borrow(), of_left);
    interchange(right.borrow(), of_left);
    let (mut upper, mut lower) = right.split_rows(h);
    let (factors, mut below) = left.split_rows(h);
    solve_unit_lower(factors.read(), upper.borrow());
    subtract(lower.borrow(), below.read(), upper.read(), Part::Whole);
    debug_assert!(m >= n);
    lu(lower, of_right);
    interchange(below.borrow(), of_right);
    of_right.iter_mut().for_each(|row| *row += h as u32);
}

/// Interchanges rows k and `swaps[k]` in order.
fn interchange<T: Scalar>(mut a: ViewMut<'_, T>, swaps: &[u32]) {
    for j in 0..a.columns() {
        let column = a.column(j);
        for (k, &row) in swaps.iter().enumerate() {
            column.swap(k, row as usize);
        }
    }
}

/// LU of at most [`SMALL`] columns.
struct SmallLu<'a, T> {
    a: ViewMut<'a, T>,
    swaps: &'a mut [u32],
}

impl<T: Scalar> Kernel<T> for SmallLu<'_, T> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<R: Register<T>, const N: usize, const H: usize>(mut self) {
        let n = self.a.columns();
        for k in 0..n {
            let row = k + largest(&self.a.column(k)[k..]);
            self.swaps[k] = row as u32;
            if row != k {
                (0..n).for_each(|j| self.a.column(j).swap(k, row));
            }
            let column = &mut self.a.column(k)[k..];
            let pivot = column[0];
            if pivot != T::ZERO {
                let inverse = T::ONE / pivot;
                column[1..].iter_mut().for_each(|x| *x *= inverse);
            }
            for j in k + 1..n {
                let (multipliers, column) = self.a.two_columns(k, j);
                let factor = column[k];
                for (x, &l) in column[k + 1..].iter_mut().zip(&multipliers[k + 1..]) {
                    *x -= l * factor;
                }
            }
        }
    }
}

/// The first place of the largest absolute value.
#[inline(always)]
fn largest<T: Scalar>(values: &[T]) -> usize {
    const LANES: usize = 16;
    let mut lanes = [T::ZERO; LANES];
    let (chunks, rest) = values.as_chunks::<LANES>();
    for chunk in chunks {
        for l in 0..LANES {
            let x = chunk[l].absolute();
            lanes[l] = if x > lanes[l] { x } else { lanes[l] };
        }
    }
    let largest = lanes.iter().chain(rest).fold(T::ZERO, |m, x| if x.absolute() > m { x.absolute() } else { m });
    values.iter().position(|x| x.absolute() == largest).unwrap_or(0)
}
