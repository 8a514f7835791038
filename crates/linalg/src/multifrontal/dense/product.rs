//! C ← C − A B by one thread.
//!
//! Blocks of C with three registers of rows and a few columns stay in registers while the inner
//! index runs (Goto and van de Geijn, ACM Trans. Math. Softw. 34 (2008)). Blocks of A are copied
//! so that they are read in order, if there are enough columns of C to be worth it.

use super::super::scalar::Scalar;
use super::registers::{Kernel, Register, run};
use super::view::{View, ViewMut};
use std::cell::Cell;

/// Columns of A, and rows of B, of a block.
const INNER: usize = 256;

/// Rows of A of a block: a multiple of three registers of any format.
const ROWS: usize = 192;

/// Columns of C from which copying A pays off.
const WORTH_COPYING: usize = 32;

/// Which entries of C are needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    Whole,
    /// Those on and below the diagonal; the others may become anything.
    Lower,
}

/// C ← C − A B; rows of `a` must be adjacent.
pub fn subtract<T: Scalar>(c: ViewMut<'_, T>, a: View<'_, T>, b: View<'_, T>, part: Part) {
    assert_eq!((c.rows(), c.columns(), a.columns()), (a.rows(), b.columns(), b.rows()));
    if c.rows() > 0 && c.columns() > 0 && a.columns() > 0 {
        assert_eq!(a.row_stride(), 1);
        run(Product { c, a, b, part });
    }
}

struct Product<'a, T> {
    c: ViewMut<'a, T>,
    a: View<'a, T>,
    b: View<'a, T>,
    part: Part,
}

thread_local! {
    /// Copies of blocks of A and B.
    static COPIES: Cell<Vec<f64>> = const { Cell::new(Vec::new()) };
}

impl<T: Scalar> Kernel<T> for Product<'_, T> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<R: Register<T>, const N: usize, const H: usize>(mut self) {
        let (n, k) = (self.c.columns(), self.a.columns());
        let rows = ROWS.min(self.c.rows()).next_multiple_of(3 * R::LANES);
        let inner = INNER.min(k);
        // rows of a transposed matrix are adjacent in its copy
        let copy_b = self.b.row_stride() != 1 && self.c.rows() > 2 * R::LANES;
        let of_b = if copy_b { inner * n.next_multiple_of(N) } else { 0 };
        let mut copies = COPIES.take();
        let length = rows * inner + of_b;
        if copies.len() < length {
            copies.resize(length, 0.0);
        }
        // SAFETY: numbers are at most as large as f64 and may have any bits.
        let (to_a, to_b) = unsafe {
            let first = copies.as_mut_ptr().cast::<T>();
            (first, first.add(rows * inner))
        };
        for first in (0..k).step_by(inner) {
            let count = inner.min(k - first);
            unsafe {
                if copy_b {
                    copy_rows::<T, N>(self.b.block(first, 0, count, n), to_b);
                }
                let b = if copy_b { Columns::Copied(to_b) } else { Columns::Given(self.b.block(first, 0, count, n)) };
                let a = self.a.block(0, first, self.a.rows(), count);
                product::<T, R, N, H>(&mut self.c, a, &b, to_a, self.part);
            }
        }
        COPIES.set(copies);
    }
}

/// Where the entries of B are.
enum Columns<'a, T> {
    /// Groups of N columns, row by row.
    Copied(*const T),
    Given(View<'a, T>),
}

impl<T: Scalar> Columns<'_, T> {
    /// Addresses of the first entries of `M` columns from `j` on, and the distance to the next row. A
    /// column beyond the last of `n` is the last.
    #[inline(always)]
    unsafe fn group<const N: usize, const M: usize>(&self, j: usize, n: usize, count: usize) -> ([*const T; M], usize) {
        unsafe {
            match self {
                Self::Copied(first) => (std::array::from_fn(|c| first.add(j * count + c)), N),
                Self::Given(b) => {
                    let at = |c: usize| b.pointer().add((j + c).min(n - 1) * b.column_stride());
                    (std::array::from_fn(at), b.row_stride())
                }
            }
        }
    }
}

/// Groups of `N` columns of B, row by row; columns beyond the last are zero.
#[inline(always)]
unsafe fn copy_rows<T: Scalar, const N: usize>(b: View<'_, T>, mut to: *mut T) {
    for j in (0..b.columns()).step_by(N) {
        let width = N.min(b.columns() - j);
        for i in 0..b.rows() {
            unsafe {
                let from = b.pointer().add(i * b.row_stride() + j * b.column_stride());
                if width == N && b.column_stride() == 1 {
                    to.cast::<[T; N]>().write_unaligned(from.cast::<[T; N]>().read_unaligned());
                } else {
                    for c in 0..N {
                        *to.add(c) = if c < width { *from.add(c * b.column_stride()) } else { T::ZERO };
                    }
                }
                to = to.add(N);
            }
        }
    }
}

