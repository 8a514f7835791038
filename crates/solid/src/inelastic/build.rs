//! The block of elements with memory, from a mesh.

use super::Inelastic;
use super::points::PointElement;
use crate::block::{Build, ElementBlock, all_or_flat, corners};
use crate::clusters::Clusters;
use crate::hex8::ReferenceGeometry;
use crate::law::HISTORY;
use crate::quadratic::reference_points;
use crate::section::{Formulation, Section};
use crate::tet4::Batch;
use rayon::prelude::*;
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
        let nodes = mesh.elements[e].as_hex().map_or_else(|| mesh.elements[e].nodes().to_vec(), |nodes| nodes.to_vec());
        let place = Place { number, section, first: firsts[e] };
        let Some(element) = element(&mesh.nodes, nodes, place, sections[section as usize].formulation) else {
            flat.push(number);
            continue;
        };
        pairs.push(pairs[elements.len()] + element.nodes.len() * element.nodes.len());
        elements.push(element);
    }
    Some(Arc::new(Inelastic { elements, clusters, pairs }))
}

/// The same elements with nodes at other positions, or those without a positive Jacobian there.
pub(super) fn at_positions(of: &Inelastic, x: &[[f64; 3]], sections: &[Section]) -> Result<Inelastic, Vec<u32>> {
    let moved = |old: &PointElement| {
        let &PointElement { number, section, first, .. } = old;
        let formulation = sections[section as usize].formulation;
        element(x, old.nodes.clone(), Place { number, section, first }, formulation).ok_or(number)
    };
    let elements = all_or_flat(of.elements.par_iter().map(moved).collect())?;
    Ok(Inelastic { elements, clusters: of.clusters.clone(), pairs: of.pairs.clone() })
}

/// The numbers that an element has in its model.
#[derive(Clone, Copy)]
struct Place {
    number: u32,
    section: u32,
    first: usize,
}

/// An element with nodes at positions `x`; `None` if the Jacobian is not positive at a point.
fn element(x: &[[f64; 3]], nodes: Vec<u32>, place: Place, formulation: Formulation) -> Option<PointElement> {
    let Place { number, section, first } = place;
    let Reference { gradients, weights, average } = reference(x, &nodes, formulation)?;
    let average = (formulation == Formulation::FBar).then_some(average);
    Some(PointElement { nodes, number, section, first, gradients, weights, average })
}

/// Gradients of the shape functions, weights and averages of an element.
pub(crate) struct Reference {
    pub gradients: Vec<Vec<[f64; 3]>>,
    pub weights: Vec<f64>,
    pub average: Vec<Vec<f64>>,
}

/// `None` if the Jacobian is not positive at a point.
fn reference(x: &[[f64; 3]], nodes: &[u32], formulation: Formulation) -> Option<Reference> {
    if let Ok(nodes) = <[u32; 8]>::try_from(nodes) {
        let geometry = ReferenceGeometry::new(&corners(x, &nodes))?;
        let gradients = (0..8).map(|q| geometry.shape_gradients(q).to_vec()).collect();
        let weights: Vec<f64> = (0..8).map(|q| geometry.weight(q)).collect();
        let average = constant(&weights);
        return Some(Reference { gradients, weights, average });
    }
    if let Ok(nodes) = <[u32; 4]>::try_from(nodes) {
        let batch = Batch::new(x, &[(0, nodes)], 0).ok()?;
        let weights = vec![batch.volumes[0]];
        let average = constant(&weights);
        return Some(Reference { gradients: vec![batch.shape_gradients(0).to_vec()], weights, average });
    }
    reference_points(x, nodes, formulation)
}

/// A projects onto constants.
fn constant(weights: &[f64]) -> Vec<Vec<f64>> {
    let volume: f64 = weights.iter().sum();
    let row: Vec<f64> = weights.iter().map(|w| w / volume).collect();
    vec![row; weights.len()]
}
