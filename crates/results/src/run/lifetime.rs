//! The life of a run: started or resumed, in progress, ended.

use std::path::Path;

use super::{ExitState, RunDirectory, RunError, RunPart, RunRecord, keep_mesh_files};
use crate::output::write_atomically;
use slipstick_case::file::{ReadFile, Resolved};

/// A run in progress: its directory, locked against other processes, and its record.
#[derive(Debug)]
pub struct Run {
    directory: RunDirectory,
    record: RunRecord,
}

impl Run {
    /// Starts a run of a case in its own directory, with copies of the case and of its mesh files;
    /// `case_file` is the file that the case was read from, and `files` reads the files that it
    /// names. With `force`, the files of an earlier run are removed.
    ///
    /// # Errors
    /// As [`RunDirectory::create`]; [`RunError::Read`] and [`RunError::Output`] if files cannot be
    /// copied.
    pub fn start(
        path: &Path,
        resolved: &Resolved,
        case_file: &Path,
        files: ReadFile<'_>,
        part: RunPart,
        force: bool,
    ) -> Result<Self, RunError> {
        let directory = RunDirectory::create(path, force)?.writing(&resolved.case.output);
        let text = resolved.source_map.text();
        let mut record = RunRecord::starting(part, &resolved.case, &case_file.display().to_string(), text);
        // This file comes first: it marks the directory as that of a run, in case this process is
        // killed before it has written the others.
        record.write(&directory)?;
        write_atomically(&directory.file("case.toml"), |writer| writer.write_all(text.as_bytes()))?;
        record.inputs = keep_mesh_files(&directory, &resolved.case, case_file, files)?;
        record.write(&directory)?;
        Ok(Self { directory, record })
    }

    /// Resumes an earlier run, whose directory this process has locked.
    ///
    /// # Errors
    /// [`RunError::Output`] if the record cannot be written.
    pub fn take_up(directory: RunDirectory, record: RunRecord, part: RunPart) -> Result<Self, RunError> {
        let record = record.resumed(part);
        record.write(&directory)?;
        Ok(Self { directory, record })
    }

    /// Its directory.
    pub fn directory(&self) -> &RunDirectory {
        &self.directory
    }

    /// SHA-256 of the case's text.
    pub fn case_sha256(&self) -> &str {
        &self.record.case_sha256
    }

    /// Records how the run ended.
    ///
    /// # Errors
    /// [`RunError::Output`] if the record cannot be written.
    pub fn end(mut self, exit: ExitState, message: Option<String>) -> Result<(), RunError> {
        self.record.end(exit, message);
        self.record.write(&self.directory)
    }
}
