//! Scaling of objective and constraints.

use serde::{Deserialize, Serialize};

/// Factors for objective and constraints that make their largest derivatives 1.
///
/// MMA is not scale-invariant: it adds a curvature `raa0 = 1e-5` per range of a variable to each
/// function, and compares constraint violations with the penalty `c`. In a mesh of 1e5 elements the
/// derivatives of the volume fraction are of the order of 1e-5, as small as that curvature, and the
/// optimizer would be very slow. Compute the factors in the first iteration, keep them (also in
/// checkpoints), and multiply values **and** gradients.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scaling {
    /// Factor of the objective and its gradient.
    pub objective: f64,
    /// Factor of each constraint and its gradient.
    pub constraints: Vec<f64>,
}

impl Scaling {
    /// Factors `1/max_j |∂f/∂x_j|` from the gradients of the first iteration, for variables with
    /// ranges of order 1, such as densities. A function whose derivatives are all zero, or not
    /// finite, gets the factor 1.
    pub fn from_first(objective_gradient: &[f64], constraint_gradients: &[Vec<f64>]) -> Self {
        let constraints = constraint_gradients.iter().map(|gradient| factor(gradient)).collect();
        Self { objective: factor(objective_gradient), constraints }
    }

    /// No scaling, for `m` constraints.
    pub fn none(m: usize) -> Self {
        Self { objective: 1.0, constraints: vec![1.0; m] }
    }

    /// Scaled objective and its gradient.
    pub fn scale_objective(&self, value: f64, gradient: &[f64]) -> (f64, Vec<f64>) {
        (self.objective * value, gradient.iter().map(|derivative| self.objective * derivative).collect())
    }

    /// Scaled constraints and their gradients.
    ///
    /// # Panics
    ///
    /// If there are not as many constraints as factors.
    pub fn scale_constraints(&self, values: &[f64], gradients: &[Vec<f64>]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let m = self.constraints.len();
        assert!(values.len() == m && gradients.len() == m, "one factor per constraint");
        let scaled_values = self.constraints.iter().zip(values).map(|(factor, value)| factor * value).collect();
        let scaled_gradient = |(factor, gradient): (&f64, &Vec<f64>)| -> Vec<f64> {
            gradient.iter().map(|derivative| factor * derivative).collect()
        };
        (scaled_values, self.constraints.iter().zip(gradients).map(scaled_gradient).collect())
    }
}

fn factor(gradient: &[f64]) -> f64 {
    let largest = gradient.iter().fold(0.0, |largest: f64, derivative| largest.max(derivative.abs()));
    let factor = 1.0 / largest;
    if factor.is_finite() && factor > 0.0 { factor } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn largest_derivative_becomes_one() {
        let scaling = Scaling::from_first(&[1e-3, -4e-3], &[vec![0.0, 0.5], vec![0.0, 0.0], vec![1e-320, 0.0]]);
        assert!((scaling.objective / 250.0 - 1.0).abs() < 1e-15);
        assert_eq!(scaling.constraints, [2.0, 1.0, 1.0]);
        let (value, gradient) = scaling.scale_objective(2.0, &[1e-3, -4e-3]);
        assert!((value - 500.0).abs() < 1e-12 && (gradient[1] + 1.0).abs() < 1e-15);
        let (values, gradients) = scaling.scale_constraints(&[3.0, 4.0, 5.0], &[vec![0.5], vec![7.0], vec![0.0]]);
        assert_eq!(values, [6.0, 4.0, 5.0]);
        assert_eq!(gradients, [[1.0], [7.0], [0.0]]);
        assert_eq!(Scaling::none(2), Scaling { objective: 1.0, constraints: vec![1.0; 2] });
    }
}
