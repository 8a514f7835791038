//! Supports and motions (`[[dirichlet]]`) and the load path (`[load_path]`).

use super::super::CaseCode;
use super::super::document::Table;
use super::super::names::Names;
use super::super::resolved::{
    Body, Component, Contact, Dirichlet, LoadCase, LoadPath, RotationAxis, Spring, SpringEnd, StartValues, Tolerance,
    Until, Waypoint,
};
use super::common::direction;
use super::load_case;
use slipstick_model::words::quantity;

pub(super) const COMPONENTS: [(&str, Component); 3] = [("x", Component::X), ("y", Component::Y), ("z", Component::Z)];

/// Placeholder if the number of steps cannot be read: every step exists.
const UNKNOWN_STEPS: usize = usize::MAX >> 1;

pub(super) fn load_path(root: &Table<'_>) -> LoadPath {
    let relative = 1e-9;
    let mut tolerance = Tolerance { relative, residual: None, displacement: None, contact: None, multiplier: None };
    let start_values = StartValues::PreviousDesign;
    root.require("load_path", "for instance [load_path] with steps = 10");
    let Some(table) = root.table("load_path") else {
        return LoadPath {
            steps: UNKNOWN_STEPS,
            tolerance,
            max_newton_iterations: 25,
            max_cutbacks: LoadPath::USUAL_CUTBACKS,
            start_values,
            viscosity: 0.0,
        };
    };
    let steps = table
        .integer("steps")
        .count(CaseCode::Steps, 1)
        .required(UNKNOWN_STEPS, "the number of equal steps of pseudo-time from 0 to 1");
    if let Some(inner) = table.table("tolerance") {
        let bound = |key| inner.number(key).positive(CaseCode::OutOfRange);
        tolerance = Tolerance {
            relative: bound("relative")
                .check(
                    CaseCode::OutOfRange,
                    |&bound| bound <= 1e-2,
                    "is too large: the result would not be an equilibrium",
                    "1e-9 is usual",
                )
                .or(relative),
            residual: bound("residual").optional(),
            displacement: bound("displacement").optional(),
            contact: bound("contact").optional(),
            multiplier: bound("multiplier").optional(),
        };
        inner.finish();
    }
    let max_newton_iterations = table.integer("max_newton_iterations").count(CaseCode::OutOfRange, 1).or(25);
    let max_cutbacks = table.integer("max_cutbacks").count(CaseCode::OutOfRange, 0).or(LoadPath::USUAL_CUTBACKS);
    let start_values = table
        .word(
            "start_values",
            &[
                ("previous_design", StartValues::PreviousDesign),
                ("extrapolated", StartValues::Extrapolated),
                ("last_state", StartValues::LastState),
            ],
        )
        .or(start_values);
    let viscosity = table
        .number("viscosity")
        .check(CaseCode::OutOfRange, |&c| c >= 0.0, "must not be negative", "0 is none")
        .or(0.0);
    table.finish();
    LoadPath { steps, tolerance, max_newton_iterations, max_cutbacks, start_values, viscosity }
}

pub(super) fn dirichlet(
    root: &Table<'_>,
    names: &Names,
    turning: &[&str],
    cases: &[LoadCase],
    steps: usize,
) -> Vec<Dirichlet> {
    let mut conditions: Vec<Dirichlet> = Vec::new();
    for table in root.tables("dirichlet") {
        let reader = table.reader;
        let path = table.path_of("set");
        let condition = condition(table, names, turning, cases, steps);
        let together = |other: &Dirichlet| match (&other.load_case, &condition.load_case) {
            (Some(a), Some(b)) => a == b,
            _ => true,
        };
        let conflict = conditions.iter().position(|other| {
            together(other)
                && other.set == condition.set
                && (other.components.iter().any(|c| condition.components.contains(c))
                    || other.rotations.iter().any(|c| condition.rotations.contains(c)))
        });
        if let (Some(other), false) = (conflict, condition.set.is_empty()) {
            reader.error(
                &path,
                CaseCode::ConflictingDirichlet,
                format!("`dirichlet[{other}]` already prescribes a component of `{}`", condition.set),
                "merge the two tables, or list different `components` in them: a component of a set has one table, also if \
                 it begins or ends within the path",
            );
        }
        conditions.push(condition);
    }
    conditions
}

