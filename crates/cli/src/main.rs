//! The slipstick program.

use slipstick_cli::exit::Exit;
use slipstick_cli::program;

fn main() -> Exit {
    program::main(std::env::args_os().collect(), None)
}
