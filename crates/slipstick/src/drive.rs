//! Runs an optimization from its current state to completion. One loop serves all ranks; files are
//! written on request.
//!
//! [`drive`] repeats [`Optimization::advance`]. With a [`Recorder`], the state is on disk in the
//! directory of the run after every iteration, so that a run that is stopped or killed can be
//! resumed from its [`Checkpoint`], bit for bit. To show progress, implement [`DriveObserver`].
//!
//! ```
//! use slipstick::{build::{build, optimization}, case::{parse_case, template}, drive::drive};
//! use slipstick_path::Silent;
//!
//! let text = template("half-ball").unwrap().text.replace("steps = 10", "steps = 2");
//! let case = parse_case(&text, "half_ball.toml")?.case;
//! let mut optimization = optimization(&case, build(&case)?)?;
//! optimization.set_iterations(1);
//! drive(&mut optimization, None, &mut Silent)?;
//! // the initial design and the updated one
//! assert_eq!(optimization.state.history.len(), 2);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::time::Instant;

use slipstick_linalg::Ranks;
use slipstick_path::{MarchEvent, MarchObserver, Silent, StateError, StepFailureKind};

use crate::analysis::{AnalysisError, Forward, ForwardNotice, Rounding};
use crate::crushed::CrushedVoid;
use crate::optimize::{IterationRecord, Optimization, OptimizeError};
use crate::output::{
    Pvd,
    fields::{DesignFields, write_design},
};
use crate::pieces::LoosePieces;
use crate::quantities::Quantities;
use crate::run::{
    Checkpoint, FailureReport, FunctionNames, History, Kept, NewtonTable, ResultRecord, RunDirectory, RunError,
    StartValuesFile, keep_failure, on_first, write_densities, write_path,
};
use slipstick_design::MmaError;

/// One evaluated design, as reported to an observer.
#[derive(Debug)]
pub struct DesignEvaluated<'a> {
    /// Its record; if an update followed, including the data of the update.
    pub record: &'a IterationRecord,
    /// Warnings about its load path.
    pub notice: Option<ForwardNotice>,
    /// Void that made attempts at its load steps fail, if these cost more than its path.
    pub crushed: Option<CrushedVoid>,
    /// Void that made its path fail: from this design on, void follows linear elasticity.
    pub rescued: Option<&'a CrushedVoid>,
    /// Whether the sharpness rose in its analysis by the first of two halves.
    pub divided: bool,
    /// Pieces of the design that hang together with nothing.
    pub loose: Option<LoosePieces>,
    /// Wall time of the analysis, the gradient and the update. \[s\]
    pub seconds: f64,
}

/// Follows an optimization on all ranks.
pub trait DriveObserver: MarchObserver {
    /// The analysis of this design begins.
    fn begins(&mut self, _iteration: usize) {}

