//! Designs as solids for CAD.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use slipstick_case::file::Case;
use slipstick_mesh::Mesh;
use slipstick_results::output::write_atomically;

use super::patches::NamedFaces;
use super::remesh::PatchedSurface;
use super::{PartBody, PartError, part_body, refuse_too_fine};
use crate::export::{Export, ExportError, ExportOptions, labelled_surface, unit_of_length};
use crate::step::{Faces, Source, simplified, step};

/// The bodies of a design as solids.
#[derive(Debug, Clone)]
pub struct Solids {
    /// The bodies.
    pub bodies: Vec<PartBody>,
    /// The surface of the design, as exported.
    pub export: Export,
}

/// How far a STEP file's facets may be from those of the part, relative to the shortest edges.
const NEAR: f64 = 0.07;

/// Largest change of the volume by that.
const VOLUME: f64 = 1e-4;

/// The bodies of a design as parts that keep their outer faces; `size` is as for [`super::part`]. Unlike there, any body may
/// be one, also one that is solid everywhere, and no face must be left. Those that are parts already, of the same size and
/// threshold, are taken from `made`.
///
/// # Errors
/// [`PartError`]: the design has no surface, or too fine a one.
pub fn solids(
    case: &Case,
    mesh: &Mesh,
    density: &[f64],
    options: &ExportOptions,
    size: Option<f64>,
    made: &[PartBody],
) -> Result<Solids, PartError> {
    let all: Vec<usize> = (0..mesh.bodies.len()).collect();
    let faces = NamedFaces::new(mesh, &all);
    let options = ExportOptions { keep_surfaces: true, ..options.clone() };
    let export = labelled_surface(mesh, density, &options, &faces.labels)?;
    let mut bodies = Vec::new();
    for body in all {
        let own = export.surface.restricted(|t| export.surface.bodies[t] as usize == body);
        if own.triangles.is_empty() {
            continue;
        }
        if let Some(size) = size {
            refuse_too_fine(&own, &mesh.bodies[body].name, size)?;
        }
        let solid: Vec<usize> =
            mesh.bodies[body].elements.clone().filter(|&e| density[e] >= export.threshold).collect();
        let mut part = match made.iter().find(|part| part.name == mesh.bodies[body].name) {
            Some(part) => part.clone(),
            None => part_body(case, mesh, &faces, &own, (body, &solid), size)?,
        };
        simplify(&mut part);
        bodies.push(part);
    }
    Ok(Solids { bodies, export })
}

/// Leaves out points of the surface where material was removed that lie close to the triangles of their neighbours, unless
/// triangles would cross.
fn simplify(body: &mut PartBody) {
    let surface = &body.surface;
    let mut free = vec![true; surface.points.len()];
    for (triangle, patch) in surface.triangles.iter().zip(&surface.patch) {
        if body.cut.binary_search(&(patch + 1)).is_err() {
            triangle.iter().for_each(|&n| free[n as usize] = false);
        }
    }
    let limits = (NEAR * body.edges[0], VOLUME * body.volume);
    let kept = simplified(&surface.points, &surface.triangles, &free, limits);
    let simple = PatchedSurface {
        points: surface.points.clone(),
        triangles: kept.iter().map(|(_, triangle)| *triangle).collect(),
        patch: kept.iter().map(|(t, _)| surface.patch[*t]).collect(),
    };
    if body.crossings == 0 && simple.crossings() == 0 {
        body.shapes = kept.iter().map(|(t, _)| body.shapes[*t]).collect();
        body.surface = simple;
    }
}

/// Writes bodies as solids to a STEP file; `length` is the case's name for the unit of length.
///
/// # Errors
/// [`ExportError::Unit`]; [`ExportError::Output`].
pub fn write_step(path: &Path, bodies: &[PartBody], length: Option<&str>) -> Result<Faces, ExportError> {
    let unit = unit_of_length(length, "STEP")?;
    let solids: Vec<(String, Vec<Source>)> = bodies.iter().map(|body| (body.name.clone(), sources(body))).collect();
    let (text, faces) = step(&solids, unit);
    write_atomically(path, |writer| writer.write_all(text.as_bytes()))?;
    Ok(faces)
}

/// The boundaries of the pieces of a body.
fn sources(body: &PartBody) -> Vec<Source> {
    let mut piece: HashMap<u32, usize> = HashMap::new();
    for (number, patches) in body.pieces.iter().enumerate() {
        piece.extend(patches.iter().map(|&patch| (patch, number)));
    }
    // a union of surfaces has no group; its parts have
    let mut names: BTreeMap<u32, &str> = BTreeMap::new();
    for face in body.faces.iter().filter(|face| face.group.is_some()) {
        face.patches.iter().for_each(|&patch| _ = names.entry(patch).or_insert(&face.name));
    }
    let mut found = vec![Source::default(); body.pieces.len()];
    let mut numbers: Vec<HashMap<u32, u32>> = vec![HashMap::new(); found.len()];
    for (t, triangle) in body.surface.triangles.iter().enumerate() {
        let patch = body.surface.patch[t] + 1;
        let Some(&number) = piece.get(&patch) else { continue };
        let (source, numbers) = (&mut found[number], &mut numbers[number]);
        source.triangles.push(triangle.map(|n| {
            *numbers.entry(n).or_insert_with(|| {
                source.points.push(body.surface.points[n as usize]);
                source.points.len() as u32 - 1
            })
        }));
        source.outer.push(body.cut.binary_search(&patch).is_err());
        source.shapes.push(body.shapes[t]);
        source.names.push(names.get(&patch).map_or_else(String::new, |name| (*name).to_owned()));
    }
    found
}
