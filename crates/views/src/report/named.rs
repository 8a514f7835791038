//! The quantities that a case names, and their bounds.

use serde::Serialize;
use serde_json::Value;
use slipstick_case::file::{Bound, Case, Constraint, Dimension, NamedBound, extreme_of};
use slipstick_model::optimize::FEASIBLE;
use slipstick_model::words::{self, quantity};

use super::summary::in_unit;
use super::tables::Table;

/// A column of a table of the run, and the bounds that its charts show as lines.
#[derive(Debug, Serialize)]
pub(super) struct Bounded {
    name: String,
    /// Its unit, as written after its name.
    unit: String,
    bounds: Vec<Line>,
}

/// A bound in a chart.
#[derive(Debug, PartialEq, Serialize)]
struct Line {
    value: f64,
    /// `≤ 20`
    text: String,
}

impl Line {
    fn of(bound: Bound) -> Self {
        let (Bound::AtMost(value) | Bound::AtLeast(value)) = bound;
        Self { value, text: words::bound(bound) }
    }
}

fn unit(case: &Case, name: &str) -> String {
    let of = case.quantities.iter().find(|quantity| quantity.name == name).map(|quantity| quantity.kind.dimension());
    match of {
        Some(dimension) if dimension != Dimension::NONE => in_unit(case, dimension, dimension.symbol()),
        _ => String::new(),
    }
}

/// The quantities of the case that are columns of `quantities.csv`, each with all its bounds.
pub(super) fn on_path(case: &Case, table: Option<&Table>) -> Vec<Bounded> {
    let columns = table.map_or(&[][..], |table| &table.columns);
    let of_table = |of: &Constraint| [of.max.map(Bound::AtMost), of.min.map(Bound::AtLeast)].into_iter().flatten();
    let mut all = Vec::new();
    for name in case.quantities.iter().map(|quantity| &quantity.name) {
        let mut bounds: Vec<Line> = Vec::new();
        for bound in case.constraints.iter().filter(|of| of.quantity == *name).flat_map(of_table) {
            let line = Line::of(bound);
            if !bounds.contains(&line) {
                bounds.push(line);
            }
        }
        if columns.contains(name) {
            all.push(Bounded { name: name.clone(), unit: unit(case, name), bounds });
        }
    }
    all
}

/// A bound of the case and its columns of `history.csv`.
#[derive(Debug, Serialize)]
pub(super) struct History {
    quantity: String,
    unit: String,
    bound: Line,
    /// Whether the smallest of several values is the worst.
    least: bool,
    /// Names of the load cases, and for each of them a column for each step.
    cases: Vec<(String, Vec<String>)>,
}

/// The bounds on columns of `history.csv`, those that differ only in step or load case as one.
pub(super) fn on_history(case: &Case) -> Vec<History> {
    let cases = case.load_case_names();
    let mut all: Vec<History> = Vec::new();
    for NamedBound { name, quantity, bound, load_case, .. } in case.bounds() {
        let (line, of) = (Line::of(bound), cases.get(load_case).cloned().unwrap_or_default());
        let known = all.iter_mut().find(|known| known.quantity == quantity && known.bound == line);
        let Some(known) = known else {
            let (unit, least) = (unit(case, &quantity), matches!(bound, Bound::AtLeast(_)));
            all.push(History { quantity, unit, bound: line, least, cases: vec![(of, vec![name])] });
            continue;
        };
        match known.cases.iter_mut().find(|(known, _)| *known == of) {
            Some((_, columns)) => columns.push(name),
            None => known.cases.push((of, vec![name])),
        }
    }
    all
}

/// The values of the quantities at the end of each load case, their range on its path, and their
/// bounds. `None` if the case names none, or if the table is that of several coefficients of friction.
pub(super) fn values(case: &Case, table: &Table) -> Option<Table> {
    let column = |name: &str| table.columns.iter().position(|found| found == name);
    let step = column("step").filter(|at| *at == 0)?;
    let (steps, cases, bounds) = (case.load_path.steps, case.load_case_names(), case.bounds());
    let at = |column: usize, number: usize| -> Option<f64> {
        let row = table.rows.iter().find(|row| row[step].as_f64() == Some(number as f64))?;
        row[column].as_f64()
    };
    let mut columns = vec!["quantity".to_owned()];
    columns.extend((!cases.is_empty()).then(|| "load case".into()));
    columns.extend(["at its last step", "smallest on the path", "largest on the path"].map(str::to_owned));
    columns.extend((!bounds.is_empty()).then(|| "bound".into()));
    let mut rows: Vec<Vec<Value>> = Vec::new();
    for named in &case.quantities {
        let shown = [named.name.clone(), extreme_of(&named.name)];
        for (column, name) in shown.iter().filter_map(|name| Some((column(name)?, name))) {
            let own = *name == named.name;
            let once = !named.kind.depends_on_state();
            for load_case in 0..if once { 1 } else { cases.len().max(1) } {
                let first = load_case * steps;
                let path: Vec<(f64, usize)> =
                    (first + 1..=first + steps).filter_map(|number| Some((at(column, number)?, number))).collect();
                let Some(&(last, reached)) = path.last() else { continue };
                let title = if own { name.clone() } else { format!("{}: the extreme itself", named.name) };
                let mut row: Vec<Value> = vec![(title + &unit(case, &named.name)).into()];
                if let Some(of) = cases.get(load_case) {
                    row.push(if once { "".into() } else { of.as_str().into() });
                }
                let place = |(value, step): (f64, usize)| format!("{} at step {step}", quantity(value));
                let smallest = path.iter().copied().reduce(|a, b| if b.0 < a.0 { b } else { a });
                let largest = path.iter().copied().reduce(|a, b| if b.0 > a.0 { b } else { a });
                // a run in progress has not reached the last step
                row.push(if reached == first + steps { quantity(last) } else { String::new() }.into());
                let range = [smallest, largest].map(|of| of.filter(|_| !once));
                row.extend(range.map(|of| Value::from(of.map_or(String::new(), place))));
                if !bounds.is_empty() {
                    let of = bounds.iter().filter(|of| own && of.quantity == named.name && of.load_case == load_case);
                    let of: Vec<&NamedBound> = of.collect();
                    let value = |of: &NamedBound| {
                        let number = first + of.step;
                        let smooth = at(column, number)?;
                        let itself =
                            self::column(table, &extreme_of(&named.name)).and_then(|column| at(column, number));
                        let correction = itself.map_or(0.0, |itself| of.bound.correction(smooth, itself));
                        Some(Judged { value: smooth + correction, of_extreme: correction != 0.0 })
                    };
                    row.push(verdict(&of, first, value).into());
                }
                rows.push(row);
            }
        }
    }
    (!rows.is_empty()).then_some(Table { columns, rows })
}

