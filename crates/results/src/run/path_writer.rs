//! Writes the load path, at once or while it is computed.

use std::borrow::Cow;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::PathBuf;

use slipstick_mesh::Mesh;
use slipstick_model::analysis::{Designs, pair_results};
use slipstick_model::model::{Design, LoadTime};
use slipstick_model::problem::Problem;
use slipstick_model::quantities::{Reached, Recording};
use slipstick_path::{Evaluated, MarchEvent, MarchObserver, StepState};

use super::fields::{Files, of_contact};
use super::tables::{ContactTable, quantity_heading, quantity_line, write_quantities};
use super::{RunDirectory, RunError};
use crate::output::{OutputError, Pvd, write_atomically};

/// Writes `path_XXXX.vtu` of every completed load step, including step 0, `path.pvd`, `contact.csv` and
/// `quantities.csv`.
///
/// As an observer of a march, it writes them while the path is computed: the state of a load step
/// before the step appears in the others, `path.pvd` atomically, and the tables by complete lines. The files
/// of a path do not depend on when they were written. All ranks have a writer, since forces are
/// summed over the ranks; only that of the first has a directory.
pub struct PathWriter<'a> {
    designs: Designs<'a>,
    recording: Recording<'a>,
    /// The load case in progress, of the march that is observed.
    case: Option<usize>,
    output: Option<PathFiles<'a>>,
    /// The first failure to write.
    error: Option<RunError>,
}

impl<'a> PathWriter<'a> {
    /// Of the paths of a problem.
    pub fn of(run: Option<&'a RunDirectory>, problem: &'a Problem) -> Self {
        Self::new(run, &problem.mesh, problem.analysis.designs(), Recording::of(problem))
    }

    /// Of a path that is recorded by `recording`.
    pub fn new(run: Option<&'a RunDirectory>, mesh: &'a Mesh, designs: Designs<'a>, recording: Recording<'a>) -> Self {
        let output = run.map(|run| PathFiles {
            run,
            designs,
            files: Files::new(run, mesh, designs),
            collection: Pvd::default(),
            contact: ContactTable::new(mesh),
            growing: None,
            previous: StepState::default(),
        });
        Self { designs, recording, case: None, output, error: None }
    }

    /// The same, and it writes after each load step.
    #[must_use]
    pub fn live(mut self) -> Self {
        if let Some(output) = &mut self.output {
            let table = |name| GrowingTable::new(output.run.file(name));
            output.growing = Some(["contact.csv", "quantities.csv"].map(table));
        }
        self
    }

    /// The path, which has this many load steps, is also written as one file if this is wanted.
    #[cfg(feature = "vtkhdf")]
    pub(super) fn series(&mut self, steps: usize) {
        if let Some(output) = &mut self.output {
            self.error = output.files.series(steps).err().map(RunError::from);
        }
    }

    /// Adds the next state, with the march's evaluation of it, if that is at hand. All ranks call it.
    pub fn add(&mut self, at: Reached, state: Cow<'a, StepState>, evaluated: Option<&Evaluated<Design>>) {
        let writes = self.output.as_mut().filter(|_| self.error.is_none());
        let Some(output) = writes else {
            self.recording.add(at, state, evaluated);
            return;
        };
        let now = state.clone();
        let first = self.recording.found().rows.is_empty();
        self.recording.add(at, state, evaluated);
        let step = at.completes.or(first.then_some(0));
        self.error = output.add(at, step, &now, &self.recording).err().map(RunError::from);
        output.previous = now.into_owned();
    }

    /// Completes the files. Returns the quantities, and on the first rank whether everything could be
    /// written.
    pub fn finish(self) -> (Recording<'a>, Result<(), RunError>) {
        let Self { recording, output, error, .. } = self;
        let written = match (output, error) {
            (_, Some(error)) => Err(error),
            (Some(output), None) => output.finish(&recording).map_err(RunError::from),
            (None, None) => Ok(()),
        };
        (recording, written)
    }
}

