//! The results that are kept of a failed analysis.

use super::{FailureReport, RunDirectory, RunError, write_failure};
use slipstick_model::analysis::AnalysisError;
use slipstick_model::problem::Problem;

/// The results that are kept of a failed analysis.
#[derive(Debug)]
pub enum Kept {
    /// Nothing: there is no directory, or no load step to write.
    Nothing,
    /// The states that converged, `path.pvd`.
    States,
    /// These, and the iterate at which the march failed, `failure.vtu`.
    FailingState,
    /// Nothing more: files could not be written.
    Lost(RunError),
}

/// Explains a failed analysis of a design, and writes the part of its path that was computed. All
/// ranks call it; `run` is that of the first rank, if it has one.
pub fn keep_failure(
    run: Option<&RunDirectory>,
    problem: &Problem,
    error: &AnalysisError,
) -> (Box<FailureReport>, Kept) {
    let kept = match error.march() {
        Some(failure) => match write_failure(run, problem, failure) {
            _ if run.is_none() => Kept::Nothing,
            Ok(true) => Kept::FailingState,
            Ok(false) => Kept::States,
            Err(error) => Kept::Lost(error),
        },
        None => Kept::Nothing,
    };
    (Box::new(FailureReport::new(error, problem)), kept)
}
