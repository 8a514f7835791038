//! The sum of the norms of the contact forces of a structure.

use super::{Dimension, Quantity, QuantityError, StateDerivative, StateView, at_node, check_nodes, norm};

/// Nodal forces below this fraction of the largest nodal force of the model are round-off at nodes
/// without contact.
///
/// Counting such a node as zero changes the quantity by less than the equilibrium tolerance can
/// resolve.
const NEGLIGIBLE: f64 = 1e-12;

/// Sum of the force norms of the slave nodes: `Σ_j (√(f_j·f_j + ε²) − ε)`, `f_j = f_int^(j) −
/// f_ext^(j)`. \[F\]
///
/// Its negative is the paper's objective: friction included, contact forces are maximized. The sum
/// of norms is not the norm of the resultant: forces in different directions do not cancel. Besides
/// loads, slave nodes carry reactions if they are supported or driven; without those components
/// ([`ContactForce::without_reactions`]) this difference is the negative contact force. With `ε =
/// 0` it is the norm itself, which has no derivative at `f_j = 0`: a node whose force is below
/// 1e-12 of the largest nodal force of the model counts as zero, with a zero derivative. With `ε >
/// 0` the function is smooth everywhere; choose ε far below the relevant forces.
///
/// Paper: (91), (93), (96); the regularization is ours.
#[derive(Clone, Debug)]
pub struct ContactForce {
    name: String,
    nodes: Vec<u32>,
    regularisation: f64,
    /// Marks the force components that are reactions; empty: none.
    reactions: Vec<bool>,
}

impl ContactForce {
    /// `nodes`: the slave nodes `S` of a mesh with `node_count` nodes; `regularisation`: ε ≥ 0
    /// \[F\].
    ///
    /// # Errors
    ///
    /// If there is no node, a node is out of range or listed twice, or the regularization is
    /// negative or not finite.
    pub fn new(nodes: Vec<u32>, node_count: usize, regularisation: f64) -> Result<Self, QuantityError> {
        check_nodes(&nodes, node_count)?;
        if !regularisation.is_finite() || regularisation < 0.0 {
            return Err(QuantityError::Regularisation { value: regularisation });
        }
        Ok(Self { name: "contact_force".into(), nodes, regularisation, reactions: Vec::new() })
    }

    /// With another name than `contact_force`.
    pub fn named(mut self, name: impl Into<String>) -> Self {
        self.name = name.into();
        self
    }

    /// Excludes the force components that `prescribed` marks (three per node of the mesh): they are
    /// reactions of supports and prescribed motions, not contact forces.
    pub fn without_reactions(mut self, prescribed: &[bool]) -> Self {
        self.reactions = prescribed.to_vec();
        self
    }

    /// Force of a node without reactions.
    fn force(&self, state: &StateView, node: u32) -> [f64; 3] {
        let (internal, external) = (at_node(state.internal_force, node), at_node(state.external_force, node));
        let mut force: [f64; 3] = std::array::from_fn(|c| internal[c] - external[c]);
        for (c, f) in force.iter_mut().enumerate() {
            if self.reactions.get(3 * node as usize + c) == Some(&true) {
                *f = 0.0;
            }
        }
        force
    }

    /// Norm below which a node counts as not in contact. \[F\]
    fn threshold(&self, internal_force: &[f64]) -> f64 {
        if self.regularisation > 0.0 {
            return 0.0;
        }
        let nodes = internal_force.chunks_exact(3);
        let largest = nodes.map(|f| f[0] * f[0] + f[1] * f[1] + f[2] * f[2]).fold(0.0, f64::max);
        NEGLIGIBLE * largest.sqrt()
    }
}

impl Quantity for ContactForce {
    fn name(&self) -> &str {
        &self.name
    }

    fn dimension(&self) -> Dimension {
        Dimension::FORCE
    }

    fn needs_contact(&self) -> bool {
        true
    }

