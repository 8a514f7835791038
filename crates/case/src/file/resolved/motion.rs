//! Symmetry planes, supports, motions, loads and the load path.

use schemars::JsonSchema;
use serde::Serialize;

pub use slipstick_model::model::motion::{
    AmplitudePoint, Centrifugal, Component, Dirichlet, Load, LoadKind, RotationAxis, Symmetry, Temperature, Until,
    Waypoint,
};

/// Steps of pseudo-time from 0 to 1, and Newton's method in each.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct LoadPath {
    /// Number N ≥ 1 of equal steps in each load case.
    pub steps: usize,
    /// Convergence bounds of Newton's iteration.
    pub tolerance: Tolerance,
    /// Maximum number of Newton iterations before an attempt counts as failed.
    pub max_newton_iterations: usize,
    /// How often the increment of a failing step may be halved, at most 30. A value above 8 also lifts the bound on what
    /// failed attempts at a step may cost.
    pub max_cutbacks: usize,
    /// Initial guess of Newton's iteration.
    pub start_values: StartValues,
    /// Viscous force per volume and velocity in pseudo-time, ≥ 0. \[F/L⁴\]
    #[serde(skip_serializing_if = "LoadPath::is_quasi_static")]
    pub viscosity: f64,
}

impl LoadPath {
    /// The default of `max_cutbacks`.
    pub const USUAL_CUTBACKS: usize = 8;

    fn is_quasi_static(viscosity: &f64) -> bool {
        *viscosity == 0.0
    }
}

/// Initial guess of Newton's iteration in a step. The solution does not depend on it, up to the
/// tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StartValues {
    /// In an optimization, the last state plus the increment of the previous design; otherwise
    /// extrapolated.
    PreviousDesign,
    /// Linear extrapolation of the last two states while the motion continues as before, otherwise
    /// the last state.
    Extrapolated,
    /// The last state.
    LastState,
}

/// Newton's tolerances: the relative one always applies, the absolute ones apply if given.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Tolerance {
    /// Bound on every norm relative to its own scale in the step. Unit-free.
    pub relative: f64,
    /// Absolute bound on the norm of the force residual (ε_res). \[F\]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual: Option<f64>,
    /// Absolute bound on the norm of the displacement increment (ε_disp). \[L\]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displacement: Option<f64>,
    /// Absolute bound on the norm of the contact residual (ε_con).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact: Option<f64>,
    /// Absolute bound on the norm of the multiplier increment (ε_LMM). \[F/L²\]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub multiplier: Option<f64>,
}
