//! `slipstick render`: draws results as a picture.

use std::path::{Path, PathBuf};

use serde_json::json;
use slipstick::case::Case;
use slipstick::charts::{axis, objective_axis, requested};
use slipstick::picture::{Drawn, PictureError, PictureRequest, Shown, picture};
use slipstick::render::{Canvas, ObjectiveAxis, Picture, RenderError, RunHistory, histories_picture};
use slipstick::render::{curves_picture, is_table, read_curves, read_histories};
use slipstick::run::RunDirectory;
use slipstick_service::run::OpenRun;

use crate::args::Render;
use crate::context::Context;
use crate::setup::read;
use slipstick_service::failure::{Failure, Outcome};

/// The first bytes of every PNG file.
const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Draws a result of a run, or the histories or curves of several.
///
/// # Errors
/// [`Failure::Input`], [`Failure::Case`].
pub fn run(context: &Context, args: &Render) -> Outcome {
    if args.history {
        return histories(context, args);
    }
    if let [x, y] = &args.curve[..] {
        return curves(context, args, [x, y]);
    }
    if args.title.is_some() {
        return Err(Failure::input("only charts have titles", "add --history or --curve, or omit --title"));
    }
    let [results] = &args.results[..] else {
        let message = format!("{} results were given for one picture", args.results.len());
        return Err(Failure::input(message, "give one directory, or draw the histories of all with --history"));
    };
    if is_table(results) {
        let message = format!("{} is a table; only its history can be drawn", results.display());
        return Err(Failure::input(message, "add --history, or give the directory of a run"));
    }
    let directory = RunDirectory::open(results)?;
    let file = args.out.clone().unwrap_or_else(|| directory.file("picture.png"));
    replaceable(&file, "--out")?;
    let OpenRun { directory, resolved, mesh } = OpenRun::of(directory)?;
    let shown = match (args.step, args.iteration) {
        (Some(step), _) => Shown::Step(step),
        (None, Some(iteration)) => Shown::Iteration(iteration),
        (None, None) if args.failure => Shown::Failure,
        (None, None) => Shown::Newest,
    };
    let threshold = args.failure.then_some(0.0);
    let (width, height) = args.size;
    let request = PictureRequest {
        field: args.field.clone(),
        shown,
        view: args.view.clone(),
        displacement_factor: args.deformed,
        threshold: args.threshold.or(threshold),
        smooth: args.smooth,
        bodies: (!args.bodies.is_empty()).then(|| args.bodies.clone()),
        marks: !args.plain,
        canvas: Canvas { width, height, ..Canvas::default() },
    };
    let Drawn { picture, field, why } = picture(&directory, &resolved.case, &mesh, &request)?;
    save(&picture, &file)?;
    let told = json!({ "command": "render", "file": file, "field": field, "width": width, "height": height });
    context.console.event("result", told);
    let why = why.map_or(String::new(), |why| format!(" ({why}; --field draws another field)"));
    context.console.text(&format!("{field} in {}{why}", file.display()));
    Ok(())
}

pub(super) fn save(picture: &Picture, file: &Path) -> Outcome {
    picture.save_png(file).map_err(|error| match error {
        RenderError::Output(error) => Failure::from(error),
        other => PictureError::from(other).into(),
    })
}

/// Draws the histories of runs in one chart.
fn histories(context: &Context, args: &Render) -> Outcome {
    let file = chart_file(args, "history.png")?;
    let runs = chosen(named(&args.results)?, &args.runs)?;
    let cases = cases(&args.results);
    let (limit, objective) = (common_limit(&cases), common_objective(&cases));
    let (width, height) = args.size;
    let canvas = Canvas { width, height, ..Canvas::default() };
    save(
        &histories_picture(args.title.as_deref(), &runs, &objective, limit, &canvas).map_err(PictureError::from)?,
        &file,
    )?;
    let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
    let told = json!({ "command": "render", "file": file, "runs": names, "width": width, "height": height });
    context.console.event("result", told);
    context.console.text(&format!("histories of {} in {}", names.join(", "), file.display()));
    Ok(())
}

/// Draws one quantity over another, for all runs in one chart.
fn curves(context: &Context, args: &Render, [x, y]: [&str; 2]) -> Outcome {
    let file = chart_file(args, "curve.png")?;
    let cases = cases(&args.results);
    let mut all = Vec::new();
    for (results, name) in args.results.iter().zip(short_names(&args.results)) {
        all.extend(read_curves(results, &name, x, y)?);
    }
    if let ([run], [Some(case)]) = (&args.results[..], &cases[..])
        && let Some(requested) = requested(run, case, [x, y])?
    {
        if let [reached] = &mut all[..] {
            reached.name = "Reached".into();
        }
        all.push(requested);
    }
    let names = [x, y].map(|column| {
        let words = |case: &Option<Case>| case.as_ref().map_or_else(|| column.to_owned(), |case| axis(case, column));
        let first = cases.first().map_or_else(|| column.to_owned(), words);
        // runs with different words for the same column
        if cases.iter().all(|case| words(case) == first) { first } else { column.to_owned() }
    });
    let (width, height) = args.size;
    let canvas = Canvas { width, height, ..Canvas::default() };
    let names = [names[0].as_str(), names[1].as_str()];
    save(&curves_picture(args.title.as_deref(), &all, names, &canvas).map_err(PictureError::from)?, &file)?;
    let told = json!({ "command": "render", "file": file, "curve": [x, y], "width": width, "height": height });
    context.console.event("result", told);
    context.console.text(&format!("{y} over {x} in {}", file.display()));
    Ok(())
}