    /// A design was evaluated and, unless it is the last one, updated. Its files are written next.
    fn evaluated(&mut self, _design: &DesignEvaluated<'_>) {}

    /// The last design is not the result: the design of this record is, and its path begins.
    fn recalls(&mut self, _result: &IterationRecord) {}
}

impl DriveObserver for Silent {}

/// Why an optimization stopped early. Finished iterations stay on disk.
#[derive(Debug, thiserror::Error)]
pub enum DriveError {
    /// An analysis failed, or its objective is only round-off.
    #[error("{report}")]
    Analysis {
        /// Place, cause, attempts and suggestions.
        report: Box<FailureReport>,
        /// The files kept in addition to the finished iterations.
        kept: Kept,
    },
    /// The optimizer failed.
    #[error("optimizer: {0}")]
    Mma(MmaError),
    /// The observer asked to stop.
    #[error("interrupted")]
    Interrupted,
    /// Files could not be written.
    #[error(transparent)]
    Run(#[from] RunError),
}

/// Writes the files of an optimization: `history.csv`, `newton.csv`, designs, start values and the
/// checkpoint after every iteration, and load paths: that of a design that is written as a field, and at the end that of
/// the last. All ranks have one; the
/// first one writes.
#[derive(Debug)]
pub struct Recorder {
    /// On the first rank, if it records a run.
    files: Option<Files>,
    /// Every how many iterations a design is written as a field.
    every: usize,
}

#[derive(Debug)]
struct Files {
    directory: RunDirectory,
    history: History,
    newton: NewtonTable,
    checkpoint: Checkpoint,
}

impl Recorder {
    /// Opens the files of a run for appending, or creates them, at the state of `checkpoint`, the
    /// current state of the optimization. All ranks call it; `run` is that of the first. A design
    /// is written as a field every `every` iterations.
    ///
    /// # Errors
    /// [`RunError::Output`] and [`RunError::Damaged`] if a table was changed after the run or
    /// cannot be written, on the first rank; [`RunError::FirstRank`] on the others.
    pub fn new(
        run: Option<&RunDirectory>,
        checkpoint: Checkpoint,
        every: usize,
        ranks: &dyn Ranks,
    ) -> Result<Self, RunError> {
        let open = || {
            let Some(directory) = run else { return Ok(None) };
            let history = History::open(directory, FunctionNames::of(&checkpoint.state), &checkpoint.state.history)?;
            let newton = NewtonTable::open(directory, checkpoint.newton_rows.last().copied().unwrap_or(0))?;
            // From here on a run that is stopped or killed can be resumed.
            checkpoint.write(directory)?;
            ResultRecord::forget(directory)?;
            Ok(Some(Files { directory: directory.clone(), history, newton, checkpoint }))
        };
        Ok(Self { files: on_first(ranks, open)?.flatten(), every })
    }

    /// Whether the design of an iteration and its load path are written as fields, unless it is the last.
    fn writes(&self, iteration: usize) -> bool {
        iteration.is_multiple_of(self.every)
    }

    fn directory(&self) -> Option<&RunDirectory> {
        self.files.as_ref().map(|files| &files.directory)
    }

    fn begins(&mut self, iteration: usize) {
        if let Some(files) = &mut self.files {
            files.newton.begin(iteration);
        }
    }

    /// Writes everything of the last evaluated design, the checkpoint last.
    fn record(&mut self, optimization: &Optimization, seconds: f64) -> Result<(), RunError> {
        let analysis = &optimization.problem.analysis;
        let (ranks, state) = (analysis.linear.ranks(), &optimization.state);
        let Some(record) = state.history.last() else { return Ok(()) };
        let every = self.every;
        on_first(ranks, || match &mut self.files {
            Some(files) => files.record(optimization, record, seconds, every),
            None => Ok(()),
        })?;
        let updated = state.iteration > record.iteration;
        let mut start_values = Vec::new();
        let guides = if updated { optimization.guides() } else { Vec::new() };
        for (realisation, guide) in guides.into_iter().enumerate() {
            let place = (state.iteration, realisation);
            start_values.extend(StartValuesFile::write(self.directory(), place, guide, ranks)?);
        }
        on_first(ranks, || match &mut self.files {
            Some(files) => files.store(optimization, start_values),
            None => Ok(()),
        })?;
        Ok(())
    }
}

impl Files {
    fn record(
        &mut self,
        optimization: &Optimization,
        record: &IterationRecord,
        seconds: f64,
        every: usize,
    ) -> Result<(), RunError> {
        self.newton.check()?;
        self.history.record(record, seconds)?;
        let Some(design) = optimization.evaluated() else { return Ok(()) };
        let (run, number) = (&self.directory, record.iteration);
        let (mesh, map) = (&optimization.problem.mesh, optimization.map());
        let variables = (!map.is_identity()).then(|| map.variables().densities(&design.x));
        let fields = DesignFields {
            iteration: number,
            density: &design.density,
            derivative: design.gradient.as_ref(),
            variables: variables.as_ref(),
        };
        write_densities(&run.file("design.csv"), mesh, fields.density, fields.derivative, fields.variables)?;
        if !number.is_multiple_of(every) && !optimization.finished() {
            return Ok(());
        }
        let name = RunDirectory::numbered("design", number);
        let pieces = run.pieces(optimization.problem.analysis.model().share(), mesh.elements.len());
        write_design(&run.file(&name), mesh, &fields, pieces.as_deref())?;
        let mut collection = Pvd::default();
        for number in 0..=number {
            let name = RunDirectory::numbered("design", number);
            if run.file(&name).exists() {
                collection.add(number as f64, run.in_series(&name))?;
            }
        }
        Ok(collection.save(&run.file("design.pvd"))?)
    }

