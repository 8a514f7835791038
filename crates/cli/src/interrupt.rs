//! Ctrl-C: once, the run stops within a Newton iteration; twice, at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::console::complain;
use crate::exit::Exit;

/// Reply to the first Ctrl-C. The book quotes it (docs/how_to.md).
pub const STOPPING: &str = "stopping when the current Newton iteration ends; Ctrl-C again stops at once";

/// Whether the user wants to stop.
#[derive(Debug, Clone, Default)]
pub struct Interrupt {
    pressed: Arc<AtomicUsize>,
}

impl Interrupt {
    /// Listens for Ctrl-C, and for the request to terminate on systems that have one; `speaks`
    /// makes it print a reply.
    pub fn install(speaks: bool) -> Self {
        let interrupt = Self::default();
        let pressed = Arc::clone(&interrupt.pressed);
        let handler = move || {
            if pressed.fetch_add(1, Ordering::SeqCst) > 0 {
                std::process::exit(Exit::Interrupted as i32);
            }
            if !speaks {
                return;
            }
            complain(&format!("\n{STOPPING}\n"));
        };
        // Without this handler, the default one ends the program at once, and the files on disk are
        // valid then too.
        if let Err(error) = ctrlc::set_handler(handler) {
            complain(&format!("warning: Ctrl-C will stop at once: {error}\n"));
        }
        interrupt
    }

    /// Whether to stop.
    pub fn requested(&self) -> bool {
        self.pressed.load(Ordering::SeqCst) > 0
    }
}
