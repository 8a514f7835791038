//! The program `slipstick`, which the wheel installs.

use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs the program with the words of a command line and returns its exit code; `launcher` has the
/// words that start it from another process.
#[pyfunction]
pub fn main(py: Python<'_>, line: Vec<OsString>, launcher: Vec<OsString>) -> u8 {
    py.detach(|| slipstick_cli::program::main(line, Some(launcher)) as u8)
}
