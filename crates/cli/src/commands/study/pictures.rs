//! Pictures and charts of a study.

use std::path::Path;

use super::child;
use super::file::Study as Plan;
use crate::context::Context;
use slipstick_service::failure::{Failure, Outcome};

/// Draws the pictures of finished runs, and the charts whose runs are all finished, for the runs in
/// `asked`.
///
/// # Errors
/// [`Failure::Input`] if a folder cannot be made or a process cannot be started.
pub fn draw(context: &Context, plan: &Plan, done: &[&str], asked: &dyn Fn(&str) -> bool) -> Outcome {
    for picture in &plan.file.pictures {
        if asked(&picture.of) && done.contains(&picture.of.as_str()) {
            one(context, plan, &picture.file, &plan.picture_line(picture))?;
        }
    }
    for chart in &plan.file.charts {
        if chart.of.iter().any(|run| asked(run)) && chart.of.iter().all(|run| done.contains(&run.as_str())) {
            one(context, plan, &chart.file, &plan.chart_line(chart))?;
        }
    }
    Ok(())
}

/// Draws to a file, relative to the study's folder.
fn one(context: &Context, plan: &Plan, file: &Path, line: &[String]) -> Outcome {
    if let Some(folder) = plan.folder.join(file).parent() {
        std::fs::create_dir_all(folder).map_err(|error| {
            Failure::input(format!("cannot create the directory {}: {error}", folder.display()), "check its parent")
        })?;
    }
    let ended = child::run(context, &plan.folder, line)?;
    match ended.error {
        Some(error) => context.console.warning(&format!("{}: {error}", file.display())),
        None => context.console.text(&format!("{} drawn", file.display())),
    }
    Ok(())
}
