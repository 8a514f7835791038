//! From a resolved case and its problem to an optimization at its start.

use slipstick_design::Method;
use slipstick_model::optimize::{FilterOptions, Optimization, OptimizationOptions, PrepareError, StopCriteria};
use slipstick_model::problem::Problem;

use super::BuildError;
use super::maps::planes;
use crate::file::{Case, OptimizerMethod, StartValues};

/// Distance of the thresholds of the eroded and the dilated design from 0.5:
/// [`RADIUS_OVER_THICKNESS`](crate::file::DensityFilter::RADIUS_OVER_THICKNESS) is for this margin.
const MARGIN: f64 = 0.25;

/// Prepares the optimization of a built case.
///
/// # Errors
/// [`BuildError`] if the case lacks a design with a volume fraction, an objective or an optimizer.
pub fn optimization(case: &Case, problem: Problem) -> Result<Optimization, BuildError> {
    let missing = |path: &str, help: &str| BuildError::new(path, "an optimization needs it", help);
    let no_design = || missing("design", "add a [design] table");
    let design = case.design.as_ref().ok_or_else(no_design)?;
    let volume_fraction = design.volume_fraction;
    if volume_fraction.is_none() && case.constraints.is_empty() {
        let help = "give the fraction of the design bodies' volume to use, or bound a quantity with [[constraint]]";
        return Err(missing("design.volume_fraction", help));
    }
    let optimizer = case.optimizer.as_ref().ok_or_else(|| missing("optimizer", "add an [optimizer] table"))?;
    let options = OptimizationOptions {
        volume_fraction,
        filter: design.sensitivity_filter.map(|filter| FilterOptions { radius: filter.radius, planes: planes(case) }),
        iterations: optimizer.iterations,
        stop: StopCriteria {
            change: optimizer.tolerance,
            optimality: optimizer.optimality,
            discreteness: optimizer.discreteness,
        },
        schedule: optimizer.schedule.clone(),
        method: match optimizer.method {
            OptimizerMethod::Mma if optimizer.adaptive => Method::Guarded { inner_iterations: Method::REPETITIONS },
            OptimizerMethod::Mma => Method::Mma,
            OptimizerMethod::Gcmma => {
                Method::Gcmma { inner_iterations: optimizer.inner_iterations.unwrap_or(Method::INNER_ITERATIONS) }
            }
        },
        mma: optimizer.mma,
        // a designed body that a load case rotates may not follow linear elasticity
        rescue_void: !case.load_cases.iter().flat_map(|of| &of.bodies).any(|body| body.rotation.is_some()),
        margin: design.minimum_thickness.map(|_| MARGIN),
        follow_previous_design: case.load_path.start_values == StartValues::PreviousDesign,
    };
    Optimization::new(problem, options).map_err(|error| match error {
        PrepareError::NoObjective => missing("objective", "add an [objective] table"),
        PrepareError::NoDesign => no_design(),
        PrepareError::Filter(error) => BuildError::new("design.sensitivity_filter.radius", error, "change the value"),
        PrepareError::TwoFilters => BuildError::new("design.sensitivity_filter", error, "omit one of them"),
        PrepareError::NoProjection | PrepareError::Margin(_) => {
            BuildError::new("design.minimum_thickness", error, "change the value")
        }
        PrepareError::Sharpness(error) => BuildError::new("optimizer.schedule.sharpness", error, "change the value"),
        PrepareError::FilterRadius(error) => {
            BuildError::new("optimizer.schedule.filter_radius", error, "change the value")
        }
        PrepareError::VolumeSchedule(error) => {
            BuildError::new("optimizer.schedule.volume_fraction", error, "change the value")
        }
        PrepareError::Volume(error) => BuildError::new("design.volume_fraction", error, "change the value"),
    })
}
