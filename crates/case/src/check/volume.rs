//! Checks whether an initial design satisfies the bound on the volume.

use super::{Notice, NoticeKind};
use crate::construct::Problem;
use crate::file::Case;
use slipstick_design::{DesignVariables, ElementValues, Role};
use slipstick_model::words::quantity;

/// An excess over the bound by less than this fraction of it is round-off.
const ROUNDING: f64 = 1e-9;

/// Two fractions of the design's volume: the material in the elements whose role passes a test, and
/// the volume of these elements.
fn share(variables: &DesignVariables, volumes: &[f64], density: &ElementValues, of: impl Fn(Role) -> bool) -> [f64; 2] {
    let domain = || variables.domain().iter().map(|&e| e as usize);
    let all: f64 = domain().map(|e| volumes[e]).sum();
    let chosen = || domain().filter(|&e| of(variables.roles()[e]));
    [chosen().map(|e| density[e] * volumes[e]).sum::<f64>() / all, chosen().map(|e| volumes[e]).sum::<f64>() / all]
}

/// The largest number of thousandths from 0 to 1 that fits, if any does.
fn largest(fits: impl Fn(f64) -> Option<bool>) -> Option<f64> {
    let fits = |thousandths: u32| fits(f64::from(thousandths) / 1000.0).unwrap_or(false);
    let (mut low, mut high) = (0, 1000);
    if !fits(low) {
        return None;
    }
    while high - low > 1 {
        let middle = (low + high) / 2;
        if fits(middle) { low = middle } else { high = middle }
    }
    (low > 0).then_some(f64::from(low) / 1000.0)
}

/// A notice if an initial design with these densities exceeds the bound; it mentions the share of
/// passive regions.
pub fn start_volume(case: &Case, problem: &Problem, density: &ElementValues) -> Option<Notice> {
    let (variables, design) = (problem.variables()?, case.design.as_ref()?);
    let scheduled = case.optimizer.as_ref().and_then(|optimizer| optimizer.schedule.volume_fraction.at(0));
    let limit = scheduled.or(design.volume_fraction)?;
    let volumes = problem.mesh.element_volumes();
    let [filled, _] = share(variables, &volumes, density, |_| true);
    if filled <= limit * (1.0 + ROUNDING) {
        return None;
    }
    let [solid, _] = share(variables, &volumes, density, |role| role == Role::Solid);
    let [free, room] = share(variables, &volumes, density, |role| role == Role::Designed);
    let passive = if solid > 0.0 {
        let each = quantity(free / room);
        format!(": passive solid elements already fill {}, and the designed elements start at {each}", quantity(solid))
    } else {
        String::new()
    };
    // a filter blurs passive regions
    let fits = |value: f64| {
        let density = problem.uniform_start(value)?;
        Some(share(variables, &volumes, &density, |_| true)[0] <= limit * (1.0 + ROUNDING))
    };
    let help = match largest(fits) {
        Some(lower) => format!(
            "an initial density of {} (`initial`) in the designed elements meets the bound; otherwise the first \
             updates remove material",
            quantity(lower)
        ),
        None => {
            "raise `volume_fraction`, or shrink `passive_solid`: with what the filter spreads, it already reaches the bound"
                .into()
        }
    };
    Some(Notice {
        kind: NoticeKind::InitialVolume,
        path: if solid > 0.0 { "design.passive_solid" } else { "design.volume_fraction" }.into(),
        message: format!(
            "the initial design fills {} of the design bodies, more than the bound of {limit}{passive}",
            quantity(filled)
        ),
        help,
    })
}
