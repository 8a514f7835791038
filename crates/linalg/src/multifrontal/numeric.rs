//! Factorization of the fronts along the tree.

use super::buffers::Buffers;
use super::front::{self, Contribution};
use super::partial::{Done, Kept};
use super::scalar::Scalar;
use super::symbolic::{Places, Structure};
use crate::solver::FactorizationError;
use rayon::prelude::*;

/// Subtrees with fewer operations are not split among threads.
const SMALL_SUBTREE: f64 = 2e7;

/// Fronts of a subtree in postorder, and the contribution of its root; none if nobody needs it.
type Subtree<T> = (Vec<Done<T>>, Option<Contribution<T>>);

/// Factorizes the matrix whose (scaled) entries are `values`. Fronts are returned in postorder, packed
/// or not, with the contributions that are kept. `threshold` is the smallest accepted ratio of a pivot to its column. Subtrees that are `kept`
/// are not computed again.
pub(super) fn factorize<T: Scalar>(
    structure: &Structure,
    places: &Places,
    values: &[T],
    kept: &Kept<T>,
    (packed, threshold): (bool, f64),
) -> Result<Vec<Done<T>>, FactorizationError> {
    let walk = Walk { structure, places, values, kept, packed, threshold, buffers: Buffers::new() };
    let trees = walk.subtrees(&structure.roots)?;
    Ok(trees.into_iter().flat_map(|(fronts, _)| fronts).collect())
}

struct Walk<'a, T> {
    structure: &'a Structure,
    places: &'a Places,
    values: &'a [T],
    kept: &'a Kept<T>,
    packed: bool,
    threshold: f64,
    buffers: Buffers<T>,
}

impl<T: Scalar> Walk<'_, T> {
    /// Subtrees in parallel; if there are several errors, the first in order is reported.
    fn subtrees(&self, roots: &[usize]) -> Result<Vec<Subtree<T>>, FactorizationError> {
        let results: Vec<_> = roots.par_iter().map(|&root| self.subtree(root)).collect();
        results.into_iter().collect()
    }

    fn subtree(&self, root: usize) -> Result<Subtree<T>, FactorizationError> {
        let supernode = &self.structure.supernodes[root];
        let mut fronts = Vec::with_capacity(root + 1 - supernode.first_descendant);
        let mut pending: Vec<Contribution<T>> = Vec::new();
        if self.kept.has(root) {
            fronts.extend((supernode.first_descendant..=root).map(|k| self.kept.front(k)));
            let contribution = fronts.last().and_then(|(_, contribution)| contribution.clone());
            return Ok((fronts, contribution));
        }
        if supernode.subtree_operations >= SMALL_SUBTREE && !supernode.children.is_empty() {
            for (below, contribution) in self.subtrees(&supernode.children)? {
                fronts.extend(below);
                pending.extend(contribution);
            }
        } else {
            for k in supernode.first_descendant..root {
                if self.kept.has(k) {
                    let (front, contribution) = self.kept.front(k);
                    if self.structure.supernodes[k].parent.is_some_and(|parent| !self.kept.has(parent)) {
                        pending.extend(contribution.clone());
                    }
                    fronts.push((front, contribution));
                    continue;
                }
                let children = self.structure.supernodes[k].children.len();
                let own = pending.split_off(pending.len() - children);
                pending.push(self.process(k, own, &mut fronts)?);
            }
        }
        let contribution = self.process(root, pending, &mut fronts)?;
        Ok((fronts, Some(contribution)))
    }

    fn process(
        &self,
        k: usize,
        children: Vec<Contribution<T>>,
        fronts: &mut Vec<Done<T>>,
    ) -> Result<Contribution<T>, FactorizationError> {
        let (mut front, contribution, best_rejected) =
            front::process((self.structure, self.places), self.values, k, children, &self.buffers, self.threshold);
        if self.structure.supernodes[k].parent.is_none()
            && let Some(&column) = front.delayed_columns.first()
        {
            let unknown = self.structure.permutation[column as usize] as usize;
            return Err(FactorizationError::Singular { unknown, pivot: best_rejected });
        }
        if self.packed {
            front.pack();
        }
        let keep = self.kept.keeps_contribution(self.structure, k);
        fronts.push((front, keep.then(|| contribution.clone())));
        Ok(contribution)
    }
}
