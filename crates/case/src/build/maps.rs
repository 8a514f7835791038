//! The map from design variables to densities.

use slipstick_design::{DensityFilter, DensityMap, DesignVariables, Projection};
use slipstick_linalg::Ranks;
use slipstick_mesh::Mesh;
use std::sync::Arc;

use super::BuildError;
use crate::case::{self, Case};

/// Density filter and projection of a design, the latter as sharp as in the first iteration of an
/// optimization. All ranks call it.
pub(super) fn build_map(
    case: &Case,
    mesh: &Mesh,
    variables: Option<&DesignVariables>,
    ranks: &Arc<dyn Ranks>,
) -> Result<Option<DensityMap>, BuildError> {
    let (Some(variables), Some(design)) = (variables, &case.design) else { return Ok(None) };
    let filter = design.density_filter.map(|filter| {
        let centroids = mesh.centroids();
        let centroids: Vec<[f64; 3]> = variables.domain().iter().map(|&e| centroids[e as usize]).collect();
        let volumes = variables.on_domain(&mesh.element_volumes().into());
        DensityFilter::on_ranks(&centroids, &volumes, filter.radius, &planes(case), ranks.clone())
    });
    let error = |path: &str, error| BuildError::new(path, error, "change the value");
    let filter = filter.transpose().map_err(|e| error("design.density_filter.radius", e))?;
    let projection = design.projection.map(|case::Projection { sharpness, threshold }| {
        let first = case.optimizer.as_ref().and_then(|optimizer| optimizer.schedule.sharpness.at(0));
        Projection::new(first.unwrap_or(sharpness), threshold)
    });
    let projection = projection.transpose().map_err(|e| error("design.projection", e))?;
    Ok(Some(DensityMap::new(variables.clone(), filter, projection)))
}

/// Symmetry planes for a filter: axis and coordinate.
pub(super) fn planes(case: &Case) -> Vec<(usize, f64)> {
    case.symmetries.iter().map(|symmetry| (symmetry.normal.index(), symmetry.at)).collect()
}
