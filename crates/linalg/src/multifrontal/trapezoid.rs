//! The factors of a front in the layout in which substitutions read them.
//!
//! Each is a lower trapezoid: a triangle over the pivots and the rows beyond. It is divided into
//! panels of eight columns, and these into square tiles, in the order in which a substitution visits
//! them, so that memory is read as one stream without remainders. The diagonal tiles are stored
//! inverted: solving with them is a product.
//!
//! ```text
//!   [ D₀⁻¹            ]     x₀ ← D₀⁻¹ x₀,  then x ← x − L x₀ in the rows below,
//!   [ L₁₀  D₁⁻¹       ]     panel by panel; the transposed solve runs backward
//!   [ L₂₀  L₂₁  D₂⁻¹  ]
//!   [ Lₜ₀  Lₜ₁  Lₜ₂   ]     rows beyond
//! ```
//!
//! The kernels are compiled for the instruction sets found at run time. Several right-hand sides are
//! the columns of a matrix: each tile is read once for all of them, and every column is computed as
//! it would be alone, bit for bit. Threads share large trapezoids; every entry of the result is
//! computed in the same way by any number of threads.

mod tile;

use super::scalar::{SIDE, Scalar};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use smallvec::SmallVec;
use std::ops::Range;
use tile::{PackedTile, Stored, Tile, add_product, first, inverse, tile_of, transposed_products};

/// Number of tiles from which threads share a trapezoid, and from which they share the products with
/// some of its panels.
const WORTH_SHARING: usize = 3200;
const WORTH_SPLITTING: usize = 1600;

/// Panels of a shared trapezoid that are solved by one thread before the others are updated.
const TOGETHER: usize = 16;

/// Tiles of a panel that a thread treats at a time.
const BLOCK: usize = 32;

/// Lower trapezoid, with `pivots` columns and `beyond` further rows. Both are padded to whole tiles:
/// by a unit matrix on the diagonal, and by zeros elsewhere.
#[derive(Debug)]
pub(super) struct Trapezoid<T> {
    pivots: usize,
    beyond: usize,
    tiles: Tiles<T>,
}

#[derive(Debug)]
enum Tiles<T> {
    Full(Vec<Tile<T>>),
    Packed(Vec<PackedTile<T>>),
}

/// The length of a vector in whole tiles.
pub(super) fn padded(length: usize) -> usize {
    length.next_multiple_of(SIDE)
}

/// Entries of a trapezoid.
pub(super) fn entries(pivots: usize, beyond: usize) -> usize {
    let (panels, beyond) = (pivots.div_ceil(SIDE), beyond.div_ceil(SIDE));
    SIDE * SIDE * (panels * (panels + 1) / 2 + panels * beyond)
}

/// Right-hand sides, or the same rows of each.
type Columns<'a, T> = SmallVec<[&'a mut [T]; 1]>;

impl<T: Scalar> Trapezoid<T> {
    /// The triangle on and below the diagonal of a column-major square matrix, with the rows `beyond`
    /// below.
    pub fn of_lower(triangle: &[T], beyond: &[T], pivots: usize) -> Self {
        let rows = beyond.len().checked_div(pivots).unwrap_or(0);
        Self::new(pivots, rows, |i| triangle[i + i * pivots], (triangle, pivots, 1), (beyond, rows, 1))
    }

    /// The same with ones on the diagonal.
    pub fn of_unit_lower(triangle: &[T], beyond: &[T], pivots: usize) -> Self {
        let rows = beyond.len().checked_div(pivots).unwrap_or(0);
        Self::new(pivots, rows, |_| T::ONE, (triangle, pivots, 1), (beyond, rows, 1))
    }

    /// The transpose of the triangle on and above the diagonal of a column-major square matrix, and of
    /// the columns `beyond` to its right.
    pub fn of_upper(triangle: &[T], beyond: &[T], pivots: usize) -> Self {
        let columns = beyond.len().checked_div(pivots).unwrap_or(0);
        Self::new(pivots, columns, |i| triangle[i + i * pivots], (triangle, 1, pivots), (beyond, 1, pivots))
    }

