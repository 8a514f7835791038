//! The context of a command.

use crate::args;
use crate::console::Console;
use crate::interrupt::Interrupt;
use crate::parallel::Parallel;

/// The context of every command.
pub struct Context {
    /// Output of text and events.
    pub console: Console,
    /// Whether the user wants to stop.
    pub interrupt: Interrupt,
    /// The other ranks, if any.
    pub parallel: Parallel,
    /// Options of every command.
    pub common: args::Common,
    /// The command line, for the record of a run.
    pub line: Vec<String>,
}
