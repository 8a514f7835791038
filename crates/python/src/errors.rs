//! Failures as Python exceptions, with the program's text and the data behind it.
//!
//! The classes are those of `slipstick.errors`, which are written in Python so that they can carry
//! attributes.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;

use pyo3::exceptions::{PyKeyboardInterrupt, PyOSError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;
use slipstick::analysis::AnalysisError;
use slipstick::build::{BuildError, Problem};
use slipstick::case::{CaseDiagnostic, CaseErrors, SourceMap};
use slipstick::run::{FailureReport, RunError, keep_failure};
use slipstick_service::failure::Failure;
use slipstick_service::read::object;

/// Why a call fails. Data for an exception, which is only made once the interpreter is attached.
pub enum Error {
    /// Errors in the case.
    Case(Vec<CaseDiagnostic>),
    /// Other invalid input: the problem and the remedy.
    Input { message: String, cure: String },
    /// A file error from the operating system, and what was attempted.
    Os { what: &'static str, path: PathBuf, error: std::io::Error },
    /// The analysis failed.
    Analysis(Box<FailureReport>),
    /// An exception of a callback, or of the user's signal handler.
    Python(PyErr),
    /// Ctrl-C, with a note on what is kept.
    Interrupted(String),
    /// A defect of slipstick.
    Internal(String),
}

impl Error {
    /// Wrong input other than a case.
    pub fn input(message: impl Into<String>, cure: impl Into<String>) -> Self {
        Self::Input { message: message.into(), cure: cure.into() }
    }

    /// An error found while building, at its place in the case.
    pub fn build(error: &BuildError, map: &SourceMap) -> Self {
        Failure::build(error, map).into()
    }

    /// The failed analysis of a problem.
    pub fn analysis(problem: &Problem, error: &AnalysisError) -> Self {
        Self::Analysis(keep_failure(None, problem, error).0)
    }
}

impl From<Failure> for Error {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Case(diagnostics) => Self::Case(diagnostics),
            Failure::Input { message, cure } | Failure::Check { message, cure } => Self::Input { message, cure },
            Failure::Analysis { report, .. } => Self::Analysis(report),
            Failure::Interrupted { message, .. } => Self::Interrupted(message),
        }
    }
}

impl From<CaseErrors> for Error {
    fn from(errors: CaseErrors) -> Self {
        Self::Case(errors.diagnostics().to_vec())
    }
}

impl From<RunError> for Error {
    fn from(error: RunError) -> Self {
        Self::Input { cure: error.cure(), message: error.to_string() }
    }
}

impl From<PyErr> for Error {
    fn from(error: PyErr) -> Self {
        Self::Python(error)
    }
}

/// Runs `work` without the interpreter and turns its failure, or its panic, into an exception.
///
/// # Errors
/// The exception.
pub fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> Result<T, Error> + Send) -> PyResult<T> {
    py.detach(|| catch_unwind(AssertUnwindSafe(work)))
        .unwrap_or_else(|panic| {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("unknown");
            Err(Error::Internal(text.to_owned()))
        })
        .map_err(|error| error.raise(py))
}

impl Error {
    /// The exception.
    pub fn raise(self, py: Python<'_>) -> PyErr {
        self.exception(py).unwrap_or_else(|error| error)
    }

    fn exception(self, py: Python<'_>) -> PyResult<PyErr> {
        let data = PyDict::new(py);
        let (class, text) = match self {
            Self::Case(diagnostics) => {
                let lines: Vec<String> = diagnostics.iter().map(CaseDiagnostic::plain).collect();
                data.set_item("diagnostics", diagnostics_as_json(&diagnostics))?;
                ("CaseError", lines.join("\n"))
            }
            Self::Input { message, cure } => {
                data.set_item("help", &cure)?;
                ("InputError", if cure.is_empty() { message } else { format!("{message}\n    help: {cure}") })
            }
            Self::Analysis(report) => {
                data.set_item("report", serde_json::to_string(&*report).unwrap_or_default())?;
                ("AnalysisError", report.to_string())
            }
            Self::Internal(text) => {
                ("InternalError", format!("slipstick has failed: {text}\n    help: please report this, with the case"))
            }
            Self::Os { what, path, error } => {
                let reason = error.to_string();
                return Ok(match error.raw_os_error() {
                    // with an error number, Python chooses the subclass, such as
                    // FileNotFoundError, and adds the path
                    Some(number) => {
                        let reason = reason.trim_end_matches(&format!(" (os error {number})"));
                        PyOSError::new_err((number, format!("{what}: {reason}"), path))
                    }
                    None => PyOSError::new_err(format!("{what} {}: {reason}", path.display())),
                });
            }
            Self::Python(error) => return Ok(error),
            Self::Interrupted(kept) => return Ok(PyKeyboardInterrupt::new_err(kept)),
        };
        let value = class_of(py, class)?.call_method("_of", (text,), Some(&data))?;
        Ok(PyErr::from_value(value))
    }
}

fn class_of<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    static MODULE: PyOnceLock<Py<PyModule>> = PyOnceLock::new();
    let module = MODULE.get_or_try_init(py, || py.import("slipstick.errors").map(Bound::unbind))?;
    module.bind(py).getattr(name)
}

/// Diagnostics as a JSON list of the objects that the program prints with `--json`.
pub fn diagnostics_as_json(diagnostics: &[CaseDiagnostic]) -> String {
    serde_json::Value::from(diagnostics.iter().map(object).collect::<Vec<_>>()).to_string()
}
