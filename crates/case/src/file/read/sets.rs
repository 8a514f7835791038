//! Surfaces (`[[surface]]`) and node sets (`[[set]]`) that the case defines.

use super::super::CaseCode;
use super::super::document::Table;
use super::super::names::Names;
use super::super::resolved::{Connected, Cylinder, NodeSet, NormalCone, Plane, Sphere, SurfaceSet};
use super::common::{axis_and_radius, boxes, direction, name};

/// Half the angle between adjacent faces of a box: each facet belongs to the nearest direction.
const DEFAULT_ANGLE: f64 = 45.0;

/// Largest angle between the normals of neighbouring facets of a smooth face.
const SMOOTH: f64 = 30.0;

pub(super) fn surfaces(root: &Table<'_>, names: &mut Names) -> Vec<SurfaceSet> {
    if root.has_misspelt("surface") {
        names.excuse_all();
    }
    root.tables("surface").into_iter().map(|table| surface(table, names)).collect()
}

fn surface(table: Table<'_>, names: &mut Names) -> SurfaceSet {
    let name = name(&table);
    let word = |value: &toml::Spanned<toml::de::DeValue<'_>>, path: String| table.reader.string(value, &path);
    let of = table
        .list("of", word)
        .check(CaseCode::Empty, |list| !list.is_empty(), "lists no surface", "for instance of = [\"left\", \"right\"]")
        .or(Vec::new());
    if table.has("of") {
        return union(table, names, name, of);
    }
    let body = table.string("body").required(String::new(), "the body whose boundary facets are selected");
    names.check_body(table.reader, &table.path_of("body"), &body);
    let within = table.string("within").optional();
    if let Some(within) = &within {
        let path = table.path_of("within");
        names.check_surface(table.reader, &path, within);
        let of = names.find(within).and_then(|(_, of)| of);
        if of.is_some() && names.body(&body).is_some() && of != names.body(&body) {
            let message = format!("`{within}` is not a surface of `{body}`");
            table.reader.error(&path, CaseCode::UnknownSet, message, "name a surface of the same body");
        }
    }
    let boxes = boxes(&table, "boxes");
    let normal = table.table("normal").map(|cone| {
        let (direction, degrees) = (direction(&cone, "direction"), degrees(&cone, DEFAULT_ANGLE));
        cone.finish();
        NormalCone { direction, degrees }
    });
    let (cylinder, sphere) = (table.table("cylinder").map(cylinder), table.table("sphere").map(sphere));
    let connected = table.table("connected").map(|face| {
        let to = face.vector("to").required([0.0; 3], "a point on the smooth face or near it [x, y, z]");
        let degrees = degrees(&face, SMOOTH);
        face.finish();
        Connected { to, degrees }
    });
    let keys = &["boxes", "normal", "cylinder", "sphere", "connected", "within"];
    conditions(&table, "a surface", keys, boxes.is_empty());
    names.add_surface(table.reader, table.path(), &name, names.body(&body));
    table.finish();
    SurfaceSet { name, body: Some(body), of: Vec::new(), within, boxes, normal, cylinder, sphere, connected }
}

/// The key `degrees`.
fn degrees(table: &Table<'_>, default: f64) -> f64 {
    let range = |angle: &f64| (0.0..=180.0).contains(angle);
    table.number("degrees").check(CaseCode::OutOfRange, range, "must lie between 0 and 180", "").or(default)
}

/// The key `tolerance`.
fn tolerance(table: &Table<'_>) -> Option<f64> {
    let range = |&length: &f64| length >= 0.0;
    table.number("tolerance").check(CaseCode::OutOfRange, range, "must not be negative", "").optional()
}

/// A solid cylinder, or its mantle.
fn cylinder(table: Table<'_>) -> Cylinder {
    let cylinder = Cylinder { tolerance: tolerance(&table), ..axis_and_radius(&table) };
    table.finish();
    cylinder
}

