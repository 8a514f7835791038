//! Ctrl-C: once, the run stops when the current attempt at a load step ends; twice, at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::console::complain;
use crate::exit::Exit;

/// What the first Ctrl-C is answered with. The book quotes it (docs/how_to.md).
pub const STOPPING: &str = "stopping when the current attempt at a load step ends; Ctrl-C again stops at once";

/// Whether the user wants to stop.
#[derive(Debug, Clone, Default)]
pub struct Interrupt {
    pressed: Arc<AtomicUsize>,
}

impl Interrupt {
    /// Listens to Ctrl-C, and to the request to terminate where the system has one; `speaks` tells that it was heard.
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
        // Without a handler the system's own ends the program at once, and what is on disk is good then too.
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
