//! The elimination tree for other solvers.

use super::symbolic::{Ordering, Structure};
use crate::csr::CsrPattern;
use std::ops::Range;
use std::sync::Arc;

/// An elimination order with low fill-in, and the tree of its supernodes, for LU factors of other
/// libraries. A multiplier follows its node, so that its pivot is not zero.
#[derive(Debug)]
pub struct EliminationTree {
    structure: Structure,
    ordering: Arc<Ordering>,
}

impl EliminationTree {
    /// The tree for `pattern`. The order is that of an `earlier` tree of the same unknowns, if that
    /// costs little more than for its own pattern.
    ///
    /// # Errors
    /// The reason, if the pattern is too large.
    pub fn new(pattern: &CsrPattern, earlier: Option<&Self>) -> Result<Self, String> {
        let known = earlier.map(|tree| &tree.ordering);
        let (structure, ordering) = Structure::without_entries(pattern, known, false)?;
        Ok(Self { structure, ordering })
    }

    /// Whether `pattern` has the unknowns of this tree, by their elimination groups.
    pub fn has_unknowns_of(&self, pattern: &CsrPattern) -> bool {
        self.ordering.has_unknowns_of(pattern)
    }

    /// The unknowns in the order of their elimination.
    pub fn order(&self) -> &[u32] {
        &self.structure.permutation
    }

    /// The places of each supernode's unknowns in the order, and its parent, which follows it.
    /// Unknowns of a supernode are coupled only to each other, to those of its descendants and to
    /// those of its ancestors.
    pub fn supernodes(&self) -> impl Iterator<Item = (Range<usize>, Option<usize>)> {
        self.structure.supernodes.iter().map(|s| (s.first..s.first + s.pivots, s.parent))
    }

    /// Entries of L and U, and floating-point operations.
    pub fn size(&self) -> (f64, f64) {
        self.structure.size()
    }
}
