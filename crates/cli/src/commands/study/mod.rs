//! `slipstick study`: runs every entry of a list, each in a separate process and directory.
//!
//! A finished run is not repeated unless its case file, its command line or the design that it uses
//! has changed; an interrupted optimization is resumed. The record `NAME.json` of a run is next to
//! its directory `NAME`.

mod child;
mod entry;
mod expected;
mod file;
mod grid;
mod pictures;
mod report;
mod tables;

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use slipstick::build::build_mesh;
use slipstick::optimize::FEASIBLE;
use slipstick::output::write_atomically;
use slipstick::run::{Image, ResultRecord, RunDirectory, asymmetry, load_density, sha256};
use slipstick::words::{counted, shell_word};

use self::entry::{Entry, Word};
use self::file::Study as Plan;
use self::tables::Numbers;
use crate::args::Study;
use crate::context::Context;
use crate::setup::read;
use slipstick_service::failure::{Failure, Outcome};

/// The record of a run, `NAME.json`.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct Record {
    /// Hash of all inputs of the run.
    inputs: String,
    /// Whether it is finished.
    finished: bool,
    /// Its results.
    numbers: Numbers,
    /// Total duration of the run over all sessions, resumed ones included [s].
    seconds: f64,
}

/// Executes the runs of a study, draws its pictures, writes its tables.
///
/// # Errors
/// [`Failure::Input`] for errors in the study file; [`Failure::Check`] at the end if runs failed or
/// numbers are not as expected; [`Failure::Interrupted`].
pub fn run(context: &Context, args: &Study) -> Outcome {
    let plan = Plan::read(&args.study)?;
    let grids = plan.grids.iter().map(|grid| grid.name.as_str());
    let names = grids.chain(plan.file.runs.iter().map(|run| run.name.as_str()));
    if let Some(unknown) = args.only.iter().find(|only| !names.clone().any(|name| name == *only)) {
        let known = names.collect::<Vec<_>>().join(", ");
        return Err(Failure::input(format!("no run is called `{unknown}`"), format!("available: {known}")));
    }
    let grid_of = |name: &str| plan.grids.iter().find(|grid| grid.runs().any(|run| run == name));
    let asked = |name: &str| {
        let named = |only: &String| only == name || grid_of(name).is_some_and(|grid| grid.name == *only);
        args.only.is_empty() || args.only.iter().any(named)
    };
    if args.plan {
        for run in plan.file.runs.iter().filter(|run| asked(&run.name)) {
            let state = if current(&plan, run).is_some_and(|record| record.finished) { "done" } else { "to do" };
            context.console.text(&format!("{state:<5}  slipstick {}", quoted(&plan.line(run))));
        }
        return Ok(());
    }
    let results = plan.folder.join(&plan.results);
    std::fs::create_dir_all(&results).map_err(|error| {
        Failure::input(format!("cannot create the directory {}: {error}", results.display()), "check its parent")
    })?;
    let mut failed: Vec<String> = Vec::new();
    for run in plan.file.runs.iter().filter(|run| asked(&run.name)) {
        if context.interrupt.requested() {
            return Err(interrupted(&args.study));
        }
        if let Some(design) = run.design.as_ref().filter(|design| failed.contains(design)) {
            context.console.warning(&format!("{}: skipped, because {design} failed", run.name));
            failed.push(run.name.clone());
        } else if !perform(context, &plan, run, &args.study)? {
            failed.push(run.name.clone());
        }
    }
    let records = plan.file.runs.iter().filter_map(|run| Some((run, current(&plan, run).filter(|r| r.finished)?)));
    let all = |run: &Entry, mut numbers: Numbers| {
        numbers.extend(asymmetries(&plan, run));
        numbers
    };
    let found: Vec<(&Entry, Numbers, f64)> =
        records.map(|(run, record)| (run, all(run, record.numbers), record.seconds)).collect();
    let off = report::write(context, &plan, &results, &found)?;
    let done: Vec<&str> = found.iter().map(|(run, ..)| run.name.as_str()).collect();
    pictures::draw(context, &plan, &done, &asked)?;
    let told = json!({ "command": "study", "directory": results, "failed": failed, "off": off });
    context.console.event("result", told);
    if failed.is_empty() && off == 0 {
        return Ok(());
    }
    let mut faults = Vec::new();
    if !failed.is_empty() {
        faults.push(format!("{} failed ({})", counted(failed.len(), "run"), failed.join(", ")));
    }
    if off > 0 {
        faults.push(format!("{} {} not as expected", counted(off, "number"), if off == 1 { "is" } else { "are" }));
    }
    let message = faults.join("; ");
    Err(Failure::Check { message, cure: "finished runs are kept; the same command continues with the rest".into() })
}

