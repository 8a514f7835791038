//! `slipstick verify deck`: a deck in CalculiX and in slipstick.

use std::collections::{BTreeSet, HashSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde::Deserialize;
use serde_json::json;
use slipstick::case::Case;
use slipstick::deck::{Compared, DeckRecord, Source, Values};
use slipstick::mesh::Mesh;
use slipstick::meshio::FileMesh;
use slipstick_service::failure::{Failure, Outcome};

use super::export::deck::RECORD;
use crate::args::{CaseFile, DesignFrom, Out, Solve, VerifyDeck};
use crate::context::Context;
use crate::summary::digits;
use crate::table::lines;

/// What `deck.json` has.
#[derive(Debug, Deserialize)]
struct Record {
    decks: Vec<DeckRecord>,
}

/// A number in all programs.
struct Row<'a> {
    compared: &'a Compared,
    slipstick: Option<f64>,
    ccx: Option<f64>,
    /// Of CalculiX from slipstick; 0 if both numbers are zero.
    deviation: Option<f64>,
    /// Whether both numbers are zero to within round-off.
    zero: bool,
}

/// Numbers below this fraction of the largest of their kind are not compared with themselves.
const SMALL: f64 = 0.1;
/// The largest of a kind is not below this fraction of the largest at a node.
const NOISE: f64 = 1e-2;
/// Forces below this fraction of E u L are round-off, with the largest modulus, displacement and size. Blocks that expand
/// freely or move have up to 3e-15 in CalculiX.
const ROUND_OFF: f64 = 1e-13;

/// Runs the decks of a folder in both programs and compares them.
///
/// # Errors
/// [`Failure::Input`] without CalculiX or without a deck; [`Failure::Check`] if it fails, or if a number or
/// the displacements as a whole deviate by more than the tolerance; those of `solve`.
pub fn run(context: &Context, args: &VerifyDeck) -> Outcome {
    let path = args.folder.join(RECORD);
    let text = fs::read_to_string(&path).map_err(|error| {
        let cure = "name a folder that `slipstick export RUN --deck DIR` wrote";
        Failure::input(format!("cannot read {}: {error}", path.display()), cure)
    })?;
    let record: Record = serde_json::from_str(&text).map_err(|error| {
        Failure::input(format!("{}: {error}", path.display()), "write the deck again with `slipstick export`")
    })?;
    let mut off = Vec::new();
    let mut stiffness: Option<f64> = None;
    for deck in &record.decks {
        let values = calculix(context, args, deck)?;
        let found = solved(context, args, deck)?;
        let built = built(args, deck);
        let round_off = built.as_ref().map_or(0.0, |(case, mesh)| round_off(case, mesh, &values));
        let rows = rows(deck, &found, &values, round_off);
        let field = built.and_then(|(case, mesh)| field(args, deck, &values, &case, &mesh));
        tell(context, deck, &rows, field);
        // NaN counts as a deviation
        let wrong = |row: &&Row<'_>| row.deviation.is_some_and(|deviation| !(deviation.abs() <= args.tolerance));
        if rows.iter().all(|row| row.deviation.is_none()) {
            let message = format!("{}: no quantity has a value in both programs", deck.deck);
            let cure =
                "add a [[quantity]] of reactions, contact forces or displacements to the case, and export it again";
            return Err(Failure::Check { message, cure: cure.into() });
        }
        off.extend(rows.iter().filter(wrong).map(|row| row.compared.column.clone()));
        // resultants may cancel by symmetry, or be round-off, where the bodies deform differently
        off.extend(field.filter(|field| !(*field <= args.tolerance)).map(|_| "all displacements".to_owned()));
        let force = |row: &Row<'_>| !matches!(row.compared.source, Source::Displacement { .. });
        if rows.iter().filter(wrong).any(force) {
            stiffness = deck.contact_stiffness.into_iter().chain(stiffness).reduce(f64::max);
        }
    }
    if off.is_empty() {
        return Ok(());
    }
    let message =
        format!("{} deviate by more than {} %: {}", off.len(), digits(100.0 * args.tolerance), off.join(", "));
    // contact that gives way is the first suspect, where there is contact
    let firmer = stiffness.map_or(String::new(), |slope| {
        format!(
            "contact in CalculiX is a spring: export with `--contact-stiffness {:.0e}`, ten times its pressure per penetration, \
             and look whether the forces change; ",
            10.0 * slope
        )
    });
    let cure = format!(
        "{firmer}friction in CalculiX needs small increments: export with more load steps (`load_path.steps`); flat facets of \
         linear elements overlap on curved fits: mesh these with second-order elements, or finer; or set --tolerance"
    );
    Err(Failure::Check { message, cure })
}

