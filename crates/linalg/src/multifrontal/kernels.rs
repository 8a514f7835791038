//! Loops of the solves with one right-hand side or a few, written so that the compiler vectorises
//! them.
//!
//! Each is compiled for the instruction sets found at run time. Products and sums are separate
//! operations: `mul_add` would call a library routine in portable builds, and memory bandwidth
//! limits the speed anyway. Matrices are column-major without gaps. Several right-hand sides are the
//! columns of such a matrix too: each entry of the factors is read once for all of them, and every
//! column is computed as it would be alone, bit for bit. Large products are divided into tiles that
//! threads share; every entry of the result is computed in the same way for any tiling.

use super::scalar::Scalar;
use rayon::prelude::*;
use smallvec::SmallVec;
use std::ops::Range;

/// Number of matrix entries from which tiling pays off.
const WORTH_TILING: usize = 200_000;

/// Rows of a tile of a product, and entries of a tile of a transposed product.
const TILE_ROWS: usize = 256;
const TILE_ENTRIES: usize = 100_000;

/// Columns of a panel of a large triangle, and of a tile of a transposed product with one.
const PANEL: usize = 128;
const TILE_COLUMNS: usize = 32;

/// Y ← Y − A X, where A has `m` rows.
pub(super) fn subtract_product<T: Scalar>(a: &[T], m: usize, x: &[T], y: &mut [T]) {
    if m == 0 || a.is_empty() {
        return;
    }
    let x: &Columns<'_, T> = &columns(x, a.len() / m);
    let mut y = columns_mut(y, m);
    if a.len() < WORTH_TILING {
        vectorized(
            #[inline(always)]
            || subtract_rows(a, m, 0..m, x, &mut y),
        );
    } else {
        subtract_tiles(a, m, 0, x, &mut y, true);
    }
}

/// Y ← Y − Aᵀ X, where A has `m` rows.
pub(super) fn subtract_transposed_product<T: Scalar>(a: &[T], m: usize, x: &[T], y: &mut [T]) {
    if m == 0 || a.is_empty() {
        return;
    }
    let x: &Columns<'_, T> = &columns(x, m);
    let mut y = columns_mut(y, a.len() / m);
    if a.len() < WORTH_TILING {
        vectorized(
            #[inline(always)]
            || subtract_dots(a, m, 0..m, x, &mut y),
        );
    } else {
        let count = TILE_ENTRIES.div_ceil(m);
        let tiles = tiles(&mut y, count);
        tiles.into_par_iter().zip(a.par_chunks(count * m)).for_each(|(mut y, a)| {
            vectorized(
                #[inline(always)]
                || subtract_dots(a, m, 0..m, x, &mut y),
            );
        });
    }
}

/// X ← L⁻¹ X with the unit lower triangle of a square matrix of `n` rows.
pub(super) fn solve_unit_lower<T: Scalar>(lu: &[T], n: usize, x: &mut [T]) {
    solve_lower_with::<true, T>(lu, n, x);
}

/// X ← L⁻¹ X with the lower triangle of a square matrix of `n` rows.
pub(super) fn solve_lower<T: Scalar>(lu: &[T], n: usize, x: &mut [T]) {
    solve_lower_with::<false, T>(lu, n, x);
}

fn solve_lower_with<const UNIT: bool, T: Scalar>(lu: &[T], n: usize, x: &mut [T]) {
    let mut x = columns_mut(x, n);
    for panel in panels(n) {
        vectorized(
            #[inline(always)]
            || lower::<UNIT, T>(Triangle { lu, n, panel: panel.clone() }, &mut x),
        );
        subtract_solved(lu, n, &panel, panel.end..n, &mut x);
    }
}

/// X ← U⁻¹ X with the upper triangle of a square matrix of `n` rows.
pub(super) fn solve_upper<T: Scalar>(lu: &[T], n: usize, x: &mut [T]) {
    let mut x = columns_mut(x, n);
    for panel in panels(n).rev() {
        vectorized(
            #[inline(always)]
            || upper(Triangle { lu, n, panel: panel.clone() }, &mut x),
        );
        subtract_solved(lu, n, &panel, 0..panel.start, &mut x);
    }
}

/// X ← U⁻ᵀ X with the upper triangle of a square matrix of `n` rows.
pub(super) fn solve_upper_transposed<T: Scalar>(lu: &[T], n: usize, x: &mut [T]) {
    let mut x = columns_mut(x, n);
    for panel in panels(n) {
        subtract_known(lu, n, &panel, 0..panel.start, &mut x);
        vectorized(
            #[inline(always)]
            || upper_transposed(Triangle { lu, n, panel: panel.clone() }, &mut x),
        );
    }
}

