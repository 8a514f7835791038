//! Optimizations that are recorded: started, driven, resumed and ended.

use std::path::{Path, PathBuf};

use slipstick::build::{self, Problem};
use slipstick::case::{Resolved, parse_case_with, sha256};
use slipstick::drive::{DriveError, DriveObserver, Recorder, drive};
use slipstick::optimize::Optimization;
use slipstick::output::write_atomically;
use slipstick::quantities::Quantities;
use slipstick::run::{Checkpoint, ExitState, RESPONSES, Run, RunDirectory, RunError, RunPart, RunRecord, mesh_files};

use crate::check::{Checked, prepare};
use crate::failure::{Failure, Outcome};
use crate::host::{Event, Host, Started};
use crate::run::{end, first, kept_in};

/// Sections of a case that an optimization needs.
pub const SECTIONS: &[&str] = &["dirichlet", "design", "objective", "optimizer"];

/// The same for an objective that is not that of the case.
pub const SECTIONS_OF_OWN: &[&str] = &["dirichlet", "design", "optimizer"];

/// An optimization of a built case at its start.
///
/// # Errors
/// [`Failure::Case`] if the case lacks what an optimization needs.
pub fn optimization(resolved: &Resolved, problem: Problem) -> Outcome<Optimization> {
    build::optimization(&resolved.case, problem).map_err(|error| Failure::build(&error, &resolved.source_map))
}

/// An optimization whose state is on disk after every iteration. All ranks have one; the first has the
/// run.
pub struct RecordedOptimization {
    /// The optimization.
    pub optimization: Optimization,
    recorder: Recorder,
    run: Option<Run>,
}

impl RecordedOptimization {
    /// Records an optimization at its start in a run that has just started. `responses` describe
    /// an objective and constraints that are not those of the case. [resume] needs them again.
    ///
    /// # Errors
    /// [`Failure::Input`] if files cannot be written; the run has then ended.
    pub fn start(
        optimization: Optimization,
        resolved: &Resolved,
        run: Option<Run>,
        responses: Option<&str>,
    ) -> Outcome<Self> {
        let hash = match run.as_ref().map(|run| describe(run, resolved, responses)).transpose() {
            Ok(hash) => hash.unwrap_or_default(),
            Err(failure) => return end(run, Err(failure)),
        };
        let checkpoint = Checkpoint::new(hash, optimization.iterations(), Vec::new(), optimization.state.clone());
        Self::record(optimization, run, checkpoint, resolved.case.output.every)
    }

    fn record(optimization: Optimization, run: Option<Run>, checkpoint: Checkpoint, every: usize) -> Outcome<Self> {
        let ranks = optimization.problem.analysis.linear.ranks();
        match Recorder::new(run.as_ref().map(Run::directory), checkpoint, every, ranks) {
            Ok(recorder) => Ok(Self { optimization, recorder, run }),
            Err(error) => end(run, Err(error.into())),
        }
    }

    /// Runs it to its end, or until it fails or is interrupted; returns the quantities of the last
    /// design, if it was evaluated now.
    ///
    /// # Errors
    /// As [`Failure`] lists them; finished iterations are kept.
    pub fn drive(self, observer: &mut dyn DriveObserver) -> (Driven, Outcome<Option<Quantities>>) {
        let Self { mut optimization, recorder, run } = self;
        let driven = drive(&mut optimization, Some(recorder), observer);
        let outcome = driven.map_err(|error| stopped(error, run.as_ref().map(Run::directory)));
        (Driven { optimization, run }, outcome)
    }
}

/// An optimization that runs no longer, of which it is not yet recorded how it ended.
pub struct Driven {
    /// The optimization.
    pub optimization: Optimization,
    run: Option<Run>,
}

impl Driven {
    /// Its run, on the first rank.
    pub fn run(&self) -> Option<&Run> {
        self.run.as_ref()
    }

    /// Records how it ended, and returns the outcome.
    ///
    /// # Errors
    /// Those of the outcome; [`Failure::Input`] if the record cannot be written.
    pub fn end<T>(self, outcome: Outcome<T>) -> Outcome<T> {
        end(self.run, outcome)
    }

    /// Records that it ended like this, for reasons that only the front end knows.
    ///
    /// # Errors
    /// [`Failure::Input`] if the record cannot be written.
    pub fn end_as(self, exit: ExitState, message: Option<String>) -> Outcome {
        Ok(self.run.map_or(Ok(()), |run| run.end(exit, message))?)
    }
}

/// Writes the description of responses that are not those of the case, and returns the [identity] of the
/// run.
fn describe(run: &Run, resolved: &Resolved, responses: Option<&str>) -> Outcome<String> {
    let file = run.directory().file(RESPONSES);
    match responses {
        Some(text) => write_atomically(&file, |writer| writer.write_all(text.as_bytes()))?,
        // of an earlier run in this directory
        None => drop(std::fs::remove_file(file)),
    }
    Ok(identity(resolved.source_map.text(), responses))
}

