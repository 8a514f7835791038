//! Prepares a design to be meshed and analysed as a part.
//!
//! ```text
//! densities ──export──▶ closed surface ──held pieces──▶ patches by name ──remeshed──▶ MSH file, script for Gmsh
//! case      ─────────────────────────────────────────▶ the same bodies, contact and path, without design
//! ```
//!
//! The faces of the design domain stay in place: curved ones keep their nodes, and points between
//! these lie on the smooth surface for which the facets stand. A patch is a connected part of the surface that
//! belongs to the same surfaces and node sets of the case everywhere. Patch borders are preserved,
//! so the script can name contact faces, supports and loads in Gmsh's mesh. The triangles of the
//! surface become almost equilateral and never cross; Gmsh fills the surface with elements without
//! changing it.

mod carry;
mod compare;
mod curved;
mod error;
mod files;
mod lengths;
mod patches;
mod per_node;
mod pieces;
mod remesh;
mod solids;
#[cfg(test)]
mod tests;
mod touching;

pub use error::PartError;
pub use files::{SCRIPT, write_moves, write_script, write_surface};
pub use per_node::PerNode;
pub use pieces::{LoosePiece, PiecesOfBody, pieces_of_design};
pub use solids::{Solids, solids, write_step};
pub use touching::Touching;

use std::collections::BTreeSet;

use slipstick_case::construct::smooth_faces;
use slipstick_case::file::Case;
use slipstick_mesh::{Mesh, Shape, SmoothSurface};

use crate::export::{Export, ExportOptions, TriangleSurface, labelled_surface};
use crate::vector::{area, norm};
use curved::Curved;
use lengths::Lengths;
use patches::{NamedFaces, Patch, patches};
use pieces::{Fate, fate};
use remesh::{PatchedSurface, remeshed};

/// A part: the designed bodies as surfaces to be meshed, and the case in which they are analysed.
#[derive(Debug, Clone)]
pub struct Part {
    /// The designed bodies that lose material.
    pub bodies: Vec<PartBody>,
    /// The designed bodies that are solid everywhere: they keep their shapes and meshes.
    pub whole: Vec<String>,
    /// The case of the part; its designed bodies come from the files that Gmsh writes.
    pub case: Case,
    /// Mesh files that other bodies use: their names in the design's case and in the part's.
    pub copies: Vec<(String, String)>,
    /// Node sets that the part's case selects again by position.
    pub reselected: Vec<String>,
    /// Surfaces and sets that the part's case lacks, because nothing uses them and they may be empty.
    pub unused: Vec<String>,
    /// Faces that the case needs and of which hardly anything is left.
    pub scarce: Vec<Scarce>,
    /// Faces of which a part is missing, where that changes loads or contact.
    pub reduced: Vec<Reduced>,
    /// Forces and springs that the design's case gives for each node of a remeshed body.
    pub per_node: Vec<PerNode>,
    /// The surface of the design, as exported.
    pub export: Export,
}

/// A face with a share of less than 1 % that the case needs.
#[derive(Debug, Clone, PartialEq)]
pub struct Scarce {
    /// Its name.
    pub name: String,
    /// What needs it, for example "a support or motion".
    pub used: String,
    /// As [`NamedFace::share`].
    pub share: f64,
}

/// What acts on a face, and becomes less with its area.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Acts {
    /// A pressure.
    Pressure,
    /// A traction.
    Traction,
    /// A spring with a stiffness per area.
    Spring,
    /// Contact.
    Contact,
    /// A tie.
    Tie,
    /// A quantity that measures a gap, a share of the surface, or a contact pressure other than the peak.
    Measured,
}

/// A face with a part of its area, where less area means less load or contact.
#[derive(Debug, Clone, PartialEq)]
pub struct Reduced {
    /// Its name.
    pub name: String,
    /// What acts there.
    pub acts: Acts,
    /// As [`NamedFace::share`].
    pub share: f64,
}

/// A designed body as a surface of patches.
#[derive(Debug, Clone)]
pub struct PartBody {
    /// Its name.
    pub name: String,
    /// Target length of its edges, as a mean over the elements of the body. \[L\]
    pub size: f64,
    /// The shortest and the longest target length of an edge. \[L\]
    pub edges: [f64; 2],
    /// About how many tetrahedra fill it.
    pub tetrahedra: usize,
    /// Volume that its surface encloses. \[L³\]
    pub volume: f64,
    /// Pieces that are left out because no support holds them and no contact pair needs them, the
    /// largest first.
    pub loose: Vec<LoosePiece>,
    /// Pieces that only a contact pair holds, beside those with a support, the largest first.
    pub by_contact: Vec<LoosePiece>,
    /// Its surfaces and node sets.
    pub faces: Vec<NamedFace>,
    /// The patches around each piece of its material, including those of cavities; counted from 1.
    pub pieces: Vec<Vec<u32>>,
    /// The patches that do not lie on outer faces of the design domain; counted from 1.
    cut: Vec<u32>,
    /// Names of the faces with material on loose pieces.
    left_out: BTreeSet<String>,
    /// Number of pairs of its triangles that cross each other; 0 unless elements are inverted.
    pub crossings: usize,
    surface: PatchedSurface,
    /// The shape on which each of its triangles lies.
    shapes: Vec<Option<Shape>>,
    /// Where elements get points between those of the surface.
    moves: curved::Moves,
}

