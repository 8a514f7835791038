//! The tables that grow while a run goes on.

use std::fs;

use slipstick_path::{MarchEvent, PathState};

use super::{RunDirectory, RunError};
use crate::optimize::IterationRecord;
use crate::output::{Cell, Csv, OutputError};

const HISTORY: &[&str] = &[
    "iteration",
    "objective",
    "volume_fraction",
    "change",
    "optimality",
    "newton_iterations",
    "uzawa_iterations",
    "increments",
    "open",
    "stick",
    "slip",
    "halvings",
    "seconds",
];

/// `history.csv`: one row per evaluated design.
#[derive(Debug)]
pub struct History {
    csv: Csv,
}

impl History {
    /// A table that keeps the rows of these designs, none for a new one.
    ///
    /// # Errors
    /// [`RunError::Output`]; of it [`OutputError::OtherTable`] if the file has fewer rows. [`RunError::Damaged`] if rows
    /// are not those of the designs, but for the seconds.
    pub fn open(run: &RunDirectory, designs: &[IterationRecord]) -> Result<Self, RunError> {
        let path = run.file("history.csv");
        let csv = Csv::resume(&path, HISTORY, designs.len())?;
        let text = fs::read_to_string(&path).map_err(RunError::read(&path))?;
        for (row, (line, record)) in text.lines().skip(1).zip(designs).enumerate() {
            let expected = csv.line(&cells(record, 0.0))?;
            let without_seconds = |line: &str| line.rsplit_once(',').map(|(cells, _)| cells.to_owned());
            if without_seconds(line) != without_seconds(&expected) {
                let reason = format!(
                    "line {} is not what this run wrote of iteration {row}: rows were changed, added or removed",
                    row + 2
                );
                let cure = "put the table back, or start anew with `slipstick optimize CASE --design RESULTS`".into();
                return Err(RunError::Damaged { path, reason, cure });
            }
        }
        Ok(Self { csv })
    }

    /// Adds an evaluated design and the seconds that it took.
    ///
    /// # Errors
    /// [`RunError::Output`].
    pub fn record(&mut self, record: &IterationRecord, seconds: f64) -> Result<(), RunError> {
        Ok(self.csv.row(&cells(record, seconds))?)
    }
}

fn cells(record: &IterationRecord, seconds: f64) -> [Cell; 13] {
    let [open, stick, slip] = record.status;
    [
        record.iteration.into(),
        record.objective.into(),
        record.volume_fraction.into(),
        record.change.into(),
        record.optimality.into(),
        record.newton_iterations.into(),
        record.uzawa_iterations.into(),
        record.increments.into(),
        open.into(),
        stick.into(),
        slip.into(),
        record.halvings.into(),
        ((seconds * 1e3).round() / 1e3).into(),
    ]
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

/// `newton.csv`: one row per Newton iteration of every accepted (sub-)step, and one per failed attempt, which has only
/// its reason in the column `failure`.
///
/// Columns: the design (or analysis) counted from 0, the user's load step, the pseudo-time at its end, and
/// [`slipstick_path::IterationRecord`].
#[derive(Debug)]
pub struct NewtonTable {
    csv: Csv,
    rows: usize,
    iteration: usize,
    step: usize,
    error: Option<OutputError>,
}

impl NewtonTable {
    /// A table that keeps its first `rows` rows, 0 for a new one.
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

    /// Rows so far.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Writes what an event tells. An observer cannot stop the march with an error, so a failure to write is kept for
    /// [`NewtonTable::check`].
    pub fn record(&mut self, event: &MarchEvent<'_>) {
        if self.error.is_some() {
            return;
        }
        let result = match event {
            MarchEvent::Accepted(state) => self.accepted(state),
            MarchEvent::Retry { step, time, failure, .. } => {
                // The first step once more: an update of the design was halved and marches from the start.
                self.step = *step;
                self.failed(*time, &failure.to_string())
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
                state.time.into(),
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

    fn failed(&mut self, time: f64, reason: &str) -> Result<(), OutputError> {
        let mut row: [Cell; 13] = std::array::from_fn(|_| Cell::Empty);
        row[0] = self.iteration.into();
        row[1] = self.step.into();
        row[2] = time.into();
        row[12] = reason.into();
        self.csv.row(&row)?;
        self.rows += 1;
        Ok(())
    }
}
