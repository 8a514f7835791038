//! `slipstick solve`: the load path of one design.

use serde_json::json;
use slipstick::analysis::{Analysis, Designs, Forward};
use slipstick::build::Problem;
use slipstick::case::Case;
use slipstick::design::{Bound, ElementValues};
use slipstick::overlaps::overlaps;
use slipstick::path::{MarchEvent, MarchObserver};
use slipstick::quantities::Recording;
use slipstick::run::{Comparison, PathWriter, Run, RunDirectory, comparisons, write_densities, write_path};
use slipstick::words::{self, quantity};
use slipstick_service::check::volume_fraction;

use crate::args::Solve;
use crate::clock;
use crate::context::Context;
use crate::runs::{end, failed, first, start, watch};
use crate::setup::prepare;
use crate::summary::{
    digits, final_status, last_values, phases, print_phases, print_quantities, warn_of_fallbacks, whole,
};
use crate::table::lines;
use crate::watch::Watch;
use slipstick_service::failure::Outcome;

/// Values of the objective per load step; `None` for steps that it does not depend on, and if it is not a sum over steps.
fn observed(analysis: &Analysis, forward: &Forward) -> Vec<Option<f64>> {
    let steps = analysis.times.len();
    let summed = analysis.objective.as_ref().filter(|objective| objective.adds_up());
    let observes = |step: usize| summed.is_some_and(|objective| objective.observes(step, steps));
    (1..).zip(&forward.step_values).map(|(step, &value)| observes(step).then_some(value)).collect()
}

/// Marches the load path and writes its states.
///
/// # Errors
/// As [`slipstick_service::failure::Failure`] lists them.
pub fn run(context: &Context, args: &Solve) -> Outcome {
    let (setup, mut problem) = prepare(context, &args.case, &["dirichlet"])?;
    let density = setup.density(context, &problem, &args.design)?;
    let run = start(context, &setup, &args.out, "solve")?;
    let outcome = solve(context, &mut problem, run.as_ref(), &density)
        .and_then(|()| tell_promises(context, &setup.checked.resolved.case, run.as_ref()));
    end(run, outcome)
}

/// Compares the values that a design promised with those of this run.
fn tell_promises(context: &Context, case: &Case, run: Option<&Run>) -> Outcome {
    let found = match run {
        Some(run) => comparisons(run.directory(), case)?,
        None => Vec::new(),
    };
    if found.is_empty() {
        return Ok(());
    }
    let row = |of: &Comparison| {
        let deviation = of.deviation_text();
        let beyond = if of.violation().is_some() { ", violated" } else { "" };
        let bounds: Vec<String> = of.bounds.iter().map(|&bound| words::bound(bound)).collect();
        let bounds = if bounds.is_empty() { String::new() } else { bounds.join(", ") + beyond };
        vec![of.name(), digits(of.promised), digits(of.found), deviation, bounds]
    };
    let event = |of: &Comparison| {
        json!({
            "quantity": of.quantity, "load_case": of.load_case, "steps": of.steps, "promised": of.promised, "found": of.found,
            "deviation": of.deviation(), "violation": of.violation().map(|(_, by)| by),
        })
    };
    context.console.event("promises", json!({ "promises": found.iter().map(event).collect::<Vec<_>>() }));
    context.console.text("compared with what the design promised:");
    let mut rows = found.iter().map(row).collect::<Vec<_>>();
    let mut titles = vec!["quantity", "design", "part", "deviation", "bound"];
    if found.iter().all(|of| of.bounds.is_empty()) {
        titles.pop();
        rows.iter_mut().for_each(|row| row.truncate(titles.len()));
    }
    context.console.lines(&lines(&titles, &rows));
    for of in &found {
        let Some((bound, by)) = of.violation() else { continue };
        let by = beyond(bound, by);
        let (name, found, bound_text, promised) =
            (of.name(), digits(of.found), words::bound(bound), digits(of.promised));
        context.console.warning(&match of.was_violated(bound) {
            true => format!(
                "the part violates a bound, as did the design: `{name}` is {found}, {by} beyond {bound_text} (design: \
                 {promised}); optimize until the design meets it, or relax it"
            ),
            false => format!(
                "the part violates a bound that the design met: `{name}` is {found}, {by} beyond {bound_text} (design: \
                 {promised}); give the bound that much margin and optimize again, or compare on a finer mesh"
            ),
        });
    }
    Ok(())
}

