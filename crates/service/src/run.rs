//! Runs: how they begin to record, fail and end, and those that are opened to be read.

use std::path::Path;

use slipstick::analysis::AnalysisError;
use slipstick::build::{Problem, build_mesh};
use slipstick::case::Resolved;
use slipstick::linalg::Ranks;
use slipstick::mesh::Mesh;
use slipstick::path::{StepFailureKind, SweepError};
use slipstick::run::{ExitState, Kept, Run, RunDirectory, RunPart, RunRecord, keep_failure, mesh_files};

use crate::check::Checked;
use crate::failure::{Failure, Outcome};
use crate::host::{Event, Host, Started, StartedCase};
use crate::read::case_file;

/// A run that is opened to be read: finished, failed, or in progress.
#[derive(Debug)]
pub struct OpenRun {
    /// Its directory.
    pub directory: RunDirectory,
    /// Its case.
    pub resolved: Resolved,
    /// The mesh of the case.
    pub mesh: Mesh,
}

impl OpenRun {
    /// Opens the directory of a run.
    ///
    /// # Errors
    /// [`Failure::Input`] if it has none; [`Failure::Case`] if its case is damaged.
    pub fn open(path: &Path) -> Outcome<Self> {
        Self::of(RunDirectory::open(path)?)
    }

    /// Reads the case of a run, and makes its mesh.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn of(directory: RunDirectory) -> Outcome<Self> {
        // without it, the copies of mesh files would not be found
        RunRecord::read(&directory)?;
        let file = directory.file("case.toml");
        let resolved = case_file(&file, &[]).map_err(|error| error.at(&file))?;
        let mesh = build_mesh(&resolved.case).map_err(|error| Failure::build(&error, &resolved.source_map))?;
        Ok(Self { directory, resolved, mesh })
    }
}

/// The value that the first rank makes for all; `None` on the others. All ranks call it.
///
/// # Errors
/// On all ranks, if it fails on the first.
pub fn first<T>(ranks: &dyn Ranks, make: impl FnOnce() -> Outcome<T>) -> Outcome<Option<T>> {
    let made = if ranks.rank() == 0 { make().map(Some) } else { Ok(None) };
    match (ranks.any(made.is_err()), made) {
        (true, Ok(_)) => Err(Failure::input("the first rank could not start", "see its message")),
        (_, made) => made,
    }
}

/// Starts a run of a case in a directory of its own, with `force` in that of an earlier run; `file` is
/// the case file. Called on the first rank.
///
/// # Errors
/// [`Failure::Input`] if the directory contains a run or cannot be written.
pub fn start(
    host: &dyn Host,
    checked: &Checked,
    (command, file): (&str, &Path),
    directory: &Path,
    force: bool,
) -> Outcome<Run> {
    let part = RunPart::starting(host.line(), checked.threads);
    let run = Run::start(directory, &checked.resolved, file, &mesh_files(file), part, force)?;
    let (case, steps) = (file.display().to_string(), checked.inspection.steps);
    let case = StartedCase { case, unknowns: checked.forecast.unknowns, steps };
    host.tell(Event::Started(Started { command, directory, threads: checked.threads, case: Some(case) }));
    Ok(run)
}

/// Records how a run ended, on the rank that has it, and returns the outcome.
///
/// # Errors
/// Those of the outcome; [`Failure::Input`] if the record cannot be written.
pub fn end<T>(run: Option<Run>, outcome: Outcome<T>) -> Outcome<T> {
    let (exit, message) = match &outcome {
        Ok(_) => (ExitState::Finished, None),
        Err(failure) => (failure.state(), Some(failure.text())),
    };
    let written = run.map_or(Ok(()), |run| run.end(exit, message));
    let value = outcome?;
    written?;
    Ok(value)
}

/// The failure of an analysis, after its remaining results have been written to `run`. All ranks
/// call it; the first has the run.
pub fn failed(problem: &Problem, error: &AnalysisError, run: Option<&Run>) -> Failure {
    if let AnalysisError::Sweep(SweepError { kind: StepFailureKind::Interrupted, .. }) = error {
        return Failure::Interrupted { message: "no gradient".into(), resume: None };
    }
    let run = run.map(Run::directory);
    let (report, kept) = keep_failure(run, problem, error);
    Failure::Analysis { report, kept: kept_in(&kept, run, "") }
}

/// The results that are kept of a failed analysis and their directory; `before` names those kept
/// earlier.
pub(crate) fn kept_in(kept: &Kept, run: Option<&RunDirectory>, before: &str) -> String {
    let Some(directory) = run.map(|run| run.path().display()) else { return String::new() };
    match kept {
        Kept::Nothing => directory.to_string(),
        Kept::States => format!("{directory}: {before}the states that converged (path.pvd)"),
        Kept::FailingState => format!(
            "{directory}: {before}the states that converged (path.pvd) and the failing one (failure.vtu); \
             `slipstick render {directory} --failure` draws it"
        ),
        Kept::Lost(error) => format!("{before}nothing more: {error}"),
    }
}
