//! The resultant of the contact forces of a pair, and its normal and tangential parts.

use super::{Dimension, Patch, Quantity, Reads, StateDerivative, StateView, VectorMeasure, norm};

/// How the contact forces of a patch are reduced to one number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ForcePart {
    /// A component or the norm of the resultant −Σ A_j z_j of the forces on the slave, friction
    /// included.
    Resultant(VectorMeasure),
    /// Sum of the normal forces, Σ A_j ζ_nj ≥ 0.
    Normal,
    /// Sum of the magnitudes of the friction forces, Σ A_j ‖ζ_τj‖.
    Tangential,
}

/// Contact force of a patch. \[F\]
///
/// Paper: (17), (43). Test: `pair_quantities_by_hand`.
#[derive(Clone, Debug)]
pub struct ContactResultant {
    name: String,
    patch: Patch,
    part: ForcePart,
}

impl ContactResultant {
    /// A part of the force on the slave nodes of a patch.
    pub fn new(name: impl Into<String>, patch: Patch, part: ForcePart) -> Self {
        Self { name: name.into(), patch, part }
    }

    fn resultant(&self, state: &StateView) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (_, at) in self.patch.of(state.contact) {
            (0..3).for_each(|c| sum[c] -= at.area * at.vector[c]);
        }
        sum
    }
}

impl Quantity for ContactResultant {
    fn name(&self) -> &str {
        &self.name
    }

    fn dimension(&self) -> Dimension {
        Dimension::FORCE
    }

    fn reads(&self) -> Reads {
        Reads { contact: true, ..Reads::default() }
    }

    fn needs_contact(&self) -> bool {
        true
    }

    fn value(&self, state: &StateView) -> f64 {
        let nodes = self.patch.of(state.contact).map(|(_, at)| at);
        match self.part {
            ForcePart::Resultant(measure) => measure.of(self.resultant(state)),
            ForcePart::Normal => nodes.map(|at| at.area * at.multiplier[0]).sum(),
            ForcePart::Tangential => nodes.map(|at| at.area * at.multiplier[1].hypot(at.multiplier[2])).sum(),
        }
    }

    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
        let direction = match self.part {
            ForcePart::Resultant(measure) => measure.slope(self.resultant(state)),
            ForcePart::Normal | ForcePart::Tangential => [0.0; 3],
        };
        for (j, at) in self.patch.of(state.contact) {
            let to = &mut to.contact[j];
            match self.part {
                ForcePart::Resultant(_) => {
                    for (c, e) in direction.iter().enumerate() {
                        to.vector[c] -= weight * at.area * e;
                        to.area -= weight * at.vector[c] * e;
                    }
                }
                ForcePart::Normal => {
                    to.multiplier[0] += weight * at.area;
                    to.area += weight * at.multiplier[0];
                }
                ForcePart::Tangential => {
                    let size = norm([0.0, at.multiplier[1], at.multiplier[2]]);
                    to.area += weight * size;
                    if size > 0.0 {
                        (1..3).for_each(|c| to.multiplier[c] += weight * at.area * at.multiplier[c] / size);
                    }
                }
            }
        }
    }
}
