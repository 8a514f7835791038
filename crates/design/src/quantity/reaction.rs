//! Forces and moments of supports.

use std::collections::BTreeSet;

use super::{
    Dimension, Quantity, QuantityError, Reads, StateDerivative, StateView, VectorMeasure, add_at_node, at_node, cross,
    dot,
};

/// A component or the norm of the force that supports and prescribed motions exert on the bodies at
/// some displacement unknowns. \[F\]
///
/// It is the sum of the residual F of the equilibrium, contact and loads included, over these
/// unknowns: its derivative is that of F. Test: `resultants_and_means_by_hand`.
#[derive(Clone, Debug)]
pub struct Reaction {
    name: String,
    /// Prescribed displacement unknowns, `3·node + component`.
    unknowns: Vec<u32>,
    measure: VectorMeasure,
}

impl Reaction {
    /// The reaction at these unknowns, `3·node + component`; those that are not prescribed do not
    /// count.
    ///
    /// # Errors
    /// Without unknowns.
    pub fn new(name: impl Into<String>, unknowns: Vec<u32>, measure: VectorMeasure) -> Result<Self, QuantityError> {
        if unknowns.is_empty() {
            return Err(QuantityError::NoNodes);
        }
        Ok(Self { name: name.into(), unknowns, measure })
    }

    fn resultant(&self, state: &StateView) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for &unknown in &self.unknowns {
            sum[unknown as usize % 3] += state.reaction[unknown as usize];
        }
        sum
    }
}

impl Quantity for Reaction {
    fn name(&self) -> &str {
        &self.name
    }

    fn dimension(&self) -> Dimension {
        Dimension::FORCE
    }

    fn reads(&self) -> Reads {
        Reads { reaction: true, ..Reads::default() }
    }

    fn value(&self, state: &StateView) -> f64 {
        self.measure.of(self.resultant(state))
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        let slope = self.measure.slope(self.resultant(state));
        for &unknown in &self.unknowns {
            to.reaction[unknown as usize] += weight * slope[unknown as usize % 3];
        }
    }
}

/// The moment of such forces about an axis, e · Σ (x − p) × r, at the current positions x = X + d.
/// \[F L\]
///
/// Test: `resultants_and_means_by_hand`.
#[derive(Clone, Debug)]
pub struct Moment {
    name: String,
    /// Nodes with their reference positions relative to p, and their unknowns that count.
    nodes: Vec<(u32, [f64; 3], [bool; 3])>,
    /// e.
    direction: [f64; 3],
}

impl Moment {
    /// The moment about the axis through `point` along `direction`, of the reactions at the
    /// unknowns `3·node + component`; `positions` are those of all nodes in the reference
    /// configuration.
    ///
    /// # Errors
    /// Without unknowns, or if the direction is zero or not finite.
    pub fn new(
        name: impl Into<String>,
        unknowns: &[u32],
        positions: &[[f64; 3]],
        point: [f64; 3],
        direction: [f64; 3],
    ) -> Result<Self, QuantityError> {
        let VectorMeasure::Along(direction) = VectorMeasure::along(direction)? else {
            return Err(QuantityError::Direction { direction });
        };
        let mut nodes: Vec<u32> = unknowns.iter().map(|unknown| unknown / 3).collect();
        nodes.sort_unstable();
        nodes.dedup();
        if let Some(&node) = nodes.iter().find(|&&node| node as usize >= positions.len()) {
            return Err(QuantityError::NodeOutOfRange { node, node_count: positions.len() });
        }
        if nodes.is_empty() {
            return Err(QuantityError::NoNodes);
        }
        let counted: BTreeSet<u32> = unknowns.iter().copied().collect();
        let of = |node: u32| {
            let arm = std::array::from_fn(|c| positions[node as usize][c] - point[c]);
            (node, arm, std::array::from_fn(|c| counted.contains(&(3 * node + c as u32))))
        };
        Ok(Self { name: name.into(), nodes: nodes.into_iter().map(of).collect(), direction })
    }

    /// Arm x − p and reaction of each node.
    fn nodes(&self, state: &StateView) -> impl Iterator<Item = (u32, [f64; 3], [f64; 3], [bool; 3])> {
        self.nodes.iter().map(|&(node, arm, counts)| {
            let (moved, force) = (at_node(state.displacement, node), at_node(state.reaction, node));
            let force = std::array::from_fn(|c| if counts[c] { force[c] } else { 0.0 });
            (node, std::array::from_fn(|c| arm[c] + moved[c]), force, counts)
        })
    }
}

impl Quantity for Moment {
    fn name(&self) -> &str {
        &self.name
    }

    fn dimension(&self) -> Dimension {
        Dimension::WORK
    }

    fn reads(&self) -> Reads {
        Reads { reaction: true, ..Reads::default() }
    }

    fn depends_on_mesh(&self) -> bool {
        true
    }

    fn value(&self, state: &StateView) -> f64 {
        self.nodes(state).map(|(_, arm, force, _)| dot(self.direction, cross(arm, force))).sum()
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        for (node, arm, force, counts) in self.nodes(state) {
            // e·(a × r) = a·(r × e) = r·(e × a)
            add_at_node(&mut to.displacement, node, weight, cross(force, self.direction));
            let by_force = cross(self.direction, arm);
            let by_force = std::array::from_fn(|c| if counts[c] { by_force[c] } else { 0.0 });
            add_at_node(&mut to.reaction, node, weight, by_force);
        }
    }
}
