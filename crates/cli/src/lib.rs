//! The parts of the slipstick program.
//!
//! [`run`] executes a command line. The program renders what `slipstick_service` and the library do: as
//! text and events, and as an exit status.

pub mod args;
pub mod clock;
pub mod commands;
pub mod console;
pub mod context;
pub mod diagnostics;
pub mod exit;
mod host;
pub mod interrupt;
pub mod parallel;
mod process;
pub mod program;
pub mod runs;
pub mod setup;
pub mod summary;
pub mod table;
mod ui;
pub mod watch;

use args::{Cli, Command, VerifyWhat};
use console::Console;
use context::Context;
use exit::Exit;
use interrupt::Interrupt;
use parallel::Parallel;
use slipstick_service::failure::{Failure, Outcome};

/// Executes the command line.
pub fn run(cli: Cli, line: Vec<String>) -> Exit {
    let mut console = Console::new(&cli.common);
    let parallel = match Parallel::join() {
        Ok(parallel) => parallel,
        Err(failure) => {
            console.failure(&failure);
            return Exit::from(&failure);
        }
    };
    if !parallel.leads() {
        console.silence();
    }
    // other commands end at once: each file is written atomically, and a part is complete once it has its case
    let interrupt = if runs(&cli.command) { Interrupt::install(parallel.leads()) } else { Interrupt::default() };
    let context = Context { console, interrupt, parallel, common: cli.common, line };
    let result = context.parallel.guard(|| execute(&context, &cli.command).and_then(|()| context.console.check()));
    if let Err(failure) = &result {
        context.console.failure(failure);
    }
    context.parallel.leave(&context.console, &result);
    result.map_or_else(|failure| Exit::from(&failure), |()| Exit::Ok)
}

/// Whether a command stops in order, within an iteration or after a run, once the user interrupts it.
fn runs(command: &Command) -> bool {
    match command {
        Command::Solve(_)
        | Command::Gradient(_)
        | Command::Optimize(_)
        | Command::Resume(_)
        | Command::Evaluate(_)
        | Command::Study(_)
        | Command::Report(_)
        | Command::Bench(_)
        | Command::Verify(_) => true,
        Command::New(_)
        | Command::Check(_)
        | Command::Render(_)
        | Command::Export(_)
        | Command::Explain(_)
        | Command::Schema(_)
        | Command::Completions(_)
        | Command::Ui(_)
        | Command::Man(_) => false,
    }
}

fn execute(context: &Context, command: &Command) -> Outcome {
    let divided = matches!(
        command,
        Command::Solve(_)
            | Command::Gradient(_)
            | Command::Optimize(_)
            | Command::Resume(_)
            | Command::Verify(_)
            | Command::Bench(_)
    );
    if context.parallel.size() > 1 && !divided {
        return Err(Failure::input("this command runs on one rank", "start it without mpirun"));
    }
    match command {
        Command::New(args) => commands::new::run(context, args),
        Command::Check(args) => commands::check::run(context, args),
        Command::Solve(args) => commands::solve::run(context, args),
        Command::Gradient(args) => commands::gradient::run(context, args),
        Command::Optimize(args) => commands::optimize::run(context, args),
        Command::Resume(args) => commands::resume::run(context, args),
        Command::Evaluate(args) => commands::evaluate::run(context, args),
        Command::Render(args) => commands::render::run(context, args),
        Command::Study(args) => commands::study::run(context, args),
        Command::Report(args) => commands::report::run(context, args),
        Command::Ui(args) => ui::run(context, args),
        Command::Export(args) => commands::export::run(context, args),
        Command::Explain(args) => commands::explain::run(context, args),
        Command::Schema(args) => commands::schema::run(context, args),
        Command::Completions(args) => commands::completions::run(context, args),
        Command::Man(args) => commands::completions::man(context, args),
        Command::Bench(args) => commands::bench::run(context, args),
        Command::Verify(args) => match &args.what {
            VerifyWhat::Gradient(args) => commands::verify::run(context, args),
            VerifyWhat::Deck(args) => commands::verify_deck::run(context, args),
        },
    }
}
