//! One measurement: a forward analysis and its gradient, with the time of each phase.

use std::sync::Arc;

use serde_json::{Map, Value, json};
use slipstick::analysis::{Analysis, AnalysisError, Designs};
use slipstick::build::Problem;
use slipstick::case::Resolved;
use slipstick::design::quantity::{ContactResultant, Displacement, ForcePart, Patch, Reaction};
use slipstick::design::{Bound, Constraint, ElementValues, ObservedSteps, Quantity, Response, VectorMeasure};
use slipstick::linalg::Ranks;
use slipstick::model::ContactModel;
use slipstick::path::{MarchEvent, MarchObserver, Silent, SolveCounts};
use slipstick::quantities::Recording;
use slipstick::run::{PathWriter, RunDirectory, RunError, write_path};
use slipstick_service::check;

use super::half_ball;
use crate::args::Bench;
use crate::clock;
use crate::context::Context;
use crate::setup::{Setup, look, read};
use crate::summary::phases;
use slipstick_service::failure::{Failure, Outcome};
use slipstick_service::memory;

/// Measures in this process, so that its peak memory is that of the analysis.
///
/// # Errors
/// Those of `solve` and `gradient`.
pub fn measure(context: &Context, args: &Bench) -> Outcome<Value> {
    let (setup, mut problem) = problem(context, args)?;
    let density = setup.density(context, &problem, &args.design)?;
    let steps = args.steps.map(|steps| steps.get());
    let steps = steps.or(args.case.is_none().then_some(half_ball::STEPS / 5));
    problem.analysis.times.truncate(steps.unwrap_or(usize::MAX));
    let analysis = &mut problem.analysis;
    let ranks = context.parallel.ranks();
    let now: fn() -> f64 = if args.cpu { clock::processor } else { clock::wall };
    analysis.measure(now);
    let (mut forward, marched) =
        timed(analysis, ranks.as_ref(), now, |analysis| analysis.forward(&density, &mut Silent))?;
    let (kept_states, kept_bytes) = (forward.path.states_with_factors(), forward.path.factor_bytes);
    let with_histories = forward.path.states_with_histories();
    let (mut gradient, mut recomputed) = (Value::Null, Value::Null);
    if analysis.objective.is_some() && kept_states > 0 {
        gradient = timed(analysis, ranks.as_ref(), now, |analysis| analysis.gradient(&forward))?.1;
        forward.path.forget_factors();
    }
    if analysis.objective.is_some() {
        recomputed = timed(analysis, ranks.as_ref(), now, |analysis| analysis.gradient(&forward))?.1;
    }
    let together = match args.responses {
        Some(count) => together(&mut problem, &density, count.get(), now)?,
        None => Value::Null,
    };
    let results = results(&mut problem, &density)?;
    let analysis = &mut problem.analysis;
    let [elements_here, slave_nodes_here] = analysis.model().counts_here();
    let counts = analysis.linear.counts();
    Ok(json!({
        "rank": ranks.rank(), "elements_here": elements_here, "slave_nodes_here": slave_nodes_here,
        "factor_bytes": counts.factor_bytes, "operations": counts.operations,
        "elements": problem.mesh.elements.len(), "unknowns": setup.checked.forecast.unknowns, "threads": setup.checked.threads, "clock": if args.cpu { "processor" } else { "wall" },
        "steps": forward.path.steps, "increments": forward.path.increments(),
        "newton_iterations": forward.path.newton_iterations(),
        "forward": marched, "gradient": gradient, "gradient_without_kept_factors": recomputed,
        "states_with_kept_factors": kept_states, "kept_bytes": kept_bytes, "states_with_histories": with_histories, "peak_bytes": memory::peak(),
        "objective": forward.value, "responses": together, "results": results,
    }))
}

