//! Whether a design is still grey.

use slipstick_case::file::Case;
use slipstick_mesh::Mesh;

/// Density up to which elements are left out.
pub(super) const THRESHOLD: f64 = 0.5;

/// Designed elements from which a grey design takes minutes to give a surface.
const MANY: usize = 20_000;

/// Whether a design has a surface that can be found in seconds: some density above the threshold and, among many
/// elements, densities that are mostly near 0 or 1.
pub(super) fn has_surface(case: &Case, mesh: &Mesh, density: &[f64]) -> bool {
    let Some(design) = &case.design else { return false };
    let bodies = mesh.bodies.iter().filter(|body| design.bodies.contains(&body.name));
    let designed: Vec<f64> = bodies.flat_map(|body| &density[body.elements.clone()]).copied().collect();
    let grey = designed.iter().map(|phi| 4.0 * phi * (1.0 - phi)).sum::<f64>();
    !is_grey(case, mesh, density) && (designed.len() < MANY || grey < 0.5 * designed.len() as f64)
}

/// Whether no designed element has a density above the threshold, as at the start of many optimizations.
pub(super) fn is_grey(case: &Case, mesh: &Mesh, density: &[f64]) -> bool {
    case.design.as_ref().is_some_and(|design| {
        let mut designed = mesh.bodies.iter().filter(|body| design.bodies.contains(&body.name));
        designed.all(|body| density[body.elements.clone()].iter().all(|&density| density <= THRESHOLD))
    })
}
