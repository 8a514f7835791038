//! `slipstick export --frd`: a load path as a result file of CalculiX.

use std::io;
use std::path::Path;

use serde_json::json;
use slipstick::output::{Frd, read_fields, write_atomically};
use slipstick::run::RunDirectory;
use slipstick::words::counted;
use slipstick_service::failure::{Failure, Outcome};
use slipstick_service::run::OpenRun;

use super::accept;
use crate::args::Export;
use crate::context::Context;

/// Writes the states at the ends of the load steps of a run.
pub(super) fn run(context: &Context, args: &Export, directory: RunDirectory, file: &Path) -> Outcome {
    accept(file, "frd", args.force)?;
    let OpenRun { directory, mesh, .. } = OpenRun::of(directory)?;
    let times = directory.path_times()?;
    // the state before the first step has no results
    let steps: Vec<usize> = directory.numbers("path")?.into_iter().filter(|step| *step > 0).collect();
    if steps.is_empty() {
        let message = format!("{} has no states of a load path", directory.path().display());
        return Err(Failure::input(message, "`slipstick solve` and `slipstick optimize` write them (path.pvd)"));
    }
    // a state that cannot be read is an error of its own, not one of writing
    let mut unread = None;
    let written = write_atomically(file, |writer| {
        let mut frd = Frd::new(&mesh, writer)?;
        for &step in &steps {
            let name = RunDirectory::numbered("path", step);
            let time = times.iter().find(|(file, _)| *file == name).map_or(step as f64, |(_, time)| *time);
            match read_fields(&directory.file(&name)) {
                Ok(fields) => frd.state(step, time, &fields)?,
                Err(error) => {
                    unread = Some(error);
                    return Err(io::Error::other("a state cannot be read"));
                }
            }
        }
        frd.end()
    });
    if let Some(error) = unread {
        return Err(error.into());
    }
    written?;
    context.console.event("result", json!({ "command": "export", "files": [file], "states": steps.len() }));
    context.console.text(&format!("written: {} with {}", file.display(), counted(steps.len(), "state")));
    Ok(())
}
