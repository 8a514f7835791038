//! `slipstick schema`: the JSON schema of case files, for editors.

use serde_json::json;
use slipstick::output::write_atomically;

use crate::args::SchemaOf;
use crate::context::Context;
use slipstick_service::failure::{Failure, Outcome};

/// Writes the JSON schema of case files.
///
/// # Errors
/// [`Failure::Input`] for a file that exists or cannot be written.
pub fn run(context: &Context, args: &SchemaOf) -> Outcome {
    let text = format!("{:#}\n", slipstick::case::schema());
    let Some(file) = &args.out else {
        context.console.raw(&text);
        return Ok(());
    };
    if file.exists() && !args.force {
        let cure = "name another file with --out, or give --force to replace it";
        return Err(Failure::input(format!("{} already exists", file.display()), cure));
    }
    write_atomically(file, |writer| writer.write_all(text.as_bytes()))?;
    let shown = file.display();
    context.console.text(&format!("wrote {shown}; refer to it in the first line of a case file: #:schema {shown}"));
    context.console.event("result", json!({ "command": "schema", "file": file }));
    Ok(())
}
