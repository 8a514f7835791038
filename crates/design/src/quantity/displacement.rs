//! Displacement of a set of nodes.

use super::{
    Dimension, Quantity, QuantityError, StateDerivative, StateView, VectorMeasure, add_at_node, at_node, check_nodes,
};

/// A component or the norm of the mean displacement Σ w_i u_i / Σ w_i of some nodes, or of its
/// difference from that of others. \[L\]
///
/// Test: `resultants_and_means_by_hand`.
#[derive(Clone, Debug)]
pub struct Displacement {
    name: String,
    /// Nodes with weights that add up to 1, or to 0 with the nodes subtracted.
    nodes: Vec<(u32, f64)>,
    measure: VectorMeasure,
}

impl Displacement {
    /// The mean over `nodes`, each with a positive weight: 1 for a mean of nodes, the area around
    /// the node for the mean of a surface.
    ///
    /// # Errors
    /// If there is no node, a node is out of range or listed twice, or a weight is not positive and
    /// finite.
    pub fn new(
        name: impl Into<String>,
        nodes: Vec<(u32, f64)>,
        node_count: usize,
        measure: VectorMeasure,
    ) -> Result<Self, QuantityError> {
        Ok(Self { name: name.into(), nodes: normalised(nodes, node_count)?, measure })
    }

    /// Subtracts the mean displacement of other nodes.
    ///
    /// # Errors
    /// As for [`new`](Self::new).
    pub fn relative_to(mut self, nodes: Vec<(u32, f64)>, node_count: usize) -> Result<Self, QuantityError> {
        self.nodes.extend(normalised(nodes, node_count)?.into_iter().map(|(node, weight)| (node, -weight)));
        Ok(self)
    }

    fn mean(&self, state: &StateView) -> [f64; 3] {
        let mut mean = [0.0; 3];
        for &(node, weight) in &self.nodes {
            let displacement = at_node(state.displacement, node);
            (0..3).for_each(|c| mean[c] += weight * displacement[c]);
        }
        mean
    }
}

fn normalised(mut nodes: Vec<(u32, f64)>, node_count: usize) -> Result<Vec<(u32, f64)>, QuantityError> {
    check_nodes(&nodes.iter().map(|(node, _)| *node).collect::<Vec<u32>>(), node_count)?;
    if let Some((node, value)) = nodes.iter().find(|(_, weight)| !(weight.is_finite() && *weight > 0.0)) {
        return Err(QuantityError::NodeWeight { node: *node, value: *value });
    }
    let sum: f64 = nodes.iter().map(|(_, weight)| weight).sum();
    nodes.iter_mut().for_each(|(_, weight)| *weight /= sum);
    Ok(nodes)
}

impl Quantity for Displacement {
    fn name(&self) -> &str {
        &self.name
    }

    fn dimension(&self) -> Dimension {
        Dimension::LENGTH
    }

    /// A mean over a surface does, not one over nodes.
    fn depends_on_mesh(&self) -> bool {
        let weights =
            |sign: f64| self.nodes.iter().map(move |(_, weight)| sign * weight).filter(|weight| *weight > 0.0);
        [1.0, -1.0].iter().any(|&sign| {
            let largest = weights(sign).fold(0.0, f64::max);
            weights(sign).any(|weight| weight < (1.0 - 1e-12) * largest)
        })
    }

    fn value(&self, state: &StateView) -> f64 {
        self.measure.of(self.mean(state))
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        let slope = self.measure.slope(self.mean(state));
        for &(node, share) in &self.nodes {
            add_at_node(&mut to.displacement, node, weight * share, slope);
        }
    }
}
