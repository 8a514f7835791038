//! A run as a single web page: design and load path in an interactive view, curves, tables and the
//! case.
//!
//! The page contains everything and needs no network: styles, scripts, and the data as JSON, in
//! which large lists of numbers are base64 of little-endian bytes. It opens from a file, follows
//! the system's light or dark colours, can be operated by keyboard, and can be printed. Its scripts
//! are in `page/` and use no libraries.
//!
//! | part | contents |
//! |---|---|
//! | model | coordinates in 32 bits; elements, of which the page computes skin and sections; of large meshes, elements of the designed bodies and the skin of the others |
//! | designs | densities of the iterations that the run wrote, in steps of 1/255; derivatives in 16 bits |
//! | warnings | what the run warned of |
//! | steps | displacements, stresses, plastic strains and contact fields of the load steps, quantized to 16 bits over their range |
//! | summary | objective, volume of material, materials of sections, quantities of the case with their bounds, resultants and peak pressures of the contact pairs |
//! | tables | `history.csv`; Newton iterations per load step of the newest design; verification and evaluations |
//!
//! If the frames exceed a budget, some are left out at regular intervals, and a note says so.

mod frames;
mod model;
mod named;
mod origin;
mod pack;
mod setup;
mod summary;
mod tables;
#[cfg(test)]
mod tests;

use serde::Serialize;
use serde_json::Value;
use slipstick_mesh::Mesh;

use crate::picture::{PictureRequest, picture};
use slipstick_case::file::{Case, Dimension};
use slipstick_model::words::{counted, quantity};
use slipstick_results::run::{RunDirectory, RunError, RunRecord, RunWarning};

use frames::Frames;
use model::Model;
use named::Bounded;
use origin::Origin;
use pack::base64;
pub use setup::{model_nodes, model_page};
use summary::Summary;
use tables::{Checked, NewtonSteps, Table};

/// The file of a run with the thinnest member and the narrowest gap of its newest design.
pub const MEASURES: &str = "measures.json";

/// The script that draws curves and tables, for other pages.
pub const CHARTS: &str = include_str!("page/charts.js");

/// A page and its contents.
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    /// The page's text (HTML, UTF-8).
    pub html: String,
    /// Numbers of designs and load steps on the page.
    pub frames: [usize; 2],
    /// Notes on the page: what is left out, and how the run ended if it did not finish.
    pub notes: Vec<String>,
}

/// Limits on the size of a page, and whether it follows a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PageOptions {
    /// Limit for designs and load steps, before encoding. \[bytes\]
    pub frame_bytes: usize,
    /// Limit for coordinates and elements, before encoding; a mesh that needs more is only shown as
    /// a picture. \[bytes\]
    pub model_bytes: usize,
    /// Meshes with at most this many elements are on the page as a whole; of larger ones, bodies that are not
    /// designed have only their skin, and sections through them are hollow.
    pub whole_elements: usize,
    /// The interval at which the open page loads its file again, for a run in progress. \[s\]
    pub reload: Option<f64>,
    /// Only the interactive view, without tables, curves and case, for a page that contains this one.
    pub view_only: bool,
}

impl Default for PageOptions {
    /// Pages of up to about 60 MB, which browsers on phones can still open.
    fn default() -> Self {
        Self {
            frame_bytes: 24_000_000,
            model_bytes: 24_000_000,
            whole_elements: 50_000,
            reload: None,
            view_only: false,
        }
    }
}

