//! The gap between the surfaces of a pair.

use std::sync::Arc;

use super::extreme::smallest;
use super::smooth::soft_minimum;
use super::{ContactNode, Dimension, Extreme, Patch, Quantity, QuantityError, Reads, StateDerivative, StateView};

/// How the nodal gaps of a patch are reduced to one number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GapMeasure {
    /// Mean over the area that faces the master, Σ g̃_j / Σ A_j.
    Mean,
    /// Smooth minimum −(h/k) ln Σ_j exp(−k g_j/h) of g_j = g̃_j/A_j, with the size h of a facet:
    /// not above the smallest gap, and closer to it the larger k is. A node counts only if at least
    /// a tenth of its area faces the master.
    Minimum {
        /// k > 0.
        k: f64,
    },
}

/// Gap at the slave nodes of a patch, positive where open. \[L\]
///
/// Test: `pair_quantities_by_hand`.
#[derive(Clone, Debug)]
pub struct Gap {
    name: String,
    patch: Patch,
    measure: GapMeasure,
}

/// Share of a node's area that must face the master for its gap to count.
const FACING: f64 = 0.1;

impl Gap {
    /// A measure of the gap of a patch.
    ///
    /// # Errors
    /// If k is not a finite number > 0.
    pub fn new(name: impl Into<String>, patch: Patch, measure: GapMeasure) -> Result<Self, QuantityError> {
        match measure {
            GapMeasure::Minimum { k } if !(k.is_finite() && k > 0.0) => Err(QuantityError::Exponent { value: k }),
            _ => Ok(Self { name: name.into(), patch, measure }),
        }
    }

    fn facing<'a>(&self, state: &StateView<'a>) -> impl Iterator<Item = (usize, &'a ContactNode)> {
        self.patch.of(state.contact).filter(|(_, at)| {
            // what is not a number stays so
            at.area > FACING * at.reference_area || at.gap.is_nan() || at.area.is_nan()
        })
    }

    /// Smooth minimum and its derivatives with respect to the gaps of the facing nodes.
    fn minimum(&self, state: &StateView, k: f64) -> (f64, Vec<f64>) {
        let (count, area) =
            self.patch.of(state.contact).fold((0.0, 0.0), |(n, sum), (_, at)| (n + 1.0, sum + at.reference_area));
        let size = (area / f64::max(count, 1.0)).sqrt();
        let relative: Vec<f64> = self.facing(state).map(|(_, at)| at.gap / at.area / size).collect();
        let (least, slopes, _) = soft_minimum(&relative, &vec![1.0; relative.len()], k);
        (size * least, slopes)
    }

    /// Σ A, Σ g̃.
    fn sums(&self, state: &StateView) -> (f64, f64) {
        self.patch.of(state.contact).fold((0.0, 0.0), |(area, gap), (_, at)| (area + at.area, gap + at.gap))
    }
}

impl Quantity for Gap {
    fn name(&self) -> &str {
        &self.name
    }

    fn dimension(&self) -> Dimension {
        Dimension::LENGTH
    }

    fn reads(&self) -> Reads {
        Reads { contact: true, ..Reads::default() }
    }

    /// Infinite if no part of the patch faces the master.
    fn depends_on_mesh(&self) -> bool {
        matches!(self.measure, GapMeasure::Minimum { .. })
    }

    fn value(&self, state: &StateView) -> f64 {
        match self.measure {
            GapMeasure::Mean => match self.sums(state) {
                (0.0, _) => f64::INFINITY,
                (area, gap) => gap / area,
            },
            GapMeasure::Minimum { k } => self.minimum(state, k).0,
        }
    }

    fn extreme(&self) -> Option<Arc<dyn Quantity>> {
        let least = |of: &Self, state: &StateView| smallest(of.facing(state).map(|(_, at)| at.gap / at.area));
        matches!(self.measure, GapMeasure::Minimum { .. }).then(|| Extreme::of(self.clone(), least))
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        match self.measure {
            GapMeasure::Mean => {
                let (area, gap) = self.sums(state);
                if area > 0.0 {
                    for (j, _) in self.patch.of(state.contact) {
                        to.contact[j].gap += weight / area;
                        to.contact[j].area -= weight * gap / (area * area);
                    }
                }
            }
            GapMeasure::Minimum { k } => {
                let (_, slopes) = self.minimum(state, k);
                for ((j, at), slope) in self.facing(state).zip(slopes) {
                    to.contact[j].gap += weight * slope / at.area;
                    to.contact[j].area -= weight * slope * at.gap / (at.area * at.area);
                }
            }
        }
    }
}
