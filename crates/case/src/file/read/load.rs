//! Loads on surfaces, rigid bodies and mass (`[[load]]`).

use super::super::CaseCode;
use super::super::document::Table;
use super::super::names::Names;
use super::super::resolved::{AmplitudePoint, Body, Centrifugal, Load, LoadCase, LoadKind};
use super::common::direction;
use super::{load_case, motion};

/// `turning`: what has a rotation.
pub(super) fn loads(
    root: &Table<'_>,
    names: &Names,
    (turning, bodies): (&[&str], &[Body]),
    cases: &[LoadCase],
    steps: usize,
) -> Vec<Load> {
    root.tables("load").into_iter().map(|table| load(table, names, (turning, bodies), cases, steps)).collect()
}

fn load(
    table: Table<'_>,
    names: &Names,
    (turning, bodies): (&[&str], &[Body]),
    cases: &[LoadCase],
    steps: usize,
) -> Load {
    let on_mass = MASS.iter().copied().find(|key| table.has(key));
    let (surface, body) = match on_mass {
        Some(key) => (String::new(), body_with_mass(&table, key, names, bodies)),
        None => (table.string("surface").required(String::new(), "a surface, for instance \"plate_ymax\""), None),
    };
    let rigid = on_mass.is_none() && turning.contains(&surface.as_str());
    let nodal = table.has("nodal_force");
    if on_mass.is_some() {
    } else if !rigid && nodal {
        names.check_set(table.reader, &table.path_of("surface"), &surface);
    } else if !rigid {
        names.check_surface(table.reader, &table.path_of("surface"), &surface);
    }
    let not_zero = "is a load of zero";
    let vector = |key| {
        table
            .vector(key)
            .check(
                CaseCode::OutOfRange,
                |v| v.iter().any(|&v| v != 0.0),
                not_zero,
                "give it a value, or remove the load",
            )
            .or([0.0; 3])
    };
    const OF_SURFACES: &[&str] = &["pressure", "traction", "force", "nodal_force", MASS[0], MASS[1]];
    let kinds: &[&str] = if rigid { &["force", "moment"] } else { OF_SURFACES };
    let kind = match table.choose("the value of the load", kinds) {
        Some("traction") => LoadKind::Traction(vector("traction")),
        Some("moment") => LoadKind::Moment(vector("moment")),
        Some("nodal_force") => LoadKind::NodalForce(vector("nodal_force")),
        Some("force") => LoadKind::Force(vector("force")),
        Some("gravity") => LoadKind::Gravity(vector("gravity")),
        Some("centrifugal") => LoadKind::Centrifugal(centrifugal(&table)),
        Some(_) => {
            let pressure = table.number("pressure");
            LoadKind::Pressure(
                pressure
                    .check(
                        CaseCode::OutOfRange,
                        |&p| p != 0.0,
                        not_zero,
                        "a positive pressure presses, a negative one pulls",
                    )
                    .or(0.0),
            )
        }
        None => LoadKind::Pressure(0.0),
    };
    let amplitude = amplitude_of(&table, steps);
    let load_case = load_case::of(&table, cases);
    table.finish();
    Load { surface, body, load_case, kind, amplitude }
}

/// The keys of loads on mass.
const MASS: [&str; 2] = ["gravity", "centrifugal"];

/// The body on whose mass the load acts, `None` for all, which must have mass.
fn body_with_mass(table: &Table<'_>, key: &'static str, names: &Names, bodies: &[Body]) -> Option<String> {
    if table.value("surface").is_some() {
        let message = format!("`{key}` acts on the mass of bodies, not on a surface");
        let help = "write body = \"…\", or omit the key for all bodies";
        table.reader.error(&table.path_of("surface"), CaseCode::ChooseOne, message, help);
    }
    let body = table.string("body").optional();
    if let Some(body) = &body {
        names.check_body(table.reader, &table.path_of("body"), body);
    }
    let mut meant = bodies.iter().filter(|known| body.as_ref().is_none_or(|body| known.name == *body)).peekable();
    if meant.peek().is_some() && !meant.any(Body::has_mass) {
        let message = match &body {
            Some(body) => format!("`{body}` has no `mass_density` on which `{key}` acts"),
            None => format!("no body has a `mass_density` on which `{key}` acts"),
        };
        table.value(key);
        table.reader.error(&table.path_of(key), CaseCode::MissingKey, message, "add the key to the [[body]]");
    }
    body
}

fn centrifugal(table: &Table<'_>) -> Centrifugal {
    let none = Centrifugal { point: [0.0; 3], direction: [0.0, 1.0, 0.0], angular_velocity: 1.0 };
    let Some(table) = table.table("centrifugal") else { return none };
    let centrifugal = Centrifugal {
        point: table.vector("point").required(none.point, "a point on the axis [x, y, z]"),
        direction: direction(&table, "direction"),
        angular_velocity: table
            .number("angular_velocity")
            .check(
                CaseCode::OutOfRange,
                |&omega| omega != 0.0,
                "is a load of zero",
                "give it a value, or remove the load",
            )
            .required(1.0, "radians per unit of time"),
    };
    table.finish();
    centrifugal
}

/// The waypoints of `amplitude`; if it is omitted, a linear growth.
pub(super) fn amplitude_of(table: &Table<'_>, steps: usize) -> Vec<AmplitudePoint> {
    let way_points = table.list("amplitude", |value, path| table.reader.table(value, path));
    match way_points.optional() {
        Some(way_points) => amplitude(table, way_points, steps),
        None => vec![AmplitudePoint { t: 1.0, factor: 1.0 }],
    }
}

/// The waypoints; each needs a `factor`.
fn amplitude(table: &Table<'_>, way_points: Vec<Table<'_>>, steps: usize) -> Vec<AmplitudePoint> {
    let mut points: Vec<AmplitudePoint> = Vec::new();
    for point in way_points {
        let t = motion::time(&point, points.last().map_or(0.0, |last| last.t), steps);
        let factor = point.number("factor").required(1.0, "the factor on the load at this time");
        point.finish();
        points.push(AmplitudePoint { t, factor });
    }
    if points.iter().all(|point| point.factor == 0.0) {
        table.reader.error(
            &table.path_of("amplitude"),
            CaseCode::Empty,
            "the load is always zero",
            "omit `amplitude` for a load that grows linearly to its value at t = 1",
        );
    }
    points
}
