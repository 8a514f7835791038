//! Reference points (`[[point]]`), linear equations (`[[equation]]`) and couplings (`[[coupling]]`).

use super::super::CaseCode;
use super::super::document::Table;
use super::super::names::Names;
use super::super::resolved::{Coupling, CouplingKind, Equation, EquationTerm, Point, TermComponent};
use super::common::{direction, name};
use super::motion::COMPONENTS;

pub(super) fn points(root: &Table<'_>, names: &mut Names) -> Vec<Point> {
    let point = |table: Table<'_>| {
        let name = name(&table);
        let at = table.vector("at").required([0.0; 3], "its position [x, y, z]");
        names.add_set(table.reader, table.path(), &name, None);
        table.finish();
        Point { name, at }
    };
    root.tables("point").into_iter().map(point).collect()
}

pub(super) fn couplings(root: &Table<'_>, names: &mut Names) -> Vec<Coupling> {
    let coupling = |table: Table<'_>| {
        let name = name(&table);
        let set = table.string("set").required(String::new(), "the surface or set that is coupled");
        names.check_set(table.reader, &table.path_of("set"), &set);
        let at = table.vector("at").required([0.0; 3], "the position of the reference point [x, y, z]");
        let kinds = [("distributing", CouplingKind::Distributing), ("kinematic", CouplingKind::Kinematic)];
        let kind = table.word("kind", &kinds).required(CouplingKind::Distributing, "\"distributing\" or \"kinematic\"");
        names.add_set(table.reader, table.path(), &name, None);
        table.finish();
        Coupling { name, set, at, kind }
    };
    root.tables("coupling").into_iter().map(coupling).collect()
}

pub(super) fn equations(root: &Table<'_>, names: &Names) -> Vec<Equation> {
    root.tables("equation").into_iter().map(|table| equation(&table, names)).collect()
}

fn equation(table: &Table<'_>, names: &Names) -> Equation {
    let help = "for instance terms = [{ set = \"a\" }, { set = \"b\", factor = -1 }]";
    table.require("terms", help);
    let terms: Vec<EquationTerm> = table.tables("terms").into_iter().map(|term| of(term, names)).collect();
    let with = terms.iter().filter(|term| term.component.is_some()).count();
    if with != 0 && with != terms.len() {
        let message = "some terms have a component, and others have not";
        let help = "give each term a `component`; or none, for an equation along each axis";
        table.reader.error(&table.path_of("terms"), CaseCode::ChooseOne, message, help);
    }
    if table.has("terms") && terms.is_empty() {
        table.reader.error(&table.path_of("terms"), CaseCode::Empty, "the equation has no terms", help);
    }
    Equation { terms }
}

fn of(table: Table<'_>, names: &Names) -> EquationTerm {
    let set = table.string("set").required(String::new(), "a surface, a set, a [[point]] or a rigid body");
    names.check_set(table.reader, &table.path_of("set"), &set);
    let component = table.value("component").and_then(|value| match value.get_ref().as_array() {
        Some(_) => Some(TermComponent::Direction(direction(&table, "component"))),
        None => table.word("component", &COMPONENTS).optional().map(TermComponent::Axis),
    });
    let factor = table.number("factor");
    let factor = factor.check(CaseCode::OutOfRange, |&a| a != 0.0, "must not be zero", "omit the term instead").or(1.0);
    let mean = table.boolean("mean").or(false);
    table.finish();
    EquationTerm { set, component, factor, mean }
}