/// Runs CalculiX in the folder.
fn calculix(context: &Context, args: &VerifyDeck, deck: &DeckRecord) -> Outcome<Values> {
    let stem = deck.deck.trim_end_matches(".inp");
    let log = args.folder.join(format!("{stem}.log"));
    let read = |error: std::io::Error| {
        let message = format!("cannot run {}: {error}", args.ccx.display());
        let cure = "install CalculiX (Debian: apt install calculix-ccx), or name it with --ccx PROGRAM";
        Failure::input(message, cure)
    };
    // results of an earlier run must not be taken for those of this one
    for end in ["frd", "dat"] {
        let _ = fs::remove_file(args.folder.join(format!("{stem}.{end}")));
    }
    let out = fs::File::create(&log).map_err(|error| {
        Failure::input(format!("cannot write {}: {error}", log.display()), "check the permissions of the folder")
    })?;
    // a relative path is that of the user, not of the folder in which the program starts
    let program =
        if args.ccx.components().count() > 1 { fs::canonicalize(&args.ccx).map_err(read)? } else { args.ccx.clone() };
    let mut command = Command::new(program);
    command.arg("-i").arg(stem).current_dir(&args.folder).stdin(Stdio::null());
    command.stdout(Stdio::from(out.try_clone().map_err(read)?)).stderr(Stdio::from(out));
    if let Some(threads) = context.common.threads {
        command.env("OMP_NUM_THREADS", threads.to_string());
    }
    context.console.text(&format!("CalculiX runs {} …", deck.deck));
    let status = command.status().map_err(read)?;
    let shown = fs::read_to_string(&log).unwrap_or_default();
    let text = |end: &str| fs::read_to_string(args.folder.join(format!("{stem}.{end}"))).unwrap_or_default();
    let failed = !status.success() || shown.contains("*ERROR") || !shown.contains("Job finished");
    let values = Values::parse(&text("frd"), &text("dat"));
    match values {
        Ok(values) if !failed && (values.time - 1.0).abs() < 1e-6 => Ok(values),
        values => {
            let error = shown.lines().skip_while(|line| !line.contains("*ERROR")).take(3).map(str::trim);
            let error = error.collect::<Vec<_>>().join(" ");
            let reached =
                values.map_or_else(|error| format!(", {error}"), |values| format!(", at time {}", values.time));
            let message =
                format!("CalculiX failed{reached}: {}", if error.is_empty() { "see its log" } else { &error });
            let cure = format!("see {}; smaller increments (`load_path.steps`) often help with contact", log.display());
            Err(Failure::Check { message, cure })
        }
    }
}

/// Solves the case of the deck; columns and values at the end.
fn solved(context: &Context, args: &VerifyDeck, deck: &DeckRecord) -> Outcome<Vec<(String, f64)>> {
    let case = args.folder.join(&deck.case);
    let directory = solution(args, deck);
    let out = Out { out: Some(directory.clone()), force: true };
    let file = CaseFile::from(Path::new(&case));
    super::solve::run(context, &Solve { case: file, design: DesignFrom { design: None }, out })?;
    let table = directory.join("quantities.csv");
    let text = fs::read_to_string(&table).map_err(|error| {
        Failure::input(format!("cannot read {}: {error}", table.display()), "run the command again")
    })?;
    let mut rows = text.lines();
    let columns = rows.next().unwrap_or_default().split(',');
    let last = rows.last().unwrap_or_default().split(',');
    Ok(columns.zip(last).filter_map(|(column, value)| Some((column.to_owned(), value.parse().ok()?))).collect())
}

