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
    /// Of the objective and its gradient.
    objective: Factor,
    /// Of each constraint and its gradient.
    constraints: Vec<Factor>,
}

/// A factor of a function; in files a number, or `"unknown"`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
enum Factor {
    Known(f64),
    /// As long as the function's derivatives are all zero.
    Unknown(Unknown),
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Unknown {
    Unknown,
}

impl Factor {
    const UNKNOWN: Self = Self::Unknown(Unknown::Unknown);

    /// `1/max |∂f/∂x|`, if it is a number.
    fn of(gradient: &[f64]) -> Self {
        let largest = gradient.iter().fold(0.0, |largest: f64, derivative| largest.max(derivative.abs()));
        let factor = 1.0 / largest;
        if factor.is_finite() && factor > 0.0 { Self::Known(factor) } else { Self::UNKNOWN }
    }

    fn learn(&mut self, gradient: &[f64]) {
        if *self == Self::UNKNOWN {
            *self = Self::of(gradient);
        }
    }

    /// 1 if it is not known.
    fn value(self) -> f64 {
        match self {
            Self::Known(factor) => factor,
            Self::Unknown(_) => 1.0,
        }
    }
}

impl Scaling {
    /// No factors yet, for `m` constraints.
    pub fn new(m: usize) -> Self {
        Self { objective: Factor::UNKNOWN, constraints: vec![Factor::UNKNOWN; m] }
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
        self.objective.learn(objective_gradient);
        self.constraints.iter_mut().zip(constraint_gradients).for_each(|(factor, gradient)| factor.learn(gradient));
    }

    /// Whether factors that were read back belong to `m` constraints and are positive.
    pub fn is_valid(&self, m: usize) -> bool {
        let mut factors = self.constraints.iter().chain([&self.objective]).map(|factor| factor.value());
        self.constraints.len() == m && factors.all(|factor| factor.is_finite() && factor > 0.0)
    }

    /// Factor of the objective; 1 if it is not known.
    pub fn objective(&self) -> f64 {
        self.objective.value()
    }

    /// Factor of each constraint; 1 for those that are not known.
    pub fn constraints(&self) -> impl Iterator<Item = f64> {
        self.constraints.iter().map(|factor| factor.value())
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
        let text = serde_json::to_string(&scaling).unwrap();
        assert!(text.ends_with("[2.0,0.25,\"unknown\"]}"), "{text}");
        assert_eq!(serde_json::from_str::<Scaling>(&text).unwrap(), scaling);
        assert!(serde_json::from_str::<Scaling>(&text.replace("0.25", "null")).is_err());
    }
}
