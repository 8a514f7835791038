//! `slipstick resume`: continues an optimization, bit for bit.

use slipstick::run::{Checkpoint, ExitState, Run, RunDirectory, RunError, RunPart, RunRecord, sha256};
use slipstick::words::counted;
use slipstick_service::run::SECTIONS;

use super::optimize::{optimization, optimize};
use crate::args::Resume;
use crate::failure::Failure;
use crate::runs::end;
use crate::setup::prepare_for;
use crate::{Context, Outcome};

/// Continues an optimization from its last finished iteration.
///
/// # Errors
/// As [`crate::failure::Failure`] lists them, in particular [`crate::failure::Failure::Input`] if
/// the case's text is not the one that the run was started with.
pub fn run(context: &Context, args: &Resume) -> Outcome {
    if !args.set.is_empty() {
        let results = args.results.display();
        return Err(Failure::input(
            "a run continues with the case that it was started with: --set is for new runs",
            format!("`slipstick optimize CASE --design {results} --set …` starts one from the design of this run"),
        ));
    }
    let parallel = &context.parallel;
    // the first rank takes the lock, and the others wait until it has it
    let taken = parallel.first(|| Ok(RunDirectory::take_up(&args.results)?))?;
    let directory = taken.map_or_else(|| RunDirectory::open(&args.results), Ok)?;
    let mut checkpoint = Checkpoint::read(&directory)?;
    let record = RunRecord::read(&directory)?;
    let path = directory.file("case.toml");
    let (setup, problem) = {
        let text = std::fs::read_to_string(&path).map_err(|source| RunError::Read { path: path.clone(), source })?;
        let (expected, found) = (checkpoint.case_sha256.clone(), sha256(&text));
        if expected != found {
            return Err(RunError::OtherCase { path, expected, found }.into());
        }
        let iterations = args.iterations.map_or(checkpoint.iterations, usize::from);
        prepare_for(context, &path.as_path().into(), SECTIONS, Some(iterations))?
    };
    let mut optimization = optimization(&setup, problem)?;
    checkpoint.restore(&directory, &mut optimization)?;
    let iterations = args.iterations.map_or(checkpoint.iterations, usize::from);
    optimization.set_iterations(iterations);
    // A run that was stopped while it wrote its last files evaluates its last design again and
    // writes them.
    if optimization.finished() && record.latest.exit == ExitState::Finished {
        let made = optimization.state.iteration;
        context.console.text(&format!(
            "the run is complete after {}: {}",
            counted(made, "iteration"),
            if made < iterations { "the criteria for stopping are met" } else { "give --iterations for more" }
        ));
        let told = serde_json::json!({ "command": "resume", "directory": directory.path(), "iterations": made });
        context.console.event("result", told);
        return Ok(());
    }
    checkpoint.iterations = iterations;
    checkpoint.reopen();
    optimization.state = checkpoint.state.clone();
    let directory = directory.writing(&setup.resolved.case.output);
    let run = parallel.first(|| {
        let part = RunPart::starting(context.line.clone(), setup.threads);
        let run = Run::take_up(directory, record, part)?;
        let path = run.directory().path();
        let started = serde_json::json!({ "command": "resume", "directory": path, "threads": setup.threads });
        context.console.event("start", started);
        Ok(run)
    })?;
    let outcome = optimize(context, &setup, &mut optimization, run.as_ref(), checkpoint);
    end(run, outcome)
}
