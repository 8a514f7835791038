//! Numbers of runs, and tables of them.

use std::collections::BTreeMap;

use crate::context::Context;
use crate::table::lines;

/// Results of a run, keyed by quantity name.
pub type Numbers = BTreeMap<String, f64>;

/// A Markdown table, which is also printed; `None` without rows.
pub fn table(context: &Context, header: &[&str], rows: &[Vec<String>]) -> Vec<String> {
    if rows.is_empty() {
        return Vec::new();
    }
    context.console.text("");
    context.console.lines(&lines(header, rows));
    let line = |cells: &mut dyn Iterator<Item = &str>| format!("| {} |", cells.collect::<Vec<_>>().join(" | "));
    let rule = std::iter::once("---").chain(std::iter::repeat_n("--:", header.len() - 1));
    let mut text = vec![String::new(), line(&mut header.iter().copied()), line(&mut rule.into_iter())];
    text.extend(rows.iter().map(|row| line(&mut row.iter().map(String::as_str))));
    text
}
