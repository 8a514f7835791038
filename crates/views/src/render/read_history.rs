//! Reads histories of optimizations.

use std::fs;
use std::path::Path;

use crate::render::RunHistory;
use slipstick_results::run::{RunDirectory, RunError};

/// Histories of optimizations: for a run's directory, its history, named after the directory; for a
/// table (`.csv`) with a column `run`, one history per run, in the order in which they appear; for
/// a table without it, one history, named after the file.
///
/// # Errors
/// [`RunError::NoRun`] for a directory without a run or without `history.csv`; [`RunError::Read`];
/// [`RunError::Damaged`] for a table without the columns `iteration`, `objective` and
/// `volume_fraction`, or with rows that are incomplete or not numeric.
pub fn read_histories(results: &Path) -> Result<Vec<RunHistory>, RunError> {
    let table = if is_table(results) {
        results.to_owned()
    } else {
        let table = RunDirectory::open(results)?.file("history.csv");
        if !table.is_file() {
            return Err(RunError::NoRun { directory: results.to_owned(), file: "history.csv" });
        }
        table
    };
    let named = if is_table(results) { results.file_stem() } else { results.file_name() };
    let name = named.unwrap_or(results.as_os_str()).to_string_lossy();
    let text = fs::read_to_string(&table).map_err(RunError::read(&table))?;
    histories(&text, &name).map_err(|reason| RunError::Damaged {
        path: table,
        reason,
        cure: "use a `history.csv` written by an optimization, or a table with the same columns and a column `run`"
            .into(),
    })
}

/// Whether the name of a source of results is that of a table.
pub fn is_table(results: &Path) -> bool {
    !results.is_dir() && results.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv"))
}

fn histories(text: &str, name: &str) -> Result<Vec<RunHistory>, String> {
    let mut lines = text.lines().enumerate();
    let cells =
        |line: &str| -> Vec<String> { line.split(',').map(|cell| cell.trim().trim_matches('"').to_owned()).collect() };
    let header = cells(lines.next().map_or("", |(_, line)| line.trim_start_matches('\u{feff}')));
    let column = |name: &str| header.iter().position(|found| found == name);
    let needed = |name: &str| column(name).ok_or_else(|| format!("line 1: there is no column `{name}`"));
    let columns = [needed("iteration")?, needed("objective")?, needed("volume_fraction")?];
    let run = column("run");
    let mut all: Vec<RunHistory> = Vec::new();
    for (number, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
        let row = cells(line);
        if row.len() != header.len() {
            let (cells, expected) = (row.len(), header.len());
            return Err(format!("line {} has {cells} cells, but the first line has {expected}", number + 1));
        }
        let mut values = [0.0; 3];
        for (value, at) in values.iter_mut().zip(columns) {
            let number = row[at].parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(|| {
                format!("line {}: {} is `{}`, which is not a number", number + 1, header[at], row[at])
            })?;
            *value = number;
        }
        let name = run.map_or(name, |at| row[at].as_str());
        match all.iter_mut().find(|history| history.name == name) {
            Some(history) => history.rows.push(values),
            None => all.push(RunHistory { name: name.to_owned(), rows: vec![values] }),
        }
    }
    if all.is_empty() { Err("there is no row below the first line".into()) } else { Ok(all) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_of_one_and_of_several_runs_are_read() {
        let one = histories("iteration,volume_fraction,objective\n0,0.5,-1\n1,0.25,-2\n", "steel").unwrap();
        let rows = vec![[0.0, -1.0, 0.5], [1.0, -2.0, 0.25]];
        assert_eq!(one, [RunHistory { name: "steel".into(), rows }]);
        let text = "run,iteration,objective,volume_fraction,seconds\na,0,-1,0.5,\n\"b\",0,-3,0.5,2\n\na,1,-2,0.5,1\n";
        let several = histories(text, "all").unwrap();
        let names: Vec<(&str, usize)> = several.iter().map(|run| (run.name.as_str(), run.rows.len())).collect();
        assert_eq!(names, [("a", 2), ("b", 1)]);
        assert_eq!(several[1].rows, [[0.0, -3.0, 0.5]]);
    }

    #[test]
    fn what_is_no_history_is_told_with_its_line() {
        let wrong = |text: &str| histories(text, "run").unwrap_err();
        assert_eq!(wrong("element,density\n0,1\n"), "line 1: there is no column `iteration`");
        let short = wrong("iteration,objective,volume_fraction\n0,1,1\n1,2");
        assert_eq!(short, "line 3 has 2 cells, but the first line has 3");
        let nan = wrong("iteration,objective,volume_fraction\n0,nan,1\n");
        assert_eq!(nan, "line 2: objective is `nan`, which is not a number");
        assert_eq!(wrong("iteration,objective,volume_fraction\n"), "there is no row below the first line");
        assert_eq!(wrong(""), "line 1: there is no column `iteration`");
    }
}
