//! The main results of a run: objective, material, contact forces.

use serde::Serialize;
use serde_json::Value;
use slipstick_mesh::Mesh;

use super::MEASURES;
use super::named;
use super::origin::Origin;
use super::tables::{self, Table};
use crate::charts::objective_axis;
use crate::render::ObjectiveAxis;
use slipstick_case::check::{SectionSummary, sections};
use slipstick_case::file::{Bound, Case, Dimension};
use slipstick_model::optimize::FEASIBLE;
use slipstick_model::words::{self, quantity, vector};
use slipstick_results::run::{Comparison, RESPONSES, ResultRecord, RunDirectory, RunError, comparisons, load_density};

/// The numbers at the top of the page.
#[derive(Debug, Default, Serialize)]
pub(super) struct Summary {
    /// Name and value as text.
    rows: Vec<[String; 2]>,
    /// Description of θ.
    objective: String,
    /// Unit of θ, as written after its name.
    unit: String,
    /// Title of the chart of the objective.
    title: String,
    /// Whether the chart shows −θ, which is maximized.
    negated: bool,
    /// Regions of bodies with several materials.
    #[serde(skip_serializing_if = "Option::is_none")]
    materials: Option<Table>,
    /// Quantities of the case with their bounds, by load case.
    #[serde(skip_serializing_if = "Option::is_none")]
    quantities: Option<Table>,
    /// By load case and contact pair.
    #[serde(skip_serializing_if = "Option::is_none")]
    contact: Option<Table>,
    /// Values that the case promises, and those of the run.
    #[serde(skip_serializing_if = "Option::is_none")]
    promise: Option<Table>,
}

/// A row of `contact.csv`.
struct Transfer {
    step: u64,
    case: usize,
    pair: usize,
    force: [f64; 3],
    size: f64,
    pressure: f64,
}

impl Summary {
    /// Those of a run; `origin` says which designs its numbers belong to.
    pub(super) fn of(
        run: &RunDirectory,
        case: &Case,
        mesh: &Mesh,
        history: Option<&Table>,
        origin: Origin,
    ) -> Result<Self, RunError> {
        let of_newest = origin.of_newest();
        let (objective, unit, axis) = match own_objective(run)? {
            Some((about, unit)) => {
                let name = format!("Objective θ{unit}");
                (about, unit, ObjectiveAxis { name, negated: false })
            }
            None => {
                let unit = case.objective_dimension().map(|dimension| in_unit(case, dimension, dimension.symbol()));
                (case.objective_in_words().unwrap_or_default(), unit.unwrap_or_default(), objective_axis(case))
            }
        };
        let title = format!("{} ({})", axis.name, if axis.negated { "maximized" } else { "minimized" });
        let mut summary = Self { objective, unit, title, negated: axis.negated, ..Self::default() };
        let recalled = ResultRecord::read(run)?;
        let result = history.zip(recalled).and_then(|(history, of)| history.rows.get(of.iteration));
        let last = result.or(history.and_then(|history| history.rows.last()));
        if let Some(recalled) = recalled {
            summary.rows.push(["result: the best design, of iteration".into(), recalled.iteration.to_string()]);
        }
        if let Some(value) = last.and_then(|row| row.get(1)).and_then(Value::as_f64) {
            summary.rows.push([format!("objective θ{of_newest}{}", summary.unit), quantity(value)]);
        }
        if run.file("design.csv").is_file()
            && let Some(row) = material(case, mesh, &load_density(run.path(), mesh)?, &of_newest)
        {
            summary.rows.push(row);
        }
        if let Some(violation) = last.and_then(|row| violated(history?, row)) {
            summary
                .rows
                .push([format!("largest violation of a bound, relative to it{of_newest}"), quantity(violation)]);
        }
        summary.rows.extend(measured(run, case)?);
        summary.quantities = tables::quantities(run)?.and_then(|table| named::values(case, &table));
        summary.promise = promised(run, case)?;
        summary.materials = materials(case, mesh);
        if let Some(table) = tables::optional(run, "contact.csv")? {
            summary.contact = contact(case, &table);
        }
        Ok(summary)
    }

    /// Whether there is anything to show.
    pub(super) fn is_empty(&self) -> bool {
        let tables = [&self.quantities, &self.contact, &self.promise, &self.materials];
        self.rows.is_empty() && tables.iter().all(|table| table.is_none())
    }
}

