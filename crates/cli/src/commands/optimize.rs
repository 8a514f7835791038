//! `slipstick optimize`, and the loop that `slipstick resume` goes on with.

use std::time::Instant;

use serde_json::json;
use slipstick::analysis::Forward;
use slipstick::case::Resolved;
use slipstick::optimize::{IterationRecord, Optimization};
use slipstick::output::Pvd;
use slipstick::output::fields::write_design;
use slipstick::run::{Checkpoint, History, NewtonTable, RunDirectory, StartValuesFile, write_densities, write_path};
use slipstick::words::counted;

use super::digits;
use crate::args::Optimize;
use crate::failure::Failure;
use crate::memory;
use crate::setup::{Run, prepare, stopped};
use crate::watch::Watch;
use crate::{Context, Outcome};

/// Sections that an optimization cannot do without.
pub const SECTIONS: &[&str] = &["dirichlet", "design", "objective", "optimizer"];

/// Optimizes the design of a case.
///
/// # Errors
/// As [`Failure`] lists them.
pub fn run(context: &Context, args: &Optimize) -> Outcome {
    let (setup, mut problem) = prepare(context, &args.case, SECTIONS)?;
    problem.initial_density = setup.density(context, &problem, &args.design)?;
    setup.warn_of_volume(context, &problem, args.design.design.is_none() && setup.starts_above_bound());
    let mut optimization = start(&setup.resolved, problem)?;
    if let Some(iterations) = args.iterations {
        optimization.set_iterations(iterations.get());
    }
    let Some(run) = context.parallel.first(|| Run::start(context, &setup, &args.out, "optimize"))? else {
        let outcome = follow(context, &setup.resolved, &mut optimization);
        return ended(context, optimization, outcome);
    };
    let state = optimization.state.clone();
    let hash = run.case_sha256().to_owned();
    let checkpoint = Checkpoint::new(hash, optimization.iterations(), Vec::new(), state);
    let outcome = drive(context, &setup.resolved, &mut optimization, &run, checkpoint);
    run.end(ended(context, optimization, outcome))
}

/// Hands the outcome on. Of a run that failed on several ranks, factors are left as they are: PETSc frees them on all ranks
/// together, and a rank that failed alone would wait for the others for ever.
pub fn ended(context: &Context, optimization: Optimization, outcome: Outcome) -> Outcome {
    if outcome.is_err() && context.parallel.size() > 1 {
        std::mem::forget(optimization);
    }
    outcome
}

/// An optimization of a built case at its start.
///
/// # Errors
/// [`Failure::Case`] if the case lacks what an optimization needs.
pub fn start(resolved: &Resolved, problem: slipstick::build::Problem) -> Outcome<Optimization> {
    use slipstick::optimize::OptimizeError::Build;
    Optimization::new(&resolved.case, problem).map_err(|error| match error {
        Build(error) => Failure::build(&error, &resolved.source_map),
        other => Failure::input(other.to_string(), "check [design] and [optimizer]"),
    })
}

/// The part of an optimization that a rank has which does not lead: the first one tells and writes what comes out.
///
/// # Errors
/// That of the analysis or the optimizer.
pub fn follow(context: &Context, resolved: &Resolved, optimization: &mut Optimization) -> Outcome {
    let mut watch = Watch::new(context, &optimization.problem);
    let ranks = context.parallel.ranks();
    let mut last = None;
    while !optimization.finished() {
        let iteration = optimization.state.iteration;
        drop(last.take());
        match optimization.advance(&mut watch) {
            Ok(forward) => last = Some(forward),
            Err(error) => return Err(stopped(&mut optimization.problem, resolved, &error, None)),
        }
        let updated = optimization.state.iteration > iteration;
        if let Some(guide) = optimization.problem.analysis.guide.as_ref().filter(|_| updated) {
            guide.serve(&*ranks);
        }
    }
    if let Some(forward) = &last {
        forward.path.serve(&*ranks);
    }
    Ok(())
}