/// The file for a chart: as requested, or in the only directory.
fn chart_file(args: &Render, name: &str) -> Outcome<PathBuf> {
    let file = match (&args.out, &args.results[..]) {
        (Some(file), _) => file.clone(),
        (None, [results]) if results.is_dir() => results.join(name),
        _ => {
            let message = "the chart needs a file name";
            return Err(Failure::input(message, format!("give one with --out, for instance --out {name}")));
        }
    };
    replaceable(&file, "--out")?;
    Ok(file)
}

/// The paths without the folders that all of them lead through.
fn short_names(results: &[PathBuf]) -> Vec<String> {
    let parts = |path: &PathBuf| path.components().map(|part| part.as_os_str().to_owned()).collect::<Vec<_>>();
    let all: Vec<Vec<_>> = results.iter().map(parts).collect();
    let shared = |at: usize| all.iter().all(|one| at + 1 < one.len() && one[at] == all[0][at]);
    let common = (0..).take_while(|&at| shared(at)).count();
    let rest = |parts: &Vec<_>| parts[common..].iter().collect::<PathBuf>().display().to_string();
    all.iter().map(rest).collect()
}

/// All histories of the results. Runs with the same name are distinguished by their paths.
fn named(results: &[PathBuf]) -> Outcome<Vec<RunHistory>> {
    let mut all: Vec<(&Path, String, RunHistory)> = Vec::new();
    for (place, name) in results.iter().zip(short_names(results)) {
        all.extend(read_histories(place)?.into_iter().map(|history| (place.as_path(), name.clone(), history)));
    }
    let names: Vec<String> = all.iter().map(|(.., history)| history.name.clone()).collect();
    for (place, short, history) in &mut all {
        if names.iter().filter(|name| **name == history.name).count() > 1 {
            let of = if place.is_dir() { String::new() } else { format!(": {}", history.name) };
            history.name = format!("{short}{of}");
        }
    }
    let runs: Vec<RunHistory> = all.into_iter().map(|(.., history)| history).collect();
    match runs.iter().enumerate().find(|(number, run)| runs[..*number].iter().any(|other| other.name == run.name)) {
        Some((_, twice)) => Err(Failure::input(format!("{} is given twice", twice.name), "give it once")),
        None => Ok(runs),
    }
}

/// The runs with these names, in this order; all of them if no names are given.
fn chosen(runs: Vec<RunHistory>, names: &[String]) -> Outcome<Vec<RunHistory>> {
    if names.is_empty() {
        return Ok(runs);
    }
    let known = || runs.iter().map(|run| run.name.as_str()).collect::<Vec<_>>().join(", ");
    let one = |name: &String| match runs.iter().find(|run| run.name == *name) {
        Some(run) => Ok(run.clone()),
        None => Err(Failure::input(format!("no run is called `{name}`"), format!("available: {}", known()))),
    };
    names.iter().map(one).collect()
}

/// The cases of all runs; `None` for tables, and for cases that are no longer valid, which only costs words and lines
/// of charts.
fn cases(results: &[PathBuf]) -> Vec<Option<Case>> {
    let of =
        |directory: &PathBuf| read(&directory.join("case.toml").as_path().into()).ok().map(|resolved| resolved.case);
    results.iter().map(of).collect()
}

/// The common bound on the volume fraction of all runs; `None` if bounds differ or a table has none.
fn common_limit(cases: &[Option<Case>]) -> Option<f64> {
    let limit = |case: &Option<Case>| case.as_ref()?.design.as_ref()?.volume_fraction;
    let first = limit(cases.first()?)?;
    cases.iter().all(|case| limit(case) == Some(first)).then_some(first)
}

/// What the objective of all runs is; without words if they differ.
fn common_objective(cases: &[Option<Case>]) -> ObjectiveAxis {
    let axis = |case: &Option<Case>| case.as_ref().map(objective_axis);
    let first = cases.first().and_then(axis);
    first.filter(|first| cases.iter().all(|case| axis(case).as_ref() == Some(first))).unwrap_or_default()
}

/// Refuses to replace a file that is not a picture.
pub(super) fn replaceable(file: &Path, option: &str) -> Outcome {
    if !file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png")) {
        let message = format!("{} does not end in .png", file.display());
        return Err(Failure::input(message, format!("pictures are PNG files: give {option} a name that ends in .png")));
    }
    let mut start = [0; SIGNATURE.len()];
    let found = std::fs::File::open(file).and_then(|mut open| std::io::Read::read_exact(&mut open, &mut start));
    if file.exists() && (found.is_err() || start != SIGNATURE) {
        let message = format!("{} exists and is not a picture", file.display());
        return Err(Failure::input(message, format!("name another file with {option}")));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: shared folders are left out, down to the last part of a path.
    #[test]
    fn names_lack_shared_folders() {
        let names = |paths: &[&str]| short_names(&paths.iter().map(PathBuf::from).collect::<Vec<_>>());
        assert_eq!(names(&["cases/snap/start", "cases/snap/end"]), ["start", "end"]);
        assert_eq!(names(&["old/case", "new/case"]), ["old/case", "new/case"]);
        assert_eq!(names(&["runs/case", "runs/case/part"]), ["case", "case/part"]);
        assert_eq!((names(&["runs/case"]), names(&["case", "case"])), (vec!["case".into()], vec!["case".into(); 2]));
    }
}