impl MarchObserver for PathWriter<'_> {
    fn on_event(&mut self, event: &MarchEvent<'_>) {
        let &MarchEvent::Accepted { state, evaluated } = event else { return };
        let LoadTime { case, .. } = state.time;
        if self.case != Some(case) {
            // each load case starts at rest
            self.case = Some(case);
            let time = LoadTime::start(case);
            let rest = self.designs.at(time).model().rest();
            self.add(Reached { time, completes: None, rest: true, holding_work: 0.0 }, Cow::Owned(rest), None);
        }
        let evaluated = evaluated.and_then(|evaluated| evaluated.downcast_ref());
        self.add(state.into(), Cow::Owned(state.state.clone()), evaluated);
    }
}

/// The files of a path, in the directory of a run.
struct PathFiles<'a> {
    run: &'a RunDirectory,
    designs: Designs<'a>,
    files: Files<'a>,
    collection: Pvd,
    contact: ContactTable<'a>,
    /// `contact.csv` and `quantities.csv`, if they grow with the path.
    growing: Option<[GrowingTable; 2]>,
    /// The last state.
    previous: StepState,
}

impl PathFiles<'_> {
    /// Adds the last recorded state, which completes load step `step`, if it completes one.
    fn add(
        &mut self,
        at: Reached,
        step: Option<usize>,
        now: &StepState,
        recording: &Recording<'_>,
    ) -> Result<(), OutputError> {
        let Some(step) = step else { return Ok(()) };
        let known = recording.last().map_or_else(
            || {
                let previous = if at.rest { now } else { &self.previous };
                Cow::Owned(of_contact(self.designs.at(at.time).contact_results(previous, now, at.time)))
            },
            Cow::Borrowed,
        );
        let name = RunDirectory::numbered("path", step);
        let row = recording.found().rows.last();
        self.files.save(&name, at.time, now, (&known, row.map_or(&[], |row| &row.slipped)))?;
        self.collection.add(at.time.on_axis(), self.run.in_series(&name))?;
        // a state that cannot be evaluated has no results
        if !known.contact.nodes.is_empty() {
            self.contact.add(step, at.time, &pair_results(self.designs.model(), &known.contact));
        }
        let Some([contact, quantities]) = &mut self.growing else { return Ok(()) };
        self.collection.save(&self.run.file("path.pvd"))?;
        contact.grow_to(self.contact.text())?;
        let heading = if quantities.length == 0 { quantity_heading("", recording.found()) } else { String::new() };
        quantities.grow(&(heading + &row.map_or(String::new(), |row| quantity_line("", row))))
    }

    fn finish(self, recording: &Recording<'_>) -> Result<(), OutputError> {
        self.collection.save(&self.run.file("path.pvd"))?;
        // a path that ends early must not go on with the steps of an earlier one
        let last = recording.found().rows.last().map_or(0, |row| row.step);
        let removed = self.run.remove_after("path", last);
        removed.map_err(OutputError::io("remove old load steps from", self.run.path()))?;
        self.contact.save(self.run)?;
        write_quantities(self.run, recording.found())?;
        self.files.finish()
    }
}

/// A table that grows by complete lines.
struct GrowingTable {
    path: PathBuf,
    /// Length so far. \[bytes\]
    length: usize,
}

impl GrowingTable {
    fn new(path: PathBuf) -> Self {
        Self { path, length: 0 }
    }

    /// Appends complete lines at once; the first ones, with the heading, replace an existing file.
    fn grow(&mut self, lines: &str) -> Result<(), OutputError> {
        if self.length == 0 {
            write_atomically(&self.path, |writer| writer.write_all(lines.as_bytes()))?;
        } else {
            let file = OpenOptions::new().append(true).open(&self.path);
            let appended = file.and_then(|mut file| file.write_all(lines.as_bytes()));
            appended.map_err(OutputError::io("write", &self.path))?;
        }
        self.length += lines.len();
        Ok(())
    }

    /// Appends what a text has in addition to the lines so far.
    fn grow_to(&mut self, text: &str) -> Result<(), OutputError> {
        let more = &text[self.length..];
        if more.is_empty() { Ok(()) } else { self.grow(more) }
    }
}