/// Runs an optimization from its checkpoint to its end; everything is on disk after every iteration.
///
/// # Errors
/// As [`Failure`] lists them; finished iterations are kept.
pub fn drive(
    context: &Context,
    resolved: &Resolved,
    optimization: &mut Optimization,
    run: &Run,
    mut checkpoint: Checkpoint,
) -> Outcome {
    let directory = &run.directory;
    let steps = optimization.problem.analysis.times.len();
    let mut history = History::open(directory, &checkpoint.state.history)?;
    let table = NewtonTable::open(directory, checkpoint.newton_rows.last().copied().unwrap_or(0))?;
    let mut watch = Watch::new(context, &optimization.problem).with_table(table);
    // From here on a run that is stopped or killed can be resumed.
    checkpoint.write(directory)?;
    let done = steps.saturating_mul(optimization.state.iteration);
    context.console.start_bar(steps.saturating_mul(optimization.iterations().saturating_add(1)), done);
    let mut last: Option<Forward> = None;
    while !optimization.finished() {
        let iteration = optimization.state.iteration;
        // The path before goes first: it may be large.
        let before = last.take().and_then(|last| last.notice);
        watch.begin(iteration, steps * iteration);
        watch.set_headline(format!("iteration {iteration}: "));
        let clock = Instant::now();
        let forward = match optimization.advance(&mut watch) {
            Ok(forward) => forward,
            Err(error) => return Err(stopped(&mut optimization.problem, resolved, &error, Some(directory))),
        };
        watch.check()?;
        // Told again only after it was otherwise.
        context.console.notice(forward.notice.filter(|notice| Some(*notice) != before));
        let seconds = clock.elapsed().as_secs_f64();
        if let Some(record) = optimization.state.history.last() {
            history.record(record, seconds)?;
            tell(context, record, seconds);
        }
        write_iteration(directory, optimization, iteration, resolved.case.output.every)?;
        checkpoint.newton_rows.push(watch.newton_rows());
        let updated = optimization.state.iteration > checkpoint.state.iteration;
        checkpoint.state = optimization.state.clone();
        if let Some(guide) = optimization.problem.analysis.guide.as_ref().filter(|_| updated) {
            let ranks = optimization.problem.analysis.linear.ranks();
            let file = StartValuesFile::write(directory, optimization.state.iteration, guide, ranks)?;
            checkpoint.start_values = Some(file);
        }
        checkpoint.write(directory)?;
        last = Some(forward);
    }
    context.console.end_bar();
    if let Some(forward) = &last {
        let problem = &mut optimization.problem;
        write_path(directory, &problem.mesh, &problem.analysis.design, &forward.path)?;
    }
    tell_result(context, optimization, directory);
    Ok(())
}

/// The design of a finished iteration: always as a table, at times as a field.
fn write_iteration(run: &RunDirectory, optimization: &Optimization, iteration: usize, every: usize) -> Outcome {
    let Some(design) = optimization.evaluated() else { return Ok(()) };
    let (mesh, gradient) = (&optimization.problem.mesh, design.gradient.as_deref());
    write_densities(&run.file("design.csv"), mesh, &design.density, gradient)?;
    if !iteration.is_multiple_of(every) && !optimization.finished() {
        return Ok(());
    }
    let name = RunDirectory::numbered("design", iteration);
    let pieces = run.pieces(optimization.problem.analysis.model().share(), mesh.elements.len());
    write_design(&run.file(&name), mesh, iteration, &design.density, gradient, pieces.as_deref())?;
    let mut collection = Pvd::default();
    for number in 0..=iteration {
        let name = RunDirectory::numbered("design", number);
        if run.file(&name).exists() {
            collection.add(number as f64, run.in_series(&name))?;
        }
    }
    Ok(collection.save(&run.file("design.pvd"))?)
}

fn tell(context: &Context, record: &IterationRecord, seconds: f64) {
    let IterationRecord { iteration, objective, volume_fraction, newton_iterations, .. } = record;
    let mut event = json!(record);
    event["seconds"] = json!(seconds);
    context.console.event("iteration", event);
    let failed = match record.failed_iterations {
        0 => String::new(),
        failed => format!(" and {failed} in failed attempts"),
    };
    let change = record.change.map_or("       ".into(), |change| format!("{change:.5}"));
    let [open, stick, slip] = record.status;
    // kept in a terminal too, above the bar
    context.console.text(&format!(
        "{iteration:>5}  objective {:>14}  volume {volume_fraction:.5}  change {change}  Newton {newton_iterations:>4}{failed}  \
         open {open}, stick {stick}, slip {slip}  {seconds:.1} s",
        digits(*objective)
    ));
}

fn tell_result(context: &Context, optimization: &Optimization, run: &RunDirectory) {
    let Some(record) = optimization.state.history.last() else { return };
    let path = run.path();
    context.console.event(
        "result",
        json!({
            "command": "optimize", "directory": path, "iterations": optimization.state.iteration,
            "objective": record.objective, "volume_fraction": record.volume_fraction, "peak_bytes": memory::peak(),
        }),
    );
    context.console.text(&format!(
        "objective {}, volume fraction {:.5} after {}; design in {}",
        digits(record.objective),
        record.volume_fraction,
        counted(optimization.state.iteration, "iteration"),
        path.join("design.pvd").display()
    ));
}
