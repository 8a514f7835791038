//! Work with files, which the first of several ranks does for all.

use slipstick_linalg::Ranks;

use super::RunError;

/// Does `work` on the first rank. All ranks call it, and succeed or fail together; `None` on the other ranks.
///
/// # Errors
/// That of `work` on the first rank; [`RunError::FirstRank`] on the others.
pub fn on_first<T>(ranks: &dyn Ranks, work: impl FnOnce() -> Result<T, RunError>) -> Result<Option<T>, RunError> {
    agree(ranks, (ranks.rank() == 0).then(work))
}

/// The result of the first rank's work, `None` on the others, once all ranks know whether it failed.
pub(super) fn agree<T>(ranks: &dyn Ranks, done: Option<Result<T, RunError>>) -> Result<Option<T>, RunError> {
    let failed = ranks.any(matches!(done, Some(Err(_))));
    match done {
        Some(result) => result.map(Some),
        None if failed => Err(RunError::FirstRank),
        None => Ok(None),
    }
}
