//! Runs on several ranks: which of them prints and writes, and how all of them end.
//!
//! All ranks do the same work, but only the first one prints and writes files. An analysis fails on
//! all ranks at once, and the first one reports it; a failure on a single rank, such as a full
//! disk, ends the others after a while.

use std::sync::Arc;
use std::time::Duration;

use crate::console::Console;
use slipstick::linalg::Ranks;
use slipstick::machine::Machine;
use slipstick_service::failure::{Failure, Outcome};
use slipstick_service::run::first;

/// How long a rank that may have failed alone waits for the others to end too.
const PATIENCE: Duration = Duration::from_secs(10);

/// How long a rank waits if the others are sure to end: the first one may have files to write.
const LONG: Duration = Duration::from_secs(24 * 3600);

/// Environment variables that MPI launchers set for each rank: OpenMPI, MPICH and Slurm's PMI,
/// PMIx.
const LAUNCHED: &[&str] = &["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK"];

/// The ranks of this program; there is one unless it was launched by MPI.
#[derive(Debug, Default)]
pub struct Parallel {
    #[cfg(feature = "petsc")]
    session: std::cell::OnceCell<slipstick::petsc::Session>,
}

impl Parallel {
    /// Joins the other ranks, if the program was launched by MPI.
    ///
    /// # Errors
    /// [`Failure::Input`] if PETSc cannot be started, or is not built in.
    pub fn join() -> Outcome<Self> {
        let parallel = Self::default();
        if Self::surrounded() {
            parallel.start()?;
        }
        Ok(parallel)
    }

    /// Whether this process was launched as a rank, possibly the only one, and was built to act as
    /// one.
    pub fn launched() -> bool {
        cfg!(feature = "petsc") && Self::surrounded()
    }

    /// Whether an MPI launcher started this process.
    fn surrounded() -> bool {
        LAUNCHED.iter().any(|variable| std::env::var_os(variable).is_some())
    }

    /// The machine on which problems are solved; `petsc` starts PETSc if it is not running.
    ///
    /// # Errors
    /// [`Failure::Input`] if PETSc cannot be started.
    pub fn machine(&self, petsc: bool) -> Outcome<Machine> {
        if petsc && cfg!(feature = "petsc") {
            self.start()?;
        }
        Ok(self.present())
    }

    /// The machine as it is now.
    fn present(&self) -> Machine {
        #[cfg(feature = "petsc")]
        if let Some(session) = self.session.get() {
            return Machine::of(session.clone());
        }
        Machine::default()
    }

    #[cfg(feature = "petsc")]
    fn start(&self) -> Outcome {
        if self.session.get().is_none() {
            let session = slipstick::petsc::Session::start()
                .map_err(|error| Failure::input(error.to_string(), "see docs/cluster.md"))?;
            let _ = self.session.set(session);
        }
        Ok(())
    }

    #[cfg(not(feature = "petsc"))]
    fn start(&self) -> Outcome {
        let several = std::env::var("OMPI_COMM_WORLD_SIZE").or(std::env::var("PMI_SIZE"));
        if several.is_ok_and(|size| size.trim().parse().is_ok_and(|size: usize| size > 1)) {
            let cure = "build it with `--features petsc` (docs/cluster.md), or run it without mpirun";
            return Err(Failure::input("this program was built without PETSc: it runs on one rank", cure));
        }
        Ok(())
    }

    /// The ranks themselves.
    pub fn ranks(&self) -> Arc<dyn Ranks> {
        self.present().ranks()
    }

    /// Number of ranks.
    pub fn size(&self) -> usize {
        self.present().ranks().size()
    }

    /// Whether this is the rank that prints and writes.
    pub fn leads(&self) -> bool {
        self.present().ranks().rank() == 0
    }

    /// Whether `here` is true on any rank.
    pub fn any(&self, here: bool) -> bool {
        self.present().ranks().any(here)
    }

    /// Number of threads for this rank on a machine with this many cores, which its ranks share.
    pub fn threads(&self, cores: usize) -> usize {
        #[cfg(feature = "petsc")]
        let here = self.session.get().map_or(1, |session| session.size_here());
        #[cfg(not(feature = "petsc"))]
        let here = 1;
        (cores / here).max(1)
    }

    /// Runs this rank's part of the program. If it panics, the other ranks are ended too, since
    /// they would wait forever.
    pub fn guard(&self, part: impl FnOnce() -> Outcome) -> Outcome {
        #[cfg(feature = "petsc")]
        if let Some(session) = self.session.get().filter(|_| self.size() > 1) {
            // nothing that the panic may have left half-done is used afterwards
            let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(part));
            return result.unwrap_or_else(|_| session.abort(101));
        }
        part()
    }

    /// The value that the first rank makes for all; `None` on the others.
    ///
    /// # Errors
    /// On all ranks, if it fails on the first.
    pub fn first<T>(&self, make: impl FnOnce() -> Outcome<T>) -> Outcome<Option<T>> {
        first(self.ranks().as_ref(), make)
    }

    /// Ends the program together with the other ranks, or aborts them if they do not arrive in
    /// time.
    pub fn leave(&self, console: &Console, result: &Outcome) {
        #[cfg(feature = "petsc")]
        if let Some(session) = self.session.get().filter(|_| self.size() > 1) {
            // an analysis fails on all ranks at once; other failures may have occurred only on this
            // rank
            let alone = matches!(result, Err(Failure::Input { .. } | Failure::Case(_)));
            if session.meet(if alone { PATIENCE } else { LONG }) {
                return;
            }
            // the first rank has reported its failure
            if let (false, Err(failure)) = (self.leads(), result) {
                console.speak(failure);
            }
            session.abort(result.as_ref().err().map_or(1, |failure| crate::exit::Exit::from(failure) as i32));
        }
        let _ = (console, result, PATIENCE, LONG);
    }
}
