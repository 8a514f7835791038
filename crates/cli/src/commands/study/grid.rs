//! Grids of a study: a run for each combination of listed values, and a table of their numbers.

use std::path::Path;

use slipstick::case::Case;
use slipstick::case::Override;
use slipstick::output::{Cell, Csv};
use slipstick_service::read::{Unreadable, case_file};
use toml::Value;

use super::entry::{Entry, Lists};
use super::tables::{Numbers, table};
use crate::context::Context;
use crate::summary::digits;
use slipstick_service::failure::Outcome;

/// The most runs of a grid.
const LARGEST: usize = 10_000;

/// The runs of an entry with lists, or of one that uses the designs of such an entry.
#[derive(Debug)]
pub struct Grid {
    /// The entry.
    pub name: String,
    /// The keys that differ between its runs; `design` for designs of another grid.
    keys: Vec<String>,
    /// The runs, each with a value for each key; the last key changes fastest.
    points: Vec<(String, Vec<String>)>,
    /// The numbers to print; those that the case names by default.
    shown: Vec<String>,
}

impl Grid {
    /// The names of its runs.
    pub fn runs(&self) -> impl Iterator<Item = &String> {
        self.points.iter().map(|(run, _)| run)
    }
}

/// One list of a grid: the key, and each value as in the file.
struct Axis {
    key: String,
    values: Vec<String>,
}

/// Replaces entries that stand for several runs by these runs, and returns the grids and all errors
/// in them. `set` are the values replaced in all runs.
pub fn expand(entries: Vec<Entry>, set: &[String], folder: &Path) -> (Vec<Entry>, Vec<Grid>, Vec<String>) {
    let (mut runs, mut grids, mut wrong) = (Vec::new(), Vec::<Grid>::new(), Vec::new());
    for entry in entries {
        let designs = entry.design.as_ref().and_then(|name| grids.iter().find(|grid| grid.name == *name));
        if entry.grid.0.is_empty() && designs.is_none() {
            if entry.tabulate.is_some() {
                wrong.push(format!("run `{}`: `tabulate` belongs to a grid, and there is no `grid`", entry.name));
            }
            // a deck may need options before it can be read
            if entry.case.extension().is_some_and(|extension| extension == "toml") {
                let checked = check(std::slice::from_ref(&entry), set, folder);
                wrong.extend(checked.err().map(|reason| format!("run `{}`: {reason}", entry.name)));
            }
            runs.push(entry);
            continue;
        }
        let mut axes = Vec::new();
        if let Some(designs) = designs {
            axes.push(Axis { key: "design".into(), values: designs.runs().cloned().collect() });
        }
        match lists(&entry).map(|lists| axes.extend(lists)).and_then(|()| points(&entry, &axes)) {
            Ok((grid, all)) => {
                match check(&all, set, folder) {
                    Ok(named) => grids.push(Grid { shown: entry.tabulate.clone().unwrap_or(named), ..grid }),
                    Err(reason) => {
                        wrong.push(format!("run `{}`: {reason}", entry.name));
                        grids.push(grid);
                    }
                }
                runs.extend(all);
            }
            Err(reason) => wrong.push(format!("run `{}`: {reason}", entry.name)),
        }
    }
    (runs, grids, wrong)
}

/// The lists of an entry.
fn lists(entry: &Entry) -> Result<Vec<Axis>, String> {
    let mut axes: Vec<Axis> = Vec::new();
    for (key, value) in &entry.grid.0 {
        let Value::Array(list) = value else {
            return Err(format!("grid: `{key}` is {}; give a list, {key} = [{0}, …]", inline(value)));
        };
        if list.is_empty() {
            return Err(format!("grid: the list of `{key}` is empty"));
        }
        let values: Vec<String> = list.iter().map(inline).collect();
        if let Some(twice) = values.iter().enumerate().find(|(at, value)| values[..*at].contains(value)) {
            return Err(format!("grid: `{key}` lists {} twice", twice.1));
        }
        let of_set = |one: &&String| one.split('=').next().is_some_and(|set| set.trim() == *key);
        if let Some(one) = entry.set.iter().find(of_set) {
            return Err(format!("`{key}` is in the grid and in `set` ({one}); keep one of them"));
        }
        axes.push(Axis { key: key.clone(), values });
    }
    Ok(axes)
}