/// X ← L⁻ᵀ X with the unit lower triangle of a square matrix of `n` rows.
pub(super) fn solve_unit_lower_transposed<T: Scalar>(lu: &[T], n: usize, x: &mut [T]) {
    solve_lower_transposed_with::<true, T>(lu, n, x);
}

/// X ← L⁻ᵀ X with the lower triangle of a square matrix of `n` rows.
pub(super) fn solve_lower_transposed<T: Scalar>(lu: &[T], n: usize, x: &mut [T]) {
    solve_lower_transposed_with::<false, T>(lu, n, x);
}

fn solve_lower_transposed_with<const UNIT: bool, T: Scalar>(lu: &[T], n: usize, x: &mut [T]) {
    let mut x = columns_mut(x, n);
    for panel in panels(n).rev() {
        subtract_known(lu, n, &panel, panel.end..n, &mut x);
        vectorized(
            #[inline(always)]
            || lower_transposed::<UNIT, T>(Triangle { lu, n, panel: panel.clone() }, &mut x),
        );
    }
}

/// The columns of right-hand sides, or the same rows of each.
type Columns<'a, T> = SmallVec<[&'a [T]; 1]>;
type ColumnsMut<'a, T> = SmallVec<[&'a mut [T]; 1]>;

fn columns<T>(x: &[T], rows: usize) -> Columns<'_, T> {
    x.chunks_exact(rows.max(1)).collect()
}

fn columns_mut<T>(x: &mut [T], rows: usize) -> ColumnsMut<'_, T> {
    x.chunks_exact_mut(rows.max(1)).collect()
}

/// These rows of every column.
fn copied<T: Copy>(x: &[&mut [T]], rows: Range<usize>) -> Vec<T> {
    x.iter().flat_map(|x| x[rows.clone()].iter().copied()).collect()
}

/// `count` rows of every column after another.
fn tiles<'a, T>(y: &'a mut [&mut [T]], count: usize) -> Vec<ColumnsMut<'a, T>> {
    let mut tiles: Vec<ColumnsMut<'a, T>> = Vec::new();
    for column in y {
        for (number, tile) in column.chunks_mut(count).enumerate() {
            match tiles.get_mut(number) {
                Some(columns) => columns.push(tile),
                None => tiles.push(std::iter::once(tile).collect()),
            }
        }
    }
    tiles
}

/// Columns of a triangle of `n` that are solved at once; the remaining unknowns follow from
/// products that threads share.
fn panels(n: usize) -> impl DoubleEndedIterator<Item = Range<usize>> {
    let width = if n * n < WORTH_TILING { n.max(1) } else { PANEL };
    (0..n.div_ceil(width)).map(move |k| k * width..((k + 1) * width).min(n))
}

/// Y ← Y − (rows of A from `first` on) X, where A has `m` rows; threads share the tiles if there is
/// enough work for them.
fn subtract_tiles<T: Scalar>(a: &[T], m: usize, first: usize, x: &Columns<'_, T>, y: &mut [&mut [T]], share: bool) {
    let tile = |(tile, mut y): (usize, ColumnsMut<'_, T>)| {
        let begin = first + tile * TILE_ROWS;
        let rows = begin..begin + y[0].len();
        vectorized(
            #[inline(always)]
            || subtract_rows(a, m, rows, x, &mut y),
        );
    };
    let tiles = tiles(y, TILE_ROWS);
    if share {
        tiles.into_par_iter().enumerate().for_each(tile);
    } else {
        tiles.into_iter().enumerate().for_each(tile);
    }
}

/// Subtracts the products of the panel's columns with the panel's rows of X from the `rest` of X.
fn subtract_solved<T: Scalar>(lu: &[T], n: usize, panel: &Range<usize>, rest: Range<usize>, x: &mut [&mut [T]]) {
    if rest.is_empty() {
        return;
    }
    let solved = copied(x, panel.clone());
    let mut unsolved: ColumnsMut<'_, T> = x.iter_mut().map(|x| &mut x[rest.clone()]).collect();
    let share = panel.len() * rest.len() >= WORTH_TILING / 2;
    let lu = &lu[panel.start * n..panel.end * n];
    subtract_tiles(lu, n, rest.start, &columns(&solved, panel.len()), &mut unsolved, share);
}

