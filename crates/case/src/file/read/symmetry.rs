//! Symmetry planes (`[[symmetry]]`).

use super::super::CaseCode;
use super::super::document::Table;
use super::super::resolved::{Component, Symmetry};
use super::motion::COMPONENTS;

pub(super) fn symmetries(root: &Table<'_>) -> Vec<Symmetry> {
    let mut planes: Vec<Symmetry> = Vec::new();
    for table in root.tables("symmetry") {
        let help = "the axis normal to the plane: \"x\", \"y\" or \"z\"";
        let normal = table.word("normal", &COMPONENTS).required(Component::X, help);
        let at = table.number("at").or(0.0);
        if planes.iter().any(|other| other.normal == normal) && table.has("normal") {
            table.reader.error(
                &table.path_of("normal"),
                CaseCode::DuplicateName,
                "there is already a symmetry plane normal to this axis",
                "a body between two parallel symmetry planes is periodic; hold one of its faces in a [[dirichlet]] \
                 table instead",
            );
        }
        table.finish();
        planes.push(Symmetry { normal, at });
    }
    planes
}