/// The case of a deck and its mesh; `None` if they cannot be read.
fn built(args: &VerifyDeck, deck: &DeckRecord) -> Option<(Case, Mesh)> {
    let case = slipstick_service::read::case_file(&args.folder.join(&deck.case), &[]).ok()?.case;
    let mesh = slipstick::build::build_mesh(&case).ok()?;
    Some((case, mesh))
}

/// L2 norm of the difference of all displacements at the end, over that of the displacements; `None` if the
/// bodies of the deck are numbered differently.
fn field(args: &VerifyDeck, deck: &DeckRecord, values: &Values, case: &Case, mesh: &Mesh) -> Option<f64> {
    let file = FileMesh::parse(&fs::read(args.folder.join(&deck.deck)).ok()?).ok()?;
    let last = solution(args, deck).join(format!("path_{:04}.vtu", case.steps()));
    let fields = slipstick::output::read_fields(&last).ok()?;
    let here = fields.iter().find(|field| field.name == "displacement" && field.on_points)?;
    let (mut difference, mut size) = (0.0, 0.0);
    // the deck does not have the copies of nodes at the sections of bolts, and CalculiX may write either side
    let copies = mesh.copies();
    let sections: HashSet<u32> = copies.values().copied().collect();
    // nor the centres of faces and elements of second order
    let centres = mesh.serendipity_centres(0..mesh.elements.len(), &BTreeSet::new());
    let centres: HashSet<u32> = centres.into_iter().map(|centre| centre.node).collect();
    let in_deck = |node: &usize| !copies.contains_key(&(*node as u32)) && !centres.contains(&(*node as u32));
    let nodes = mesh.bodies.iter().flat_map(|body| body.nodes.clone());
    for (at, node) in nodes.filter(in_deck).enumerate() {
        if file.points.get(at) != mesh.nodes.get(node) {
            return None;
        }
        if sections.contains(&(node as u32)) {
            continue;
        }
        let there = values.displacements.get(&u32::try_from(file.point_numbers[at]).ok()?)?;
        for (c, there) in there.iter().enumerate() {
            let here = here.values.get(3 * node + c)?;
            difference += (there - here).powi(2);
            size += here.powi(2);
        }
    }
    (size > 0.0).then(|| (difference / size).sqrt())
}

/// The directory with the solution of slipstick.
fn solution(args: &VerifyDeck, deck: &DeckRecord) -> PathBuf {
    args.folder.join(format!("{}_solve", deck.case.trim_end_matches(".toml")))
}

/// The force that round-off of displacements causes. \[F\]
fn round_off(case: &Case, mesh: &Mesh, values: &Values) -> f64 {
    let Some((low, high)) = mesh.bounding_box() else { return 0.0 };
    let size = (0..3).map(|c| high[c] - low[c]).fold(0.0, f64::max);
    let bodies = case.bodies.iter().filter(|body| body.rigid.is_none());
    let moduli = bodies.flat_map(|body| body.materials().map(|material| material.youngs_modulus()));
    ROUND_OFF * moduli.fold(0.0, f64::max) * values.largest()[0] * size
}

fn rows<'a>(deck: &'a DeckRecord, found: &[(String, f64)], values: &Values, round_off: f64) -> Vec<Row<'a>> {
    let of = |compared: &'a Compared| Row {
        compared,
        slipstick: found.iter().find(|(column, _)| *column == compared.column).map(|(_, value)| *value),
        ccx: values.of(compared),
        deviation: None,
        zero: false,
    };
    let mut rows: Vec<Row<'a>> = deck.compared.iter().map(of).collect();
    let kind = |row: &Row<'_>| match row.compared.source {
        Source::Reaction { .. } | Source::Contact { .. } => 0,
        Source::Displacement { .. } => 1,
    };
    for kind_of in 0..2 {
        let own = |row: &&Row<'_>| kind(row) == kind_of;
        let floor = NOISE * values.largest()[1 - kind_of];
        let scale = rows.iter().filter(own).filter_map(|row| row.slipstick).fold(floor, |a: f64, b| a.max(b.abs()));
        let known: Vec<_> =
            rows.iter().filter_map(|row| Some((row.compared.column.as_str(), row.slipstick?))).collect();
        let sizes: Vec<f64> = rows.iter().map(|row| size(&known, &row.compared.column, scale)).collect();
        for (row, size) in rows.iter_mut().zip(sizes).filter(|(row, _)| kind(row) == kind_of) {
            let (Some(here), Some(there)) = (row.slipstick, row.ccx) else { continue };
            row.zero = kind_of == 0 && here.abs().max(there.abs()) < round_off;
            row.deviation = if row.zero { Some(0.0) } else { (size > 0.0).then(|| (there - here) / size) };
        }
    }
    rows
}