fn condition(table: Table<'_>, names: &Names, turning: &[&str], cases: &[LoadCase], steps: usize) -> Dirichlet {
    let help = "a surface, for instance \"plate_ymin\", or the name of a [[set]]";
    let set = table.string("set").required(String::new(), help);
    names.check_set(table.reader, &table.path_of("set"), &set);
    let rigid = turning.contains(&set.as_str());
    let (components, rotations) = components(&table, rigid);
    let rotation = table.table("rotation").map(|axis| {
        let help = "a point on the axis [x, y, z]";
        let point = axis.vector("point").required([0.0; 3], help);
        let direction = direction(&axis, "direction");
        axis.finish();
        RotationAxis { point, direction }
    });
    let motion = motion(&table, &components, rotation.is_some(), steps);
    if let (true, Some(axis)) = (rigid && motion.iter().any(|point| point.angle != 0.0), &rotation)
        && COMPONENTS.iter().any(|(_, c)| axis.direction[c.index()] != 0.0 && !rotations.contains(c))
    {
        let message = "the axis has a component about which the rotation is not prescribed";
        let help = "add the rotations (\"rx\", \"ry\", \"rz\") to `components`, or omit `components`";
        table.reader.error(&table.path_of("rotation"), CaseCode::Motion, message, help);
    }
    let load_case = load_case::of(&table, cases);
    let (from, until) = span(&table, steps);
    let condition = Dirichlet { set, load_case, components, rotations, motion, rotation, from, until };
    check_span(&table, &condition, rigid);
    warn_of_end(&table, &condition);
    table.finish();
    condition
}

/// When the support begins and ends, at ends of load steps; it lets go over the load step after its end.
fn span(table: &Table<'_>, steps: usize) -> (f64, Option<Until>) {
    let n = steps as f64;
    let outside = "must lie between 0 and 1";
    let end_of_step = |key: &str, t: f64| {
        let end = (t * n - 1e-6).ceil().max(0.0) / n;
        if (end - t).abs() > 1e-9 {
            let message = format!("t = {t} lies within a load step, and counts as its end, {}", quantity(end));
            let help = "choose `load_path.steps` so that t × steps is a whole number";
            table.reader.warning(&table.path_of(key), CaseCode::CornerBetweenSteps, message, help);
        }
        // exactly what was given, where this is the end of a step
        if (end - t).abs() > 1e-9 { end } else { t }
    };
    let from = table.number("from");
    let from = from.check(CaseCode::MotionTime, |&t| (0.0..1.0).contains(&t), outside, "pseudo-time runs from 0 to 1");
    let from = end_of_step("from", from.or(0.0));
    let until = table
        .number("until")
        .check(CaseCode::MotionTime, |&t| t > 0.0 && t < 1.0, outside, "omit the key for a support that does not end")
        .optional()
        .map(|t| end_of_step("until", t));
    if from >= 1.0 || until.is_some_and(|t| t <= from) {
        let key = if until.is_some() { "until" } else { "from" };
        let message = "the support acts in no load step";
        table.reader.error(&table.path_of(key), CaseCode::MotionTime, message, "begin earlier, or end later");
    }
    let until = until.filter(|t| *t < 1.0).map(|t| Until { t, released: ((t * n).round() + 1.0) / n });
    (from, until)
}

/// A motion that is not finished when the support ends.
fn warn_of_end(table: &Table<'_>, condition: &Dirichlet) {
    let Some(until) = condition.until else { return };
    if let Some(point) = condition.motion.iter().find(|point| point.t > until.t + 1e-9) {
        let message = format!("the support ends at t = {}, before its waypoint at t = {}", quantity(until.t), point.t);
        let help = "the nodes are let go on the way there; omit `until`, or move the waypoint";
        table.reader.warning(&table.path_of("motion"), CaseCode::MotionTime, message, help);
    }
}

