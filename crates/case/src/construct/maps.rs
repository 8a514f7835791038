//! The map from design variables to densities.

use slipstick_design::{DensityFilter, DensityMap, DesignVariables, FilterError, PrintedBox, Projection, Triangle};
use slipstick_linalg::Ranks;
use slipstick_mesh::Mesh;
use std::sync::Arc;

use super::BuildError;
use super::select::default_tolerance;
use crate::file::{self, Case, Design, FilterBoundary, Overhang, Shape};

/// The map of a design, with the filter radius and sharpness of the first iteration of an
/// optimization. All ranks call it.
pub(super) fn build_map(
    case: &Case,
    mesh: &Mesh,
    variables: Option<&DesignVariables>,
    mirrored: &[[bool; 3]],
    ranks: &Arc<dyn Ranks>,
) -> Result<Option<DensityMap>, BuildError> {
    let (Some(variables), Some(design)) = (variables, &case.design) else { return Ok(None) };
    let schedule = case.optimizer.as_ref().map(|optimizer| &optimizer.schedule);
    let filter = design.density_filter.map(|filter| -> Result<DensityFilter, FilterError> {
        let centroids = mesh.centroids();
        let centroids: Vec<[f64; 3]> = variables.domain().iter().map(|&e| centroids[e as usize]).collect();
        let volumes = variables.on_domain(&mesh.element_volumes().into());
        let radius = schedule.and_then(|schedule| schedule.filter_radius.at(0)).unwrap_or(filter.radius);
        let found = DensityFilter::on_ranks(&centroids, &volumes, radius, &planes(case), ranks.clone())?;
        Ok(match filter.boundary {
            FilterBoundary::Truncated => found,
            FilterBoundary::Void => found.in_void(free_faces(case, design, mesh, mirrored)),
        })
    });
    let error = |path: &str, error| BuildError::new(path, error, "change the value");
    let filter = filter.transpose().map_err(|e| error("design.density_filter.radius", e))?;
    let projection = design.projection.map(|file::Projection { sharpness, threshold }| {
        let first = schedule.and_then(|schedule| schedule.sharpness.at(0));
        Projection::new(first.unwrap_or(sharpness), threshold)
    });
    let projection = projection.transpose().map_err(|e| error("design.projection", e))?;
    // the list of maps, in their order
    let mut map = DensityMap::new(variables.clone());
    if let Some(filter) = filter {
        map = map.filtered(filter);
    }
    if let Some(projection) = projection {
        map = map.projected(projection);
    }
    if let Some(overhang) = design.overhang {
        map = map.printed(&printed_boxes(case, design, overhang, mesh)?);
    }
    Ok(Some(map))
}

/// The design bodies as boxes that are printed in layers.
fn printed_boxes(case: &Case, design: &Design, overhang: Overhang, mesh: &Mesh) -> Result<Vec<PrintedBox>, BuildError> {
    let (axis, downwards) = (overhang.direction.axis(), overhang.direction.is_downwards());
    if let Some(plane) = case.symmetries.iter().find(|plane| plane.normal.index() == axis) {
        let letter = ["x", "y", "z"][axis];
        let message = format!("the layers would be parallel to the symmetry plane {letter} = {}", plane.at);
        let help = "choose a direction within the symmetry plane, or mesh the whole body";
        return Err(BuildError::new("design.overhang.direction", message, help));
    }
    let tolerance = default_tolerance(mesh);
    let bodies = case.bodies.iter().zip(&mesh.bodies).filter(|(body, _)| design.bodies.contains(&body.name));
    let printed = bodies.map(|(body, in_mesh)| {
        let refuse = |why: String| {
            let message = format!("the overhang filter does not apply to body `{}`: {why}", body.name);
            let help = "it needs bodies of the shape `box` without rotation, whose elements form layers; design only \
                        such bodies, or omit `overhang`";
            Err(BuildError::new("design.overhang", message, help))
        };
        let Shape::Box { min, max, elements: cells, .. } = body.shape else {
            return refuse(format!("its shape is `{}`", body.shape.key()));
        };
        if body.place.rotate.is_some() {
            return refuse("it is rotated".into());
        }
        let in_plane = |axis: usize, side: f64| {
            let at = side + body.place.translate[axis];
            let mut planes = case.symmetries.iter().filter(|plane| plane.normal.index() == axis);
            planes.any(|plane| (plane.at - at).abs() <= tolerance)
        };
        let mirrored = std::array::from_fn(|axis| [min[axis], max[axis]].map(|side| in_plane(axis, side)));
        Ok(PrintedBox { first: in_mesh.elements.start as u32, cells, axis, downwards, mirrored })
    });
    printed.collect()
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