/// Times of the gradients of one response, of three and of `count`, with kept factors: `[[number,
/// seconds], …]`.
fn together(problem: &mut Problem, density: &ElementValues, count: usize, now: fn() -> f64) -> Outcome<Value> {
    let failed = |error: AnalysisError| Failure::Check {
        message: format!("the analysis failed: {error}"),
        cure: "use a case for which `slipstick gradient` succeeds".into(),
    };
    let quantities: Vec<Arc<dyn Quantity>> = (0..count).map(|number| quantity(problem, number)).collect();
    let responses = quantities.into_iter().map(|of| Response::of(of, ObservedSteps::All, 1.0));
    let analysis = &mut problem.analysis;
    let mut responses = responses.collect::<Vec<_>>().into_iter();
    analysis.objective = responses.next();
    let constraint = |response| Constraint { response, bound: Bound::AtMost(1.0), corrected: true };
    let all: Vec<Constraint> = responses.map(constraint).collect();
    analysis.constraints = all.clone();
    let forward = analysis.forward(density, &mut Silent).map_err(failed)?;
    let mut rows = Vec::new();
    for number in [1, 3, count].into_iter().filter(|number| *number <= count) {
        analysis.constraints = all[..number - 1].to_vec();
        let begin = now();
        analysis.response_gradients(&forward, false).map_err(failed)?;
        rows.push(json!([number, now() - begin]));
    }
    Ok(rows.into())
}

/// One of many different quantities of a problem: components of the contact force of the first
/// pair, of the displacement of its slave nodes, and of the reaction of the last support.
fn quantity(problem: &Problem, number: usize) -> Arc<dyn Quantity> {
    let model = problem.analysis.model();
    let angle = number as f64;
    let along = VectorMeasure::Along([angle.cos(), angle.sin() * angle.cos(), angle.sin() * angle.sin()]);
    let slaves = model.slave_nodes();
    let supports = model.prescribed().owned();
    match number % 3 {
        1 if !slaves.is_empty() => {
            let nodes = slaves.into_iter().map(|node| (node, 1.0)).collect();
            let displacement = Displacement::new("displacement", nodes, problem.mesh.nodes.len(), along);
            Arc::new(displacement.expect("slave nodes are nodes of the mesh"))
        }
        2 if !supports.is_empty() => {
            let (_, unknowns) = supports[supports.len() - 1].clone();
            Arc::new(Reaction::new("reaction", unknowns, along).expect("a support prescribes displacements"))
        }
        _ => Arc::new(ContactResultant::new("force", Patch::whole(0), ForcePart::Resultant(along))),
    }
}

fn problem(context: &Context, args: &Bench) -> Outcome<(Setup, Problem)> {
    let with_memory = |mut resolved: Resolved| {
        let memory = &mut resolved.case.adjoint.memory;
        *memory = args.memory.unwrap_or(*memory);
        resolved
    };
    match (&args.case, args.sizes.first()) {
        (Some(path), _) => {
            let resolved = with_memory(read(&path.as_path().into())?);
            let (checked, problem) = check::prepare(context, resolved, &["dirichlet"], None)?;
            Ok((Setup::new(path, checked), problem))
        }
        (None, size) => {
            let name = "half_ball.toml";
            let text = half_ball::case(size.map_or(1000, |size| size.get()), "2 GiB");
            look(context, name.as_ref(), with_memory(slipstick::case::parse_case(&text, name)?))
        }
    }
}

/// The result of some work, its time, its solves, and the messages that this rank sent for it:
/// `{ seconds, phases: { solid, … }, solves: { … }, evaluations: { … }, calls, bytes_sent }`.
fn timed<T>(
    analysis: &mut Analysis,
    ranks: &dyn Ranks,
    now: fn() -> f64,
    work: impl FnOnce(&mut Analysis) -> Result<T, AnalysisError>,
) -> Outcome<(T, Value)> {
    let (told, before, counts, begin) = (ranks.traffic(), analysis.timings(), analysis.linear.counts(), now());
    let evaluated = analysis.model().evaluations();
    let result = work(analysis);
    let seconds = now() - begin;
    let spent = analysis.timings() - before;
    let result = result.map_err(|error| Failure::Check {
        message: format!("the analysis failed: {error}"),
        cure: "use a case for which `slipstick gradient` succeeds".into(),
    })?;
    Ok((
        result,
        json!({
            "seconds": seconds, "phases": phases(&spent), "solves": solves(counts, analysis.linear.counts()),
            "evaluations": evaluations(&evaluated, analysis.model()),
            "calls": ranks.traffic().calls - told.calls, "bytes_sent": ranks.traffic().bytes - told.bytes,
        }),
    ))
}

