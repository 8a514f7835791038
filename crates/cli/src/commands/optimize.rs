//! `slipstick optimize`, and how `slipstick resume` continues.

use serde_json::{Value, json};
use slipstick::build::{self, Problem};
use slipstick::drive::{Recorder, drive};
use slipstick::optimize::Optimization;
use slipstick::run::{Checkpoint, Run};
use slipstick::words::counted;

use super::{digits, last_values, tell_quantities, warn_of_fallbacks};
use crate::args::Optimize;
use crate::failure::Failure;
use crate::runs::{end, start, stopped};
use crate::setup::{Setup, prepare};
use crate::watch::Watch;
use crate::{Context, Outcome, memory};

/// Sections that an optimization needs.
pub const SECTIONS: &[&str] = &["dirichlet", "design", "objective", "optimizer"];

/// Optimizes the design of a case.
///
/// # Errors
/// As [`Failure`] lists them.
pub fn run(context: &Context, args: &Optimize) -> Outcome {
    let (setup, mut problem) = prepare(context, &args.case, SECTIONS)?;
    setup.start_from(context, &mut problem, &args.design)?;
    setup.warn_of_volume(context, &problem, args.design.design.is_none() && setup.starts_above_bound());
    let mut optimization = optimization(&setup, problem)?;
    if let Some(iterations) = args.iterations {
        optimization.set_iterations(iterations.get());
    }
    let run = start(context, &setup, &args.out, "optimize")?;
    let hash = run.as_ref().map_or(String::new(), |run| run.case_sha256().to_owned());
    let checkpoint = Checkpoint::new(hash, optimization.iterations(), Vec::new(), optimization.state.clone());
    let outcome = optimize(context, &setup, &mut optimization, run.as_ref(), checkpoint);
    end(run, outcome)
}

/// An optimization of a built case at its start.
///
/// # Errors
/// [`Failure::Case`] if the case lacks what an optimization needs.
pub fn optimization(setup: &Setup, problem: Problem) -> Outcome<Optimization> {
    let resolved = &setup.resolved;
    build::optimization(&resolved.case, problem).map_err(|error| Failure::build(&error, &resolved.source_map))
}

/// Runs an optimization from its checkpoint to its end; the first rank has the run.
///
/// # Errors
/// As [`Failure`] lists them; finished iterations are kept.
pub fn optimize(
    context: &Context,
    setup: &Setup,
    optimization: &mut Optimization,
    run: Option<&Run>,
    checkpoint: Checkpoint,
) -> Outcome {
    let every = setup.resolved.case.output.every;
    let ranks = optimization.problem.analysis.linear.ranks();
    let recorder = Recorder::new(run.map(Run::directory), checkpoint, every, ranks)?;
    let mut watch = Watch::new(context, &optimization.problem);
    let steps = optimization.problem.analysis.times.len();
    let all = steps.saturating_mul(optimization.iterations().saturating_add(1));
    context.console.start_bar(all, steps.saturating_mul(optimization.state.iteration));
    let quantities = drive(optimization, Some(recorder), &mut watch).map_err(|error| stopped(error, run))?;
    context.console.end_bar();
    if let Some(run) = run {
        if let Some(quantities) = &quantities {
            tell_quantities(context, quantities);
        }
        tell_result(context, optimization, run, quantities.as_ref().map(last_values));
    }
    Ok(())
}

/// Relative violation from which a warning says that a design violates its constraints.
const VIOLATED: f64 = 0.01;

fn tell_result(context: &Context, optimization: &Optimization, run: &Run, quantities: Option<Value>) {
    let Some(record) = optimization.state.history.last() else { return };
    let path = run.directory().path();
    context.console.event(
        "result",
        json!({
            "command": "optimize", "directory": path, "iterations": optimization.state.iteration,
            "objective": record.objective, "volume_fraction": record.volume_fraction,
            "violation": record.violation,
            "quantities": quantities, "peak_bytes": memory::peak(),
        }),
    );
    context.console.text(&format!(
        "objective {}, volume fraction {:.5} after {}; design in {}",
        digits(record.objective),
        record.volume_fraction,
        counted(optimization.state.iteration, "iteration"),
        path.join("design.pvd").display()
    ));
    if record.violation > VIOLATED {
        context.console.warning(&format!(
            "the design violates its constraints: the largest relative violation is {:.3} (columns of history.csv); more \
             iterations may reduce it, unless constraints contradict each other",
            record.violation
        ));
    }
    warn_of_fallbacks(context, &optimization.problem.analysis);
}