/// The runs of all combinations of values.
fn points(entry: &Entry, axes: &[Axis]) -> Result<(Grid, Vec<Entry>), String> {
    let count = axes.iter().try_fold(1usize, |product, axis| product.checked_mul(axis.values.len()));
    let count = count.filter(|&count| count <= LARGEST).ok_or_else(|| {
        let sizes = axes.iter().map(|axis| axis.values.len().to_string()).collect::<Vec<_>>().join(" × ");
        format!("the grid has {sizes} runs; the most is {LARGEST}")
    })?;
    let mut grid = Grid {
        name: entry.name.clone(),
        keys: axes.iter().map(|axis| axis.key.clone()).collect(),
        points: Vec::new(),
        shown: Vec::new(),
    };
    let mut runs = Vec::new();
    for number in 0..count {
        let mut rest = number;
        let mut at: Vec<usize> = axes.iter().rev().map(|axis| divide(&mut rest, axis.values.len())).collect();
        at.reverse();
        let mut run = Entry { grid: Lists::default(), tabulate: None, ..entry.clone() };
        let mut values = Vec::new();
        for (axis, &at) in axes.iter().zip(&at) {
            let value = &axis.values[at];
            match axis.key.as_str() {
                "design" => {
                    run.design = Some(value.clone());
                    let of = entry.design.as_ref().map_or(0, |of| of.len() + 1);
                    run.name = format!("{}_{}", run.name, &value[of.min(value.len())..]);
                }
                key => {
                    let key = if key == "friction" { "contact[*].friction" } else { key };
                    run.set.push(format!("{key} = {value}"));
                    run.name = format!("{}_{}", run.name, word(value).unwrap_or_else(|| (at + 1).to_string()));
                }
            }
            values.push(value.clone());
        }
        if grid.runs().any(|other| *other == run.name) {
            // two values that differ in what names leave out
            run.name = format!("{}_{}", entry.name, number + 1);
        }
        grid.points.push((run.name.clone(), values));
        runs.push(run);
    }
    Ok((grid, runs))
}

/// The remainder; `rest` becomes the quotient.
fn divide(rest: &mut usize, by: usize) -> usize {
    let remainder = *rest % by;
    *rest /= by;
    remainder
}

/// A value as part of a name; `None` if it is not a short word or number.
fn word(value: &str) -> Option<String> {
    let bare = value.trim_matches('"');
    let good = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
    (!bare.is_empty() && bare.len() <= 24 && bare.chars().all(good)).then(|| bare.to_owned())
}

/// A value on one line, as in a case file.
fn inline(value: &Value) -> String {
    match value {
        Value::Table(table) => {
            let entries = table.iter().map(|(key, value)| format!("{key} = {}", inline(value)));
            format!("{{ {} }}", entries.collect::<Vec<_>>().join(", "))
        }
        Value::Array(list) => format!("[{}]", list.iter().map(inline).collect::<Vec<_>>().join(", ")),
        Value::Float(number) if number.is_finite() => format!("{number:?}"),
        value => value.to_string(),
    }
}

/// The first load case with coefficients of friction of its own.
fn with_own_friction(case: &Case) -> Option<&str> {
    let own = case.load_cases.iter().find(|of| of.friction.is_some() || !of.pairs.is_empty());
    own.map(|load_case| load_case.name.as_str())
}

/// Checks the cases of all runs; returns the names of the quantities of the first.
fn check(runs: &[Entry], set: &[String], folder: &Path) -> Result<Vec<String>, String> {
    let mut named = Vec::new();
    for (number, run) in runs.iter().enumerate() {
        let file = folder.join(&run.case);
        let parse = |text: &String| text.parse::<Override>().map_err(|error| format!("{error}; {}", error.cure()));
        let overrides = set.iter().chain(&run.set).map(parse).collect::<Result<Vec<_>, _>>()?;
        let varies_friction = run.set.iter().any(|set| set.starts_with("contact[*].friction"));
        let read = case_file(&file, &overrides);
        if let Ok(resolved) = &read
            && varies_friction
            && let Some(own) = with_own_friction(&resolved.case)
        {
            return Err(format!(
                "the runs vary `contact[*].friction`, and the load case `{own}` of `{}` sets its own, with `friction` or `pairs`; \
                 remove these, or vary `load_case[…].friction` instead",
                run.name
            ));
        }
        match read {
            Ok(resolved) if number == 0 => {
                named = resolved.case.quantities.iter().map(|quantity| quantity.name.clone()).collect();
            }
            Ok(_) => {}
            Err(Unreadable::Override(error)) => return Err(format!("{error}; {}", error.cure())),
            Err(Unreadable::Wrong(errors)) => {
                let first = errors.diagnostics().first().map_or_else(String::new, |one| one.plain().to_string());
                return Err(format!("the case of `{}` has errors: {first}", run.name));
            }
            // a missing file has its own message
            Err(Unreadable::Io(_)) => return Ok(named),
            Err(Unreadable::Encoding(at)) => return Err(format!("{}: {at}", file.display())),
        }
    }
    Ok(named)
}

