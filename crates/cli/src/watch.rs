//! Watches a march: shows load steps, keeps the table of Newton iterations, asks whether to stop.

use serde_json::json;
use slipstick::analysis::ForwardNotice;
use slipstick::build::Problem;
use slipstick::drive::{DesignEvaluated, DriveObserver};
use slipstick::model::LoadTime;
use slipstick::optimize::IterationRecord;
use slipstick::path::{FailedAttempt, MarchEvent, MarchObserver, PathState, Remedy};
use slipstick::run::{NewtonTable, RunError};

use crate::console::Console;
use crate::context::Context;
use crate::interrupt::Interrupt;
use crate::parallel::Parallel;
use crate::summary::digits;

/// The observer of all analyses of a command.
pub struct Watch<'a> {
    console: &'a Console,
    interrupt: &'a Interrupt,
    parallel: &'a Parallel,
    newton: Option<NewtonTable>,
    /// Verbosity from which load steps are printed.
    level: u8,
    iteration: usize,
    /// Load steps completed in this analysis, and in all analyses before it.
    steps: usize,
    steps_before: usize,
    newton_iterations: usize,
    headline: String,
    load_cases: Vec<String>,
    /// Load steps of an analysis.
    steps_of_path: usize,
    /// The notice about the previous path.
    notice: Option<ForwardNotice>,
    /// Whether void that collapses has been reported.
    crushed: bool,
    /// Whether the previous design had loose pieces.
    loose: bool,
}

impl<'a> Watch<'a> {
    /// Watches analyses of a problem, without a table.
    pub fn new(context: &'a Context, problem: &Problem) -> Self {
        Self {
            console: &context.console,
            interrupt: &context.interrupt,
            parallel: &context.parallel,
            newton: None,
            level: 1,
            iteration: 0,
            steps: 0,
            steps_before: 0,
            newton_iterations: 0,
            headline: String::new(),
            load_cases: problem.load_cases.clone(),
            steps_of_path: problem.analysis.times.len(),
            notice: None,
            crushed: false,
            loose: false,
        }
    }

    /// Keeps `newton.csv`.
    pub fn with_table(mut self, table: NewtonTable) -> Self {
        self.newton = Some(table);
        self
    }

    /// Prints load steps even without `-v`, because the command has nothing else to print
    /// meanwhile.
    pub fn telling_steps(mut self) -> Self {
        self.level = 0;
        self
    }

    /// Begins an analysis of this design; `steps_before` load steps were completed before it in
    /// total.
    pub fn begin(&mut self, iteration: usize, steps_before: usize) {
        (self.iteration, self.steps_before, self.steps, self.newton_iterations) = (iteration, steps_before, 0, 0);
        if let Some(table) = &mut self.newton {
            table.begin(iteration);
        }
    }

    /// Checks that all events could be written.
    ///
    /// # Errors
    /// The first failure to write.
    pub fn check(&mut self) -> Result<(), RunError> {
        self.newton.as_mut().map_or(Ok(()), NewtonTable::check)
    }

    /// A pseudo-time, preceded by the load case if it has a name.
    fn place(&self, time: LoadTime) -> String {
        let name = time.name(&self.load_cases).map_or(String::new(), |name| format!("{name} "));
        format!("{name}t = {:.5}", time.t)
    }

    fn accepted(&mut self, state: &PathState) {
        let last = state.report.iterations.last();
        let [open, stick, slip] = last.map_or([0; 3], |record| record.status);
        let iterations = state.report.iterations.len();
        self.newton_iterations += iterations;
        let step = match state.completes {
            Some(step) => {
                self.steps = step;
                format!("step {step:>3}")
            }
            None => "   part  ".into(),
        };
        self.console.event(
            "step",
            json!({
                "iteration": self.iteration, "step": state.completes, "time": state.time.on_axis(),
                "load_case": state.time.name(&self.load_cases), "newton_iterations": iterations, "uzawa_iterations": state.report.uzawa, "rounded": state.report.rounded,
                "rescued": state.report.rescued, "left_free": state.report.left_free, "holding": state.report.holding, "holding_work": state.report.holding_work,
                "open": open, "stick": stick, "slip": slip,
            }),
        );
        if self.console.shows(self.level) && !self.console.has_bar() {
            let at = self.place(state.time);
            let rounded = state.report.rounded.map_or(String::new(), |left| format!("; round-off left {left:.1e}"));
            let rescued = if state.report.rescued { "; found with held multipliers" } else { "" };
            let free = match &state.report.left_free {
                free if free.is_empty() => String::new(),
                free => format!(
                    "; held with {:.1e} of the forces and a work of {:.1e}: {}",
                    state.report.holding,
                    state.report.holding_work,
                    free.join("; ")
                ),
            };
            self.console.text(&format!(
                "  {step}  {at}  Newton {iterations:>3}  open {open}, stick {stick}, slip {slip}{rounded}{rescued}{free}"
            ));
        }
        if self.console.shows(2) {
            for at in &state.report.iterations {
                self.console.text(&format!(
                    "      {:>3}  |R| {:.3e}  |H| {:.3e}  |Δd| {:.3e}  |Δζ| {:.3e}  length {:<6}  {:?}",
                    at.iteration, at.residual, at.contact, at.displacement, at.multiplier, at.step_length, at.status
                ));
            }
        }
        self.console.progress(self.steps_before + self.steps);
        self.console.status(|| {
            let Self { headline, steps, newton_iterations, .. } = self;
            format!("{headline}step {steps}, Newton {newton_iterations}, open {open}, stick {stick}, slip {slip}")
        });
    }
}

