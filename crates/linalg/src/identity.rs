//! Identities of sparsity patterns.

use std::sync::atomic::{AtomicU64, Ordering};

/// The next number.
static NEXT: AtomicU64 = AtomicU64::new(0);

/// Identity of a sparsity pattern. Each constructor call gives a new identity; clones share it.
///
/// Patterns are immutable, so two patterns with one identity are equal. Equal patterns from
/// separate constructor calls have different identities. Comparing identities takes constant time.
/// The number differs between runs and ranks; results depend only on whether two identities are
/// equal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct PatternId(u64);

impl PatternId {
    /// A new identity.
    pub(crate) fn mint() -> Self {
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}
