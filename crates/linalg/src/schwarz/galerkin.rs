//! The Galerkin product Rᵀ A P. The part of it that is far from changes of the matrix is kept.

use super::aggregates::MODES;
use super::motions::{Displacements, Motions};
use super::transfer::{Side, products};
use super::vertices::Vertices;
use crate::csr::{CsrMatrix, CsrPattern};
use crate::multifrontal::MultifrontalSolver;
use crate::solver::{FactorizationError, LinearSolver, Precision};
use crate::symbolic::Symbolic;
use rayon::prelude::*;
use std::sync::Arc;

/// Aggregates that a thread treats at a time: the rows of most have no part in a product near changes.
const CHUNK: usize = 16;

/// What the coarse matrices of similar matrices share.
#[derive(Debug)]
pub(super) struct Kept {
    /// Which vertices are near changes; the rows of the others are added up in `far`.
    near: Vec<bool>,
    far: Vec<f64>,
    pub symbolic: Symbolic,
}

/// A coarse matrix.
pub(super) struct Galerkin {
    pub matrix: CsrMatrix,
    pub kept: Kept,
    /// Fraction of the vertices whose rows have been multiplied.
    pub treated: f64,
}

/// A row of the product: aggregates reached, and a block for each.
type Row = (Vec<u32>, Vec<[[f64; MODES]; MODES]>);

impl Galerkin {
    /// Rᵀ A P for the motions \[R, P\]. The rows of all vertices with multipliers around them must be
    /// `near`. If these are the vertices of `kept`, which belongs to an earlier matrix with the same
    /// pattern and displacements, only their rows are multiplied, unless multipliers now reach more
    /// aggregates.
    ///
    /// # Errors
    /// If the coarse matrix cannot be analysed.
    pub fn new(
        a: &CsrMatrix,
        vertices: &Vertices,
        displacements: &Displacements,
        motions: [&Motions; 2],
        kept: Option<Kept>,
        near: &[bool],
    ) -> Result<Self, FactorizationError> {
        let aggregates = displacements.aggregates();
        let starts = &displacements.starts;
        let close = rows(a, vertices, motions, aggregates, &|v| near[v]);
        let share = near.iter().filter(|near| **near).count() as f64 / near.len().max(1) as f64;
        let serves = |kept: &Kept| kept.near == near && contains(kept.symbolic.pattern(), starts, &close);
        if let Some(kept) = kept.filter(serves) {
            let mut values = kept.far.clone();
            add(&mut values, kept.symbolic.pattern(), starts, &close);
            let matrix = CsrMatrix { pattern: kept.symbolic.pattern().clone(), values };
            return Ok(Self { matrix, kept, treated: share });
        }
        let others = rows(a, vertices, motions, aggregates, &|v| !near[v]);
        let pattern = Arc::new(pattern(starts, &close, &others));
        let symbolic = MultifrontalSolver::new(Precision::F32).analyse(&pattern)?;
        let mut far = vec![0.0; pattern.entries()];
        add(&mut far, &pattern, starts, &others);
        let mut values = far.clone();
        add(&mut values, &pattern, starts, &close);
        let matrix = CsrMatrix { pattern, values };
        Ok(Self { matrix, kept: Kept { near: near.to_vec(), far, symbolic }, treated: 1.0 })
    }
}

/// The sum of Rᵀ A P over the rows of the vertices `which`.
fn rows(
    a: &CsrMatrix,
    vertices: &Vertices,
    [weights, motions]: [&Motions; 2],
    aggregates: usize,
    which: &(impl Fn(usize) -> bool + Sync),
) -> Vec<Row> {
    let patches = products(motions, a, Side::Rows, vertices, aggregates, which, &|_| true);
    let row = |slots: &mut Vec<u32>, index: usize| -> Row {
        let (mut reached, mut blocks): Row = Default::default();
        // of the aggregates that the patch of the last vertex reaches
        let (mut last, mut places) = (usize::MAX, Vec::new());
        for (i, weight) in weights.of(index) {
            let v = vertices.of[i as usize] as usize;
            let Some(patch) = &patches[v] else { continue };
            let k = vertices.members(v).partition_point(|&j| j < i);
            if v != last {
                last = v;
                places.clear();
                places.extend(patch.reached.iter().map(|&aggregate| {
                    let slot = &mut slots[aggregate as usize];
                    if *slot == u32::MAX {
                        *slot = reached.len() as u32;
                        reached.push(aggregate);
                        blocks.push([[0.0; MODES]; MODES]);
                    }
                    *slot as usize
                }));
            }
            for (&place, product) in places.iter().zip(patch.row(k)) {
                let block = &mut blocks[place];
                for r in 0..MODES {
                    (0..MODES).for_each(|c| block[r][c] += weight[r] * product[c]);
                }
            }
        }
        reached.iter().for_each(|&aggregate| slots[aggregate as usize] = u32::MAX);
        (reached, blocks)
    };
    (0..aggregates).into_par_iter().with_max_len(CHUNK).map_init(|| vec![u32::MAX; aggregates], row).collect()
}

