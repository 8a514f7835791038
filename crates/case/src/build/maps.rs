//! The map from design variables to densities.

use slipstick_design::{DensityFilter, DensityMap, DesignVariables, FilterError, Projection, Triangle};
use slipstick_linalg::Ranks;
use slipstick_mesh::Mesh;
use std::sync::Arc;

use super::BuildError;
use crate::case::{self, Case, Design, FilterBoundary};

/// Density filter and projection of a design, the latter as sharp as in the first iteration of an
/// optimization. All ranks call it.
pub(super) fn build_map(
    case: &Case,
    mesh: &Mesh,
    variables: Option<&DesignVariables>,
    mirrored: &[[bool; 3]],
    ranks: &Arc<dyn Ranks>,
) -> Result<Option<DensityMap>, BuildError> {
    let (Some(variables), Some(design)) = (variables, &case.design) else { return Ok(None) };
    let filter = design.density_filter.map(|filter| -> Result<DensityFilter, FilterError> {
        let centroids = mesh.centroids();
        let centroids: Vec<[f64; 3]> = variables.domain().iter().map(|&e| centroids[e as usize]).collect();
        let volumes = variables.on_domain(&mesh.element_volumes().into());
        let (radius, planes) = (filter.radius, planes(case));
        let found = DensityFilter::on_ranks(&centroids, &volumes, radius, &planes, ranks.clone())?;
        Ok(match filter.boundary {
            FilterBoundary::Truncated => found,
            FilterBoundary::Void => {
                found.in_void(&centroids, radius, &planes, &free_faces(case, design, mesh, mirrored))
            }
        })
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

/// The faces of the design bodies without contact, support, prescribed motion, load or symmetry
/// plane, as triangles.
fn free_faces(case: &Case, design: &Design, mesh: &Mesh, mirrored: &[[bool; 3]]) -> Vec<Triangle> {
    let contacts = case.contacts.iter().flat_map(|contact| [&contact.slave, &contact.master]);
    let names = contacts
        .chain(case.dirichlet.iter().map(|dirichlet| &dirichlet.set))
        .chain(case.loads.iter().map(|load| &load.surface));
    let mut held: Vec<Vec<bool>> =
        (0..3).map(|axis| mirrored.iter().map(|components| components[axis]).collect()).collect();
    for nodes in names.filter_map(|name| mesh.set_nodes(name)) {
        let mut inside = vec![false; mesh.nodes.len()];
        nodes.iter().for_each(|&node| inside[node as usize] = true);
        held.push(inside);
    }
    let bodies = (0..mesh.bodies.len()).filter(|&body| design.bodies.contains(&mesh.bodies[body].name));
    let mut triangles = Vec::new();
    for facet in bodies.flat_map(|body| mesh.boundary(body).facets) {
        let nodes: &[u32] = &facet.nodes;
        if held.iter().any(|inside| nodes.iter().all(|&node| inside[node as usize])) {
            continue;
        }
        let corner = |k: usize| mesh.nodes[nodes[k] as usize];
        triangles.extend((2..nodes.len()).map(|k| [corner(0), corner(k - 1), corner(k)]));
    }
    triangles
}

/// Symmetry planes for a filter: axis and coordinate.
pub(super) fn planes(case: &Case) -> Vec<(usize, f64)> {
    case.symmetries.iter().map(|symmetry| (symmetry.normal.index(), symmetry.at)).collect()
}
