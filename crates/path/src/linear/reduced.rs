//! The part of a system that is solved: free unknowns, and on several ranks each rank's own.

use crate::failure::{StateError, StepFailureKind};
use slipstick_linalg::{CsrMatrix, FactorizationError, Layout, PatternId, Ranks, Reduction, Summed};
use slipstick_status::ContactStatus;
use std::sync::Arc;

/// What systems with one pattern and the same prescribed unknowns have in common.
pub(super) struct Cached {
    pub(super) pattern: PatternId,
    pub(super) fixed: Vec<bool>,
    pub(super) reduction: Arc<Reduction>,
    pub(super) multipliers: Arc<[bool]>,
    pub(super) layout: Arc<Layout>,
}

/// The free part of a tangent, or of its transpose, with the map back to all unknowns.
pub(crate) struct Reduced<'a> {
    pub(super) matrix: CsrMatrix,
    pub(super) transposed: bool,
    /// Which unknowns are prescribed.
    pub(super) fixed: &'a [bool],
    /// Status of the contact nodes.
    pub(super) active_set: &'a [ContactStatus],
    pub(super) reduction: Arc<Reduction>,
    /// Which block rows belong to multipliers.
    pub(super) multipliers: Arc<[bool]>,
    /// Which of the free unknowns belong to this rank.
    pub(super) layout: Arc<Layout>,
}

/// The term added to the diagonal of the multipliers' rows, whose entries are of order 1, if
/// contact conditions repeat each other or a prescribed displacement.
const REGULARISATION: f64 = 1e-7;

impl Reduced<'_> {
    /// The matrix with a small term on the diagonal of the multipliers' rows. It preconditions a
    /// matrix that is singular because some contact conditions follow from others, for instance if
    /// more slave nodes stick than master nodes can move against prescribed displacements. The
    /// solutions of such a system differ by multipliers without a force, and iterations with these
    /// factors find the solution with the smallest of them.
    pub(super) fn regularised(&self) -> CsrMatrix {
        let mut matrix = self.matrix.clone();
        for unknown in 0..matrix.n() {
            if self.multipliers[self.reduction.origin(unknown).0] {
                let start = matrix.pattern.row_range(unknown).start;
                let place = matrix.row(unknown).0.iter().position(|&column| column as usize == unknown);
                if let Some(place) = place {
                    matrix.values[start + place] += REGULARISATION;
                }
            }
        }
        matrix
    }

    /// A failure with the number of the unknown among all unknowns.
    pub(super) fn failure(&self, error: FactorizationError) -> StepFailureKind {
        match error {
            FactorizationError::Singular { unknown, pivot } => {
                let (row, component) = self.reduction.origin(unknown);
                StepFailureKind::Singular { unknown: 3 * row + component, pivot }
            }
            FactorizationError::NonFinite { row, .. } => {
                let (row, component) = self.reduction.origin(row);
                StateError::NotFinite { quantity: "the tangent".into(), index: 3 * row + component }.into()
            }
            error => StepFailureKind::Linear(error.to_string()),
        }
    }

    /// The matrix as the sum of the ranks' parts.
    pub(super) fn on<'a>(&'a self, ranks: &'a dyn Ranks) -> Summed<'a> {
        Summed { part: &self.matrix, layout: &self.layout, ranks }
    }

    /// The free unknowns of this rank.
    pub(super) fn restrict(&self, full: &[f64]) -> Vec<f64> {
        let free = self.reduction.restrict(full);
        if self.layout.own() == free.len() { free } else { self.layout.restrict(&free) }
    }

    /// A solution on all ranks, with the prescribed unknowns at zero.
    pub(super) fn prolong(&self, x: &[f64], ranks: &dyn Ranks) -> Vec<f64> {
        let mut full = vec![0.0; self.fixed.len()];
        self.reduction.prolong(&self.layout.join(x, ranks), &mut full);
        full
    }
}
