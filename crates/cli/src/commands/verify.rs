//! `slipstick verify gradient`: the adjoint against differences, on the user's own model.

use serde_json::json;
use slipstick::build::Problem;
use slipstick::design::ElementValues;
use slipstick::output::{Cell, Csv, write_atomically};
use slipstick::run::{Run, RunError};
use slipstick::verify::{
    DirectionCheck, GradientCheck, Quotient, Verdict, VerifyError, VerifyOptions, verify_gradient,
};

use super::digits;
use crate::args::VerifyGradient;
use crate::failure::Failure;
use crate::runs::{end, failed, first, start};
use crate::setup::prepare;
use crate::table::lines;
use crate::watch::Watch;
use crate::{Context, Outcome};

const COLUMNS: &[&str] = &[
    "direction",
    "adjoint",
    "step",
    "difference",
    "relative_error",
    "round_off",
    "remainder",
    "order",
    "kinks",
    "kinks_at",
    "cut_back",
    "one_sided",
];

/// Compares the gradient with differences.
///
/// # Errors
/// As [`Failure`] lists them, in particular [`Failure::Check`] if the error in a direction exceeds the tolerance and
/// cannot be explained by errors of the difference itself, or if nothing could be compared.
pub fn run(context: &Context, args: &VerifyGradient) -> Outcome {
    if args.elements == 0 && args.directions == 0 {
        let cure = "set --elements or --directions to at least 1";
        return Err(Failure::input("there is nothing to compare", cure));
    }
    let (setup, mut problem) = prepare(context, &args.case, &["dirichlet", "design", "objective"])?;
    let density = setup.density(context, &problem, &args.design)?;
    let run = start(context, &setup, &args.out, "verify")?;
    let outcome = verify(context, &mut problem, run.as_ref(), &density, args);
    end(run, outcome)
}

/// The elements whose densities may vary.
fn designed(problem: &Problem) -> Vec<u32> {
    problem.variables.as_ref().map_or(Vec::new(), |variables| variables.designed().to_vec())
}

fn options(args: &VerifyGradient) -> VerifyOptions {
    VerifyOptions {
        directions: args.directions,
        elements: args.elements,
        step: args.step,
        halvings: args.halvings,
        tolerance: args.tolerance,
        ..VerifyOptions::default()
    }
}

fn verify(
    context: &Context,
    problem: &mut Problem,
    run: Option<&Run>,
    density: &ElementValues,
    args: &VerifyGradient,
) -> Outcome {
    let (designed, options) = (designed(problem), options(args));
    let mut watch = Watch::new(context, problem);
    let analysis = &mut problem.analysis;
    let check = match verify_gradient(analysis, density, &designed, &options, &mut watch) {
        Ok(check) => check,
        Err(VerifyError::Analysis(error)) => return Err(failed(problem, &error, run)),
        Err(VerifyError::Rounding(rounding)) => {
            let message = format!("nothing could be compared: {rounding}");
            return Err(Failure::Check { message, cure: rounding.cures().join("\n    help: ") });
        }
        Err(VerifyError::Interrupted) => {
            return Err(Failure::Interrupted { message: "nothing was compared".into(), resume: None });
        }
    };
    first(problem, || run.map_or(Ok(()), |run| write(run, &check, args.tolerance)))?;
    let path = run.map(|run| run.directory().path());
    context.console.notice(check.notice);
    let summary = json!({
        "command": "verify gradient", "directory": path, "check": check, "tolerance": args.tolerance,
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
    let silent: Vec<String> = [Verdict::Kink, Verdict::CutBack, Verdict::NotResolvable]
        .into_iter()
        .filter(|&verdict| check.count(verdict) > 0)
        .map(|verdict| format!("{} {}", check.count(verdict), reason(verdict)))
        .collect();
    if check.count(Verdict::Off) > 0 {
        let worst = check.worst.unwrap_or(f64::NAN);
        return Err(Failure::Check {
            message: format!("the gradient has an error of {worst:.1e}; the tolerance is {tolerance:.1e}"),
            cure: "check the orders in verify.csv: if they are 2 and errors decrease with the step, the step is too \
                   large (--step); if errors stay the same, the gradient is wrong"
                .into(),
        });
    }
    let Some(worst) = check.worst else {
        let found = if silent.is_empty() { "no density may vary".into() } else { silent.join(", ") };
        let cure = if check.count(Verdict::NotResolvable) > 0 {
            "a larger --step, or a larger --tolerance"
        } else {
            "a smaller --step, or other densities (--design)"
        };
        let message = format!("nothing could be compared: {found}");
        return Err(Failure::Check { message, cure: cure.into() });
    };
    if !silent.is_empty() {
        context.console.warning(&format!("some directions are inconclusive: {}", silent.join(", ")));
    }
    context.console.text(&format!("confirmed: the largest error is {worst:.1e}, the tolerance is {tolerance:.1e}"));
    Ok(())
}

/// Why directions are inconclusive, to be printed after their number.
fn reason(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Kink => "with a kink at every step",
        Verdict::CutBack => "with paths that are cut back differently at every step",
        Verdict::NotResolvable => "not resolvable at these steps: adjoint and difference agree to round-off",
        Verdict::Right => "right",
        Verdict::Off => "off",
    }
}

fn describe(direction: &DirectionCheck) -> Vec<String> {
    let rows: Vec<_> = direction
        .quotients
        .iter()
        .map(|at| {
            vec![
                format!("{:.2e}", at.step),
                format!("{:.10e}", at.difference + 0.0),
                format!("{:.1e}", at.relative_error),
                format!("{:.1e}", at.round_off),
                finite(at.order).map_or(String::new(), |order| format!("{order:.2}")),
                remark(at),
            ]
        })
        .collect();
    let one_sided = if direction.one_sided { ", one-sided differences" } else { "" };
    let mut text = vec![format!("{}: adjoint {:.10e}{one_sided}", direction.name, direction.adjoint + 0.0)];
    text.extend(lines(&["step", "difference", "error", "round-off", "order", "remark"], &rows));
    text.push(String::new());
    text
}

/// What spoils a difference: the first few places where the objective has a kink between its two designs, or different
/// steps of their paths.
fn remark(at: &Quotient) -> String {
    const SHOWN: usize = 3;
    if at.cut_back {
        return "cut back differently".into();
    }
    if at.kinked && at.kink.is_empty() {
        return "kink of the overlap".into();
    }
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

fn write(run: &Run, check: &GradientCheck, tolerance: f64) -> Result<(), RunError> {
    let mut csv = Csv::create(&run.directory().file("verify.csv"), COLUMNS)?;
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
                at.round_off.into(),
                at.remainder.into(),
                finite(at.order).into(),
                at.kink.len().into(),
                places,
                usize::from(at.cut_back).into(),
                usize::from(direction.one_sided).into(),
            ])?;
        }
    }
    let right = check.worst.is_some() && check.count(Verdict::Off) == 0;
    let object = json!({ "tolerance": tolerance, "right": right, "check": check });
    write_atomically(&run.directory().file("verify.json"), |writer| writeln!(writer, "{object:#}"))?;
    Ok(())
}
