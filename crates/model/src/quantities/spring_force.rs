//! The force of springs.

use slipstick_design::VectorMeasure;
use slipstick_design::quantity::{Dimension, Quantity, StateDerivative, StateView};
use slipstick_solid::spring::Spring;

/// A component or the norm of the resultant force that springs exert on the nodes at their first ends. \[F\]
///
/// Test: `the_force_of_springs_by_hand`.
#[derive(Debug, Clone)]
pub struct SpringForce {
    name: String,
    springs: Vec<Spring>,
    measure: VectorMeasure,
}

impl SpringForce {
    /// The resultant of these springs.
    pub fn new(name: impl Into<String>, springs: Vec<Spring>, measure: VectorMeasure) -> Self {
        Self { name: name.into(), springs, measure }
    }

    fn resultant(&self, d: &[f64]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for spring in &self.springs {
            sum.iter_mut().zip(spring.force(d)).for_each(|(sum, force)| *sum -= force);
        }
        sum
    }
}

impl Quantity for SpringForce {
    fn name(&self) -> &str {
        &self.name
    }

    fn dimension(&self) -> Dimension {
        Dimension::FORCE
    }

    fn value(&self, state: &StateView) -> f64 {
        self.measure.of(self.resultant(state.displacement))
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        let slope = self.measure.slope(self.resultant(state.displacement));
        for spring in &self.springs {
            let by_force = spring.slope(state.displacement);
            let along = |b: usize| -> f64 { (0..3).map(|a| slope[a] * by_force[3 * a + b]).sum() };
            spring.add(std::array::from_fn(|b| -weight * along(b)), &mut to.displacement);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_design::quantity::check_derivatives;
    use slipstick_solid::spring::Acts;

    /// Springs of stiffness 2 and 3 along x and y, and one of length 3 that is turned and stretched to 5.
    #[test]
    fn the_force_of_springs_by_hand() {
        let springs = vec![
            Spring { node: 0, to: None, stiffness: 2.0, acts: Acts::Along([1.0, 0.0, 0.0]) },
            Spring { node: 0, to: Some(1), stiffness: 3.0, acts: Acts::Along([0.0, 1.0, 0.0]) },
            Spring { node: 0, to: Some(1), stiffness: 1.0, acts: Acts::Line([3.0, 0.0, 0.0]) },
        ];
        let displacement = [-3.0, 5.0, 0.0, 0.0, 0.0, 0.0];
        let state = StateView { step: 1, steps: 1, time: 1.0, displacement: &displacement, ..StateView::default() };
        let along = |n| SpringForce::new("force", springs.clone(), VectorMeasure::along(n).unwrap());
        assert_eq!(along([1.0, 0.0, 0.0]).value(&state), 6.0);
        assert_eq!(along([0.0, 1.0, 0.0]).value(&state), -17.0);
        for measure in [VectorMeasure::along([1.0, -2.0, 0.5]).unwrap(), VectorMeasure::Norm] {
            check_derivatives(&SpringForce::new("force", springs.clone(), measure), &state).unwrap();
        }
    }
}