impl MarchObserver for Watch<'_> {
    fn on_event(&mut self, event: &MarchEvent<'_>) {
        if let Some(table) = &mut self.newton {
            table.record(event);
        }
        match event {
            MarchEvent::Accepted { state, .. } => self.accepted(state),
            MarchEvent::Retry { step, failed: FailedAttempt { time, rung, kind, iterations }, remedy } => {
                let next = match remedy {
                    Remedy::OtherSetting => "another setting of the iteration",
                    Remedy::HeldMultipliers => "Uzawa's iteration over all multipliers",
                    Remedy::CutBack => "half the increment",
                };
                self.console.event(
                    "retry",
                    json!({
                        "iteration": self.iteration, "step": step, "time": time.on_axis(),
                        "load_case": time.name(&self.load_cases), "message": kind.to_string(), "rung": rung.to_string(), "newton_iterations": iterations, "next": next,
                    }),
                );
                if self.console.shows(self.level.max(1)) {
                    let to = self.place(*time);
                    self.console.text(&format!(
                        "  step {step:>3}  to {to} {rung} failed after Newton {iterations}: {kind}; next, {next}"
                    ));
                }
            }
        }
    }

    fn cancelled(&self) -> bool {
        self.parallel.any(self.interrupt.requested())
    }
}

impl DriveObserver for Watch<'_> {
    fn begins(&mut self, iteration: usize) {
        self.begin(iteration, self.steps_of_path * iteration);
        self.headline = format!("iteration {iteration}: ");
    }

    fn recalls(&mut self, result: &IterationRecord) {
        self.begin(result.iteration, self.steps_before);
        self.headline = format!("iteration {}: ", result.iteration);
    }

    fn evaluated(&mut self, design: &DesignEvaluated<'_>) {
        let DesignEvaluated { record, ref notice, seconds, ref crushed, rescued, divided, ref loose } = *design;
        self.console.goes_on();
        // Repeated only if it differs from that of the previous design.
        self.console.notice(notice.as_ref().filter(|notice| Some(*notice) != self.notice.as_ref()));
        self.notice.clone_from(notice);
        if let Some(crushed) = crushed.as_ref().filter(|_| !self.crushed) {
            self.crushed = true;
            self.console.crushed_void(crushed);
        }
        if let Some(void) = rescued {
            self.console.rescued_void(void, record.iteration);
        }
        if divided {
            self.console.event("divided_rise", json!({ "iteration": record.iteration }));
            self.console.text(&format!(
                "  iteration {}: the sharpness rises in two halves, since the design would break a bound",
                record.iteration
            ));
        }
        if let Some(loose) = loose.as_ref().filter(|_| !self.loose) {
            self.console.loose_pieces(loose, Some(record.iteration));
        } else if loose.is_none() && self.loose {
            self.console.text(&format!("  from iteration {} on, no piece of the design is loose", record.iteration));
        }
        self.loose = loose.is_some();
        let IterationRecord { iteration, objective, volume_fraction, newton_iterations, .. } = record;
        let mut event = json!(record);
        event["seconds"] = json!(seconds);
        self.console.event("iteration", event);
        let failed = match record.failed_iterations {
            0 => String::new(),
            failed => format!(" and {failed} in failed attempts"),
        };
        let change = record.change.map_or("       ".into(), |change| format!("{change:.5}"));
        // the volume is shown by itself
        let violation = match record.constraints.len() {
            0 | 1 => String::new(),
            _ => format!("  violation {:.5}", record.violation),
        };
        let [open, stick, slip] = record.status;
        // also kept on a terminal, above the bar
        self.console.text(&format!(
            "{iteration:>5}  objective {:>14}  volume {volume_fraction:.5}{violation}  change {change}  Newton {newton_iterations:>4}{failed}  \
             open {open}, stick {stick}, slip {slip}  {seconds:.1} s",
            digits(*objective)
        ));
    }
}
