//! Square tiles of a matrix, whole or packed, and their products with vectors.

use super::super::scalar::{SIDE, Scalar};
use pulp::Simd;
use std::ops::Range;

/// A square matrix, column-major.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(super) struct Tile<T>(pub(super) [[T; SIDE]; SIDE]);

/// A square matrix of 16-bit integers times a common factor: half the memory of single precision, and
/// an error of at most 2e-5 of its largest entry.
#[derive(Debug, Clone, Copy)]
#[repr(align(16))]
pub(super) struct PackedTile<T> {
    pub(super) entries: [[i16; SIDE]; SIDE],
    pub(super) factor: T,
}

/// A tile as the kernels see it: a matrix of numbers, and a factor for vectors.
pub(super) trait Stored<T>: Copy + Send + Sync {
    fn column(&self, column: usize) -> [T; SIDE];
    fn scale(&self, x: &[T; SIDE]) -> [T; SIDE];
}

impl<T: Scalar> Stored<T> for Tile<T> {
    #[inline(always)]
    fn column(&self, column: usize) -> [T; SIDE] {
        self.0[column]
    }

    #[inline(always)]
    fn scale(&self, x: &[T; SIDE]) -> [T; SIDE] {
        *x
    }
}

impl<T: Scalar> Stored<T> for PackedTile<T> {
    #[inline(always)]
    fn column(&self, column: usize) -> [T; SIDE] {
        self.entries[column].map(T::from_i16)
    }

    #[inline(always)]
    fn scale(&self, x: &[T; SIDE]) -> [T; SIDE] {
        x.map(|x| x * self.factor)
    }
}

impl<T: Scalar> PackedTile<T> {
    #[inline(always)]
    pub(super) fn of(tile: &Tile<T>) -> Self {
        let mut sizes = [T::ZERO; SIDE];
        for column in &tile.0 {
            sizes.iter_mut().zip(column).for_each(|(size, x)| *size = larger(*size, x.absolute()));
        }
        let largest = sizes.into_iter().fold(T::ZERO, larger).to_f64();
        let unit = if largest > 0.0 { largest / f64::from(i16::MAX) } else { 1.0 };
        let inverse = T::from_f64(1.0 / unit);
        Self { entries: tile.0.map(|column| column.map(|x| (x * inverse).round_to_i16())), factor: T::from_f64(unit) }
    }
}

#[inline(always)]
fn larger<T: Scalar>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

/// The first numbers of a slice, as many as a tile has rows.
#[inline(always)]
pub(super) fn first<T>(x: &[T]) -> &[T; SIDE] {
    x.first_chunk().expect("whole tiles")
}

/// At most `SIDE` rows and columns of a matrix, given with the distances of its columns and of its
/// rows in memory; zeros elsewhere.
#[inline]
pub(super) fn tile_of<T: Scalar>(
    (values, column_stride, row_stride): (&[T], usize, usize),
    rows: Range<usize>,
    columns: Range<usize>,
) -> Tile<T> {
    let mut tile = Tile([[T::ZERO; SIDE]; SIDE]);
    let start = |i: usize, j: usize| i * row_stride + j * column_stride;
    let whole = rows.len() == SIDE && columns.len() == SIDE;
    if whole && row_stride == 1 {
        for (j, to) in columns.zip(&mut tile.0) {
            to.copy_from_slice(&values[start(rows.start, j)..][..SIDE]);
        }
    } else if whole && column_stride == 1 {
        for (i, row) in rows.enumerate() {
            let from: &[T; SIDE] = first(&values[start(row, columns.start)..]);
            for j in 0..SIDE {
                tile.0[j][i] = from[j];
            }
        }
    } else {
        for (j, to) in columns.zip(&mut tile.0) {
            rows.clone().zip(to).for_each(|(i, to)| *to = values[start(i, j)]);
        }
    }
    tile
}

/// The inverse of a lower triangle with these entries on its `diagonal`; beyond them, that of the unit
/// matrix.
pub(super) fn inverse<T: Scalar>(triangle: &Tile<T>, diagonal: impl Iterator<Item = T>) -> Tile<T> {
    let mut pivots = [1.0; SIDE];
    pivots.iter_mut().zip(diagonal).for_each(|(to, pivot)| *to = pivot.to_f64());
    let mut tile = Tile([[T::ZERO; SIDE]; SIDE]);
    for (j, column) in tile.0.iter_mut().enumerate() {
        let mut x = [0.0; SIDE];
        for i in j..SIDE {
            let known: f64 = (j..i).map(|k| triangle.0[k][i].to_f64() * x[k]).sum();
            x[i] = (if i == j { 1.0 } else { 0.0 } - known) / pivots[i];
            column[i] = T::from_f64(x[i]);
        }
    }
    tile
}

/// y ← y + A x, in two sums that do not wait for each other. The compiler vectorizes the loops; it does
/// not fuse products and sums.
#[inline(always)]
pub(super) fn add_product<T: Scalar>(tile: &impl Stored<T>, x: &[T; SIDE], y: &mut [T; SIDE]) {
    let x = tile.scale(x);
    let (mut even, mut odd) = (*y, [T::ZERO; SIDE]);
    for k in 0..SIDE / 2 {
        let (a, b) = (tile.column(2 * k), tile.column(2 * k + 1));
        for i in 0..SIDE {
            even[i] += a[i] * x[2 * k];
        }
        for i in 0..SIDE {
            odd[i] += b[i] * x[2 * k + 1];
        }
    }
    for i in 0..SIDE {
        y[i] = even[i] + odd[i];
    }
}

/// Sums of the products of transposed tiles with vectors: as many tiles as the vector has. The lanes of
/// the registers are summed at the end, so that additions do not wait for each other.
#[inline(always)]
pub(super) fn transposed_products<S: Simd, T: Scalar, K: Stored<T>>(simd: S, terms: [(&[K], &[T]); 2]) -> [T; SIDE] {
    let mut totals = [T::ZERO; SIDE];
    for v in 0..T::vectors::<S>(&[T::ZERO; SIDE]).len() {
        let of = |x: &[T; SIDE]| T::vectors::<S>(x)[v];
        let [mut s0, mut s1, mut s2, mut s3, mut s4, mut s5, mut s6, mut s7] = [T::splat(simd, T::ZERO); SIDE];
        for (tiles, x) in terms {
            for (tile, x) in tiles.iter().zip(x.as_chunks::<SIDE>().0) {
                let x = of(&tile.scale(x));
                s0 = T::multiply_add(simd, of(&tile.column(0)), x, s0);
                s1 = T::multiply_add(simd, of(&tile.column(1)), x, s1);
                s2 = T::multiply_add(simd, of(&tile.column(2)), x, s2);
                s3 = T::multiply_add(simd, of(&tile.column(3)), x, s3);
                s4 = T::multiply_add(simd, of(&tile.column(4)), x, s4);
                s5 = T::multiply_add(simd, of(&tile.column(5)), x, s5);
                s6 = T::multiply_add(simd, of(&tile.column(6)), x, s6);
                s7 = T::multiply_add(simd, of(&tile.column(7)), x, s7);
            }
        }
        let sums = [s0, s1, s2, s3, s4, s5, s6, s7];
        totals.iter_mut().zip(sums).for_each(|(total, sum)| *total += T::total(simd, sum));
    }
    totals
}
