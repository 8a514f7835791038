//! Transfer between unknowns and coarse unknowns.

use super::aggregates::{Aggregates, MODES};
use super::vertices::Vertices;
use crate::csr::CsrMatrix;
use rayon::prelude::*;

/// A sparse matrix with a row for every unknown, and [`MODES`] columns for every aggregate.
#[derive(Debug, Clone)]
pub(super) struct Transfer {
    offsets: Vec<usize>,
    aggregates: Vec<u32>,
    values: Vec<[f64; MODES]>,
}

/// The product of the rows or columns of a vertex with a transfer: the aggregates reached and,
/// unknown by unknown, one item per aggregate.
#[derive(Debug, Default)]
pub(super) struct Patch {
    pub reached: Vec<u32>,
    pub products: Vec<[f64; MODES]>,
}

impl Patch {
    /// The items of the unknown at position `k` of the vertex.
    pub fn row(&self, k: usize) -> &[[f64; MODES]] {
        let width = self.reached.len();
        &self.products[k * width..(k + 1) * width]
    }
}

/// Where the rows of each aggregate's column are in a [`Transfer`].
#[derive(Debug)]
pub(super) struct Supports {
    offsets: Vec<usize>,
    /// Unknown, and place among the blocks of the transfer.
    items: Vec<(u32, u32)>,
}

impl Supports {
    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        8 * (self.offsets.len() + self.items.len())
    }

    fn of(&self, aggregate: usize) -> &[(u32, u32)] {
        &self.items[self.offsets[aggregate]..self.offsets[aggregate + 1]]
    }
}

/// Rows of a transfer.
pub(super) trait Rows: Sync {
    /// Aggregates, and what an unknown moves with the motions of each.
    fn row(&self, i: usize) -> impl ExactSizeIterator<Item = (u32, &[f64; MODES])>;
}

impl Rows for Transfer {
    fn row(&self, i: usize) -> impl ExactSizeIterator<Item = (u32, &[f64; MODES])> {
        let range = self.offsets[i]..self.offsets[i + 1];
        self.aggregates[range.clone()].iter().copied().zip(&self.values[range])
    }
}

/// The matrix or its transpose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Rows,
    /// Columns of a matrix with a symmetric pattern.
    Columns,
}

/// Vertices that a thread treats at a time: the costs of their rows differ.
const CHUNK: usize = 256;

/// Marks an aggregate that the current vertex has not reached yet.
const UNSEEN: u32 = u32::MAX;

impl Transfer {
    /// Each unknown follows the rigid motions of its aggregate.
    pub fn tentative(aggregates: &Aggregates) -> Self {
        Self::of_rows(aggregates.motions.iter().map(|motion| motion.iter().copied()))
    }

    fn of_rows(rows: impl Iterator<Item = impl Iterator<Item = (u32, [f64; MODES])>>) -> Self {
        let mut transfer = Self { offsets: vec![0], aggregates: Vec::new(), values: Vec::new() };
        for row in rows {
            for (aggregate, motion) in row {
                transfer.aggregates.push(aggregate);
                transfer.values.push(motion);
            }
            transfer.offsets.push(transfer.aggregates.len());
        }
        transfer
    }

