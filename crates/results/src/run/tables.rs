//! The tables that grow during a run.

use std::fs;

use slipstick_mesh::Mesh;
use slipstick_path::{FailedAttempt, MarchEvent, PathState};

use super::{RunDirectory, RunError};
use crate::output::{Cell, Csv, OutputError, write_atomically};
use slipstick_model::analysis::PairResult;
use slipstick_model::model::LoadTime;
use slipstick_model::optimize::{COLUMNS, IterationRecord, OptimizationState, SECONDS};
use slipstick_model::quantities::{FRICTION, PLACE, Quantities, QuantityRow};
use slipstick_model::words::rounded;

/// `history.csv`: one row per evaluated design ([`IterationRecord`]).
///
/// After the first columns, there are two for each function whose largest is the objective and for
/// each constraint: its value, under its name, and its multiplier. The volume fraction has only the
/// latter, since it is among the first. The last column is the wall time. \[s\]
#[derive(Debug)]
pub struct History {
    csv: Csv,
    names: FunctionNames,
}

/// Names of the functions of an optimization.
#[derive(Debug, Clone, Default)]
pub struct FunctionNames {
    /// Of those whose largest is the objective; empty if there is only one.
    pub parts: Vec<String>,
    /// Of the constraints.
    pub constraints: Vec<String>,
    /// Which constraints bound smooth values of extremes.
    pub extremes: Vec<usize>,
}

impl FunctionNames {
    /// Those of an optimization.
    pub fn of(state: &OptimizationState) -> Self {
        Self { parts: state.parts.clone(), constraints: state.constraints.clone(), extremes: state.extremes.clone() }
    }
}

impl History {
    /// A table that keeps the rows of these designs; a new table has none.
    ///
    /// # Errors
    /// [`RunError::Output`], with [`OutputError::OtherTable`] if the file has fewer rows;
    /// [`RunError::Damaged`] if rows differ from those of the designs, except in the seconds.
    pub fn open(run: &RunDirectory, names: FunctionNames, designs: &[IterationRecord]) -> Result<Self, RunError> {
        let path = run.file("history.csv");
        let columns = columns(&names);
        let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
        let csv = Csv::resume(&path, &columns, designs.len())?;
        let text = fs::read_to_string(&path).map_err(RunError::read(&path))?;
        for (row, (line, record)) in text.lines().skip(1).zip(designs).enumerate() {
            let expected = csv.line(&cells(&names, record, 0.0))?;
            let without_seconds = |line: &str| line.rsplit_once(',').map(|(cells, _)| cells.to_owned());
            if without_seconds(line) != without_seconds(&expected) {
                let reason = format!(
                    "line {} is not what this run wrote for iteration {row}: rows were changed, added or removed",
                    row + 2
                );
                let cure = "restore the table, or start a new run with `slipstick optimize CASE --design RESULTS`";
                return Err(RunError::Damaged { path, reason, cure: cure.into() });
            }
        }
        Ok(Self { csv, names })
    }

    /// Adds an evaluated design and the seconds that it took.
    ///
    /// # Errors
    /// [`RunError::Output`].
    pub fn record(&mut self, record: &IterationRecord, seconds: f64) -> Result<(), RunError> {
        Ok(self.csv.row(&cells(&self.names, record, seconds))?)
    }
}

/// The bound on the volume, whose value is among the first columns.
const VOLUME: &str = "volume_fraction";

fn columns(FunctionNames { parts, constraints, extremes }: &FunctionNames) -> Vec<String> {
    let parts = || parts.iter().map(|name| format!("objective_{name}"));
    let values = parts().chain(constraints.iter().filter(|name| *name != VOLUME).cloned());
    let multipliers = parts().chain(constraints.iter().cloned()).map(|name| format!("multiplier_{name}"));
    let first = COLUMNS.iter().map(|(name, _)| (*name).to_owned());
    let extremes = extremes.iter().filter_map(|&number| constraints.get(number));
    let extremes = extremes.map(|name| slipstick_design::extreme_of(name));
    first.chain(values).chain(extremes).chain(multipliers).chain([SECONDS.to_owned()]).collect()
}