/// Subtracts the products of the panel's columns with the `known` rows of X from the panel's rows.
fn subtract_known<T: Scalar>(lu: &[T], n: usize, panel: &Range<usize>, known: Range<usize>, x: &mut [&mut [T]]) {
    if known.is_empty() {
        return;
    }
    let values = copied(x, known.clone());
    let values: &Columns<'_, T> = &columns(&values, known.len());
    let lu = &lu[panel.start * n..panel.end * n];
    let mut unsolved: ColumnsMut<'_, T> = x.iter_mut().map(|x| &mut x[panel.clone()]).collect();
    let some = |(mut y, lu): (ColumnsMut<'_, T>, &[T])| {
        vectorized(
            #[inline(always)]
            || subtract_dots(lu, n, known.clone(), values, &mut y),
        );
    };
    let share = panel.len() * known.len() >= WORTH_TILING / 2;
    if share {
        let tiles = tiles(&mut unsolved, TILE_COLUMNS);
        tiles.into_par_iter().zip(lu.par_chunks(TILE_COLUMNS * n)).for_each(some);
    } else {
        some((unsolved, lu));
    }
}

fn vectorized(run: impl FnOnce()) {
    pulp::Arch::new().dispatch(run);
}

/// Y ← Y − (rows of A) X, A of m rows.
#[inline(always)]
fn subtract_rows<T: Scalar>(a: &[T], m: usize, rows: Range<usize>, x: &[&[T]], y: &mut [&mut [T]]) {
    let count = a.len() / m;
    let column = |k: usize| &a[k * m + rows.start..k * m + rows.end];
    for q in 0..count / 4 {
        let k = 4 * q;
        let (a0, a1, a2, a3) = (column(k), column(k + 1), column(k + 2), column(k + 3));
        for (x, y) in x.iter().zip(y.iter_mut()) {
            let (x0, x1, x2, x3) = (x[k], x[k + 1], x[k + 2], x[k + 3]);
            for (y, (((a0, a1), a2), a3)) in y.iter_mut().zip(a0.iter().zip(a1).zip(a2).zip(a3)) {
                *y -= (*a0 * x0 + *a1 * x1) + (*a2 * x2 + *a3 * x3);
            }
        }
    }
    for k in count / 4 * 4..count {
        for (x, y) in x.iter().zip(y.iter_mut()) {
            let x = x[k];
            for (y, a) in y.iter_mut().zip(column(k)) {
                *y -= *a * x;
            }
        }
    }
}

/// Y ← Y − (rows of A)ᵀ X, A of m rows; X has only these rows.
#[inline(always)]
fn subtract_dots<T: Scalar>(a: &[T], m: usize, rows: Range<usize>, x: &[&[T]], y: &mut [&mut [T]]) {
    for (k, a) in a.chunks_exact(m).enumerate() {
        let a = &a[rows.clone()];
        let (pairs, rest) = x.as_chunks::<2>();
        for ([x0, x1], y) in pairs.iter().zip(y.chunks_exact_mut(2)) {
            let [dot0, dot1] = two_dots(a, x0, x1);
            y[0][k] -= dot0;
            y[1][k] -= dot1;
        }
        if let ([x], Some(y)) = (rest, y.last_mut()) {
            y[k] -= dot(a, x);
        }
    }
}

/// Number of sums in [`dot`] that do not wait for each other.
const LANES: usize = 16;

/// Sum of products in independent lanes.
#[inline(always)]
fn dot<T: Scalar>(a: &[T], b: &[T]) -> T {
    let mut lanes = [T::ZERO; LANES];
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    for (a, b) in a.iter().zip(b) {
        for l in 0..LANES {
            lanes[l] += a[l] * b[l];
        }
    }
    total(lanes, a_rest, b_rest)
}

/// [`dot`] of `a` with two vectors: the sums of one run while those of the other wait.
#[inline(always)]
fn two_dots<T: Scalar>(a: &[T], b: &[T], c: &[T]) -> [T; 2] {
    let (mut of_b, mut of_c) = ([T::ZERO; LANES], [T::ZERO; LANES]);
    let ((a, a_rest), (b, b_rest), (c, c_rest)) =
        (a.as_chunks::<LANES>(), b.as_chunks::<LANES>(), c.as_chunks::<LANES>());
    for ((a, b), c) in a.iter().zip(b).zip(c) {
        for l in 0..LANES {
            of_b[l] += a[l] * b[l];
        }
        for l in 0..LANES {
            of_c[l] += a[l] * c[l];
        }
    }
    [total(of_b, a_rest, b_rest), total(of_c, a_rest, c_rest)]
}