    /// From the entries on the diagonal, and from two matrices with the distances of their columns and
    /// of their rows in memory: the triangle and the rows beyond.
    fn new(
        pivots: usize,
        beyond: usize,
        diagonal: impl Fn(usize) -> T,
        triangle: (&[T], usize, usize),
        rows_beyond: (&[T], usize, usize),
    ) -> Self {
        let (panels, below) = (pivots.div_ceil(SIDE), beyond.div_ceil(SIDE));
        let mut tiles = Vec::with_capacity(entries(pivots, beyond) / (SIDE * SIDE));
        for panel in 0..panels {
            let first = SIDE * panel;
            let columns = first..pivots.min(first + SIDE);
            let on_diagonal = tile_of(triangle, columns.clone(), columns.clone());
            tiles.push(inverse(&on_diagonal, columns.clone().map(&diagonal)));
            let tile = |matrix, rows: usize, row: usize| {
                tile_of(matrix, SIDE * row..rows.min(SIDE * (row + 1)), columns.clone())
            };
            tiles.extend((panel + 1..panels).map(|row| tile(triangle, pivots, row)));
            tiles.extend((0..below).map(|row| tile(rows_beyond, beyond, row)));
        }
        Self { pivots, beyond, tiles: Tiles::Full(tiles) }
    }

    /// Number of rows below the triangle.
    pub fn beyond(&self) -> usize {
        self.beyond
    }

    /// Number of stored entries.
    pub fn entries(&self) -> usize {
        entries(self.pivots, self.beyond)
    }

    /// Memory of the entries. \[bytes\]
    pub fn bytes(&self) -> usize {
        match &self.tiles {
            Tiles::Full(tiles) => size_of_val(tiles.as_slice()),
            Tiles::Packed(tiles) => size_of_val(tiles.as_slice()),
        }
    }

    /// Stores the entries with 16 bits each.
    pub fn pack(&mut self) {
        if let Tiles::Full(tiles) = &self.tiles {
            let mut packed = Vec::with_capacity(tiles.len());
            vectorized(
                #[inline(always)]
                || packed.extend(tiles.iter().map(PackedTile::of)),
            );
            self.tiles = Tiles::Packed(packed);
        }
    }

    /// Solves with the triangle in `head`, and subtracts the products with the rows beyond from `tail`.
    /// Both contain `columns` columns of [`padded`] length, with zeros at the end.
    pub fn forward(&self, columns: usize, head: &mut [T], tail: &mut [T]) {
        match &self.tiles {
            Tiles::Full(tiles) => self.panels(tiles).forward(columns, head, tail),
            Tiles::Packed(tiles) => self.panels(tiles).forward(columns, head, tail),
        }
    }

    /// Solves with the transpose of the triangle in `head`, after subtracting the products of the
    /// transposed rows beyond with `tail`.
    pub fn backward(&self, columns: usize, head: &mut [T], tail: &[T]) {
        match &self.tiles {
            Tiles::Full(tiles) => self.panels(tiles).backward(columns, head, tail),
            Tiles::Packed(tiles) => self.panels(tiles).backward(columns, head, tail),
        }
    }

    fn panels<'a, K>(&self, tiles: &'a [K]) -> Panels<'a, K> {
        Panels { count: self.pivots.div_ceil(SIDE), beyond: self.beyond.div_ceil(SIDE), tiles }
    }
}

/// The tiles of a trapezoid.
#[derive(Clone, Copy)]
struct Panels<'a, K> {
    /// Number of panels.
    count: usize,
    /// Tiles of each in the rows beyond.
    beyond: usize,
    tiles: &'a [K],
}