fn column(table: &Table, name: &str) -> Option<usize> {
    table.columns.iter().position(|found| found == name)
}

/// The value that a bound judges.
#[derive(Clone, Copy)]
struct Judged {
    value: f64,
    /// Whether it is the extreme, because it is worse than the smooth value that stands for it.
    of_extreme: bool,
}

/// Bounds that differ only in their steps as one, each with whether it is met; by how much, where and
/// by which value it is not, the values of extremes counting where they are worse. Steps are counted from
/// that after `first`.
fn verdict(bounds: &[&NamedBound], first: usize, value: impl Fn(&NamedBound) -> Option<Judged>) -> String {
    let mut lines: Vec<(Line, Vec<&NamedBound>)> = Vec::new();
    for &bound in bounds {
        let line = Line::of(bound.bound);
        match lines.iter_mut().find(|(known, _)| *known == line) {
            Some((_, all)) => all.push(bound),
            None => lines.push((line, vec![bound])),
        }
    }
    let each = lines.iter().map(|(line, all)| {
        let found = all.iter().filter_map(|of| {
            let judged = value(of)?;
            Some((of.bound.violation(judged.value).0, first + of.step, judged))
        });
        match found.reduce(|a, b| if b.0 > a.0 { b } else { a }) {
            None => line.text.clone(),
            Some((violation, step, judged)) if violation > FEASIBLE => {
                let by = match line.value {
                    0.0 => quantity(violation),
                    _ => format!("{:.2} %", 100.0 * violation),
                };
                let which = match judged.of_extreme {
                    true => format!(" by the extreme itself, {}", quantity(judged.value)),
                    false => String::new(),
                };
                format!("✗ {}: violated by {by} at step {step}{which}", line.text)
            }
            Some(_) => format!("✓ {}", line.text),
        }
    });
    each.collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bound(bound: Bound, step: usize) -> NamedBound {
        let (name, quantity) = (String::new(), "q".into());
        NamedBound { name, constraint: 0, quantity, bound, load_case: 0, step, corrected: true }
    }

    /// 12 exceeds 10 by 20 %; 9.995 misses 10 by less than the tolerance of 0.1 %; from zero, the distance
    /// itself counts.
    #[test]
    fn verdicts_name_the_worst_step() {
        let most = [1, 2, 3].map(|step| bound(Bound::AtMost(10.0), step));
        let most: Vec<&NamedBound> = most.iter().collect();
        let smooth = |value: f64| Judged { value, of_extreme: false };
        let values = |of: &NamedBound| [11.0, 12.0].get(of.step - 1).copied().map(smooth);
        assert_eq!(verdict(&most, 4, values), "✗ ≤ 10: violated by 20.00 % at step 6");
        assert_eq!(verdict(&most, 0, |_| Some(smooth(10.0))), "✓ ≤ 10");
        assert_eq!(verdict(&most, 0, |_| None), "≤ 10");
        let both = [bound(Bound::AtLeast(10.0), 1), bound(Bound::AtMost(0.0), 1)];
        let both: Vec<&NamedBound> = both.iter().collect();
        assert_eq!(verdict(&both, 0, |_| Some(smooth(9.995))), "✓ ≥ 10; ✗ ≤ 0: violated by 9.995 at step 1");
        // the smallest value of a smooth minimum that meets its bound: 1.5 misses 2 by a quarter
        let least = bound(Bound::AtLeast(2.0), 3);
        let extreme = |_: &NamedBound| Some(Judged { value: 1.5, of_extreme: true });
        assert_eq!(verdict(&[&least], 0, extreme), "✗ ≥ 2: violated by 25.00 % at step 3 by the extreme itself, 1.5");
    }
}