/// A command line, quoted for a shell.
fn quoted(line: &[String]) -> String {
    line.iter().map(|word| shell_word(word)).collect::<Vec<_>>().join(" ")
}

fn interrupted(study: &Path) -> Failure {
    let message =
        format!("finished runs are kept; continue with: slipstick study {}", shell_word(&study.display().to_string()));
    Failure::Interrupted { message, resume: None }
}

/// Executes a run unless it is finished; returns whether it is finished now.
fn perform(context: &Context, plan: &Plan, run: &Entry, study: &Path) -> Outcome<bool> {
    let before = current(plan, run);
    if before.as_ref().is_some_and(|record| record.finished) {
        context.console.text(&format!("{}: already finished", run.name));
        return Ok(true);
    }
    let directory = plan.results.join(&run.name);
    let resume = run.command == Word::Optimize && before.is_some() && {
        let file = |name: &str| plan.folder.join(&directory).join(name).is_file();
        file("checkpoint.json") && file("run.json")
    };
    let mut record = before.unwrap_or(Record { inputs: inputs(plan, run), ..Record::default() });
    write(plan, run, &record)?;
    let line = match resume {
        true => vec!["resume".into(), directory.display().to_string()],
        false => [plan.line(run), vec!["--force".into()]].concat(),
    };
    context.console.text(&format!("{}: slipstick {}", run.name, quoted(&line)));
    let clock = Instant::now();
    let ended = child::run(context, &plan.folder, &line)?;
    record.seconds += clock.elapsed().as_secs_f64();
    record.finished = ended.code == Some(0);
    record.numbers = numbers(plan, run, &ended.events);
    write(plan, run, &record)?;
    if context.interrupt.requested() && !record.finished {
        return Err(interrupted(study));
    }
    if !record.finished {
        let reason = ended.error.unwrap_or_else(|| format!("it ended with {:?}", ended.code));
        context.console.warning(&format!("{}: {reason}", run.name));
    }
    Ok(record.finished)
}

/// Hash of all inputs of a run: its command line, the text of its case file, the design that it
/// uses.
fn inputs(plan: &Plan, run: &Entry) -> String {
    let text = |path: PathBuf| std::fs::read_to_string(path).unwrap_or_default();
    let case = text(plan.folder.join(&run.case));
    let design = run.design.as_ref().map(|name| text(plan.folder.join(&plan.results).join(name).join("design.csv")));
    sha256(&json!([plan.line(run), case, design]).to_string())
}

fn record_file(plan: &Plan, run: &Entry) -> PathBuf {
    plan.folder.join(&plan.results).join(format!("{}.json", run.name))
}

/// The record of a run, if it exists and has the same inputs.
fn current(plan: &Plan, run: &Entry) -> Option<Record> {
    let text = std::fs::read_to_string(record_file(plan, run)).ok()?;
    let record: Record = serde_json::from_str(&text).ok()?;
    (record.inputs == inputs(plan, run)).then_some(record)
}

fn write(plan: &Plan, run: &Entry, record: &Record) -> Outcome {
    let text = serde_json::to_string_pretty(record).unwrap_or_default();
    Ok(write_atomically(&record_file(plan, run), |writer| writeln!(writer, "{text}"))?)
}