/// The pattern of the sum of two products.
fn pattern(starts: &[usize], one: &[Row], other: &[Row]) -> CsrPattern {
    let (mut offsets, mut columns, mut groups) = (vec![0], Vec::new(), Vec::new());
    for (index, ((one, _), (other, _))) in one.iter().zip(other).enumerate() {
        let mut reached: Vec<usize> = one.iter().chain(other).map(|&aggregate| aggregate as usize).collect();
        reached.sort_unstable();
        reached.dedup();
        for _ in starts[index]..starts[index + 1] {
            columns.extend(reached.iter().flat_map(|&k| starts[k]..starts[k + 1]).map(|column| column as u32));
            offsets.push(columns.len());
            groups.push(index as u32);
        }
    }
    CsrPattern::new(offsets, columns, groups, Vec::new()).expect("columns ascend")
}

/// Whether the pattern of a coarse matrix contains a product.
fn contains(pattern: &CsrPattern, starts: &[usize], rows: &[Row]) -> bool {
    rows.iter().enumerate().all(|(index, (reached, _))| {
        let columns = pattern.row(starts[index]);
        reached.iter().all(|&aggregate| columns.binary_search(&(starts[aggregate as usize] as u32)).is_ok())
    })
}

/// Adds a product to the entries of a pattern that contains its own.
fn add(values: &mut [f64], pattern: &CsrPattern, starts: &[usize], rows: &[Row]) {
    for (index, (reached, blocks)) in rows.iter().enumerate() {
        for (&aggregate, block) in reached.iter().zip(blocks) {
            let (first, end) = (starts[aggregate as usize], starts[aggregate as usize + 1]);
            for (row, block) in (starts[index]..starts[index + 1]).zip(block) {
                let place = pattern.row(row).partition_point(|&column| (column as usize) < first);
                let place = pattern.row_range(row).start + place;
                values[place..place + end - first].iter_mut().zip(block).for_each(|(sum, x)| *sum += x);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Nodes;
    use super::*;

    /// A bar of 4 × 4 × 24 nodes with three unknowns each, some of them with a multiplier. Aggregates
    /// have at most 48 nodes.
    fn bar(multipliers: &[usize]) -> (CsrMatrix, Nodes) {
        let [nx, ny, nz] = [4, 4, 24];
        let count = nx * ny * nz;
        let place = |node: usize| [node % nx, node / nx % ny, node / (nx * ny)];
        let next = |a: usize, b: usize| place(a).iter().zip(place(b)).all(|(a, b)| a.abs_diff(b) <= 1);
        let entry = |i: usize, j: usize| match (i < 3 * count, j < 3 * count) {
            (true, true) => next(i / 3, j / 3),
            (true, false) => next(i / 3, multipliers[j - 3 * count]),
            (false, true) => next(multipliers[i - 3 * count], j / 3),
            (false, false) => false,
        };
        let n = 3 * count + multipliers.len();
        let (mut offsets, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
        for i in 0..n {
            let row = (0..n).filter(|&j| entry(i, j)).map(|j| j as u32);
            columns.extend(row);
            values.extend(columns[offsets[i]..].iter().map(|&j| {
                let size = if i == j as usize { 60.0 } else { 1.0 };
                size * (1.5 + ((i * 37 + j as usize * 91) as f64).sin())
            }));
            offsets.push(columns.len());
        }
        let groups = (0..n).map(|i| if i < 3 * count { i / 3 } else { multipliers[i - 3 * count] } as u32);
        let origins = (0..n).map(|i| if i < 3 * count { i } else { 3 * (i - 2 * count) } as u32).collect();
        let pattern = CsrPattern::new(offsets, columns, groups.collect(), origins).unwrap();
        let coordinates: Vec<[f64; 3]> = (0..count).map(|node| place(node).map(|i| i as f64)).collect();
        let nodes = Nodes { bodies: vec![Some(0); count].into(), coordinates: coordinates.into() };
        (CsrMatrix { pattern: Arc::new(pattern), values }, nodes)
    }

    /// By definition, dᵀ (Rᵀ A P) c = (R d)ᵀ A (P c) for all coarse vectors.
    fn check(a: &CsrMatrix, [weights, motions]: [&Motions; 2], product: &Galerkin, aggregates: usize) {
        let wave =
            |k: f64| (0..aggregates).map(|i| [0, 1, 2, 3, 4, 5].map(|m| (k * (6 * i + m) as f64).sin())).collect();
        let (c, d): (Vec<[f64; MODES]>, Vec<[f64; MODES]>) = (wave(0.7), wave(1.3));
        let (mut u, mut v, mut force) = (vec![0.0; a.n()], vec![0.0; a.n()], vec![0.0; a.n()]);
        motions.prolong(&c, &mut u);
        weights.prolong(&d, &mut v);
        a.mul(&u, &mut force);
        let expected: f64 = v.iter().zip(&force).map(|(v, f)| v * f).sum();
        let mut coarse = vec![0.0; 6 * aggregates];
        product.matrix.mul(c.as_flattened(), &mut coarse);
        let found: f64 = d.as_flattened().iter().zip(&coarse).map(|(d, f)| d * f).sum();
        assert!((found - expected).abs() < 1e-12 * expected.abs(), "{found} instead of {expected}");
    }

    /// The products of two matrices with the same displacements. The change is applied to the values of
    /// the first.
    fn products(
        (a, nodes): &mut (CsrMatrix, Nodes),
        near: &[bool],
        change: impl Fn(&mut CsrMatrix),
    ) -> [(f64, usize); 2] {
        let vertices = Vertices::new(&a.pattern);
        let displacements = Arc::new(Displacements::new(a, &vertices, nodes));
        let aggregates = displacements.aggregates();
        assert!(aggregates > 2 && displacements.starts[aggregates] == 6 * aggregates);
        let mut kept = None;
        [false, true].map(|changed| {
            if changed {
                change(a);
            }
            let step = |side| Motions::new(a, side, &vertices, nodes, &displacements);
            let (motions, weights) = (step(Side::Rows), step(Side::Columns));
            let product = Galerkin::new(a, &vertices, &displacements, [&weights, &motions], kept.take(), near).unwrap();
            check(a, [&weights, &motions], &product, aggregates);
            let found = (product.treated, product.matrix.pattern.entries());
            kept = Some(product.kept);
            found
        })
    }

    /// The second matrix differs from the first in the rows near the multipliers; its product multiplies
    /// only these rows.
    #[test]
    fn the_part_far_from_changes_is_kept() {
        let mut bar = bar(&[383, 381, 371]);
        let near: Vec<bool> = bar.1.coordinates.iter().map(|x| x[2] > 20.5).collect();
        let [first, second] = products(&mut bar, &near, |a| {
            for i in (0..a.n()).filter(|&i| near[a.pattern.groups()[i] as usize]) {
                a.values[a.pattern.row_range(i)].iter_mut().enumerate().for_each(|(k, x)| *x += (k as f64).cos());
            }
        });
        assert_eq!((first.0, second), (1.0, (48.0 / 384.0, first.1)));
    }

    /// By definition: the largest entry of the coarse unknown's column of P.
    #[test]
    fn a_coarse_unknown_is_named_after_the_unknown_that_it_moves_most() {
        let (a, nodes) = bar(&[]);
        let vertices = Vertices::new(&a.pattern);
        let displacements = Arc::new(Displacements::new(&a, &vertices, &nodes));
        let motions = Motions::new(&a, Side::Rows, &vertices, &nodes, &displacements);
        for coarse in 0..6 * displacements.aggregates() {
            let (mut blocks, mut u) = (vec![[0.0; MODES]; displacements.aggregates()], vec![0.0; a.n()]);
            blocks[coarse / 6][coarse % 6] = 1.0;
            motions.prolong(&blocks, &mut u);
            let largest = u.iter().fold(0.0, |largest: f64, u| largest.max(u.abs()));
            assert_eq!(u[displacements.most_moved_by(coarse)].abs(), largest, "{coarse}");
        }
    }

    /// In the first matrix, conditions do not depend on their own nodes, so that no motion has multipliers.
    /// In the second, they do: motions reach more aggregates, and the kept pattern does not suffice.
    #[test]
    fn motions_with_new_multipliers_extend_the_pattern() {
        let slaves: Vec<usize> = (0..24).map(|z| 16 * z).collect();
        let mut bar = bar(&slaves);
        let near: Vec<bool> = bar.1.coordinates.iter().map(|x| x[0] < 1.5).collect();
        let whole = bar.0.values.clone();
        let a = &mut bar.0;
        for i in 3 * 384..a.n() {
            let group = a.pattern.groups()[i];
            let own =
                a.pattern.row_range(i).zip(a.pattern.row(i)).filter(|(_, j)| a.pattern.groups()[**j as usize] == group);
            own.map(|(k, _)| k).collect::<Vec<_>>().into_iter().for_each(|k| a.values[k] = 0.0);
        }
        let [first, second] = products(&mut bar, &near, |a| a.values.clone_from(&whole));
        assert!((first.0, second.0) == (1.0, 1.0) && second.1 > first.1, "{first:?} {second:?}");
    }
}
