//! Load cases (`[[load_case]]`), and the load case that a table belongs to.

use super::super::CaseCode;
use super::super::reader::suggestion_or_list;
use super::super::resolved::LoadCase;
use super::super::typed::Table;

pub(super) fn load_cases(root: &Table<'_>) -> Vec<LoadCase> {
    let mut cases: Vec<LoadCase> = Vec::new();
    for table in root.tables("load_case") {
        let name = super::name(&table);
        if cases.iter().any(|other| other.name == name) && !name.is_empty() {
            let message = format!("two load cases are called `{name}`");
            table.reader.error(&table.path_of("name"), CaseCode::DuplicateName, message, "give each a different name");
        }
        let weight = table.number("weight").positive(CaseCode::OutOfRange).or(1.0);
        table.finish();
        cases.push(LoadCase { name, weight });
    }
    cases
}

/// The load case that a table's `load_case` names; `None`: all.
pub(super) fn of(table: &Table<'_>, cases: &[LoadCase]) -> Option<String> {
    let name = table.string("load_case").optional()?;
    if !cases.iter().any(|case| case.name == name) {
        let mut names: Vec<&str> =
            cases.iter().map(|case| case.name.as_str()).filter(|name| !name.is_empty()).collect();
        names.dedup();
        let help = if names.is_empty() {
            "add a [[load_case]] with this name".into()
        } else {
            suggestion_or_list(&name, &names)
        };
        let message = format!("there is no load case called `{name}`");
        table.reader.error(&table.path_of("load_case"), CaseCode::UnknownSet, message, help);
        return None;
    }
    Some(name)
}

/// Warns of load cases in which nothing moves or is loaded.
pub(super) fn warn_idle(root: &Table<'_>, cases: &[LoadCase], driven: &[Option<String>]) {
    for (number, case) in cases.iter().enumerate() {
        if !driven.iter().any(|of| of.as_ref().is_none_or(|name| *name == case.name)) {
            root.reader.warning(
                &format!("load_case[{number}].name"),
                CaseCode::Motion,
                format!("nothing moves or loads the bodies in load case `{}`", case.name),
                "add load_case = \"…\" to a [[dirichlet]] with a motion, or to a [[load]]",
            );
        }
    }
}
