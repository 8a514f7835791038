//! Output of text and events: people read text, programs read one JSON object per line.

use std::cell::{OnceCell, RefCell};
use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::{Value, json};
use slipstick::analysis::ForwardNotice;
use slipstick::case::CaseDiagnostic;
use slipstick::coarse_friction::CoarseFriction;
use slipstick::crushed::{CURE, CrushedVoid, RESCUED};
use slipstick::imbalance::Imbalance;
use slipstick::losses::LostWork;
use slipstick::overlaps::OpenOverlap;
use slipstick::pieces::{self, LoosePieces};
use slipstick::releases::ReleasedEnergy;
use slipstick::rough_pressure::RoughPressure;
use slipstick::void_contact::VoidContact;
use slipstick::words::{is_hidden, visible};
use slipstick_service::read::object;

use crate::args::Common;
use crate::diagnostics;
use crate::exit::Exit;
use slipstick_service::failure::{Failure, Outcome};
use slipstick_service::warnings::KeptWarnings;

/// Output of text and events.
///
/// Results are written to standard output, warnings and errors to standard error; with `--json`,
/// all of them are events on standard output.
#[derive(Debug)]
pub struct Console {
    json: bool,
    quiet: bool,
    verbose: u8,
    /// Errors are not shown either.
    silent: bool,
    bar: OnceCell<ProgressBar>,
    /// The first error in writing standard output.
    refused: OnceCell<io::Error>,
    /// Warnings, which a run keeps for its report.
    kept: RefCell<KeptWarnings>,
}

impl Console {
    /// A console with these options.
    pub fn new(common: &Common) -> Self {
        Self {
            json: common.json,
            quiet: common.quiet,
            verbose: common.verbose,
            silent: false,
            bar: OnceCell::new(),
            refused: OnceCell::new(),
            kept: RefCell::default(),
        }
    }

    /// Silences the console: another rank writes.
    pub fn silence(&mut self) {
        (self.json, self.quiet, self.verbose, self.silent) = (false, true, 0, true);
    }

    /// Whether results are events.
    pub fn json(&self) -> bool {
        self.json
    }

    /// Whether this level is printed: 0 always (unless quiet), 1 load steps, 2 Newton iterations.
    pub fn shows(&self, level: u8) -> bool {
        !self.quiet && self.verbose >= level
    }

    /// Prints a line for people.
    pub fn text(&self, line: &str) {
        if !self.json && !self.quiet {
            self.suspended(|| self.put(&visible(line)));
        }
    }

    /// Prints lines for people.
    pub fn lines(&self, lines: &[String]) {
        lines.iter().for_each(|line| self.text(line));
    }

    /// Prints text that is itself the result of the command, like a case file.
    pub fn raw(&self, text: &str) {
        let mut out = io::stdout().lock();
        let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
        // It is not an error if the reader closes the pipe early.
        if let Err(error) = written.or_else(unless_closed) {
            let _ = self.refused.set(error);
        }
    }

    /// Writes a line to standard output.
    fn put(&self, line: &str) {
        self.raw(&format!("{line}\n"));
    }

    /// Checks that everything could be written to standard output.
    ///
    /// # Errors
    /// [`Failure::Input`], at the end of a command that has done its work: its results are on disk.
    pub fn check(&self) -> Outcome {
        match self.refused.get() {
            Some(error) => Err(Failure::input(
                format!("cannot write to standard output: {error}"),
                "check where it is redirected to; files are complete",
            )),
            None => Ok(()),
        }
    }

    /// Writes an object for programs; `value` is an object, to which the key `event` is added.
    pub fn event(&self, name: &str, mut value: Value) {
        if self.json {
            value["event"] = name.into();
            self.put(&ascii_marks(&value.to_string()));
        }
    }

    /// From now on, warnings are also kept in this directory of a run, with those so far. A run that
    /// is `resumed` keeps its earlier ones, too.
    pub fn keep_in(&self, run: &Path, resumed: bool) {
        self.kept.borrow_mut().begin(run, resumed);
    }

    /// A run goes on: its results are no longer those of an earlier part.
    pub fn goes_on(&self) {
        self.kept.borrow_mut().update();
    }

    /// The warnings that follow are about the result of an optimization.
    pub fn judges_result(&self) {
        self.kept.borrow_mut().judge_result();
    }

    fn keep(&self, message: &str, help: Option<&str>) {
        self.kept.borrow_mut().add(message, help);
    }