/// For at most [`INNER`] columns of A.
#[inline(always)]
unsafe fn product<T: Scalar, R: Register<T>, const N: usize, const H: usize>(
    c: &mut ViewMut<'_, T>,
    a: View<'_, T>,
    b: &Columns<'_, T>,
    copy: *mut T,
    part: Part,
) {
    let (m, n, count) = (c.rows(), c.columns(), a.columns());
    let panel = 3 * R::LANES;
    for top in (0..m).step_by(ROWS) {
        let bottom = (top + ROWS).min(m);
        let last = match part {
            Part::Whole => n,
            Part::Lower => n.min(bottom),
        };
        // whole registers of rows can be read where they are, the last rows cannot
        let copied_from = if last >= WORTH_COPYING { top } else { bottom - (bottom - top) % R::LANES };
        unsafe {
            let mut to = copy;
            let mut i = copied_from;
            while i < bottom {
                let lanes = panel.min((bottom - i).next_multiple_of(R::LANES));
                copy_panel::<T, R>(a.block(i, 0, lanes.min(bottom - i), count), lanes / R::LANES, to);
                to = to.add(lanes * count);
                i += lanes;
            }
        }
        let mut j = 0;
        while j < last {
            let narrow = last - j <= H;
            let mut from = copy.cast_const();
            let mut i = top;
            while i < bottom {
                let end = if i < copied_from { copied_from } else { bottom };
                let lanes = panel.min((end - i).next_multiple_of(R::LANES));
                let (at, stride) =
                    unsafe { if i < copied_from { (a.pointer().add(i), a.column_stride()) } else { (from, lanes) } };
                if i >= copied_from {
                    from = unsafe { from.add(lanes * count) };
                }
                let rows = lanes.min(bottom - i);
                if part == Part::Whole || i + rows > j {
                    let block = Block { count, a: at, stride, i, j, rows };
                    unsafe {
                        if narrow {
                            block.any::<R, N, H>(c, b);
                        } else {
                            block.any::<R, N, N>(c, b);
                        }
                    }
                }
                i += lanes;
            }
            j += if narrow { H } else { N };
        }
    }
}

/// Copies rows of A, `registers` registers of them, column by column; rows beyond the last are zero.
#[inline(always)]
unsafe fn copy_panel<T: Scalar, R: Register<T>>(a: View<'_, T>, registers: usize, mut to: *mut T) {
    let whole = a.rows() / R::LANES;
    for k in 0..a.columns() {
        unsafe {
            let from = a.pointer().add(k * a.column_stride());
            for r in 0..whole {
                R::load(from.add(r * R::LANES)).store(to.add(r * R::LANES));
            }
            if whole < registers {
                let rest = a.rows() - whole * R::LANES;
                R::load_part(from.add(whole * R::LANES), rest).store(to.add(whole * R::LANES));
            }
            to = to.add(registers * R::LANES);
        }
    }
}

/// A block of C: `rows` rows from `i` on, and some columns from `j` on.
struct Block<T> {
    count: usize,
    /// Rows of A, columns of which are `stride` numbers apart.
    a: *const T,
    stride: usize,
    i: usize,
    j: usize,
    rows: usize,
}

impl<T: Scalar> Block<T> {
    #[inline(always)]
    unsafe fn any<R: Register<T>, const N: usize, const M: usize>(&self, c: &mut ViewMut<'_, T>, b: &Columns<'_, T>) {
        unsafe {
            let (b, step) = b.group::<N, M>(self.j, c.columns(), self.count);
            match self.rows.div_ceil(R::LANES) {
                1 => self.update::<R, 1, M>(c, b, step),
                2 => self.update::<R, 2, M>(c, b, step),
                _ => self.update::<R, 3, M>(c, b, step),
            }
        }
    }

    /// With `G` registers of rows and `M` columns.
    #[inline(always)]
    unsafe fn update<R: Register<T>, const G: usize, const M: usize>(
        &self,
        c: &mut ViewMut<'_, T>,
        b: [*const T; M],
        step: usize,
    ) {
        unsafe {
            let mut sums = [[R::splat(T::ZERO); G]; M];
            let (mut a, mut at) = (self.a, 0);
            for _ in 0..self.count {
                let rows: [R; G] = std::array::from_fn(|g| R::load(a.add(g * R::LANES)));
                for (sums, column) in sums.iter_mut().zip(&b) {
                    let factor = R::splat(*column.add(at));
                    for (sum, &row) in sums.iter_mut().zip(&rows) {
                        *sum = sum.plus_product(row, factor);
                    }
                }
                // beyond the last column, the address may lie outside of the matrix
                a = a.wrapping_add(self.stride);
                at += step;
            }
            let stride = c.stride();
            let columns = M.min(c.columns() - self.j);
            let mut to = c.pointer().add(self.i + self.j * stride);
            let rest = self.rows - (G - 1) * R::LANES;
            for (j, sums) in sums.iter().enumerate() {
                // the loop is unrolled, which keeps the sums in registers
                if j >= columns {
                    break;
                }
                for (g, &sum) in sums.iter().enumerate() {
                    let to = to.add(g * R::LANES);
                    if g + 1 < G || rest == R::LANES {
                        R::load(to).minus(sum).store(to);
                    } else {
                        R::load_part(to, rest).minus(sum).store_part(to, rest);
                    }
                }
                to = to.wrapping_add(stride);
            }
        }
    }
}
