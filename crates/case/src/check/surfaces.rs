//! The surfaces of a case, in figures.

use serde::Serialize;
use slipstick_mesh::{Mesh, facet_area_vector};

/// A surface in its reference configuration.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SurfaceSummary {
    /// Name.
    pub name: String,
    /// The bodies whose facets it consists of.
    pub bodies: Vec<String>,
    /// Facets.
    pub facets: usize,
    /// Nodes.
    pub nodes: usize,
    /// Area. \[L²\]
    pub area: f64,
    /// Direction of the mean outward normal; `None` for closed and nearly closed surfaces.
    pub normal: Option<[f64; 3]>,
}

/// Mean normals shorter than this have no meaningful direction.
const CLOSED: f64 = 0.05;

/// All surfaces of a mesh, by name.
pub(super) fn surfaces(mesh: &Mesh) -> Vec<SurfaceSummary> {
    let summary = |(name, surface): (&String, &slipstick_mesh::Surface)| {
        let mut mean = nalgebra::Vector3::zeros();
        let mut bodies: Vec<usize> = Vec::new();
        for facet in &surface.facets {
            mean += nalgebra::Vector3::from(facet_area_vector(&mesh.facet_coordinates(facet)));
            bodies.extend(mesh.body_of_element(facet.element as usize));
            bodies.dedup();
        }
        bodies.sort_unstable();
        bodies.dedup();
        let area = mesh.surface_area(surface);
        SurfaceSummary {
            name: name.clone(),
            bodies: bodies.into_iter().map(|body| mesh.bodies[body].name.clone()).collect(),
            facets: surface.facets.len(),
            nodes: surface.nodes().len(),
            area,
            normal: mean.try_normalize(CLOSED * area).map(Into::into),
        }
    };
    mesh.surfaces.iter().map(summary).collect()
}
