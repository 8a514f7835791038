//! Springs (`[[spring]]`).

use super::super::CaseCode;
use super::super::document::Table;
use super::super::names::Names;
use super::super::resolved::{Spring, SpringDirection, SpringEnd, SpringLine, SpringStiffness};
use super::common::{direction, name};

pub(super) fn springs(root: &Table<'_>, names: &Names) -> Vec<Spring> {
    let mut springs: Vec<Spring> = Vec::new();
    for table in root.tables("spring") {
        let (reader, path) = (table.reader, table.path_of("name"));
        let spring = spring(table, names);
        if springs.iter().any(|other| other.name == spring.name) && !spring.name.is_empty() {
            let message = format!("two springs are called `{}`", spring.name);
            reader.error(&path, CaseCode::DuplicateName, message, "give each a different name");
        }
        springs.push(spring);
    }
    springs
}

fn spring(table: Table<'_>, names: &Names) -> Spring {
    let name = name(&table);
    let set = table.string("set").required(String::new(), "a surface, a set or a rigid body");
    names.check_set(table.reader, &table.path_of("set"), &set);
    let to = other_end(&table, names);
    let direction = acts(&table, to.is_some());
    let positive = |key| table.number(key).positive(CaseCode::OutOfRange).or(1.0);
    let stiffness = match table.choose("the stiffness", &["stiffness", "nodal_stiffness", "stiffness_per_area"]) {
        Some("nodal_stiffness") => SpringStiffness::NodalStiffness(positive("nodal_stiffness")),
        Some("stiffness_per_area") => {
            names.check_surface(table.reader, &table.path_of("set"), &set);
            SpringStiffness::StiffnessPerArea(positive("stiffness_per_area"))
        }
        Some(_) => SpringStiffness::Stiffness(positive("stiffness")),
        None => SpringStiffness::Stiffness(1.0),
    };
    table.finish();
    Spring { name, set, to, direction, stiffness }
}

/// A set or a point; the ground if it is omitted.
fn other_end(table: &Table<'_>, names: &Names) -> Option<SpringEnd> {
    if table.value("to")?.get_ref().as_array().is_some() {
        return table.vector("to").optional().map(SpringEnd::Point);
    }
    let set = table.string("to").optional()?;
    names.check_set(table.reader, &table.path_of("to"), &set);
    Some(SpringEnd::Set(set))
}

/// The direction; all if it is omitted.
fn acts(table: &Table<'_>, between: bool) -> Option<SpringDirection> {
    if table.value("direction")?.get_ref().as_array().is_some() {
        return Some(SpringDirection::Fixed(direction(table, "direction")));
    }
    let line = table.word("direction", &[("line", SpringLine::Line)]).optional()?;
    if !between {
        let message = "a spring to the ground has no line that it could follow";
        let help = "give a direction [x, y, z], omit the key for all directions, or give its other end with `to`";
        table.reader.error(&table.path_of("direction"), CaseCode::ChooseOne, message, help);
    }
    Some(SpringDirection::Word(line))
}
