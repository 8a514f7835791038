//! What can go wrong with a run's directory.

use std::io;
use std::path::{Path, PathBuf};

use crate::output::OutputError;

/// An error about a run's directory: names the place and the cure.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The directory holds a run already.
    #[error("{} holds the results of a run already", .directory.display())]
    Exists {
        /// The directory.
        directory: PathBuf,
    },
    /// Another process writes to the directory.
    #[error("{} is being written by another slipstick", .directory.display())]
    Locked {
        /// The directory.
        directory: PathBuf,
    },
    /// The place cannot become a run's directory.
    #[error("cannot make the directory {}: {reason}", .directory.display())]
    Directory {
        /// The directory.
        directory: PathBuf,
        /// Why not.
        reason: String,
        /// What mends it.
        cure: String,
    },
    /// The directory holds no run.
    #[error("{} holds no {file}", .directory.display())]
    NoRun {
        /// The directory.
        directory: PathBuf,
        /// The file that should be there.
        file: &'static str,
    },
    /// A file of the run that is not what it should be.
    #[error("{}: {reason}", .path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// In what way.
        reason: String,
        /// What mends it.
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
    /// A table of densities that does not fit the mesh.
    #[error("{}{}: {reason}", .path.display(), .line.map_or(String::new(), |n| format!(":{n}")))]
    Densities {
        /// The table.
        path: PathBuf,
        /// Line, from 1; `None` where it is the whole table.
        line: Option<usize>,
        /// What is wrong.
        reason: String,
        /// What mends it.
        cure: String,
    },
    /// On ranks other than the first: the first one could not do its work with files.
    #[error("the first rank failed")]
    FirstRank,
    /// A file cannot be read.
    #[error("cannot read {}: {source}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// A file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

impl RunError {
    /// What mends it, in words for the program's user.
    pub fn cure(&self) -> String {
        match self {
            Self::Exists { .. } => {
                "name another directory with --out, go on with `slipstick resume`, or give --force to replace them"
                    .into()
            }
            Self::Locked { .. } => "wait until it ends, stop it, or name another directory with --out".into(),
            Self::Directory { cure, .. } | Self::Damaged { cure, .. } | Self::Densities { cure, .. } => cure.clone(),
            Self::NoRun { file: "checkpoint.json", .. } => {
                "name the directory that an optimization has written; one that was stopped before its first iteration \
                 has nothing to go on with: start it again with --force"
                    .into()
            }
            Self::NoRun { .. } => "name the directory that an optimization has written".into(),
            Self::OtherCase { .. } => {
                "put the old text back, or start a new run with `slipstick optimize CASE --design RESULTS`".into()
            }
            Self::Read { .. } => "check the name and the permission to read it".into(),
            Self::Output(OutputError::NotRead { .. }) => "run the analysis again, or choose another result".into(),
            Self::Output(OutputError::OtherTable { .. }) => {
                "put the table back as the run left it, or start anew with `slipstick optimize CASE --design RESULTS`"
                    .into()
            }
            Self::FirstRank => "see its message".into(),
            Self::Output(_) => "check the permission to write there and the free space".into(),
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