/// The distance from a bound in words: beyond zero, the distance itself counts.
pub(super) fn beyond(bound: Bound, by: f64) -> String {
    match bound {
        Bound::AtMost(0.0) | Bound::AtLeast(0.0) => quantity(by),
        _ => format!("{:.1} %", 100.0 * by),
    }
}

/// The values of the objective in the load cases, as text; empty if there is only one load path.
fn shares(problem: &Problem, forward: &Forward) -> String {
    let names = &problem.load_cases;
    let Some(objective) = problem.analysis.objective.as_ref().filter(|_| !names.is_empty()) else {
        return String::new();
    };
    let axis = problem.analysis.axis();
    let values: Vec<(usize, f64)> = match objective.worst_of() {
        // the parts whose largest counts
        Some(cases) => cases.into_iter().zip(forward.parts.iter().copied()).collect(),
        None => objective.in_each_load_case(&forward.quantities[0], &axis),
    };
    let weights = if objective.is_mean() { "" } else { ", with weights" };
    let share = |(case, value): &(usize, f64)| Some(format!("{} {}", names.get(*case)?, digits(*value)));
    format!(": {}{weights}", values.iter().filter_map(share).collect::<Vec<_>>().join(", "))
}

fn solve(context: &Context, problem: &mut Problem, run: Option<&Run>, density: &ElementValues) -> Outcome {
    let directory = run.map(Run::directory);
    let mut watch = watch(context, problem, run)?.telling_steps();
    problem.analysis.measure(clock::wall);
    // the path is written while it is computed
    problem.analysis.set_density(density);
    let (design, cases) = (problem.analysis.design.clone(), problem.analysis.cases.clone());
    let designs = Designs::new(&design, &cases);
    let steps = problem.analysis.times.len() / cases.count();
    let recording = Recording::new(&problem.mesh, &problem.quantities, designs, steps);
    let mut writer = PathWriter::new(directory, &problem.mesh, designs, recording).live();
    let marched = problem.analysis.forward_only(density, &mut Both { watch: &mut watch, writer: &mut writer });
    let (recording, written) = writer.finish();
    let forward = match marched {
        Ok(forward) => forward,
        Err(error) => return Err(failed(problem, &error, run)),
    };
    first(problem, || {
        watch.check()?;
        written?;
        let write = |run: &RunDirectory| write_densities(&run.file("design.csv"), &problem.mesh, density, None, None);
        Ok(directory.map_or(Ok(()), write)?)
    })?;
    let quantities = match directory {
        // the file of the whole path is written at once
        Some(run) if run.vtkhdf() => write_path(directory, problem, &forward.path)?,
        _ => recording.finish(overlaps(problem, &forward.path)),
    };
    whole(context, &forward, problem.analysis.times.len())?;
    context.console.notice(forward.notice.as_ref());
    let Some(directory) = directory else { return Ok(()) };
    let (path, [open, stick, slip]) = (directory.path(), final_status(&forward));
    let objective = problem.analysis.objective.is_some().then_some(forward.value);
    let newton = forward.path.newton_iterations();
    context.console.event(
        "result",
        json!({
            "command": "solve", "directory": path, "objective": objective, "step_values": observed(&problem.analysis, &forward),
            "volume_fraction": volume_fraction(problem, density), "newton_iterations": newton,
            "failed_iterations": forward.path.failed_iterations(),
            "increments": forward.path.increments(), "open": open, "stick": stick, "slip": slip,
            "quantities": last_values(&quantities, problem), "phases": phases(&problem.analysis.timings()),
        }),
    );
    print_phases(context, "solution", &problem.analysis.timings());
    warn_of_fallbacks(context, &problem.analysis);
    if let Some(value) = objective {
        context.console.text(&format!("objective {}{}", digits(value), shares(problem, &forward)));
    }
    print_quantities(context, &quantities, problem);
    let failed = match forward.path.failed_iterations() {
        0 => String::new(),
        failed => format!(" and {failed} in failed attempts"),
    };
    context.console.text(&format!("{newton} Newton iterations{failed}; states in {}", path.join("path.pvd").display()));
    Ok(())
}

/// The watch of the run and the writer of its path.
struct Both<'w, 'a, 'p> {
    watch: &'w mut Watch<'a>,
    writer: &'w mut PathWriter<'p>,
}

impl MarchObserver for Both<'_, '_, '_> {
    fn on_event(&mut self, event: &MarchEvent<'_>) {
        // what is printed is already on disk
        self.writer.on_event(event);
        self.watch.on_event(event);
    }

    fn cancelled(&self) -> bool {
        self.watch.cancelled()
    }
}
