//! `slipstick report`: writes a run as one web page, and again while the run is in progress.

use std::path::Path;
use std::time::{Duration, SystemTime};

use serde_json::json;
use slipstick::output::write_atomically;
use slipstick::report::{Page, PageOptions, page};
use slipstick::run::RunDirectory;
use slipstick::words::counted;
use slipstick_service::run::OpenRun;

use crate::args::Report;
use crate::context::Context;
use slipstick_service::failure::{Failure, Outcome};
use slipstick_service::memory::bytes;

/// How often the files of a run in progress are looked at, and how often a browser loads its page
/// again. \[s\]
const LOOK: f64 = 0.5;
const RELOAD: f64 = 4.0;

/// Writes the page of a run, once or until the run ends.
///
/// # Errors
/// [`Failure::Input`], [`Failure::Case`].
pub fn run(context: &Context, args: &Report) -> Outcome {
    let directory = RunDirectory::open(&args.results)?;
    let file = args.out.clone().unwrap_or_else(|| directory.file("report.html"));
    if args.out.is_some() && file.exists() && !args.force {
        let cure = "name another file with --out, or give --force to replace it";
        return Err(Failure::input(format!("{} already exists", file.display()), cure));
    }
    let OpenRun { directory, resolved, mesh } = OpenRun::of(directory)?;
    loop {
        let in_progress = args.follow && directory.is_in_progress() && !context.interrupt.requested();
        let before = stamps(&directory);
        let options = PageOptions { reload: in_progress.then_some(RELOAD), ..PageOptions::default() };
        let page = page(&directory, &resolved.case, &mesh, &options)?;
        write_atomically(&file, |writer| writer.write_all(page.html.as_bytes()))?;
        report(context, &file, &page, in_progress);
        if !in_progress {
            return Ok(());
        }
        while stamps(&directory) == before && directory.is_in_progress() && !context.interrupt.requested() {
            std::thread::sleep(Duration::from_secs_f64(LOOK));
        }
    }
}

/// When the files that the page shows were last written.
fn stamps(directory: &RunDirectory) -> [Option<SystemTime>; 6] {
    let files = ["run.json", "checkpoint.json", "history.csv", "path.pvd", "quantities.csv", "warnings.json"];
    files.map(|name| std::fs::metadata(directory.file(name)).and_then(|file| file.modified()).ok())
}

/// Prints what was written; the notes only at the end.
fn report(context: &Context, file: &Path, page: &Page, in_progress: bool) {
    let ([designs, steps], size) = (page.frames, page.html.len());
    let event = if in_progress { "page" } else { "result" };
    context.console.event(
        event,
        json!({
            "command": "report", "file": file, "bytes": size, "designs": designs, "steps": steps, "notes": page.notes,
        }),
    );
    if !in_progress {
        page.notes.iter().for_each(|note| context.console.text(note));
    }
    let size = bytes(size as f64);
    let (designs, steps) = (counted(designs, "design"), counted(steps, "load step"));
    context.console.text(&format!("{designs}, {steps}, {size}: {}", file.display()));
}
