//! All that the next iteration of an optimization depends on, on disk.

use std::fs;

use serde::{Deserialize, Serialize};
use slipstick_design::Scaling;

use super::{RunDirectory, RunError, StartValuesFile, seal};
use crate::output::write_atomically;
use slipstick_model::optimize::{Optimization, OptimizationState};

/// Version of the file's layout; another one is refused.
const FORMAT: u32 = 3;

/// The state of an optimization after a finished iteration, `checkpoint.json`.
///
/// Numbers are written with as many digits as give the same number back, so that a run that goes on from here gives the
/// same results as one that was never stopped, bit for bit. The file ends with the hash of what stands before it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Checkpoint {
    format: u32,
    /// SHA-256 of the case file's text, in hexadecimal.
    pub case_sha256: String,
    /// Updates asked for.
    pub iterations: usize,
    /// Rows of `newton.csv` at the end of each evaluated design; as long as the state's history.
    pub newton_rows: Vec<usize>,
    /// Start values of the next march, where they are those of the design before.
    pub start_values: Option<StartValuesFile>,
    /// The state.
    pub state: OptimizationState,
}

impl Checkpoint {
    /// A checkpoint of this state.
    pub fn new(case_sha256: String, iterations: usize, newton_rows: Vec<usize>, state: OptimizationState) -> Self {
        Self { format: FORMAT, case_sha256, iterations, newton_rows, start_values: None, state }
    }

    /// Drops the evaluation of a design that no update has followed yet, if there is one: to go on, it is evaluated
    /// again, with its gradient.
    pub fn reopen(&mut self) {
        self.state.history.truncate(self.state.iteration);
        self.newton_rows.truncate(self.state.iteration);
    }

    /// Writes `checkpoint.json`.
    ///
    /// # Errors
    /// [`RunError::Output`].
    pub fn write(&self, run: &RunDirectory) -> Result<(), RunError> {
        // Compact: a design of a million elements is ten vectors of that length.
        let path = run.file("checkpoint.json");
        Ok(write_atomically(&path, |writer| seal::write(writer, |writer| Ok(serde_json::to_writer(writer, self)?)))?)
    }

    /// Reads `checkpoint.json`. Whether it fits a case is checked by [`Checkpoint::restore`].
    ///
    /// # Errors
    /// [`RunError::NoRun`] where there is none, [`RunError::Damaged`] where it is not of a run of this version.
    pub fn read(run: &RunDirectory) -> Result<Self, RunError> {
        let path = run.file("checkpoint.json");
        if !path.exists() {
            return Err(RunError::NoRun { directory: run.path().to_owned(), file: "checkpoint.json" });
        }
        let bytes = fs::read(&path).map_err(RunError::read(&path))?;
        let damaged = |reason: String| Err(damaged(run, reason));
        let found: Self = match serde_json::from_slice(&bytes) {
            Ok(found) => found,
            Err(error) => return damaged(format!("is not a checkpoint: {error}")),
        };
        if found.format != FORMAT {
            return damaged(format!("has layout {}; this version reads {FORMAT}", found.format));
        }
        if !seal::is_whole(&bytes) {
            return damaged("was changed or damaged after it was written: its SHA-256 is another".into());
        }
        Ok(found)
    }

    /// Puts the state into an optimization of the same case that is at its start.
    ///
    /// # Errors
    /// [`RunError::Damaged`] where a list has another length than the case needs, a value is out of its range, or parts
    /// contradict each other; the optimization is then as before.
    pub fn restore(&self, run: &RunDirectory, optimization: &mut Optimization) -> Result<(), RunError> {
        self.check(optimization.state.x.len()).map_err(|reason| damaged(run, reason))?;
        if self.start_values.is_some() != (optimization.follows_previous_design() && self.state.iteration > 0) {
            return Err(damaged(run, "`start_values` does not fit the case and the number of updates".into()));
        }
        let ranks = optimization.problem.analysis.linear.ranks();
        let guide = self.start_values.as_ref().map(|file| file.read(run, ranks)).transpose();
        let elsewhere = ranks.any(guide.is_err()) && guide.is_ok();
        let guide = guide?;
        if elsewhere {
            return Err(damaged(run, "names start values that another rank could not read".into()));
        }
        optimization.state = self.state.clone();
        optimization.problem.analysis.guide = guide;
        Ok(())
    }

    /// Whether the state is one of `n` design variables; else in what it is not.
    fn check(&self, n: usize) -> Result<(), String> {
        let OptimizationState { iteration, x, x_before, mma, scaling, history } = &self.state;
        let (updates, records, rows) = (*iteration, history.len(), self.newton_rows.len());
        if rows != records || !(records == updates || records.checked_sub(1) == Some(updates)) {
            return Err(format!("{records} evaluated designs do not fit {updates} updates and {rows} row counts"));
        }
        densities("x", x, n)?;
        if let Some(before) = x_before {
            densities("x_before", before, n)?;
        }
        mma.check(n, 1).map_err(|error| format!("`mma`: {error}"))?;
        let parts = [x_before.is_some(), scaling.is_some()];
        if mma.iteration() != updates || parts.contains(&(updates == 0)) {
            return Err(format!("the optimizer's memory does not fit {updates} updates"));
        }
        if let Some(Scaling { objective, constraints }) = scaling {
            let right = |factor: &f64| factor.is_finite() && *factor > 0.0;
            if !right(objective) || constraints.len() != 1 || !constraints.iter().all(right) {
                return Err("`scaling` must be a positive factor of the objective and one of the volume".into());
            }
        }
        for (number, record) in history.iter().enumerate() {
            let measured = [Some(record.objective), Some(record.volume_fraction), record.change, record.optimality];
            let complete = record.iteration == number && record.change.is_some() == (number < updates);
            if !complete || measured.iter().flatten().any(|value| !value.is_finite()) {
                return Err(format!("`history[{number}]` is not the record of iteration {number}"));
            }
        }
        if !self.newton_rows.is_sorted() {
            return Err("`newton_rows` must not fall".into());
        }
        Ok(())
    }
}

/// Whether a list is one of `n` densities.
fn densities(name: &str, list: &[f64], n: usize) -> Result<(), String> {
    if list.len() != n {
        return Err(format!("`{name}` has {} entries; the case has {n} design variables", list.len()));
    }
    match list.iter().position(|value| !(0.0..=1.0).contains(value)) {
        Some(entry) => Err(format!("`{name}[{entry}]` is {:?}, which is no density in [0, 1]", list[entry])),
        None => Ok(()),
    }
}

fn damaged(run: &RunDirectory, reason: String) -> RunError {
    let cure = "start anew with `slipstick optimize CASE --design RESULTS`".into();
    RunError::Damaged { path: run.file("checkpoint.json"), reason, cure }
}
