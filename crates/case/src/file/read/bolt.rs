//! Bolts (`[[bolt]]`).

use super::super::CaseCode;
use super::super::document::Table;
use super::super::names::Names;
use super::super::resolved::{Body, Bolt, BoltSection, Keeps, PreloadPoint};
use super::common::{direction, name};
use super::motion;

pub(super) fn bolts(root: &Table<'_>, names: &mut Names, bodies: &[Body], steps: usize) -> Vec<Bolt> {
    root.tables("bolt").into_iter().map(|table| bolt(table, names, bodies, steps)).collect()
}

fn bolt(table: Table<'_>, names: &mut Names, bodies: &[Body], steps: usize) -> Bolt {
    let name = name(&table);
    let body = table.string("body").required(String::new(), "the body that is the bolt");
    names.check_body(table.reader, &table.path_of("body"), &body);
    if bodies.iter().any(|known| known.name == body && known.rigid.is_some()) {
        let message = format!("`{body}` is rigid, so a force cannot stretch it");
        table.reader.error(&table.path_of("body"), CaseCode::OutOfRange, message, "omit `rigid`, or name another body");
    }
    table.require("section", "for instance section = { point = [0, 10, 0], normal = [0, 1, 0] }");
    let section = table.table("section").map(|section| {
        let point = section.vector("point").required([0.0; 3], "a point in the plane [x, y, z]");
        let normal = direction(&section, "normal");
        let radius = section.number("radius").positive(CaseCode::OutOfRange).optional();
        section.finish();
        BoltSection { point, normal, radius }
    });
    let section = section.unwrap_or(BoltSection { point: [0.0; 3], normal: [0.0, 1.0, 0.0], radius: None });
    table.require("force", "for instance force = [{ t = 0.5, force = 20000 }]");
    let way_points = table.list("force", |value, path| table.reader.table(value, path)).or(Vec::new());
    let mut force: Vec<PreloadPoint> = Vec::new();
    for point in way_points {
        let t = motion::time(&point, force.last().map_or(0.0, |last| last.t), steps);
        let at = point.number("force").check(
            CaseCode::OutOfRange,
            |&force| force >= 0.0,
            "must not be negative",
            "a bolt pulls its parts together",
        );
        let at = at.required(1.0, "the force of the bolt at this time");
        point.finish();
        force.push(PreloadPoint { t, force: at });
    }
    if table.has("force") && force.iter().all(|point| point.force == 0.0) {
        let help = "give it a force, or remove the bolt";
        table.reader.error(&table.path_of("force"), CaseCode::Empty, "the bolt has no force", help);
    }
    let words = [("length", Keeps::Length), ("force", Keeps::Force)];
    let keeps = table.word("keeps", &words).or(Keeps::Length);
    names.add_set(table.reader, table.path(), &name, None);
    table.finish();
    Bolt { name, body, section, force, keeps }
}
