//! `slipstick new`: writes a commented case file to start from.

mod step;

use std::path::{Path, PathBuf};

use serde_json::json;
use slipstick::case::{TEMPLATES, case_of_mesh, design_of_deck, template};
use slipstick::output::write_atomically;
use slipstick::run::with_includes;
use slipstick::words::shell_word;
use slipstick_service::read::case_or_deck;

use crate::args::New;
use crate::context::Context;
use slipstick_service::failure::{Failure, Outcome};

/// Name of the template for a mesh file.
const MY_MESH: &str = "my-mesh";

/// Its description.
const ABOUT_MY_MESH: &str = "your own mesh, with its bodies and surfaces by name: `slipstick new my-mesh --mesh FILE`";

/// Description of a STEP file given instead of a template.
const ABOUT_STEP: &str = "your own STEP file, meshed with Gmsh for Python: `slipstick new part.step`";

/// Writes a template, or lists all.
///
/// # Errors
/// [`Failure::Input`] for an unknown template, a mesh that cannot be used, or an output file that
/// exists or cannot be written.
pub fn run(context: &Context, args: &New) -> Outcome {
    if let Some(deck) = &args.deck {
        return of_deck(context, args, deck);
    }
    if let Some(file) = args.template.as_deref().filter(|name| step::is_step(name)) {
        return step::of_step(context, args, Path::new(file));
    }
    if args.size.is_some() || args.distance.is_some() || args.hexahedra {
        let cure = "name the STEP file: `slipstick new part.step`";
        return Err(Failure::input("--size, --distance and --hexahedra are for STEP files", cure));
    }
    let name = args.template.as_deref().map(|name| name.replace('_', "-"));
    match (name.as_deref(), &args.mesh) {
        (None, None) => list(context),
        (None | Some(MY_MESH), Some(mesh)) => of_mesh(context, args, mesh),
        (Some(MY_MESH), None) => {
            let cure = "give a .msh, .inp, .vtu or .vtk file with --mesh";
            Err(Failure::input("the template `my-mesh` needs a mesh", cure))
        }
        (Some(name), Some(_)) => {
            let message = format!("the template `{name}` has its own shapes and takes no mesh");
            Err(Failure::input(message, "omit --mesh, or use the template `my-mesh`"))
        }
        (Some(name), None) => {
            let Some(found) = template(name) else {
                let known: Vec<&str> = names().map(|(name, _)| name).collect();
                let message = format!("there is no template `{name}`");
                return Err(Failure::input(message, format!("available: {}", known.join(", "))));
            };
            let file = args.out.clone().unwrap_or_else(|| PathBuf::from(found.name.replace('-', "_") + ".toml"));
            write(context, args, &file, found.text, found.name, found.about)
        }
    }
}

/// All templates with their descriptions.
fn names() -> impl Iterator<Item = (&'static str, &'static str)> {
    TEMPLATES.iter().map(|template| (template.name, template.about)).chain([(MY_MESH, ABOUT_MY_MESH)])
}

fn list(context: &Context) -> Outcome {
    let console = &context.console;
    let width = names().map(|(name, _)| name.len()).max().unwrap_or(0);
    for (name, about) in names() {
        console.text(&format!("  {name:width$}   {about}"));
        console.event("result", json!({ "command": "new", "template": name, "about": about }));
    }
    console.text(&format!("  {:width$}   {ABOUT_STEP}", "part.step"));
    Ok(())
}

/// Writes a case for a mesh file.
fn of_mesh(context: &Context, args: &New, mesh: &Path) -> Outcome {
    let bytes = with_includes(mesh).map_err(|error| {
        Failure::input(format!("cannot read the mesh file {}: {error}", mesh.display()), "check its name")
    })?;
    let stem = mesh.file_stem().unwrap_or(mesh.as_os_str());
    let file = args.out.clone().unwrap_or_else(|| Path::new(stem).with_extension("toml"));
    let case = case_of_mesh(&bytes, &seen_from(&file, mesh)).map_err(|error| {
        Failure::input(format!("{}: {}: {}", mesh.display(), error.place, error.message), error.cure)
    })?;
    // standard output contains only the case, which mentions the same changes
    if file.as_os_str() != "-" {
        case.notices.iter().for_each(|notice| context.console.warning(notice));
    }
    write(context, args, &file, &case.text, MY_MESH, "contact, supports and motion are guesses: correct them")
}

/// Writes a case for a deck.
fn of_deck(context: &Context, args: &New, deck: &Path) -> Outcome {
    let resolved = case_or_deck(deck, &[], &args.ignore).map_err(|error| error.at(deck))?;
    let stem = deck.file_stem().unwrap_or(deck.as_os_str());
    let file = args.out.clone().unwrap_or_else(|| Path::new(stem).with_extension("toml"));
    let text = design_of_deck(&resolved.case, &seen_from(&file, deck), &args.ignore);
    if let Some(ledger) = resolved.deck.as_ref().filter(|_| file.as_os_str() != "-") {
        context.console.lines(&super::check::deck(ledger));
    }
    write(context, args, &file, &text, "deck", "design and objective are guesses: adapt them")
}

/// The path of the mesh file from the folder of the case file: relative if it lies in or below that
/// folder, otherwise absolute.
fn seen_from(case: &Path, mesh: &Path) -> String {
    let folder = match case.parent() {
        Some(parent) if parent != Path::new("") && case.as_os_str() != "-" => parent,
        // without further knowledge, assume that they are in the same folder
        _ => return mesh.display().to_string(),
    };
    let seen = match (folder.canonicalize(), mesh.canonicalize()) {
        (Ok(folder), Ok(mesh)) => mesh.strip_prefix(folder).map(Path::to_path_buf).unwrap_or(mesh),
        _ => mesh.to_path_buf(),
    };
    seen.display().to_string()
}

fn write(context: &Context, args: &New, file: &Path, text: &str, name: &str, about: &str) -> Outcome {
    let console = &context.console;
    if file.as_os_str() == "-" {
        console.raw(text);
        return Ok(());
    }
    if file.exists() && !args.force {
        let cure = "name another file with --out, or give --force to replace it";
        return Err(Failure::input(format!("{} already exists", file.display()), cure));
    }
    write_atomically(file, |writer| writer.write_all(text.as_bytes()))?;
    let shown = file.display();
    console.text(&format!("wrote {shown}: {about}"));
    console.text(&format!("next: slipstick check {}", shell_word(&shown.to_string())));
    console.event("result", json!({ "command": "new", "template": name, "file": file }));
    Ok(())
}
