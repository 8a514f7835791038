//! Why a request failed.

use std::path::PathBuf;

use slipstick::build::BuildError;
use slipstick::case::{CaseDiagnostic, CaseErrors, Severity, SourceMap};
use slipstick::export::ExportError;
use slipstick::output::OutputError;
use slipstick::part::PartError;
use slipstick::picture::PictureError;
use slipstick::run::{ExitState, FailureReport, RunError};
use slipstick::words::shell_word;

/// Why a request failed. The program renders it as text, an event and its exit status, the Python
/// package as an exception.
#[derive(Debug)]
pub enum Failure {
    /// The case file has errors.
    Case(Vec<CaseDiagnostic>),
    /// Other input is wrong: a file, a directory, an option.
    Input {
        /// What is wrong, and where.
        message: String,
        /// The remedy.
        cure: String,
    },
    /// The analysis failed.
    Analysis {
        /// Where and why, what was tried, and what may help.
        report: Box<FailureReport>,
        /// The results that were kept, and where they are.
        kept: String,
    },
    /// A verification found a discrepancy, or could not compare anything.
    Check {
        /// Its result.
        message: String,
        /// The remedy.
        cure: String,
    },
    /// Stopped by the user.
    Interrupted {
        /// The progress so far.
        message: String,
        /// The directory from which `slipstick resume` continues.
        resume: Option<PathBuf>,
    },
}

impl Failure {
    /// Makes an error about input other than a case file.
    pub fn input(message: impl Into<String>, cure: impl Into<String>) -> Self {
        Self::Input { message: message.into(), cure: cure.into() }
    }

    /// An error from building the model, at its place in the case file.
    pub fn build(error: &BuildError, map: &SourceMap) -> Self {
        Self::Case(vec![map.diagnostic(Severity::Error, &error.path, error.code, &error.message, &error.help)])
    }

    /// The exit state in the run's record.
    pub fn state(&self) -> ExitState {
        match self {
            Self::Interrupted { .. } => ExitState::Interrupted,
            _ => ExitState::Failed,
        }
    }

    /// The complete message, without colours.
    pub fn text(&self) -> String {
        match self {
            Self::Case(diagnostics) => {
                let lines: Vec<String> = diagnostics.iter().map(CaseDiagnostic::plain).collect();
                lines.join("\n")
            }
            Self::Input { message, cure } | Self::Check { message, cure } => {
                format!("error: {message}\n    help: {cure}")
            }
            Self::Analysis { report, kept } => format!("error: {report}\n    kept: {kept}"),
            Self::Interrupted { message, resume: None } => format!("interrupted: {message}"),
            Self::Interrupted { message, resume: Some(directory) } => {
                format!(
                    "interrupted: {message}\n    continue with: slipstick resume {}",
                    shell_word(&directory.display().to_string())
                )
            }
        }
    }
}

impl From<CaseErrors> for Failure {
    fn from(errors: CaseErrors) -> Self {
        Self::Case(errors.diagnostics().to_vec())
    }
}

impl From<RunError> for Failure {
    fn from(error: RunError) -> Self {
        Self::Input { message: error.to_string(), cure: error.cure() }
    }
}

impl From<PictureError> for Failure {
    fn from(error: PictureError) -> Self {
        Self::Input { message: error.to_string(), cure: error.cure() }
    }
}

impl From<PartError> for Failure {
    fn from(error: PartError) -> Self {
        Self::Input { message: error.to_string(), cure: error.cure() }
    }
}

impl From<ExportError> for Failure {
    fn from(error: ExportError) -> Self {
        Self::Input { message: error.to_string(), cure: error.cure() }
    }
}

impl From<OutputError> for Failure {
    fn from(error: OutputError) -> Self {
        RunError::from(error).into()
    }
}

/// The result of a request.
pub type Outcome<T = ()> = Result<T, Failure>;
