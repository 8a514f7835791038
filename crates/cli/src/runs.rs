//! How runs start, and who watches them.

use std::path::{Component, Path};

use slipstick::build::Problem;
use slipstick::run::{NewtonTable, Run, RunError, on_first};
use slipstick_service::run;
pub use slipstick_service::run::{end, failed};

use crate::args::Out;
use crate::context::Context;
use crate::setup::Setup;
use crate::watch::Watch;
use slipstick_service::failure::{Failure, Outcome};

/// Watches analyses of a problem, with `newton.csv` in the run of the first rank. All ranks call
/// it.
///
/// # Errors
/// [`Failure::Input`] if the table cannot be written.
pub fn watch<'a>(context: &'a Context, problem: &Problem, run: Option<&Run>) -> Outcome<Watch<'a>> {
    let watch = Watch::new(context, problem);
    let table = first(problem, || run.map(|run| NewtonTable::open(run.directory(), 0)).transpose())?.flatten();
    Ok(match table {
        Some(table) => watch.with_table(table),
        None => watch,
    })
}

/// Performs file operations on the first rank; all ranks call it, and succeed or fail together.
///
/// # Errors
/// [`Failure::Input`].
pub fn first<T>(problem: &Problem, work: impl FnOnce() -> Result<T, RunError>) -> Outcome<Option<T>> {
    Ok(on_first(problem.analysis.linear.ranks(), work)?)
}

/// Refuses the root and the current or parent folder, in which `what` would lie among other files.
///
/// # Errors
/// [`Failure::Input`], with an example.
pub fn refuse_shared(path: &Path, what: &str, example: &str) -> Outcome {
    let current = || Some(path.canonicalize().ok()? == std::env::current_dir().ok()?.canonicalize().ok()?);
    if matches!(path.components().next_back(), Some(Component::Normal(_))) && current() != Some(true) {
        return Ok(());
    }
    Err(Failure::input(
        format!("{} is no folder of its own: {what} would lie among other files", path.display()),
        format!("name a folder for the {what}, for instance `{example}`"),
    ))
}

/// Starts a run in its own directory; `None` on ranks other than the first.
///
/// # Errors
/// [`Failure::Input`] if the directory contains a run or cannot be written.
pub fn start(context: &Context, setup: &Setup, out: &Out, command: &str) -> Outcome<Option<Run>> {
    context.parallel.first(|| {
        let path = setup.directory(out, command);
        refuse_shared(&path, "results", "--out results")?;
        // a run that may overwrite files must not remove the design that it starts from
        if setup.replaces_design(&path) {
            return Err(Failure::input(
                format!("{} contains the requested design, which the results would replace", path.display()),
                "name another directory for the results with --out",
            ));
        }
        run::start(context, &setup.checked, (command, &setup.file), &path, out.force)
    })
}
