//! `slipstick optimize`, and how `slipstick resume` continues.

use serde_json::{Value, json};
use slipstick::optimize::{FEASIBLE, IterationRecord, MostViolated, Optimization};
use slipstick::run::{ResultRecord, Run};
use slipstick::words::counted;
use slipstick_service::optimization::{RecordedOptimization, SECTIONS, optimization};

use crate::args::Optimize;
use crate::context::Context;
use crate::runs::start;
use crate::setup::prepare_for;
use crate::summary::{digits, last_values, print_quantities, warn_of_fallbacks};
use crate::watch::Watch;
use slipstick_service::failure::Outcome;
use slipstick_service::memory;
use slipstick_service::warnings::violation;

/// Optimizes the design of a case.
///
/// # Errors
/// As [`slipstick_service::failure::Failure`] lists them.
pub fn run(context: &Context, args: &Optimize) -> Outcome {
    let iterations = args.iterations.map(usize::from);
    let (setup, mut problem) = prepare_for(context, &args.case, SECTIONS, iterations)?;
    setup.start_from(context, &mut problem, &args.design)?;
    setup.warn_of_volume(context, &problem, args.design.design.is_none() && setup.starts_above_bound());
    let mut optimization = optimization(&setup.checked.resolved, problem)?;
    if let Some(iterations) = iterations {
        optimization.set_iterations(iterations);
    }
    let run = start(context, &setup, &args.out, "optimize")?;
    drive(context, RecordedOptimization::start(optimization, &setup.checked.resolved, run, None)?)
}

/// Runs an optimization to its end and prints its result; the first rank has the run.
///
/// # Errors
/// As [`slipstick_service::failure::Failure`] lists them; finished iterations are kept.
pub fn drive(context: &Context, recorded: RecordedOptimization) -> Outcome {
    let optimization = &recorded.optimization;
    let mut watch = Watch::new(context, &optimization.problem);
    let steps = optimization.problem.analysis.times.len();
    let all = steps.saturating_mul(optimization.iterations().saturating_add(1));
    context.console.start_bar(all, steps.saturating_mul(optimization.state.iteration));
    let (driven, outcome) = recorded.drive(&mut watch);
    let outcome = outcome.map(|quantities| {
        context.console.end_bar();
        let Some(run) = driven.run() else { return };
        context.console.judges_result();
        if let Some(quantities) = &quantities {
            print_quantities(context, quantities, &driven.optimization.problem);
        }
        tell_result(
            context,
            &driven.optimization,
            run,
            quantities.as_ref().map(|all| last_values(all, &driven.optimization.problem)),
        );
    });
    driven.end(outcome)
}

fn tell_result(context: &Context, optimization: &Optimization, run: &Run, quantities: Option<Value>) {
    let state = &optimization.state;
    let Some(last) = state.history.last() else { return };
    // also if its path could not be marched again
    let recalled = ResultRecord::read(run.directory()).ok().flatten();
    let record = recalled.and_then(|recalled| state.history.get(recalled.iteration)).unwrap_or(last);
    let path = run.directory().path();
    context.console.event(
        "result",
        json!({
            "command": "optimize", "directory": path, "iterations": state.iteration,
            "iteration": record.iteration, "objective": record.objective, "volume_fraction": record.volume_fraction,
            "violation": record.violation,
            "quantities": quantities, "peak_bytes": memory::peak(),
        }),
    );
    let (of, file) = match recalled {
        Some(_) => (format!(" in iteration {} of {}", record.iteration, state.iteration), "design.csv"),
        None => (format!(" after {}", counted(state.iteration, "iteration")), "design.pvd"),
    };
    context.console.text(&format!(
        "objective {}, volume fraction {:.5}{of}; design in {}",
        digits(record.objective),
        record.volume_fraction,
        path.join(file).display()
    ));
    tell_parts(context, optimization, record);
    if recalled.is_some() {
        tell_why_not_the_last(context, optimization, record, last);
    }
    if let Some(message) = violation(optimization, record) {
        context.console.warning(&message);
    }
    let density = optimization.evaluated().map(|design| &design.density);
    if let Some(loose) = density.and_then(|density| optimization.problem.loose_pieces(density)) {
        context.console.loose_pieces(&loose, None);
    }
    warn_of_fallbacks(context, &optimization.problem.analysis);
}

/// Relative difference of the eroded design's objective from the nominal one's from which a warning says so.
const ERODED: f64 = 0.5;

/// Prints the functions whose largest is the objective; the eroded design should hardly differ from the nominal one.
fn tell_parts(context: &Context, optimization: &Optimization, record: &IterationRecord) {
    let names = &optimization.state.parts;
    if names.len() < 2 || names.len() != record.parts.len() {
        return;
    }
    let each: Vec<String> =
        names.iter().zip(&record.parts).map(|(name, part)| format!("{name} {}", digits(part.value))).collect();
    context.console.text(&format!("  the objective is the largest of: {}", each.join(", ")));
    let value = |name: &str| Some(record.parts[names.iter().position(|part| part == name)?].value);
    // of each load case, if the worst of them counts
    for of in names.iter().filter_map(|name| name.strip_prefix("nominal")) {
        let [nominal, eroded, dilated] = ["nominal", "eroded", "dilated"].map(|design| value(&format!("{design}{of}")));
        let (Some(nominal), Some(eroded), Some(dilated)) = (nominal, eroded, dilated) else { continue };
        if (eroded - nominal).abs() > ERODED * nominal.abs().max(0.1 * dilated.abs()) {
            context.console.warning(&format!(
                "the objectives differ widely: {} of the eroded design, {} of the nominal one, {} of the dilated one. Either \
                 members are about as thin as `minimum_thickness`: give a smaller one, or finer elements. Or a bound, which \
                 holds for all three designs, is too tight",
                digits(eroded),
                digits(nominal),
                digits(dilated)
            ));
        }
    }
}

/// The result is the best design that meets the constraints, and why it is not the last one.
fn tell_why_not_the_last(
    context: &Context,
    optimization: &Optimization,
    result: &IterationRecord,
    last: &IterationRecord,
) {
    let (best, objective) = (result.iteration, digits(last.objective));
    match optimization.most_violated(last).filter(|_| last.violation > FEASIBLE) {
        Some(MostViolated { name, violation, .. }) => context.console.warning(&format!(
            "the last design, with the objective {objective}, violates `{name}` by {:.2} % of its bound, so the result \
             is the best design that meets the constraints, that of iteration {best}; more iterations \
             (`slipstick resume`) may find a better one",
            100.0 * violation
        )),
        None => context.console.text(&format!(
            "  iteration {best} has the best objective of all designs that meet the constraints; the last one has \
             {objective}"
        )),
    }
}
