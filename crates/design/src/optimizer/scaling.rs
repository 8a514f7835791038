//! Scaling of objective and constraints.

use serde::{Deserialize, Serialize};

/// Factors for objective and constraints that make their largest derivatives 1.
///
/// MMA is not scale-invariant: it adds a curvature `raa0 = 1e-5` per range of a variable to each
/// function, and compares constraint violations with the penalty `c`. In a mesh of 1e5 elements the
/// derivatives of the volume fraction are of the order of 1e-5, as small as that curvature, and the
/// optimizer would be very slow. [`learn`](Self::learn) the factors from the gradients of the first
/// iteration, keep them (also in checkpoints), and multiply values **and** gradients.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scaling {
    /// Factor of the objective and its gradient; `None` as long as its derivatives are all zero.
    objective: Option<f64>,
    /// Factor of each constraint and its gradient, likewise.
    constraints: Vec<Option<f64>>,
}

impl Scaling {
    /// No factors yet, for `m` constraints.
    pub fn new(m: usize) -> Self {
        Self { objective: None, constraints: vec![None; m] }
    }

    /// Sets factors that are not known yet to `1/max_j |∂f/∂x_j|`, for variables with ranges of order
    /// 1, such as densities. A function whose derivatives are all zero, such as a contact pressure
    /// before there is contact, or not finite, gets its factor later.
    ///
    /// # Panics
    ///
    /// If there are not as many gradients as constraints.
    pub fn learn(&mut self, objective_gradient: &[f64], constraint_gradients: &[Vec<f64>]) {
        assert_eq!(constraint_gradients.len(), self.constraints.len(), "one gradient per constraint");
        self.objective = self.objective.or_else(|| factor(objective_gradient));
        for (known, gradient) in self.constraints.iter_mut().zip(constraint_gradients) {
            *known = known.or_else(|| factor(gradient));
        }
    }

    /// Whether factors that were read back belong to `m` constraints and are positive.
    pub fn is_valid(&self, m: usize) -> bool {
        let mut known = self.constraints.iter().chain([&self.objective]).flatten();
        self.constraints.len() == m && known.all(|factor| factor.is_finite() && *factor > 0.0)
    }

    /// Factor of the objective; 1 if it is not known.
    pub fn objective(&self) -> f64 {
        self.objective.unwrap_or(1.0)
    }

    /// Factor of each constraint; 1 for those that are not known.
    pub fn constraints(&self) -> impl Iterator<Item = f64> {
        self.constraints.iter().map(|factor| factor.unwrap_or(1.0))
    }

    /// Scaled objective and its gradient.
    pub fn scale_objective(&self, value: f64, gradient: &[f64]) -> (f64, Vec<f64>) {
        let factor = self.objective();
        (factor * value, gradient.iter().map(|derivative| factor * derivative).collect())
    }

    /// Scaled constraints and their gradients.
    ///
    /// # Panics
    ///
    /// If there are not as many constraints as factors.
    pub fn scale_constraints(&self, values: &[f64], gradients: &[Vec<f64>]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let m = self.constraints.len();
        assert!(values.len() == m && gradients.len() == m, "one factor per constraint");
        let scaled_values = self.constraints().zip(values).map(|(factor, value)| factor * value).collect();
        let scaled_gradient = |(factor, gradient): (f64, &Vec<f64>)| -> Vec<f64> {
            gradient.iter().map(|derivative| factor * derivative).collect()
        };
        (scaled_values, self.constraints().zip(gradients).map(scaled_gradient).collect())
    }
}

/// `1/max |∂f/∂x|`, if it is a number.
fn factor(gradient: &[f64]) -> Option<f64> {
    let largest = gradient.iter().fold(0.0, |largest: f64, derivative| largest.max(derivative.abs()));
    Some(1.0 / largest).filter(|factor| factor.is_finite() && *factor > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn largest_derivative_becomes_one() {
        let mut scaling = Scaling::new(3);
        scaling.learn(&[1e-3, -4e-3], &[vec![0.0, 0.5], vec![0.0, 0.0], vec![1e-320, 0.0]]);
        assert!((scaling.objective() / 250.0 - 1.0).abs() < 1e-15);
        assert_eq!(scaling.constraints().collect::<Vec<f64>>(), [2.0, 1.0, 1.0]);
        let (value, gradient) = scaling.scale_objective(2.0, &[1e-3, -4e-3]);
        assert!((value - 500.0).abs() < 1e-12 && (gradient[1] + 1.0).abs() < 1e-15);
        let (values, gradients) = scaling.scale_constraints(&[3.0, 4.0, 5.0], &[vec![0.5], vec![7.0], vec![0.0]]);
        assert_eq!(values, [6.0, 4.0, 5.0]);
        assert_eq!(gradients, [[1.0], [7.0], [0.0]]);
        // known factors stay, and the others are learned as soon as there is a gradient
        scaling.learn(&[1.0, 0.0], &[vec![0.0, 9.0], vec![4.0, 0.0], vec![0.0; 2]]);
        assert!((scaling.objective() / 250.0 - 1.0).abs() < 1e-15);
        assert_eq!(scaling.constraints().collect::<Vec<f64>>(), [2.0, 0.25, 1.0]);
    }
}