    /// The `selected` rows after one block-Jacobi step for A P = 0 at the vertices `which`:
    /// P ← P − ω E D⁻¹ E A P, where D contains the diagonal blocks of these vertices and E selects the
    /// `selected` rows; the other rows are empty. With [`Side::Columns`], A is the transpose of the matrix.
    /// Rows of a vertex whose block is singular do not change.
    pub fn relax(
        &self,
        a: &CsrMatrix,
        side: Side,
        vertices: &Vertices,
        aggregates: usize,
        which: &(impl Fn(usize) -> bool + Sync),
        selected: &(impl Fn(u32) -> bool + Sync),
        damping: f64,
    ) -> Self {
        let mut patches = products(self, a, side, vertices, aggregates, which, selected);
        patches.par_iter_mut().enumerate().for_each(|(v, slot)| {
            let Some(patch) = slot else { return };
            let members = vertices.members(v);
            let mut block = Vec::with_capacity(members.len() * members.len());
            for &i in members {
                block.extend(members.iter().map(|&j| match side {
                    Side::Rows => entry(a, i, j),
                    Side::Columns => entry(a, j, i),
                }));
            }
            let width = patch.reached.len();
            if !solve_dense(&mut block, &mut patch.products, width) {
                *slot = None;
                return;
            }
            for (k, &i) in members.iter().enumerate() {
                let factor = if selected(i) { -damping } else { 0.0 };
                let row = &mut patch.products[k * width..(k + 1) * width];
                row.iter_mut().flatten().for_each(|x| *x *= factor);
                for (aggregate, motion) in self.row(i as usize) {
                    let at =
                        patch.reached.iter().position(|&a| a == aggregate).expect("its own aggregates are reached");
                    (0..MODES).for_each(|m| row[at][m] += motion[m]);
                }
            }
        });
        let mut relaxed = Self { offsets: vec![0], aggregates: Vec::new(), values: Vec::new() };
        for i in 0..vertices.of.len() {
            let v = vertices.of[i] as usize;
            let mut add = |aggregate: u32, motion: &[f64; MODES]| {
                relaxed.aggregates.push(aggregate);
                relaxed.values.push(*motion);
            };
            match &patches[v] {
                _ if !selected(i as u32) => {}
                None => self.row(i).for_each(|(aggregate, motion)| add(aggregate, motion)),
                Some(patch) => {
                    let k = vertices.members(v).partition_point(|&j| (j as usize) < i);
                    patch.reached.iter().zip(patch.row(k)).for_each(|(&aggregate, motion)| add(aggregate, motion));
                }
            }
            relaxed.offsets.push(relaxed.aggregates.len());
        }
        relaxed
    }

    /// The transfer by aggregates.
    pub fn supports(&self, aggregates: usize) -> Supports {
        let mut offsets = vec![0; aggregates + 1];
        self.aggregates.iter().for_each(|&aggregate| offsets[aggregate as usize + 1] += 1);
        (0..aggregates).for_each(|k| offsets[k + 1] += offsets[k]);
        let mut next = offsets.clone();
        let mut items = vec![(0, 0); self.aggregates.len()];
        for i in 0..self.offsets.len() - 1 {
            for place in self.offsets[i]..self.offsets[i + 1] {
                let slot = &mut next[self.aggregates[place] as usize];
                items[*slot] = (i as u32, place as u32);
                *slot += 1;
            }
        }
        Supports { offsets, items }
    }

    /// The motions in the support of an aggregate: unknown and displacement in each motion, by
    /// ascending unknowns.
    pub fn of<'a>(&'a self, supports: &'a Supports, aggregate: usize) -> impl Iterator<Item = (u32, &'a [f64; MODES])> {
        supports.of(aggregate).iter().map(|&(i, place)| (i, &self.values[place as usize]))
    }

    /// The same without blocks of zeros.
    pub fn without_zeros(self) -> Self {
        let is_zero = |motion: &[f64; MODES]| motion.iter().all(|x| *x == 0.0);
        let rest = |i: usize| self.row(i).map(|(aggregate, motion)| (aggregate, *motion)).filter(|(_, m)| !is_zero(m));
        Self::of_rows((0..self.offsets.len() - 1).map(rest))
    }

    /// Number of stored blocks.
    pub fn blocks(&self) -> usize {
        self.aggregates.len()
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        8 * self.offsets.len() + (8 * MODES + 4) * self.blocks()
    }
}

