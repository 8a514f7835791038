//! The slipstick program.

use clap::Parser;
use clap::error::Error;
use slipstick_cli::args::Cli;
use slipstick_cli::console::unless_closed;
use slipstick_cli::exit::Exit;

fn main() -> Exit {
    let line = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    Cli::try_parse().map_or_else(|error| explain(&error), |cli| slipstick_cli::run(cli, line))
}

/// Prints help or version if requested, or the error in the command line.
fn explain(error: &Error) -> Exit {
    let written = error.print().or_else(unless_closed);
    if error.use_stderr() || written.is_err() { Exit::BadInput } else { Exit::Ok }
}
