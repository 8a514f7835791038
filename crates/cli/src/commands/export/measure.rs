//! `slipstick export --measure`: the thinnest member and the narrowest gap of a design.

use serde_json::{Value, json};
use slipstick::case::{Case, Dimension};
use slipstick::export::{Distance, TriangleSurface, measure};
use slipstick::mesh::Mesh;
use slipstick::output::write_atomically;
use slipstick::part::regular_surface;
use slipstick::report::MEASURES;
use slipstick::run::RunDirectory;

use crate::args::Export;
use crate::context::Context;
use crate::summary::digits;
use slipstick_service::failure::Outcome;

/// Measures a surface, prints the results and, if it is the newest design, keeps them in the run;
/// returns what was written.
pub(super) fn run(
    context: &Context,
    args: &Export,
    directory: &RunDirectory,
    case: &Case,
    mesh: &Mesh,
    surface: &TriangleSurface,
) -> Outcome<Value> {
    let mirrors: Vec<(usize, f64)> = case.symmetries.iter().map(|plane| (plane.normal as usize, plane.at)).collect();
    let found = measure(&regular_surface(mesh, surface), &mirrors);
    let unit = case.units.bracket(Dimension::LENGTH);
    let text = |what: &str, distance: Option<Distance>| match distance {
        Some(Distance { length, at, body }) => {
            let at = at.map(digits).join(", ");
            let of = mesh.bodies.get(body as usize).map_or("", |body| &body.name);
            context.console.text(&format!("{what}{unit}: {} at ({at}) of {of}", digits(length)));
        }
        None => context.console.text(&format!("{what}: none")),
    };
    text("thinnest member", found.member);
    text("narrowest gap", found.gap);
    let requested = case.design.as_ref().and_then(|design| design.minimum_thickness);
    if let Some(thickness) = requested {
        context.console.text(&format!("requested of both{unit}: {}", digits(thickness)));
    }
    let value = json!({ "member": found.member, "gap": found.gap, "requested": requested });
    if args.iteration.is_none() {
        let line = format!("{value:#}\n");
        write_atomically(&directory.file(MEASURES), |writer| writer.write_all(line.as_bytes()))?;
    }
    context.console.event("measures", value.clone());
    Ok(value)
}