impl<'a, K> Panels<'a, K> {
    /// Tiles of a panel, from the diagonal down.
    fn panel(&self, panel: usize) -> &'a [K] {
        let rows = self.count + self.beyond;
        let start = |panel: usize| panel * rows - panel * panel.saturating_sub(1) / 2;
        &self.tiles[start(panel)..start(panel + 1)]
    }

    /// Groups of panels that are solved by one thread.
    fn groups(&self) -> impl DoubleEndedIterator<Item = Range<usize>> + use<K> {
        let panels = self.count;
        let size = if self.tiles.len() < WORTH_SHARING { panels.max(1) } else { TOGETHER };
        (0..panels.div_ceil(size)).map(move |k| k * size..((k + 1) * size).min(panels))
    }

    fn forward<T: Scalar>(&self, columns: usize, head: &mut [T], tail: &mut [T])
    where
        K: Stored<T>,
    {
        let (mut head, mut tail) = (divide(head, columns), divide(tail, columns));
        for group in self.groups() {
            vectorized(
                #[inline(always)]
                || {
                    for p in group.clone() {
                        for x in &mut head {
                            self.eliminate(p, group.end, x);
                        }
                    }
                },
            );
            let (solved, mut rest): (Vec<&[T]>, Columns<'_, T>) = (head.iter_mut())
                .map(|x| {
                    let (solved, rest) = x.split_at_mut(SIDE * group.end);
                    (&solved[SIDE * group.start..], rest)
                })
                .unzip();
            self.subtract_products(&group, group.end, &solved, &mut rest);
            self.subtract_products(&group, self.count, &solved, &mut tail);
        }
    }

    fn backward<T: Scalar>(&self, columns: usize, head: &mut [T], tail: &[T])
    where
        K: Stored<T>,
    {
        let mut head = divide(head, columns);
        let tail: SmallVec<[&[T]; 1]> = match tail.len() / columns {
            0 => (0..columns).map(|_| [].as_slice()).collect(),
            length => tail.chunks_exact(length).collect(),
        };
        for group in self.groups().rev() {
            let outside = group.len() * (self.count - group.end + self.beyond);
            let split = self.tiles.len() >= WORTH_SHARING && outside >= WORTH_SPLITTING;
            if split {
                for (x, tail) in head.iter_mut().zip(&tail) {
                    let (own, below) = x.split_at_mut(SIDE * group.end);
                    let (below, tail) = (&*below, *tail);
                    own[SIDE * group.start..].par_chunks_exact_mut(SIDE).zip(group.clone()).for_each(|(own, p)| {
                        let panel = self.panel(p);
                        let (of_below, of_tail) = (&panel[group.end - p..], &panel[self.count - p..]);
                        pulp::Arch::new().dispatch(SubtractSums { own, terms: [(of_below, below), (of_tail, tail)] });
                    });
                }
            }
            pulp::Arch::new().dispatch(Backward { panels: *self, group, split, head: &mut head, tail: &tail });
        }
    }

    /// Solves with the diagonal tile of a panel, and subtracts the products from the rows above `end`.
    #[inline(always)]
    fn eliminate<T: Scalar>(&self, panel: usize, end: usize, x: &mut [T])
    where
        K: Stored<T>,
    {
        let (own, below) = x[SIDE * panel..SIDE * end].split_at_mut(SIDE);
        let tiles = self.panel(panel);
        let mut solved = [T::ZERO; SIDE];
        add_product(&tiles[0], first(own), &mut solved);
        own.copy_from_slice(&solved);
        let opposite = solved.map(|x| -x);
        for (tile, x) in tiles[1..].iter().zip(below.as_chunks_mut().0) {
            add_product(tile, &opposite, x);
        }
    }

    /// Subtracts the products of a group of panels, from row tile `first` on, with its `solved` rows.
    fn subtract_products<T: Scalar>(&self, group: &Range<usize>, first: usize, solved: &[&[T]], x: &mut [&mut [T]])
    where
        K: Stored<T>,
    {
        let tiles = x.first().map_or(0, |x| x.len() / SIDE);
        if tiles == 0 {
            return;
        }
        let some = |(block, mut x): (usize, Columns<'_, T>)| {
            let start = first + BLOCK * block;
            vectorized(
                #[inline(always)]
                || {
                    for (k, p) in group.clone().enumerate() {
                        for (solved, x) in solved.iter().zip(&mut x) {
                            let mut opposite = [T::ZERO; SIDE];
                            opposite.iter_mut().zip(&solved[SIDE * k..]).for_each(|(to, x)| *to = -*x);
                            for (tile, x) in self.panel(p)[start - p..].iter().zip(x.as_chunks_mut().0) {
                                add_product(tile, &opposite, x);
                            }
                        }
                    }
                },
            );
        };
        let mut blocks: Vec<Columns<'_, T>> = Vec::with_capacity(tiles.div_ceil(BLOCK));
        for column in x {
            for (number, block) in column.chunks_mut(SIDE * BLOCK).enumerate() {
                match blocks.get_mut(number) {
                    Some(columns) => columns.push(block),
                    None => blocks.push(std::iter::once(block).collect()),
                }
            }
        }
        if self.tiles.len() >= WORTH_SHARING && group.len() * tiles >= WORTH_SPLITTING {
            blocks.into_par_iter().enumerate().for_each(some);
        } else {
            blocks.into_iter().enumerate().for_each(some);
        }
    }
}

