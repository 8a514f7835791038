//! The program as a whole: from its arguments to its exit code, and how it starts itself again.

use std::ffi::OsString;
use std::io::ErrorKind;
use std::process::Command;
use std::sync::OnceLock;

use clap::Parser;
use clap::error::Error;

use crate::Outcome;
use crate::args::Cli;
use crate::console::unless_closed;
use crate::exit::Exit;
use crate::failure::Failure;

/// The words that start this program, if they are not the path of the running executable.
static LAUNCHER: OnceLock<Vec<OsString>> = OnceLock::new();

/// Runs the program with the words of a command line, of which the first is the program's name.
///
/// `launcher` has the words that start this program from another process, for a program that is
/// part of another executable, such as an interpreter; without it, this is the running executable.
pub fn main(line: Vec<OsString>, launcher: Option<Vec<OsString>>) -> Exit {
    if let Some(words) = launcher {
        // the first call decides; a process runs the program once
        let _ = LAUNCHER.set(words);
    }
    let words = line.iter().map(|word| word.to_string_lossy().into_owned()).collect();
    Cli::try_parse_from(line).map_or_else(|error| explain(&error), |cli| crate::run(cli, words))
}

/// Prints help or version if requested, or the error in the command line.
fn explain(error: &Error) -> Exit {
    let written = error.print().or_else(unless_closed);
    if error.use_stderr() || written.is_err() { Exit::BadInput } else { Exit::Ok }
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