/// A surface or a node set of a designed body.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedFace {
    /// Its name in the case.
    pub name: String,
    /// Its name in the mesh file; `None` for a union of other surfaces.
    pub group: Option<String>,
    /// Area on the part divided by area on the design domain, 0 … 1.
    pub share: f64,
    /// Relative difference of its area from that on the design's surface, on facets.
    pub area_change: f64,
    /// Largest distance of its triangles from the face of the design domain, before points of curved
    /// faces moved onto the smooth surface. \[L\]
    pub distance: f64,
    /// Its patches, counted from 1.
    pub patches: Vec<u32>,
}

impl PartBody {
    /// Number of triangles of its surface.
    pub fn triangles(&self) -> usize {
        self.surface.triangles.len()
    }

    /// The mesh file that the script writes.
    pub fn mesh_file(&self) -> String {
        format!("{}_part.msh", self.name)
    }

    /// Whether a face lies where the design's does: its area within 2 % of the whole face, its distance
    /// within 2 % of the edges.
    pub fn keeps(&self, face: &NamedFace) -> bool {
        (face.share * face.area_change).abs() < 0.02 && face.distance < 0.02 * self.size
    }

    /// The file with the points of curved faces between those of the surface.
    pub fn curved_file(&self) -> String {
        format!("{}_curved.json", self.name)
    }

    /// The file with its surface.
    pub fn surface_file(&self) -> String {
        format!("{}_surface.msh", self.name)
    }
}

/// Prepares the part for a design. `size` is the edge length \[L\]; by default, edges are
/// as long as the shortest edges of the design's elements there. Without it, a body that is solid everywhere keeps
/// its mesh.
///
/// # Errors
/// [`PartError`]: the case has no design, the design has no surface, or no material is left on a
/// surface or set that the case needs.
pub fn part(
    case: &Case,
    mesh: &Mesh,
    density: &[f64],
    options: &ExportOptions,
    size: Option<f64>,
) -> Result<Part, PartError> {
    let design = case.design.as_ref().ok_or(PartError::NoDesign)?;
    let designed: Vec<usize> =
        (0..mesh.bodies.len()).filter(|&b| design.bodies.contains(&mesh.bodies[b].name)).collect();
    let faces = NamedFaces::new(mesh, &designed);
    let options = ExportOptions { bodies: design.bodies.clone(), keep_surfaces: true, ..options.clone() };
    let export = labelled_surface(mesh, density, &options, &faces.labels)?;
    let (mut bodies, mut whole) = (Vec::new(), Vec::new());
    for body in designed {
        let own = export.surface.restricted(|t| export.surface.bodies[t] as usize == body);
        if let Some(size) = size {
            refuse_too_fine(&own, &mesh.bodies[body].name, size)?;
        }
        if size.is_none() && !own.triangles.is_empty() && own.outer.iter().all(|&outer| outer) {
            whole.push(mesh.bodies[body].name.clone());
        } else {
            let solid: Vec<usize> =
                mesh.bodies[body].elements.clone().filter(|&e| density[e] >= export.threshold).collect();
            bodies.push(part_body(case, mesh, &faces, &own, (body, &solid), size)?);
        }
    }
    let carried = carry::carried(case, mesh, &faces, &bodies, &|e| density[e] >= export.threshold)?;
    Ok(Part {
        bodies,
        whole,
        case: carried.case,
        copies: carried.copies,
        reselected: carried.reselected,
        unused: carried.unused,
        scarce: carried.scarce,
        reduced: carried.reduced,
        per_node: carried.per_node,
        export,
    })
}

/// Most triangles of a surface that is remeshed with a given size.
const MOST_TRIANGLES: f64 = 2e6;

/// Refuses a size of edges for which a surface would need too many triangles.
fn refuse_too_fine(surface: &TriangleSurface, body: &str, size: f64) -> Result<(), PartError> {
    let area: f64 = (0..surface.triangles.len()).map(|t| 0.5 * norm(area(surface.corners(t)))).sum();
    // equilateral triangles
    let of = |size: f64| area / (0.25 * 3f64.sqrt() * size * size);
    if of(size) <= MOST_TRIANGLES {
        return Ok(());
    }
    let least = size * (of(size) / MOST_TRIANGLES).sqrt();
    Err(PartError::TooFine { body: body.to_owned(), triangles: of(size), least })
}

