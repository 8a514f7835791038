//! Design, objective and optimizer.

use schemars::JsonSchema;
use serde::Serialize;

use super::{BoxRegion, Dimension};
pub use slipstick_design::{MmaParameters, ObservedSteps};
pub use slipstick_solid::{EnergyInterpolation, Simp};

/// The design: one density in \[0, 1\] per element of the design bodies. Paper: section 4.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Design {
    /// The bodies to be designed; at least one.
    pub bodies: Vec<String>,
    /// Initial density, 0 < φ ≤ 1.
    pub initial: f64,
    /// Bound V on the mean density of the design bodies (87), 0 < V ≤ 1; required for an optimization.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume_fraction: Option<f64>,
    /// Stiffness as a function of density.
    pub simp: Simp,
    /// Linear elasticity for elements with very low density; `None`: finite strains everywhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy_interpolation: Option<EnergyInterpolation>,
    /// Filter of the gradient; `None`: no filter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensitivity_filter: Option<SensitivityFilter>,
    /// Elements whose centroid lies in one of these boxes keep density 1.
    pub passive_solid: Vec<BoxRegion>,
    /// Elements whose centroid lies in one of these boxes keep density 0.
    pub passive_void: Vec<BoxRegion>,
}

/// Sensitivity filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct SensitivityFilter {
    /// Radius, > 0. \[L\]
    pub radius: f64,
}

/// What is minimised.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Objective {
    /// Minus the sum of the norms of the slave nodes' contact forces, friction included. This is not their resultant:
    /// forces in different directions do not cancel. Paper: (91), (96).
    ContactForce {
        /// The load steps in which it is evaluated.
        steps: ObservedSteps,
    },
    /// Work of the loads on the displacements, f_ext · d.
    Compliance {
        /// The load steps in which it is evaluated.
        steps: ObservedSteps,
    },
}

impl Objective {
    /// Description of θ: `minus the sum of the magnitudes of the nodal contact forces, …, at the last load step`.
    pub fn about(&self) -> String {
        let (what, steps) = match self {
            Self::ContactForce { steps } => (
                "minus the sum of the magnitudes of the nodal contact forces, friction included (not their resultant)",
                steps,
            ),
            Self::Compliance { steps } => ("the work of the loads on the displacements", steps),
        };
        format!("{what}, {steps}")
    }

    /// The dimension of θ.
    pub fn dimension(&self) -> Dimension {
        match self {
            Self::ContactForce { .. } => Dimension::FORCE,
            Self::Compliance { .. } => Dimension::WORK,
        }
    }

    /// The dimension of θ as text, if units have no names.
    pub fn unit(&self) -> &'static str {
        match self {
            Self::ContactForce { .. } => "F",
            Self::Compliance { .. } => "F L",
        }
    }
}

/// The optimizer and when it stops.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Optimizer {
    /// Parameters of the method of moving asymptotes.
    pub mma: MmaParameters,
    /// Maximum number of iterations.
    pub iterations: usize,
    /// The optimizer stops when no density changes by more than this in an iteration; `None`: it runs all iterations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
}
