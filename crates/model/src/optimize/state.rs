//! The state of an optimization, its options, and what can go wrong.

use crate::analysis::{AnalysisError, Forward};
use crate::crushed::CrushedVoid;
use serde::{Deserialize, Serialize};
use slipstick_design::{
    FilterError, Method, MmaError, MmaParameters, Optimizer, Scaling, Schedule, VariableValues, VolumeError,
};
use slipstick_path::MarchFailure;

use super::{Best, StopCriteria};

/// One evaluated design.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct IterationRecord {
    /// 0 is the start design.
    pub iteration: usize,
    /// θ.
    pub objective: f64,
    /// Filled fraction of the design domain, of the nominal design.
    pub volume_fraction: f64,
    /// Largest change of a variable in the update that followed, before halvings and inner
    /// iterations shortened it; `None` after the last evaluation.
    pub change: Option<f64>,
    /// Norm of the optimality residual of the (filtered, scaled) problem at this design, as the
    /// optimizer sees it.
    pub optimality: Option<f64>,
    /// Newton iterations of the whole path; of several realizations, of all their paths. The same
    /// holds for the next three numbers.
    pub newton_iterations: usize,
    /// Newton iterations of failed attempts, including the paths that failed before the update was
    /// halved, and of the paths of rejected candidates.
    #[serde(default)]
    pub failed_iterations: usize,
    /// Uzawa iterations of the whole path.
    pub uzawa_iterations: usize,
    /// Accepted (sub-)steps.
    pub increments: usize,
    /// The functions whose largest is the objective, in the order of [`OptimizationState::parts`];
    /// empty if there is only one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<FunctionRecord>,
    /// Constraints, in the order of [`OptimizationState::constraints`]. Of several realizations, the
    /// value that violates the bound most, and the sum of the multipliers.
    pub constraints: Vec<FunctionRecord>,
    /// Largest violation of a constraint, relative to its bound; 0 if all are met.
    pub violation: f64,
    /// Share of intermediate densities of the nominal design, 4 Σ V φ (1 − φ) / Σ V over the design domain: 0 for a
    /// design of solid and void, 1 if all densities are 0.5. Source: Sigmund, Struct. Multidiscip.
    /// Optim. 33 (2007) 401–424.
    pub discreteness: f64,
    /// Slave nodes open, sticking, slipping at the end of the path of the nominal design.
    pub status: [usize; 3],
    /// How many times the update was halved because the path could not be marched with the full
    /// one.
    pub halvings: usize,
    /// Inner iterations of GCMMA: candidates that were marched and rejected before this design.
    #[serde(default)]
    pub inner_iterations: usize,
}

/// A constraint, or a part of the objective, at a design.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct FunctionRecord {
    /// Its value.
    pub value: f64,
    /// The extreme for which a smooth value stands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extreme: Option<f64>,
    /// Multiplier. Of a constraint: how much θ would fall if the bound were relaxed by its own
    /// magnitude (by 1 if the bound is 0), to first order. Of a part of the objective: its share of
    /// the largest, from 0 to 1; the shares of all parts add up to 1. `None` after the last
    /// evaluation.
    pub multiplier: Option<f64>,
}

/// Everything that the next iteration depends on.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct OptimizationState {
    /// Number of updates made.
    pub iteration: usize,
    /// Design variables.
    pub x: VariableValues,
    /// The variables before the last update, for halving it.
    pub x_before: Option<VariableValues>,
    /// The optimizer's memory, under the name of its method.
    #[serde(flatten)]
    pub optimizer: Optimizer,
    /// Scales of objective and constraints, each from the first gradient that is not zero.
    pub scaling: Option<Scaling>,
    /// Names of the functions whose largest is the objective: load cases, realizations of the
    /// design, or both; empty if there is only one function.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<String>,
    /// Names of the constraints: the bound on the volume, if any, then those of the analysis.
    pub constraints: Vec<String>,
    /// Bound on the volume fraction of the dilated design in the last update, with which the nominal
    /// one keeps its bound; `None` without a dilated design, and before the first update.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dilated_limit: Option<f64>,
    /// What the last update added to the smooth values of bounded extremes ([`slipstick_design::Bound::correction`]),
    /// for each realization and constraint of the analysis; empty if nothing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shifts: Vec<f64>,
    /// Which constraints bound smooth values of extremes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub extremes: Vec<usize>,
    /// The best design that meets all constraints; `None` if none does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub best: Option<Best>,
    /// Since when void follows linear elasticity because a path could not be completed otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interpolation: Option<Interpolation>,
    /// Iterations at which the sharpness rose only half of the way, because a bound would have broken; the
    /// rest follows two iterations later.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub divided: Vec<usize>,
    /// All evaluated designs.
    pub history: Vec<IterationRecord>,
}