    /// Writes a design that is the result although it is not the last one.
    fn recall(&self, optimization: &Optimization, iteration: usize) -> Result<(), RunError> {
        let Some(design) = optimization.evaluated() else { return Ok(()) };
        let (run, mesh, map) = (&self.directory, &optimization.problem.mesh, optimization.map());
        let variables = (!map.is_identity()).then(|| map.variables().densities(&design.x));
        write_densities(&run.file("design.csv"), mesh, &design.density, None, variables.as_ref())?;
        ResultRecord { iteration }.write(run)
    }

    /// Writes the checkpoint; without new start values, the previous ones are kept.
    fn store(&mut self, optimization: &Optimization, start_values: Vec<StartValuesFile>) -> Result<(), RunError> {
        self.checkpoint.newton_rows.push(self.newton.rows());
        if !start_values.is_empty() {
            self.checkpoint.start_values = start_values;
        }
        self.checkpoint.state = optimization.state.clone();
        self.checkpoint.write(&self.directory)
    }
}

/// Runs an optimization to its end. All ranks call it, either all with a recorder or all without;
/// they succeed or fail together. Returns the [quantities](crate::quantities) of the last design,
/// if it was evaluated now and recorded.
///
/// # Errors
/// See [`DriveError`]; the state is that of the last finished iteration.
pub fn drive(
    optimization: &mut Optimization,
    mut recorder: Option<Recorder>,
    observer: &mut dyn DriveObserver,
) -> Result<Option<Quantities>, DriveError> {
    let mut last: Option<Forward> = None;
    while !optimization.finished() {
        let iteration = optimization.state.iteration;
        // Drop the previous path first: it may be large.
        drop(last.take());
        observer.begins(iteration);
        if let Some(recorder) = &mut recorder {
            recorder.begins(iteration);
        }
        let clock = Instant::now();
        let newton = recorder.as_mut().and_then(|recorder| recorder.files.as_mut()).map(|files| &mut files.newton);
        let mut both = Both { newton, observer: &mut *observer, failed: Vec::new() };
        let advanced = optimization.advance(&mut both);
        let failed = both.failed;
        let forward = match advanced {
            Ok(forward) => forward,
            Err(error) => return Err(stopped(optimization, error, recorder.as_ref())),
        };
        let seconds = clock.elapsed().as_secs_f64();
        if let Some(record) = optimization.state.history.last() {
            let costly = record.failed_iterations > record.newton_iterations;
            let crushed = costly.then(|| optimization.problem.crushed_void(&forward.density, failed.iter())).flatten();
            let loose = optimization.problem.loose_pieces(&forward.density);
            let rescued = optimization.state.interpolation.as_ref();
            let rescued = rescued.filter(|of| of.from == record.iteration).map(|of| &of.void);
            let notice = forward.notice.clone();
            let divided = optimization.state.divided.contains(&record.iteration);
            observer.evaluated(&DesignEvaluated { record, notice, crushed, rescued, divided, loose, seconds });
        }
        if let Some(recorder) = &mut recorder {
            recorder.record(optimization, seconds)?;
            let written = optimization.state.history.last().is_some_and(|of| recorder.writes(of.iteration));
            // that of the last design is written at the end
            if written && !optimization.finished() {
                write_path(recorder.directory(), &optimization.problem, &forward.path)?;
            }
        }
        last = Some(forward);
    }
    if last.is_none() {
        return Ok(None);
    }
    if let Some(forward) = recall(optimization, recorder.as_mut(), observer)? {
        last = Some(forward);
    }
    let (Some(recorder), Some(forward)) = (&recorder, &last) else { return Ok(None) };
    let problem = &optimization.problem;
    Ok(Some(write_path(recorder.directory(), problem, &forward.path)?))
}

/// Evaluates and writes the best design, if it is the result instead of the last one. If its path
/// cannot be marched again, the last design remains the result.
fn recall(
    optimization: &mut Optimization,
    recorder: Option<&mut Recorder>,
    observer: &mut dyn DriveObserver,
) -> Result<Option<Forward>, DriveError> {
    let [result, last] = [optimization.state.result(), optimization.state.history.last()].map(|of| of.cloned());
    let Some(result) = result.filter(|result| Some(result.iteration) != last.map(|last| last.iteration)) else {
        return Ok(None);
    };
    observer.recalls(&result);
    let forward = match optimization.recall(observer) {
        Ok(Some(forward)) => forward,
        Err(OptimizeError::Interrupted) => return Err(DriveError::Interrupted),
        _ => return Ok(None),
    };
    if let Some(recorder) = recorder {
        let ranks = optimization.problem.analysis.linear.ranks();
        on_first(ranks, || match &recorder.files {
            Some(files) => files.recall(optimization, result.iteration),
            None => Ok(()),
        })?;
    }
    Ok(Some(forward))
}

/// Combines the growing table and the caller's observer.
struct Both<'a> {
    newton: Option<&'a mut NewtonTable>,
    observer: &'a mut dyn DriveObserver,
    /// States at which attempts failed.
    failed: Vec<StateError>,
}

impl MarchObserver for Both<'_> {
    fn on_event(&mut self, event: &MarchEvent<'_>) {
        if let Some(newton) = &mut self.newton {
            newton.record(event);
        }
        if let MarchEvent::Retry { failed, .. } = event
            && let StepFailureKind::State(error) = &failed.kind
        {
            self.failed.push(error.clone());
        }
        self.observer.on_event(event);
    }

