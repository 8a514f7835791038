//! Substitution for one or several right-hand sides with several threads.
//!
//! Small subtrees of the assembly tree are independent tasks. Their results for the fronts above
//! are added in a fixed order; in these fronts the threads share the products. The choice of tasks
//! depends only on the matrix. Each front is read once for all right-hand sides, and each of these
//! is solved as it would be alone, bit for bit.
//!
//! Right-hand sides are interleaved, so that the entries of an unknown lie together; in the fronts,
//! they are the columns of a matrix.

use super::Numeric;
use super::front::Front;
use super::scalar::Scalar;
use super::symbolic::Structure;
use super::trapezoid::{Trapezoid, padded};
use rayon::prelude::*;
use std::ops::Range;

/// Number of factor entries below which a single thread does all the work.
const WORTH_SHARING: usize = 500_000;

/// A subtree with less than this fraction of all entries is a task.
const SHARES: usize = 24;

/// Division of the fronts into tasks.
#[derive(Debug)]
pub(super) struct Plan {
    tasks: Vec<Task>,
    /// Fronts above the tasks, in postorder.
    top: Vec<usize>,
    /// Start of each front's pivots in the order of elimination, [`padded`], then their total length.
    starts: Vec<usize>,
}

/// A subtree.
#[derive(Debug)]
struct Task {
    fronts: Range<usize>,
    /// Its unknowns in the permuted numbering.
    unknowns: Range<usize>,
    /// Its pivots in the order of elimination, without delayed ones.
    pivots: Range<usize>,
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
        let bound = if total < WORTH_SHARING { 0 } else { total / SHARES };
        let is_small = |k: usize| entries[k] <= bound;
        let is_task = |k: &usize| is_small(*k) && structure.supernodes[*k].parent.is_none_or(|p| !is_small(p));
        let task = |k: usize| {
            let (last, first) = (&structure.supernodes[k], structure.supernodes[k].first_descendant);
            Task {
                fronts: first..k + 1,
                unknowns: structure.supernodes[first].first..last.first + last.pivots,
                pivots: starts[first]..starts[k + 1],
            }
        };
        let tasks = (0..fronts.len()).filter(is_task).map(task).collect();
        let top = (0..fronts.len()).filter(|&k| !is_small(k)).collect();
        Self { tasks, top, starts }
    }

    fn pivots(&self, k: usize) -> Range<usize> {
        self.starts[k]..self.starts[k + 1]
    }
}

/// The unknowns that a task uses: its own from `first` on, and a copy of those beyond.
struct View<'a, T> {
    first: usize,
    /// Number of right-hand sides.
    columns: usize,
    own: &'a mut [T],
    beyond: &'a mut [T],
}

impl<T: Scalar> View<'_, T> {
    /// The entries of an unknown, one for each right-hand side.
    fn at(&mut self, unknown: usize) -> &mut [T] {
        let i = (unknown - self.first) * self.columns;
        let past = self.own.len();
        if i < past { &mut self.own[i..i + self.columns] } else { &mut self.beyond[i - past..i - past + self.columns] }
    }

    /// The entries of some unknowns, as columns of length `rows`.
    fn gather(&mut self, unknowns: impl Iterator<Item = usize>, rows: usize, to: &mut [T]) {
        for (i, unknown) in unknowns.enumerate() {
            for (j, x) in self.at(unknown).iter().enumerate() {
                to[j * rows + i] = *x;
            }
        }
    }
}

impl<T: Scalar> Numeric<T> {
    /// Solves in place, in the permuted numbering, for interleaved right-hand sides.
    pub(super) fn sweep(&self, transpose: bool, columns: usize, x: &mut [T]) {
        let length = columns * self.plan.starts[self.fronts.len()];
        let mut y = vec![T::ZERO; length];
        self.forward(transpose, columns, x, &mut y);
        self.backward(transpose, columns, x, &mut y);
    }

    /// y ← L⁻¹ x (transposed: U⁻ᵀ x), y front by front in the order of elimination.
    fn forward(&self, transpose: bool, columns: usize, x: &mut [T], y: &mut [T]) {
        let tasks = &self.plan.tasks;
        let size = x.len();
        let own = disjoint(x, tasks.iter().map(|t| of(columns, t.unknowns.clone())));
        let stages = disjoint(y, tasks.iter().map(|t| of(columns, t.pivots.clone())));
        // every task leaves zeros in the buffer
        let updates: Vec<Vec<T>> = (tasks, own, stages)
            .into_par_iter()
            .map_init(
                || vec![T::ZERO; size],
                |buffer, (task, own, y)| {
                    let beyond = &mut buffer[columns * task.unknowns.end..];
                    let mut view = View { first: task.unknowns.start, columns, own, beyond };
                    let mut update = Vec::new();
                    for k in task.fronts.clone() {
                        let w = &mut y[of(columns, within(self.plan.pivots(k), task.pivots.start))];
                        self.forward_front(transpose, k, &mut view, w, &mut update);
                    }
                    let mut passed_on = Vec::with_capacity(columns * self.passed_on(task).count());
                    for i in self.passed_on(task) {
                        passed_on.extend_from_slice(view.at(i));
                        view.at(i).fill(T::ZERO);
                    }
                    passed_on
                },
            )
            .collect();
        let mut view = View { first: 0, columns, own: x, beyond: &mut [] };
        for (task, update) in tasks.iter().zip(updates) {
            for (i, update) in self.passed_on(task).zip(update.chunks_exact(columns)) {
                view.at(i).iter_mut().zip(update).for_each(|(x, u)| *x += *u);
            }
        }
        let mut update = Vec::new();
        for &k in &self.plan.top {
            self.forward_front(transpose, k, &mut view, &mut y[of(columns, self.plan.pivots(k))], &mut update);
        }
    }

