//! All that the next iteration of an optimization depends on, on disk.

use std::fs;

use serde::{Deserialize, Serialize};

use super::{RunDirectory, RunError};
use crate::optimize::OptimizationState;
use crate::output::write_atomically;

/// Version of the file's layout; another one is refused.
const FORMAT: u32 = 1;

/// The state of an optimization after a finished iteration, `checkpoint.json`.
///
/// Numbers are written with as many digits as give the same number back, so that a run that goes on from here gives the
/// same results as one that was never stopped, bit for bit.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Checkpoint {
    format: u32,
    /// SHA-256 of the case file's text, in hexadecimal.
    pub case_sha256: String,
    /// Updates asked for.
    pub iterations: usize,
    /// Rows of `newton.csv` at the end of each evaluated design; as long as the state's history.
    pub newton_rows: Vec<usize>,
    /// The state.
    pub state: OptimizationState,
}

impl Checkpoint {
    /// A checkpoint of this state.
    pub fn new(case_sha256: String, iterations: usize, newton_rows: Vec<usize>, state: OptimizationState) -> Self {
        Self { format: FORMAT, case_sha256, iterations, newton_rows, state }
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
        Ok(write_atomically(&path, |writer| Ok(serde_json::to_writer(writer, self)?))?)
    }

    /// Reads `checkpoint.json`.
    ///
    /// # Errors
    /// [`RunError::NoRun`] where there is none, [`RunError::Damaged`] where it is not of a run of this version.
    pub fn read(run: &RunDirectory) -> Result<Self, RunError> {
        let path = run.file("checkpoint.json");
        if !path.exists() {
            return Err(RunError::NoRun { directory: run.path().to_owned(), file: "checkpoint.json" });
        }
        let text = fs::read_to_string(&path).map_err(RunError::read(&path))?;
        let damaged = |reason: String| {
            let cure = "start anew with `slipstick optimize CASE --design RESULTS`".into();
            RunError::Damaged { path: path.clone(), reason, cure }
        };
        let found: Self = serde_json::from_str(&text).map_err(|e| damaged(format!("is not a checkpoint: {e}")))?;
        if found.format != FORMAT {
            return Err(damaged(format!("has layout {}; this version reads {FORMAT}", found.format)));
        }
        let (rows, records, updates) = (found.newton_rows.len(), found.state.history.len(), found.state.iteration);
        if rows != records || !(updates..=updates + 1).contains(&records) {
            let reason = format!("{records} evaluated designs do not fit {updates} updates and {rows} row counts");
            return Err(damaged(reason));
        }
        Ok(found)
    }
}
