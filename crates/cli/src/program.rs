//! The program as a whole: from its arguments to its exit code.

use std::ffi::OsString;

use clap::Parser;
use clap::error::Error;

use crate::args::Cli;
use crate::console::unless_closed;
use crate::exit::Exit;
use crate::process;

/// Runs the program with the words of a command line, of which the first is the program's name.
///
/// `launcher` has the words that start this program from another process, for a program that is
/// part of another executable, such as an interpreter; without it, this is the running executable.
pub fn main(line: Vec<OsString>, launcher: Option<Vec<OsString>>) -> Exit {
    if let Some(words) = launcher {
        process::set_launcher(words);
    }
    let words = line.iter().map(|word| word.to_string_lossy().into_owned()).collect();
    Cli::try_parse_from(line).map_or_else(|error| explain(&error), |cli| crate::run(cli, words))
}

/// Prints help or version if requested, or the error in the command line.
fn explain(error: &Error) -> Exit {
    let written = error.print().or_else(unless_closed);
    if error.use_stderr() || written.is_err() { Exit::BadInput } else { Exit::Ok }
}
