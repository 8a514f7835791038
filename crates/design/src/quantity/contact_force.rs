//! The sum of the norms of the contact forces of a structure.

use super::{Measure, Objective, ObjectiveError, ObservedSteps, StateDerivative, StateView, check_nodes, nodal_force};

/// Nodal forces below this fraction of the largest nodal force of the model are round-off at nodes without contact.
///
/// Counting such a node as zero changes the objective by less than the equilibrium tolerance can resolve.
const NEGLIGIBLE: f64 = 1e-12;

/// Negative sum of the force norms of the slave nodes: `θ_s = −Σ_j (√(f_j·f_j + ε²) − ε)`, `f_j = f_int,s^(j) −
/// f_ext,s^(j)`. \[F\]
///
/// Minimising it maximises the contact forces, friction included. The sum of norms is not the norm of the resultant:
/// forces in different directions do not cancel. Besides loads, slave nodes carry reactions if they are supported or
/// driven; without those components ([`ContactForce::without_reactions`]) this difference is the negative contact
/// force. With `ε = 0` it is the norm itself, which has no derivative at `f_j = 0`: a node whose force is below 1e-12
/// of the largest nodal force of the model counts as zero, with a zero derivative. With `ε > 0` the function is smooth
/// everywhere; choose ε far below the relevant forces.
///
/// Paper: (91), (93), (96); the regularisation is ours.
#[derive(Clone, Debug)]
pub struct ContactForce {
    nodes: Vec<u32>,
    steps: ObservedSteps,
    regularisation: f64,
    /// Marks the force components that are reactions; empty: none.
    reactions: Vec<bool>,
}

impl ContactForce {
    /// `nodes`: the slave nodes `S` of a mesh with `node_count` nodes; `regularisation`: ε ≥ 0 \[F\].
    ///
    /// Check `steps` against the load path with [`ObservedSteps::check`].
    ///
    /// # Errors
    ///
    /// If there is no node, a node is out of range or listed twice, or the regularisation is negative or not finite.
    pub fn new(
        nodes: Vec<u32>,
        node_count: usize,
        steps: ObservedSteps,
        regularisation: f64,
    ) -> Result<Self, ObjectiveError> {
        check_nodes(&nodes, node_count)?;
        if !regularisation.is_finite() || regularisation < 0.0 {
            return Err(ObjectiveError::Regularisation { value: regularisation });
        }
        Ok(Self { nodes, steps, regularisation, reactions: Vec::new() })
    }

    /// Excludes the force components that `prescribed` marks (three per node of the mesh): they are reactions of
    /// supports and prescribed motions, not contact forces.
    pub fn without_reactions(mut self, prescribed: &[bool]) -> Self {
        self.reactions = prescribed.to_vec();
        self
    }

    /// Force of a node without reactions.
    fn force(&self, state: &StateView, node: u32) -> [f64; 3] {
        let mut force = nodal_force(state, node);
        for (c, f) in force.iter_mut().enumerate() {
            if self.reactions.get(3 * node as usize + c) == Some(&true) {
                *f = 0.0;
            }
        }
        force
    }

