//! Design, objective and optimizer.

use std::fmt;

use schemars::JsonSchema;
use serde::Serialize;

use super::{BoxRegion, Dimension};

/// The design: a density in \[0, 1\] per element of the design bodies. Paper: section 4.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Design {
    /// Bodies whose elements are designed; at least one.
    pub bodies: Vec<String>,
    /// Density at the start, 0 < φ ≤ 1.
    pub initial: f64,
    /// Bound V on the mean density of the design bodies (87), 0 < V ≤ 1; an optimization needs it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume_fraction: Option<f64>,
    /// Stiffness as a function of density.
    pub simp: Simp,
    /// Linear elasticity where there is hardly any material, `None`: finite strains everywhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy_interpolation: Option<EnergyInterpolation>,
    /// Filter of the gradient, `None`: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensitivity_filter: Option<SensitivityFilter>,
    /// Elements whose centroid lies in one of these boxes keep density 1.
    pub passive_solid: Vec<BoxRegion>,
    /// Elements whose centroid lies in one of these boxes keep density 0.
    pub passive_void: Vec<BoxRegion>,
}

/// Modified SIMP interpolation. Paper: (86).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Simp {
    /// Penalization power p ≥ 1.
    pub p: f64,
    /// φ_min: the void's stiffness over the solid's, 0 ≤ φ_min < 1.
    pub min: f64,
}

/// Energy interpolation: elements with φ^p below the threshold follow linear elasticity, which cannot invert.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct EnergyInterpolation {
    /// Threshold of φ^p, between 0 and 1.
    pub threshold: f64,
    /// Sharpness of the threshold, > 0.
    pub sharpness: f64,
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
    /// Minus the sum of the norms of the slave nodes' contact forces, friction included. Not their resultant: forces in
    /// different directions do not cancel. Paper: (91), (96).
    ContactForce {
        /// The load steps that count.
        steps: ObservedSteps,
    },
    /// Work of the loads on the displacements, f_ext · d.
    Compliance {
        /// The load steps that count.
        steps: ObservedSteps,
    },
}

impl Objective {
    /// What θ is, in words for people: `minus the sum of the magnitudes of the nodal contact forces, …, at the last load step`.
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

    /// What θ is measured in.
    pub fn dimension(&self) -> Dimension {
        match self {
            Self::ContactForce { .. } => Dimension::FORCE,
            Self::Compliance { .. } => Dimension::WORK,
        }
    }

    /// The same where units have no names.
    pub fn unit(&self) -> &'static str {
        match self {
            Self::ContactForce { .. } => "F",
            Self::Compliance { .. } => "F L",
        }
    }
}

/// Load steps that an objective looks at, within each load case.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ObservedSteps {
    /// The last one.
    Last,
    /// All.
    All,
    /// These, 1 … N, ascending and unique.
    #[serde(untagged)]
    Only(Vec<usize>),
}

impl fmt::Display for ObservedSteps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Last => f.write_str("at the last load step"),
            Self::All => f.write_str("over all load steps"),
            Self::Only(steps) => {
                let steps: Vec<String> = steps.iter().map(usize::to_string).collect();
                write!(f, "at load step{} {}", if steps.len() == 1 { "" } else { "s" }, steps.join(", "))
            }
        }
    }
}

/// The optimizer and when it stops.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Optimizer {
    /// Parameters of the method of moving asymptotes.
    pub mma: Mma,
    /// Most iterations.
    pub iterations: usize,
    /// Stops when no density changes by more than this in an iteration; `None`: runs all iterations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
}

/// Parameters of the method of moving asymptotes, version of 2007, named as in Svanberg's notes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Mma {
    /// Most that a density may change in an iteration (the paper's 0.1).
    pub move_limit: f64,
    /// Distance of the first asymptotes over the range of the variable.
    pub asyinit: f64,
    /// Factor on that distance where the variable goes on in its direction, ≥ 1.
    pub asyincr: f64,
    /// Factor where it turns back, < 1.
    pub asydecr: f64,
    /// Smallest distance of an asymptote over the range.
    pub asymin: f64,
    /// Largest distance of an asymptote over the range.
    pub asymax: f64,
    /// How near to an asymptote a variable may come.
    pub albefa: f64,
    /// Least curvature of the approximations.
    pub raa0: f64,
    /// Price of violating a constraint.
    pub c: f64,
}

impl Default for Mma {
    /// Svanberg's values with the paper's move limit.
    fn default() -> Self {
        Self {
            move_limit: 0.1,
            asyinit: 0.5,
            asyincr: 1.2,
            asydecr: 0.7,
            asymin: 0.01,
            asymax: 10.0,
            albefa: 0.1,
            raa0: 1e-5,
            c: 1000.0,
        }
    }
}