/// The failure of an optimization that stopped early.
fn stopped(error: DriveError, run: Option<&RunDirectory>) -> Failure {
    match error {
        DriveError::Analysis { report, kept } => {
            Failure::Analysis { report, kept: kept_in(&kept, run, "finished iterations, ") }
        }
        DriveError::Mma(error) => Failure::Check {
            message: format!("the optimizer failed: {error}"),
            cure: "check history.csv; a smaller `optimizer.mma.move_limit` may help".into(),
        },
        DriveError::Interrupted => Failure::Interrupted {
            message: "finished iterations are kept".into(),
            resume: run.map(|run| run.path().to_owned()),
        },
        DriveError::Run(error) => error.into(),
    }
}

/// A request to continue an optimization from its last finished iteration.
#[derive(Debug, Clone, Copy)]
pub struct Resume<'a> {
    /// The directory of its run.
    pub results: &'a Path,
    /// Total number of updates; `None`: that with which the run was started.
    pub iterations: Option<usize>,
    /// What describes objective and constraints that are not those of the case, if it has such.
    pub responses: Option<&'a str>,
    /// Sections that the case needs.
    pub sections: &'a [&'a str],
}

/// An optimization that was resumed.
pub enum Resumed {
    /// Nothing was left to do.
    Complete {
        /// The directory of its run.
        directory: PathBuf,
        /// Updates made.
        iterations: usize,
        /// Whether it ended before its last update, because criteria are met.
        criteria_met: bool,
    },
    /// It goes on.
    InProgress(Box<RecordedOptimization>),
}

/// Continues an optimization from its last finished iteration, bit for bit. `amend` completes the problem
/// with what is not in the case. All ranks call it; the first takes the lock of the run and keeps it.
///
/// # Errors
/// Those of `amend`; as [`prepare`]; [`Failure::Input`] if there is no run, another process writes to it,
/// its files are damaged, or its case or responses are not those with which it was started.
pub fn resume<E: From<Failure>>(
    host: &dyn Host,
    request: &Resume<'_>,
    amend: impl FnOnce(&mut Problem) -> Result<(), E>,
) -> Result<Resumed, E> {
    let ranks = host.ranks();
    // the others wait until the first has the lock
    let taken = first(ranks.as_ref(), || Ok(RunDirectory::take_up(request.results)?))?;
    let directory = taken.map_or_else(|| RunDirectory::open(request.results), Ok).map_err(Failure::from)?;
    let checkpoint = Checkpoint::read(&directory).map_err(Failure::from)?;
    let record = RunRecord::read(&directory).map_err(Failure::from)?;
    let resolved = case_of(&directory, &checkpoint, request.responses)?;
    let iterations = request.iterations.unwrap_or(checkpoint.iterations);
    let (checked, mut problem) = prepare(host, resolved, request.sections, Some(iterations))?;
    let Checked { resolved, threads, .. } = checked;
    amend(&mut problem)?;
    let optimization = optimization(&resolved, problem)?;
    let suspended = Suspended { directory, checkpoint, record, iterations };
    Ok(suspended.go_on(host, optimization, resolved, threads)?)
}

/// A run whose lock is taken.
struct Suspended {
    directory: RunDirectory,
    checkpoint: Checkpoint,
    record: RunRecord,
    iterations: usize,
}

impl Suspended {
    fn go_on(
        self,
        host: &dyn Host,
        mut optimization: Optimization,
        resolved: Resolved,
        threads: usize,
    ) -> Outcome<Resumed> {
        let Self { directory, mut checkpoint, record, iterations } = self;
        checkpoint.restore(&directory, &mut optimization)?;
        optimization.set_iterations(iterations);
        // A run that was stopped while it wrote its last files evaluates its last design again and
        // writes them.
        if optimization.finished() && record.latest.exit == ExitState::Finished {
            let made = optimization.state.iteration;
            let directory = directory.path().to_owned();
            return Ok(Resumed::Complete { directory, iterations: made, criteria_met: made < iterations });
        }
        checkpoint.iterations = iterations;
        checkpoint.reopen();
        optimization.state = checkpoint.state.clone();
        let directory = directory.writing(&resolved.case.output);
        let run = first(host.ranks().as_ref(), || {
            let run = Run::take_up(directory, record, RunPart::starting(host.line(), threads))?;
            let directory = run.directory().path();
            host.tell(Event::Started(Started { command: "resume", directory, threads, case: None }));
            Ok(run)
        })?;
        let recorded = RecordedOptimization::record(optimization, run, checkpoint, resolved.case.output.every)?;
        Ok(Resumed::InProgress(Box::new(recorded)))
    }
}

/// The case of a run, if it is the one with which the run was started.
fn case_of(directory: &RunDirectory, checkpoint: &Checkpoint, responses: Option<&str>) -> Outcome<Resolved> {
    let path = directory.file("case.toml");
    let text = std::fs::read_to_string(&path).map_err(|source| RunError::Read { path: path.clone(), source })?;
    let (expected, found) = (checkpoint.case_sha256.clone(), identity(&text, responses));
    if expected != found {
        return Err(RunError::OtherCase { path, expected, found }.into());
    }
    Ok(parse_case_with(&text, &path.display().to_string(), &mesh_files(&path))?)
}

/// The hash in the checkpoint of a run: of its case, and of responses that are not those of the case. Only
/// a front end that has the latter can resume the run.
fn identity(case: &str, responses: Option<&str>) -> String {
    match responses {
        Some(responses) => sha256(&format!("{case}\n{responses}")),
        None => sha256(case),
    }
}
