//! `slipstick new`: a commented case file to start from.

use std::path::PathBuf;

use serde_json::json;
use slipstick::case::{TEMPLATES, template};
use slipstick::output::write_atomically;

use crate::args::New;
use crate::failure::Failure;
use crate::{Context, Outcome};

/// Writes a template, or lists all.
///
/// # Errors
/// [`Failure::Input`] for an unknown template, an existing file, or one that cannot be written.
pub fn run(context: &Context, args: &New) -> Outcome {
    let console = &context.console;
    let Some(name) = &args.template else {
        let width = TEMPLATES.iter().map(|template| template.name.len()).max().unwrap_or(0);
        for found in TEMPLATES {
            console.text(&format!("  {:width$}   {}", found.name, found.about));
            console.event("result", json!({ "command": "new", "template": found.name, "about": found.about }));
        }
        return Ok(());
    };
    let Some(found) = template(name) else {
        let known: Vec<&str> = TEMPLATES.iter().map(|template| template.name).collect();
        return Err(Failure::input(format!("there is no template `{name}`"), format!("known: {}", known.join(", "))));
    };
    let file = args.out.clone().unwrap_or_else(|| PathBuf::from(found.name.replace('-', "_") + ".toml"));
    if file.as_os_str() == "-" {
        console.raw(found.text);
        return Ok(());
    }
    if file.exists() && !args.force {
        let cure = "name another file with --out, or give --force to replace it";
        return Err(Failure::input(format!("{} exists already", file.display()), cure));
    }
    write_atomically(&file, |writer| writer.write_all(found.text.as_bytes()))?;
    let shown = file.display();
    console.text(&format!("wrote {shown}: {}", found.about));
    console.text(&format!("next: slipstick check {shown}"));
    console.event("result", json!({ "command": "new", "template": found.name, "file": file }));
    Ok(())
}
