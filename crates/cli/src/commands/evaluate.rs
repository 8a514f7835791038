//! `slipstick evaluate`: a design under other coefficients of friction. Paper: Table 1.

use std::collections::BTreeMap;

use serde_json::json;
use slipstick::build::Problem;
use slipstick::design::ElementValues;
use slipstick::output::{Cell, Csv};
use slipstick::quantities::quantities;
use slipstick::run::{Run, write_evaluations};
use slipstick_service::check::volume_fraction;

use crate::args::Evaluate;
use crate::context::Context;
use crate::runs::{end, failed, start, watch};
use crate::setup::prepare;
use crate::summary::{case_values, digits, final_status, whole};
use crate::table::lines;
use slipstick_service::failure::{Failure, Outcome};

const COLUMNS: &[&str] = &[
    "friction",
    "objective",
    "volume_fraction",
    "objective_over_volume_fraction",
    "newton_iterations",
    "increments",
    "open",
    "stick",
    "slip",
];

/// Evaluates a design, once for each coefficient of friction.
///
/// # Errors
/// As [`Failure`] lists them. Where an analysis fails, the others still follow, and the last
/// failure is returned, to which the files of a failure belong.
pub fn run(context: &Context, args: &Evaluate) -> Outcome {
    let (setup, mut problem) = prepare(context, &args.case, &["dirichlet", "design", "objective", "contact"])?;
    let density = setup.density_of(context, &problem, &args.design)?;
    // on one rank, so that there is a run
    let Some(run) = start(context, &setup, &args.out, "evaluate")? else { return Ok(()) };
    let outcome = evaluate(context, &mut problem, &run, &density, &args.friction);
    end(Some(run), outcome)
}

fn evaluate(context: &Context, problem: &mut Problem, run: &Run, density: &ElementValues, friction: &[f64]) -> Outcome {
    let directory = run.directory();
    let own = own_friction(problem);
    let asked: Vec<Option<f64>> =
        if friction.is_empty() { vec![None] } else { friction.iter().copied().map(Some).collect() };
    let steps = problem.analysis.times.len();
    let fraction = volume_fraction(problem, density).unwrap_or(1.0);
    let mut csv = Csv::create(&directory.file("evaluate.csv"), COLUMNS)?;
    let mut watch = watch(context, problem, Some(run))?;
    context.console.start_bar(steps * asked.len(), 0);
    let (mut rows, mut paths) = (Vec::new(), Vec::new());
    let mut names: Vec<String> = Vec::new();
    let mut last_failure = None;
    for (number, &coefficient) in asked.iter().enumerate() {
        watch.begin(number, steps * number);
        let shown = coefficient.or(own);
        if let Some(coefficient) = coefficient {
            problem.analysis.set_friction(coefficient);
        }
        let forward = match problem.analysis.forward_only(density, &mut watch) {
            Ok(forward) => forward,
            Err(error) => {
                // the other coefficients may well converge
                let mut failure = failed(problem, &error, Some(run));
                if let (Failure::Analysis { report, .. }, Some(coefficient)) = (&mut failure, shown) {
                    report.cause = format!("with friction {coefficient}, {}", report.cause);
                }
                let mut cells: Vec<Cell> = vec![Cell::from(shown)];
                cells.resize(COLUMNS.len(), Cell::from(None::<f64>));
                csv.row(&cells)?;
                let mut row = vec![shown.map_or("as in the case".into(), |value| value.to_string()), "failed".into()];
                row.resize(6, String::new());
                rows.push(row);
                last_failure = Some(failure);
                continue;
            }
        };
        watch.check()?;
        whole(context, &forward, steps)?;
        context.console.notice(forward.notice.as_ref());
        let found = quantities(problem, &forward.path);
        context.console.overlaps(&found.overlaps);
        context.console.losses(&found.losses);
        context.console.coarse_friction(&found.coarse_friction);
        context.console.rough_pressures(&found.rough_pressures);
        context.console.on_void(&found.on_void);
        found.released.iter().for_each(|released| context.console.released(released));
        found.imbalance.iter().for_each(|found| context.console.imbalance(found));
        let values = case_values(&found, problem);
        names = values.iter().map(|(name, _)| name.clone()).collect();
        paths.push((shown, found));
        write_evaluations(directory, &paths)?;
        // a design without material has no ratio
        let ratio = Some(forward.value / fraction).filter(|ratio| ratio.is_finite());
        let [open, stick, slip] = final_status(&forward);
        let (newton, increments) = (forward.path.newton_iterations(), forward.path.increments());
        csv.row(&[
            shown.into(),
            forward.value.into(),
            fraction.into(),
            ratio.into(),
            newton.into(),
            increments.into(),
            open.into(),
            stick.into(),
            slip.into(),
        ])?;
        context.console.event(
            "evaluation",
            json!({
                "friction": shown, "objective": forward.value, "volume_fraction": fraction,
                "objective_over_volume_fraction": ratio, "newton_iterations": newton,
                "increments": increments, "open": open, "stick": stick, "slip": slip,
                "quantities": values.iter().cloned().collect::<BTreeMap<String, f64>>(),
            }),
        );
        rows.push(vec![
            shown.map_or("as in the case".into(), |value| value.to_string()),
            digits(forward.value),
            ratio.map_or_else(|| "–".into(), digits),
            open.to_string(),
            stick.to_string(),
            slip.to_string(),
        ]);
        rows.last_mut().into_iter().for_each(|row| row.extend(values.iter().map(|(_, value)| digits(*value))));
    }
    context.console.end_bar();
    context.console.text(&format!("volume fraction {fraction:.5}"));
    let mut header = vec!["friction", "objective", "objective/volume fraction", "open", "stick", "slip"];
    header.extend(names.iter().map(String::as_str));
    rows.iter_mut().for_each(|row| row.resize(header.len(), String::new()));
    context.console.lines(&lines(&header, &rows));
    let path = directory.path();
    context.console.event("result", json!({ "command": "evaluate", "directory": path, "evaluations": rows.len() }));
    last_failure.map_or(Ok(()), Err)
}

/// The case's coefficient of friction, if all its contact pairs have the same.
fn own_friction(problem: &Problem) -> Option<f64> {
    let mut all = problem.analysis.model().interfaces().iter().map(|interface| interface.friction);
    let first = all.next()?;
    all.all(|other| other == first).then_some(first)
}
