//! Load cases (`[[load_case]]`), and the load case that a table belongs to.

use super::super::CaseCode;
use super::super::document::Table;
use super::super::names::Names;
use super::super::reader::suggestion_or_list;
use super::super::resolved::{BodyInCase, Contact, LoadCase, LoadInCase, MotionInCase, PairInCase, Turn};
use crate::quantity::{Slaves, slave};

pub(super) fn load_cases(root: &Table<'_>, names: &Names, contacts: &[Contact]) -> Vec<LoadCase> {
    let mut cases: Vec<LoadCase> = Vec::new();
    for table in root.tables("load_case") {
        let name = super::common::name(&table);
        if cases.iter().any(|other| other.name == name) && !name.is_empty() {
            let message = format!("two load cases are called `{name}`");
            table.reader.error(&table.path_of("name"), CaseCode::DuplicateName, message, "give each a different name");
        }
        let weight = table.number("weight").positive(CaseCode::OutOfRange).or(1.0);
        let not_negative = |&friction: &f64| friction >= 0.0;
        let friction = |table: &Table<'_>| {
            let friction = table.number("friction");
            friction.check(CaseCode::OutOfRange, not_negative, "must not be negative", "0 means no friction").optional()
        };
        let modulus_factor =
            |table: &Table<'_>| table.number("modulus_factor").positive(CaseCode::OutOfRange).optional();
        let case = LoadCase {
            name,
            weight,
            friction: friction(&table),
            modulus_factor: modulus_factor(&table),
            motion_factor: table.number("motion_factor").optional(),
            load_factor: table.number("load_factor").optional(),
            pairs: each(
                &table,
                ("pairs", "slave"),
                |pair: &PairInCase| &pair.slave,
                |inner| {
                    let slave = slave(inner, names, &Slaves::of(contacts, names));
                    if contacts.iter().any(|pair| pair.slave == slave && pair.tied) {
                        let message = format!("`{slave}` is tied, and has no friction in any load case");
                        let path = inner.path_of("slave");
                        inner.reader.error(&path, CaseCode::Friction, message, "omit the entry");
                    }
                    inner.require("friction", "the coefficient of friction in this load case");
                    PairInCase { slave, friction: friction(inner).unwrap_or_default() }
                },
            ),
            bodies: each(
                &table,
                ("bodies", "body"),
                |body: &BodyInCase| &body.body,
                |inner| {
                    inner.require_one_of(&["offset", "rotation", "modulus_factor"], "the body does not differ");
                    let body = inner.string("body").required(String::new(), "the name of a [[body]]");
                    names.check_body(inner.reader, &inner.path_of("body"), &body);
                    BodyInCase {
                        body,
                        offset: inner.vector("offset").optional(),
                        rotation: inner.table("rotation").map(turn),
                        modulus_factor: modulus_factor(inner),
                    }
                },
            ),
            motions: each(
                &table,
                ("motions", "set"),
                |motion: &MotionInCase| &motion.set,
                |inner| MotionInCase {
                    set: inner.string("set").required(String::new(), "the set of a [[dirichlet]]"),
                    factor: inner.number("factor").required(1.0, "the factor on its motion"),
                },
            ),
            loads: each(
                &table,
                ("loads", "surface"),
                |load: &LoadInCase| &load.surface,
                |inner| LoadInCase {
                    surface: inner.string("surface").required(String::new(), "the surface of a [[load]]"),
                    factor: inner.number("factor").required(1.0, "the factor on its value"),
                },
            ),
        };
        if case.friction.is_some() && !contacts.is_empty() && contacts.iter().all(|pair| pair.tied) {
            let message = "all contact pairs are tied: no coefficient of friction has an effect";
            table.reader.warning(&table.path_of("friction"), CaseCode::Friction, message, "omit the key");
        }
        table.finish();
        cases.push(case);
    }
    cases
}

/// The entries of a list of tables, at most one for each `name`.
fn each<T>(
    table: &Table<'_>,
    (key, of): (&'static str, &'static str),
    name: impl Fn(&T) -> &str,
    read: impl Fn(&Table<'_>) -> T,
) -> Vec<T> {
    let mut entries: Vec<T> = Vec::new();
    for inner in table.tables(key) {
        let entry = read(&inner);
        if entries.iter().any(|other| name(other) == name(&entry)) && !name(&entry).is_empty() {
            let message = format!("`{}` has two entries", name(&entry));
            inner.reader.error(&inner.path_of(of), CaseCode::DuplicateName, message, "join them");
        }
        inner.finish();
        entries.push(entry);
    }
    entries
}

fn turn(table: Table<'_>) -> Turn {
    let turn = Turn {
        point: table.vector("point").required([0.0; 3], "a point on the axis"),
        direction: super::common::direction(&table, "direction"),
        angle: table.number("angle").required(0.0, "the angle in degrees"),
    };
    table.finish();
    turn
}

/// Checks that motions and loads that differ in a load case exist there: `driven` and `loaded` list
/// their sets with their load cases.
pub(super) fn check_differences(root: &Table<'_>, cases: &[LoadCase], driven: &[Named], loaded: &[Named]) {
    for (number, case) in cases.iter().enumerate() {
        let check = |name: &str, key: &str, what: &str, known: &[Named]| {
            let here = |(_, of): &&Named| of.as_ref().is_none_or(|of| *of == case.name);
            let names: Vec<&str> = known.iter().filter(here).map(|(name, _)| name.as_str()).collect();
            if name.is_empty() || names.contains(&name) || known.iter().any(|(name, _)| name.is_empty()) {
                return;
            }
            let message = format!("nothing {what} `{name}` in load case `{}`", case.name);
            let help = if names.is_empty() { "omit the entry".into() } else { suggestion_or_list(name, &names) };
            root.reader.error(&format!("load_case[{number}].{key}"), CaseCode::UnknownSet, message, help);
        };
        for (i, motion) in case.motions.iter().enumerate() {
            check(&motion.set, &format!("motions[{i}].set"), "moves", driven);
        }
        for (i, load) in case.loads.iter().enumerate() {
            check(&load.surface, &format!("loads[{i}].surface"), "loads", loaded);
        }
    }
}

/// A set and the load case in which it is moved or loaded; `None`: in all.
pub(super) type Named = (String, Option<String>);

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
