//! Values that several parts of a case have: names, directions, boxes and cylinders.

use super::super::CaseCode;
use super::super::document::Table;
use super::super::resolved::{BoxRegion, Cylinder};

/// A name: letters, digits, `_` and `-`, so that it can be used in paths, file names and tables.
/// Empty after an error.
pub(crate) fn name(table: &Table<'_>) -> String {
    let allowed = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
    table
        .string("name")
        .check(
            CaseCode::BadName,
            |name| !name.is_empty() && name.chars().all(allowed),
            "must consist of letters, digits, `_` and `-`",
            "for instance \"plate\" or \"lower_ring\"",
        )
        .required(String::new(), "for instance name = \"plate\"")
}

/// A list of boxes `{ min = […], max = […] }`.
pub(crate) fn boxes(table: &Table<'_>, key: &'static str) -> Vec<BoxRegion> {
    table.tables(key).into_iter().map(box_region).collect()
}

/// A box `{ min = […], max = […] }`.
pub(crate) fn box_region(table: Table<'_>) -> BoxRegion {
    let help = "the box's lowest and highest corner: { min = [x, y, z], max = [x, y, z] }";
    let min = table.vector("min").required([0.0; 3], help);
    let ordered = |max: &[f64; 3]| (0..3).all(|i| min[i] <= max[i]);
    let max = table
        .vector("max")
        .check(CaseCode::BadShape, ordered, "is below `min`", "swap the two bounds")
        .required(min, help);
    table.finish();
    BoxRegion { min, max }
}

/// A solid cylinder.
pub(crate) fn cylinder(table: Table<'_>) -> Cylinder {
    let cylinder = axis_and_radius(&table);
    table.finish();
    cylinder
}

/// The axis and the radius of a cylinder, in a table with further keys.
pub(crate) fn axis_and_radius(table: &Table<'_>) -> Cylinder {
    let start = table.vector("start").required([0.0; 3], "one end of the axis [x, y, z]");
    let end = table
        .vector("end")
        .check(CaseCode::BadShape, |end| *end != start, "is the same point as `start`", "the axis must have a length")
        .required(start.map(|x| x + 1.0), "the other end of the axis [x, y, z]");
    let radius = table.number("radius").positive(CaseCode::BadShape).required(1.0, "a length");
    Cylinder { start, end, radius, tolerance: None }
}

/// A direction: three numbers, not all zero.
pub(crate) fn direction(table: &Table<'_>, key: &'static str) -> [f64; 3] {
    table
        .vector(key)
        .check(
            CaseCode::OutOfRange,
            |axis| axis.iter().any(|&x| x != 0.0),
            "must not be the zero vector",
            "the y axis is [0, 1, 0]",
        )
        .required([0.0, 1.0, 0.0], "a direction, for instance [0, 1, 0]")
}
