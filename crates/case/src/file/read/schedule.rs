//! Parameters that change over the iterations (`[optimizer.schedule]`).

use super::super::CaseCode;
use super::super::document::Table;
use super::super::resolved::{Design, Schedule, Steps};

/// A test of a value, and the range that it stands for.
type InRange = (fn(f64) -> bool, &'static str);

pub(super) fn schedule(table: Table<'_>, design: Option<&Design>, iterations: usize) -> Schedule {
    let sharpness = steps(&table, "sharpness", (|value| value > 0.0, "greater than zero"));
    let p = steps(&table, "p", (|value| value >= 1.0, "at least 1"));
    let fraction: InRange = (|value| value > 0.0 && value <= 1.0, "in (0, 1]");
    let move_limit = steps(&table, "move_limit", fraction);
    let filter_radius = steps(&table, "filter_radius", (|value| value > 0.0, "greater than zero"));
    let volume_fraction = steps(&table, "volume_fraction", fraction);
    for (key, of, cure) in [
        ("sharpness", "projection", "add `projection = {}`, or omit the schedule of its sharpness"),
        ("filter_radius", "density_filter", "add `density_filter`, or omit the schedule of its radius"),
        ("volume_fraction", "volume_fraction", "add `volume_fraction`, or omit its schedule"),
    ] {
        let by_thickness = key == "sharpness" && table.reader.contains("design.minimum_thickness");
        if table.has(key) && !by_thickness && !table.reader.contains(&format!("design.{of}")) {
            let message = format!("`{key}` requires `{of}` in [design]");
            table.reader.error(&table.path_of(key), CaseCode::Unsupported, message, cure);
        }
    }
    if table.has("filter_radius") && table.reader.contains("design.minimum_thickness") {
        let message = "`filter_radius` follows from `design.minimum_thickness`";
        table.reader.error(&table.path_of("filter_radius"), CaseCode::ChooseOne, message, "omit one of them");
    }
    let ends = |key: &str, steps: &Steps, code: CaseCode, (name, given): (&str, Option<f64>)| {
        if let (Some(given), Some(&(_, last))) = (given, steps.entries().last())
            && last != given
        {
            let message =
                format!("the schedule ends with {key} = {last}, but all other commands use `{name}`, which is {given}");
            table.reader.warning(&table.path_of(key), code, message, "give both the same value");
        }
    };
    ends("p", &p, CaseCode::Simp, ("design.simp.p", design.map(|design| design.simp.penalization)));
    let of_design = ("design.volume_fraction", design.and_then(|design| design.volume_fraction));
    ends("volume_fraction", &volume_fraction, CaseCode::Fraction, of_design);
    let schedule = Schedule { sharpness, p, move_limit, filter_radius, volume_fraction };
    for (key, last) in schedule.late(iterations) {
        let (message, help) = late(last, iterations);
        table.reader.warning(&table.path_of(key), CaseCode::LateSchedule, message, help);
    }
    table.finish();
    schedule
}

/// The warning about an entry that no update follows.
pub(in crate::file) fn late(last: usize, iterations: usize) -> (String, &'static str) {
    let message = format!("no update follows the entry for iteration {last}: there are {iterations} iterations");
    (message, "raise `optimizer.iterations`, or omit the entry")
}

/// A list of pairs `[iteration, value]`.
fn steps(table: &Table<'_>, key: &'static str, (in_range, range): InRange) -> Steps {
    let reader = table.reader;
    let entry = |value: &toml::Spanned<toml::de::DeValue<'_>>, path: String| -> Option<(i64, f64)> {
        match value.get_ref().as_array() {
            Some(pair) if pair.len() == 2 => Some((
                reader.integer(&pair[0], &format!("`{path}[0]`"))?,
                reader.number(&pair[1], &format!("`{path}[1]`"))?,
            )),
            _ => {
                reader.wrong_type(value, &format!("`{path}`"), "a pair [iteration, value]");
                None
            }
        }
    };
    let help = "pairs [[iteration, value], …]; a value holds from its iteration on";
    let entries = table
        .list(key, entry)
        .check(CaseCode::Empty, |list| !list.is_empty(), "is empty: nothing changes", help)
        .or(Vec::new());
    let mut before = -1;
    for (i, &(iteration, value)) in entries.iter().enumerate() {
        let path = format!("{}[{i}]", table.path_of(key));
        if iteration <= before {
            let message = match iteration {
                ..0 => format!("iteration {iteration} is negative"),
                _ => format!("iteration {iteration} is not above {before}"),
            };
            reader.error(&path, CaseCode::OutOfRange, message, "list the iterations in ascending order, from 0");
            break;
        }
        if !in_range(value) {
            let message = format!("`{key}` must be {range}, but is {value}");
            reader.error(&path, CaseCode::OutOfRange, message, "");
        }
        before = iteration;
    }
    let entries = entries.into_iter().filter_map(|(iteration, value)| Some((usize::try_from(iteration).ok()?, value)));
    Steps::new(entries.collect()).unwrap_or_default()
}
