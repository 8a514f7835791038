//! How runs start, end and fail.

use slipstick::analysis::AnalysisError;
use slipstick::build::Problem;
use slipstick::drive::DriveError;
use slipstick::path::{StepFailureKind, SweepError};
use slipstick::run::{
    ExitState, Kept, NewtonTable, Run, RunDirectory, RunError, RunPart, keep_failure, mesh_files, on_first,
};

use crate::args::Out;
use crate::failure::Failure;
use crate::setup::Setup;
use crate::watch::Watch;
use crate::{Context, Outcome};

/// Watches analyses of a problem, with `newton.csv` in the run of the first rank. All ranks call
/// it.
///
/// # Errors
/// [`Failure::Input`] if the table cannot be written.
pub fn watch<'a>(context: &'a Context, problem: &Problem, run: Option<&Run>) -> Outcome<Watch<'a>> {
    let watch = Watch::new(context, problem);
    let table = first(problem, || run.map(|run| NewtonTable::open(run.directory(), 0)).transpose())?.flatten();
    Ok(match table {
        Some(table) => watch.with_table(table),
        None => watch,
    })
}

/// Performs file operations on the first rank; all ranks call it, and succeed or fail together.
///
/// # Errors
/// [`Failure::Input`].
pub fn first<T>(problem: &Problem, work: impl FnOnce() -> Result<T, RunError>) -> Outcome<Option<T>> {
    Ok(on_first(problem.analysis.linear.ranks(), work)?)
}

/// The failure of an analysis, after its remaining results have been written to `run`. All ranks
/// call it; the first has the run.
pub fn failed(problem: &Problem, error: &AnalysisError, run: Option<&Run>) -> Failure {
    if let AnalysisError::Sweep(SweepError { kind: StepFailureKind::Interrupted, .. }) = error {
        return Failure::Interrupted { message: "no gradient".into(), resume: None };
    }
    let run = run.map(Run::directory);
    let (report, kept) = keep_failure(run, problem, error);
    Failure::Analysis { report, kept: told(&kept, run, "") }
}

/// The failure of an optimization that stopped early; the first rank has the run.
pub fn stopped(error: DriveError, run: Option<&Run>) -> Failure {
    match error {
        DriveError::Analysis { report, kept } => {
            Failure::Analysis { report, kept: told(&kept, run.map(Run::directory), "finished iterations, ") }
        }
        DriveError::Mma(error) => Failure::Check {
            message: format!("the optimizer failed: {error}"),
            cure: "check history.csv; a smaller `optimizer.mma.move_limit` may help".into(),
        },
        DriveError::Interrupted => Failure::Interrupted {
            message: "finished iterations are kept".into(),
            resume: run.map(|run| run.directory().path().to_owned()),
        },
        DriveError::Run(error) => error.into(),
    }
}

/// The results that are kept of a failed analysis and their directory; `before` names those kept
/// earlier.
fn told(kept: &Kept, run: Option<&RunDirectory>, before: &str) -> String {
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

/// Starts a run in its own directory; `None` on ranks other than the first.
///
/// # Errors
/// [`Failure::Input`] if the directory contains a run or cannot be written.
pub fn start(context: &Context, setup: &Setup, out: &Out, command: &str) -> Outcome<Option<Run>> {
    context.parallel.first(|| {
        let path = setup.directory(out, command);
        // a run that may overwrite files must not remove the design that it starts from
        if setup.replaces_design(&path) {
            return Err(Failure::input(
                format!("{} contains the requested design, which the results would replace", path.display()),
                "name another directory for the results with --out",
            ));
        }
        let part = RunPart::starting(context.line.clone(), setup.threads);
        let run = Run::start(&path, &setup.resolved, &setup.file, &mesh_files(&setup.file), part, out.force)?;
        let started = serde_json::json!({
            "command": command, "case": setup.file.display().to_string(), "directory": path, "threads": setup.threads,
            "unknowns": setup.inspection.unknowns,
            "steps": setup.inspection.steps,
        });
        context.console.event("start", started);
        Ok(run)
    })
}

/// Records how the run ended, on the rank that has it, and returns the outcome.
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