    /// Prints warnings about the case file.
    pub fn warnings(&self, diagnostics: &[CaseDiagnostic]) {
        diagnostics.iter().for_each(|of| self.keep(of.message(), Some(of.help())));
        self.diagnostics("warning", diagnostics, !self.quiet);
    }

    /// Prints any other warning.
    pub fn warning(&self, message: &str) {
        self.keep(message, None);
        self.event("warning", json!({ "message": message }));
        if !self.json && !self.quiet {
            self.suspended(|| complain(&format!("warning: {message}\n")));
        }
    }

    /// Prints a likely mistake in a path.
    pub fn notice(&self, notice: Option<&ForwardNotice>) {
        let Some(notice) = notice else { return };
        let help = "check the motions, the gaps (`slipstick check`) and the steps of the objective";
        self.finding(json!({ "code": notice.code(), "message": notice.to_string(), "help": help }));
    }

    /// Prints that void collapses, and what helps.
    pub fn crushed_void(&self, crushed: &CrushedVoid) {
        self.finding(json!({ "code": "crushed_void", "message": crushed.to_string(), "help": CURE, "void": crushed }));
    }

    /// Prints that void follows linear elasticity from an iteration on.
    pub fn rescued_void(&self, void: &CrushedVoid, iteration: usize) {
        let (message, help) = (void.rescued_from(iteration), RESCUED);
        self.finding(
            json!({ "code": "rescued_void", "message": message, "help": help, "iteration": iteration, "void": void }),
        );
    }

    /// Prints that a design falls apart: that of an iteration, or the result.
    pub fn loose_pieces(&self, loose: &LoosePieces, iteration: Option<usize>) {
        let help = pieces::CURE;
        let message = match iteration {
            Some(iteration) => format!("from iteration {iteration} on, {loose}"),
            None => loose.to_string(),
        };
        let object = json!({
            "code": "loose_pieces", "message": message, "help": help, "loose": loose, "iteration": iteration,
        });
        self.finding(object);
    }

    /// Prints where bodies overlap without a contact force on a path.
    pub fn overlaps(&self, overlaps: &[OpenOverlap]) {
        for overlap in overlaps {
            let help = overlap.help();
            let object =
                json!({ "code": "open_overlap", "message": overlap.to_string(), "help": help, "overlap": overlap });
            self.finding(object);
        }
    }

    /// Prints which pairs take or add energy without a mechanism.
    pub fn losses(&self, losses: &[LostWork]) {
        for lost in losses {
            let help = lost.help();
            let object = json!({ "code": "lost_work", "message": lost.to_string(), "help": help, "loss": lost });
            self.finding(object);
        }
    }

    /// Prints for which friction work the load steps are coarse.
    pub fn coarse_friction(&self, found: &[CoarseFriction]) {
        for work in found {
            let help = work.help();
            let object =
                json!({ "code": "coarse_friction", "message": work.to_string(), "help": help, "friction": work });
            self.finding(object);
        }
    }

    /// Prints which largest pressures the facets do not resolve.
    pub fn rough_pressures(&self, found: &[RoughPressure]) {
        for pressure in found {
            let (message, help) = (pressure.to_string(), pressure.help());
            self.finding(json!({ "code": "rough_pressure", "message": message, "help": help, "pressure": pressure }));
        }
    }

    /// Prints which contact forces act on void.
    pub fn on_void(&self, found: &[VoidContact]) {
        for contact in found {
            let (message, help) = (contact.to_string(), contact.help());
            self.finding(json!({ "code": "contact_on_void", "message": message, "help": help, "contact": contact }));
        }
    }

    /// Prints that energies do not balance.
    pub fn imbalance(&self, found: &Imbalance) {
        let help = found.help();
        let object = json!({ "code": "imbalance", "message": found.to_string(), "help": help, "imbalance": found });
        self.finding(object);
    }

    /// Prints in which load step stored energy disappears.
    pub fn released(&self, released: &ReleasedEnergy) {
        let help = released.help();
        let object =
            json!({ "code": "released_energy", "message": released.to_string(), "help": help, "released": released });
        self.finding(object);
    }

    /// Prints the `message` and the `help` of a warning, or all of it for programs.
    fn finding(&self, object: Value) {
        let [message, help] = ["message", "help"].map(|key| object[key].as_str().unwrap_or_default());
        self.keep(message, Some(help));
        if !self.json && !self.quiet {
            self.suspended(|| complain(&format!("warning: {message}\n    help: {help}\n")));
        }
        self.event("warning", object);
    }

