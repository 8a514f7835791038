//! Factorization of the fronts along the tree.

use super::buffers::Buffers;
use super::front::{self, Contribution, Front};
use super::scalar::Scalar;
use super::symbolic::{Places, Structure};
use crate::solver::FactorizationError;
use rayon::prelude::*;

/// Subtrees with fewer operations are not split among threads.
const SMALL_SUBTREE: f64 = 2e7;

/// Fronts of a subtree in postorder, and the contribution of its root.
type Subtree<T> = (Vec<Front<T>>, Contribution<T>);

/// Factorizes the matrix whose (scaled) entries are `values`. Fronts are returned in postorder, packed
/// or not. `threshold` is the smallest accepted ratio of a pivot to its column.
pub(super) fn factorize<T: Scalar>(
    structure: &Structure,
    places: &Places,
    values: &[T],
    (packed, threshold): (bool, f64),
) -> Result<Vec<Front<T>>, FactorizationError> {
    let walk = Walk { structure, places, values, packed, threshold, buffers: Buffers::new() };
    let trees = walk.subtrees(&structure.roots)?;
    Ok(trees.into_iter().flat_map(|(fronts, _)| fronts).collect())
}

struct Walk<'a, T> {
    structure: &'a Structure,
    places: &'a Places,
    values: &'a [T],
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
        if supernode.subtree_operations >= SMALL_SUBTREE && !supernode.children.is_empty() {
            for (below, contribution) in self.subtrees(&supernode.children)? {
                fronts.extend(below);
                pending.push(contribution);
            }
        } else {
            for k in supernode.first_descendant..root {
                let children = self.structure.supernodes[k].children.len();
                let own = pending.split_off(pending.len() - children);
                pending.push(self.process(k, own, &mut fronts)?);
            }
        }
        let contribution = self.process(root, pending, &mut fronts)?;
        Ok((fronts, contribution))
    }

    fn process(
        &self,
        k: usize,
        children: Vec<Contribution<T>>,
        fronts: &mut Vec<Front<T>>,
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
        fronts.push(front);
        Ok(contribution)
    }
}
