//! Watches marches and sweeps: Ctrl-C, progress and the callbacks of an optimization.

use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use pyo3::prelude::*;
use serde_json::json;
use slipstick::crushed::{CURE, RESCUED};
use slipstick::drive::{DesignEvaluated, DriveObserver};
use slipstick::optimize::{Optimization, StopCriteria};
use slipstick::path::{Interrupt, MarchEvent, MarchObserver};
use slipstick::pieces;
use slipstick::run::{ResultRecord, Run};
use slipstick_service::warnings::{KeptWarnings, violation};

use crate::errors::Error;
use crate::host::Interpreter;

/// Interval at which the interpreter is asked for signals. Each request takes up to its switch
/// interval of 5 ms if other Python threads are computing.
pub const PAUSE: Duration = Duration::from_millis(50);

/// The observer of all analyses of a call.
pub struct Watch {
    /// `progress(steps completed, Newton iterations, [open, stick, slip])`, after each (sub-)step.
    progress: Option<Py<PyAny>>,
    /// `callback(record as JSON, seconds, outlook as JSON)`, after each design of an optimization.
    callback: Option<Py<PyAny>>,
    /// When the optimization ends, as JSON.
    outlook: String,
    signals: Arc<Mutex<Signals>>,
    /// Warnings about the designs of an optimization, each once.
    pub warnings: Vec<String>,
    /// The same and those about the case, which the run keeps.
    kept: KeptWarnings,
    crushed: bool,
    /// Whether the previous design had loose pieces.
    loose: bool,
    steps: usize,
    newton_iterations: usize,
}

/// What stops a call.
struct Signals {
    /// The exception of a callback or a signal handler.
    raised: Option<PyErr>,
    asked: Instant,
}

impl Signals {
    fn call(&mut self, call: impl FnOnce(Python<'_>) -> PyResult<()>) {
        if self.raised.is_none() {
            self.raised = Python::attach(call).err();
        }
    }

    fn stop(&mut self) -> bool {
        if self.asked.elapsed() >= PAUSE {
            self.call(|py| py.check_signals());
            self.asked = Instant::now();
        }
        self.raised.is_some()
    }
}

fn locked(signals: &Mutex<Signals>) -> MutexGuard<'_, Signals> {
    signals.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Watch {
    /// Watches analyses of one call.
    pub fn new(progress: Option<Py<PyAny>>, callback: Option<Py<PyAny>>) -> Self {
        let signals = Arc::new(Mutex::new(Signals { raised: None, asked: Instant::now() }));
        Self {
            progress,
            callback,
            outlook: String::new(),
            signals,
            warnings: Vec::new(),
            kept: KeptWarnings::default(),
            crushed: false,
            loose: false,
            steps: 0,
            newton_iterations: 0,
        }
    }

    /// Keeps warnings in the directory of a run that has started or is `resumed`, with those about its
    /// case.
    pub fn keep_in(&mut self, run: &Path, resumed: bool, host: &Interpreter) {
        self.kept.begin(run, resumed);
        for about_case in host.warnings.borrow().iter() {
            self.kept.add(about_case.message(), Some(about_case.help()));
        }
    }

    fn warn(&mut self, message: &str, help: &str) {
        self.kept.add(message, Some(help));
        self.warnings.push(if help.is_empty() { message.to_owned() } else { format!("{message}\n{help}") });
    }

    /// Warns of what is wrong with the result of an optimization.
    pub fn judge_result(&mut self, optimization: &Optimization, run: Option<&Run>) {
        self.kept.judge_result();
        let history = &optimization.state.history;
        // the result, if it is not the last design
        let recalled = run.and_then(|run| ResultRecord::read(run.directory()).ok().flatten());
        let record = recalled.and_then(|recalled| history.get(recalled.iteration)).or(history.last());
        if let Some(message) = record.and_then(|record| violation(optimization, record)) {
            self.warn(&message, "");
        }
        let density = optimization.evaluated().map(|design| &design.density);
        if let Some(loose) = density.and_then(|density| optimization.problem.loose_pieces(density)) {
            self.warn(&loose.to_string(), pieces::CURE);
        }
    }

    /// Tells the callback when this optimization ends: after so many updates, or earlier, after the
    /// last entry of the schedule, at the first design that meets all criteria.
    pub fn expect(&mut self, optimization: &Optimization) {
        let StopCriteria { change, optimality, discreteness } = optimization.stop_criteria();
        self.outlook = json!({
            "iterations": optimization.iterations(), "scheduled": optimization.last_scheduled(),
            "stop": { "change": change, "optimality": optimality, "discreteness": discreteness },
        })
        .to_string();
    }

    /// The hook for linear systems, which stops within a load step and within a sweep.
    pub fn interrupt(&self) -> Interrupt {
        let signals = Arc::clone(&self.signals);
        Arc::new(move || locked(&signals).stop())
    }

    /// The exception that stopped the call.
    ///
    /// # Errors
    /// This exception.
    pub fn check(&self) -> Result<(), Error> {
        locked(&self.signals).raised.take().map_or(Ok(()), |error| Err(Error::Python(error)))
    }
}

impl MarchObserver for Watch {
    fn on_event(&mut self, event: &MarchEvent<'_>) {
        let MarchEvent::Accepted { state, .. } = event else { return };
        self.newton_iterations += state.report.iterations.len();
        self.steps = state.completes.unwrap_or(self.steps);
        let Some(progress) = &self.progress else { return };
        let status = state.report.iterations.last().map_or([0; 3], |record| record.status);
        let arguments = (self.steps, self.newton_iterations, status);
        locked(&self.signals).call(|py| progress.call1(py, arguments).map(drop));
    }

    fn cancelled(&self) -> bool {
        locked(&self.signals).stop()
    }
}

impl DriveObserver for Watch {
    fn begins(&mut self, _iteration: usize) {
        self.newton_iterations = 0;
    }

    fn evaluated(&mut self, design: &DesignEvaluated<'_>) {
        let DesignEvaluated { record, crushed, rescued, loose, .. } = design;
        let from = record.iteration;
        self.kept.update();
        if let Some(void) = rescued {
            self.warn(&void.rescued_from(from), RESCUED);
        }
        if let Some(crushed) = crushed.as_ref().filter(|_| !std::mem::replace(&mut self.crushed, true)) {
            self.warn(&crushed.to_string(), CURE);
        }
        if let Some(loose) = loose.as_ref().filter(|_| !self.loose) {
            self.kept.add(&format!("from iteration {from} on, {loose}"), Some(pieces::CURE));
        }
        self.loose = loose.is_some();
        let Some(callback) = &self.callback else { return };
        let record = serde_json::to_string(design.record).unwrap_or_default();
        locked(&self.signals).call(|py| callback.call1(py, (record, design.seconds, &self.outlook)).map(drop));
    }
}
