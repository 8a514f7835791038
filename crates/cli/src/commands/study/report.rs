//! Writes the numbers of a study as tables.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::json;
use slipstick::optimize::FEASIBLE;
use slipstick::output::{Cell, Csv, write_atomically};

use super::entry::{Entry, Word};
use super::expected::Ratio;
use super::file::Study as Plan;
use super::grid;
use super::tables::{Numbers, table};
use crate::context::Context;
use crate::summary::digits;
use slipstick_service::failure::Outcome;

/// Writes `numbers.csv`, with one row per number, and `tables.md`, for people, to the directory of
/// the results, and compares the numbers with the expected ones; returns how many do not match.
///
/// # Errors
/// [`slipstick_service::failure::Failure::Input`] if files cannot be written.
pub fn write(context: &Context, plan: &Plan, results: &Path, found: &[(&Entry, Numbers, f64)]) -> Outcome<usize> {
    let text = |holds| Cell::Text(if holds { "yes" } else { "no" }.into());
    let mut csv = Csv::create(&results.join("numbers.csv"), &["run", "quantity", "value", "as_expected"])?;
    let mut off = Vec::new();
    for (run, numbers, _) in found {
        let expected = plan.expected.runs.get(&run.name);
        for (name, &value) in numbers {
            let holds = expected.and_then(|expected| expected.get(name)).map(|expected| expected.holds(value));
            let cells = [run.name.as_str().into(), name.as_str().into(), value.into(), holds.map_or(Cell::Empty, text)];
            csv.row(&cells)?;
        }
        for (name, one) in expected.into_iter().flatten() {
            let value = numbers.get(name).copied().unwrap_or(f64::NAN);
            if !one.holds(value) {
                off.push(format!("{}: {name} is {value}; {one}", run.name));
            }
        }
    }
    let ratios = ratios(plan, found);
    for (ratio, value) in &ratios {
        let holds = ratio.is.holds(*value);
        let number = value.is_finite().then_some(*value);
        csv.row(&[ratio.of.0.as_str().into(), ratio.name().as_str().into(), number.into(), text(holds)])?;
        if !holds {
            off.push(format!("{}: {} is {value}; {}", ratio.of.0, ratio.name(), ratio.is));
        }
    }
    let mut text = vec![format!("# {}", if plan.file.title.is_empty() { "Study" } else { &plan.file.title })];
    text.extend(optimizations(context, found));
    text.extend(evaluations(context, found));
    for grid in plan.grids.iter().filter(|grid| found.iter().any(|(run, ..)| grid.runs().any(|one| *one == run.name))) {
        text.extend(grid::tabulate(context, grid, results, found)?);
    }
    let rows = ratios.iter().map(|(ratio, value)| vec![format!("{}: {}", ratio.of.0, ratio.name()), digits(*value)]);
    text.extend(table(context, &["", "ratio"], &rows.collect::<Vec<_>>()));
    write_atomically(&results.join("tables.md"), |writer| writeln!(writer, "{}", text.join("\n")))?;
    for line in &off {
        context.console.warning(line);
    }
    context.console.event("comparison", json!({ "off": off }));
    context.console.text(&format!("tables in {}", results.join("tables.md").display()));
    Ok(off.len())
}

/// The expected ratios whose two runs are both finished; NaN if a number is missing.
fn ratios<'a>(plan: &'a Plan, found: &[(&Entry, Numbers, f64)]) -> Vec<(&'a Ratio, f64)> {
    let number = |(run, quantity): &(String, String)| {
        let (_, numbers, _) = found.iter().find(|(one, ..)| one.name == *run)?;
        Some(numbers.get(quantity).copied().unwrap_or(f64::NAN))
    };
    let one = |ratio: &'a Ratio| Some((ratio, number(&ratio.of)? / number(&ratio.to)?));
    plan.expected.ratios.iter().filter_map(one).collect()
}

/// Runs that are not evaluations, one row each.
fn optimizations(context: &Context, found: &[(&Entry, Numbers, f64)]) -> Vec<String> {
    let runs: Vec<_> = found.iter().filter(|(run, ..)| run.command != Word::Evaluate).collect();
    let all = runs.iter().flat_map(|(_, numbers, _)| numbers.keys().map(String::as_str));
    let asymmetries: BTreeSet<&str> = all.filter(|name| name.starts_with("asymmetry ")).collect();
    let violated = |(_, numbers, _): &&(&Entry, Numbers, f64)| numbers.get("violation").is_some_and(|&v| v > FEASIBLE);
    let violation = runs.iter().copied().any(|run| violated(&run)).then_some("violation");
    let names = ["objective", "best_objective", "volume_fraction"].into_iter().chain(violation).chain(asymmetries);
    let names = names.chain(["gradient_error"]);
    let shown: Vec<&str> =
        names.filter(|name| runs.iter().any(|(_, numbers, _)| numbers.contains_key(*name))).collect();
    let cell = |numbers: &Numbers, name: &str| numbers.get(name).map_or(String::new(), |&value| digits(value));
    let rows = runs.iter().map(|(run, numbers, seconds)| {
        let mut row = vec![run.name.clone()];
        row.extend(shown.iter().map(|name| cell(numbers, name)));
        row.push(format!("{seconds:.0}"));
        row
    });
    let header = [&["run"], &shown[..], &["seconds"]].concat();
    table(context, &header, &rows.collect::<Vec<_>>())
}

/// Designs under different coefficients of friction: one row per coefficient, one column per
/// design; then the same divided by the volume fraction of each design. Paper: Table 1.
fn evaluations(context: &Context, found: &[(&Entry, Numbers, f64)]) -> Vec<String> {
    let runs: Vec<_> = found.iter().filter(|(run, ..)| run.command == Word::Evaluate).collect();
    let mut text = Vec::new();
    for quantity in ["objective", "objective_over_volume_fraction"] {
        let prefix = format!("{quantity} at ");
        let keys = runs.iter().flat_map(|(_, numbers, _)| numbers.keys());
        let mut frictions: Vec<&str> = keys.filter_map(|key| key.strip_prefix(&prefix)).collect();
        let number = |text: &str| text.parse::<f64>().unwrap_or(0.0);
        frictions.sort_by(|a, b| number(a).total_cmp(&number(b)));
        frictions.dedup();
        let rows: Vec<Vec<String>> = frictions
            .iter()
            .map(|friction| {
                let value = |numbers: &Numbers| numbers.get(&format!("{prefix}{friction}")).copied();
                let mut row = vec![format!("{quantity}, μ = {friction}")];
                row.extend(runs.iter().map(|(_, numbers, _)| value(numbers).map_or(String::new(), digits)));
                row
            })
            .collect();
        let header: Vec<&str> = std::iter::once("").chain(runs.iter().map(|(run, ..)| run.name.as_str())).collect();
        text.extend(table(context, &header, &rows));
    }
    text
}
