//! `slipstick explain`: what a code means and how to fix the mistake.

use serde_json::json;
use slipstick::case::CaseCode;

use crate::args::Explain;
use crate::context::Context;
use slipstick_service::failure::{Failure, Outcome};

/// Prefix of all codes.
const PREFIX: &str = "slipstick::case::";

/// Explains a code, or lists all.
///
/// # Errors
/// [`Failure::Input`] for an unknown code.
pub fn run(context: &Context, args: &Explain) -> Outcome {
    let console = &context.console;
    let name = |code: CaseCode| code.as_str().trim_start_matches(PREFIX);
    let event = |code: CaseCode| {
        let told = json!({ "command": "explain", "code": code.as_str(), "about": code.about(), "cure": code.cure() });
        console.event("result", told);
    };
    let Some(asked) = &args.code else {
        let rows = CaseCode::ALL.iter().map(|&code| format!("  {:<22}   {}", name(code), code.about()));
        console.lines(&rows.collect::<Vec<_>>());
        CaseCode::ALL.iter().for_each(|&code| event(code));
        return Ok(());
    };
    let bare = asked.trim().trim_start_matches('[').trim_end_matches(']').trim_start_matches(PREFIX);
    let Some(&code) = CaseCode::ALL.iter().find(|&&code| name(code) == bare) else {
        let like = CaseCode::ALL.iter().map(|&code| name(code)).filter(|known| known.contains(bare));
        let like: Vec<&str> = like.collect();
        let cure = match &like[..] {
            [] => "`slipstick explain` lists all codes".into(),
            some => format!("similar codes: {}", some.join(", ")),
        };
        return Err(Failure::input(format!("there is no code `{asked}`"), cure));
    };
    event(code);
    console.text(code.as_str());
    console.text(&format!("\n{}", code.about()));
    console.text(&format!("\n{}", code.cure()));
    Ok(())
}
