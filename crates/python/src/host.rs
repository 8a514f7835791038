//! The interpreter as the host of requests.

use std::cell::RefCell;

use slipstick::case::CaseDiagnostic;
use slipstick::path::Interrupt;
use slipstick_service::failure::Outcome;
use slipstick_service::host::{Event, Host};
use slipstick_service::memory::Budget;

/// The host of the requests of one call. It prints nothing: the package returns warnings as data, and a
/// run keeps them.
#[derive(Default)]
pub struct Interpreter {
    /// The command line, for the record of a run.
    pub line: Vec<String>,
    /// What asks for signals, and whether a callback has failed.
    pub interrupt: Option<Interrupt>,
    /// Warnings about the case.
    pub warnings: RefCell<Vec<CaseDiagnostic>>,
}

impl Host for Interpreter {
    fn threads(&self, of_case: Option<usize>) -> Outcome<usize> {
        if let Some(threads) = of_case {
            // the threads serve the whole process: the first case that asks for them decides
            let _ = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
        }
        Ok(rayon::current_num_threads())
    }

    fn memory(&self) -> Budget {
        Budget::of_machine()
    }

    fn interrupt(&self) -> Option<Interrupt> {
        self.interrupt.clone()
    }

    fn line(&self) -> Vec<String> {
        self.line.clone()
    }

    fn tell(&self, event: Event<'_>) {
        if let Event::Warnings(warnings) = event {
            self.warnings.borrow_mut().extend_from_slice(warnings);
        }
    }
}