    fn cancelled(&self) -> bool {
        self.observer.cancelled()
    }
}

/// An optimization that stopped early, after the remains of its last analysis have been written.
fn stopped(optimization: &Optimization, error: OptimizeError, recorder: Option<&Recorder>) -> DriveError {
    match error {
        OptimizeError::Mma(error) => DriveError::Mma(error),
        OptimizeError::Interrupted => DriveError::Interrupted,
        OptimizeError::Analysis(error) => kept(optimization, &error, recorder),
        OptimizeError::Rounding(forward) => without_direction(optimization, &forward, recorder),
    }
}

fn kept(optimization: &Optimization, error: &AnalysisError, recorder: Option<&Recorder>) -> DriveError {
    let problem = &optimization.problem;
    let run = recorder.and_then(Recorder::directory);
    let (report, kept) = keep_failure(run, problem, error);
    DriveError::Analysis { report, kept }
}

/// The objective of a design is only round-off: its path and densities are written.
fn without_direction(optimization: &Optimization, forward: &Forward, recorder: Option<&Recorder>) -> DriveError {
    let rounding = forward.rounding.as_ref();
    let report = Box::new(FailureReport {
        cause: rounding.map_or(String::new(), |rounding| format!("there is nothing to optimize: {rounding}")),
        cures: rounding.map_or(&[][..], Rounding::cures).iter().map(|cure| (*cure).to_owned()).collect(),
        ..FailureReport::default()
    });
    let Some(recorder) = recorder else { return DriveError::Analysis { report, kept: Kept::Nothing } };
    let (problem, run) = (&optimization.problem, recorder.directory());
    let path = write_path(run, problem, &forward.path);
    let table = on_first(problem.analysis.linear.ranks(), || match run.map(|run| run.file("design.csv")) {
        // the table of an earlier iteration is kept: it cannot be replaced
        Some(table) if !table.exists() => Ok(write_densities(&table, &problem.mesh, &forward.density, None, None)?),
        _ => Ok(()),
    });
    let kept = path.and(table).map_or_else(Kept::Lost, |_| Kept::States);
    DriveError::Analysis { report, kept }
}