/// The violation of a design, if it exceeds the tolerance of the optimizers.
fn violated(history: &Table, row: &[Value]) -> Option<f64> {
    let column = history.columns.iter().position(|name| name == "violation")?;
    row.get(column)?.as_f64().filter(|violation| *violation > FEASIBLE)
}

/// The thinnest member and the narrowest gap, if they were measured.
fn measured(run: &RunDirectory, case: &Case) -> Result<Vec<[String; 2]>, RunError> {
    let path = run.file(MEASURES);
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let text = std::fs::read_to_string(&path).map_err(RunError::read(&path))?;
    let found: Value = serde_json::from_str(&text).map_err(|error| RunError::Damaged {
        path: path.clone(),
        reason: format!("is not a list of measures: {error}"),
        cure: "run `slipstick export --measure` again".into(),
    })?;
    let unit = in_unit(case, Dimension::LENGTH, "L");
    let row = |key: &str, what: &str| {
        let numbers: Option<Vec<f64>> = found[key]["at"].as_array()?.iter().map(Value::as_f64).collect();
        let [x, y, z] = numbers?[..] else { return None };
        let length = quantity(found[key]["length"].as_f64()?);
        Some([format!("{what}{unit}"), format!("{length} at {}", vector([x, y, z]))])
    };
    let requested = found["requested"].as_f64();
    let requested = requested.map(|thickness| [format!("requested of both{unit}"), quantity(thickness)]);
    let rows = [row("member", "thinnest member"), row("gap", "narrowest gap"), requested];
    Ok(rows.into_iter().flatten().collect())
}

/// Promised values next to those of the run.
fn promised(run: &RunDirectory, case: &Case) -> Result<Option<Table>, RunError> {
    let found = comparisons(run, case)?;
    let mut columns: Vec<String> = vec!["quantity".into()];
    let cases = !case.load_cases.is_empty();
    if cases {
        columns.push("load case".into());
    }
    columns.extend(["design", "part", "deviation"].map(str::to_owned));
    let bounded = found.iter().any(|of| !of.bounds.is_empty());
    columns.extend(bounded.then(|| "bound".to_owned()));
    let row = |of: &Comparison| {
        let mut row: Vec<Value> = vec![format!("{}{}", of.quantity, of.at_steps()).into()];
        row.extend(cases.then(|| of.load_case.as_str().into()));
        let deviation = of.deviation_text();
        row.extend([quantity(of.promised).into(), quantity(of.found).into(), deviation.into()]);
        row.extend(bounded.then(|| verdicts(of).into()));
        row
    };
    let rows: Vec<Vec<Value>> = found.iter().map(row).collect();
    Ok((!rows.is_empty()).then_some(Table { columns, rows }))
}

/// The bounds that a design had to meet, and whether its part meets them.
fn verdicts(of: &Comparison) -> String {
    let verdict = |&bound: &Bound| {
        let sign = if bound.violation(of.found).0 > FEASIBLE { "✗" } else { "✓" };
        format!("{sign} {}", words::bound(bound))
    };
    of.bounds.iter().map(verdict).collect::<Vec<_>>().join("; ")
}

/// Description and unit of an objective that is not that of the case, which the run records.
fn own_objective(run: &RunDirectory) -> Result<Option<(String, String)>, RunError> {
    let path = run.file(RESPONSES);
    if !path.is_file() {
        return Ok(None);
    }
    let text = std::fs::read_to_string(&path).map_err(RunError::read(&path))?;
    let found: Value = serde_json::from_str(&text).map_err(|error| RunError::Damaged {
        path: path.clone(),
        reason: format!("is not a record of objective and constraints: {error}"),
        cure: "start a new run".into(),
    })?;
    // a run with constraints of its own alone has the objective of its case
    let Some(about) = found["about"].as_str() else { return Ok(None) };
    let unit = found["unit"].as_str().filter(|unit| !unit.is_empty());
    Ok(Some((about.to_owned(), unit.map_or(String::new(), |unit| format!(" [{unit}]")))))
}

/// The name of a unit in the case, otherwise the dimension.
pub(super) fn in_unit(case: &Case, of: Dimension, dimension: &str) -> String {
    let name = case.units.bracket(of);
    if name.is_empty() { format!(" [{dimension}]") } else { name }
}