/// How often each thing has been evaluated since `before`: `{ name: count }`.
fn evaluations(before: &[(&'static str, u64)], model: &ContactModel) -> Value {
    let since = model.evaluations().into_iter().zip(before);
    since.map(|((name, now), (_, before))| (name.to_owned(), (now - before).into())).collect::<Map<_, _>>().into()
}

/// Load steps whose results are counted.
const COUNTED: usize = 3;

/// What quantities and files need while the path is marched, and of a path that is there: `{ increments, marched:
/// { evaluations }, later: { evaluations } }`, over the first load steps. The files are removed again.
fn results(problem: &mut Problem, density: &ElementValues) -> Outcome<Value> {
    if problem.analysis.model().share().is_part() {
        return Ok(Value::Null);
    }
    let times = problem.analysis.times.clone();
    problem.analysis.times.truncate(COUNTED);
    let directory = std::env::temp_dir().join(format!("slipstick-bench-{}", std::process::id()));
    let counted = RunDirectory::create(&directory, true).map(|run| counted(problem, &run, density));
    problem.analysis.times = times;
    // what cannot be removed is temporary anyway
    let _ = std::fs::remove_dir_all(&directory);
    counted.and_then(|counted| counted).map_err(|error| Failure::Check {
        message: format!("results cannot be written: {error}"),
        cure: "set TMPDIR to a directory that can be written".into(),
    })
}

fn counted(problem: &mut Problem, run: &RunDirectory, density: &ElementValues) -> Result<Value, RunError> {
    problem.analysis.set_density(density);
    let (design, cases) = (problem.analysis.design.clone(), problem.analysis.cases.clone());
    let (designs, steps) = (Designs::new(&design, &cases), problem.analysis.times.len());
    let recording = Recording::new(&problem.mesh, &problem.quantities, designs, steps);
    let model = design.model();
    let writer = PathWriter::new(Some(run), &problem.mesh, designs, recording).live();
    let mut counting = Counting { writer, model, counts: Map::new() };
    let marched = problem.analysis.forward_only(density, &mut counting);
    let Counting { writer, counts: marching, .. } = counting;
    writer.finish().1?;
    let Ok(forward) = marched else { return Ok(Value::Null) };
    let before = model.evaluations();
    write_path(Some(run), problem, &forward.path)?;
    let later = evaluations(&before, model);
    Ok(json!({
        "increments": forward.path.increments(), "marching": { "evaluations": marching },
        "later": { "evaluations": later },
    }))
}

/// Writes a path while it is marched, and counts what that takes.
struct Counting<'a> {
    writer: PathWriter<'a>,
    model: &'a ContactModel,
    /// Evaluations of each thing.
    counts: Map<String, Value>,
}

impl MarchObserver for Counting<'_> {
    fn on_event(&mut self, event: &MarchEvent<'_>) {
        let before = self.model.evaluations();
        self.writer.on_event(event);
        for ((name, now), (_, before)) in self.model.evaluations().into_iter().zip(before) {
            let count = self.counts.get(name).and_then(Value::as_u64).unwrap_or(0);
            self.counts.insert(name.to_owned(), (count + now - before).into());
        }
    }
}

/// The numbers of solves by kind between two counts.
fn solves(before: SolveCounts, after: SolveCounts) -> Value {
    json!({
        "factorizations": after.factorizations - before.factorizations,
        "with_earlier_factors": after.lagged - before.lagged,
        "iterations_of_these": after.lagged_iterations - before.lagged_iterations,
        "given_up": after.given_up - before.given_up,
    })
}