/// What a support that begins or ends cannot be.
fn check_span(table: &Table<'_>, condition: &Dirichlet, rigid: bool) {
    if condition.is_permanent() {
        return;
    }
    let key = table.path_of(if condition.from > 0.0 { "from" } else { "until" });
    let refuse = |message: &str, help: &str| table.reader.error(&key, CaseCode::Motion, message, help);
    if rigid {
        refuse(
            "only supports of nodes of deformable bodies can begin or end within the path",
            "tie the rigid body to a deformable body, and hold that one; or omit the key",
        );
    } else if condition.rotation.is_some() {
        refuse("a rotation cannot begin or end within the path", "omit the key, or prescribe displacements");
    } else if condition.load_case.is_some() {
        refuse("a support of one load case cannot begin or end within the path", "omit `load_case` or this key");
    }
    let early = condition.motion.iter().find(|point| point.t <= condition.from + 1e-9 && condition.from > 0.0);
    if let Some(point) = early {
        let message = format!("the waypoint at t = {} is not later than `from`", point.t);
        let help = "begin with the position that the nodes move to; until then they are free";
        table.reader.error(&table.path_of("motion"), CaseCode::MotionTime, message, help);
    }
}

/// The prescribed translations, and for a rigid body the prescribed rotations.
fn components(table: &Table<'_>, rigid: bool) -> (Vec<Component>, Vec<Component>) {
    let reader = table.reader;
    let all = COMPONENTS.map(|(_, component)| component).to_vec();
    let one = |value, path: String| {
        let word = reader.string(value, "a component")?;
        let plain = word.strip_prefix('r').filter(|_| rigid);
        let found = COMPONENTS.iter().find(|(name, _)| *name == plain.unwrap_or(&word));
        if found.is_none() {
            let message = format!("there is no component `{word}`");
            let help = if rigid { "components: x, y, z, rx, ry, rz" } else { "components: x, y, z" };
            reader.error(&path, CaseCode::UnknownWord, message, help);
        }
        found.map(|&(_, component)| (component, plain.is_some()))
    };
    let help = "omit the key to prescribe all";
    let listed = table
        .list("components", one)
        .check(CaseCode::Empty, |list| !list.is_empty(), "lists no component", help)
        .optional();
    let Some(listed) = listed else {
        return (all.clone(), if rigid { all } else { Vec::new() });
    };
    let of = |rotation: bool| {
        let of_kind = listed.iter().filter(|(_, turns)| *turns == rotation);
        let mut components: Vec<Component> = of_kind.map(|&(component, _)| component).collect();
        components.sort_unstable();
        components.dedup();
        components
    };
    let (components, rotations) = (of(false), of(true));
    if components.len() + rotations.len() < listed.len() {
        reader.error(&table.path_of("components"), CaseCode::DuplicateName, "a component is listed twice", "");
    }
    (components, rotations)
}

/// The waypoints; an omitted `u` or `angle` keeps its value of the previous waypoint.
fn motion(table: &Table<'_>, components: &[Component], has_axis: bool, steps: usize) -> Vec<Waypoint> {
    let mut points: Vec<Waypoint> = Vec::new();
    for point in table.tables("motion") {
        let last = points.last().copied().unwrap_or(Waypoint { t: 0.0, u: [0.0; 3], angle: 0.0 });
        points.push(waypoint(point, &last, components, has_axis, steps));
    }
    if has_axis && points.iter().all(|point| point.angle == 0.0) {
        table.reader.warning(
            &table.path_of("rotation"),
            CaseCode::Motion,
            "an axis of rotation without an angle has no effect",
            "give the waypoints an `angle` in degrees, or remove `rotation`",
        );
    }
    let mut last = (0.0, 0.0);
    for point in &points {
        // within a load step, displacements are linear: a larger rotation would be a different
        // motion
        let turn = (point.angle - last.1).abs() / ((point.t - last.0) * steps as f64);
        if point.t > last.0 && turn > LARGEST_TURN * (1.0 + 1e-9) {
            table.reader.error(
                &table.path_of("motion"),
                CaseCode::Motion,
                format!("the rotation is {}° in one load step; the limit is {LARGEST_TURN}°", quantity(turn)),
                format!("set `load_path.steps` to {:.0} or more", (turn / LARGEST_TURN * steps as f64).ceil()),
            );
            break;
        }
        last = (point.t, point.angle);
    }
    points
}

/// Largest prescribed rotation in a load step. \[degrees\]
const LARGEST_TURN: f64 = 90.0;