fn divide<T>(x: &mut [T], columns: usize) -> Columns<'_, T> {
    let length = x.len() / columns;
    match length {
        0 => (0..columns).map(|_| [].as_mut_slice()).collect(),
        _ => x.chunks_exact_mut(length).collect(),
    }
}

fn vectorized(run: impl FnOnce()) {
    pulp::Arch::new().dispatch(run);
}

/// The transposed solve with a group of panels.
struct Backward<'a, 'x, T, K> {
    panels: Panels<'a, K>,
    group: Range<usize>,
    /// Whether the products with the rows beyond the group have been subtracted.
    split: bool,
    head: &'a mut Columns<'x, T>,
    tail: &'a [&'x [T]],
}

impl<T: Scalar, K: Stored<T>> WithSimd for Backward<'_, '_, T, K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { panels, group, split, head, tail } = self;
        for p in group.clone().rev() {
            let panel = panels.panel(p);
            for (x, tail) in head.iter_mut().zip(tail) {
                let (own, below) = x[SIDE * p..].split_at_mut(SIDE);
                let terms = if split {
                    [(&panel[1..], &below[..SIDE * (group.end - p - 1)]), (&[][..], &[][..])]
                } else {
                    [(&panel[1..], &*below), (&panel[panels.count - p..], *tail)]
                };
                SubtractSums { own, terms }.with_simd(simd);
                let product = transposed_products(simd, [(&panel[..1], own), (&[], &[])]);
                own.copy_from_slice(&product);
            }
        }
    }
}

/// Subtracts the products of the transposed tiles of a panel with vectors.
struct SubtractSums<'a, T, K> {
    own: &'a mut [T],
    terms: [(&'a [K], &'a [T]); 2],
}

