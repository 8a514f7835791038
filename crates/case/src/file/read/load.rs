//! Loads on surfaces and rigid bodies (`[[load]]`).

use super::super::CaseCode;
use super::super::document::Table;
use super::super::names::Names;
use super::super::resolved::{AmplitudePoint, Load, LoadCase, LoadKind};
use super::{load_case, motion};

pub(super) fn loads(root: &Table<'_>, names: &Names, turning: &[&str], cases: &[LoadCase], steps: usize) -> Vec<Load> {
    root.tables("load").into_iter().map(|table| load(table, names, turning, cases, steps)).collect()
}

fn load(table: Table<'_>, names: &Names, turning: &[&str], cases: &[LoadCase], steps: usize) -> Load {
    let surface = table.string("surface").required(String::new(), "a surface, for instance \"plate_ymax\"");
    let rigid = turning.contains(&surface.as_str());
    let nodal = table.has("nodal_force");
    if !rigid && nodal {
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
    let kinds: &[&str] = if rigid { &["force", "moment"] } else { &["pressure", "traction", "force", "nodal_force"] };
    let kind = match table.choose("the value of the load", kinds) {
        Some("traction") => LoadKind::Traction(vector("traction")),
        Some("moment") => LoadKind::Moment(vector("moment")),
        Some("nodal_force") => LoadKind::NodalForce(vector("nodal_force")),
        Some("force") => LoadKind::Force(vector("force")),
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
    let way_points = table.list("amplitude", |value, path| table.reader.table(value, path));
    let amplitude = match way_points.optional() {
        Some(way_points) => amplitude(&table, way_points, steps),
        None => vec![AmplitudePoint { t: 1.0, factor: 1.0 }],
    };
    let load_case = load_case::of(&table, cases);
    table.finish();
    Load { surface, load_case, kind, amplitude }
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