#[inline(always)]
fn total<T: Scalar>(mut lanes: [T; LANES], a_rest: &[T], b_rest: &[T]) -> T {
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

/// Diagonal block of a square matrix of `n` columns.
struct Triangle<'a, T> {
    lu: &'a [T],
    n: usize,
    /// Its rows and columns.
    panel: Range<usize>,
}

impl<T> Triangle<'_, T> {
    /// Rows of column j of the matrix.
    #[inline(always)]
    fn column(&self, j: usize, rows: Range<usize>) -> &[T] {
        &self.lu[j * self.n + rows.start..j * self.n + rows.end]
    }
}

#[inline(always)]
fn lower<const UNIT: bool, T: Scalar>(lu: Triangle<'_, T>, x: &mut [&mut [T]]) {
    for j in lu.panel.clone() {
        let below = j + 1..lu.panel.end;
        let (column, pivot) = (lu.column(j, below.clone()), lu.column(j, j..j + 1)[0]);
        for x in x.iter_mut() {
            if !UNIT {
                x[j] /= pivot;
            }
            let xj = x[j];
            for (x, l) in x[below.clone()].iter_mut().zip(column) {
                *x -= *l * xj;
            }
        }
    }
}

#[inline(always)]
fn upper<T: Scalar>(lu: Triangle<'_, T>, x: &mut [&mut [T]]) {
    for j in lu.panel.clone().rev() {
        let above = lu.panel.start..j;
        let (column, pivot) = (lu.column(j, above.clone()), lu.column(j, j..j + 1)[0]);
        for x in x.iter_mut() {
            let xj = x[j] / pivot;
            x[j] = xj;
            for (x, u) in x[above.clone()].iter_mut().zip(column) {
                *x -= *u * xj;
            }
        }
    }
}

#[inline(always)]
fn upper_transposed<T: Scalar>(lu: Triangle<'_, T>, x: &mut [&mut [T]]) {
    for j in lu.panel.clone() {
        let above = lu.panel.start..j;
        let (column, pivot) = (lu.column(j, above.clone()), lu.column(j, j..j + 1)[0]);
        for x in x.iter_mut() {
            let sum = dot(column, &x[above.clone()]);
            x[j] = (x[j] - sum) / pivot;
        }
    }
}

#[inline(always)]
fn lower_transposed<const UNIT: bool, T: Scalar>(lu: Triangle<'_, T>, x: &mut [&mut [T]]) {
    for j in lu.panel.clone().rev() {
        let below = j + 1..lu.panel.end;
        let (column, pivot) = (lu.column(j, below.clone()), lu.column(j, j..j + 1)[0]);
        for x in x.iter_mut() {
            x[j] -= dot(column, &x[below.clone()]);
            if !UNIT {
                x[j] /= pivot;
            }
        }
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
        subtract_product(&a, m, &x, &mut y);
        subtract_transposed_product(&a, m, &z, &mut w);
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
            let unit_lower = |i: usize, j: usize| if i == j { 1.0 } else { lu[i + j * n] * f64::from(i > j) };
            let lower = |i: usize, j: usize| lu[i + j * n] * f64::from(i >= j);
            let upper = |i: usize, j: usize| lu[i + j * n] * f64::from(i <= j);
            type Solve = fn(&[f64], usize, &mut [f64]);
            type Entry<'a> = &'a dyn Fn(usize, usize) -> f64;
            let solves: [(Solve, Entry<'_>); 6] = [
                (solve_unit_lower, &unit_lower),
                (solve_lower, &lower),
                (solve_upper, &upper),
                (solve_upper_transposed, &|i, j| upper(j, i)),
                (solve_unit_lower_transposed, &|i, j| unit_lower(j, i)),
                (solve_lower_transposed, &|i, j| lower(j, i)),
            ];
            for (solve, entry) in solves {
                let mut x = b.clone();
                solve(&lu, n, &mut x);
                for i in 0..n {
                    let product: f64 = (0..n).map(|j| entry(i, j) * x[j]).sum();
                    assert!((product - b[i]).abs() < 1e-12, "n = {n}, row {i}: {product} for {}", b[i]);
                }
            }
        }
    }
}
