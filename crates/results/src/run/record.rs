//! Who ran what, when, on what machine, and how it ended.

use std::fs;

use serde::{Deserialize, Serialize};

use super::{InputFile, RunDirectory, RunError, clock};
use crate::output::write_atomically;
use slipstick_case::file::{Case, sha256};

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ExitState {
    /// It has not ended: it is running, or was killed.
    Running,
    /// Done.
    Finished,
    /// The analysis failed.
    Failed,
    /// Stopped from outside.
    Interrupted,
}

/// The machine of a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Operating system.
    pub os: String,
    /// Instruction set.
    pub architecture: String,
    /// Cores that the process may use.
    pub cores: usize,
}

impl Machine {
    /// This machine.
    pub fn this() -> Self {
        Self {
            os: std::env::consts::OS.into(),
            architecture: std::env::consts::ARCH.into(),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
        }
    }
}

/// One start of the program on a run: the first, or a resumption.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunPart {
    /// Version of slipstick.
    pub version: String,
    /// The command line.
    pub command: Vec<String>,
    /// Threads.
    pub threads: usize,
    /// The machine.
    pub machine: Machine,
    /// When it started (UTC, RFC 3339).
    pub start: String,
    /// When it ended; `None` while it runs, or if it was killed.
    pub end: Option<String>,
    /// How it ended.
    pub exit: ExitState,
    /// Its final message, if it failed.
    pub message: Option<String>,
}

impl RunPart {
    /// A part that starts now.
    pub fn starting(command: Vec<String>, threads: usize) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            command,
            threads,
            machine: Machine::this(),
            start: clock::now(),
            end: None,
            exit: ExitState::Running,
            message: None,
        }
    }
}

/// The record of a run, `run.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// The latest start of the program.
    #[serde(flatten)]
    pub latest: RunPart,
    /// Earlier starts, oldest first, if the run was resumed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub earlier: Vec<RunPart>,
    /// The case file, as named by the user.
    pub case_file: String,
    /// SHA-256 of the case file's text, in hexadecimal.
    pub case_sha256: String,
    /// The files that the case names; the run keeps copies of them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub inputs: Vec<InputFile>,
    /// The case with all defaults filled in.
    pub case: serde_json::Value,
}

impl RunRecord {
    /// The record of a run that starts now; `text` is the text of the case file `case_file`.
    pub fn starting(part: RunPart, case: &Case, case_file: &str, text: &str) -> Self {
        Self {
            latest: part,
            earlier: Vec::new(),
            case_file: case_file.into(),
            case_sha256: sha256(text),
            inputs: Vec::new(),
            // A resolved case consists of finite numbers, strings and lists, which JSON can
            // represent.
            case: serde_json::to_value(case).unwrap_or_default(),
        }
    }

    /// Another start of the program on the same run.
    pub fn resumed(mut self, part: RunPart) -> Self {
        self.earlier.push(std::mem::replace(&mut self.latest, part));
        self
    }

    /// Marks the run as ended now.
    pub fn end(&mut self, exit: ExitState, message: Option<String>) {
        self.latest.end = Some(clock::now());
        self.latest.exit = exit;
        self.latest.message = message;
    }

    /// Writes `run.json`.
    ///
    /// # Errors
    /// [`RunError::Output`].
    pub fn write(&self, run: &RunDirectory) -> Result<(), RunError> {
        Ok(write_atomically(&run.file("run.json"), |writer| {
            serde_json::to_writer_pretty(&mut *writer, self)?;
            writer.write_all(b"\n")
        })?)
    }

    /// Reads `run.json`.
    ///
    /// # Errors
    /// [`RunError::Read`], [`RunError::Damaged`].
    pub fn read(run: &RunDirectory) -> Result<Self, RunError> {
        let path = run.file("run.json");
        let text = fs::read_to_string(&path).map_err(RunError::read(&path))?;
        serde_json::from_str(&text).map_err(|error| RunError::Damaged {
            path,
            reason: format!("is not the record of a run: {error}"),
            cure: "start the run again".into(),
        })
    }
}
