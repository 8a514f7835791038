//! The block of elements with memory, from a mesh.

use super::Inelastic;
use super::points::PointElement;
use crate::block::{Build, ElementBlock};
use crate::clusters::Clusters;
use crate::hex8::ReferenceGeometry;
use crate::law::HISTORY;
use crate::quadratic::reference_points;
use crate::section::{Formulation, Section};
use crate::tet4::Batch;
use slipstick_mesh::{Element, Mesh};
use std::sync::Arc;

/// Number of integration points of an element.
pub(crate) fn integration_points(element: &Element, formulation: Formulation) -> usize {
    match element {
        Element::Tet4(_) => 1,
        Element::Wedge6(_) | Element::Hex8(_) | Element::Tet10(_) => 8,
        Element::Wedge18(_) => 9,
        Element::Hex27(_) if formulation == Formulation::Reduced => 8,
        Element::Hex27(_) => 27,
    }
}

/// Length of the history of a mesh: all elements whose section has memory, on all ranks.
pub(crate) fn history(mesh: &Mesh, sections: &[Section], section_of: &[u32]) -> usize {
    HISTORY * first_points(mesh, sections, section_of).1
}

/// The first point of each element among those of all elements with memory, and the number of points.
fn first_points(mesh: &Mesh, sections: &[Section], section_of: &[u32]) -> (Vec<usize>, usize) {
    let section = |e: usize| &sections[section_of[e] as usize];
    let mut points = 0;
    let of = |(e, element): (usize, &Element)| {
        let first = points;
        if section(e).material.kind().has_memory() {
            points += integration_points(element, section(e).formulation);
        }
        first
    };
    let firsts = mesh.elements.iter().enumerate().map(of).collect();
    (firsts, points)
}

/// The elements with these numbers. Histories are numbered through all elements of the mesh whose
/// section has memory.
pub(crate) fn block(build: Build<'_>) -> Option<Arc<dyn ElementBlock>> {
    let Build { mesh, numbers, sections, section_of, flat } = build;
    if numbers.is_empty() {
        return None;
    }
    let (firsts, _) = first_points(mesh, sections, section_of);
    let clusters = Clusters::new(mesh, numbers);
    let mut elements: Vec<PointElement> = Vec::with_capacity(clusters.order.len());
    let mut pairs = vec![0];
    for &number in &clusters.order {
        let (e, section) = (number as usize, section_of[number as usize]);
        let Some((nodes, gradients, weights, average)) =
            reference(mesh, number, sections[section as usize].formulation)
        else {
            flat.push(number);
            continue;
        };
        pairs.push(pairs[elements.len()] + nodes.len() * nodes.len());
        elements.push(PointElement {
            nodes,
            number,
            section,
            first: firsts[e],
            gradients,
            weights,
            average: (sections[section as usize].formulation == Formulation::FBar).then_some(average),
        });
    }
    Some(Arc::new(Inelastic { elements, clusters, pairs }))
}

/// Nodes, gradients of the shape functions, weights and averages of an element.
pub(crate) type Reference = (Vec<u32>, Vec<Vec<[f64; 3]>>, Vec<f64>, Vec<Vec<f64>>);

/// `None` if the Jacobian is not positive at a point.
fn reference(mesh: &Mesh, number: u32, formulation: Formulation) -> Option<Reference> {
    let element = &mesh.elements[number as usize];
    if let Some(nodes) = element.as_hex() {
        let geometry = ReferenceGeometry::new(&mesh.coordinates(&nodes))?;
        let gradients = (0..8).map(|q| geometry.shape_gradients(q).to_vec()).collect();
        let weights: Vec<f64> = (0..8).map(|q| geometry.weight(q)).collect();
        let average = constant(&weights);
        return Some((nodes.to_vec(), gradients, weights, average));
    }
    if let Element::Tet4(nodes) = element {
        let batch = Batch::new(mesh, &[(number, *nodes)], 0).ok()?;
        let weights = vec![batch.volumes[0]];
        let average = constant(&weights);
        return Some((nodes.to_vec(), vec![batch.shape_gradients(0).to_vec()], weights, average));
    }
    reference_points(mesh, number, formulation)
}

/// A projects onto constants.
fn constant(weights: &[f64]) -> Vec<Vec<f64>> {
    let volume: f64 = weights.iter().sum();
    let row: Vec<f64> = weights.iter().map(|w| w / volume).collect();
    vec![row; weights.len()]
}