    fn diagnostics(&self, event: &str, diagnostics: &[CaseDiagnostic], shown: bool) {
        if self.json {
            for diagnostic in diagnostics {
                self.event(event, object(diagnostic));
            }
        } else if shown {
            let text = diagnostics::report(diagnostics, io::stderr().is_terminal());
            self.suspended(|| write_error(&text));
        }
    }

    /// Prints why the command ends.
    pub fn failure(&self, failure: &Failure) {
        if !self.silent {
            self.speak(failure);
        }
    }

    /// Prints why the command ends, even on a silent rank.
    pub fn speak(&self, failure: &Failure) {
        self.end_bar();
        let exit = Exit::from(failure) as u8;
        match failure {
            // If events cannot be written, the error must still be shown.
            _ if self.refused.get().is_some() => complain(&format!("{}\n", failure.text())),
            Failure::Case(diagnostics) => self.diagnostics("error", diagnostics, true),
            _ if !self.json => complain(&format!("{}\n", failure.text())),
            Failure::Input { message, cure } | Failure::Check { message, cure } => {
                self.event("error", json!({ "exit": exit, "message": message, "help": cure }));
            }
            Failure::Analysis { report, kept } => {
                let message = report.to_string();
                let message = message.lines().next().unwrap_or_default();
                self.event("error", json!({ "exit": exit, "message": message, "failure": report, "kept": kept }));
            }
            Failure::Interrupted { message, resume } => {
                self.event("error", json!({ "exit": exit, "message": message, "resume": resume }));
            }
        }
    }

    /// Shows a progress bar for this many load steps on a terminal; `done` of them are finished.
    /// Called once per command.
    pub fn start_bar(&self, total: usize, done: usize) {
        let watched = io::stderr().is_terminal() && io::stdout().is_terminal();
        if self.json || self.quiet || self.verbose > 0 || !watched {
            return;
        }
        let bar =
            self.bar.get_or_init(|| ProgressBar::with_draw_target(Some(total as u64), ProgressDrawTarget::stderr()));
        if let Ok(style) = ProgressStyle::with_template("{wide_bar} {percent}%  {elapsed}, {eta} to go\n{msg}") {
            bar.set_style(style);
        }
        bar.set_position(done as u64);
        bar.reset_eta();
        bar.enable_steady_tick(Duration::from_millis(500));
    }

    /// Whether a bar is shown, which makes lines of progress unnecessary.
    pub fn has_bar(&self) -> bool {
        self.bar.get().is_some_and(|bar| !bar.is_finished())
    }

    /// Moves the bar to this many load steps.
    pub fn progress(&self, position: usize) {
        if let Some(bar) = self.bar.get() {
            bar.set_position(position as u64);
        }
    }

    /// Text below the bar.
    pub fn status(&self, message: impl FnOnce() -> String) {
        if let Some(bar) = self.bar.get() {
            bar.set_message(message());
        }
    }

    /// Removes the bar.
    pub fn end_bar(&self) {
        if let Some(bar) = self.bar.get() {
            bar.finish_and_clear();
        }
    }

    /// Writes while the bar is hidden.
    fn suspended(&self, write: impl FnOnce()) {
        match self.bar.get() {
            Some(bar) => bar.suspend(write),
            None => write(),
        }
    }
}

/// JSON in which the characters that [`visible`] replaces are escapes; strings alone can contain them.
fn ascii_marks(json: &str) -> String {
    let mut out = String::with_capacity(json.len());
    for c in json.chars() {
        match is_hidden(c) {
            true => c.encode_utf16(&mut [0; 2]).iter().for_each(|unit| out += &format!("\\u{unit:04x}")),
            false => out.push(c),
        }
    }
    out
}

/// Writes text to standard error, with [visible] control characters.
pub fn complain(text: &str) {
    write_error(&visible(text));
}

/// Writes text to standard error; if that fails too, there is nothing left to do.
fn write_error(text: &str) {
    let _ = io::stderr().lock().write_all(text.as_bytes());
}

/// A pipe that its reader has closed is not an error.
pub fn unless_closed(error: io::Error) -> io::Result<()> {
    if error.kind() == io::ErrorKind::BrokenPipe { Ok(()) } else { Err(error) }
}
