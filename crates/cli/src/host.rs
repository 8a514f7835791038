//! The program as the host of requests: its ranks and threads, and how it shows events.

use std::sync::Arc;

use crate::context::Context;
use serde_json::json;
use slipstick::check::{ContactSummary, Inspection};
use slipstick::linalg::Ranks;
use slipstick::machine::Machine;
use slipstick::path::Interrupt;
use slipstick::words::{counted, quantity};
use slipstick_service::failure::{Failure, Outcome};
use slipstick_service::host::{Event, Host};
use slipstick_service::memory::Budget;

/// Maximum number of threads on any machine, unless it has more cores.
const MOST_THREADS: usize = 1024;

impl Host for Context {
    fn ranks(&self) -> Arc<dyn Ranks> {
        self.parallel.ranks()
    }

    fn machine(&self, petsc: bool) -> Outcome<Machine> {
        self.parallel.machine(petsc)
    }

    fn threads(&self, of_case: Option<usize>) -> Outcome<usize> {
        let asked = self.common.threads.map(usize::from).or(of_case);
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = asked.unwrap_or(self.parallel.threads(cores));
        let most = cores.max(MOST_THREADS);
        if threads > most {
            let cure = format!("this machine has {cores} cores; more threads than cores do not help");
            return Err(Failure::input(format!("{threads} threads were requested; at most {most} are possible"), cure));
        }
        // This thread belongs to the pool: it takes part in each loop instead of handing it over.
        rayon::ThreadPoolBuilder::new().num_threads(threads).use_current_thread().build_global().map_err(|error| {
            Failure::input(format!("cannot start {threads} threads: {error}"), "request fewer with --threads")
        })?;
        Ok(threads)
    }

    fn memory(&self) -> Budget {
        Budget::of_machine()
    }

    fn interrupt(&self) -> Option<Interrupt> {
        let (interrupt, ranks) = (self.interrupt.clone(), self.parallel.ranks());
        Some(Arc::new(move || ranks.any(interrupt.requested())))
    }

    fn line(&self) -> Vec<String> {
        self.line.clone()
    }

    fn tell(&self, event: Event<'_>) {
        match event {
            Event::Warnings(warnings) => self.console.warnings(warnings),
            Event::Prepared(inspection) => {
                let pairs = inspection.contacts.iter().enumerate();
                for (pair, adjusted) in pairs.filter_map(|(pair, contact)| Some((pair, contact.adjusted?))) {
                    self.console.event("adjusted", json!({ "contact": pair, "adjusted": adjusted }));
                }
                self.console.lines(&adjusted(inspection));
            }
            Event::Started(started) => {
                self.console.keep_in(started.directory, started.command == "resume");
                self.console.event("start", json!(started));
            }
        }
    }
}

/// One line for each contact pair with `adjust`: what is removed, and what remains.
pub(crate) fn adjusted(inspection: &Inspection) -> Vec<String> {
    let line = |pair: &ContactSummary| {
        let at = pair.adjusted?;
        let removed = match at.at_node {
            None if at.gap == 0.0 => "no gap or penetration to remove".into(),
            None => "no gap to change".into(),
            Some(node) if at.gap == 0.0 => format!(
                "gaps and penetrations removed without stress at {}, the largest of {} at node {node}",
                counted(at.nodes, "node"),
                quantity(at.largest.abs())
            ),
            Some(node) => format!(
                "gaps of {} count as {}, the largest change of {} at node {node}",
                counted(at.nodes, "node"),
                quantity(at.gap),
                quantity(at.largest.abs())
            ),
        };
        let left = match at.left {
            0 => String::new(),
            left => {
                let why = match at.distance.filter(|_| !at.chosen) {
                    Some(distance) => format!("larger than {} and left", quantity(distance)),
                    None => "not adjusted".into(),
                };
                let deepest = match at.deepest_left > 0.0 {
                    true => format!(", with penetrations of up to {}", quantity(at.deepest_left)),
                    false => String::new(),
                };
                format!("; {why} at {}{deepest}", counted(left, "node"))
            }
        };
        Some(format!("{} on {}: {removed}{left}", pair.slave, pair.master))
    };
    inspection.contacts.iter().filter_map(line).collect()
}