/// Writes `grid_NAME.csv`, with a row for each run and all its numbers, and prints a table of its
/// main numbers, which it returns as Markdown.
///
/// # Errors
/// [`slipstick_service::failure::Failure::Input`] if the file cannot be written.
pub fn tabulate(
    context: &Context,
    grid: &Grid,
    results: &Path,
    found: &[(&Entry, Numbers, f64)],
) -> Outcome<Vec<String>> {
    let of = |run: &str| found.iter().find(|(entry, ..)| entry.name == run).map(|(_, numbers, _)| numbers);
    let mut names: Vec<&str> = Vec::new();
    for name in grid.runs().filter_map(|run| of(run)).flat_map(|numbers| numbers.keys()) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    names.sort_unstable();
    let keys: Vec<&str> = grid.keys.iter().map(String::as_str).collect();
    let mut csv =
        Csv::create(&results.join(format!("grid_{}.csv", grid.name)), &[&["run"], &keys[..], &names[..]].concat())?;
    for (run, values) in &grid.points {
        let mut cells: Vec<Cell> = vec![run.as_str().into()];
        cells.extend(values.iter().map(|value| Cell::from(value.trim_matches('"'))));
        cells.extend(names.iter().map(|name| Cell::from(of(run).and_then(|numbers| numbers.get(*name)).copied())));
        csv.row(&cells)?;
    }
    // a quantity of several load cases has a number in each
    let of_name = |name: &str| -> Vec<&str> {
        let in_cases = format!("{name} in ");
        names.iter().copied().filter(|found| *found == name || found.starts_with(&in_cases)).collect()
    };
    for name in grid.shown.iter().filter(|name| of_name(name).is_empty() && !names.is_empty()) {
        context.console.warning(&format!(
            "{}: no number is called `{name}`; available: {}",
            grid.name,
            names.join(", ")
        ));
    }
    let main = ["objective", "volume_fraction", "violation"].map(str::to_owned);
    let shown: Vec<&String> = main.iter().chain(grid.shown.iter().filter(|name| !main.contains(name))).collect();
    let shown: Vec<&str> = shown.into_iter().flat_map(|name| of_name(name)).collect();
    let row = |(run, values): &(String, Vec<String>)| {
        let mut row = vec![run.clone()];
        row.extend(values.iter().cloned());
        row.extend(shown.iter().map(|name| match of(run) {
            Some(numbers) => numbers.get(*name).map_or_else(String::new, |&value| digits(value)),
            None => "–".into(),
        }));
        row
    };
    let rows: Vec<Vec<String>> = grid.points.iter().map(row).collect();
    Ok(table(context, &[&[grid.name.as_str()], &keys[..], &shown[..]].concat(), &rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(text: &str) -> Entry {
        toml::from_str(&format!("name = 'g'\ncommand = 'solve'\ncase = 'no/such/file.toml'\n{text}")).expect(text)
    }

    fn expanded(entries: &[&str]) -> (Vec<Entry>, Vec<Grid>, Vec<String>) {
        expand(entries.iter().map(|text| entry(text)).collect(), &[], Path::new(""))
    }

    #[test]
    fn grids_are_products() {
        let (runs, grids, wrong) = expanded(&[
            "set = ['a = 1']\n[grid]\nfriction = [0.1, 0.2]\nload_path.steps = [4, 8]\nx.law = [{ a = 1 }]",
        ]);
        assert_eq!(wrong, Vec::<String>::new());
        let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
        assert_eq!(names, ["g_0.1_4_1", "g_0.1_8_1", "g_0.2_4_1", "g_0.2_8_1"]);
        assert_eq!(runs[1].set, ["a = 1", "contact[*].friction = 0.1", "load_path.steps = 8", "x.law = { a = 1 }"]);
        assert_eq!(grids[0].keys, ["friction", "load_path.steps", "x.law"]);
        assert_eq!(grids[0].points[2].1, ["0.2", "4", "{ a = 1 }"]);
    }

    /// A run with the design of a grid is one for each of its designs.
    #[test]
    fn designs_of_grids_are_a_list() {
        let design = "design = 'g'\ngrid = { friction = [0.5] }";
        let under = Entry { name: "under".into(), ..entry(design) };
        let (runs, grids, _) = expand(vec![entry("grid = { friction = [0.1, 0.2] }"), under], &[], Path::new(""));
        let of = |run: &Entry| (run.name.clone(), run.design.clone().unwrap_or_default());
        assert_eq!(
            runs[2..].iter().map(of).collect::<Vec<_>>(),
            [("under_0.1_0.5".into(), "g_0.1".into()), ("under_0.2_0.5".into(), "g_0.2".into())]
        );
        assert_eq!(grids[1].keys, ["design", "friction"]);
    }

    #[test]
    fn wrong_grids_are_errors() {
        let many = format!("grid = {{ a = {0:?}, b = {0:?} }}", (0..101).collect::<Vec<_>>());
        for (text, told) in [
            ("grid = { friction = 0.1 }", "`friction` is 0.1; give a list, friction = [0.1, …]"),
            ("grid = { friction = [] }", "the list of `friction` is empty"),
            ("grid = { friction = [0.1, 0.1] }", "`friction` lists 0.1 twice"),
            ("set = ['a.b=1']\ngrid = { a.b = [2] }", "in the grid and in `set` (a.b=1)"),
            (&many, "101 × 101 runs; the most is 10000"),
            ("tabulate = ['x']", "there is no `grid`"),
            ("grid = { 'a b' = [1] }", "the key does not have the form"),
        ] {
            let (.., wrong) = expanded(&[text]);
            assert!(wrong.len() == 1 && wrong[0].contains(told), "{text}: {wrong:?}");
        }
    }
}
