//! `slipstick completions` and `slipstick man`: completion scripts and manual pages.

use clap::CommandFactory;

use crate::args::{Cli, Completions, Man};
use crate::context::Context;
use slipstick_service::failure::{Failure, Outcome};

/// Writes the completion script of a shell to standard output.
///
/// # Errors
/// None; the caller checks that standard output could be written.
pub fn run(context: &Context, args: &Completions) -> Outcome {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "slipstick", &mut script);
    context.console.raw(&String::from_utf8_lossy(&script));
    Ok(())
}

/// Writes a manual page (roff) to standard output.
///
/// # Errors
/// [`Failure::Input`] for an unknown command.
pub fn man(context: &Context, args: &Man) -> Outcome {
    let mut program = Cli::command();
    program.build();
    let page = match &args.command {
        None => clap_mangen::Man::new(program),
        Some(name) => {
            let found = program.get_subcommands().find(|command| command.get_name() == name && !command.is_hide_set());
            let command = found.cloned().ok_or_else(|| {
                let cure = "`slipstick --help` lists the commands";
                Failure::input(format!("there is no command `{name}`"), cure)
            })?;
            // Leaked once per run of the program, since clap needs a static name for the command.
            let title: &'static str = Box::leak(format!("slipstick-{name}").into_boxed_str());
            clap_mangen::Man::new(command.name(title))
        }
    };
    let mut text = Vec::new();
    let cannot =
        |error: std::io::Error| Failure::input(format!("cannot make the manual page: {error}"), "please report this");
    page.render(&mut text).map_err(cannot)?;
    context.console.raw(&String::from_utf8_lossy(&text));
    Ok(())
}
