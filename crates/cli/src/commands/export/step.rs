//! `slipstick export --step`: the design as solids for CAD.

use serde_json::{Value, json};
use slipstick::case::Case;
use slipstick::export::ExportOptions;
use slipstick::mesh::Mesh;
use slipstick::part::{Part, Solids, solids, write_step};
use slipstick::step::Faces;
use slipstick::words::counted;

use super::{accept, summary};
use crate::args::Export;
use crate::context::Context;
use crate::summary::digits;
use slipstick_service::failure::{Failure, Outcome};

/// Refuses options that do not go with a STEP file, and the name of a file that exists or ends otherwise.
pub(super) fn refuse(args: &Export) -> Outcome {
    let Some(file) = &args.step else {
        if args.size.is_some() && args.case.is_none() {
            return Err(Failure::input("--size is for --case and --step", "give one of them, or omit --size"));
        }
        return Ok(());
    };
    if !args.keep_surfaces {
        let message = "a STEP file has the outer faces of the bodies, which --keep-surfaces false does not keep";
        return Err(Failure::input(message, "omit --keep-surfaces, or write STL or OBJ"));
    }
    match file.extension() {
        Some(found) if found.eq_ignore_ascii_case("stp") => accept(file, "stp", args.force),
        _ => accept(file, "step", args.force),
    }
}

/// Writes the STEP file, if one is wanted.
pub(super) fn write(
    args: &Export,
    case: &Case,
    (mesh, density): (&Mesh, &[f64]),
    options: &ExportOptions,
    part: Option<&Part>,
) -> Outcome<Option<(Solids, Faces)>> {
    let Some(file) = &args.step else { return Ok(None) };
    // the bodies of a part with the same threshold are not meshed again
    let threshold = part.map_or(options.threshold, |part| Some(part.export.threshold));
    let options = ExportOptions { threshold, ..options.clone() };
    let solids = solids(case, mesh, density, &options, args.size, part.map_or(&[][..], |part| &part.bodies[..]))?;
    let faces = write_step(file, &solids.bodies, case.units.length.as_deref())?;
    Ok(Some((solids, faces)))
}

/// The numbers of the file.
pub(super) fn record((solids, faces): &(Solids, Faces)) -> Value {
    let bodies = solids.bodies.iter().map(|body| {
        json!({ "name": body.name, "solids": body.pieces.len(), "volume": body.volume, "triangles": body.triangles() })
    });
    json!({
        "bodies": bodies.collect::<Vec<_>>(), "planes": faces.planes, "curved": faces.curved, "facets": faces.facets,
        "curved_as_facets": faces.left,
    })
}

/// Says what the file contains, and what it lacks.
pub(super) fn tell(context: &Context, (solids, faces): &(Solids, Faces), threshold: f64) {
    let count: usize = solids.bodies.iter().map(|body| body.pieces.len()).sum();
    context.console.text(&format!(
        "{}: {}, {} on cylinders, cones, spheres and tori, {} where material was removed",
        counted(count, "solid"),
        counted(faces.planes, "plane face"),
        faces.curved,
        counted(faces.facets, "facet")
    ));
    if faces.left > 0 {
        context.console.warning(&format!(
            "{} wholly or partly as facets: points of the surface do not reach {}; another --size may help",
            counted(faces.left, "curved face"),
            if faces.left == 1 { "it" } else { "them" }
        ));
    }
    for body in &solids.bodies {
        if body.crossings > 0 {
            context.console.warning(&format!(
                "{} of `{}` cross each other: CAD programs may refuse the solid",
                counted(body.crossings, "pair") + " of triangles",
                body.name
            ));
        }
        if let Some((pieces, volume, at)) = summary(&body.loose) {
            context.console.warning(&format!(
                "{pieces} of `{}` that no support holds (volume {volume}, the largest at ({at})) left out of the STEP \
                 file; if elements below the threshold of {} connect them in the design, a lower --threshold does so \
                 here",
                body.name,
                digits(threshold)
            ));
        }
    }
}