fn cells(names: &FunctionNames, record: &IterationRecord, seconds: f64) -> Vec<Cell> {
    let mut cells: Vec<Cell> = COLUMNS.iter().map(|(_, value)| value(record).into()).collect();
    let named = || names.constraints.iter().zip(&record.constraints);
    cells.extend(record.parts.iter().map(|part| Cell::from(part.value)));
    cells.extend(named().filter(|(name, _)| *name != VOLUME).map(|(_, constraint)| Cell::from(constraint.value)));
    let extremes = names.extremes.iter().filter_map(|&number| record.constraints.get(number));
    cells.extend(extremes.map(|constraint| Cell::from(constraint.extreme)));
    cells.extend(record.parts.iter().chain(&record.constraints).map(|function| Cell::from(function.multiplier)));
    cells.push(((seconds * 1e3).round() / 1e3).into());
    cells
}

const CONTACT: &str =
    "step,load_case,time,contact,force_x,force_y,force_z,force,peak_pressure,peak_node,peak_x,peak_y,peak_z\n";

/// `contact.csv`: what each contact pair transfers at the end of each load step.
///
/// Columns: the load step, counted through all load cases; the load case, from 0, and pseudo-time
/// within it; the number of the `[[contact]]` table, from 0; the resultant of the contact forces on
/// the slave, friction included, and its magnitude \[F\]; the largest contact pressure at a slave
/// node \[F/L²\], that node and its reference position \[L\], empty if no node is under pressure.
#[derive(Debug)]
pub struct ContactTable<'a> {
    mesh: &'a Mesh,
    text: String,
}

impl<'a> ContactTable<'a> {
    /// A table without rows, for this mesh.
    pub fn new(mesh: &'a Mesh) -> Self {
        Self { mesh, text: CONTACT.to_owned() }
    }

    /// Adds a load step.
    pub fn add(&mut self, step: usize, LoadTime { case, t: time }: LoadTime, pairs: &[PairResult]) {
        let time = rounded(time, 12);
        for (number, pair) in pairs.iter().enumerate() {
            // write −0 as 0
            let [x, y, z] = pair.force.map(|f| f + 0.0);
            let (size, peak) = (pair.force_size(), pair.peak_pressure);
            let node = pair.peak_node.map_or_else(
                || ",,,".to_owned(),
                |node| {
                    let [x, y, z] = self.mesh.nodes[node as usize];
                    format!("{node},{x:?},{y:?},{z:?}")
                },
            );
            self.text += &format!("{step},{case},{time:?},{number},{x:?},{y:?},{z:?},{size:?},{peak:?},{node}\n");
        }
    }

    /// The table; empty if no pair has a row.
    pub fn text(&self) -> &str {
        if self.text == CONTACT { "" } else { &self.text }
    }

    /// Writes the table, completely or not at all; nothing if no pair has a row.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn save(&self, run: &RunDirectory) -> Result<(), OutputError> {
        if self.text().is_empty() {
            return Ok(());
        }
        write_atomically(&run.file("contact.csv"), |writer| writer.write_all(self.text.as_bytes()))
    }
}

/// Writes `quantities.csv`, completely or not at all: one row per load step and one column per
/// quantity ([`slipstick_model::quantities`]), after the load step, counted through all load cases;
/// the load case, from 0; and pseudo-time within it. A cell is empty if the state can no longer be
/// evaluated.
///
/// # Errors
/// [`OutputError::Io`].
pub fn write_quantities(run: &RunDirectory, quantities: &Quantities) -> Result<(), OutputError> {
    write_paths(run, "", &[(String::new(), quantities)])
}

/// Writes `quantities.csv` of several evaluations of a design, as [`write_quantities`] does, with
/// the coefficient of friction as the first column; the cells of that column are empty if the
/// contact pairs have different coefficients.
///
/// # Errors
/// [`OutputError::Io`].
pub fn write_evaluations(run: &RunDirectory, evaluations: &[(Option<f64>, Quantities)]) -> Result<(), OutputError> {
    let cell = |friction: &Option<f64>| friction.map_or(",".to_owned(), |friction| format!("{friction:?},"));
    let paths: Vec<(String, &Quantities)> = evaluations.iter().map(|(friction, path)| (cell(friction), path)).collect();
    write_paths(run, &format!("{FRICTION},"), &paths)
}

/// Rows of several paths, each with leading cells, under the names of the first.
fn write_paths(run: &RunDirectory, heading: &str, paths: &[(String, &Quantities)]) -> Result<(), OutputError> {
    let Some((_, first)) = paths.first() else { return Ok(()) };
    write_atomically(&run.file("quantities.csv"), |writer| {
        writer.write_all(quantity_heading(heading, first).as_bytes())?;
        for (leading, row) in paths.iter().flat_map(|(leading, path)| path.rows.iter().map(move |row| (leading, row))) {
            writer.write_all(quantity_line(leading, row).as_bytes())?;
        }
        Ok(())
    })
}

