//! How the program starts itself again, as another process.

use std::ffi::OsString;
use std::io::ErrorKind;
use std::process::Command;
use std::sync::OnceLock;

use slipstick_service::failure::{Failure, Outcome};

/// The words that start this program, if they are not the path of the running executable.
static LAUNCHER: OnceLock<Vec<OsString>> = OnceLock::new();

/// Sets the words that start this program; the first call decides, since a process runs the program once.
pub(crate) fn set_launcher(words: Vec<OsString>) {
    let _ = LAUNCHER.set(words);
}

/// A command that starts this program, to which the caller adds arguments.
///
/// # Errors
/// [`Failure::Input`] if the program's file is unknown.
pub(crate) fn again() -> Outcome<Command> {
    if let Some([program, words @ ..]) = LAUNCHER.get().map(Vec::as_slice) {
        let mut command = Command::new(program);
        command.args(words);
        return Ok(command);
    }
    let program = std::env::current_exe().map_err(|error| {
        Failure::input(format!("cannot find the program file: {error}"), "start the program by its path")
    })?;
    Ok(Command::new(program))
}

/// The failure of a process that could not be started.
pub(crate) fn refused(error: std::io::Error) -> Failure {
    let cure = match error.kind() {
        ErrorKind::NotFound => "the program's file was moved or replaced since it was started: run this command again",
        _ => "free some memory, or end other processes",
    };
    Failure::input(format!("cannot start a process: {error}"), cure)
}
