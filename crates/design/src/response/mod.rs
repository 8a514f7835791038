//! An objective over several load cases.

use super::{Measure, Objective, StateDerivative, StateView};

/// The weighted sum of an objective over load cases: `θ = Σ_k w_k θ_k`, where the load steps of all cases are
/// consecutive.
///
/// The inner objective receives the steps of each case counted from 1; pseudo-time is that of the whole sequence.
pub struct Weighted {
    objective: Box<dyn Objective>,
    weights: Vec<f64>,
}

impl Weighted {
    /// `weights`: one for each load case.
    pub fn new(objective: Box<dyn Objective>, weights: Vec<f64>) -> Self {
        Self { objective, weights }
    }

    /// Number of the load case, the step within it, and its number of steps.
    fn place(&self, step: usize, steps: usize) -> (usize, usize, usize) {
        let each = (steps / self.weights.len()).max(1);
        let case = ((step - 1) / each).min(self.weights.len() - 1);
        (case, step - case * each, each)
    }

    fn within<'a>(&self, state: &StateView<'a>) -> (f64, StateView<'a>) {
        let (case, step, steps) = self.place(state.step, state.steps);
        (self.weights[case], StateView { step, steps, ..*state })
    }
}

impl Objective for Weighted {
    fn name(&self) -> &str {
        self.objective.name()
    }

    fn measure(&self) -> Measure {
        self.objective.measure()
    }

    fn observes(&self, step: usize, steps: usize) -> bool {
        let (_, step, steps) = self.place(step, steps);
        self.objective.observes(step, steps)
    }

    fn value(&self, state: &StateView) -> f64 {
        let (weight, state) = self.within(state);
        weight * self.objective.value(&state)
    }

    fn derivative(&self, state: &StateView, derivative: &mut StateDerivative) {
        let (weight, state) = self.within(state);
        let zeros = || vec![0.0; state.displacement.len()];
        let [mut displacement, mut internal_force, mut external_force] = [zeros(), zeros(), zeros()];
        self.objective.derivative(
            &state,
            &mut StateDerivative {
                displacement: &mut displacement,
                internal_force: &mut internal_force,
                external_force: &mut external_force,
            },
        );
        let add = |to: &mut [f64], from: &[f64]| to.iter_mut().zip(from).for_each(|(to, from)| *to += weight * from);
        add(derivative.displacement, &displacement);
        add(derivative.internal_force, &internal_force);
        add(derivative.external_force, &external_force);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ObservedSteps, ReactionForce, check_derivatives};

    const D: [f64; 6] = [1e-3, -2e-3, 5e-4, 0.0, 1e-3, -1e-4];
    const F: [f64; 6] = [30.0, -20.0, 7.0, 1.0, 11.0, -4.0];

    /// Three cases of four steps, of which the last and the second are observed: weights computed by hand, derivatives
    /// by differences.
    #[test]
    fn weights_and_steps_of_each_case() {
        let reaction = || ReactionForce::new(vec![1], 2, [0.0, -1.0, 0.0], ObservedSteps::Only(vec![2, 4])).unwrap();
        let weighted = Weighted::new(Box::new(reaction()), vec![1.0, 0.25, 2.0]);
        let observed: Vec<usize> = (1..=12).filter(|&step| weighted.observes(step, 12)).collect();
        assert_eq!(observed, [2, 4, 6, 8, 10, 12]);
        for (step, weight) in [(2, 1.0), (4, 1.0), (6, 0.25), (8, 0.25), (10, 2.0), (12, 2.0)] {
            let state = StateView {
                step,
                steps: 12,
                time: 0.3,
                displacement: &D,
                internal_force: &F,
                external_force: &[0.0; 6],
            };
            assert_eq!(weighted.value(&state), weight * 11.0);
            check_derivatives(&weighted, &state).unwrap();
        }
    }
}
