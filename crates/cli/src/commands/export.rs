//! `slipstick export`: a design as a closed triangle surface, as solids for CAD, as a part with its own case, or as a
//! deck; a load path as a result file of CalculiX.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde_json::json;
use slipstick::export::{
    ExportError, ExportOptions, TriangleSurface, design_surface, unit_of_3mf, unit_of_length, write_3mf, write_obj,
    write_stl, write_vtu,
};
use slipstick::part::{LoosePiece, PiecesOfBody, pieces_of_design};
use slipstick::run::{RunDirectory, design_density};
use slipstick::words::counted;
use slipstick_service::run::OpenRun;

pub(super) mod deck;
mod frd;
mod measure;
mod part;
mod step;

use crate::args::Export;
use crate::context::Context;
use crate::summary::digits;
use slipstick_service::failure::{Failure, Outcome};

/// Writes the surface of a design of a run.
///
/// # Errors
/// [`Failure::Input`], [`Failure::Case`].
pub fn run(context: &Context, args: &Export) -> Outcome {
    if let Some(folder) = &args.deck {
        return deck::run(context, args, folder);
    }
    if args.results.is_file() {
        let message = format!("{} is a file, not the directory of a run", args.results.display());
        return Err(Failure::input(message, "a case file can be written as a deck: --deck DIR"));
    }
    let directory = RunDirectory::open(&args.results)?;
    if let Some(file) = &args.frd {
        return frd::run(context, args, directory, file);
    }
    let files = files(args, &directory)?;
    step::refuse(args)?;
    if let Some(folder) = &args.case {
        part::refuse(folder, args.force)?;
    }
    let OpenRun { directory, resolved, mesh } = OpenRun::of(directory)?;
    let density = design_density(&directory, &mesh, args.iteration)?;
    let options = ExportOptions {
        threshold: args.threshold.0,
        smoothing: args.smooth,
        keep_surfaces: args.keep_surfaces,
        bodies: args.body.clone(),
    };
    let length = resolved.case.units.length.as_deref();
    if args.threemf.is_some() {
        unit_of_3mf(length)?;
    }
    if args.step.is_some() {
        unit_of_length(length, "STEP")?;
    }
    let part = match &args.case {
        Some(_) => Some(slipstick::part::part(&resolved.case, &mesh, &density, &options, args.size)?),
        None => None,
    };
    let export = match &part {
        Some(part) => part.export.clone(),
        None => design_surface(&mesh, &density, &options)?,
    };
    let names: Vec<&str> = mesh.bodies.iter().map(|body| body.name.as_str()).collect();
    for (format, file) in &files {
        format.write(file, &export.surface, &names, length)?;
    }
    let (surface, volume) = (&export.surface, export.surface.volume());
    let crossings = surface.crossings();
    let pieces = surface.pieces();
    let solids = step::write(args, &resolved.case, (&mesh, &density), &options, part.as_ref())?;
    let paths: Vec<&PathBuf> = files.iter().map(|(_, file)| file).chain(&args.step).collect();
    context.console.event(
        "result",
        json!({
            "command": "export", "files": paths, "threshold": export.threshold, "triangles": surface.triangles.len(),
            "points": surface.points.len(), "surfaces": pieces, "crossings": crossings,
            "volume": volume,
            "density_volume": export.density_volume,
            "step": solids.as_ref().map(step::record),
        }),
    );
    context.console.text(&format!(
        "density above {}: volume {}, {:+.2} % relative to that of the densities; {} in {}",
        digits(export.threshold),
        digits(volume),
        100.0 * (volume / export.density_volume - 1.0),
        counted(surface.triangles.len(), "triangle"),
        counted(pieces, "closed surface")
    ));
    if crossings > 0 {
        context.console.warning(&format!(
            "{} of the surface cross each other: elements of the design are inverted or flat there; `slipstick check` \
             names them",
            counted(crossings, "pair") + " of triangles"
        ));
    }
    let bodies: BTreeSet<u32> = surface.bodies.iter().copied().collect();
    if let Some(solids) = &solids {
        step::tell(context, solids, export.threshold);
    }
    if pieces > bodies.len() && part.is_none() && solids.is_none() {
        let options = ExportOptions { threshold: Some(export.threshold), ..options.clone() };
        tell_pieces(context, &pieces_of_design(&resolved.case, &mesh, &density, &options)?, export.threshold);
    }
    for file in paths {
        context.console.text(&format!("written: {}", file.display()));
    }
    let measures = match args.measure {
        true => {
            // the same surface with and without a part: the borders of its faces would change it
            let plain = if part.is_some() { design_surface(&mesh, &density, &options)? } else { export };
            Some(measure::run(context, args, &directory, &resolved.case, &mesh, &plain.surface)?)
        }
        false => None,
    };
    match (&args.case, part) {
        (Some(folder), Some(part)) => {
            part::write(context, args, &directory, &resolved.case, (&mesh, &density), part, folder, measures)
        }
        _ => Ok(()),
    }
}

