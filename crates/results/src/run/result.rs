//! Which design a finished optimization returns, if it is not the last one.

use std::fs;

use serde::{Deserialize, Serialize};

use super::{RunDirectory, RunError};
use crate::output::write_atomically;

/// The file `result.json`: it exists only if the result is not the last evaluated design.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ResultRecord {
    /// The iteration of the design in `design.csv`, whose load path is in the files of the path.
    pub iteration: usize,
}

/// Its name.
pub(super) const RESULT: &str = "result.json";

impl ResultRecord {
    /// Reads the file; `None` if the result is the last design.
    ///
    /// # Errors
    /// [`RunError::Read`], [`RunError::Damaged`].
    pub fn read(run: &RunDirectory) -> Result<Option<Self>, RunError> {
        let path = run.file(RESULT);
        if !path.is_file() {
            return Ok(None);
        }
        let text = fs::read_to_string(&path).map_err(RunError::read(&path))?;
        let found = serde_json::from_str(&text).map_err(|error| RunError::Damaged {
            path,
            reason: format!("does not name the iteration of the result: {error}"),
            cure: "run `slipstick optimize` again".into(),
        })?;
        Ok(Some(found))
    }

    /// Writes the file.
    ///
    /// # Errors
    /// [`RunError::Output`].
    pub fn write(self, run: &RunDirectory) -> Result<(), RunError> {
        let text = serde_json::json!(self).to_string();
        Ok(write_atomically(&run.file(RESULT), |writer| writer.write_all(text.as_bytes()))?)
    }

    /// Removes the file, because the run goes on.
    ///
    /// # Errors
    /// [`RunError::Read`] if it exists and cannot be removed.
    pub fn forget(run: &RunDirectory) -> Result<(), RunError> {
        let path = run.file(RESULT);
        if path.exists() { fs::remove_file(&path).map_err(RunError::read(&path)) } else { Ok(()) }
    }
}
