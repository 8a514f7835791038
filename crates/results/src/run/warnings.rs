//! The warnings of a run, for those who read its results later.

use std::fs;

use serde::{Deserialize, Serialize};

use super::{RunDirectory, RunError};
use crate::output::write_atomically;

/// A warning that a run gave. A run without warnings, and one of an earlier version, has no
/// `warnings.json`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunWarning {
    /// What is suspicious.
    pub message: String,
    /// What helps, if this is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub help: Option<String>,
    /// Whether it is about the result of an optimization: it no longer holds if the run is resumed.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub of_result: bool,
}

/// Its name.
pub(super) const WARNINGS: &str = "warnings.json";

impl RunWarning {
    /// The warnings of a run, in the order in which it gave them.
    ///
    /// # Errors
    /// [`RunError::Read`], [`RunError::Damaged`].
    pub fn read(run: &RunDirectory) -> Result<Vec<Self>, RunError> {
        let path = run.file(WARNINGS);
        if !path.is_file() {
            return Ok(Vec::new());
        }
        let text = fs::read_to_string(&path).map_err(RunError::read(&path))?;
        serde_json::from_str(&text).map_err(|error| RunError::Damaged {
            path,
            reason: format!("is not a list of warnings: {error}"),
            cure: "remove it; only the report reads it".into(),
        })
    }

    /// Writes `warnings.json`, completely or not at all.
    ///
    /// # Errors
    /// [`RunError::Output`].
    pub fn write(all: &[Self], run: &RunDirectory) -> Result<(), RunError> {
        Ok(write_atomically(&run.file(WARNINGS), |writer| {
            serde_json::to_writer_pretty(&mut *writer, all)?;
            writer.write_all(b"\n")
        })?)
    }
}