impl<T: Scalar, K: Stored<T>> WithSimd for SubtractSums<'_, T, K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let sums = transposed_products(simd, self.terms);
        self.own.iter_mut().zip(sums).for_each(|(x, sum)| *x -= sum);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the bounds: an entry is off by at most half a unit, 1/65534 of the largest of its tile, and by
    /// round-off; the errors of a solve with a well-conditioned matrix add up accordingly.
    #[test]
    fn packed_entries_are_off_by_half_a_unit() {
        let entry = |i: usize, j: usize| ((7 * i + 3 * j) as f32).sin() * 10f32.powi(i as i32 / 8 - j as i32 / 8);
        let tile = Tile::<f32>(std::array::from_fn(|j| std::array::from_fn(|i| entry(i, 8 * j))));
        let packed = PackedTile::of(&tile);
        let largest = tile.0.iter().flatten().fold(0.0, |m: f32, x| m.max(x.abs()));
        for (j, column) in tile.0.iter().enumerate() {
            for (x, stored) in column.iter().zip(packed.column(j)) {
                assert!((stored * packed.factor - x).abs() <= largest * (1.0 / 65534.0 + 1e-6));
            }
        }
        assert_eq!(PackedTile::of(&Tile([[0f32; SIDE]; SIDE])).entries, [[0; SIDE]; SIDE]);

        let (q, t) = (61, 130);
        let wave = |count: usize, pitch: f32| (0..count).map(|i| (i as f32 * pitch).sin()).collect::<Vec<f32>>();
        let value = |k: usize, x: f32| if k % q == k / q { 2.0 } else { x / q as f32 };
        let triangle: Vec<f32> = wave(q * q, 0.618).iter().enumerate().map(|(k, x)| value(k, *x)).collect();
        let below = wave(t * q, 0.37);
        let full = Trapezoid::of_lower(&triangle, &below, q);
        let mut packed = Trapezoid::of_lower(&triangle, &below, q);
        packed.pack();
        // a factor for each tile, which is aligned
        assert_eq!((packed.entries(), 64 * packed.bytes()), (full.entries(), 36 * full.bytes()));
        let solve = |factor: &Trapezoid<f32>| {
            let (mut head, mut tail) = (wave(padded(q), 0.73), wave(padded(t), 0.29));
            factor.forward(1, &mut head, &mut tail);
            factor.backward(1, &mut head, &tail);
            head[..q].to_vec()
        };
        let (exact, found) = (solve(&full), solve(&packed));
        let size = exact.iter().fold(0.0, |m: f32, x| m.max(x.abs()));
        let error = exact.iter().zip(&found).fold(0.0, |m: f32, (x, y)| m.max((x - y).abs()));
        // in both directions, each product of a row is off by half a unit of entries of at most one
        let bound = 2.0 * (q + t) as f32 / 65534.0;
        assert!(error < bound * size, "{error:e} of {size}");
        assert_ne!(exact, found);
    }

    /// Small and large trapezoids, with and without rows beyond, for one right-hand side and for three:
    /// multiplying the solutions by the matrices reproduces the right-hand sides.
    #[test]
    fn solves_invert_products() {
        for (q, t) in [(1, 0), (7, 3), (8, 8), (61, 130), (500, 0), (333, 709)] {
            assert!((entries(q, t) / SIDE / SIDE >= WORTH_SHARING) == (q > 300 && t > 0));
            let wave = |count: usize, pitch: f64| (0..count).map(|i| (i as f64 * pitch).sin()).collect::<Vec<f64>>();
            let triangle: Vec<f64> = wave(q * q, 0.618).iter().map(|x| x / q as f64).collect();
            let diagonal = |i: usize| 2.0 + triangle[i + i * q];
            let triangle: Vec<f64> =
                (0..q * q).map(|k| if k % q == k / q { diagonal(k / q) } else { triangle[k] }).collect();
            let below = wave(t * q, 0.37);
            let right: Vec<f64> = (0..q * t).map(|k| below[k / q + k % q * t]).collect();
            let transposed: Vec<f64> = (0..q * q).map(|k| triangle[k / q + k % q * q]).collect();
            let lower = |i: usize, j: usize| if i >= j { triangle[i + j * q] } else { 0.0 };
            let unit = |i: usize, j: usize| if i == j { 1.0 } else { lower(i, j) };
            type Entry<'a> = &'a dyn Fn(usize, usize) -> f64;
            let matrices: [(Trapezoid<f64>, Entry<'_>); 3] = [
                (Trapezoid::of_lower(&triangle, &below, q), &lower),
                (Trapezoid::of_unit_lower(&triangle, &below, q), &unit),
                (Trapezoid::of_upper(&transposed, &right, q), &lower),
            ];
            for ((trapezoid, entry), columns) in matrices.iter().flat_map(|m| [(m, 1), (m, 3)]) {
                assert_eq!(trapezoid.entries(), entries(q, t));
                let pad = |x: &[f64], length: usize| -> Vec<f64> {
                    let column =
                        |c: usize| x.iter().map(move |x| x * (c + 1) as f64).chain(vec![0.0; padded(length) - length]);
                    (0..columns).flat_map(column).collect()
                };
                let (b, c) = (wave(q, 0.73), wave(t, 0.29));
                let (mut head, mut tail) = (pad(&b, q), pad(&c, t));
                trapezoid.forward(columns, &mut head, &mut tail);
                for column in 0..columns {
                    let (x, y) = (&head[column * padded(q)..], &tail[column * padded(t)..]);
                    let factor = (column + 1) as f64;
                    for i in 0..q {
                        let product: f64 = (0..=i).map(|j| entry(i, j) * x[j]).sum();
                        assert!((product - factor * b[i]).abs() < 1e-11, "{q} × {t}, row {i}: {product} for {}", b[i]);
                    }
                    for i in 0..t {
                        let product: f64 = (0..q).map(|j| below[i + j * t] * x[j]).sum();
                        assert!((y[i] + product - factor * c[i]).abs() < 1e-11);
                    }
                }
                let (mut head, tail) = (pad(&b, q), pad(&c, t));
                trapezoid.backward(columns, &mut head, &tail);
                for column in 0..columns {
                    let (x, factor) = (&head[column * padded(q)..], (column + 1) as f64);
                    for j in 0..q {
                        let inside: f64 = (j..q).map(|i| entry(i, j) * x[i]).sum();
                        let outside: f64 = (0..t).map(|i| below[i + j * t] * factor * c[i]).sum();
                        assert!((inside + outside - factor * b[j]).abs() < 1e-10);
                    }
                }
            }
        }
    }
}
