//! Everything that the next iteration of an optimization depends on, stored on disk.

use std::fs;

use serde::{Deserialize, Serialize};

use super::{RunDirectory, RunError, StartValuesFile, seal};
use crate::output::write_atomically;
use slipstick_model::optimize::{Optimization, OptimizationState};
use slipstick_path::Guide;

/// Version of the file layout; files of any other version are rejected.
const FORMAT: u32 = 5;

/// The state of an optimization after a finished iteration, `checkpoint.json`.
///
/// Numbers are written with enough digits to be read back exactly, so a run that continues from
/// here gives the same results as one that was never stopped, bit for bit. The file ends with a
/// hash of everything before it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Checkpoint {
    format: u32,
    /// SHA-256 of the case file's text, in hexadecimal.
    pub case_sha256: String,
    /// Requested number of updates.
    pub iterations: usize,
    /// Number of rows of `newton.csv` after each evaluated design; as long as the state's history.
    pub newton_rows: Vec<usize>,
    /// Start values of the next march, if they come from the previous design: one file for each of
    /// its realizations.
    pub start_values: Vec<StartValuesFile>,
    /// The state.
    pub state: OptimizationState,
}

impl Checkpoint {
    /// A checkpoint of this state.
    pub fn new(case_sha256: String, iterations: usize, newton_rows: Vec<usize>, state: OptimizationState) -> Self {
        Self { format: FORMAT, case_sha256, iterations, newton_rows, start_values: Vec::new(), state }
    }

    /// Drops the evaluation of the last design, if no update has followed it: when the run
    /// continues, that design is evaluated again, with its gradient.
    pub fn reopen(&mut self) {
        self.state.history.truncate(self.state.iteration);
        self.newton_rows.truncate(self.state.iteration);
    }

    /// Writes `checkpoint.json`.
    ///
    /// # Errors
    /// [`RunError::Output`].
    pub fn write(&self, run: &RunDirectory) -> Result<(), RunError> {
        // Compact, because the state of a design with a million elements has about ten vectors of
        // that length.
        let path = run.file("checkpoint.json");
        Ok(write_atomically(&path, |writer| seal::write(writer, |writer| Ok(serde_json::to_writer(writer, self)?)))?)
    }

