//! Designs as closed triangle surfaces, for CAD, meshing and printing.
//!
//! ```text
//! densities ──means──▶ values on tetrahedra ──threshold──▶ closed surface ──Taubin──▶ TriangleSurface ──▶ STL, 3MF, OBJ, VTU
//! ```
//!
//! Each element but a linear tetrahedron is divided into tetrahedra between its centre, the centres of
//! its quadrilateral faces and its corners, 24 for a hexahedron, so that neighbours conform; if two
//! triangles cover a quadrilateral, it is divided along them. The density is linear on each
//! tetrahedron: the element's own value at the centre of a hexahedron or a wedge, and means of the
//! surrounding elements elsewhere. The surface bounds the part of the bodies where this function
//! exceeds the threshold: it crosses the tetrahedra inside a body and follows the body's outer faces
//! where these are solid.
//!
//! **Why it is closed.** The tetrahedra of a body are a conforming triangulation of it. Points are
//! either above the threshold or not, and each edge between the two kinds has one point of the
//! surface in its interior, so the part above is itself a solid, and its boundary is a closed
//! surface: every edge belongs to exactly two triangles, which traverse it in opposite directions.
//! This holds for any densities; smoothing moves points and keeps the triangles.
//!
//! **Why thin walls have no holes.** Means at both sides of a wall that is one element thick may be below
//! the threshold; nodes there count as solid if all elements between them are (`thin`).
//!
//! **Why it does not cross itself.** The extracted triangles lie in different tetrahedra, so they only
//! meet at common edges and corners. Smoothing moves the points of triangles that would cross others
//! back; exact predicates decide. Pieces and cavities smaller than a twentieth of an element are left
//! out.
//! Test: `any_densities_give_closed_surfaces`.
//!
//! ```
//! use slipstick_views::export::{ExportOptions, design_surface};
//! use slipstick_mesh::{BoxShape, box_mesh};
//! let shape = BoxShape { min: [0.0; 3], max: [4.0, 1.0, 1.0], elements: [4, 1, 1], grading: [1.0; 3] };
//! let mesh = box_mesh("bar", &shape)?;
//! let export = design_surface(&mesh, &[1.0, 1.0, 0.0, 0.0], &ExportOptions::default())?;
//! assert!((export.surface.volume() / 2.0 - 1.0).abs() < 0.05, "half of the bar; with so few elements the volume
//! jumps"); assert_eq!(export.surface.open_edges(), 0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod extract;
mod files;
mod lattice;
mod measure;
mod restore;
mod smooth;
mod surface;
#[cfg(test)]
mod tests;
mod thin;
mod threemf;
mod walls;

pub use error::ExportError;
pub use files::{write_obj, write_stl, write_vtu};
pub use measure::{Distance, Measures, MirrorPlane, measure};
pub use surface::TriangleSurface;
pub use threemf::{unit_of_3mf, unit_of_length, write_3mf};

use slipstick_mesh::Mesh;

use extract::{NEAREST, extract};
pub use lattice::FaceLabels;

use lattice::Lattice;
use smooth::{Rules, smoothed};
use walls::Walls;

/// Options of the export of a design.
#[derive(Debug, Clone, PartialEq)]
pub struct ExportOptions {
    /// Density above which there is material, 0 … 1; `None`: the value that preserves the volume of
    /// the densities.
    pub threshold: Option<f64>,
    /// Number of passes of Taubin's smoothing; 0 leaves the extracted surface unchanged.
    pub smoothing: usize,
    /// Whether to keep the outer faces of the bodies, including their edges, in place.
    pub keep_surfaces: bool,
    /// Names of the bodies; empty: those with a density below 1 somewhere, or all if there is none.
    pub bodies: Vec<String>,
}

impl Default for ExportOptions {
    fn default() -> Self {
        Self { threshold: None, smoothing: 10, keep_surfaces: true, bodies: Vec::new() }
    }
}

/// A design as a closed surface, with related numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Export {
    /// The surface.
    pub surface: TriangleSurface,
    /// Density above which there is material.
    pub threshold: f64,
    /// Volume of the densities, Σ φ V over the elements of the bodies. \[L³\]
    pub density_volume: f64,
}

/// Target for the relative difference of volumes in the search for a threshold.
const VOLUME_TOLERANCE: f64 = 1e-3;

/// Volume below which a piece or a cavity is left out, relative to the mean element of the bodies.
const CRUMB: f64 = 0.05;

/// Relative difference of volumes above which a threshold does not represent the densities.
const VOLUME_LIMIT: f64 = 0.05;