/// The first line of `quantities.csv`.
pub(super) fn quantity_heading(leading: &str, quantities: &Quantities) -> String {
    let names: String = quantities.names.iter().map(|quantity| format!(",{}", quantity.name)).collect();
    format!("{leading}{}{names}\n", PLACE.join(","))
}

/// A line of `quantities.csv`.
pub(super) fn quantity_line(leading: &str, row: &QuantityRow) -> String {
    let LoadTime { case, t: time } = row.time;
    let cell = |value: &f64| if value.is_finite() { format!(",{value:?}") } else { ",".to_owned() };
    let cells: String = row.values.iter().map(cell).collect();
    format!("{leading}{},{case},{:?}{cells}\n", row.step, rounded(time, 12))
}

const NEWTON: &[&str] = &[
    "iteration",
    "step",
    "time",
    "newton_iteration",
    "residual",
    "contact",
    "displacement",
    "multiplier",
    "step_length",
    "open",
    "stick",
    "slip",
    "failure",
];

/// `newton.csv`: one row per Newton iteration of every accepted (sub-)step, and one per failed
/// attempt, with its number of Newton iterations, and its rung and reason in the column `failure`.
///
/// Columns: the design (or analysis) counted from 0, the user's load step, the pseudo-time at its
/// end, and [`slipstick_path::IterationRecord`].
#[derive(Debug)]
pub struct NewtonTable {
    csv: Csv,
    rows: usize,
    iteration: usize,
    step: usize,
    error: Option<OutputError>,
}

impl NewtonTable {
    /// A table that keeps its first `rows` rows; 0 for a new table.
    ///
    /// # Errors
    /// [`RunError::Output`].
    pub fn open(run: &RunDirectory, rows: usize) -> Result<Self, RunError> {
        let csv = Csv::resume(&run.file("newton.csv"), NEWTON, rows)?;
        Ok(Self { csv, rows, iteration: 0, step: 1, error: None })
    }

    /// The rows that follow belong to this design.
    pub fn begin(&mut self, iteration: usize) {
        self.iteration = iteration;
        self.step = 1;
    }

    /// Number of rows so far.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Writes the contents of an event. An observer cannot stop the march with an error, so a
    /// failure to write is kept for [`NewtonTable::check`].
    pub fn record(&mut self, event: &MarchEvent<'_>) {
        if self.error.is_some() {
            return;
        }
        let result = match event {
            MarchEvent::Accepted { state, .. } => self.accepted(state),
            MarchEvent::Retry { step, failed, .. } => {
                // The first step again: an update of the design was halved, and the march restarts.
                self.step = *step;
                self.failed(failed)
            }
        };
        self.error = result.err();
    }

    /// The first failure to write, once.
    ///
    /// # Errors
    /// That failure.
    pub fn check(&mut self) -> Result<(), RunError> {
        self.error.take().map_or(Ok(()), |error| Err(error.into()))
    }

    fn accepted(&mut self, state: &PathState) -> Result<(), OutputError> {
        let step = state.completes.unwrap_or(self.step);
        for at in &state.report.iterations {
            let [open, stick, slip] = at.status;
            self.csv.row(&[
                self.iteration.into(),
                step.into(),
                state.time.on_axis().into(),
                at.iteration.into(),
                at.residual.into(),
                at.contact.into(),
                at.displacement.into(),
                at.multiplier.into(),
                at.step_length.into(),
                open.into(),
                stick.into(),
                slip.into(),
                Cell::Empty,
            ])?;
            self.rows += 1;
        }
        self.step = step + usize::from(state.completes.is_some());
        Ok(())
    }

    fn failed(&mut self, failed: &FailedAttempt) -> Result<(), OutputError> {
        let FailedAttempt { time, rung, kind, iterations } = failed;
        let mut row: [Cell; 13] = std::array::from_fn(|_| Cell::Empty);
        row[0] = self.iteration.into();
        row[1] = self.step.into();
        row[2] = time.on_axis().into();
        row[3] = (*iterations).into();
        let reason = format!("{rung}: {kind}");
        row[12] = reason.as_str().into();
        self.csv.row(&row)?;
        self.rows += 1;
        Ok(())
    }
}
