//! Factors of a matrix that reuse those of an earlier one.
//!
//! Newton's method changes a tangent mostly near the contact: elsewhere, entries move by less than
//! GMRES needs to notice. Fronts whose entries, and those of all fronts below, have changed by no more
//! than a tolerance since they were factorized are kept with the contributions that others still need.
//! The factors are then exactly those of a matrix that differs from the given one by at most the
//! tolerance in each scaled entry (twice the tolerance where an entry has left the pattern), and serve
//! as its preconditioner.

use super::Analysis;
use super::front::{Contribution, Front};
use super::scalar::Scalar;
use super::symbolic::{Entry, Places, Structure, Supernode};
use crate::csr::CsrPattern;
use std::sync::Arc;

/// No such front.
const NONE: usize = usize::MAX;

/// A front with its contribution, if it is kept.
pub(super) type Done<T> = (Front<T>, Option<Contribution<T>>);

/// The latest factors, and what later ones may use of them.
#[derive(Debug)]
pub(super) struct Earlier<T> {
    pub structure: Arc<Structure>,
    pub places: Arc<Places>,
    /// The entries of the matrix whose factors these are.
    pub values: Vec<T>,
    pub fronts: Vec<Front<T>>,
    pub contributions: Vec<Option<Contribution<T>>>,
}

/// Which fronts need not be computed again.
pub(super) struct Kept<T> {
    /// Whether later factors may use these.
    remembers: bool,
    /// Whether a front had other unknowns before.
    is_new: Vec<bool>,
    fronts: Vec<Option<Done<T>>>,
}

impl<T: Scalar> Kept<T> {
    /// Nothing is kept, now or for later.
    pub fn nothing(structure: &Structure, remembers: bool) -> Self {
        let count = structure.supernodes.len();
        Self { remembers, is_new: vec![true; count], fronts: (0..count).map(|_| None).collect() }
    }

    /// What remains of `earlier` factors; replaces the `values` of kept fronts by those that they were
    /// computed from.
    pub fn of(
        earlier: Earlier<T>,
        Analysis { structure, places, .. }: &Analysis,
        pattern: &CsrPattern,
        values: &mut Vec<T>,
        tolerance: f64,
    ) -> Self {
        let mut kept = Self::nothing(structure, true);
        let supernodes = &structure.supernodes;
        let (old, same) = (earlier.partners(structure), Arc::ptr_eq(&earlier.structure, structure));
        kept.is_new = old.iter().map(|&old| old == NONE).collect();
        let mut changed = match same {
            true => earlier.changed_fronts(pattern, values, tolerance),
            false => kept.is_new.clone(),
        };
        for k in 0..supernodes.len() {
            let differs = || !same && !earlier.is_close(old[k], structure, places.of(k), k, values, tolerance);
            changed[k] = changed[k] || differs();
            if let Some(parent) = supernodes[k].parent.filter(|_| changed[k]) {
                changed[parent] = true;
            }
        }
        for k in (0..supernodes.len()).rev() {
            let needed = supernodes[k].parent.is_some_and(|parent| changed[parent]);
            changed[k] = changed[k] || needed && earlier.contributions[old[k]].is_none();
        }
        let position = super::tree::inverse(&structure.permutation);
        let renumber = |list: &mut Vec<u32>| {
            list.iter_mut().for_each(|i| *i = position[earlier.structure.permutation[*i as usize] as usize]);
        };
        for k in (0..supernodes.len()).filter(|&k| !changed[k]) {
            let (mut front, mut contribution) = (earlier.fronts[old[k]].clone(), earlier.contributions[old[k]].clone());
            if !same {
                front.unknowns_mut().into_iter().for_each(renumber);
                front.smallest_pivot = front
                    .smallest_pivot
                    .map(|(size, at)| (size, position[earlier.structure.permutation[at as usize] as usize]));
                if let Some(contribution) = &mut contribution {
                    renumber(&mut contribution.delayed_rows);
                    renumber(&mut contribution.delayed_columns);
                }
                earlier.restore(old[k], structure, places.of(k), k, values);
            }
            kept.fronts[k] = Some((front, contribution));
        }
        if same {
            // few fronts have changed
            let mut restored = earlier.values;
            for entry in (0..supernodes.len()).filter(|&k| changed[k]).flat_map(|k| places.of(k)) {
                restored[entry.source as usize] = values[entry.source as usize];
            }
            *values = restored;
        }
        kept
    }

    pub fn has(&self, k: usize) -> bool {
        self.fronts[k].is_some()
    }

    /// Whether a front has been kept.
    pub fn any(&self) -> bool {
        self.fronts.iter().any(Option::is_some)
    }

