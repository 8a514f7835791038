//! Passive regions, ties and the overhang filter of a design.

use super::super::CaseCode;
use super::super::document::Table;
use super::super::names::Names;
use super::super::reader::suggestion_or_list;
use super::super::resolved::{BuildDirection, DesignSymmetry, Direction, Overhang, Pattern, Region};
use super::common::{box_region, cylinder, direction};
use super::motion::COMPONENTS;

/// The keys that tell what kind of region a table describes.
const REGIONS: &[&str] = &["min", "start", "axis", "centre", "surface", "set", "part", "body"];

/// A list of passive regions.
pub(super) fn regions(table: &Table<'_>, key: &'static str, names: &Names) -> Vec<Region> {
    table.tables(key).into_iter().filter_map(|table| region(table, REGIONS, names)).collect()
}

/// The keys of regions that depend on nothing but the mesh of a body.
pub(super) const OF_BODY: &[&str] = &["min", "start", "axis", "centre", "part"];

/// A region of one of the `kinds`; `None` after an error that leaves the kind unknown.
pub(super) fn region(table: Table<'_>, kinds: &'static [&'static str], names: &Names) -> Option<Region> {
    let reader = table.reader;
    // half of a box or cylinder is one with a missing key
    let half = [("max", "min"), ("end", "start")].into_iter().find(|(other, key)| table.has(other) && !table.has(key));
    let kind = match half {
        Some((_, key)) => Some(key),
        None => table.choose("the kind of region", kinds),
    };
    let positive = |key: &'static str, help: &str| table.number(key).positive(CaseCode::OutOfRange).required(1.0, help);
    let name = |key: &'static str| table.string(key).required(String::new(), "");
    let within = || positive("within", "the largest distance of an element's centroid from it");
    let radius = || positive("radius", "the radius of the region");
    let region = match kind {
        Some("min") => {
            let found = box_region(table);
            return Some(Region::Box { min: found.min, max: found.max });
        }
        Some("start") => {
            let found = cylinder(table);
            return Some(Region::Cylinder { start: found.start, end: found.end, radius: found.radius });
        }
        Some("axis") => {
            let axis = axis_or_vector(&table, "axis");
            Some(Region::EndlessCylinder { axis, through: table.vector("through").or([0.0; 3]), radius: radius() })
        }
        Some("centre") => {
            let centre = table.vector("centre").required([0.0; 3], "the centre of the ball");
            Some(Region::Ball { centre, radius: radius() })
        }
        Some("surface") => {
            let surface = name("surface");
            names.check_surface(reader, &table.path_of("surface"), &surface);
            Some(Region::NearSurface { surface, within: within() })
        }
        Some("set") => {
            let set = name("set");
            names.check_set(reader, &table.path_of("set"), &set);
            Some(Region::NearSet { set, within: within() })
        }
        Some("part") => {
            let part = name("part");
            names.check_part(reader, &table.path_of("part"), &part);
            Some(Region::Part { part })
        }
        Some("body") => {
            let body = name("body");
            names.check_body(reader, &table.path_of("body"), &body);
            Some(Region::Body { body })
        }
        _ => {
            know(&table, &["max", "end", "through", "radius", "within"]);
            None
        }
    };
    table.finish();
    region
}

/// Marks keys as known that belong to some kind of a table whose kind is not clear: one mistake is one
/// error.
fn know(table: &Table<'_>, keys: &[&'static str]) {
    for key in keys {
        table.value(key);
    }
}

/// An axis by its letter, or a vector.
fn axis_or_vector(table: &Table<'_>, key: &'static str) -> Direction {
    table.require(key, "\"x\", \"y\", \"z\" or a direction [x, y, z]");
    match table.value(key) {
        Some(value) if value.get_ref().as_array().is_some() => Direction::Vector(direction(table, key)),
        _ => Direction::Axis(table.word(key, &COMPONENTS).or(COMPONENTS[0].1)),
    }
}

/// The design body that a tie is limited to.
fn own_body(table: &Table<'_>, bodies: &[String]) -> Option<String> {
    let name = table.string("body").optional()?;
    if !bodies.contains(&name) && !bodies.is_empty() {
        let message = format!("`{name}` is not a body of the design");
        table.reader.error(&table.path_of("body"), CaseCode::UnknownBody, message, suggestion_or_list(&name, bodies));
    }
    Some(name)
}

pub(super) fn symmetries(table: &Table<'_>, bodies: &[String]) -> Vec<DesignSymmetry> {
    table.tables("symmetry").into_iter().filter_map(|table| symmetry(table, bodies)).collect()
}

fn symmetry(table: Table<'_>, bodies: &[String]) -> Option<DesignSymmetry> {
    let body = own_body(&table, bodies);
    let symmetry = match table.choose("what the design is symmetric about", &["normal", "axis"]) {
        Some("normal") => Some(match axis_or_vector(&table, "normal") {
            Direction::Axis(normal) => DesignSymmetry::Plane { normal, at: table.number("at").or(0.0), body },
            Direction::Vector(normal) => {
                DesignSymmetry::InclinedPlane { normal, through: table.vector("through").or([0.0; 3]), body }
            }
        }),
        Some(_) => {
            let axis = axis_or_vector(&table, "axis");
            let through = table.vector("through").or([0.0; 3]);
            let help = "the number of equal sectors: 2 for half a turn";
            let folds = table.integer("folds").count(CaseCode::OutOfRange, 2).required(2, help);
            Some(DesignSymmetry::Rotation { axis, through, folds, body })
        }
        None => {
            know(&table, &["at", "through", "folds"]);
            None
        }
    };
    table.finish();
    symmetry
}

pub(super) fn extrude(table: &Table<'_>) -> Option<Direction> {
    table.value("extrude").map(|_| axis_or_vector(table, "extrude"))
}

pub(super) fn patterns(table: &Table<'_>, bodies: &[String]) -> Vec<Pattern> {
    let pattern = |table: Table<'_>| {
        let moves = |step: &[f64; 3]| step.iter().any(|x| *x != 0.0);
        let help = "from a cell to the next one, [x, y, z]";
        let step = table
            .vector("step")
            .check(CaseCode::OutOfRange, moves, "must not be the zero vector", help)
            .required([1.0, 0.0, 0.0], help);
        let count = table.integer("count").count(CaseCode::OutOfRange, 2).required(2, "the number of cells");
        let body = own_body(&table, bodies);
        table.finish();
        Pattern { step, count, body }
    };
    table.tables("pattern").into_iter().map(pattern).collect()
}

pub(super) fn overhang(table: &Table<'_>) -> Option<Overhang> {
    let table = table.table("overhang")?;
    let words = [
        ("x", BuildDirection::X),
        ("y", BuildDirection::Y),
        ("z", BuildDirection::Z),
        ("-x", BuildDirection::MinusX),
        ("-y", BuildDirection::MinusY),
        ("-z", BuildDirection::MinusZ),
    ];
    let help = "the direction in which layers are stacked: \"x\", \"y\", \"z\", \"-x\", \"-y\" or \"-z\"";
    let direction = table.word("direction", &words).required(BuildDirection::Z, help);
    table.finish();
    Some(Overhang { direction })
}
