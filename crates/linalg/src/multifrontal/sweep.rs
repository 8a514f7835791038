//! Substitution for one or several right-hand sides with several threads.
//!
//! Subtrees of the assembly tree are independent of each other. The fronts of a small one are solved
//! by a single thread, with the entries of a vector over all unknowns; those above pass on what their
//! subtrees add to the unknowns beyond. Sums have a fixed order, and the division into subtrees
//! depends only on the matrix. Each front is read once for all right-hand sides, and each of these is
//! solved as it would be alone, bit for bit.
//!
//! Right-hand sides are interleaved, so that the entries of an unknown lie together; in the fronts,
//! they are the columns of a matrix.

use super::Numeric;
use super::front::Front;
use super::scalar::Scalar;
use super::symbolic::{Structure, Supernode};
use super::trapezoid::{Trapezoid, padded};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Mutex;

/// Number of factor entries below which a single thread does all the work.
const WORTH_SHARING: usize = 500_000;

/// A subtree with less than this fraction of all entries is small.
const SHARES: usize = 24;

/// Division of the fronts.
#[derive(Debug)]
pub(super) struct Plan {
    /// Whether the subtree below and with a front is small.
    small: Vec<bool>,
    /// Start of each front's pivots in the order of elimination, [`padded`], then their total length.
    starts: Vec<usize>,
}

impl Plan {
    pub fn new<T: Scalar>(structure: &Structure, fronts: &[Front<T>]) -> Self {
        let mut starts = vec![0];
        let mut entries: Vec<usize> = fronts.iter().map(Front::entries).collect();
        for (k, front) in fronts.iter().enumerate() {
            starts.push(starts[k] + padded(front.pivot_rows.len()));
            if let Some(parent) = structure.supernodes[k].parent {
                entries[parent] += entries[k];
            }
        }
        let total: usize = structure.roots.iter().map(|&root| entries[root]).sum();
        let bound = if total < WORTH_SHARING { total } else { total / SHARES };
        Self { small: entries.iter().map(|entries| *entries <= bound).collect(), starts }
    }
}

impl<T: Scalar> Numeric<T> {
    /// Solves in place, in the permuted numbering, for interleaved right-hand sides.
    pub(super) fn sweep(&self, transpose: bool, columns: usize, x: &mut [T]) {
        let sweep = Sweep { factors: self, transpose, columns, whole: Mutex::default() };
        let mut y = vec![T::ZERO; columns * self.plan.starts[self.fronts.len()]];
        sweep.forward(&self.structure.roots, x, &mut y);
        let nothing = vec![Vec::new(); self.structure.roots.len()];
        sweep.backward(&self.structure.roots, x, &mut y, nothing);
    }
}

/// A substitution.
struct Sweep<'a, T> {
    factors: &'a Numeric<T>,
    transpose: bool,
    /// Number of right-hand sides.
    columns: usize,
    /// Free vectors over all unknowns, for small subtrees.
    whole: Mutex<Vec<Vec<T>>>,
}

/// The unknowns of a front's pivots, the delayed ones beyond them, and the factor to solve with.
type Reading<'a, T> = (&'a [u32], &'a [u32], &'a Trapezoid<T>);

