//! Elements with memory from a mesh.

use super::Inelastic;
use super::points::PointElement;
use crate::clusters::Clusters;
use crate::hex8::ReferenceGeometry;
use crate::quadratic::reference_points;
use crate::section::{Formulation, Section};
use crate::tet4::Batch;
use slipstick_mesh::{Element, Mesh};

/// Number of integration points of an element.
pub(crate) fn integration_points(element: &Element) -> usize {
    match element {
        Element::Tet4(_) => 1,
        Element::Wedge6(_) | Element::Hex8(_) | Element::Tet10(_) => 8,
        Element::Hex27(_) => 27,
    }
}

impl Inelastic {
    /// The elements with these numbers. Those without a positive Jacobian are added to `flat`. Histories
    /// are numbered through all elements of the mesh whose section has memory.
    pub fn new(mesh: &Mesh, numbers: Vec<u32>, sections: &[Section], section_of: &[u32], flat: &mut Vec<u32>) -> Self {
        let has_memory = |e: usize| sections[section_of[e] as usize].material.kind().has_memory();
        let mut points = 0;
        let mut firsts = Vec::with_capacity(mesh.elements.len());
        for (e, element) in mesh.elements.iter().enumerate() {
            firsts.push(points);
            points += if has_memory(e) { integration_points(element) } else { 0 };
        }
        if points == 0 {
            return Self::default();
        }
        let clusters = Clusters::new(mesh, numbers);
        let mut elements = Vec::with_capacity(clusters.order.len());
        for &number in &clusters.order {
            let (e, section) = (number as usize, section_of[number as usize]);
            match reference(mesh, number) {
                Some((nodes, gradients, weights, average)) => elements.push(PointElement {
                    nodes,
                    number,
                    section,
                    first: firsts[e],
                    gradients,
                    weights,
                    average: (sections[section as usize].formulation == Formulation::FBar).then_some(average),
                }),
                None => flat.push(number),
            }
        }
        Self { elements, clusters: Some(clusters), points }
    }
}

/// Nodes, gradients of the shape functions, weights and averages of an element.
pub(crate) type Reference = (Vec<u32>, Vec<Vec<[f64; 3]>>, Vec<f64>, Vec<Vec<f64>>);

/// `None` if the Jacobian is not positive at a point.
fn reference(mesh: &Mesh, number: u32) -> Option<Reference> {
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
    reference_points(mesh, number)
}

/// A projects onto constants.
fn constant(weights: &[f64]) -> Vec<Vec<f64>> {
    let volume: f64 = weights.iter().sum();
    let row: Vec<f64> = weights.iter().map(|w| w / volume).collect();
    vec![row; weights.len()]
}
