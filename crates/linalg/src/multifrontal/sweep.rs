//! Substitution for one right-hand side with several threads.
//!
//! Small subtrees of the assembly tree are independent tasks. Their results for the fronts above
//! are added in a fixed order; in these fronts the threads share the products. The choice of tasks
//! depends only on the matrix.

use super::Numeric;
use super::front::Front;
use super::kernels;
use super::scalar::Scalar;
use super::symbolic::Structure;
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
    /// First pivot of each front in the order of elimination, then their total number.
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
            starts.push(starts[k] + front.pivot_rows.len());
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
    own: &'a mut [T],
    beyond: Vec<T>,
}

impl<T: Scalar> View<'_, T> {
    fn at(&mut self, unknown: usize) -> &mut T {
        let i = unknown - self.first;
        let past = self.own.len();
        if i < past { &mut self.own[i] } else { &mut self.beyond[i - past] }
    }
}

impl<T: Scalar> Numeric<T> {
    /// Solves in place, in the permuted numbering.
    pub(super) fn sweep(&self, transpose: bool, x: &mut [T]) {
        let mut y = vec![T::ZERO; x.len()];
        self.forward(transpose, x, &mut y);
        self.backward(transpose, x, &mut y);
    }

    /// y ← L⁻¹ x (transposed: U⁻ᵀ x), y in the order of elimination.
    fn forward(&self, transpose: bool, x: &mut [T], y: &mut [T]) {
        let n = x.len();
        let tasks = &self.plan.tasks;
        let own = disjoint(x, tasks.iter().map(|t| t.unknowns.clone()));
        let stages = disjoint(y, tasks.iter().map(|t| t.pivots.clone()));
        let updates: Vec<Vec<T>> = (tasks, own, stages)
            .into_par_iter()
            .map(|(task, own, y)| {
                let beyond = vec![T::ZERO; n - task.unknowns.end];
                let mut view = View { first: task.unknowns.start, own, beyond };
                let mut update = Vec::new();
                for k in task.fronts.clone() {
                    let pivots = self.plan.pivots(k);
                    let w = &mut y[pivots.start - task.pivots.start..pivots.end - task.pivots.start];
                    self.forward_front(transpose, k, &mut view, w, &mut update);
                }
                self.passed_on(task).map(|i| view.beyond[i - task.unknowns.end]).collect()
            })
            .collect();
        for (task, update) in tasks.iter().zip(updates) {
            self.passed_on(task).zip(update).for_each(|(i, u)| x[i] += u);
        }
        let mut view = View { first: 0, own: x, beyond: Vec::new() };
        let mut update = Vec::new();
        for &k in &self.plan.top {
            self.forward_front(transpose, k, &mut view, &mut y[self.plan.pivots(k)], &mut update);
        }
    }

    /// x ← U⁻¹ y (transposed: L⁻ᵀ y).
    fn backward(&self, transpose: bool, x: &mut [T], y: &mut [T]) {
        let n = x.len();
        let mut view = View { first: 0, own: x, beyond: Vec::new() };
        let mut known = Vec::new();
        for &k in self.plan.top.iter().rev() {
            self.backward_front(transpose, k, &mut view, &mut y[self.plan.pivots(k)], &mut known);
        }
        let tasks = &self.plan.tasks;
        let from_above: Vec<Vec<T>> = tasks.iter().map(|t| self.passed_on(t).map(|i| x[i]).collect()).collect();
        let own = disjoint(x, tasks.iter().map(|t| t.unknowns.clone()));
        let stages = disjoint(y, tasks.iter().map(|t| t.pivots.clone()));
        (tasks, own, stages, from_above).into_par_iter().for_each(|(task, own, y, from_above)| {
            let mut beyond = vec![T::ZERO; n - task.unknowns.end];
            self.passed_on(task).zip(from_above).for_each(|(i, value)| beyond[i - task.unknowns.end] = value);
            let mut view = View { first: task.unknowns.start, own, beyond };
            let mut known = Vec::new();
            for k in task.fronts.clone().rev() {
                let pivots = self.plan.pivots(k);
                let w = &mut y[pivots.start - task.pivots.start..pivots.end - task.pivots.start];
                self.backward_front(transpose, k, &mut view, w, &mut known);
            }
        });
    }

    /// Unknowns beyond a task that its fronts couple to: those of its last front.
    fn passed_on(&self, task: &Task) -> impl Iterator<Item = usize> + '_ {
        self.structure.supernodes[task.fronts.end - 1].rows.iter().map(|&i| i as usize)
    }

    fn forward_front(&self, transpose: bool, k: usize, x: &mut View<'_, T>, w: &mut [T], update: &mut Vec<T>) {
        let front = &self.fronts[k];
        let (pivots, delayed) = if transpose {
            (&front.pivot_columns, &front.delayed_columns)
        } else {
            (&front.pivot_rows, &front.delayed_rows)
        };
        w.iter_mut().zip(pivots).for_each(|(w, &i)| *w = *x.at(i as usize));
        update.clear();
        update.resize(delayed.len() + self.structure.supernodes[k].rows.len(), T::ZERO);
        if transpose {
            kernels::solve_upper_transposed(&front.lu, w);
            kernels::subtract_transposed_product(&front.upper, w, update);
        } else {
            kernels::solve_unit_lower(&front.lu, w);
            kernels::subtract_product(&front.lower, w, update);
        }
        for (i, u) in self.beyond(k, delayed).zip(update) {
            *x.at(i) += *u;
        }
    }

    fn backward_front(&self, transpose: bool, k: usize, x: &mut View<'_, T>, w: &mut [T], known: &mut Vec<T>) {
        let front = &self.fronts[k];
        let (pivots, delayed) = if transpose {
            (&front.pivot_rows, &front.delayed_rows)
        } else {
            (&front.pivot_columns, &front.delayed_columns)
        };
        known.clear();
        known.extend(self.beyond(k, delayed).map(|i| *x.at(i)));
        if transpose {
            kernels::subtract_transposed_product(&front.lower, known, w);
            kernels::solve_unit_lower_transposed(&front.lu, w);
        } else {
            kernels::subtract_product(&front.upper, known, w);
            kernels::solve_upper(&front.lu, w);
        }
        for (&i, w) in pivots.iter().zip(w) {
            *x.at(i as usize) = *w;
        }
    }
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
