//! Values that a design promised (`[[promise]]`).

use super::super::CaseCode;
use super::super::document::Table;
use super::super::resolved::{ObservedSteps, Promise};
use super::quantity::observed_steps;

/// The promises; `cases` is the number of load paths, `steps` that of their load steps.
pub(super) fn promises(root: &Table<'_>, cases: usize, steps: usize) -> Vec<Promise> {
    let mut promises: Vec<Promise> = Vec::new();
    for table in root.tables("promise") {
        let quantity = table.string("quantity").required(String::new(), "a column of quantities.csv");
        let of_steps = observed_steps(&table, steps);
        let twice =
            |other: &Promise| other.quantity == quantity && [&other.steps, &of_steps] == [&ObservedSteps::Last; 2];
        if promises.iter().any(twice) && !quantity.is_empty() {
            let message = format!("`{quantity}` is promised twice");
            table.reader.error(&table.path_of("quantity"), CaseCode::DuplicateName, message, "keep one of the two");
        }
        let values = table
            .list("values", |value, what| table.reader.number(value, &what))
            .check(
                CaseCode::BadShape,
                |values| values.len() == cases,
                "must have one value for each load case",
                "without [[load_case]] tables, give one value",
            )
            .required(Vec::new(), "the values at the end of each load case, for instance [12.5]");
        let [max, min] = ["max", "min"].map(|key| table.number(key).optional());
        table.finish();
        promises.push(Promise { quantity, values, max, min, steps: of_steps });
    }
    promises
}
