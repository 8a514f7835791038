//! Errors of a run's directory.

use std::io;
use std::path::{Path, PathBuf};

use crate::output::OutputError;

/// An error of a run's directory; it gives the place and the cure.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The directory already contains a run.
    #[error("{} already contains the results of a run", .directory.display())]
    Exists {
        /// The directory.
        directory: PathBuf,
    },
    /// Another process writes to the directory.
    #[error("another slipstick process is writing to {}", .directory.display())]
    Locked {
        /// The directory.
        directory: PathBuf,
    },
    /// The path cannot become a run's directory.
    #[error("cannot create the directory {}: {reason}", .directory.display())]
    Directory {
        /// The directory.
        directory: PathBuf,
        /// The reason.
        reason: String,
        /// The cure.
        cure: String,
    },
    /// The directory contains no run.
    #[error("there is no {file} in {}", .directory.display())]
    NoRun {
        /// The directory.
        directory: PathBuf,
        /// The file that should be there.
        file: &'static str,
    },
    /// A file of the run that is damaged, missing or not its own.
    #[error("{}: {reason}", .path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
        /// The cure.
        cure: String,
    },
    /// The case is not the one that the run was started with.
    #[error("{} is not the case that this run was started with: its SHA-256 is {found}, not {expected}", .path.display())]
    OtherCase {
        /// The file.
        path: PathBuf,
        /// Hash of the run.
        expected: String,
        /// Hash of the file.
        found: String,
    },
    /// A table of densities that does not match the mesh.
    #[error("{}{}: {reason}", .path.display(), .line.map_or(String::new(), |n| format!(":{n}")))]
    Densities {
        /// The table.
        path: PathBuf,
        /// Line, from 1; `None` for the whole table.
        line: Option<usize>,
        /// What is wrong.
        reason: String,
        /// The cure.
        cure: String,
    },
    /// On ranks other than the first: a file operation failed on the first rank.
    #[error("the first rank failed")]
    FirstRank,
    /// A file cannot be read.
    #[error("cannot read {}: {source}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// A file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

impl RunError {
    /// The cure, for users of the program.
    pub fn cure(&self) -> String {
        match self {
            Self::Exists { .. } => {
                "name another directory with --out, continue with `slipstick resume`, or give --force to replace the \
                 results"
                    .into()
            }
            Self::Locked { .. } => "wait until it ends, stop it, or name another directory with --out".into(),
            Self::Directory { cure, .. } | Self::Damaged { cure, .. } | Self::Densities { cure, .. } => cure.clone(),
            Self::NoRun { file: "checkpoint.json", .. } => {
                "name the directory of an optimization; one that was stopped before its first iteration cannot be \
                 resumed: start it again with --force"
                    .into()
            }
            Self::NoRun { file: "quantities.csv", .. } => "name the directory of a run of `solve` or `optimize`".into(),
            Self::NoRun { file: "history.csv" | "design.csv", .. } => "name the directory of an optimization".into(),
            Self::NoRun { .. } => "name the directory of a run".into(),
            Self::OtherCase { .. } => {
                "restore the original text, or start a new run with `slipstick optimize CASE --design RESULTS`".into()
            }
            Self::Read { .. } => "check the name and the permission to read it".into(),
            Self::Output(OutputError::NotRead { .. }) => "run the analysis again, or choose another result".into(),
            Self::Output(OutputError::OtherTable { .. }) => {
                "restore the table, or start a new run with `slipstick optimize CASE --design RESULTS`".into()
            }
            Self::Output(OutputError::NotFinite { .. }) => {
                "check the case for values near the limits of numbers; `slipstick check` shows its sizes".into()
            }
            Self::FirstRank => "see its message".into(),
            Self::Output(error) => error.cure(),
        }
    }

    /// The operating system refuses to make or change a run's directory.
    pub(super) fn cannot_write(directory: &Path, error: &io::Error) -> Self {
        Self::Directory {
            directory: directory.to_owned(),
            reason: error.to_string(),
            cure: "check the permission to write there, or name another directory with --out".into(),
        }
    }

    /// For `map_err`: the file that could not be read.
    pub fn read(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Read { path, source }
    }
}