    /// The slave nodes whose forces are summed.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// The steps that are summed over.
    pub fn steps(&self) -> &ObservedSteps {
        &self.steps
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

fn norm([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}

impl Objective for ContactForce {
    fn name(&self) -> &str {
        "contact_force"
    }

    fn measure(&self) -> Measure {
        Measure::ContactForce
    }

    fn observes(&self, step: usize, steps: usize) -> bool {
        self.steps.contains(step, steps)
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
        -sum
    }

    fn derivative(&self, state: &StateView, derivative: &mut StateDerivative) {
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
                derivative.internal_force[at] -= force[component] / regularised;
                derivative.external_force[at] += force[component] / regularised;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(internal_force: &[f64]) -> StateView<'_> {
        StateView { step: 1, steps: 1, time: 1.0, displacement: &[], internal_force, external_force: &NONE }
    }

    fn gradient(objective: &impl Objective, force: &[f64]) -> Vec<f64> {
        let mut internal_force = vec![0.0; force.len()];
        let mut external_force = vec![0.0; force.len()];
        let mut derivative = StateDerivative {
            displacement: &mut [],
            internal_force: &mut internal_force,
            external_force: &mut external_force,
        };
        objective.derivative(&view(force), &mut derivative);
        assert!(internal_force.iter().zip(&external_force).all(|(i, e)| *i == -e || i.is_nan() && e.is_nan()));
        internal_force
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
        let objective = ContactForce::new(vec![1, 2, 3], 4, ObservedSteps::Last, 0.0).unwrap();
        let objective = objective.without_reactions(&prescribed);
        assert_eq!(objective.value(&view(&FORCE)), -6.0);
        let found = gradient(&objective, &FORCE);
        assert_eq!((found[3], found[4]), (-1.0, 0.0));
    }

    #[test]
    fn norms_by_hand_and_noise_counts_as_zero() {
        let objective = ContactForce::new(vec![1, 2, 3], 4, ObservedSteps::Last, 0.0).unwrap();
        assert_eq!(objective.value(&view(&FORCE)), -8.0);
        // not the norm of the resultant (5, −5, 2), in which forces cancel
        assert!(norm([5.0, -5.0, 2.0]) < 7.4);
        let third = 1.0 / 3.0;
        let expected = [0.0, 0.0, 0.0, -0.6, 0.8, 0.0, -2.0 * third, third, -2.0 * third, 0.0, 0.0, 0.0];
        for (value, expected) in gradient(&objective, &FORCE).iter().zip(expected) {
            assert!((value - expected).abs() < 1e-15);
        }
        assert_eq!(objective.value(&view(&[0.0; 12])), 0.0);
        assert_eq!(gradient(&objective, &[0.0; 12]), [0.0; 12]);
    }

    /// Computed by hand: a node counts as not in contact below 1e-12 of the largest force, here (2, −3, 6) × 1e4 with
    /// norm 7e4, in any unit.
    #[test]
    fn the_largest_force_says_what_is_negligible() {
        let objective = ContactForce::new(vec![1], 3, ObservedSteps::Last, 0.0).unwrap();
        for unit in [1e-4, 1.0, 1e4] {
            for (size, counts) in [(6.9e-8, false), (7.1e-8, true)] {
                let mut force = [2e4, -3e4, 6e4, 0.0, size, 0.0, 1e4, 1e4, -1e4].map(|f| unit * f);
                let found = objective.value(&view(&force));
                assert_eq!(found, if counts { -unit * size } else { 0.0 }, "{unit} {size}");
                force[4] = -force[4];
                assert_eq!(objective.value(&view(&force)), found);
            }
        }
        let regularised = ContactForce::new(vec![1], 3, ObservedSteps::Last, 1e-3).unwrap();
        assert_eq!(regularised.threshold(&[2e4, -3e4, 6e4]), 0.0);
    }

    #[test]
    fn derivative_agrees_with_central_differences() {
        for regularisation in [0.0, 1e-3, 1.0] {
            let objective = ContactForce::new(vec![2, 1], 4, ObservedSteps::All, regularisation).unwrap();
            let exact = gradient(&objective, &FORCE);
            for entry in 0..12 {
                let step = 1e-5;
                let mut forward = FORCE;
                let mut backward = FORCE;
                forward[entry] += step;
                backward[entry] -= step;
                let change = objective.value(&view(&forward)) - objective.value(&view(&backward));
                assert!((change / (2.0 * step) - exact[entry]).abs() < 1e-9, "entry {entry}");
            }
        }
    }

    #[test]
    fn regularisation_is_smooth_at_zero_and_keeps_its_digits() {
        let objective = ContactForce::new(vec![0], 1, ObservedSteps::Last, 1.0).unwrap();
        // √(f² + 1) − 1 = f²/2 − f⁴/8 …; the naive form would give 0 for f = 1e-9.
        let value = objective.value(&view(&[1e-9, 0.0, 0.0]));
        assert!((value / -0.5e-18 - 1.0).abs() < 1e-12);
        assert!((gradient(&objective, &[1e-9, 0.0, 0.0])[0] / -1e-9 - 1.0).abs() < 1e-12);
        assert_eq!(gradient(&objective, &[0.0; 3]), [0.0; 3]);
    }

    #[test]
    fn a_force_that_is_not_a_number_is_not_lost() {
        let objective = ContactForce::new(vec![1], 2, ObservedSteps::Last, 0.0).unwrap();
        let force = [1.0, 0.0, 0.0, f64::NAN, 0.0, 0.0];
        assert!(objective.value(&view(&force)).is_nan());
        assert!(gradient(&objective, &force)[3].is_nan());
    }

    #[test]
    fn derivatives_accumulate() {
        let objective = ContactForce::new(vec![0], 1, ObservedSteps::Last, 0.0).unwrap();
        let mut internal_force = [10.0, 20.0, 30.0];
        let mut derivative = StateDerivative {
            displacement: &mut [],
            internal_force: &mut internal_force,
            external_force: &mut [0.0; 3],
        };
        objective.derivative(&view(&[0.0, 2.0, 0.0]), &mut derivative);
        assert_eq!(internal_force, [10.0, 19.0, 30.0]);
    }

    #[test]
    fn errors_name_the_node() {
        let make = |nodes: &[u32], regularisation| {
            ContactForce::new(nodes.to_vec(), 4, ObservedSteps::Last, regularisation).unwrap_err()
        };
        assert_eq!(make(&[], 0.0), ObjectiveError::NoNodes);
        assert_eq!(make(&[0, 4], 0.0), ObjectiveError::NodeOutOfRange { node: 4, node_count: 4 });
        assert_eq!(make(&[2, 1, 2], 0.0), ObjectiveError::DuplicateNode { node: 2 });
        assert_eq!(make(&[1], -1.0), ObjectiveError::Regularisation { value: -1.0 });
        assert!(matches!(make(&[1], f64::NAN), ObjectiveError::Regularisation { .. }));
    }
}