    /// x ← U⁻¹ y (transposed: L⁻ᵀ y).
    fn backward(&self, transpose: bool, columns: usize, x: &mut [T], y: &mut [T]) {
        let size = x.len();
        let mut view = View { first: 0, columns, own: x, beyond: &mut [] };
        let mut known = Vec::new();
        for &k in self.plan.top.iter().rev() {
            self.backward_front(transpose, k, &mut view, &mut y[of(columns, self.plan.pivots(k))], &mut known);
        }
        let tasks = &self.plan.tasks;
        let from_above = |t: &Task| self.passed_on(t).flat_map(|i| view.at(i).to_vec()).collect::<Vec<T>>();
        let from_above: Vec<Vec<T>> = tasks.iter().map(from_above).collect();
        let own = disjoint(x, tasks.iter().map(|t| of(columns, t.unknowns.clone())));
        let stages = disjoint(y, tasks.iter().map(|t| of(columns, t.pivots.clone())));
        let buffer = || vec![T::ZERO; size];
        (tasks, own, stages, from_above).into_par_iter().for_each_init(buffer, |buffer, (task, own, y, from_above)| {
            let beyond = &mut buffer[columns * task.unknowns.end..];
            let mut view = View { first: task.unknowns.start, columns, own, beyond };
            for (i, values) in self.passed_on(task).zip(from_above.chunks_exact(columns)) {
                view.at(i).copy_from_slice(values);
            }
            let mut known = Vec::new();
            for k in task.fronts.clone().rev() {
                let w = &mut y[of(columns, within(self.plan.pivots(k), task.pivots.start))];
                self.backward_front(transpose, k, &mut view, w, &mut known);
            }
        });
    }

    /// Unknowns beyond a task that its fronts couple to: those of its last front.
    fn passed_on(&self, task: &Task) -> impl Iterator<Item = usize> + '_ {
        self.structure.supernodes[task.fronts.end - 1].rows.iter().map(|&i| i as usize)
    }

    /// Rows (forward) and columns (backward) of a front beyond its pivots.
    fn beyond<'a>(&'a self, k: usize, delayed: &'a [u32]) -> impl Iterator<Item = usize> + 'a {
        delayed.iter().chain(&self.structure.supernodes[k].rows).map(|&i| i as usize)
    }

    fn forward_front(&self, transpose: bool, k: usize, x: &mut View<'_, T>, w: &mut [T], update: &mut Vec<T>) {
        let front = &self.fronts[k];
        let (pivots, delayed, factor) = if transpose {
            (&front.pivot_columns, &front.delayed_columns, front.upper.as_ref().unwrap_or(&front.lower))
        } else {
            (&front.pivot_rows, &front.delayed_rows, &front.lower)
        };
        x.gather(pivots.iter().map(|&i| i as usize), padded(pivots.len()), w);
        let rows = padded(factor.beyond());
        update.clear();
        update.resize(rows * x.columns, T::ZERO);
        factor.forward(x.columns, w, update);
        for (i, unknown) in self.beyond(k, delayed).enumerate() {
            for (j, x) in x.at(unknown).iter_mut().enumerate() {
                *x += update[j * rows + i];
            }
        }
    }

    fn backward_front(&self, transpose: bool, k: usize, x: &mut View<'_, T>, w: &mut [T], known: &mut Vec<T>) {
        let front = &self.fronts[k];
        let (pivots, delayed, factor): (_, _, &Trapezoid<T>) = if transpose {
            (&front.pivot_rows, &front.delayed_rows, &front.lower)
        } else {
            (&front.pivot_columns, &front.delayed_columns, front.upper.as_ref().unwrap_or(&front.lower))
        };
        let (q, rows) = (padded(pivots.len()), padded(factor.beyond()));
        known.clear();
        known.resize(rows * x.columns, T::ZERO);
        x.gather(self.beyond(k, delayed), rows, known);
        factor.backward(x.columns, w, known);
        for (i, &unknown) in pivots.iter().enumerate() {
            for (j, x) in x.at(unknown as usize).iter_mut().enumerate() {
                *x = w[j * q + i];
            }
        }
    }
}

/// The entries of a range of unknowns, with several for each.
fn of(columns: usize, range: Range<usize>) -> Range<usize> {
    columns * range.start..columns * range.end
}

fn within(range: Range<usize>, start: usize) -> Range<usize> {
    range.start - start..range.end - start
}

/// Parts of a slice; the ranges ascend and do not overlap.
fn disjoint<T>(mut rest: &mut [T], ranges: impl Iterator<Item = Range<usize>>) -> Vec<&mut [T]> {
    let mut at = 0;
    let mut parts = Vec::new();
    for range in ranges {
        let (_, tail) = std::mem::take(&mut rest).split_at_mut(range.start - at);
        let (part, tail) = tail.split_at_mut(range.len());
        parts.push(part);
        (rest, at) = (tail, range.end);
    }
    parts
}
