//! `slipstick verify gradient`: the adjoint against differences, on the user's own model.

use serde_json::json;
use slipstick::build::Problem;
use slipstick::output::{Cell, Csv, write_atomically};
use slipstick::verify::{DirectionCheck, GradientCheck, Quotient, VerifyOptions, verify_gradient};

use super::digits;
use crate::args::VerifyGradient;
use crate::failure::Failure;
use crate::setup::{Run, failed, prepare};
use crate::table::lines;
use crate::watch::Watch;
use crate::{Context, Outcome};

const COLUMNS: &[&str] =
    &["direction", "adjoint", "step", "difference", "relative_error", "remainder", "order", "kinks", "kinks_at"];

/// Compares the gradient with differences.
///
/// # Errors
/// As [`Failure`] lists them; of those [`Failure::Check`] if a difference without a kink is off by more than the
/// tolerance, or if nothing could be compared.
pub fn run(context: &Context, args: &VerifyGradient) -> Outcome {
    let (setup, mut problem) = prepare(context, &args.case.case, &["dirichlet", "design", "objective"])?;
    let density = setup.density(&problem, &args.design)?;
    let run = Run::start(context, &setup, &args.out, "verify")?;
    let outcome = verify(context, &mut problem, &run, &density, args);
    run.end(outcome)
}

fn verify(context: &Context, problem: &mut Problem, run: &Run, density: &[f64], args: &VerifyGradient) -> Outcome {
    let designed = problem.variables.as_ref().map_or(Vec::new(), |variables| variables.designed().to_vec());
    let options = VerifyOptions {
        directions: args.directions,
        elements: args.elements.get(),
        step: args.step,
        halvings: args.halvings,
        ..VerifyOptions::default()
    };
    let mut watch = Watch::new(context);
    let analysis = &mut problem.analysis;
    let check = match verify_gradient(analysis, density, &designed, &options, &mut watch) {
        Ok(check) => check,
        Err(error) => return Err(failed(problem, &error, &run.directory)),
    };
    if context.interrupt.requested() {
        // Differences of paths that were cut short mean nothing.
        return Err(Failure::Interrupted { message: "nothing was compared".into(), resume: None });
    }
    write(run, &check, args.tolerance)?;
    let summary = json!({
        "command": "verify gradient", "directory": run.directory.path(), "check": check, "tolerance": args.tolerance,
    });
    context.console.event("result", summary);
    context.console.text(&format!(
        "objective {}, norm of its gradient {}\n",
        digits(check.objective),
        digits(check.gradient_norm)
    ));
    check.directions.iter().for_each(|direction| context.console.lines(&describe(direction)));
    verdict(context, &check, args.tolerance)
}

fn verdict(context: &Context, check: &GradientCheck, tolerance: f64) -> Outcome {
    match check.worst {
        // Written so that a worst error that is not a number does not pass.
        Some(worst) if worst <= tolerance => {
            let all_kinks = check.directions.iter().filter(|direction| direction.best.is_none()).count();
            if all_kinks > 0 {
                let message = format!("{all_kinks} directions have a kink at every step and say nothing");
                context.console.warning(&message);
            }
            context.console.text(&format!("right: the largest error is {worst:.1e}, allowed is {tolerance:.1e}"));
            Ok(())
        }
        Some(worst) => Err(Failure::Check {
            message: format!("the gradient is off by {worst:.1e}, allowed is {tolerance:.1e}"),
            cure:
                "look at the orders in verify.csv: 2 with errors that fall with the step means the step is too large \
                   (--step), errors that grow mean it is too small for the accuracy of the forward analysis"
                    .into(),
        }),
        None => Err(Failure::Check {
            message: "nothing could be compared: every direction has a kink at every step, or no density may vary"
                .into(),
            cure: "a smaller --step, other densities (--design), or 0 < `design.initial` < 1".into(),
        }),
    }
}

fn describe(direction: &DirectionCheck) -> Vec<String> {
    let rows: Vec<_> = direction
        .quotients
        .iter()
        .map(|at| {
            vec![
                format!("{:.2e}", at.step),
                format!("{:.10e}", at.difference),
                format!("{:.1e}", at.relative_error),
                finite(at.order).map_or(String::new(), |order| format!("{order:.2}")),
                kinks(at),
            ]
        })
        .collect();
    let mut text = vec![format!("{}: adjoint {:.10e}", direction.name, direction.adjoint)];
    text.extend(lines(&["step", "difference", "error", "order", "kinks"], &rows));
    text.push(String::new());
    text
}

/// Where the objective kinks between the densities of a difference, the first few places.
fn kinks(at: &Quotient) -> String {
    const SHOWN: usize = 3;
    let mut shown: Vec<String> =
        at.kink.iter().take(SHOWN).map(|(step, node)| format!("step {step} node {node}")).collect();
    if at.kink.len() > SHOWN {
        shown.push(format!("{} more", at.kink.len() - SHOWN));
    }
    shown.join(", ")
}

fn finite(order: Option<f64>) -> Option<f64> {
    order.filter(|order| order.is_finite())
}

fn write(run: &Run, check: &GradientCheck, tolerance: f64) -> Outcome {
    let mut csv = Csv::create(&run.directory.file("verify.csv"), COLUMNS)?;
    for direction in &check.directions {
        for at in &direction.quotients {
            let places: Vec<String> = at.kink.iter().map(|(step, node)| format!("{step}:{node}")).collect();
            let places = if places.is_empty() { Cell::Empty } else { Cell::Text(places.join(" ")) };
            csv.row(&[
                direction.name.as_str().into(),
                direction.adjoint.into(),
                at.step.into(),
                at.difference.into(),
                at.relative_error.into(),
                at.remainder.into(),
                finite(at.order).into(),
                at.kink.len().into(),
                places,
            ])?;
        }
    }
    let right = check.worst.is_some_and(|worst| worst <= tolerance);
    let object = json!({ "tolerance": tolerance, "right": right, "check": check });
    write_atomically(&run.directory.file("verify.json"), |writer| writeln!(writer, "{object:#}"))?;
    Ok(())
}
