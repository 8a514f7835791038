//! The symbolic analysis of a sparsity pattern, as a value.

use crate::csr::{CsrMatrix, CsrPattern};
use crate::solver::FactorizationError;
use std::any::Any;
use std::fmt;
use std::sync::Arc;

/// A solver's data on all matrices with the same pattern, before their entries are known: for
/// instance an elimination order and the structure of the factors.
///
/// [`LinearSolver::analyse`](crate::LinearSolver::analyse) returns it, the caller keeps it, and
/// [`LinearSolver::factorize`](crate::LinearSolver::factorize) uses it. Each solver has its own
/// type of content. Clones share the content.
#[derive(Clone)]
pub struct Symbolic {
    pattern: Arc<CsrPattern>,
    content: Arc<dyn Any + Send + Sync>,
}

impl Symbolic {
    /// The analysis `content` of `pattern`. A solver that needs no analysis stores `()`.
    pub fn new<T: Any + Send + Sync>(pattern: &Arc<CsrPattern>, content: T) -> Self {
        Self { pattern: Arc::clone(pattern), content: Arc::new(content) }
    }

    /// The analysed pattern.
    pub fn pattern(&self) -> &Arc<CsrPattern> {
        &self.pattern
    }

    /// Whether `pattern` is the analysed one, by [identity](CsrPattern::id). An equal pattern from
    /// another constructor call is a different one.
    pub fn is_of(&self, pattern: &CsrPattern) -> bool {
        self.pattern.id() == pattern.id()
    }

    /// The content, if it has type `T`.
    pub fn content<T: Any>(&self) -> Option<&T> {
        self.content.downcast_ref()
    }

    /// The content, checked for a factorization of `a`.
    ///
    /// # Errors
    /// [`FactorizationError::Analysis`] if `a` has a different pattern or the content a different
    /// type; errors of [`CsrMatrix::check`].
    pub fn content_for<T: Any>(&self, a: &CsrMatrix) -> Result<&T, FactorizationError> {
        let content = self.content().filter(|_| self.is_of(&a.pattern));
        let content = content.ok_or(FactorizationError::Analysis { n: a.n() })?;
        a.check()?;
        Ok(content)
    }
}

impl fmt::Debug for Symbolic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (id, n) = (self.pattern.id(), self.pattern.n());
        f.debug_struct("Symbolic").field("pattern", &id).field("n", &n).finish_non_exhaustive()
    }
}