/// A P, for `motions` P, in the `selected` rows of the vertices `which`; the other rows are zero.
pub(super) fn products(
    motions: &impl Rows,
    a: &CsrMatrix,
    side: Side,
    vertices: &Vertices,
    aggregates: usize,
    which: &(impl Fn(usize) -> bool + Sync),
    selected: &(impl Fn(u32) -> bool + Sync),
) -> Vec<Option<Patch>> {
    let patch = |slots: &mut Vec<u32>, v: usize| {
        let members = vertices.members(v);
        let mut reached: Vec<u32> = Vec::new();
        let mut reach = |j: u32| {
            for (aggregate, _) in motions.row(j as usize) {
                if slots[aggregate as usize] == UNSEEN {
                    slots[aggregate as usize] = reached.len() as u32;
                    reached.push(aggregate);
                }
            }
        };
        let mut rows = members.iter().filter(|&&i| selected(i)).map(|&i| a.pattern.row(i as usize));
        let first = rows.next().unwrap_or_default();
        first.iter().for_each(|&j| reach(j));
        rows.filter(|row| *row != first).flatten().for_each(|&j| reach(j));
        members.iter().for_each(|&j| reach(j));
        let width = reached.len();
        let mut products = vec![[0.0; MODES]; members.len() * width];
        let alike = |&i: &u32| selected(i) && a.pattern.row(i as usize) == first;
        if side == Side::Rows && members.iter().all(alike) {
            let values: Vec<&[f64]> = members.iter().map(|&i| a.row(i as usize).1).collect();
            for (at, &j) in first.iter().enumerate() {
                for (aggregate, motion) in motions.row(j as usize) {
                    let slot = slots[aggregate as usize] as usize;
                    for (sums, values) in products.chunks_exact_mut(width).zip(&values) {
                        let value = values[at];
                        sums[slot].iter_mut().zip(motion).for_each(|(sum, m)| *sum += value * m);
                    }
                }
            }
            reached.iter().for_each(|&aggregate| slots[aggregate as usize] = UNSEEN);
            return Patch { reached, products };
        }
        for (k, &i) in members.iter().enumerate().filter(|(_, i)| selected(**i)) {
            let row = &mut products[k * width..(k + 1) * width];
            let mut add = |j: u32, value: f64| {
                for (aggregate, motion) in motions.row(j as usize) {
                    let sum = &mut row[slots[aggregate as usize] as usize];
                    (0..MODES).for_each(|m| sum[m] += value * motion[m]);
                }
            };
            for (at, &j) in a.pattern.row_range(i as usize).zip(a.pattern.row(i as usize)) {
                let value = match side {
                    Side::Rows => a.values[at],
                    Side::Columns => entry(a, j, i),
                };
                if value != 0.0 {
                    add(j, value);
                }
            }
        }
        reached.iter().for_each(|&aggregate| slots[aggregate as usize] = UNSEEN);
        Patch { reached, products }
    };
    let chosen: Vec<usize> = (0..vertices.len()).filter(|&v| which(v)).collect();
    let found: Vec<Patch> = (chosen.par_iter().with_max_len(CHUNK))
        .map_init(|| vec![UNSEEN; aggregates], |slots, &v| patch(slots, v))
        .collect();
    let mut patches: Vec<Option<Patch>> = std::iter::repeat_with(|| None).take(vertices.len()).collect();
    chosen.into_iter().zip(found).for_each(|(v, patch)| patches[v] = Some(patch));
    patches
}

/// Entry (i, j) of a matrix; zero outside the pattern.
fn entry(a: &CsrMatrix, i: u32, j: u32) -> f64 {
    let (columns, values) = a.row(i as usize);
    columns.binary_search(&j).map_or(0.0, |k| values[k])
}

/// Largest pivot of a singular matrix, relative to the terms that cancel in it.
const ROUND_OFF: f64 = 1e-12;

