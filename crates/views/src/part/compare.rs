//! Compares the named faces of a part with those of the design.

use std::collections::BTreeMap;

use slipstick_mesh::Mesh;

use super::NamedFace;
use super::patches::NamedFaces;
use super::remesh::PatchedSurface;
use crate::closest::ClosestPoint;
use crate::vector::{area, norm, subtract};

/// Sets the differences of areas and the distances of faces, on facets: the part has the patches of
/// the design's surface.
///
/// The distance is that of corners, edges and triangles of the part from the face of the design domain,
/// be it solid there or not: the rim of the material is rounded within the face, which the area shows.
pub(super) fn compare(
    found: &mut [NamedFace],
    (mesh, body, faces): (&Mesh, usize, &NamedFaces),
    design: &PatchedSurface,
    part: &PatchedSurface,
) {
    let mut domain: BTreeMap<&str, Vec<[[f64; 3]; 3]>> = BTreeMap::new();
    for facet in mesh.boundary(body).facets {
        let corners: Vec<[f64; 3]> = facet.nodes.iter().map(|&n| mesh.nodes[n as usize]).collect();
        let centre = std::array::from_fn(|c| corners.iter().map(|p| p[c]).sum::<f64>() / corners.len() as f64);
        for name in faces.labels.get(&facet.nodes.sorted()).map_or(&[][..], |&label| faces.of(label)) {
            let of_face = domain.entry(name).or_default();
            let next = |k: usize| corners[(k + 1) % corners.len()];
            of_face.extend((0..corners.len()).map(|k| [centre, corners[k], next(k)]));
        }
    }
    for face in found.iter_mut().filter(|face| !face.patches.is_empty()) {
        let [before, after] = [design, part].map(|surface| {
            let own = (0..surface.triangles.len()).filter(|&t| face.patches.contains(&(surface.patch[t] + 1)));
            own.map(|t| surface.corners(t)).collect::<Vec<_>>()
        });
        let sum = |all: &[[[f64; 3]; 3]]| all.iter().map(|&corners| norm(area(corners))).sum::<f64>();
        face.area_change = sum(&after) / sum(&before) - 1.0;
        let domain = domain.remove(face.name.as_str()).unwrap_or_default();
        let domain = ClosestPoint::of_triangles(domain.into_iter());
        let off = |x: [f64; 3]| domain.nearest(x, f64::INFINITY).map_or(0.0, |at| norm(subtract(at, x)));
        face.distance = after.iter().flat_map(samples).map(off).fold(0.0, f64::max);
    }
}

/// Corners, middles of the edges, and centroid of a triangle.
fn samples(&[a, b, c]: &[[f64; 3]; 3]) -> [[f64; 3]; 7] {
    let mean = |of: &[[f64; 3]]| std::array::from_fn(|k| of.iter().map(|p| p[k]).sum::<f64>() / of.len() as f64);
    [a, b, c, mean(&[a, b]), mean(&[b, c]), mean(&[c, a]), mean(&[a, b, c])]
}
