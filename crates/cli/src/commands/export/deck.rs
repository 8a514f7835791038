//! `slipstick export --deck`: a case, or the solid elements of a design, as a deck for CalculiX.

use std::fs;
use std::path::Path;

use serde_json::json;
use slipstick::build::build;
use slipstick::case::{Case, Promise, Resolved};
use slipstick::deck::{DeckOptions, DeckRecord, Note, deck, solid_part};
use slipstick::mesh::Mesh;
use slipstick::output::write_atomically;
use slipstick::run::{RunDirectory, design_density, promises};
use slipstick::words::{counted, shell_word};
use slipstick_service::failure::{Failure, Outcome};
use slipstick_service::read::case_or_deck;
use slipstick_service::run::OpenRun;

use crate::args::Export;
use crate::context::Context;
use crate::runs::refuse_shared;
use crate::summary::digits;

/// The file that lists the decks of a folder.
pub const RECORD: &str = "deck.json";

/// Writes the files of a deck and says what they contain.
pub(super) fn run(context: &Context, args: &Export, folder: &Path) -> Outcome {
    refuse(folder, args.force)?;
    let (resolved, mesh, promised) = if args.results.is_file() {
        let resolved = case_or_deck(&args.results, &[], &[]).map_err(|error| error.at(&args.results))?;
        // builds the whole problem, so that the errors of `check` come before anything is written
        let mesh = build(&resolved.case).map_err(|error| Failure::build(&error, &resolved.source_map))?.mesh;
        let promised = resolved.case.promises.clone();
        (resolved, mesh, promised)
    } else {
        let OpenRun { directory, resolved, mesh } = OpenRun::of(RunDirectory::open(&args.results)?)?;
        let mesh = reduced(context, args, &directory, &resolved.case, mesh)?;
        // the tables of a run belong to its last design
        let own = if args.iteration.is_none() { promises(&directory, &resolved.case)? } else { vec![] };
        (resolved, mesh, own)
    };
    write(context, args, folder, &resolved, &mesh, &promised)
}

/// The solid part of the design of a run.
fn reduced(context: &Context, args: &Export, run: &RunDirectory, case: &Case, mesh: Mesh) -> Outcome<Mesh> {
    let Some(design) = &case.design else { return Ok(mesh) };
    let density = design_density(run, &mesh, args.iteration)?;
    let own: usize =
        mesh.bodies.iter().filter(|body| design.bodies.contains(&body.name)).map(|b| b.elements.len()).sum();
    let solid = solid_part(case, &mesh, &density, args.threshold.0);
    let removed = mesh.elements.len() - solid.mesh.elements.len();
    if removed == own {
        let message = format!("no element of the design has a density above {}", digits(solid.threshold));
        return Err(Failure::input(message, "give a lower --threshold"));
    }
    context.console.text(&format!(
        "density above {}: {} of {}; volume {:+.2} % relative to that of the densities",
        digits(solid.threshold),
        own - removed,
        counted(own, "element"),
        100.0 * (solid.volume_ratio - 1.0)
    ));
    if solid.loose > 0 {
        let text = counted(solid.loose, "element");
        context.console.warning(&format!("{text} are left out: no support, contact or joint holds their pieces"));
    }
    for (surface, share) in &solid.loaded {
        context.console.warning(&format!(
            "{:.1} % of the loaded surface `{surface}` lies on void and is left out: a pressure or traction there is \
             missing, and a force is spread over the rest (a lower --threshold, or `passive_solid` under the load)",
            100.0 * (1.0 - share)
        ));
    }
    Ok(solid.mesh)
}

/// Refuses a folder with another run, case or deck.
fn refuse(folder: &Path, force: bool) -> Outcome {
    refuse_shared(folder, "files of the deck", "--deck deck")?;
    let taken = ["case.toml", "model.inp", RECORD].into_iter().find(|name| folder.join(name).exists());
    let Some(name) = taken else { return Ok(()) };
    if RunDirectory::open(folder).is_ok() || !folder.join(RECORD).exists() {
        let message = format!("{} has a {name} that `export --deck` did not write", folder.display());
        return Err(Failure::input(message, "name another folder"));
    }
    if force {
        return Ok(());
    }
    let message = format!("{} already exists", folder.join(name).display());
    Err(Failure::input(message, "name another folder, or give --force to replace its deck"))
}

fn write(
    context: &Context,
    args: &Export,
    folder: &Path,
    resolved: &Resolved,
    mesh: &Mesh,
    promised: &[Promise],
) -> Outcome {
    let case = &resolved.case;
    let mut written = Vec::new();
    for load_case in 0..case.load_cases.len().max(1) {
        let options = DeckOptions {
            load_case,
            ignored: &args.ignore,
            contact_stiffness: args.contact_stiffness,
            promises: promised,
        };
        written.push(deck(case, mesh, options).map_err(|error| Failure::build(&error, &resolved.source_map))?);
    }
    let mut notes: Vec<&Note> = Vec::new();
    for note in written.iter().flat_map(|deck| &deck.notes) {
        if !notes.contains(&note) {
            notes.push(note);
        }
    }
    let refused: Vec<&&Note> = notes.iter().filter(|note| note.refused).collect();
    if let [first, rest @ ..] = &refused[..] {
        let mut message = format!("a deck cannot hold `{}`: {}", first.key, first.message);
        let mut cure = first.cure.clone();
        for note in rest {
            message += &format!("\n  nor `{}`: {}", note.key, note.message);
            cure += &format!("\n    help: {}", note.cure);
        }
        return Err(Failure::input(message, cure));
    }
    fs::create_dir_all(folder).map_err(|error| {
        Failure::input(format!("cannot create {}: {error}", folder.display()), "check its name and permissions")
    })?;
    let records: Vec<&DeckRecord> = written.iter().map(|deck| &deck.record).collect();
    for deck in &written {
        let file = |name: &str, text: &str| write_atomically(&folder.join(name), |out| out.write_all(text.as_bytes()));
        file(&deck.record.deck, &deck.deck)?;
        file(&deck.record.case, &deck.case)?;
    }
    let text = format!("{:#}\n", json!({ "decks": records }));
    write_atomically(&folder.join(RECORD), |out| out.write_all(text.as_bytes()))?;
    context.console.event("result", json!({ "command": "export", "folder": folder, "decks": records, "notes": notes }));
    for note in &notes {
        context.console.warning(&format!("`{}`: {} ({})", note.key, note.message, note.cure));
    }
    let mut left_out: Vec<&(String, String)> = Vec::new();
    for of in records.iter().flat_map(|record| &record.left_out).filter(|(name, _)| !name.is_empty()) {
        if !left_out.iter().any(|(name, _)| *name == of.0) {
            left_out.push(of);
        }
    }
    for (name, why) in left_out {
        context.console.text(&format!("not compared: {name}: {why}"));
    }
    let shown = folder.display();
    for record in &records {
        context.console.text(&format!("written: {shown}/{}, {}", record.deck, record.case));
    }
    context.console.text(&format!("next: slipstick verify deck {}", shell_word(&shown.to_string())));
    Ok(())
}