    fn value(&self, state: &StateView) -> f64 {
        let threshold = self.threshold(state.internal_force);
        let mut sum = 0.0;
        for &node in &self.nodes {
            let size = norm(self.force(state, node));
            if size <= threshold {
                continue; // false for NaN, which therefore reaches the sum
            }
            // √(f·f + ε²) − ε without cancellation for f ≪ ε
            sum += size * (size / (size.hypot(self.regularisation) + self.regularisation));
        }
        sum
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        let threshold = self.threshold(state.internal_force);
        for &node in &self.nodes {
            let force = self.force(state, node);
            let size = norm(force);
            if size <= threshold {
                continue;
            }
            let regularised = size.hypot(self.regularisation);
            for component in 0..3 {
                let at = 3 * node as usize + component;
                to.internal_force[at] += weight * (force[component] / regularised);
                to.external_force[at] -= weight * (force[component] / regularised);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(internal_force: &[f64]) -> StateView<'_> {
        StateView { step: 1, steps: 1, time: 1.0, internal_force, external_force: &NONE, ..StateView::default() }
    }

    fn gradient(quantity: &impl Quantity, force: &[f64]) -> Vec<f64> {
        let mut to = StateDerivative::zero(&view(force));
        to.external_force.resize(force.len(), 0.0);
        quantity.pull_back(&view(force), -1.0, &mut to);
        let opposite = |(i, e): (&f64, &f64)| *i == -e || i.is_nan() && e.is_nan();
        assert!(to.internal_force.iter().zip(&to.external_force).all(opposite));
        to.internal_force
    }

    /// No load.
    const NONE: [f64; 12] = [0.0; 12];

    /// Node 0 is not observed and carries the largest force; node 3 carries noise.
    const FORCE: [f64; 12] = [50.0, 0.0, 1.0, 3.0, -4.0, 0.0, 2.0, -1.0, 2.0, 1e-13, -2e-13, 1e-13];

    /// Node 1 is driven in y: only its x component is contact. By hand: 3 + 3 (nodes 1 and 2).
    #[test]
    fn reactions_do_not_count() {
        let mut prescribed = vec![false; 12];
        prescribed[4] = true;
        let quantity = ContactForce::new(vec![1, 2, 3], 4, 0.0).unwrap();
        let quantity = quantity.without_reactions(&prescribed);
        assert_eq!(quantity.value(&view(&FORCE)), 6.0);
        let found = gradient(&quantity, &FORCE);
        assert_eq!((found[3], found[4]), (-1.0, 0.0));
    }

    #[test]
    fn norms_by_hand_and_noise_counts_as_zero() {
        let quantity = ContactForce::new(vec![1, 2, 3], 4, 0.0).unwrap();
        assert_eq!(quantity.value(&view(&FORCE)), 8.0);
        // not the norm of the resultant (5, −5, 2), in which forces cancel
        assert!(norm([5.0, -5.0, 2.0]) < 7.4);
        let third = 1.0 / 3.0;
        let expected = [0.0, 0.0, 0.0, -0.6, 0.8, 0.0, -2.0 * third, third, -2.0 * third, 0.0, 0.0, 0.0];
        for (value, expected) in gradient(&quantity, &FORCE).iter().zip(expected) {
            assert!((value - expected).abs() < 1e-15);
        }
        assert_eq!(quantity.value(&view(&[0.0; 12])), 0.0);
        assert_eq!(gradient(&quantity, &[0.0; 12]), [0.0; 12]);
    }

    /// Computed by hand: a node counts as not in contact below 1e-12 of the largest force, here (2,
    /// −3, 6) × 1e4 with norm 7e4, in any unit.
    #[test]
    fn the_largest_force_says_what_is_negligible() {
        let quantity = ContactForce::new(vec![1], 3, 0.0).unwrap();
        for unit in [1e-4, 1.0, 1e4] {
            for (size, counts) in [(6.9e-8, false), (7.1e-8, true)] {
                let mut force = [2e4, -3e4, 6e4, 0.0, size, 0.0, 1e4, 1e4, -1e4].map(|f| unit * f);
                let found = quantity.value(&view(&force));
                assert_eq!(found, if counts { unit * size } else { 0.0 }, "{unit} {size}");
                force[4] = -force[4];
                assert_eq!(quantity.value(&view(&force)), found);
            }
        }
        let regularised = ContactForce::new(vec![1], 3, 1e-3).unwrap();
        assert_eq!(regularised.threshold(&[2e4, -3e4, 6e4]), 0.0);
    }

    #[test]
    fn derivative_agrees_with_central_differences() {
        for regularisation in [0.0, 1e-3, 1.0] {
            let quantity = ContactForce::new(vec![2, 1], 4, regularisation).unwrap();
            let exact = gradient(&quantity, &FORCE);
            for entry in 0..12 {
                let step = 1e-5;
                let mut forward = FORCE;
                let mut backward = FORCE;
                forward[entry] += step;
                backward[entry] -= step;
                let change = quantity.value(&view(&backward)) - quantity.value(&view(&forward));
                assert!((change / (2.0 * step) - exact[entry]).abs() < 1e-9, "entry {entry}");
            }
        }
    }

    #[test]
    fn regularisation_is_smooth_at_zero_and_keeps_its_digits() {
        let quantity = ContactForce::new(vec![0], 1, 1.0).unwrap();
        // √(f² + 1) − 1 = f²/2 − f⁴/8 …; the naive form would give 0 for f = 1e-9.
        let value = quantity.value(&view(&[1e-9, 0.0, 0.0]));
        assert!((value / 0.5e-18 - 1.0).abs() < 1e-12);
        assert!((gradient(&quantity, &[1e-9, 0.0, 0.0])[0] / -1e-9 - 1.0).abs() < 1e-12);
        assert_eq!(gradient(&quantity, &[0.0; 3]), [0.0; 3]);
    }

    #[test]
    fn a_force_that_is_not_a_number_is_not_lost() {
        let quantity = ContactForce::new(vec![1], 2, 0.0).unwrap();
        let force = [1.0, 0.0, 0.0, f64::NAN, 0.0, 0.0];
        assert!(quantity.value(&view(&force)).is_nan());
        assert!(gradient(&quantity, &force)[3].is_nan());
    }

    #[test]
    fn derivatives_accumulate() {
        let quantity = ContactForce::new(vec![0], 1, 0.0).unwrap();
        let mut to = StateDerivative {
            internal_force: vec![10.0, 20.0, 30.0],
            external_force: vec![0.0; 3],
            ..StateDerivative::default()
        };
        quantity.pull_back(&view(&[0.0, 2.0, 0.0]), -1.0, &mut to);
        assert_eq!(to.internal_force, [10.0, 19.0, 30.0]);
    }

    #[test]
    fn errors_name_the_node() {
        let make = |nodes: &[u32], regularisation| ContactForce::new(nodes.to_vec(), 4, regularisation).unwrap_err();
        assert_eq!(make(&[], 0.0), QuantityError::NoNodes);
        assert_eq!(make(&[0, 4], 0.0), QuantityError::NodeOutOfRange { node: 4, node_count: 4 });
        assert_eq!(make(&[2, 1, 2], 0.0), QuantityError::DuplicateNode { node: 2 });
        assert_eq!(make(&[1], -1.0), QuantityError::Regularisation { value: -1.0 });
        assert!(matches!(make(&[1], f64::NAN), QuantityError::Regularisation { .. }));
    }
}
