//! What the facets of a contact pair stand for.

use crate::construct::surfaces::smooth;
use crate::file::{Case, Contact, Surfaces};
use serde::Serialize;
use slipstick_contact::ContactInterface;
use slipstick_mesh::{ContactMap, FacetNodes, Mesh, Shape, SmoothSurface};

/// The kind of surface for which facets stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SurfaceKind {
    /// A sphere.
    Sphere,
    /// A cylinder.
    Cylinder,
    /// A cone.
    Cone,
    /// A torus.
    Torus,
    /// A surface that is interpolated from averaged normals.
    AveragedNormals,
    /// The facets themselves, which bend nowhere.
    Flat,
    /// The facets themselves, as the case requests.
    Faceted,
}

/// The part of one side of a contact pair that stands for surfaces of one kind and size.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SurfacePart {
    /// The kind of surface.
    pub kind: SurfaceKind,
    /// In words, with its radii.
    pub name: String,
    /// Number of its facets.
    pub facets: usize,
    /// The largest distance of the surface from a facet: for linear elements, the sagitta. \[L\]
    pub height: f64,
}

/// The parts of slave and master of a pair; none of tied surfaces, which are joined facet by facet.
pub(super) fn parts(
    case: &Case,
    contact: &Contact,
    interface: &ContactInterface,
    mesh: &Mesh,
    mirrored: &[[bool; 3]],
) -> [Vec<SurfacePart>; 2] {
    if contact.tied {
        return [Vec::new(), Vec::new()];
    }
    let points = ContactMap::new(mesh).points(&mesh.nodes);
    [interface.slave_facets(), interface.master_facets()].map(|facets| match contact.surfaces {
        Surfaces::Faceted => vec![rest(SurfaceKind::Faceted, facets.len())],
        Surfaces::Smooth => of_side(facets, smooth(case, contact, mesh, &points, facets, mirrored)),
    })
}

fn rest(kind: SurfaceKind, facets: usize) -> SurfacePart {
    let name = if kind == SurfaceKind::Flat { "flat" } else { "facets" };
    SurfacePart { kind, name: name.into(), facets, height: 0.0 }
}

/// Parts of the same name count as one; what remains is flat.
fn of_side(facets: &[FacetNodes], smooth: Option<SmoothSurface>) -> Vec<SurfacePart> {
    let mut parts: Vec<SurfacePart> = Vec::new();
    for patch in smooth.into_iter().flat_map(|smooth| smooth.patches) {
        let name = patch.shape.map_or("averaged normals".into(), |shape| shape.to_string());
        match parts.iter_mut().find(|part| part.name == name) {
            Some(part) => {
                part.facets += patch.facets.len();
                part.height = part.height.max(patch.sagitta);
            }
            None => {
                let (kind, facets, height) = (kind(patch.shape), patch.facets.len(), patch.sagitta);
                parts.push(SurfacePart { kind, name, facets, height });
            }
        }
    }
    let curved: usize = parts.iter().map(|part| part.facets).sum();
    if curved < facets.len() {
        parts.push(rest(SurfaceKind::Flat, facets.len() - curved));
    }
    parts
}

fn kind(shape: Option<Shape>) -> SurfaceKind {
    match shape {
        Some(Shape::Sphere { .. }) => SurfaceKind::Sphere,
        Some(shape @ Shape::Cone { .. }) if shape.is_cylinder() => SurfaceKind::Cylinder,
        Some(Shape::Cone { .. }) => SurfaceKind::Cone,
        Some(Shape::Torus { .. }) => SurfaceKind::Torus,
        None => SurfaceKind::AveragedNormals,
    }
}