/// The surface of a design; `density` has one value in \[0, 1\] per element of the mesh.
///
/// If the threshold is chosen automatically, the volume of the surface agrees with that of the
/// densities to 0.1 % where possible (with few different densities, the volume jumps) and always to
/// 5 %.
///
/// # Errors
/// [`ExportError`]: densities that do not match the mesh or are invalid, unknown bodies, a
/// threshold that no density exceeds, or no suitable threshold.
pub fn design_surface(mesh: &Mesh, density: &[f64], options: &ExportOptions) -> Result<Export, ExportError> {
    labelled_surface(mesh, density, options, &FaceLabels::default())
}

/// The same surface with labels on its outer triangles; smoothing keeps the borders between
/// different labels in place, also those within a plane.
///
/// # Errors
/// As [`design_surface`].
pub fn labelled_surface(
    mesh: &Mesh,
    density: &[f64],
    options: &ExportOptions,
    labels: &FaceLabels,
) -> Result<Export, ExportError> {
    check(mesh, density, options)?;
    let bodies = bodies(mesh, density, options)?;
    let density_volume: f64 =
        bodies.iter().flat_map(|&b| mesh.bodies[b].elements.clone()).map(|e| density[e] * mesh.element_volume(e)).sum();
    let lattice = Lattice::new(mesh, &bodies, density, labels);
    let rules = Rules { passes: options.smoothing, keep_outer: options.keep_surfaces };
    let crumb = CRUMB * lattice.mean_volume();
    let mut walls = Walls::new(mesh, &bodies);
    let mut at = |threshold: f64| {
        smoothed(extract(&lattice, threshold, NEAREST).without_shells_below(crumb), &rules, &mut walls)
    };
    if let Some(threshold) = options.threshold {
        let surface = at(threshold);
        if surface.triangles.is_empty() {
            return Err(ExportError::Empty { threshold, largest: lattice.largest() });
        }
        return Ok(Export { surface, threshold, density_volume });
    }
    // Smoothing changes the volume slightly: shift the target to compensate.
    let mut aim = density_volume;
    let mut best: Option<(f64, Export)> = None;
    for _ in 0..8 {
        let threshold = lattice.threshold_of_volume(aim);
        let surface = at(threshold);
        let missing = density_volume - surface.volume();
        let error = missing.abs() / density_volume;

        if best.as_ref().is_none_or(|(least, _)| error < *least) && !surface.triangles.is_empty() {
            best = Some((error, Export { surface, threshold, density_volume }));
        }
        if error < VOLUME_TOLERANCE {
            break;
        }
        aim += missing;
    }
    match best {
        Some((error, export)) if error < VOLUME_LIMIT => Ok(export),
        _ => Err(ExportError::NoThreshold { near: lattice.threshold_of_volume(density_volume) }),
    }
}

fn check(mesh: &Mesh, density: &[f64], options: &ExportOptions) -> Result<(), ExportError> {
    let (found, elements) = (density.len(), mesh.elements.len());
    if found != elements {
        return Err(ExportError::Length { found, elements });
    }
    if let Some(element) = density.iter().position(|value| !(0.0..=1.0).contains(value)) {
        return Err(ExportError::Density { element, value: density[element] });
    }
    match options.threshold.filter(|threshold| !(0.0..=1.0).contains(threshold)) {
        Some(value) => Err(ExportError::Threshold { value }),
        None => Ok(()),
    }
}

/// Numbers of the exported bodies.
fn bodies(mesh: &Mesh, density: &[f64], options: &ExportOptions) -> Result<Vec<usize>, ExportError> {
    let all = 0..mesh.bodies.len();
    if !options.bodies.is_empty() {
        let number = |name: &String| {
            let found = mesh.bodies.iter().position(|body| body.name == *name);
            found.ok_or_else(|| ExportError::UnknownBody {
                name: name.clone(),
                known: mesh.bodies.iter().map(|body| body.name.as_str()).collect::<Vec<_>>().join(", "),
            })
        };
        let mut numbers = options.bodies.iter().map(number).collect::<Result<Vec<_>, _>>()?;
        numbers.sort_unstable();
        numbers.dedup();
        return Ok(numbers);
    }
    let designed = |&b: &usize| density[mesh.bodies[b].elements.clone()].iter().any(|value| *value < 1.0);
    let some: Vec<usize> = all.clone().filter(designed).collect();
    Ok(if some.is_empty() { all.collect() } else { some })
}