impl<T: Scalar> Sweep<'_, T> {
    /// y ← L⁻¹ x (transposed: U⁻ᵀ x) in subtrees that are adjacent: x their unknowns, y front by front
    /// in the order of elimination. Returns what each adds to the unknowns beyond.
    fn forward(&self, subtrees: &[usize], x: &mut [T], y: &mut [T]) -> Vec<Vec<T>> {
        let parts = self.divide(subtrees, x, y);
        parts.into_par_iter().map(|(k, x, y)| self.forward_subtree(k, x, y)).collect()
    }

    fn forward_subtree(&self, k: usize, x: &mut [T], y: &mut [T]) -> Vec<T> {
        let (supernode, columns) = (self.supernode(k), self.columns);
        let start = self.unknowns(k).start;
        if self.factors.plan.small[k] {
            return self.with_whole(|whole| {
                let own = self.of(self.unknowns(k));
                whole[own.clone()].copy_from_slice(x);
                let (first, mut update) = (self.first_pivot(k), Vec::new());
                for front in supernode.first_descendant..k + 1 {
                    let y = &mut y[self.of(within(self.pivots(front), first))];
                    self.forward_front(front, whole, 0, y, &mut update);
                    let (_, delayed, factor) = self.forward_reading(front);
                    let beyond = delayed.iter().chain(&self.supernode(front).rows);
                    match_places(beyond, 0, columns, padded(factor.beyond()), |i, at| whole[i] += update[at]);
                }
                x.copy_from_slice(&whole[own]);
                let mut passed_on = Vec::with_capacity(columns * supernode.rows.len());
                for &i in &supernode.rows {
                    let at = &mut whole[columns * i as usize..columns * (i as usize + 1)];
                    passed_on.extend_from_slice(at);
                    at.fill(T::ZERO);
                }
                passed_on
            });
        }
        let (below, own) = y.split_at_mut(columns * (self.pivots(k).start - self.first_pivot(k)));
        let updates = self.forward(&supernode.children, &mut x[..columns * (supernode.first - start)], below);
        let mut passed_on = vec![T::ZERO; columns * supernode.rows.len()];
        for (&child, update) in supernode.children.iter().zip(updates) {
            let places = self.places(child, k);
            for (place, update) in places.zip(update.chunks_exact(columns)) {
                let to = match place {
                    Place::Inside(i) => &mut x[columns * i..columns * (i + 1)],
                    Place::Beyond(i) => &mut passed_on[columns * i..columns * (i + 1)],
                };
                to.iter_mut().zip(update).for_each(|(to, update)| *to += *update);
            }
        }
        let mut update = Vec::new();
        self.forward_front(k, x, start, own, &mut update);
        let (_, delayed, factor) = self.forward_reading(k);
        let rows = padded(factor.beyond());
        match_places(delayed.iter(), start, columns, rows, |i, at| x[i] += update[at]);
        for (i, to) in passed_on.chunks_exact_mut(columns).enumerate() {
            to.iter_mut().enumerate().for_each(|(j, to)| *to += update[j * rows + delayed.len() + i]);
        }
        passed_on
    }

    /// x ← U⁻¹ y (transposed: L⁻ᵀ y) in adjacent subtrees, with the unknowns beyond each.
    fn backward(&self, subtrees: &[usize], x: &mut [T], y: &mut [T], above: Vec<Vec<T>>) {
        let parts = self.divide(subtrees, x, y);
        let all = parts.into_par_iter().zip(above);
        all.for_each(|((k, x, y), above)| self.backward_subtree(k, x, y, &above));
    }

    fn backward_subtree(&self, k: usize, x: &mut [T], y: &mut [T], above: &[T]) {
        let (supernode, columns) = (self.supernode(k), self.columns);
        let start = self.unknowns(k).start;
        let mut known = Vec::new();
        if self.factors.plan.small[k] {
            self.with_whole(|whole| {
                let own = self.of(self.unknowns(k));
                whole[own.clone()].copy_from_slice(x);
                for (&i, above) in supernode.rows.iter().zip(above.chunks_exact(columns)) {
                    whole[columns * i as usize..columns * (i as usize + 1)].copy_from_slice(above);
                }
                let first = self.first_pivot(k);
                for front in (supernode.first_descendant..k + 1).rev() {
                    let (pivots, delayed, factor) = self.backward_reading(front);
                    let y = &mut y[self.of(within(self.pivots(front), first))];
                    let rows = padded(factor.beyond());
                    clear(&mut known, rows * columns);
                    let beyond = delayed.iter().chain(&self.supernode(front).rows);
                    match_places(beyond, 0, columns, rows, |i, at| known[at] = whole[i]);
                    factor.backward(columns, y, &known);
                    match_places(pivots.iter(), 0, columns, padded(pivots.len()), |i, at| whole[i] = y[at]);
                }
                x.copy_from_slice(&whole[own]);
            });
            return;
        }
        let (below, own) = y.split_at_mut(columns * (self.pivots(k).start - self.first_pivot(k)));
        let (pivots, delayed, factor) = self.backward_reading(k);
        let rows = padded(factor.beyond());
        clear(&mut known, rows * columns);
        match_places(delayed.iter(), start, columns, rows, |i, at| known[at] = x[i]);
        for (i, above) in above.chunks_exact(columns).enumerate() {
            above.iter().enumerate().for_each(|(j, above)| known[j * rows + delayed.len() + i] = *above);
        }
        factor.backward(columns, own, &known);
        match_places(pivots.iter(), start, columns, padded(pivots.len()), |i, at| x[i] = own[at]);
        let beyond = |child: &usize| -> Vec<T> {
            let of = |place| match place {
                Place::Inside(i) => &x[columns * i..columns * (i + 1)],
                Place::Beyond(i) => &above[columns * i..columns * (i + 1)],
            };
            self.places(*child, k).flat_map(of).copied().collect()
        };
        let beyond = supernode.children.iter().map(beyond).collect();
        self.backward(&supernode.children, &mut x[..columns * (supernode.first - start)], below, beyond);
    }

    /// Solves with the triangle of a front; `update` receives what it adds beyond.
    fn forward_front(&self, k: usize, x: &[T], start: usize, y: &mut [T], update: &mut Vec<T>) {
        let (pivots, _, factor) = self.forward_reading(k);
        match_places(pivots.iter(), start, self.columns, padded(pivots.len()), |i, at| y[at] = x[i]);
        clear(update, padded(factor.beyond()) * self.columns);
        factor.forward(self.columns, y, update);
    }

    /// A front for the solve with L (transposed: with Uᵀ).
    fn forward_reading(&self, k: usize) -> Reading<'_, T> {
        self.reading(k, self.transpose)
    }

    /// A front for the solve with U (transposed: with Lᵀ).
    fn backward_reading(&self, k: usize) -> Reading<'_, T> {
        self.reading(k, !self.transpose)
    }

    fn reading(&self, k: usize, upper: bool) -> Reading<'_, T> {
        let front = &self.factors.fronts[k];
        if upper {
            (&front.pivot_columns, &front.delayed_columns, front.upper.as_ref().unwrap_or(&front.lower))
        } else {
            (&front.pivot_rows, &front.delayed_rows, &front.lower)
        }
    }

    fn supernode(&self, k: usize) -> &Supernode {
        &self.factors.structure.supernodes[k]
    }

    /// The unknowns of a subtree.
    fn unknowns(&self, k: usize) -> Range<usize> {
        let last = self.supernode(k);
        self.supernode(last.first_descendant).first..last.first + last.pivots
    }

    /// The places of a front's pivots in the order of elimination.
    fn pivots(&self, k: usize) -> Range<usize> {
        self.factors.plan.starts[k]..self.factors.plan.starts[k + 1]
    }

    /// The place of the first pivot of a subtree.
    fn first_pivot(&self, k: usize) -> usize {
        self.factors.plan.starts[self.supernode(k).first_descendant]
    }

    /// The entries of a range of unknowns.
    fn of(&self, range: Range<usize>) -> Range<usize> {
        self.columns * range.start..self.columns * range.end
    }

    /// Unknowns and pivots of adjacent subtrees.
    fn divide<'x>(
        &self,
        subtrees: &[usize],
        mut x: &'x mut [T],
        mut y: &'x mut [T],
    ) -> Vec<(usize, &'x mut [T], &'x mut [T])> {
        let part = |&k: &usize| {
            let (unknowns, pivots) = (self.unknowns(k).len(), self.pivots(k).end - self.first_pivot(k));
            let own = x.split_off_mut(..self.columns * unknowns).expect("the unknowns of all subtrees");
            (k, own, y.split_off_mut(..self.columns * pivots).expect("the pivots of all subtrees"))
        };
        subtrees.iter().map(part).collect()
    }

    /// Where the unknowns beyond a child lie: all belong to its parent or are beyond it as well.
    fn places(&self, child: usize, parent: usize) -> impl Iterator<Item = Place> {
        let (unknowns, beyond) = (self.unknowns(parent), &self.supernode(parent).rows);
        let mut at = 0;
        self.supernode(child).rows.iter().map(move |&row| {
            if (row as usize) < unknowns.end {
                return Place::Inside(row as usize - unknowns.start);
            }
            at += beyond[at..].iter().position(|&other| other == row).expect("rows of a child are rows of its parent");
            Place::Beyond(at)
        })
    }

    /// Runs a task with a vector over all unknowns. It is zero outside the small subtrees as long as all
    /// tasks leave it so.
    fn with_whole<R>(&self, task: impl FnOnce(&mut [T]) -> R) -> R {
        let free = || self.whole.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let taken = free().pop();
        let mut whole = taken.unwrap_or_else(|| vec![T::ZERO; self.columns * self.factors.structure.n]);
        let result = task(&mut whole);
        free().push(whole);
        result
    }
}

/// The place of an unknown beyond a subtree, as the parent sees it.
enum Place {
    /// Among the unknowns of the parent's subtree.
    Inside(usize),
    /// Among those beyond it.
    Beyond(usize),
}

fn within(range: Range<usize>, start: usize) -> Range<usize> {
    range.start - start..range.end - start
}

fn clear<T: Scalar>(x: &mut Vec<T>, length: usize) {
    x.clear();
    x.resize(length, T::ZERO);
}

/// Calls `each` with the places of every entry of some unknowns: in interleaved vectors that start at
/// unknown `start`, and in columns of length `rows`.
#[inline(always)]
fn match_places<'a>(
    unknowns: impl Iterator<Item = &'a u32>,
    start: usize,
    columns: usize,
    rows: usize,
    mut each: impl FnMut(usize, usize),
) {
    for (row, &unknown) in unknowns.enumerate() {
        let first = columns * (unknown as usize - start);
        (0..columns).for_each(|j| each(first + j, j * rows + row));
    }
}