    /// Whether a front is computed although its unknowns are the same as before.
    pub fn changed(&self, k: usize) -> bool {
        !self.is_new[k] && !self.has(k)
    }

    pub fn front(&self, k: usize) -> Done<T> {
        self.fronts[k].clone().expect("kept")
    }

    pub fn keeps_contribution(&self, structure: &Structure, k: usize) -> bool {
        self.remembers && structure.keeps_contribution(k)
    }
}

impl<T: Scalar> Earlier<T> {
    /// For each front, the one with the same unknowns.
    fn partners(&self, structure: &Arc<Structure>) -> Vec<usize> {
        let count = structure.supernodes.len();
        if Arc::ptr_eq(&self.structure, structure) {
            return (0..count).collect();
        }
        if self.structure.n != structure.n {
            return vec![NONE; count];
        }
        let mut of_first = vec![NONE; structure.n];
        for (k, supernode) in self.structure.supernodes.iter().enumerate() {
            of_first[self.structure.permutation[supernode.first] as usize] = k;
        }
        let same = |k: usize, old: usize| {
            let (now, before) = (&structure.supernodes[k], &self.structure.supernodes[old]);
            now.pivots == before.pivots
                && now.rows.len() == before.rows.len()
                && structure.unknowns(now).eq(self.structure.unknowns(before))
        };
        let mut partners: Vec<usize> = Vec::with_capacity(count);
        for (k, supernode) in structure.supernodes.iter().enumerate() {
            let old = of_first[structure.permutation[supernode.first] as usize];
            let children = || supernode.children.iter().map(|&child| partners[child]);
            let found =
                old != NONE && same(k, old) && children().eq(self.structure.supernodes[old].children.iter().copied());
            partners.push(if found { old } else { NONE });
        }
        partners
    }

    /// The fronts with an entry that has changed by more than the tolerance, if the pattern is the same.
    fn changed_fronts(&self, pattern: &CsrPattern, values: &[T], tolerance: f64) -> Vec<bool> {
        let position = super::tree::inverse(&self.structure.permutation);
        let mut owner = vec![0u32; self.structure.n];
        for (k, supernode) in self.structure.supernodes.iter().enumerate() {
            owner[supernode.first..supernode.first + supernode.pivots].fill(k as u32);
        }
        let mut changed = vec![false; self.structure.supernodes.len()];
        for i in 0..pattern.n() {
            for k in pattern.row_range(i) {
                // written so that NaN counts as a change
                if !((values[k] - self.values[k]).absolute().to_f64() <= tolerance) {
                    let first = position[i].min(position[pattern.columns()[k] as usize]);
                    changed[owner[first as usize] as usize] = true;
                }
            }
        }
        changed
    }

    fn is_close(
        &self,
        old: usize,
        structure: &Arc<Structure>,
        entries: &[Entry],
        k: usize,
        values: &[T],
        tolerance: f64,
    ) -> bool {
        let close = |a: T, b: T| (a - b).absolute().to_f64() <= tolerance;
        let mut all = true;
        self.merge(old, structure, entries, k, |now, before| {
            let value = |values: &[T], at: Option<u32>| at.map_or(T::ZERO, |at| values[at as usize]);
            all = all && close(value(values, now), value(&self.values, before));
        });
        all
    }

    fn restore(&self, old: usize, structure: &Arc<Structure>, entries: &[Entry], k: usize, values: &mut [T]) {
        self.merge(old, structure, entries, k, |now, before| {
            if let Some(now) = now {
                values[now as usize] = before.map_or(T::ZERO, |before| self.values[before as usize]);
            }
        });
    }

    /// Calls `each` with the places of each entry of a front in the new and in the old matrix.
    fn merge(
        &self,
        old: usize,
        structure: &Structure,
        entries: &[Entry],
        k: usize,
        mut each: impl FnMut(Option<u32>, Option<u32>),
    ) {
        // both lists ascend by the original row, then by the original column
        let key = |structure: &Structure, supernode: &Supernode, entry: &Entry| {
            [entry.row, entry.column].map(|at| structure.unknown(supernode, at as usize))
        };
        let (now, before) = (&structure.supernodes[k], &self.structure.supernodes[old]);
        let mut rest = self.places.of(old).iter().peekable();
        for entry in entries {
            let at = key(structure, now, entry);
            while let Some(other) = rest.next_if(|other| key(&self.structure, before, other) < at) {
                each(None, Some(other.source));
            }
            let found = rest.next_if(|other| key(&self.structure, before, other) == at);
            each(Some(entry.source), found.map(|other| other.source));
        }
        rest.for_each(|other| each(None, Some(other.source)));
    }
}
