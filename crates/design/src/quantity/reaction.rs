//! The reaction force of supports in one direction.

use super::{Measure, Objective, ObjectiveError, ObservedSteps, StateDerivative, StateView, check_nodes, nodal_force};

/// Negative resultant of the internal forces of a node set in a direction: `θ_s = −Σ_j e·f_int,s^(j)`. \[F\]
///
/// For nodes with prescribed displacements the internal force is the force that the support exerts on the body, so
/// minimising this maximises the force that is needed to move the set in direction `e`: it gives a stiff structure
/// under prescribed motion. It is linear in the forces, hence smooth.
#[derive(Clone, Debug)]
pub struct ReactionForce {
    nodes: Vec<u32>,
    direction: [f64; 3],
    steps: ObservedSteps,
}

impl ReactionForce {
    /// `nodes` of a mesh with `node_count` nodes; `direction` may have any nonzero length and is normalised here.
    ///
    /// Check `steps` against the load path with [`ObservedSteps::check`].
    ///
    /// # Errors
    ///
    /// If there is no node, a node is out of range or listed twice, or the direction is zero or not finite.
    pub fn new(
        nodes: Vec<u32>,
        node_count: usize,
        direction: [f64; 3],
        steps: ObservedSteps,
    ) -> Result<Self, ObjectiveError> {
        check_nodes(&nodes, node_count)?;
        let length = direction[0].hypot(direction[1]).hypot(direction[2]);
        if !length.is_normal() {
            return Err(ObjectiveError::Direction { direction });
        }
        Ok(Self { nodes, direction: direction.map(|component| component / length), steps })
    }

    /// The unit vector `e`.
    pub fn direction(&self) -> [f64; 3] {
        self.direction
    }
}

impl Objective for ReactionForce {
    fn name(&self) -> &str {
        "reaction_force"
    }

    fn measure(&self) -> Measure {
        Measure::Force
    }

    fn observes(&self, step: usize, steps: usize) -> bool {
        self.steps.contains(step, steps)
    }

    fn value(&self, state: &StateView) -> f64 {
        let [x, y, z] = self.direction;
        let along = |&node: &u32| {
            let force = nodal_force(state, node);
            x * force[0] + y * force[1] + z * force[2]
        };
        -self.nodes.iter().map(along).sum::<f64>()
    }

    fn derivative(&self, _state: &StateView, derivative: &mut StateDerivative) {
        for &node in &self.nodes {
            for component in 0..3 {
                let at = 3 * node as usize + component;
                derivative.internal_force[at] -= self.direction[component];
                derivative.external_force[at] += self.direction[component];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resultant_by_hand_and_linear() {
        let objective = ReactionForce::new(vec![0, 2], 3, [0.0, -5.0, 0.0], ObservedSteps::All).unwrap();
        assert_eq!(objective.direction(), [0.0, -1.0, 0.0]);
        let force = [1.0, -2.0, 3.0, 7.0, 7.0, 7.0, 0.5, -0.25, 9.0];
        let state = StateView {
            step: 2,
            steps: 3,
            time: 0.5,
            displacement: &[0.0; 9],
            internal_force: &force,
            external_force: &[0.0; 9],
        };
        // −e·Σf = −(2 + 0.25): the supports push the body down.
        assert_eq!(objective.value(&state), -2.25);
        let [mut displacement, mut internal_force, mut external_force] = [[0.0; 9]; 3];
        let mut derivative = StateDerivative {
            displacement: &mut displacement,
            internal_force: &mut internal_force,
            external_force: &mut external_force,
        };
        objective.derivative(&state, &mut derivative);
        assert_eq!(external_force, internal_force.map(|f| -f));
        // a load on the nodes carries part of the support force
        assert_eq!(objective.value(&StateView { external_force: &force, ..state }), 0.0);
        // A linear function is its derivative applied to its argument.
        let linear: f64 = internal_force.iter().zip(force).map(|(d, f)| d * f).sum();
        assert_eq!(linear, -2.25);
        assert_eq!(internal_force[3..6], [0.0; 3]);
        assert_eq!(displacement, [0.0; 9]);
    }

    #[test]
    fn a_direction_is_needed() {
        for direction in [[0.0; 3], [f64::NAN, 1.0, 0.0], [f64::INFINITY, 0.0, 0.0]] {
            let error = ReactionForce::new(vec![0], 1, direction, ObservedSteps::Last).unwrap_err();
            assert!(matches!(error, ObjectiveError::Direction { .. }));
        }
    }
}
