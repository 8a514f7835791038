//! Target lengths of the edges of a part: those of the design's elements nearby, or one length.

use std::collections::HashMap;

use slipstick_mesh::Mesh;

use super::curved::bits;
use crate::closest::{ClosestPoint, Simplex};
use crate::vector::{norm, subtract};

/// How often lengths are averaged with their neighbours, so that irregular elements do not leave a
/// trace in the part.
const ROUNDS: usize = 3;

/// Lengths of edges in space. \[L\]
#[derive(Debug)]
pub(super) enum Lengths {
    /// The same everywhere.
    Uniform(f64),
    /// Given at nodes; elsewhere, the nearest node counts.
    AtNodes { nodes: ClosestPoint, lengths: HashMap<[u64; 3], f64>, mean: f64 },
}

impl Lengths {
    /// The shortest edges of the elements of a body, averaged between neighbours.
    pub fn of_elements(mesh: &Mesh, body: usize) -> Self {
        let elements = mesh.bodies[body].elements.clone();
        let mut shortest: Vec<f64> = elements.clone().map(|e| shortest_edge(mesh, e)).collect();
        let mean = shortest.iter().sum::<f64>() / shortest.len() as f64;
        let close = |length: &f64| (length / mean - 1.0).abs() < 1e-9;
        if shortest.iter().all(close) {
            return Self::Uniform(mean);
        }
        let mut at: HashMap<u32, f64> = HashMap::new();
        for _ in 0..ROUNDS {
            let mut sums: HashMap<u32, (f64, f64)> = HashMap::new();
            for (e, length) in elements.clone().zip(&shortest) {
                for &node in mesh.elements[e].nodes() {
                    let (sum, count) = sums.entry(node).or_default();
                    *sum += length;
                    *count += 1.0;
                }
            }
            at = sums.into_iter().map(|(node, (sum, count))| (node, sum / count)).collect();
            for (e, length) in elements.clone().zip(&mut shortest) {
                let nodes = mesh.elements[e].nodes();
                *length = nodes.iter().map(|node| at[node]).sum::<f64>() / nodes.len() as f64;
            }
        }
        let point = |node: &u32| mesh.nodes[*node as usize];
        let mut numbers: Vec<u32> = at.keys().copied().collect();
        numbers.sort_unstable();
        let simplices = numbers.iter().map(|node| Simplex { corners: [point(node); 3], normal: [0.0; 3] });
        Self::AtNodes {
            nodes: ClosestPoint::new(simplices.collect()),
            // in ascending order, so that coincident nodes leave the same one in every run
            lengths: numbers.iter().map(|node| (bits(point(node)), at[node])).collect(),
            mean,
        }
    }

    /// The length at a point. \[L\]
    pub fn at(&self, x: [f64; 3]) -> f64 {
        match self {
            Self::Uniform(length) => *length,
            Self::AtNodes { nodes, lengths, mean } => {
                let node = nodes.of(x, ([0.0; 3], 0.0), f64::INFINITY);
                node.and_then(|node| lengths.get(&bits(node)).copied()).unwrap_or(*mean)
            }
        }
    }

    /// About how many tetrahedra fill a unit of the volume of these elements. \[1/L³\]
    pub fn tetrahedra(&self, mesh: &Mesh, elements: &[usize]) -> f64 {
        let one = |length: f64| length.powi(3) * 2f64.sqrt() / 12.0;
        let (mut count, mut volume) = (0.0, 0.0);
        for &e in elements {
            let own = mesh.element_volume(e);
            count += own / one(self.at(mesh.centroid(e)));
            volume += own;
        }
        if volume > 0.0 { count / volume } else { 1.0 / one(self.mean()) }
    }

    /// The shortest and the longest. \[L\]
    pub fn range(&self) -> [f64; 2] {
        match self {
            Self::Uniform(length) => [*length; 2],
            Self::AtNodes { lengths, .. } => {
                let wider = |[low, high]: [f64; 2], &length: &f64| [low.min(length), high.max(length)];
                lengths.values().fold([f64::INFINITY, 0.0], wider)
            }
        }
    }

    /// The mean over the elements. \[L\]
    pub fn mean(&self) -> f64 {
        match self {
            Self::Uniform(length) => *length,
            Self::AtNodes { mean, .. } => *mean,
        }
    }
}

/// The shortest edge of an element. \[L\]
fn shortest_edge(mesh: &Mesh, e: usize) -> f64 {
    let element = &mesh.elements[e];
    let sides = (0..element.sides()).map(|side| element.side(side));
    let lengths = sides.flat_map(|side| {
        let at = |k: usize| mesh.nodes[side[k % side.len()] as usize];
        (0..side.len()).map(|k| norm(subtract(at(k + 1), at(k)))).collect::<Vec<_>>()
    });
    lengths.fold(f64::INFINITY, f64::min)
}