/// Overwrites the right-hand sides, `width` items for each row, with the solutions of a small dense
/// system, by Gaussian elimination with partial pivoting; `false` if it is singular. A pivot counts as
/// zero if it is round-off compared with the sum of the absolute values of its terms, whatever the
/// units of rows and columns.
fn solve_dense(block: &mut [f64], rhs: &mut [[f64; MODES]], width: usize) -> bool {
    let n = block.len().isqrt();
    let mut terms: Vec<f64> = block.iter().map(|x| x.abs()).collect();
    let subtract = |rhs: &mut [[f64; MODES]], to: usize, factor: f64, from: usize| {
        for c in 0..width {
            let what = rhs[from * width + c];
            rhs[to * width + c].iter_mut().zip(what).for_each(|(x, y)| *x -= factor * y);
        }
    };
    for k in 0..n {
        let pivot = (k..n).fold(k, |best, i| if block[i * n + k].abs() > block[best * n + k].abs() { i } else { best });
        let size = block[pivot * n + k];
        // also if something is not finite
        if !(size.abs() > ROUND_OFF * terms[pivot * n + k] && size.is_finite()) {
            return false;
        }
        if pivot != k {
            (0..n).for_each(|j| block.swap(k * n + j, pivot * n + j));
            (0..n).for_each(|j| terms.swap(k * n + j, pivot * n + j));
            (0..width).for_each(|c| rhs.swap(k * width + c, pivot * width + c));
        }
        for i in k + 1..n {
            let factor = block[i * n + k] / size;
            if factor != 0.0 {
                (k..n).for_each(|j| block[i * n + j] -= factor * block[k * n + j]);
                (k..n).for_each(|j| terms[i * n + j] += factor.abs() * terms[k * n + j]);
                subtract(rhs, i, factor, k);
            }
        }
    }
    for k in (0..n).rev() {
        for j in k + 1..n {
            let factor = block[k * n + j];
            if factor != 0.0 {
                subtract(rhs, k, factor, j);
            }
        }
        let inverse = 1.0 / block[k * n + k];
        rhs[k * width..(k + 1) * width].iter_mut().flatten().for_each(|x| *x *= inverse);
    }
    rhs.iter().flatten().all(|x| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Source: a system with the solution (1, 2, −1), multiplied out by hand, whose first pivot is
    /// zero.
    #[test]
    fn small_systems_are_solved_with_pivoting() {
        let mut block = vec![0.0, 2.0, 1.0, 1.0, 1.0, 1.0, 4.0, -1.0, 0.0];
        let mut rhs: Vec<[f64; MODES]> = [3.0, 2.0, 2.0].iter().map(|b| [*b; MODES]).collect();
        assert!(solve_dense(&mut block, &mut rhs, 1));
        for (row, expected) in rhs.iter().zip([1.0, 2.0, -1.0]) {
            assert!(row.iter().all(|x| (x - expected).abs() < 1e-15));
        }
        assert!(!solve_dense(&mut [1.0, 1.0, 1.0, 1.0], &mut [[1.0; MODES], [1.0; MODES]], 1));
    }

    /// A node with d free displacements and three multipliers, [K B; Bᵀ 0]. By rank: singular for
    /// d = 2, as three conditions cannot be independent there, whatever round-off leaves; regular for
    /// d = 3, in any units.
    #[test]
    fn a_pivot_of_round_off_makes_a_block_singular() {
        let block = |d: usize, stiffness: f64| {
            let n = d + 3;
            let wave = |i: usize, j: usize| ((7 * i + 11 * j + 3 * i * j) as f64).sin();
            let entry = |i: usize, j: usize| match (i < d, j < d) {
                (true, true) => stiffness * (f64::from(u8::from(i == j)) * 3.0 + wave(i, j)),
                (true, false) => wave(i, j),
                (false, true) => wave(j, i),
                (false, false) => 0.0,
            };
            (0..n * n).map(|at| entry(at / n, at % n)).collect::<Vec<f64>>()
        };
        for stiffness in [1e-6, 1.0, 210e9] {
            assert!(!solve_dense(&mut block(2, stiffness), &mut [[1.0; MODES]; 5], 1), "{stiffness}");
            let (before, mut x) = (block(3, stiffness), [[1.0; MODES]; 6]);
            assert!(solve_dense(&mut before.clone(), &mut x, 1), "{stiffness}");
            for row in before.chunks_exact(6) {
                let terms: Vec<f64> = row.iter().zip(&x).map(|(a, x)| a * x[0]).collect();
                let size = terms.iter().fold(1.0, |size, term| size + term.abs());
                assert!((terms.iter().sum::<f64>() - 1.0).abs() < 1e-12 * size, "{stiffness}");
            }
        }
    }
}