fn part_body(
    case: &Case,
    mesh: &Mesh,
    faces: &NamedFaces,
    surface: &TriangleSurface,
    (body, solid): (usize, &[usize]),
    size: Option<f64>,
) -> Result<PartBody, PartError> {
    let name = mesh.bodies[body].name.clone();
    if surface.triangles.is_empty() {
        return Err(PartError::Empty { body: name });
    }
    let Fate { kept, by_contact, left_out } = fate(case, faces, surface);
    let lengths = size.map_or_else(|| Lengths::of_elements(mesh, body), Lengths::Uniform);
    let (patched, list) = patches(&kept.surface);
    let mut around = vec![Vec::new(); kept.piece.iter().max().map_or(0, |&most| most as usize + 1)];
    for (&piece, &patch) in kept.piece.iter().zip(&patched.patch) {
        around[piece as usize].push(patch + 1);
    }
    for patches in &mut around {
        patches.sort_unstable();
        patches.dedup();
    }
    let (facets, smooth) = smooth_faces(case, mesh, body)?;
    let mut curved = Curved::new(mesh, facets, smooth);
    let nodes = curved.nodes();
    let outer = |patch: u32| list[patch as usize].outer;
    let cut = (0..list.len() as u32).filter(|&patch| !outer(patch)).map(|patch| patch + 1).collect();
    let fixed = |point| nodes.contains(&curved::bits(point));
    let mut fine =
        remeshed(&patched, &lengths, |patch| !outer(patch), fixed, |x, normal| curved.onto_facets(x, normal));
    let flat = fine.clone();
    let moves = curved.lift(&mut fine, |t| outer(flat.patch[t]));
    let shapes = (0..flat.triangles.len())
        .map(|t| outer(flat.patch[t]).then(|| curved.shape(flat.corners(t))).flatten())
        .collect();
    let mut found = named_faces((case, mesh), faces, &fine, &list, body);
    compare::compare(&mut found, (mesh, body, faces), &patched, &flat);
    Ok(PartBody {
        faces: found,
        crossings: fine.crossings(),
        moves,
        cut,
        name,
        size: lengths.mean(),
        edges: lengths.range(),
        tetrahedra: (fine.volume() * lengths.tetrahedra(mesh, solid)).round() as usize,
        volume: fine.volume(),
        loose: kept.loose,
        by_contact,
        left_out,
        pieces: around,
        surface: fine,
        shapes,
    })
}

/// Edge length of a surface for measuring, relative to the element size of its body.
const MEASURED: f64 = 0.5;

/// The surface of a design, for measuring, with regular triangles half as large as the elements of
/// its bodies. It lacks the slivers and folds of the extracted surface, which have no meaningful
/// size. Outer faces stay in place.
pub fn regular_surface(mesh: &Mesh, surface: &TriangleSurface) -> TriangleSurface {
    let mut all = TriangleSurface::default();
    for body in 0..mesh.bodies.len() {
        let own = surface.restricted(|t| surface.bodies[t] as usize == body);
        if own.triangles.is_empty() {
            continue;
        }
        let lengths = Lengths::of_elements(mesh, body);
        let (patched, list) = patches(&own);
        let facets = mesh.boundary(body).facets.iter().map(|facet| facet.nodes).collect();
        let mut faces = Curved::new(mesh, facets, SmoothSurface::default());
        let fine = remeshed(
            &patched,
            &Lengths::Uniform(MEASURED * lengths.mean()),
            |patch| !list[patch as usize].outer,
            |_| false,
            |x, normal| faces.onto_facets(x, normal),
        );
        let first = all.points.len() as u32;
        all.points.extend(fine.points);
        all.triangles.extend(fine.triangles.iter().map(|t| t.map(|n| first + n)));
        all.outer.extend(fine.patch.iter().map(|&patch| list[patch as usize].outer));
        all.labels.extend(fine.patch.iter().map(|&patch| list[patch as usize].label));
        all.bodies.extend(fine.patch.iter().map(|_| body as u32));
    }
    all
}

/// The surfaces and node sets of a body, and their patches.
fn named_faces(
    (case, mesh): (&Case, &Mesh),
    faces: &NamedFaces,
    surface: &PatchedSurface,
    list: &[Patch],
    body: usize,
) -> Vec<NamedFace> {
    let mut areas = vec![0.0; list.len()];
    for (t, &patch) in surface.patch.iter().enumerate() {
        areas[patch as usize] += 0.5 * norm(area(surface.corners(t)));
    }
    let mut found: Vec<NamedFace> = Vec::new();
    for (name, &whole) in &faces.areas {
        if !on_body(mesh, name, body) {
            continue;
        }
        let carries = |k: &usize| faces.of(list[*k].label).contains(name);
        let own: Vec<usize> = (0..list.len()).filter(carries).collect();
        found.push(NamedFace {
            name: name.clone(),
            group: None,
            area_change: 0.0,
            distance: 0.0,
            share: (own.iter().fold(0.0, |sum, &k| sum + areas[k]) / whole).min(1.0),
            patches: own.iter().map(|&k| k as u32 + 1).collect(),
        });
    }
    carry::name_groups(case, &mesh.bodies[body].name, &mut found);
    found
}

/// Whether a surface or a set has a node of a body.
fn on_body(mesh: &Mesh, name: &str, body: usize) -> bool {
    let nodes = mesh.set_nodes(name);
    nodes.is_some_and(|nodes| nodes.iter().any(|&n| mesh.bodies[body].nodes.contains(&(n as usize))))
}
