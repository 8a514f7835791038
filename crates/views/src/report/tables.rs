//! The tables of a run for the page.

use std::collections::BTreeMap;
use std::fs;

use serde::Serialize;
use serde_json::{Value, json};

use super::origin::Origin;

use slipstick_results::run::{RunDirectory, RunError};

/// Columns and rows; numbers as JSON numbers, empty cells as `null`.
#[derive(Debug, Serialize)]
pub(super) struct Table {
    pub columns: Vec<String>,
    pub rows: Vec<Vec<Value>>,
}

/// The result of a gradient check.
#[derive(Debug, Serialize)]
pub(super) struct Checked {
    verdict: String,
    columns: Vec<&'static str>,
    rows: Vec<Vec<Value>>,
}

/// `quantities.csv`, if it exists.
pub(super) fn quantities(run: &RunDirectory) -> Result<Option<Table>, RunError> {
    optional(run, "quantities.csv")
}

/// Newton iterations of a design, per load step.
#[derive(Debug, Default, Serialize)]
pub(super) struct NewtonSteps {
    /// The design, for the title.
    what: String,
    step: Vec<u64>,
    iterations: Vec<u64>,
    failed: Vec<u64>,
    open: Vec<Option<u64>>,
    stick: Vec<Option<u64>>,
    slip: Vec<Option<u64>>,
}

/// `history.csv`, if it exists.
pub(super) fn history(run: &RunDirectory) -> Result<Option<Table>, RunError> {
    optional(run, "history.csv")
}

/// A table without commas in its cells, if it exists. Incomplete rows are left out.
pub(super) fn optional(run: &RunDirectory, name: &str) -> Result<Option<Table>, RunError> {
    let path = run.file(name);
    if !path.is_file() {
        return Ok(None);
    }
    let text = fs::read_to_string(&path).map_err(RunError::read(&path))?;
    let mut lines = text.lines();
    let columns: Vec<String> = lines.next().unwrap_or_default().split(',').map(str::to_owned).collect();
    let rows = lines.map(|line| line.split(',').map(cell).collect::<Vec<Value>>());
    let rows = rows.filter(|row| row.len() == columns.len()).collect();
    Ok(Some(Table { columns, rows }))
}

fn cell(text: &str) -> Value {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => json!(number),
        _ if text.is_empty() => Value::Null,
        _ => text.into(),
    }
}

/// The part of `newton.csv` for the design of the load path, if it exists; of an `optimization` whose path
/// belongs to no known design, for the last finished iteration. Of other runs, for the last analysis.
pub(super) fn newton(run: &RunDirectory, optimization: Option<Origin>) -> Result<Option<NewtonSteps>, RunError> {
    let path = run.file("newton.csv");
    if !path.is_file() {
        return Ok(None);
    }
    let text = fs::read_to_string(&path).map_err(RunError::read(&path))?;
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let column = |name: &str| header.iter().position(|found| *found == name);
    let needed = ["iteration", "step", "newton_iteration", "open", "stick", "slip"].map(column);
    let [Some(design), Some(step), Some(count), Some(open), Some(stick), Some(slip)] = needed else { return Ok(None) };
    let wanted = optimization.and_then(|of| of.path.or(of.newest)).map(|number| number as u64);
    // Per load step: Newton iterations, failed attempts, and the last status.
    let mut steps: BTreeMap<u64, (u64, u64, [Option<u64>; 3])> = BTreeMap::new();
    let (mut newest, mut before) = (0, None);
    for line in lines {
        // The reason for a failure comes last and may contain commas.
        let cells: Vec<&str> = line.splitn(header.len(), ',').collect();
        let number = |at: usize| cells.get(at).and_then(|cell| cell.parse::<u64>().ok());
        let (Some(of), Some(at)) = (number(design), number(step)) else { continue };
        // the result of an optimization is marched once more at its end
        if before.replace(of) != Some(of) && wanted.is_none_or(|wanted| wanted == of) {
            newest = of;
            steps.clear();
        }
        if of != newest {
            continue;
        }
        let entry = steps.entry(at).or_default();
        if number(count).is_some() {
            entry.0 += 1;
            entry.2 = [number(open), number(stick), number(slip)];
        } else {
            entry.1 += 1;
        }
    }
    let what = match optimization {
        Some(_) => format!(" of iteration {newest}"),
        None if newest > 0 => format!(" of analysis {}", newest + 1),
        None => String::new(),
    };
    let mut found = NewtonSteps { what, ..NewtonSteps::default() };
    for (number, (iterations, failed, [open, stick, slip])) in steps {
        found.step.push(number);
        found.iterations.push(iterations);
        found.failed.push(failed);
        found.open.push(open);
        found.stick.push(stick);
        found.slip.push(slip);
    }
    Ok(Some(found))
}

/// The gradient check from `verify.json`, if it exists.
pub(super) fn verify(run: &RunDirectory) -> Result<Option<Checked>, RunError> {
    let path = run.file("verify.json");
    if !path.is_file() {
        return Ok(None);
    }
    let text = fs::read_to_string(&path).map_err(RunError::read(&path))?;
    let damaged = |error: serde_json::Error| RunError::Damaged {
        path: path.clone(),
        reason: format!("is not the result of a verification: {error}"),
        cure: "run `slipstick verify gradient` again".into(),
    };
    let found: Value = serde_json::from_str(&text).map_err(damaged)?;
    let right = found["right"].as_bool().unwrap_or(false);
    let checks = found["checks"].as_array().cloned().unwrap_or_default();
    let worst = checks.iter().filter_map(|of| of["check"]["worst"].as_f64()).reduce(f64::max);
    let verdict = match (right, worst) {
        (true, Some(worst)) => format!("Confirmed: the adjoint agrees with the differences to {worst:.1e}."),
        (false, Some(worst)) => {
            format!("Not confirmed: the adjoint differs from the differences by up to {worst:.1e}.")
        }
        (_, None) => "Nothing could be compared.".into(),
    };
    let row = |quantity: &Value, direction: &Value| {
        let verdict = direction["verdict"].as_str().unwrap_or_default().replace('_', " ");
        let last = direction["quotients"].as_array().and_then(|all| all.last()).cloned().unwrap_or_default();
        let number = |name: &str| last[name].clone();
        vec![
            quantity.clone(),
            direction["name"].clone(),
            direction["adjoint"].clone(),
            number("difference"),
            direction["best"].clone(),
            number("order"),
            verdict.into(),
        ]
    };
    let rows = checks.iter().flat_map(|of| {
        let directions = of["check"]["directions"].as_array().cloned().unwrap_or_default();
        directions.iter().map(|direction| row(&of["quantity"], direction)).collect::<Vec<_>>()
    });
    let columns = vec![
        "quantity",
        "direction",
        "adjoint",
        "difference (smallest step)",
        "smallest relative error",
        "order",
        "verdict",
    ];
    Ok(Some(Checked { verdict, columns, rows: rows.collect() }))
}
