//! Changes of temperature (`[[temperature]]`).

use super::super::CaseCode;
use super::super::document::Table;
use super::super::names::Names;
use super::super::resolved::{Body, LoadCase, Temperature};
use super::{load, load_case};

pub(super) fn temperatures(
    root: &Table<'_>,
    names: &Names,
    bodies: &[Body],
    cases: &[LoadCase],
    steps: usize,
) -> Vec<Temperature> {
    root.tables("temperature").into_iter().map(|table| temperature(table, names, bodies, cases, steps)).collect()
}

fn temperature(table: Table<'_>, names: &Names, bodies: &[Body], cases: &[LoadCase], steps: usize) -> Temperature {
    let (body, set) = (table.string("body").optional(), table.string("set").optional());
    if let Some(body) = &body {
        names.check_body(table.reader, &table.path_of("body"), body);
    }
    if let Some(set) = &set {
        names.check_set(table.reader, &table.path_of("set"), set);
        if body.is_some() {
            let message = "`body` and `set` cannot be combined";
            table.reader.error(&table.path_of("set"), CaseCode::ChooseOne, message, "keep one of them");
        }
    }
    let change = table
        .number("change")
        .check(CaseCode::OutOfRange, |&change| change != 0.0, "changes nothing", "give it a value, or remove the table")
        .required(1.0, "the change of the temperature");
    let mut meant = bodies.iter().filter(|known| body.as_ref().is_none_or(|body| known.name == *body)).peekable();
    if meant.peek().is_some() && !meant.any(Body::expands) {
        let message = match &body {
            Some(body) => format!("`{body}` has no `thermal_expansion`: its temperature changes nothing"),
            None => "no body has a `thermal_expansion`: temperatures change nothing".into(),
        };
        table.reader.error(&table.path_of("change"), CaseCode::MissingKey, message, "add the key to the [[body]]");
    }
    let amplitude = load::amplitude_of(&table, steps);
    let load_case = load_case::of(&table, cases);
    table.finish();
    Temperature { body, set, load_case, change, amplitude }
}