/// The material in the design bodies, Σ φ V, and the fraction of them that it fills.
fn material(case: &Case, mesh: &Mesh, density: &[f64], of: &str) -> Option<[String; 2]> {
    let design = case.design.as_ref()?;
    let volumes = mesh.element_volumes();
    let bodies = || mesh.bodies.iter().filter(|body| design.bodies.contains(&body.name));
    let sum = |value: &dyn Fn(usize) -> f64| bodies().flat_map(|body| body.elements.clone()).map(value).sum::<f64>();
    let (filled, whole) = (sum(&|e| density[e] * volumes[e]), sum(&|e| volumes[e]));
    let names: Vec<&str> = bodies().map(|body| body.name.as_str()).collect();
    let bound = design.volume_fraction.map_or(String::new(), |bound| format!("; the bound is {bound}"));
    let text =
        format!("{} of {}, a fraction of {}{bound}", quantity(filled), quantity(whole), quantity(filled / whole));
    Some([format!("material in {}{of}{}", names.join(", "), in_unit(case, Dimension::VOLUME, "L³")), text])
}

/// The regions of bodies with several materials.
fn materials(case: &Case, mesh: &Mesh) -> Option<Table> {
    let volume = format!("volume{}", in_unit(case, Dimension::VOLUME, "L³"));
    let columns = ["body", "region", "elements", &volume, "material"].map(str::to_owned).to_vec();
    let row = |of: SectionSummary| {
        let volume = quantity(of.volume);
        vec![of.body.into(), of.region.into(), of.elements.into(), volume.into(), of.material.into()]
    };
    let rows: Vec<Vec<Value>> = sections(case, mesh).into_iter().map(row).collect();
    (!rows.is_empty()).then_some(Table { columns, rows })
}

/// Resultants and pressures of each pair, at the end of each load case and their largest values.
fn contact(case: &Case, table: &Table) -> Option<Table> {
    let column = |name: &str| table.columns.iter().position(|found| found == name);
    let names = ["step", "load_case", "contact", "force_x", "force_y", "force_z", "force", "peak_pressure"];
    let at: Vec<usize> = names.iter().filter_map(|name| column(name)).collect();
    let [step, load_case, pair, x, y, z, size, pressure] = at[..] else { return None };
    let transfers: Vec<Transfer> = table
        .rows
        .iter()
        .filter_map(|row| {
            let number = |at: usize| row[at].as_f64();
            Some(Transfer {
                step: number(step)? as u64,
                case: number(load_case)? as usize,
                pair: number(pair)? as usize,
                force: [number(x)?, number(y)?, number(z)?],
                size: number(size)?,
                pressure: number(pressure)?,
            })
        })
        .collect();
    let (force, stress) = (in_unit(case, Dimension::FORCE, "F"), in_unit(case, Dimension::STRESS, "F/L²"));
    let mut columns: Vec<String> = vec!["slave on master".into()];
    let cases = case.load_case_names();
    if !cases.is_empty() {
        columns.push("load case".into());
    }
    columns.extend([
        "last step".into(),
        format!("resultant on the slave at that step{force}"),
        format!("its magnitude{force}"),
        format!("largest magnitude on the path{force}"),
        format!("peak pressure at the last step{stress}"),
        format!("largest on the path{stress}"),
    ]);
    let mut rows = Vec::new();
    for (number, contact) in case.contacts.iter().enumerate() {
        for load_case in 0..cases.len().max(1) {
            let own: Vec<&Transfer> =
                transfers.iter().filter(|t| t.pair == number && t.case == load_case && t.step > 0).collect();
            let Some(last) = own.last() else { continue };
            let largest = |value: fn(&Transfer) -> f64| {
                let top = own.iter().max_by(|a, b| value(a).total_cmp(&value(b)));
                top.map_or(Value::Null, |top| format!("{} at step {}", quantity(value(top)), top.step).into())
            };
            let tie = if contact.tied { " (tie)" } else { "" };
            let mut row: Vec<Value> = vec![format!("{} on {}{tie}", contact.slave, contact.master).into()];
            // a tie also pulls: its tractions are those of a joint, largest at its edges
            let pressures = [quantity(last.pressure).into(), largest(|t| t.pressure)];
            row.extend(cases.get(load_case).map(|name| name.as_str().into()));
            row.extend([
                last.step.into(),
                // keep it on one line
                vector(last.force).replace(' ', "\u{a0}").into(),
                quantity(last.size).into(),
                largest(|t| t.size),
            ]);
            row.extend(pressures.map(|of| if contact.tied { "".into() } else { of }));
            rows.push(row);
        }
    }
    (!rows.is_empty()).then_some(Table { columns, rows })
}