/// Void that follows linear elasticity from an iteration on, because it made the path of a design fail.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Interpolation {
    /// The first iteration whose design was analysed like this.
    pub from: usize,
    /// The void that inverted or folded.
    pub void: CrushedVoid,
}

/// How a problem is optimized.
#[derive(Debug, Clone, PartialEq)]
pub struct OptimizationOptions {
    /// Bound on the fraction of the design domain's volume that is filled, in (0, 1]; `None`: no
    /// bound.
    pub volume_fraction: Option<f64>,
    /// Filter of the sensitivities; `None` for none. It requires a design map that is the identity.
    pub filter: Option<FilterOptions>,
    /// Number of updates.
    pub iterations: usize,
    /// When the optimization stops earlier.
    pub stop: StopCriteria,
    /// Parameters that change over the iterations.
    pub schedule: Schedule,
    /// MMA or GCMMA.
    pub method: Method,
    /// Parameters of either method.
    pub mma: MmaParameters,
    /// Whether each march takes its start values from the path of the previous design.
    pub follow_previous_design: bool,
    /// Whether void follows linear elasticity from the first design on whose path fails, or costs more in failed
    /// attempts than otherwise, because void inverts or folds. Without effect if it does so anyway.
    pub rescue_void: bool,
    /// Designs with the thresholds η ± `margin` of the projection are analysed too, and the worst
    /// of the three is improved. In (0, 0.5)
    pub margin: Option<f64>,
}

/// A filter of sensitivities.
#[derive(Debug, Clone, PartialEq)]
pub struct FilterOptions {
    /// Radius. \[L\]
    pub radius: f64,
    /// Symmetry planes, across which elements have mirror images: axis (0, 1 or 2) and coordinate.
    /// \[L\]
    pub planes: Vec<(usize, f64)>,
}

/// Why a problem cannot be optimized.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PrepareError {
    /// It has no objective.
    #[error("an optimization needs an objective")]
    NoObjective,
    /// It has no design.
    #[error("an optimization needs a design")]
    NoDesign,
    /// The sensitivity filter is impossible.
    #[error(transparent)]
    Filter(FilterError),
    /// The sensitivity filter would falsify gradients that are exact with respect to the variables.
    #[error("a sensitivity filter cannot be combined with a density filter, a projection or an overhang filter")]
    TwoFilters,
    /// Eroded and dilated designs need a projection.
    #[error("eroded and dilated designs need a projection")]
    NoProjection,
    /// The thresholds of eroded and dilated designs are impossible.
    #[error(transparent)]
    Margin(FilterError),
    /// The schedule of the sharpness is impossible.
    #[error(transparent)]
    Sharpness(FilterError),
    /// The schedule of the filter radius is impossible.
    #[error(transparent)]
    FilterRadius(FilterError),
    /// The schedule of the bound on the volume is impossible.
    #[error(transparent)]
    VolumeSchedule(VolumeError),
    /// The bound on the volume is impossible.
    #[error(transparent)]
    Volume(VolumeError),
}

/// Why an optimization stopped short.
#[derive(Debug, thiserror::Error)]
pub enum OptimizeError {
    /// The analysis failed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// The optimizer failed.
    #[error("optimizer: {0}")]
    Mma(#[from] MmaError),
    /// The objective of a design is only round-off, so it permits no update; the state is that of
    /// the last finished iteration.
    #[error("{}", .0.rounding.as_ref().map_or(String::new(), ToString::to_string))]
    Rounding(Box<Forward>),
    /// Stopped from outside, in the middle of an iteration; the state is that of the last finished
    /// one.
    #[error("interrupted")]
    Interrupted,
}

impl OptimizeError {
    /// The failed march, if a march failed.
    pub fn march_failure(&self) -> Option<&MarchFailure> {
        match self {
            Self::Analysis(error) => error.march(),
            _ => None,
        }
    }
}
