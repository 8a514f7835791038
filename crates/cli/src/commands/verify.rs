//! `slipstick verify gradient`: the adjoint against differences, on the user's own model.

use std::sync::Arc;

use serde_json::json;
use slipstick::analysis::Rounding;
use slipstick::build::Problem;
use slipstick::design::{ObservedSteps, Quantity, Response};
use slipstick::output::{Cell, Csv, write_atomically};
use slipstick::run::{Run, RunError};
use slipstick::verify::{
    DirectionCheck, GradientCheck, Quotient, Verdict, VerifyError, VerifyOptions, verify_gradient, verify_variables,
};

use crate::args::VerifyGradient;
use crate::context::Context;
use crate::runs::{end, failed, first, start};
use crate::setup::prepare;
use crate::summary::digits;
use crate::table::lines;
use crate::watch::Watch;
use slipstick_service::failure::{Failure, Outcome};

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
    "quantity",
];

/// Compares the gradient with differences.
///
/// # Errors
/// As [`Failure`] lists them, in particular [`Failure::Check`] if the error in a direction exceeds
/// the tolerance and cannot be explained by errors of the difference itself, or if nothing could be
/// compared.
pub fn run(context: &Context, args: &VerifyGradient) -> Outcome {
    if args.elements == 0 && args.directions == 0 {
        let cure = "set --elements or --directions to at least 1";
        return Err(Failure::input("there is nothing to compare", cure));
    }
    let (setup, mut problem) = prepare(context, &args.case, &["dirichlet", "design"])?;
    setup.start_from(context, &mut problem, &args.design)?;
    let run = start(context, &setup, &args.out, "verify")?;
    let outcome = verify(context, &mut problem, run.as_ref(), args);
    end(run, outcome)
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

/// What is differentiated, with the name for reports.
fn chosen(problem: &Problem, names: &[String]) -> Result<Vec<(String, Response)>, Failure> {
    let of = |quantity: &Arc<dyn Quantity>| {
        let response = Response::of(quantity.clone(), ObservedSteps::Last, 1.0);
        let response = match problem.load_cases.len() {
            0 | 1 => response,
            cases => response.in_load_cases(vec![1.0; cases]),
        };
        (quantity.name().to_owned(), response)
    };
    let known: Vec<&str> = problem.quantities.iter().map(|quantity| quantity.name()).collect();
    if let Some(name) = names.iter().find(|name| !known.contains(&name.as_str())) {
        let cure = match known.is_empty() {
            true => "name a quantity in the case: [[quantity]]".to_owned(),
            false => format!("quantities of the case: {}", known.join(", ")),
        };
        return Err(Failure::input(format!("there is no quantity called `{name}`"), cure));
    }
    let objective = problem.analysis.objective.iter().filter(|_| names.is_empty());
    let mut chosen: Vec<(String, Response)> = objective.map(|of| ("objective".to_owned(), of.clone())).collect();
    let wanted = |quantity: &&Arc<dyn Quantity>| names.is_empty() || names.iter().any(|name| name == quantity.name());
    chosen.extend(problem.quantities.iter().filter(wanted).map(of));
    if chosen.is_empty() {
        let cure = "add an [objective], or a [[quantity]]";
        return Err(Failure::input("the case has neither an objective nor a quantity to differentiate", cure));
    }
    Ok(chosen)
}

/// Compares the gradient with respect to the design variables.
fn compare(
    problem: &mut Problem,
    options: &VerifyOptions,
    watch: &mut Watch<'_>,
) -> Result<GradientCheck, VerifyError> {
    let (map, x) = (problem.map().cloned(), problem.initial_variables().cloned());
    let density = problem.initial_density().clone();
    let analysis = &mut problem.analysis;
    match map.zip(x) {
        Some((map, x)) => verify_variables(analysis, &map, &x, options, watch),
        None => verify_gradient(analysis, &density, &[], options, watch),
    }
}

/// A comparison of one quantity: its name, and the outcome, or why there is none.
type Checked = (String, Result<GradientCheck, Rounding>);

fn verify(context: &Context, problem: &mut Problem, run: Option<&Run>, args: &VerifyGradient) -> Outcome {
    let options = options(args);
    let chosen = chosen(problem, &args.quantities)?;
    let several = chosen.len() > 1;
    problem.analysis.constraints.clear();
    let mut checked: Vec<Checked> = Vec::new();
    for (name, response) in chosen {
        let mut watch = Watch::new(context, problem);
        problem.analysis.objective = Some(response);
        let check = match compare(problem, &options, &mut watch) {
            Ok(check) => Ok(check),
            Err(VerifyError::Rounding(rounding)) => Err(rounding),
            Err(VerifyError::Analysis(error)) => return Err(failed(problem, &error, run)),
            Err(VerifyError::Interrupted) => {
                return Err(Failure::Interrupted { message: "nothing was compared".into(), resume: None });
            }
        };
        if let Ok(check) = &check {
            context.console.notice(check.notice.as_ref());
            let [value, norm] = [check.objective, check.gradient_norm].map(digits);
            context.console.text(&format!("{name} {value}, norm of its gradient {norm}\n"));
            check.directions.iter().for_each(|direction| context.console.lines(&describe(direction)));
        }
        checked.push((name, check));
    }
    first(problem, || run.map_or(Ok(()), |run| write(run, &checked, args.tolerance)))?;
    let path = run.map(|run| run.directory().path());
    let summary = json!({
        "command": "verify gradient", "directory": path, "checks": checks(&checked), "tolerance": args.tolerance,
    });
    context.console.event("result", summary);
    let mut confirmed = 0;
    let mut inconclusive = Vec::new();
    for (name, check) in &checked {
        let outcome = match check {
            Ok(check) => verdict(context, name, check, args.tolerance),
            Err(rounding) => {
                let message = format!("nothing could be compared: {}", worded(rounding, name));
                Err(Failure::Check { message, cure: rounding.cures().join("\n    help: ") })
            }
        };
        match outcome {
            Ok(()) => confirmed += 1,
            Err(Failure::Check { message, cure }) if several && !wrong(check) => {
                inconclusive.push((name, message, cure));
            }
            Err(failure) => return Err(failure),
        }
    }
    if confirmed == 0
        && let Some((_, message, cure)) = inconclusive.pop()
    {
        return Err(Failure::Check { message, cure });
    }
    for (name, message, _) in inconclusive {
        context.console.warning(&format!("`{name}`: {message}"));
    }
    Ok(())
}

/// The message about a value that is only round-off.
fn worded(rounding: &Rounding, name: &str) -> String {
    match name {
        "objective" => rounding.to_string(),
        name => rounding.to_string().replacen("the objective", &format!("`{name}`"), 1),
    }
}

/// Whether a comparison shows that the gradient is wrong.
fn wrong(check: &Result<GradientCheck, Rounding>) -> bool {
    check.as_ref().is_ok_and(|check| check.count(Verdict::Off) > 0)
}

/// The comparisons as JSON.
fn checks(checked: &[Checked]) -> Vec<serde_json::Value> {
    let of = |(name, check): &Checked| match check {
        Ok(check) => json!({ "quantity": name, "check": check }),
        Err(rounding) => json!({ "quantity": name, "not_compared": worded(rounding, name) }),
    };
    checked.iter().map(of).collect()
}

fn verdict(context: &Context, name: &str, check: &GradientCheck, tolerance: f64) -> Outcome {
    let name = if name == "objective" { "the gradient".to_owned() } else { format!("the gradient of `{name}`") };
    let silent: Vec<String> = [Verdict::Kink, Verdict::CutBack, Verdict::NotResolvable]
        .into_iter()
        .filter(|&verdict| check.count(verdict) > 0)
        .map(|verdict| format!("{} {}", check.count(verdict), reason(verdict)))
        .collect();
    if check.count(Verdict::Off) > 0 {
        let worst = check.worst.unwrap_or(f64::NAN);
        return Err(Failure::Check {
            message: format!("{name} has an error of {worst:.1e}; the tolerance is {tolerance:.1e}"),
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
        let of = if name == "the gradient" { String::new() } else { format!(" for {name}") };
        context.console.warning(&format!("some directions are inconclusive{of}: {}", silent.join(", ")));
    }
    let of = if name == "the gradient" { String::new() } else { format!(" of {name}") };
    let text = format!("confirmed: the largest error{of} is {worst:.1e}, the tolerance is {tolerance:.1e}");
    context.console.text(&text);
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

/// What spoils a difference: the first few places where the objective has a kink between its two
/// designs, or different steps of their paths.
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

fn write(run: &Run, checked: &[Checked], tolerance: f64) -> Result<(), RunError> {
    let mut csv = Csv::create(&run.directory().file("verify.csv"), COLUMNS)?;
    let compared = || checked.iter().filter_map(|(name, check)| Some((name, check.as_ref().ok()?)));
    let directions =
        compared().flat_map(|(name, check)| check.directions.iter().map(move |direction| (name, direction)));
    for (name, direction) in directions {
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
                name.as_str().into(),
            ])?;
        }
    }
    let known = compared().any(|(_, check)| check.worst.is_some());
    let right = known && !checked.iter().any(|(_, check)| wrong(check));
    let object = json!({ "tolerance": tolerance, "right": right, "checks": checks(checked) });
    write_atomically(&run.directory().file("verify.json"), |writer| writeln!(writer, "{object:#}"))?;
    Ok(())
}
