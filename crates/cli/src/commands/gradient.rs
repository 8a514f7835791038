//! `slipstick gradient`: objective and its derivative with respect to every density, friction,
//! moduli, motions and loads.

use serde_json::json;
use slipstick::build::Problem;
use slipstick::case::Case;
use slipstick::design::ElementValues;
use slipstick::model::Parameter;
use slipstick::output::fields::{DesignFields, write_design};
use slipstick::overlaps::overlaps;
use slipstick::run::{Run, RunDirectory, write_densities};
use slipstick_service::check::volume_fraction;

use crate::args::Gradient;
use crate::clock;
use crate::context::Context;
use crate::runs::{end, failed, first, start, watch};
use crate::setup::prepare;
use crate::summary::{digits, phases, print_phases, warn_of_fallbacks, whole};
use slipstick_service::failure::Outcome;

/// Marches, sweeps back, and writes the derivatives.
///
/// # Errors
/// As [`slipstick_service::failure::Failure`] lists them.
pub fn run(context: &Context, args: &Gradient) -> Outcome {
    let (setup, mut problem) = prepare(context, &args.case, &["dirichlet", "design", "objective"])?;
    let density = setup.density(context, &problem, &args.design)?;
    let run = start(context, &setup, &args.out, "gradient")?;
    let outcome = gradient(context, &setup.checked.resolved.case, &mut problem, run.as_ref(), &density);
    end(run, outcome)
}

fn gradient(
    context: &Context,
    case: &Case,
    problem: &mut Problem,
    run: Option<&Run>,
    density: &ElementValues,
) -> Outcome {
    let mut watch = watch(context, problem, run)?;
    let analysis = &mut problem.analysis;
    analysis.measure(clock::wall);
    let forward = match analysis.forward(density, &mut watch) {
        Ok(forward) => forward,
        Err(error) => return Err(failed(problem, &error, run)),
    };
    first(problem, || watch.check())?;
    whole(context, &forward, problem.analysis.times.len())?;
    context.console.notice(forward.notice.as_ref());
    context.console.overlaps(&overlaps(problem, &forward.path));
    if let Some(rounding) = &forward.rounding {
        context.console.warning(&format!("{rounding}; so are its derivatives"));
    }
    let marched = problem.analysis.timings();
    let gradients = match problem.analysis.gradients(&forward) {
        Ok(gradients) => gradients,
        Err(error) => return Err(failed(problem, &error, run)),
    };
    let spent = problem.analysis.timings() - marched;
    let (mesh, gradient) = (&problem.mesh, &gradients.density);
    let fields = DesignFields { iteration: 0, density, derivative: Some(gradient), variables: None };
    let write = |run: &RunDirectory| {
        write_densities(&run.file("gradient.csv"), mesh, density, Some(gradient), None)?;
        write_design(&run.file("gradient.vtu"), mesh, &fields, None)
    };
    first(problem, || Ok(run.map(Run::directory).map_or(Ok(()), write)?))?;
    let Some(path) = run.map(|run| run.directory().path()) else { return Ok(()) };
    let norm = gradient.iter().map(|value| value * value).sum::<f64>().sqrt();
    context.console.event(
        "result",
        json!({
            "command": "gradient", "directory": path, "objective": forward.value, "gradient_norm": norm,
            "volume_fraction": volume_fraction(problem, density),
            "parameters": gradients.parameters.iter().map(|&(parameter, derivative)| {
                let (kind, of) = name(case, parameter);
                json!({ "parameter": kind, "of": of, "derivative": derivative })
            }).collect::<Vec<_>>(),
            "phases": phases(&marched), "gradient_phases": phases(&spent),
        }),
    );
    print_phases(context, "solution", &marched);
    print_phases(context, "gradient", &spent);
    warn_of_fallbacks(context, &problem.analysis);
    context.console.text(&format!("objective {}, norm of its gradient {}", digits(forward.value), digits(norm)));
    let moves = |p: &Parameter| match p {
        Parameter::Amplitude { motion } => {
            case.dirichlet[*motion].motion.iter().any(|w| w.u != [0.0; 3] || w.angle != 0.0)
        }
        _ => true,
    };
    for &(parameter, derivative) in gradients.parameters.iter().filter(|(parameter, _)| moves(parameter)) {
        let (kind, of) = name(case, parameter);
        context.console.text(&format!("  with respect to {kind} of {of}: {}", digits(derivative)));
    }
    let file = path.join("gradient.csv");
    context.console.text(&format!("{} contains the derivatives with respect to the densities", file.display()));
    Ok(())
}

/// The kind of a parameter, and the part of the case that it belongs to.
fn name(case: &Case, parameter: Parameter) -> (&'static str, String) {
    match parameter {
        Parameter::Friction { interface } => {
            let contact = &case.contacts[interface];
            ("friction", format!("{} on {}", contact.slave, contact.master))
        }
        Parameter::YoungsModulus { body } => ("youngs_modulus", case.bodies[body].name.clone()),
        Parameter::Amplitude { motion } => {
            ("amplitude", format!("dirichlet[{motion}] ({})", case.dirichlet[motion].set))
        }
        Parameter::Preload { bolt } => ("amplitude", format!("bolt[{bolt}].force ({})", case.bolts[bolt].name)),
        Parameter::Load { load } => ("amplitude", format!("load[{load}] ({})", case.loads[load].target())),
        Parameter::Expansion { body } => ("thermal_expansion", case.bodies[body].name.clone()),
        Parameter::Temperature { change } => {
            let of = &case.temperatures[change];
            let place = of.body.as_ref().or(of.set.as_ref()).map_or("all bodies", String::as_str);
            ("amplitude", format!("temperature[{change}] ({place})"))
        }
    }
}
