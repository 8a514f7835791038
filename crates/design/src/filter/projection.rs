//! Smooth threshold projection.

use super::FilterError;
use crate::map::{DesignMap, MapParameter};
use std::sync::Arc;

/// Pushes densities to 0 or 1:
/// `φ = (tanh βη + tanh β(x − η)) / (tanh βη + tanh β(1 − η))`, sharpness `β > 0`, threshold
/// `η ∈ [0, 1]`.
///
/// It preserves 0 and 1, increases strictly, and tends to the identity as `β → 0` and to a step at
/// `η` as `β → ∞`.
///
/// Source: Wang, Lazarov, Sigmund, Struct. Multidiscip. Optim. 43 (2011) 767–784.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    sharpness: f64,
    threshold: f64,
}

impl Projection {
    /// `sharpness` β in (0, ∞), `threshold` η in [0, 1].
    ///
    /// # Errors
    ///
    /// A parameter outside its range.
    pub fn new(sharpness: f64, threshold: f64) -> Result<Self, FilterError> {
        if !(sharpness.is_finite() && sharpness > 0.0) {
            return Err(FilterError::Projection { name: "sharpness", value: sharpness, range: "(0, ∞)" });
        }
        if !(0.0..=1.0).contains(&threshold) {
            return Err(FilterError::Projection { name: "threshold", value: threshold, range: "[0, 1]" });
        }
        Ok(Self { sharpness, threshold })
    }

    /// Sharpness β.
    pub fn sharpness(&self) -> f64 {
        self.sharpness
    }

    /// Threshold η.
    pub fn threshold(&self) -> f64 {
        self.threshold
    }

    fn range(&self) -> f64 {
        let Self { sharpness, threshold } = *self;
        (sharpness * threshold).tanh() + (sharpness * (1.0 - threshold)).tanh()
    }
}

impl DesignMap for Projection {
    fn apply(&self, x: &[f64]) -> Vec<f64> {
        let Self { sharpness, threshold } = *self;
        let (low, range) = ((sharpness * threshold).tanh(), self.range());
        x.iter().map(|x| (low + (sharpness * (x - threshold)).tanh()) / range).collect()
    }

    fn pull_back(&self, x: &[f64], d_phi: &[f64]) -> Vec<f64> {
        assert_eq!(x.len(), d_phi.len(), "one derivative per density");
        let Self { sharpness, threshold } = *self;
        let range = self.range();
        // 1/cosh² is accurate where 1 − tanh² suffers from cancellation
        let slope = |x: f64| sharpness / ((sharpness * (x - threshold)).cosh().powi(2) * range);
        x.iter().zip(d_phi).map(|(&x, d)| d * slope(x)).collect()
    }

    fn parameter(&self, which: MapParameter) -> Option<f64> {
        match which {
            MapParameter::Sharpness => Some(self.sharpness),
            MapParameter::Threshold => Some(self.threshold),
            MapParameter::Radius => None,
        }
    }

    fn with(&self, which: MapParameter, value: f64) -> Result<Option<Arc<dyn DesignMap>>, FilterError> {
        let other = match which {
            MapParameter::Sharpness => Self::new(value, self.threshold)?,
            MapParameter::Threshold => Self::new(self.sharpness, value)?,
            MapParameter::Radius => return Ok(None),
        };
        Ok(Some(Arc::new(other)))
    }

    /// The x in \[0, 1\] that is projected to `density`, for a density in \[0, 1\].
    fn inverse(&self, density: f64) -> f64 {
        if density <= 0.0 || density >= 1.0 {
            return density.clamp(0.0, 1.0);
        }
        let Self { sharpness, threshold } = *self;
        let tanh = (density * self.range() - (sharpness * threshold).tanh()).clamp(-1.0, 1.0);
        (threshold + tanh.atanh() / sharpness).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_stay_and_limits_hold() {
        for sharpness in [1e-6, 1.0, 8.0, 512.0] {
            for threshold in [0.0, 0.3, 1.0] {
                let ends = Projection::new(sharpness, threshold).unwrap().apply(&[0.0, 1.0]);
                assert!(ends[0].abs() < 1e-15 && (ends[1] - 1.0).abs() < 1e-15);
            }
        }
        let flat = Projection::new(1e-5, 0.5).unwrap().apply(&[0.3]);
        assert!((flat[0] - 0.3).abs() < 1e-10);
        let step = Projection::new(1e4, 0.5).unwrap().apply(&[0.49, 0.51]);
        assert!(step[0] < 1e-12 && step[1] > 1.0 - 1e-12);
        // A threshold in the middle preserves it: φ(½) = ½.
        assert!((Projection::new(7.0, 0.5).unwrap().apply(&[0.5])[0] - 0.5).abs() < 1e-15);
    }

    #[test]
    fn slope_agrees_with_central_differences() {
        let projection = Projection::new(8.0, 0.4).unwrap();
        for x in [0.01, 0.25, 0.4, 0.77, 0.99] {
            let step = 1e-6;
            let values = projection.apply(&[x - step, x + step]);
            let difference = (values[1] - values[0]) / (2.0 * step);
            assert!((projection.pull_back(&[x], &[3.0])[0] - 3.0 * difference).abs() < 1e-8);
        }
        // Far from a sharp threshold the slope is zero, not NaN.
        assert_eq!(Projection::new(1e4, 0.5).unwrap().pull_back(&[0.9], &[1.0]), [0.0]);
    }

    #[test]
    fn inverse_undoes_the_projection() {
        for sharpness in [1e-3, 1.0, 8.0, 64.0] {
            for threshold in [0.0, 0.3, 0.5, 1.0] {
                let projection = Projection::new(sharpness, threshold).unwrap();
                for density in [0.0, 0.1, 0.4, 0.95, 1.0] {
                    let x = projection.inverse(density);
                    assert!((0.0..=1.0).contains(&x));
                    assert!((projection.apply(&[x])[0] - density).abs() < 1e-12, "{sharpness} {threshold} {density}");
                }
            }
        }
    }

    #[test]
    fn parameters_are_checked() {
        for (sharpness, threshold) in [(0.0, 0.5), (f64::NAN, 0.5), (1.0, -0.1), (1.0, f64::NAN)] {
            assert!(matches!(Projection::new(sharpness, threshold), Err(FilterError::Projection { .. })));
        }
    }
}