/// The input of the page's script.
#[derive(Debug, Default, Serialize)]
struct Data {
    title: String,
    summary: String,
    /// Objective, material and contact forces.
    #[serde(skip_serializing_if = "Summary::is_empty")]
    results: Summary,
    notes: Vec<String>,
    /// What the run warned of.
    warnings: Vec<RunWarning>,
    /// Which designs the numbers belong to.
    origin: Origin,
    model: Option<Model>,
    #[serde(flatten)]
    frames: Frames,
    history: Option<Table>,
    newton: Option<NewtonSteps>,
    /// Quantities at each load step of the newest design, and the columns to show at first: x and
    /// y.
    quantities: Option<Table>,
    curve: Option<[String; 2]>,
    /// The quantities of the case among them, and the bounds on columns of the history.
    named: Vec<Bounded>,
    bounded: Vec<named::History>,
    volume_fraction: Option<f64>,
    load_cases: Vec<String>,
    verify: Option<Checked>,
    evaluate: Option<Table>,
    /// Names of the units of lengths, forces and tractions.
    units: [String; 3],
    case_text: String,
    resolved: Value,
    run: Vec<[String; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reload: Option<f64>,
    /// Whether the page is only the view.
    view_only: bool,
    /// Whether the page shows a model that has not run, in a colour for each body.
    setup: bool,
    /// Surfaces and node sets that the view can mark.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    marks: Vec<setup::Mark>,
}

/// Makes the page of a run; `mesh` is the mesh of its case.
///
/// # Errors
/// [`RunError`] if a file of the run cannot be read or does not match this mesh.
pub fn page(run: &RunDirectory, case: &Case, mesh: &Mesh, options: &PageOptions) -> Result<Page, RunError> {
    let record = RunRecord::read(run)?;
    if options.view_only {
        return view(run, case, mesh, options, &record);
    }
    let path = run.file("case.toml");
    let case_text = std::fs::read_to_string(&path).map_err(RunError::read(&path))?;
    let history = tables::history(run)?;
    let quantities = tables::quantities(run)?;
    let mut notes = ending(&record);
    let (model, frames) = shown(run, case, mesh, options, &mut notes)?;
    let picture = picture(run, case, mesh, &PictureRequest::default()).ok();
    let picture = picture.and_then(|drawn| drawn.picture.png().ok());
    let title = match case.title.as_str() {
        "" => format!("slipstick {}", command(&record.latest.command)),
        title => title.to_owned(),
    };
    let counts = [frames.designs.len(), frames.steps.len()];
    let origin = Origin::of(run, history.as_ref(), &frames.path)?;
    let newton = tables::newton(run, history.is_some().then_some(origin))?;
    let data = Data {
        summary: summary(&record, history.as_ref()),
        results: Summary::of(run, case, mesh, history.as_ref(), origin)?,
        warnings: RunWarning::read(run)?,
        origin,
        notes: notes.clone(),
        model,
        frames,
        history,
        newton,
        curve: quantities.as_ref().and_then(|table| first_curve(case, table)),
        named: named::on_path(case, quantities.as_ref()),
        bounded: named::on_history(case),
        volume_fraction: case.design.as_ref().and_then(|design| design.volume_fraction),
        load_cases: case.load_case_names(),
        quantities,
        verify: tables::verify(run)?,
        evaluate: tables::optional(run, "evaluate.csv")?,
        units: units(case),
        case_text,
        run: about(&record),
        reload: options.reload,
        resolved: record.case,
        title,
        ..Data::default()
    };
    Ok(Page { html: html(&data, picture), frames: counts, notes })
}

/// The page of a run with nothing but the view.
fn view(
    run: &RunDirectory,
    case: &Case,
    mesh: &Mesh,
    options: &PageOptions,
    record: &RunRecord,
) -> Result<Page, RunError> {
    let mut notes = ending(record);
    let (model, frames) = shown(run, case, mesh, options, &mut notes)?;
    let picture = match &model {
        Some(_) => None,
        None => picture(run, case, mesh, &PictureRequest::default()).ok().and_then(|drawn| drawn.picture.png().ok()),
    };
    let counts = [frames.designs.len(), frames.steps.len()];
    let history = tables::history(run)?;
    let data = Data {
        title: case.title.clone(),
        notes: notes.clone(),
        origin: Origin::of(run, history.as_ref(), &frames.path)?,
        model,
        frames,
        load_cases: case.load_case_names(),
        units: units(case),
        view_only: true,
        reload: options.reload,
        ..Data::default()
    };
    Ok(Page { html: html(&data, picture), frames: counts, notes })
}

/// The text of the page.
fn html(data: &Data, picture: Option<Vec<u8>>) -> String {
    // A number that is not finite becomes `null`, and `<` cannot end the script that holds the
    // data.
    let json = serde_json::to_string(data).unwrap_or_default().replace('<', "\\u003c");
    let picture = picture.map_or(String::new(), |bytes| format!("data:image/png;base64,{}", base64(&bytes)));
    let script = [
        CHARTS,
        include_str!("page/smooth.js"),
        include_str!("page/viewer.js"),
        include_str!("page/section.js"),
        include_str!("page/controls.js"),
        include_str!("page/picking.js"),
        include_str!("page/main.js"),
    ]
    .concat();
    let part = |key: &str| match key {
        "TITLE" => escaped(&data.title),
        "CLASS" if data.view_only => "bare".into(),
        "CLASS" => String::new(),
        "STYLE" => include_str!("page/style.css").trim_end().into(),
        "PICTURE" => picture.clone(),
        "SCRIPT" => script.trim_end().into(),
        _ => json.clone(),
    };
    // In the template, keys stand between @ and there is no other @; inserted text is not searched
    // again.
    let pieces = include_str!("page/page.html").split('@').enumerate();
    pieces.map(|(k, piece)| if k % 2 == 1 { part(piece) } else { piece.to_owned() }).collect()
}

/// Model and frames, unless there is nothing to show or they are too large.
fn shown(
    run: &RunDirectory,
    case: &Case,
    mesh: &Mesh,
    options: &PageOptions,
    notes: &mut Vec<String>,
) -> Result<(Option<Model>, Frames), RunError> {
    let layout = model::Layout::new(case, mesh, options.whole_elements);
    if layout.bytes() > options.model_bytes {
        notes.push(format!(
            "The mesh has {} elements, which is too large for this page, so only a picture is shown. ParaView opens \
             design.pvd and path.pvd.",
            mesh.elements.len()
        ));
        return Ok((None, Frames::default()));
    }
    let (frames, path_density) = frames::read(run, case, mesh, &layout, options.frame_bytes, notes)?;
    if frames.designs.is_empty() && frames.steps.is_empty() {
        return Ok((None, frames));
    }
    Ok((Some(layout.model(mesh, path_density)), frames))
}

/// The force-displacement curve to show at first: the reaction of the first support that moves,
/// along the direction in which it moves most, over its displacement; without one, the strain
/// energy over pseudo-time.
fn first_curve(case: &Case, table: &Table) -> Option<[String; 2]> {
    let known = |name: &String| table.columns.contains(name);
    let moving = case.dirichlet.iter().filter_map(|support| {
        let [x, y, z] = support.motion.last()?.u;
        let sizes = [("x", x.abs()), ("y", y.abs()), ("z", z.abs())];
        let (axis, size) = sizes.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        (size > 0.0).then(|| ["displacement", "reaction"].map(|what| format!("{what}_{}_{axis}", support.set)))
    });
    let over_time = ["time".to_owned(), "strain_energy".to_owned()];
    moving.chain([over_time]).find(|pair| pair.iter().all(known))
}

/// Names of units as in the case, otherwise their dimensions.
fn units(case: &Case) -> [String; 3] {
    [(Dimension::LENGTH, " [L]"), (Dimension::FORCE, " [F]"), (Dimension::STRESS, " [F/L²]")].map(|(of, dimension)| {
        let name = case.units.bracket(of);
        if name.is_empty() { dimension.into() } else { name }
    })
}

/// Commands that start runs, in a command line after options of all commands and their values.
const COMMANDS: &[&str] = &["solve", "gradient", "optimize", "resume", "evaluate", "verify"];

/// The command of a run.
fn command(line: &[String]) -> &str {
    let found = line.iter().skip(1).find(|word| COMMANDS.contains(&word.as_str()));
    found.map_or("run", |word| if word == "resume" { "optimize" } else { word })
}

fn summary(record: &RunRecord, history: Option<&Table>) -> String {
    let mut text = format!("slipstick {}, {}", record.latest.version, command(&record.latest.command));
    if let Some(rows) = history.map(|history| &history.rows).filter(|rows| !rows.is_empty()) {
        let objective = |row: &Vec<Value>| row.get(1).and_then(Value::as_f64);
        if let (Some(first), Some(last)) = (rows.first().and_then(objective), rows.last().and_then(objective)) {
            let (first, last) = (quantity(first), quantity(last));
            text += &format!(": objective {first} at the start, {last} after {}", counted(rows.len() - 1, "update"));
        }
    }
    text
}

/// Notes that users should read before the results.
fn ending(record: &RunRecord) -> Vec<String> {
    use slipstick_results::run::ExitState::{Failed, Finished, Interrupted, Running};
    let message = record.latest.message.clone().unwrap_or_default();
    match record.latest.exit {
        Finished => Vec::new(),
        Running => {
            vec!["The run is still in progress or was killed. The page shows what it has written so far.".into()]
        }
        Failed => vec![format!("The run failed: {}", said(&message, "error: "))],
        Interrupted => vec![format!("The run was interrupted: {}", said(&message, "interrupted: "))],
    }
}

/// The final message of a run, without its first word.
fn said<'a>(message: &'a str, word: &str) -> &'a str {
    message.strip_prefix(word).unwrap_or(message)
}

/// The run's record as rows of a table.
fn about(record: &RunRecord) -> Vec<[String; 2]> {
    let mut lines = Vec::new();
    let mut line = |name: &str, value: String| lines.push([name.to_owned(), value]);
    line("case file", record.case_file.clone());
    line("SHA-256 of the case", record.case_sha256.clone());
    for part in record.earlier.iter().chain([&record.latest]) {
        let machine = &part.machine;
        line("command", part.command.join(" "));
        line("version", part.version.clone());
        let end = part.end.as_deref().unwrap_or("no end");
        line("time (UTC)", format!("{} to {end}, {}", part.start, format!("{:?}", part.exit).to_lowercase()));
        line(
            "machine",
            format!(
                "{} {}, {} of {}",
                machine.os,
                machine.architecture,
                counted(part.threads, "thread"),
                counted(machine.cores, "core")
            ),
        );
    }
    lines
}

/// Text escaped for HTML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
