//! The commands, one file each.

pub mod bench;
pub mod check;
pub mod completions;
pub mod evaluate;
pub mod explain;
pub mod export;
pub mod gradient;
pub mod new;
pub mod optimize;
pub mod render;
pub mod report;
pub mod resume;
pub mod schema;
pub mod solve;
pub mod study;
pub mod verify;

use serde_json::{Value, json};
use slipstick::analysis::Forward;
use slipstick::path::{Phase, Timings};

use crate::failure::Failure;
use crate::{Context, Outcome};

/// Returns the analysis unless the user stopped it before its last load step.
fn whole(context: &Context, forward: &Forward, steps: usize) -> Outcome {
    if context.interrupt.requested() && forward.path.steps < steps {
        let message = format!("{} of {steps} load steps were reached", forward.path.steps);
        return Err(Failure::Interrupted { message, resume: None });
    }
    Ok(())
}

/// Numbers of open, sticking and slipping slave nodes at the end of the path.
fn final_status(forward: &Forward) -> [usize; 3] {
    let last = forward.path.states.last().and_then(|state| state.report.iterations.last());
    last.map_or([0; 3], |record| record.status)
}

/// A quantity with few digits, for display.
pub(crate) fn digits(value: f64) -> String {
    // Write −0 as 0.
    let (value, size) = (value + 0.0, value.abs());
    if size != 0.0 && !(1e-3..1e6).contains(&size) { format!("{value:.5e}") } else { format!("{value:.6}") }
}

/// Time by phase: seconds and number of calls.
fn phases(spent: &Timings) -> Value {
    let entry = |phase: Phase| (phase.name().to_owned(), json!([spent.seconds(phase), spent.calls(phase)]));
    Value::Object(Phase::ALL.into_iter().map(entry).collect())
}

/// Prints the time by phase if verbose.
fn tell_phases(context: &Context, what: &str, spent: &Timings) {
    if context.console.tells(1) {
        let part = |phase: Phase| format!("{} {:.2} s", phase.name().replace('_', " "), spent.seconds(phase));
        context.console.text(&format!("{what}: {}", Phase::ALL.map(part).join(", ")));
    }
}

/// A number of bytes with a unit.
pub(crate) fn bytes(value: f64) -> String {
    let (scaled, unit) = match value {
        v if v < 1e6 => (v / 1e3, "kB"),
        v if v < 1e9 => (v / 1e6, "MB"),
        v if v < 1e12 => (v / 1e9, "GB"),
        v => (v / 1e12, "TB"),
    };
    format!("{scaled:.1} {unit}")
}

#[cfg(test)]
mod tests {
    #[test]
    fn quantities_are_short() {
        assert_eq!(super::digits(-9.876_543_21), "-9.876543");
        assert_eq!(super::digits(1.234e-7), "1.23400e-7");
        assert_eq!((super::digits(0.0), super::digits(-0.0)), ("0.000000".into(), "0.000000".into()));
        assert_eq!((super::bytes(2.5e3), super::bytes(3.26e9)), ("2.5 kB".into(), "3.3 GB".into()));
    }
}
