//! What a run warns of, and how it keeps this.

use std::path::Path;

use slipstick::design::extreme_of;
use slipstick::optimize::{FEASIBLE, IterationRecord, MostViolated, Optimization};
use slipstick::run::{RunDirectory, RunWarning};
use slipstick::words::quantity;

/// The warning about the constraint that a design violates most, if it violates one.
pub fn violation(optimization: &Optimization, record: &IterationRecord) -> Option<String> {
    let MostViolated { name, value, of_extreme, violation } = optimization.most_violated(record)?;
    let value = quantity(value);
    // the column of the value, so that it is not mistaken for the smooth one
    let what = if of_extreme { format!("the extreme `{}`", extreme_of(name)) } else { format!("`{name}`") };
    Some(if record.violation > FEASIBLE {
        format!(
            "the design violates its constraints: the largest relative violation is {violation:.3} ({what} is {value}; \
             columns of history.csv); more iterations may reduce it, unless constraints contradict each other"
        )
    } else {
        // with `corrected = false`
        format!(
            "the smooth measure `{name}` meets its bound, but the extreme for which it stands, {value}, violates it by \
             {:.2} %; without `corrected = false`, the bound holds for the extreme",
            100.0 * violation
        )
    })
}

/// Warnings so far, and the run that keeps them.
///
/// A warning that cannot be written is only printed: if the disk is full, the tables of the run fail
/// with an error.
#[derive(Debug, Default)]
pub struct KeptWarnings {
    all: Vec<RunWarning>,
    /// The run, opened to be read: its lock belongs to the command.
    run: Option<RunDirectory>,
    /// Whether warnings are about the result.
    of_result: bool,
    /// Whether the file has other warnings than `all`: a resumed run changes no file before it goes on.
    outdated: bool,
}

impl KeptWarnings {
    /// Keeps warnings in the directory of a run that has started or is `resumed`.
    pub fn begin(&mut self, run: &Path, resumed: bool) {
        self.run = RunDirectory::open(run).ok();
        let earlier = self.run.as_ref().filter(|_| resumed).and_then(|run| RunWarning::read(run).ok());
        let new = std::mem::take(&mut self.all);
        let known = earlier.as_ref().is_some_and(|all| !all.is_empty());
        self.all = earlier.unwrap_or_default().into_iter().filter(|warning| !warning.of_result).collect();
        for warning in new {
            self.all.extend((!self.has(&warning.message)).then_some(warning));
        }
        // also if none is left, because the earlier part had some of its result
        self.outdated = known || !self.all.is_empty();
        if !resumed {
            self.update();
        }
    }

    /// The warnings that follow are about the result.
    pub fn judge_result(&mut self) {
        self.of_result = true;
        self.update();
    }

    /// Writes the warnings of a resumed run that are not written yet: it goes on.
    pub fn update(&mut self) {
        if std::mem::take(&mut self.outdated) {
            self.write();
        }
    }

    /// Adds a warning, unless the run has it.
    pub fn add(&mut self, message: &str, help: Option<&str>) {
        if self.has(message) {
            return;
        }
        let (message, help) = (message.to_owned(), help.filter(|help| !help.is_empty()).map(str::to_owned));
        self.all.push(RunWarning { message, help, of_result: self.of_result });
        self.outdated = false;
        self.write();
    }

    fn has(&self, message: &str) -> bool {
        self.all.iter().any(|known| known.message == message)
    }

    fn write(&self) {
        if let Some(run) = &self.run {
            let _ = RunWarning::write(&self.all, run);
        }
    }
}