/// What a number is compared with: its own magnitude or, if that is [small](SMALL) beside `scale`, the largest
/// of its kind, the magnitude of the vector of which it is a component, between that fraction of `scale` and
/// `scale`.
fn size(known: &[(&str, f64)], column: &str, scale: f64) -> f64 {
    fn vector(column: &str) -> &str {
        ["_x", "_y", "_z"].iter().find_map(|component| column.strip_suffix(component)).unwrap_or(column)
    }
    let own = known.iter().find(|(name, _)| *name == column).map_or(0.0, |(_, value)| value.abs());
    if own >= SMALL * scale {
        return own;
    }
    let of_vector = known.iter().filter(|(name, _)| vector(name) == vector(column)).map(|(_, value)| value * value);
    of_vector.sum::<f64>().sqrt().clamp(SMALL * scale, scale)
}

fn tell(context: &Context, deck: &DeckRecord, rows: &[Row<'_>], field: Option<f64>) {
    let event = |row: &Row<'_>| {
        json!({
            "quantity": row.compared.column, "promised": row.compared.promised, "slipstick": row.slipstick,
            "ccx": row.ccx, "deviation": row.deviation, "zero": row.zero,
        })
    };
    let all: Vec<_> = rows.iter().map(event).collect();
    context.console.event(
        "deck",
        json!({ "deck": deck.deck, "load_case": deck.load_case, "compared": all, "displacements": field }),
    );
    let number = |value: Option<f64>| value.map_or("–".to_owned(), digits);
    let row = |row: &Row<'_>| {
        let percent = |of: f64| format!("{:+.2} %", (1e4 * of).round() / 100.0 + 0.0);
        let deviation = if row.zero { "zero".into() } else { row.deviation.map_or(String::new(), percent) };
        vec![
            row.compared.column.clone(),
            number(row.compared.promised),
            number(row.slipstick),
            number(row.ccx),
            deviation,
        ]
    };
    let name = deck.load_case.as_ref().map_or(String::new(), |name| format!(" (load case {name})"));
    context.console.text(&format!("{} in CalculiX{name}, at the end:", deck.deck));
    let heads = ["quantity", "promised", "slipstick", "ccx", "ccx − slipstick"];
    context.console.lines(&lines(&heads, &rows.iter().map(row).collect::<Vec<_>>()));
    if let Some(field) = field {
        let percent = digits(100.0 * field);
        context
            .console
            .text(&format!("all displacements: the L2 norm of the difference is {percent} % of that of slipstick"));
    }
}

#[cfg(test)]
mod tests {
    use super::size;

    /// By hand: components beside a large one count as parts of their vector, small vectors as a tenth of the largest.
    #[test]
    fn small_components_are_parts_of_their_vector() {
        let known = [("core_x", -0.3), ("core_y", -0.4), ("nose_x", 3.0), ("nose_y", 40.0), ("side_z", 100.0)];
        assert_eq!(size(&known, "nose_y", 100.0), 40.0);
        assert_eq!(size(&known, "nose_x", 100.0), (9.0f64 + 1600.0).sqrt());
        assert_eq!(size(&known, "core_y", 100.0), 10.0);
        assert_eq!(size(&known, "push", 100.0), 10.0);
        let known = [("root_x", 1.0), ("root_y", 90.0), ("root_z", -100.0)];
        assert_eq!(size(&known, "root_x", 100.0), 100.0);
    }
}