/// A ball, or its surface.
fn sphere(table: Table<'_>) -> Sphere {
    let centre = table.vector("centre").required([0.0; 3], "the centre of the sphere [x, y, z]");
    let radius = table.number("radius").positive(CaseCode::BadShape).required(1.0, "a length");
    let tolerance = tolerance(&table);
    table.finish();
    Sphere { centre, radius, tolerance }
}

/// A surface that consists of others.
fn union(table: Table<'_>, names: &mut Names, name: String, of: Vec<String>) -> SurfaceSet {
    for (i, part) in of.iter().enumerate() {
        let path = format!("{}[{i}]", table.path_of("of"));
        names.check_surface(table.reader, &path, part);
        if of[..i].contains(part) {
            table.reader.error(
                &path,
                CaseCode::DuplicateName,
                format!("`{part}` is listed twice"),
                "remove one of them",
            );
        }
    }
    let bodies: Vec<Option<usize>> = of.iter().map(|part| names.find(part).and_then(|(_, body)| body)).collect();
    let first = bodies.first().copied().flatten();
    let body = first.filter(|_| bodies.iter().all(|body| *body == first));
    names.add_surface(table.reader, table.path(), &name, body);
    table.finish();
    SurfaceSet { name, of, ..SurfaceSet::default() }
}

pub(super) fn sets(root: &Table<'_>, names: &mut Names) -> Vec<NodeSet> {
    if root.has_misspelt("set") {
        names.excuse_all();
    }
    root.tables("set").into_iter().map(|table| set(table, names)).collect()
}

fn set(table: Table<'_>, names: &mut Names) -> NodeSet {
    let name = name(&table);
    let within = table.string("within").optional();
    if let Some(within) = &within {
        names.check_set(table.reader, &table.path_of("within"), within);
    }
    let body = table.string("body").optional();
    if let Some(body) = &body {
        let path = table.path_of("body");
        names.check_body(table.reader, &path, body);
        let of = within.as_ref().and_then(|within| names.find(within)).and_then(|(_, of)| of);
        if let (Some(of), Some(body_number), Some(within)) = (of, names.body(body), &within)
            && of != body_number
        {
            let message = format!("`{within}` is not a set of `{body}`");
            table.reader.error(
                &path,
                CaseCode::UnknownSet,
                message,
                "name the body to which it belongs, or omit `body`",
            );
        }
    }
    let of = match (&body, &within) {
        (Some(body), _) => names.body(body),
        (None, Some(within)) => names.find(within).and_then(|(_, of)| of),
        (None, None) => None,
    };
    names.add_set(table.reader, table.path(), &name, of);
    let boxes = boxes(&table, "boxes");
    let plane = table.table("plane").map(plane);
    let cylinder = table.table("cylinder").map(cylinder);
    let nearest = table.vector("nearest").optional();
    conditions(&table, "a set", &["boxes", "plane", "cylinder", "nearest", "within", "body"], boxes.is_empty());
    table.finish();
    NodeSet { name, body, within, boxes, plane, cylinder, nearest }
}

/// Reports an empty list of boxes, and a table without any of the keys.
fn conditions(table: &Table<'_>, what: &str, keys: &'static [&'static str], no_boxes: bool) {
    if table.has("boxes") && no_boxes {
        let help = "boxes = [{ min = [x, y, z], max = [x, y, z] }]";
        let message = format!("{what} with `boxes` needs at least one box");
        table.reader.error(&table.path_of("boxes"), CaseCode::Empty, message, help);
    }
    table.require_one_of(keys, &format!("{what} needs a condition"));
}

fn plane(table: Table<'_>) -> Plane {
    let point = table.vector("point").required([0.0; 3], "a point on the plane [x, y, z]");
    let normal = direction(&table, "normal");
    let tolerance = tolerance(&table);
    table.finish();
    Plane { point, normal, tolerance }
}
