//! `slipstick report`: writes a run as one web page.

use serde_json::json;
use slipstick::build::build_mesh;
use slipstick::output::write_atomically;
use slipstick::report::{PageOptions, page};
use slipstick::run::RunDirectory;
use slipstick::words::counted;

use super::bytes;
use crate::args::Report;
use crate::failure::Failure;
use crate::setup::read;
use crate::{Context, Outcome};

/// Writes the page of a run.
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
    let resolved = read(&directory.file("case.toml").as_path().into())?;
    let mesh = build_mesh(&resolved.case).map_err(|error| Failure::build(&error, &resolved.source_map))?;
    let page = page(&directory, &resolved.case, &mesh, &PageOptions::default())?;
    write_atomically(&file, |writer| writer.write_all(page.html.as_bytes()))?;
    let ([designs, steps], size) = (page.frames, page.html.len());
    context.console.event(
        "result",
        json!({
            "command": "report", "file": file, "bytes": size, "designs": designs, "steps": steps, "notes": page.notes,
        }),
    );
    page.notes.iter().for_each(|note| context.console.text(note));
    let size = bytes(size as f64);
    let (designs, steps) = (counted(designs, "design"), counted(steps, "load step"));
    context.console.text(&format!("{designs}, {steps}, {size}: {}", file.display()));
    Ok(())
}
