//! `slipstick render`: results as a picture.

use std::path::Path;

use serde_json::json;
use slipstick::build::build_mesh;
use slipstick::render::{Canvas, RenderError};
use slipstick::run::{PictureError, PictureRequest, RunDirectory, Shown, picture};

use crate::args::Render;
use crate::failure::Failure;
use crate::setup::read;
use crate::{Context, Outcome};

/// The first bytes of every PNG file.
const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Draws a result of a run.
///
/// # Errors
/// [`Failure::Input`], [`Failure::Case`].
pub fn run(context: &Context, args: &Render) -> Outcome {
    let directory = RunDirectory::open(&args.results)?;
    let file = args.out.clone().unwrap_or_else(|| directory.file("picture.png"));
    replaceable(&file)?;
    let resolved = read(&directory.file("case.toml").as_path().into())?;
    let mesh = build_mesh(&resolved.case).map_err(|error| Failure::build(&error, &resolved.source_map))?;
    let shown = match (args.step, args.iteration) {
        (Some(step), _) => Shown::Step(step),
        (None, Some(iteration)) => Shown::Iteration(iteration),
        (None, None) if args.failure => Shown::Failure,
        (None, None) => Shown::Newest,
    };
    let (field, threshold) = if args.failure { ("smallest_determinant", Some(0.0)) } else { ("density", None) };
    let field = args.field.as_deref().unwrap_or(field);
    let (width, height) = args.size;
    let request = PictureRequest {
        field: field.to_owned(),
        shown,
        view: args.view.clone(),
        displacement_factor: args.deformed,
        threshold: args.threshold.or(threshold),
        smooth: args.smooth,
        canvas: Canvas { width, height, ..Canvas::default() },
    };
    let picture = picture(&directory, &resolved.case, &mesh, &request)?;
    picture.save_png(&file).map_err(|error| match error {
        RenderError::Output(error) => Failure::from(error),
        other => PictureError::from(other).into(),
    })?;
    let told = json!({ "command": "render", "file": file, "field": field, "width": width, "height": height });
    context.console.event("result", told);
    context.console.text(&format!("{field} in {}", file.display()));
    Ok(())
}

/// Refuses to replace what is no picture.
fn replaceable(file: &Path) -> Outcome {
    if !file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png")) {
        let message = format!("{} does not end in .png", file.display());
        return Err(Failure::input(message, "pictures are PNG files: give --out a name that says so"));
    }
    let mut start = [0; SIGNATURE.len()];
    let found = std::fs::File::open(file).and_then(|mut open| std::io::Read::read_exact(&mut open, &mut start));
    if file.exists() && (found.is_err() || start != SIGNATURE) {
        let message = format!("{} exists and is no picture", file.display());
        return Err(Failure::input(message, "name another file with --out"));
    }
    Ok(())
}
