//! File operations that only the first rank performs, on behalf of all ranks.

use slipstick_linalg::Ranks;

use super::RunError;

/// Runs `work` on the first rank. All ranks must call this function; they succeed or fail together.
/// Returns `None` on the other ranks.
///
/// # Errors
/// That of `work` on the first rank; [`RunError::FirstRank`] on the others.
pub fn on_first<T>(ranks: &dyn Ranks, work: impl FnOnce() -> Result<T, RunError>) -> Result<Option<T>, RunError> {
    agree(ranks, (ranks.rank() == 0).then(work))
}

/// The result of the first rank's work, `None` on the others, once all ranks know whether it
/// failed.
pub(super) fn agree<T>(ranks: &dyn Ranks, done: Option<Result<T, RunError>>) -> Result<Option<T>, RunError> {
    let failed = ranks.any(matches!(done, Some(Err(_))));
    match done {
        Some(result) => result.map(Some),
        None if failed => Err(RunError::FirstRank),
        None => Ok(None),
    }
}

#[cfg(test)]
mod tests {
    use slipstick_linalg::Alone;
    use slipstick_ranks::threads::on_ranks;

    use super::*;

    fn wrong() -> RunError {
        RunError::NoRun { directory: "there".into(), file: "run.json" }
    }

    #[test]
    fn only_the_first_rank_works() {
        let results = on_ranks(3, |rank| on_first(&rank, || Ok(rank.rank() + 7)).map_err(|e| e.to_string()));
        assert_eq!(results, [Ok(Some(7)), Ok(None), Ok(None)]);
        assert_eq!(on_first(&Alone, || Ok(7)).ok(), Some(Some(7)));
    }

    /// A rank that did not learn of the failure would wait for the first one in its next call.
    #[test]
    fn all_ranks_fail_with_the_first() {
        let results = on_ranks(3, |rank| on_first(&rank, || Err::<(), _>(wrong())));
        assert!(matches!(results[0], Err(RunError::NoRun { .. })), "{results:?}");
        assert!(results[1..].iter().all(|result| matches!(result, Err(RunError::FirstRank))), "{results:?}");
    }
}