    /// Reads `checkpoint.json`. [`Checkpoint::restore`] checks whether it matches a case.
    ///
    /// # Errors
    /// [`RunError::NoRun`] if there is none, [`RunError::Damaged`] if it is damaged or was written
    /// by another version.
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
            return damaged("was changed or damaged after it was written: its SHA-256 does not match".into());
        }
        Ok(found)
    }

    /// Restores the state in an optimization of the same case that has not started yet.
    ///
    /// # Errors
    /// [`RunError::Damaged`] if a list does not have the length that the case needs, a value is out
    /// of range, or parts contradict each other; the optimization is then unchanged.
    pub fn restore(&self, run: &RunDirectory, optimization: &mut Optimization) -> Result<(), RunError> {
        self.check(&optimization.state, optimization.function_counts()).map_err(|reason| damaged(run, reason))?;
        let methods = [&self.state, &optimization.state].map(|state| state.optimizer.name());
        if methods[0] != methods[1] {
            return Err(damaged(
                run,
                format!("the optimizer is `{}`; that of the case is `{}`", methods[0], methods[1]),
            ));
        }
        let follows = optimization.follows_previous_design() && self.state.iteration > 0;
        if self.start_values.len() != if follows { optimization.realisations() } else { 0 } {
            return Err(damaged(run, "`start_values` does not match the case and the number of updates".into()));
        }
        let ranks = optimization.problem.analysis.linear.ranks();
        let guides: Vec<Result<Guide, RunError>> = self.start_values.iter().map(|file| file.read(run, ranks)).collect();
        let guides = guides.into_iter().collect::<Result<Vec<Guide>, RunError>>();
        let elsewhere = ranks.any(guides.is_err()) && guides.is_ok();
        let guides = guides?;
        if elsewhere {
            return Err(damaged(run, "refers to start values that another rank could not read".into()));
        }
        optimization.state = self.state.clone();
        optimization.set_guides(guides);
        Ok(())
    }

    /// Checks that the state is valid for an optimization that starts with `start`, and for these
    /// numbers of constraints in the memory of the optimizer and in the scaling; the error says
    /// what is wrong.
    fn check(&self, start: &OptimizationState, [m, scaled]: [usize; 2]) -> Result<(), String> {
        let OptimizationState { iteration, x, x_before, optimizer, scaling, constraints: names, best, history, .. } =
            &self.state;
        let (n, constraints) = (start.x.len(), &start.constraints);
        let (updates, records, rows) = (*iteration, history.len(), self.newton_rows.len());
        if rows != records || !(records == updates || records.checked_sub(1) == Some(updates)) {
            return Err(format!("{records} evaluated designs do not match {updates} updates and {rows} row counts"));
        }
        if names != constraints {
            return Err(format!("the constraints are {names:?}; those of the case are {constraints:?}"));
        }
        let parts = [&self.state, start].map(|state| &state.parts);
        if parts[0] != parts[1] {
            return Err(format!("the parts of the objective are {:?}; those of the case are {:?}", parts[0], parts[1]));
        }
        if self.state.dilated_limit.is_some_and(|limit| !(limit.is_finite() && limit > 0.0)) {
            return Err("`dilated_limit` is not positive".into());
        }
        densities("x", x, n)?;
        if let Some(before) = x_before {
            densities("x_before", before, n)?;
        }
        if let Some(best) = best {
            densities("best.x", &best.x, n)?;
            // after `reopen`, it may be the design that is evaluated again
            if best.iteration > updates {
                return Err(format!("`best` is iteration {}, which was not evaluated", best.iteration));
            }
        }
        if let Some(of) = self.state.interpolation.as_ref().filter(|of| of.from > updates) {
            return Err(format!("`interpolation` is from iteration {}, which was not evaluated", of.from));
        }
        optimizer.check(n, m).map_err(|error| format!("`{}`: {error}", optimizer.name()))?;
        let parts = [x_before.is_some(), scaling.is_some()];
        if optimizer.memory().iteration() != updates || parts.contains(&(updates == 0)) {
            return Err(format!("the optimizer's memory does not match {updates} updates"));
        }
        if scaling.as_ref().is_some_and(|scaling| !scaling.is_valid(scaled)) {
            return Err("`scaling` must have a positive factor for the objective and for each constraint".into());
        }
        for (number, record) in history.iter().enumerate() {
            let functions = record.parts.iter().chain(&record.constraints);
            let of_constraints = functions.flat_map(|of| [Some(of.value), of.multiplier]);
            let measured = [Some(record.objective), Some(record.volume_fraction), record.change, record.optimality];
            let measured: Vec<Option<f64>> = measured.into_iter().chain(of_constraints).collect();
            let complete = record.iteration == number
                && record.change.is_some() == (number < updates)
                && record.parts.len() == self.state.parts.len()
                && record.constraints.len() == names.len();
            if !complete || measured.iter().flatten().any(|value| !value.is_finite()) {
                return Err(format!("`history[{number}]` is not the record of iteration {number}"));
            }
        }
        if !self.newton_rows.is_sorted() {
            return Err("`newton_rows` must not decrease".into());
        }
        Ok(())
    }
}

/// Checks that a list contains `n` densities.
fn densities(name: &str, list: &[f64], n: usize) -> Result<(), String> {
    if list.len() != n {
        return Err(format!("`{name}` has {} entries; the case has {n} design variables", list.len()));
    }
    match list.iter().position(|value| !(0.0..=1.0).contains(value)) {
        Some(entry) => Err(format!("`{name}[{entry}]` is {:?}, which is not a density in [0, 1]", list[entry])),
        None => Ok(()),
    }
}

fn damaged(run: &RunDirectory, reason: String) -> RunError {
    let cure = "start a new run with `slipstick optimize CASE --design RESULTS`".into();
    RunError::Damaged { path: run.file("checkpoint.json"), reason, cure }
}
