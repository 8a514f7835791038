//! How often the elements of a model are evaluated.

use std::array::from_fn;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// What is evaluated, for all elements at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Evaluation {
    /// Internal forces.
    Force,
    /// Tangents.
    Tangent,
    /// Products of the tangent with a vector.
    Product,
    /// Transposed derivatives with respect to densities and histories.
    PullBack,
    /// Histories at the end of a step.
    History,
    /// Energies.
    Energy,
    /// Stresses, or their transposed derivatives.
    Stress,
    /// Smallest determinants.
    Determinant,
}

impl Evaluation {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Force,
        Self::Tangent,
        Self::Product,
        Self::PullBack,
        Self::History,
        Self::Energy,
        Self::Stress,
        Self::Determinant,
    ];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Force => "force",
            Self::Tangent => "tangent",
            Self::Product => "tangent product",
            Self::PullBack => "pull-back",
            Self::History => "history",
            Self::Energy => "energy",
            Self::Stress => "stress",
            Self::Determinant => "determinant",
        }
    }
}

/// Counts evaluations; clones count together.
#[derive(Debug, Clone, Default)]
pub(crate) struct Counter(Arc<[AtomicU64; Evaluation::ALL.len()]>);

impl Counter {
    pub fn count(&self, evaluation: Evaluation) {
        self.0[evaluation as usize].fetch_add(1, Ordering::Relaxed);
    }

    /// In the order of [`Evaluation::ALL`].
    pub fn counts(&self) -> [u64; Evaluation::ALL.len()] {
        from_fn(|i| self.0[i].load(Ordering::Relaxed))
    }
}
