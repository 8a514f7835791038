//! The loads of a case.

use super::{BuildError, sections, surface_of};
use crate::file::{self, Case};
use slipstick_mesh::Mesh;
use slipstick_model::model::{Loaded, Loads};
use slipstick_solid::Formulation;

pub(super) fn build_loads(case: &Case, mesh: &Mesh, load_cases: &[&str]) -> Result<Loads, BuildError> {
    let target = |(i, load): (usize, &file::Load)| {
        if load.acts_on_mass() {
            let body = load.body.as_ref().and_then(|name| mesh.bodies.iter().find(|body| body.name == *name));
            return Ok(Loaded::Mass(body.map_or(0..mesh.elements.len(), |body| body.elements.clone())));
        }
        if let Some(reference) = mesh.reference_of(&load.surface) {
            return Ok(Loaded::Body(reference));
        }
        let path = format!("load[{i}].surface");
        if let (file::LoadKind::NodalForce(_), Some(nodes)) = (load.kind, mesh.set_nodes(&load.surface)) {
            return Ok(Loaded::Nodes(nodes.into_owned()));
        }
        let surface = surface_of(mesh, &load.surface, &path)?;
        Ok(Loaded::Facets(mesh.faces_of_surface(surface)))
    };
    let targets: Result<Vec<Loaded>, BuildError> = case.loads.iter().enumerate().map(target).collect();
    let reduced = case.bodies.iter().any(|body| body.element == Formulation::Reduced);
    let formulations = if reduced { sections(case, mesh)?.formulations(mesh) } else { Vec::new() };
    Ok(Loads::new(case.loads.clone(), targets?, mesh, &formulations, load_cases))
}
