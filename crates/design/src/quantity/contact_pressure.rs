//! Contact pressure of a pair.

use std::sync::Arc;

use super::extreme::{largest, smallest};
use super::smooth::{p_norm, soft_minimum};
use super::{ContactNode, Dimension, Extreme, Patch, Quantity, QuantityError, Reads, StateDerivative, StateView};

/// How the nodal pressures of a patch are reduced to one number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PressureMeasure {
    /// p-norm of the nodal pressures, (Σ_j max(ζ_nj, 0)^p)^(1/p): an upper bound of the largest
    /// pressure that becomes tight as p grows.
    Peak {
        /// p ≥ 1.
        p: f64,
    },
    /// Mean over the area that faces the master, Σ A_j ζ_nj / Σ A_j.
    Mean,
    /// Standard deviation over that area divided by the mean: 0 for uniform pressure.
    Spread,
    /// Smooth minimum −(m/k) ln Σ_j a_j exp(−k x_j) with the mean m and a_j = A_j/Σ A_i: between the
    /// smallest m x_j and the mean, and closer to the smallest the larger k is. x_j is ζ_nj/m where
    /// the surfaces touch; at open nodes, which have no pressure, −ln(1 + E g_j/(h m)) with the gap g_j =
    /// g̃_j/A_j and the size h of a facet: near contact, m x_j is then minus the pressure that would
    /// close the gap. So a bound or an objective also closes gaps.
    Minimum {
        /// k > 0.
        k: f64,
        /// Young's modulus E of the softer body, > 0. \[F/L²\]
        modulus: f64,
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

/// Derivatives with respect to ζ_nj, A_j and g̃_j of a node.
#[derive(Clone, Copy, Default)]
struct NodeSlopes {
    pressure: f64,
    area: f64,
    gap: f64,
}

impl ContactPressure {
    /// A measure of the pressure on a patch.
    ///
    /// # Errors
    /// If p is not a finite number ≥ 1, or k or E not a finite number > 0.
    pub fn new(name: impl Into<String>, patch: Patch, measure: PressureMeasure) -> Result<Self, QuantityError> {
        match measure {
            PressureMeasure::Peak { p } if !(p.is_finite() && p >= 1.0) => Err(QuantityError::Exponent { value: p }),
            PressureMeasure::Minimum { k, .. } if !(k.is_finite() && k > 0.0) => {
                Err(QuantityError::Exponent { value: k })
            }
            PressureMeasure::Minimum { modulus, .. } if !(modulus.is_finite() && modulus > 0.0) => {
                Err(QuantityError::Modulus { value: modulus })
            }
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

    /// Smooth minimum, and its derivatives.
    fn minimum(
        &self,
        state: &StateView,
        (k, modulus): (f64, f64),
        (mean, whole): (f64, f64),
    ) -> (f64, Vec<NodeSlopes>) {
        let nodes = || self.patch.of(state.contact).map(|(_, at)| at);
        let (count, area) = nodes().fold((0.0, 0.0), |(n, sum), at| (n + 1.0, sum + at.reference_area));
        let stiffness = modulus / (area / f64::max(count, 1.0)).sqrt();
        // s_j = E g_j/(h m) of open nodes, of which x_j = −ln(1 + s_j)
        let open = |at: &ContactNode| {
            (!at.status.is_closed() && at.area != 0.0).then(|| stiffness * (at.gap / at.area).max(0.0) / mean)
        };
        let relative: Vec<f64> = nodes().map(|at| open(at).map_or(at.pressure() / mean, |s| -s.ln_1p())).collect();
        let shares: Vec<f64> = nodes().map(|at| at.area / whole).collect();
        let (least, by_x, by_share) = soft_minimum(&relative, &shares, k);
        // f = m g(x, a): ∂f/∂ζ_j = g_j + (g + m Σ g_i ∂x_i/∂m) ∂m/∂ζ_j
        let along = |(at, x): (&ContactNode, &f64)| open(at).map_or(-x, |s| s / (1.0 + s));
        let by_mean = least + nodes().zip(&relative).map(along).zip(&by_x).map(|(x, g)| g * x).sum::<f64>();
        // ∂a_i/∂A_j = (δ_ij − a_i)/ΣA
        let whole_share: f64 = by_share.iter().zip(&shares).map(|(by, share)| by * share).sum();
        let of = |(j, at): (usize, &ContactNode)| {
            // ∂m/∂ζ_j = a_j, ∂m/∂A_j = (ζ_j − m)/ΣA
            let by_area = mean * (by_share[j] - whole_share) / whole + by_mean * (at.pressure() - mean) / whole;
            match open(at).filter(|s| *s > 0.0) {
                Some(s) => {
                    let by_gap = -by_x[j] * stiffness / (1.0 + s) / at.area;
                    NodeSlopes { pressure: 0.0, area: by_area - by_gap * at.gap / at.area, gap: by_gap }
                }
                None => NodeSlopes { pressure: by_x[j] + by_mean * shares[j], area: by_area, gap: 0.0 },
            }
        };
        (mean * least, nodes().enumerate().map(of).collect())
    }

    /// Value, and its derivatives, node by node of the patch.
    fn evaluate(&self, state: &StateView) -> (f64, Vec<NodeSlopes>) {
        let (pressure, area): (Vec<f64>, Vec<f64>) =
            self.patch.of(state.contact).map(|(_, at)| (at.pressure(), at.area)).unzip();
        let whole: f64 = area.iter().sum();
        let force: f64 = area.iter().zip(&pressure).map(|(a, p)| a * p).sum();
        // zero area gives zero pressure; NaN areas propagate
        let mean = if whole == 0.0 { 0.0 } else { force / whole };
        let none = vec![NodeSlopes::default(); area.len()];
        let each = |slopes: &dyn Fn(f64, f64) -> (f64, f64)| -> Vec<NodeSlopes> {
            let of = |(&a, &p): (&f64, &f64)| slopes(a, p);
            area.iter().zip(&pressure).map(of).map(|(pressure, area)| NodeSlopes { pressure, area, gap: 0.0 }).collect()
        };
        match self.measure {
            PressureMeasure::Peak { p } => {
                let (value, slopes) = p_norm(&pressure, p);
                (value, slopes.into_iter().map(|pressure| NodeSlopes { pressure, ..NodeSlopes::default() }).collect())
            }
            // ∂m/∂ζ_j = A_j/ΣA, ∂m/∂A_j = (ζ_j − m)/ΣA
            PressureMeasure::Mean if whole != 0.0 => (mean, each(&|a, p| (a / whole, (p - mean) / whole))),
            PressureMeasure::Spread if mean != 0.0 => {
                let moment = |power| area.iter().zip(&pressure).map(|(a, p)| a * (p - mean).powi(power)).sum::<f64>();
                let variance = moment(2) / whole;
                let deviation = variance.sqrt();
                if deviation == 0.0 {
                    return (0.0, none);
                }
                // s = √v/m with ∂v/∂ζ_j = 2 A_j (ζ_j − m)/ΣA, ∂v/∂A_j = ((ζ_j − m)² − v)/ΣA
                let (by_variance, by_mean) = (0.5 / (deviation * mean), -deviation / (mean * mean));
                let slopes = each(&|a, p| {
                    let off = p - mean;
                    let along = by_variance * 2.0 * a * off / whole + by_mean * a / whole;
                    (along, by_variance * (off * off - variance) / whole + by_mean * off / whole)
                });
                (deviation / mean, slopes)
            }
            PressureMeasure::Minimum { k, modulus } if mean != 0.0 => self.minimum(state, (k, modulus), (mean, whole)),
            // zero pressure; a NaN mean propagates
            PressureMeasure::Mean | PressureMeasure::Spread | PressureMeasure::Minimum { .. } => (mean, none),
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

    fn depends_on_mesh(&self) -> bool {
        matches!(self.measure, PressureMeasure::Minimum { .. })
    }

    fn value(&self, state: &StateView) -> f64 {
        self.evaluate(state).0
    }

    fn extreme(&self) -> Option<Arc<dyn Quantity>> {
        let smooth = matches!(self.measure, PressureMeasure::Peak { .. } | PressureMeasure::Minimum { .. });
        smooth.then(|| Extreme::of(self.clone(), Self::extreme_pressure))
    }

    fn combines_pressures_of(&self) -> Option<&Patch> {
        matches!(self.measure, PressureMeasure::Peak { .. } | PressureMeasure::Minimum { .. }).then_some(&self.patch)
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        for ((j, at), slopes) in self.patch.of(state.contact).zip(self.evaluate(state).1) {
            if at.status.is_closed() {
                to.contact[j].multiplier[0] += weight * slopes.pressure;
            }
            to.contact[j].area += weight * slopes.area;
            to.contact[j].gap += weight * slopes.gap;
        }
    }
}
