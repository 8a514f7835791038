//! Contact pressure of a pair.

use std::sync::Arc;

use super::extreme::{largest, smallest};
use super::smooth::{p_norm, soft_minimum};
use super::{ContactNode, Dimension, Extreme, Patch, Quantity, QuantityError, Reads, StateDerivative, StateView};

/// How the nodal pressures of a patch are reduced to one number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PressureMeasure {
    /// p-norm of the nodal pressures, (Σ_j max(ζ_nj, 0)^p)^(1/p): not below the largest pressure,
    /// and closer to it the larger p is.
    Peak {
        /// p ≥ 1.
        p: f64,
    },
    /// Mean over the area that faces the master, Σ A_j ζ_nj / Σ A_j.
    Mean,
    /// Standard deviation over that area divided by the mean: 0 for uniform pressure.
    Spread,
    /// Smooth minimum −(m/k) ln Σ_j a_j exp(−k ζ_nj/m) with the mean m and a_j = A_j/Σ A_i: between
    /// the smallest pressure and the mean, and closer to the smallest the larger k is.
    Minimum {
        /// k > 0.
        k: f64,
    },
}

/// Pressure ζ_nj at the slave nodes of a patch, with nodal weights A_j. \[F/L²\]
///
/// Test: `pair_quantities_by_hand`.
#[derive(Clone, Debug)]
pub struct ContactPressure {
    name: String,
    patch: Patch,
    measure: PressureMeasure,
}

impl ContactPressure {
    /// A measure of the pressure on a patch.
    ///
    /// # Errors
    /// If p is not a finite number ≥ 1, or k not a finite number > 0.
    pub fn new(name: impl Into<String>, patch: Patch, measure: PressureMeasure) -> Result<Self, QuantityError> {
        match measure {
            PressureMeasure::Peak { p } if !(p.is_finite() && p >= 1.0) => Err(QuantityError::Exponent { value: p }),
            PressureMeasure::Minimum { k } if !(k.is_finite() && k > 0.0) => Err(QuantityError::Exponent { value: k }),
            _ => Ok(Self { name: name.into(), patch, measure }),
        }
    }

    /// The largest nodal pressure, or the smallest of all nodes with an area.
    fn extreme_pressure(&self, state: &StateView) -> f64 {
        let nodes = || self.patch.of(state.contact).map(|(_, at)| at);
        match self.measure {
            PressureMeasure::Minimum { .. } if nodes().any(|at| at.area != 0.0) => {
                smallest(nodes().filter(|at| at.area != 0.0).map(ContactNode::pressure))
            }
            PressureMeasure::Minimum { .. } => 0.0,
            _ => largest(nodes().map(ContactNode::pressure)),
        }
    }

    /// Value, and its derivatives with respect to pressures and areas, node by node of the patch.
    fn evaluate(&self, state: &StateView) -> (f64, Vec<f64>, Vec<f64>) {
        let (pressure, area): (Vec<f64>, Vec<f64>) =
            self.patch.of(state.contact).map(|(_, at)| (at.pressure(), at.area)).unzip();
        let none = vec![0.0; area.len()];
        let whole: f64 = area.iter().sum();
        let force: f64 = area.iter().zip(&pressure).map(|(a, p)| a * p).sum();
        // no area, no pressure; areas that are not numbers stay so
        let mean = if whole == 0.0 { 0.0 } else { force / whole };
        // ∂m/∂ζ_j = A_j/ΣA, ∂m/∂A_j = (ζ_j − m)/ΣA
        let by_area = || -> Vec<f64> { pressure.iter().map(|p| (p - mean) / whole).collect() };
        let by_pressure = || -> Vec<f64> { area.iter().map(|a| a / whole).collect() };
        match self.measure {
            PressureMeasure::Peak { p } => {
                let (value, slopes) = p_norm(&pressure, p);
                (value, slopes, none)
            }
            PressureMeasure::Mean if whole != 0.0 => (mean, by_pressure(), by_area()),
            PressureMeasure::Spread if mean != 0.0 => {
                let moment = |power| area.iter().zip(&pressure).map(|(a, p)| a * (p - mean).powi(power)).sum::<f64>();
                let variance = moment(2) / whole;
                let deviation = variance.sqrt();
                if deviation == 0.0 {
                    return (0.0, none.clone(), none);
                }
                // s = √v/m with ∂v/∂ζ_j = 2 A_j (ζ_j − m)/ΣA, ∂v/∂A_j = ((ζ_j − m)² − v)/ΣA
                let (by_variance, by_mean) = (0.5 / (deviation * mean), -deviation / (mean * mean));
                let slopes = area.iter().zip(&pressure).map(|(a, p)| {
                    let off = p - mean;
                    let along = by_variance * 2.0 * a * off / whole + by_mean * a / whole;
                    (along, by_variance * (off * off - variance) / whole + by_mean * off / whole)
                });
                let (by_pressure, by_area) = slopes.unzip();
                (deviation / mean, by_pressure, by_area)
            }
            PressureMeasure::Minimum { k } if mean != 0.0 => {
                let relative: Vec<f64> = pressure.iter().map(|p| p / mean).collect();
                let shares = by_pressure();
                let (least, slopes, by_share) = soft_minimum(&relative, &shares, k);
                // f = m g(ζ/m, a): ∂f/∂ζ_j = g_j + (g − Σ g_i ζ_i/m) ∂m/∂ζ_j
                let by_mean = least - slopes.iter().zip(&relative).map(|(g, x)| g * x).sum::<f64>();
                let of_pressure = slopes.iter().zip(&shares).map(|(g, m)| g + by_mean * m).collect();
                // ∂a_i/∂A_j = (δ_ij − a_i)/ΣA
                let whole_share: f64 = by_share.iter().zip(&shares).map(|(by, share)| by * share).sum();
                let of_area = by_share.iter().zip(by_area());
                let of_area = of_area.map(|(by, m)| mean * (by - whole_share) / whole + by_mean * m).collect();
                (mean * least, of_pressure, of_area)
            }
            // no pressure; a mean that is not a number stays so
            PressureMeasure::Mean | PressureMeasure::Spread | PressureMeasure::Minimum { .. } => {
                (mean, none.clone(), none)
            }
        }
    }
}

impl Quantity for ContactPressure {
    fn name(&self) -> &str {
        &self.name
    }

    fn dimension(&self) -> Dimension {
        if self.measure == PressureMeasure::Spread { Dimension::NONE } else { Dimension::STRESS }
    }

    fn reads(&self) -> Reads {
        Reads { contact: true, ..Reads::default() }
    }

    fn needs_contact(&self) -> bool {
        true
    }

    fn value(&self, state: &StateView) -> f64 {
        self.evaluate(state).0
    }

    fn extreme(&self) -> Option<Arc<dyn Quantity>> {
        let smooth = matches!(self.measure, PressureMeasure::Peak { .. } | PressureMeasure::Minimum { .. });
        smooth.then(|| Extreme::of(self.clone(), Self::extreme_pressure))
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        let (_, by_pressure, by_area) = self.evaluate(state);
        for ((j, at), (p, a)) in self.patch.of(state.contact).zip(by_pressure.iter().zip(by_area)) {
            if at.status != 0 {
                to.contact[j].multiplier[0] += weight * p;
            }
            to.contact[j].area += weight * a;
        }
    }
}
