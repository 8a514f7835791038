//! Uzawa's iteration: Newton's method with held multipliers, multiplier update, repeat.

use crate::failure::{StepFailure, StepFailureKind};
use crate::linear::LinearSystem;
use crate::newton::{self, NewtonOptions, StepReport};
use crate::problem::{StepProblem, UzawaOptions};

/// Solves one (sub-)step of the augmented Lagrangian method.
///
/// The inner Newton uses the augmented traction z(d; ẑ) and its tangent, then ẑ ← z, until the contact conditions hold to
/// the tolerance. Paper: (48)–(52), with the inner solve of theory §4.
pub(crate) fn solve(
    problem: &mut dyn StepProblem,
    linear: &mut LinearSystem,
    y: &mut [f64],
    target: &[f64],
    newton: &NewtonOptions,
    uzawa: &UzawaOptions,
    report: &mut StepReport,
) -> Result<(), StepFailure> {
    problem.hold_multipliers(true);
    let result = iterate(problem, linear, y, target, newton, uzawa, report);
    problem.hold_multipliers(false);
    result
}

fn iterate(
    problem: &mut dyn StepProblem,
    linear: &mut LinearSystem,
    y: &mut [f64],
    target: &[f64],
    newton: &NewtonOptions,
    uzawa: &UzawaOptions,
    report: &mut StepReport,
) -> Result<(), StepFailure> {
    let mut violation = f64::INFINITY;
    for iteration in 1..=uzawa.max_iterations {
        newton::solve(problem, linear, y, target, newton, report)?;
        report.uzawa = iteration;
        violation = problem.update_multipliers(y).map_err(|e| StepFailure {
            kind: e.into(),
            iterations: report.iterations.clone(),
            iterate: y.to_vec(),
        })?;
        if violation <= uzawa.tolerance {
            return Ok(());
        }
    }
    Err(StepFailure {
        kind: StepFailureKind::Uzawa { iterations: uzawa.max_iterations, violation, tolerance: uzawa.tolerance },
        iterations: std::mem::take(&mut report.iterations),
        iterate: y.to_vec(),
    })
}