/// The results of a run: from its events and, for an optimization, from its history, which is
/// complete even after a resumption.
fn numbers(plan: &Plan, run: &Entry, events: &[Value]) -> Numbers {
    let directory = plan.folder.join(&plan.results).join(&run.name);
    let mut numbers = Numbers::new();
    let mut quantities = Numbers::new();
    let mut put = |name: String, value: &Value| {
        if let Some(value) = value.as_f64() {
            numbers.insert(name, value);
        }
    };
    for event in events {
        let suffix = match event["event"].as_str() {
            Some("evaluation") => event["friction"].as_f64().map_or(String::new(), |mu| format!(" at {mu}")),
            _ => String::new(),
        };
        for name in ["objective", "objective_over_volume_fraction", "newton_iterations", "gradient_norm"] {
            put(format!("{name}{suffix}"), &event[name]);
        }
        put("volume_fraction".into(), &event["volume_fraction"]);
        let values = event["quantities"].as_object().into_iter().flatten();
        quantities.extend(values.filter_map(|(name, value)| Some((format!("{name}{suffix}"), value.as_f64()?))));
        let worst = |of: &Value| of["check"]["worst"].as_f64();
        let worst = event["checks"].as_array().into_iter().flatten().filter_map(worst).reduce(f64::max);
        put("gradient_error".into(), &json!(worst));
    }
    if run.command == Word::Optimize {
        history(&directory).into_iter().for_each(|(name, value)| put(name, &json!(value)));
    }
    for (name, value) in quantities {
        numbers.entry(name).or_insert(value);
    }
    numbers
}

/// The row of the result in the history of a run, its first objective, and the best one of a feasible design.
fn history(directory: &Path) -> Vec<(String, f64)> {
    let text = std::fs::read_to_string(directory.join("history.csv")).unwrap_or_default();
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let rows: Vec<Vec<Option<f64>>> = lines.map(|l| l.split(',').map(|cell| cell.parse().ok()).collect()).collect();
    let cell = |row: &[Option<f64>], name: &str| row.get(header.iter().position(|found| *found == name)?).copied()?;
    let mut found = Vec::new();
    let recalled = RunDirectory::open(directory).and_then(|run| ResultRecord::read(&run)).ok().flatten();
    let result = recalled.and_then(|recalled| rows.get(recalled.iteration));
    if let Some(last) = result.or(rows.last()) {
        // constraint columns come after the column `inner_iterations`
        let constraints = header.iter().skip_while(|name| **name != "inner_iterations").skip(1);
        let constraints = constraints.take_while(|name| **name != "seconds" && !name.starts_with("multiplier"));
        for name in ["iteration", "objective", "volume_fraction", "violation"].iter().chain(constraints) {
            found.extend(cell(last, name).map(|value| ((*name).to_owned(), value)));
        }
    }
    let first = rows.first().and_then(|row| cell(row, "objective"));
    found.extend(first.map(|value| ("first_objective".to_owned(), value)));
    let feasible = |row: &&Vec<Option<f64>>| cell(row, "violation").is_none_or(|violation| violation <= FEASIBLE);
    let best = rows.iter().filter(feasible).filter_map(|row| cell(row, "objective")).fold(f64::INFINITY, f64::min);
    if best.is_finite() {
        found.push(("best_objective".into(), best));
    }
    let sum = |name: &str| rows.iter().filter_map(|row| cell(row, name)).sum::<f64>();
    found.push(("seconds".into(), sum("seconds")));
    found.push(("halvings".into(), sum("halvings")));
    found
}

/// Asymmetries of the design of a run, for those symmetries that its mesh has.
fn asymmetries(plan: &Plan, run: &Entry) -> Numbers {
    let mirrors = run.mirror.iter().map(|axis| (format!("asymmetry {}", axis.letter()), Image::Mirror(axis.number())));
    let turns = run.half_turn.iter();
    let turns = turns.map(|axis| (format!("asymmetry half turn {}", axis.letter()), Image::HalfTurn(axis.number())));
    let images: Vec<(String, Image)> = mirrors.chain(turns).collect();
    if images.is_empty() {
        return Numbers::new();
    }
    let found = || {
        let directory = plan.folder.join(&plan.results).join(&run.name);
        let case = read(&directory.join("case.toml").as_path().into()).ok()?.case;
        let mesh = build_mesh(&case).ok()?;
        let density = load_density(&directory, &mesh).ok()?;
        let designed = case.design?.bodies;
        let bodies = mesh.bodies.iter().filter(|body| designed.contains(&body.name));
        let elements: Vec<usize> = bodies.flat_map(|body| body.elements.clone()).collect();
        let one = |(name, image)| Some((name, asymmetry(&mesh, &density, &elements, image)?));
        Some(images.into_iter().filter_map(one).collect())
    };
    found().unwrap_or_default()
}
