//! What requests run on, and what they tell while they run.

use std::path::Path;
use std::sync::Arc;

use serde::Serialize;
use slipstick::case::CaseDiagnostic;
use slipstick::check::Inspection;
use slipstick::linalg::{Alone, Ranks};
use slipstick::machine::Machine;
use slipstick::path::Interrupt;

use crate::failure::Outcome;
use crate::memory::Budget;

/// What a front end gives its requests: ranks, threads, memory, and the user's wish to stop; and where
/// it hears of their events. On several ranks, each has one.
pub trait Host {
    /// The ranks that share the work.
    fn ranks(&self) -> Arc<dyn Ranks> {
        Arc::new(Alone)
    }

    /// The machine that solves problems; `petsc` says whether the case asks for PETSc.
    ///
    /// # Errors
    /// [`Failure::Input`](crate::failure::Failure::Input) if it cannot be started.
    fn machine(&self, _petsc: bool) -> Outcome<Machine> {
        Ok(Machine::default())
    }

    /// Starts the threads and returns their number; `of_case` is the number that the case asks for.
    ///
    /// # Errors
    /// [`Failure::Input`](crate::failure::Failure::Input) if they cannot be started.
    fn threads(&self, of_case: Option<usize>) -> Outcome<usize>;

    /// The memory that requests may use.
    fn memory(&self) -> Budget;

    /// What stops a computation within a load step or a sweep.
    fn interrupt(&self) -> Option<Interrupt> {
        None
    }

    /// The command line, for the record of a run.
    fn line(&self) -> Vec<String>;

    /// Hears of an event; on several ranks, only the first has those of its files.
    fn tell(&self, _event: Event<'_>) {}
}

/// What happens before a case computes. Events of the computation are those of
/// [`DriveObserver`](slipstick::drive::DriveObserver).
#[derive(Debug)]
pub enum Event<'a> {
    /// The case has what are probably mistakes.
    Warnings(&'a [CaseDiagnostic]),
    /// The case can run.
    Prepared(&'a Inspection),
    /// A run has begun to record.
    Started(Started<'a>),
}

/// A run that has begun to record.
#[derive(Debug, Clone, Serialize)]
pub struct Started<'a> {
    /// What was asked for: `solve`, `resume`, ….
    pub command: &'a str,
    /// Its directory.
    pub directory: &'a Path,
    /// Number of threads.
    pub threads: usize,
    /// The case, unless an earlier part of the run has told it.
    #[serde(flatten)]
    pub case: Option<StartedCase>,
}

/// The case of a run.
#[derive(Debug, Clone, Serialize)]
pub struct StartedCase {
    /// The case file, as the user names it.
    pub case: String,
    /// Free unknowns of a load step.
    pub unknowns: usize,
    /// Load steps.
    pub steps: usize,
}
