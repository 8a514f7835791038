//! The names on the faces of a body, and the connected patches that they form on the surface of a
//! design.

use std::collections::{BTreeMap, BTreeSet};

use slipstick_mesh::{FacetNodes, Mesh, facet_area};

use super::remesh::PatchedSurface;
use crate::export::{FaceLabels, TriangleSurface};
use crate::vector::{dot, unit_normal};

/// Cosine of the angle between adjacent outer faces above which their edge is sharp (30°).
const SHARP: f64 = 0.866;

/// The surfaces and node sets on the outer faces of some bodies.
#[derive(Debug, Default)]
pub(super) struct NamedFaces {
    /// The label of each face, which stands for the names on it.
    pub labels: FaceLabels,
    /// Entry k lists the names of label k + 1, ascending; faces without a name also have a label.
    pub names: Vec<Vec<String>>,
    /// Area of each name's faces. \[L²\]
    pub areas: BTreeMap<String, f64>,
    /// Node sets that consist of whole faces of one of the bodies, with the body's number.
    pub whole: BTreeMap<String, usize>,
}

impl NamedFaces {
    /// The names on the faces of the bodies with these numbers. A node set names every face whose
    /// nodes it contains completely.
    pub fn new(mesh: &Mesh, bodies: &[usize]) -> Self {
        let sets: Vec<(&String, BTreeSet<u32>)> =
            mesh.node_sets.iter().map(|(name, nodes)| (name, nodes.iter().copied().collect())).collect();
        let mut found = Self::default();
        let mut numbers: BTreeMap<Vec<String>, u32> = BTreeMap::new();
        for &body in bodies {
            let boundary = mesh.boundary(body).facets;
            let mut names: BTreeMap<FacetNodes, Vec<String>> =
                boundary.iter().map(|facet| (facet.nodes.sorted(), Vec::new())).collect();
            for (name, surface) in &mesh.surfaces {
                for facet in &surface.facets {
                    if let Some(of_face) = names.get_mut(&facet.nodes.sorted()) {
                        of_face.push(name.clone());
                    }
                }
            }
            for (name, nodes) in &sets {
                let mut covered = BTreeSet::new();
                for (face, of_face) in &mut names {
                    if face.iter().all(|node| nodes.contains(node)) {
                        covered.extend(face.iter().copied());
                        of_face.push((*name).clone());
                    }
                }
                if covered == *nodes {
                    found.whole.insert((*name).clone(), body);
                }
            }
            for facet in boundary {
                let face = facet.nodes.sorted();
                let mut of_face = names.remove(&face).unwrap_or_default();
                of_face.sort();
                of_face.dedup();
                let size = facet_area(&mesh.facet_coordinates(&facet));
                of_face.iter().for_each(|name| *found.areas.entry(name.clone()).or_default() += size);
                let next = numbers.len() as u32 + 1;
                let number = *numbers.entry(of_face).or_insert(next);
                found.labels.insert(face, number);
            }
        }
        found.names = vec![Vec::new(); numbers.len()];
        for (names, number) in numbers {
            found.names[number as usize - 1] = names;
        }
        found
    }

    /// The names of a label.
    pub fn of(&self, label: u32) -> &[String] {
        label.checked_sub(1).and_then(|k| self.names.get(k as usize)).map_or(&[], Vec::as_slice)
    }
}

/// A connected part of a surface that has the same names everywhere and, on outer faces, no sharp
/// edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Patch {
    /// Its label; 0 inside the body.
    pub label: u32,
    /// Whether it lies on outer faces of the body.
    pub outer: bool,
}

/// Divides a closed surface into patches; their numbers are indices into the list.
pub(super) fn patches(surface: &TriangleSurface) -> (PatchedSurface, Vec<Patch>) {
    let neighbours = neighbours(surface);
    let normals: Vec<[f64; 3]> = (0..surface.triangles.len()).map(|t| unit_normal(surface.corners(t))).collect();
    let continues = |s: usize, t: usize| {
        surface.outer[s] == surface.outer[t]
            && surface.labels[s] == surface.labels[t]
            && (!surface.outer[s] || dot(normals[s], normals[t]) > SHARP)
    };
    let (patch, count) = components(&neighbours, continues);
    let mut list = vec![Patch { label: 0, outer: false }; count];
    for (t, &number) in patch.iter().enumerate() {
        list[number as usize] = Patch { label: surface.labels[t], outer: surface.outer[t] };
    }
    let surface = PatchedSurface { points: surface.points.clone(), triangles: surface.triangles.clone(), patch };
    (surface, list)
}

/// The number of the closed shell to which each triangle belongs, and the number of shells.
pub(super) fn shells(surface: &TriangleSurface) -> (Vec<u32>, usize) {
    components(&neighbours(surface), |_, _| true)
}

/// The three triangles that share an edge with each triangle of a closed surface.
fn neighbours(surface: &TriangleSurface) -> Vec<[u32; 3]> {
    let mut edges: Vec<([u32; 2], u32, usize)> = Vec::with_capacity(3 * surface.triangles.len());
    for (number, t) in (0..).zip(&surface.triangles) {
        edges.extend((0..3).map(|k| {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            ([a.min(b), a.max(b)], number, k)
        }));
    }
    edges.sort_unstable();
    let mut neighbours = vec![[0; 3]; surface.triangles.len()];
    for pair in edges.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, s, k), (_, t, l)] = *pair {
            neighbours[s as usize][k] = t;
            neighbours[t as usize][l] = s;
        }
    }
    neighbours
}

/// Numbers the sets of triangles that are connected through edges across which the surface
/// `continues`.
fn components(neighbours: &[[u32; 3]], continues: impl Fn(usize, usize) -> bool) -> (Vec<u32>, usize) {
    let mut found = vec![u32::MAX; neighbours.len()];
    let mut count = 0;
    for start in 0..neighbours.len() {
        if found[start] != u32::MAX {
            continue;
        }
        found[start] = count;
        let mut open = vec![start];
        while let Some(s) = open.pop() {
            for t in neighbours[s].map(|t| t as usize) {
                if found[t] == u32::MAX && continues(s, t) {
                    found[t] = count;
                    open.push(t);
                }
            }
        }
        count += 1;
    }
    (found, count as usize)
}