/// Says which pieces of the material nothing or only contact holds; further closed surfaces are cavities.
fn tell_pieces(context: &Context, bodies: &[PiecesOfBody], threshold: f64) {
    if bodies.is_empty() {
        context.console.text("each body is one piece of material; further closed surfaces bound its cavities");
    }
    for PiecesOfBody { body, pieces, loose, by_contact } in bodies {
        context.console.text(&format!("`{body}` consists of {pieces} pieces of material"));
        let connects = format!(
            "if elements below the threshold of {} connect them in the design, a lower --threshold or a sharper `projection` \
             in [design] does so here",
            digits(threshold)
        );
        if let Some((pieces, volume, at)) = summary(loose) {
            context.console.warning(&format!(
                "neither support nor contact holds {pieces} of `{body}` (volume {volume}, the largest at ({at})): the file \
                 contains them; {connects}"
            ));
        }
        if let Some((pieces, volume, at)) = summary(by_contact) {
            context.console.warning(&format!(
                "only contact holds {pieces} of `{body}` (volume {volume}, the largest at ({at})); {connects}"
            ));
        }
    }
}

/// The number of pieces, their volume, and the centre of the box around the largest.
fn summary(pieces: &[LoosePiece]) -> Option<(String, String, String)> {
    let largest = pieces.first()?;
    let volume: f64 = pieces.iter().map(|piece| piece.volume).sum();
    let at: Vec<String> = (0..3).map(|c| digits(0.5 * (largest.bounds[0][c] + largest.bounds[1][c]))).collect();
    Some((counted(pieces.len(), "piece"), digits(volume), at.join(", ")))
}

/// A file format for surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Stl,
    Obj,
    ThreeMf,
    Vtu,
}

impl Format {
    fn extension(self) -> &'static str {
        match self {
            Self::Stl => "stl",
            Self::Obj => "obj",
            Self::ThreeMf => "3mf",
            Self::Vtu => "vtu",
        }
    }

    /// Writes a file; `names` are the names of the bodies, `length` is the name of the case's unit
    /// of length.
    fn write(
        self,
        file: &Path,
        surface: &TriangleSurface,
        names: &[&str],
        length: Option<&str>,
    ) -> Result<(), ExportError> {
        match self {
            Self::Stl => write_stl(file, surface),
            Self::Obj => write_obj(file, surface, names),
            Self::ThreeMf => write_3mf(file, surface, names, length),
            Self::Vtu => write_vtu(file, surface),
        }
    }
}

/// The formats and files to write; if none is given, `design.stl` in the run's directory.
fn files(args: &Export, directory: &RunDirectory) -> Outcome<Vec<(Format, PathBuf)>> {
    let asked = [
        (Format::Stl, &args.stl),
        (Format::Obj, &args.obj),
        (Format::ThreeMf, &args.threemf),
        (Format::Vtu, &args.vtu),
    ];
    let files: Vec<(Format, PathBuf)> =
        asked.into_iter().filter_map(|(format, file)| Some((format, file.clone()?))).collect();
    for (format, file) in &files {
        accept(file, format.extension(), args.force)?;
    }
    Ok(if files.is_empty() && args.case.is_none() && args.step.is_none() {
        vec![(Format::Stl, directory.file("design.stl"))]
    } else {
        files
    })
}

/// Refuses a file with another extension than that of its format, which is also the name of the option, and
/// one that exists, unless it may be replaced.
fn accept(file: &Path, extension: &str, force: bool) -> Outcome {
    if !file.extension().is_some_and(|found| found.eq_ignore_ascii_case(extension)) {
        let message = format!("{} does not end in .{extension}", file.display());
        return Err(Failure::input(message, format!("give --{extension} a file name with this extension")));
    }
    if file.exists() && !force {
        let message = format!("{} already exists", file.display());
        return Err(Failure::input(message, "name another file, or give --force to replace it"));
    }
    Ok(())
}