fn waypoint(table: Table<'_>, last: &Waypoint, components: &[Component], has_axis: bool, steps: usize) -> Waypoint {
    let t = time(&table, last.t, steps);
    if !table.has("u") && !table.has("angle") {
        table.reader.error(
            table.path(),
            CaseCode::Motion,
            "a waypoint needs `u` or `angle`",
            "for instance { t = 1.0, u = [x, y, z] } or { t = 1.0, angle = 30.0 }",
        );
    }
    let free = |u: &[f64; 3]| COMPONENTS.iter().any(|(_, c)| u[c.index()] != 0.0 && !components.contains(c));
    let u = table
        .vector("u")
        .check(
            CaseCode::Motion,
            |u| !free(u),
            "moves a component that is not prescribed",
            "write 0 for it, or add the component to `components`",
        )
        .or(last.u);
    let angle = table
        .number("angle")
        .check(
            CaseCode::Motion,
            |&angle| has_axis || angle == 0.0,
            "needs an axis",
            "add rotation = { point = [x, y, z], direction = [x, y, z] } to the [[dirichlet]] table",
        )
        .or(last.angle);
    table.finish();
    Waypoint { t, u, angle }
}

/// Pseudo-time of a waypoint, later than the previous one.
pub(super) fn time(table: &Table<'_>, earliest: f64, steps: usize) -> f64 {
    let t = table
        .number("t")
        .check(
            CaseCode::MotionTime,
            |&t| t > 0.0 && t <= 1.0,
            "must lie in (0, 1]",
            "pseudo-time runs from 0, at rest, to 1",
        )
        .check(
            CaseCode::MotionTime,
            |&t| t > earliest,
            "must be later than at the previous waypoint",
            "list the waypoints in order of time",
        )
        .optional();
    table.require("t", "pseudo-time of the waypoint, in (0, 1]");
    if let Some(t) = t {
        warn_corner(table, "t", t, steps);
    }
    t.unwrap_or(earliest)
}

/// Data along the path change from load step to load step, so a waypoint between two is skipped.
pub(super) fn warn_corner(table: &Table<'_>, key: &str, t: f64, steps: usize) {
    let position = t * steps as f64;
    if (position - position.round()).abs() > 1e-9 * steps as f64 {
        table.reader.warning(
            &table.path_of(key),
            CaseCode::CornerBetweenSteps,
            format!(
                "the waypoint at t = {t} lies between load steps {} and {} and is skipped",
                position.floor(),
                position.ceil()
            ),
            "choose `load_path.steps` so that t × steps is a whole number",
        );
    }
}

/// Warns of bodies without any support or prescribed motion.
pub(super) fn warn_unsupported(
    root: &Table<'_>,
    names: &Names,
    bodies: &[Body],
    contacts: &[Contact],
    dirichlet: &[Dirichlet],
    springs: &[Spring],
) {
    let body_of = |name: &str| names.find(name).map(|(_, body)| body);
    // A set of several bodies may support any of them, and an unknown name is already an error.
    if dirichlet.iter().any(|condition| !matches!(body_of(&condition.set), Some(Some(_)))) {
        return;
    }
    for (number, body) in bodies.iter().enumerate() {
        // a surface that several bodies share may hold any of them
        let on_body = |name: &str| match body_of(name) {
            Some(Some(body)) => body == number,
            of_several => of_several.is_some(),
        };
        let sprung = springs
            .iter()
            .any(|spring| on_body(&spring.set) || matches!(&spring.to, Some(SpringEnd::Set(to)) if on_body(to)));
        if sprung || dirichlet.iter().any(|condition| on_body(&condition.set)) {
            continue;
        }
        let touches = contacts.iter().any(|pair| on_body(&pair.slave) || on_body(&pair.master));
        if contacts.iter().any(|pair| pair.tied && (on_body(&pair.slave) || on_body(&pair.master))) {
            continue;
        }
        let what = if touches {
            "only contact can hold it, and nothing holds it until it touches"
        } else {
            "it has neither supports nor contact"
        };
        root.reader.warning(
            &format!("body[{number}].name"),
            CaseCode::UnsupportedBody,
            format!("nothing is prescribed on the body `{}`: {what}", body.name),
            "hold or move one of its surfaces in a [[dirichlet]] table",
        );
    }
}
