//! The slipstick program.

use clap::Parser;
use slipstick_cli::args::Cli;
use slipstick_cli::exit::Exit;

fn main() -> Exit {
    let line = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    slipstick_cli::run(Cli::parse(), line)
}
