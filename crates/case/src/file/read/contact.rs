//! Contact pairs (`[[contact]]`).

use super::super::CaseCode;
use super::super::document::Table;
use super::super::field::Field;
use super::super::names::Names;
use super::super::resolved::{
    Adjust, Body, CELL_RULES, Contact, Enforcement, MultiplierShape, Normals, Pressure, PressureAt, Shape, Sides,
    Stiffness, StiffnessScaling, Surfaces, ToleranceScaling,
};
use super::motion;
use slipstick_model::model::{DEFAULT_COMPLEMENTARITY, FrictionPoint, OffsetPoint};

const LAGRANGE: Enforcement = Enforcement::Lagrange {
    complementarity_parameter: Some(DEFAULT_COMPLEMENTARITY),
    stiffness: None,
    scaling: StiffnessScaling::Area,
};

/// The pairs; those whose numbers are in `exchanged` with slave and master swapped.
pub(super) fn contacts(
    root: &Table<'_>,
    names: &Names,
    bodies: &[Body],
    steps: usize,
    exchanged: &[usize],
) -> Vec<Contact> {
    let mut contacts: Vec<Contact> = Vec::new();
    for table in root.tables("contact") {
        let reader = table.reader;
        let path = table.path().to_owned();
        let mut contact = contact(table, names, bodies, steps);
        if exchanged.contains(&contacts.len()) {
            if contact.sides == Sides::Corrected {
                let Contact { slave, master, .. } = &contact;
                let message = format!(
                    "slave and master are swapped: with `{slave}` as the slave, contact with `{master}` would be missed \
                     within its facets"
                );
                let help = format!(
                    "name `{master}` as the slave, or keep the sides with `sides = \"as_given\"`; results list the pair \
                     under `{master}`"
                );
                reader.warning(&format!("{path}.slave"), CaseCode::CoarseSlave, message, help);
            }
            contact.sides = Sides::Chosen;
            std::mem::swap(&mut contact.slave, &mut contact.master);
        }
        let same = |other: &Contact| (&other.slave, &other.master) == (&contact.slave, &contact.master);
        let together = |other: &Contact| other.active[0] < contact.active[1] && contact.active[0] < other.active[1];
        if let Some(other) = contacts.iter().find(|other| same(other)).filter(|_| !contact.slave.is_empty()) {
            reader.error(
                &path,
                CaseCode::DuplicateName,
                format!("the pair {} – {} is listed twice", contact.slave, contact.master),
                match together(other) {
                    true => "remove one of them",
                    false => "exchange slave and master of one of them: a node is a slave in one pair only",
                },
            );
        }
        let reversed =
            |other: &Contact| (&other.slave, &other.master) == (&contact.master, &contact.slave) && together(other);
        if !contact.slave.is_empty() && contact.slave != contact.master && contacts.iter().any(reversed) {
            reader.error(
                &path,
                CaseCode::DuplicateName,
                format!("the pair {} – {} is listed in both directions", contact.master, contact.slave),
                "remove one of them: contact would be counted twice",
            );
        }
        contacts.push(contact);
    }
    contacts
}

fn contact(table: Table<'_>, names: &Names, shapes: &[Body], steps: usize) -> Contact {
    let slave = surface(&table, "slave", names);
    let master = surface(&table, "master", names);
    let words = [("as_given", Sides::AsGiven), ("corrected", Sides::Corrected), ("chosen", Sides::Chosen)];
    let sides = table.word("sides", &words).or(Sides::default());
    let bodies = [&slave, &master].map(|name| names.find(name).and_then(|(_, body)| body));
    let shape = bodies[0].and_then(|body| shapes.get(body)).filter(|body| !matches!(body.shape, Shape::Mesh(_)));
    let is_face = |body: &Body| [&slave, &master].iter().all(|name| name.starts_with(&format!("{}_", body.name)));
    if slave != master && bodies[0] == bodies[1] && shape.is_some_and(is_face) {
        // No two faces of a shape face each other; parts of them, listed as surfaces, may.
        table.reader.error(
            &table.path_of("master"),
            CaseCode::SameBody,
            format!("`{slave}` and `{master}` are faces of the same body, and never face each other"),
            "name a surface of another body, or parts of the faces by [[surface]] tables",
        );
    }
    let tied = table.boolean("tied").or(false);
    let friction = table.number("friction").check(
        CaseCode::Friction,
        |&mu| mu >= 0.0,
        "must not be negative",
        "0 is frictionless",
    );
    let friction = match tied {
        true => friction.or(0.0),
        false => friction.required(0.0, "the coefficient of friction; 0 is frictionless"),
    };
    let friction_path = friction_path(&table, steps);
    if friction == 0.0 && table.has("friction") && !friction_path.is_empty() {
        let message = "factors on a coefficient of friction of 0 have no effect";
        table.reader.warning(
            &table.path_of("friction_path"),
            CaseCode::Friction,
            message,
            "give `friction` a value, and begin with `factor = 0` for contact without friction at first",
        );
    }
    let shear_limit = positive(&table, "shear_limit").optional();
    if shear_limit.is_some() && friction == 0.0 && !tied {
        let message = "without friction there is no shear stress to limit";
        let help = "raise `friction`, or omit `shear_limit`";
        table.reader.warning(&table.path_of("shear_limit"), CaseCode::Friction, message, help);
    }
    let offset = offset(&table, steps);
    let active = active(&table, steps);
    let multiplier_shape = table
        .word(
            "multiplier_shape",
            &[
                ("standard", MultiplierShape::Standard),
                ("dual", MultiplierShape::Dual),
                ("mean", MultiplierShape::Mean),
            ],
        )
        .optional();
    let cell_rule = cell_rule(&table);
    let search_radius = positive(&table, "search_radius").optional();
    let feature_angle = table
        .number("feature_angle")
        .check(
            CaseCode::OutOfRange,
            |&angle| angle > 0.0 && angle <= 180.0,
            "must be greater than 0 and at most 180 degrees",
            "with 180, normals are averaged over all edges, however sharp",
        )
        .or(Contact::FEATURE_ANGLE);
    let edge_cover = table
        .number("edge_cover")
        .check(
            CaseCode::OutOfRange,
            |&cover| cover > 0.0 && cover <= 1.0,
            "must be greater than 0 and at most 1",
            "the fraction of a node's area that the master must cover for its contact condition to be rigid",
        )
        .or(Contact::EDGE_COVER);
    let surfaces =
        table.word("surfaces", &[("smooth", Surfaces::Smooth), ("faceted", Surfaces::Faceted)]).or(Surfaces::Smooth);
    let adjust = adjust(&table, names);
    let normals = table.word("normals", &[("touched", Normals::Touched), ("averaged", Normals::Averaged)]).optional();
    let enforcement = table.table("enforcement").map_or(LAGRANGE, enforcement);
    if tied {
        refuse_with_tied(&table);
    }
    if slave == master && !slave.is_empty() && (tied || !matches!(enforcement, Enforcement::Penalty { .. })) {
        table.reader.error(
            &table.path_of("master"),
            CaseCode::SameSurface,
            format!("`{slave}` is both slave and master"),
            "for a surface that touches itself, use `enforcement = { penalty = {} }`; otherwise name two surfaces",
        );
    }
    if tied && !matches!(enforcement, Enforcement::Lagrange { .. }) {
        table.reader.error(
            &table.path_of("enforcement"),
            CaseCode::Unsupported,
            "only Lagrange multipliers tie surfaces",
            "omit `enforcement`",
        );
    }
    table.finish();
    Contact {
        slave,
        master,
        sides,
        friction,
        friction_path,
        tied,
        shear_limit,
        offset,
        active,
        multiplier_shape,
        cell_rule,
        search_radius,
        feature_angle,
        edge_cover,
        surfaces,
        adjust,
        normals,
        enforcement,
    }
}

/// Refuses the keys that have no meaning for tied surfaces.
fn refuse_with_tied(table: &Table<'_>) {
    let of_sliding = ["sides", "friction", "friction_path", "shear_limit", "edge_cover"];
    let of_gaps = ["offset", "adjust", "surfaces"];
    for key in of_sliding.into_iter().chain(of_gaps).chain(["feature_angle", "normals"]) {
        if table.has(key) {
            let message = format!("`{key}` has no meaning for tied surfaces, which neither separate nor slide");
            let help = format!("omit `{key}`, or `tied`");
            table.reader.error(&table.path_of(key), CaseCode::ChooseOne, message, help);
        }
    }
}

/// A number, or waypoints `{ t, offset }`.
fn offset(table: &Table<'_>, steps: usize) -> Vec<OffsetPoint> {
    let list = table.value("offset").is_some_and(|value| value.get_ref().as_array().is_some());
    if !list {
        return table.number("offset").optional().map(|offset| OffsetPoint { t: 0.0, offset }).into_iter().collect();
    }
    let mut points: Vec<OffsetPoint> = Vec::new();
    for point in table.tables("offset") {
        let t = match point.number("t").optional() {
            Some(0.0) if points.is_empty() => 0.0,
            _ => motion::time(&point, points.last().map_or(0.0, |last| last.t), steps),
        };
        let offset = point.number("offset").required(0.0, "a length; below 0, the meshes may overlap");
        point.finish();
        points.push(OffsetPoint { t, offset });
    }
    points
}

/// Waypoints `{ t, factor }`.
fn friction_path(table: &Table<'_>, steps: usize) -> Vec<FrictionPoint> {
    let mut points: Vec<FrictionPoint> = Vec::new();
    for point in table.tables("friction_path") {
        let t = match point.number("t").optional() {
            Some(0.0) if points.is_empty() => 0.0,
            _ => motion::time(&point, points.last().map_or(0.0, |last| last.t), steps),
        };
        let factor = point
            .number("factor")
            .check(CaseCode::Friction, |&factor| factor >= 0.0, "must not be negative", "0 is frictionless")
            .required(1.0, "a factor on `friction`");
        point.finish();
        points.push(FrictionPoint { t, factor });
    }
    points
}

/// A distance, or `{ distance = …, nodes = …, gap = … }`.
fn adjust(table: &Table<'_>, names: &Names) -> Option<Adjust> {
    if !table.value("adjust")?.get_ref().is_table() {
        return positive(table, "adjust").optional().map(Adjust::Distance);
    }
    let inner = table.table("adjust")?;
    let distance = positive(&inner, "distance").optional();
    let nodes = inner.string("nodes").optional();
    if let Some(nodes) = &nodes {
        names.check_set(inner.reader, &inner.path_of("nodes"), nodes);
    }
    let gap = inner.number("gap").optional();
    if !["distance", "nodes", "gap"].into_iter().any(|key| inner.has(key)) {
        let help =
            "give the largest `distance` that is closed, the `nodes` that are adjusted, or the `gap` that they get";
        inner.reader.error(inner.path(), CaseCode::MissingKey, "nothing is adjusted", help);
    }
    inner.finish();
    Some(Adjust::Chosen { distance, nodes, gap: gap.unwrap_or(0.0) })
}

/// The part `[from, to]` of the load path.
fn active(table: &Table<'_>, steps: usize) -> [f64; 2] {
    let help = "two pseudo-times [from, to] with 0 <= from < to <= 1";
    let number = |value: &toml::Spanned<toml::de::DeValue<'_>>, path: String| table.reader.number(value, &path);
    let span = table
        .list("active", number)
        .check(
            CaseCode::MotionTime,
            |span| matches!(span[..], [from, to] if 0.0 <= from && from < to && to <= 1.0),
            "is not a part of the load path",
            help,
        )
        .optional();
    let Some([from, to]) = span.as_deref().and_then(|span| <[f64; 2]>::try_from(span).ok()) else {
        return Contact::ALWAYS;
    };
    [from, to].into_iter().for_each(|t| motion::warn_corner(table, "active", t, steps));
    [from, to]
}

/// The name of a surface; empty after an error.
fn surface(table: &Table<'_>, key: &'static str, names: &Names) -> String {
    let help = "the name of a surface: a body's name, `_`, and the face, for instance \"plate_ymax\"";
    let name = table.string(key).required(String::new(), help);
    names.check_surface(table.reader, &table.path_of(key), &name);
    name
}

fn cell_rule(table: &Table<'_>) -> usize {
    let help = format!("available numbers of points per triangle: {CELL_RULES:?}");
    table
        .integer("cell_rule")
        .check(
            CaseCode::CellRule,
            |points| CELL_RULES.iter().any(|&rule| rule as i64 == *points),
            "is not the number of points of an integration rule",
            &help,
        )
        .or(7) as usize
}

fn enforcement(table: Table<'_>) -> Enforcement {
    let chosen = table.choose("the enforcement", &["lagrange", "penalty", "augmented"]);
    let enforcement = chosen.and_then(|key| Some((key, table.table(key)?))).map(|(key, inner)| {
        let enforcement = match key {
            "lagrange" => lagrange(&inner),
            "penalty" => penalty(&inner),
            _ => augmented(&inner),
        };
        inner.finish();
        enforcement
    });
    table.finish();
    enforcement.unwrap_or(LAGRANGE)
}

fn penalty(table: &Table<'_>) -> Enforcement {
    let pressure = table.table("pressure").and_then(pressure);
    let (stiffness, scaling) = (stiffness(table), penalty_scaling(table));
    if pressure.is_some() && scaling == StiffnessScaling::Weighted {
        let message = "a pressure depends on the gap, not on the weighted gap";
        table.reader.error(&table.path_of("scaling"), CaseCode::Unsupported, message, "omit `scaling`");
    }
    let places = [("nodes", PressureAt::Nodes), ("points", PressureAt::Points)];
    let pressure_at = table.word("pressure_at", &places).or(PressureAt::Nodes);
    if pressure_at == PressureAt::Points && scaling != StiffnessScaling::Area {
        let message =
            "at an integration point, the stiffness multiplies the gap itself, not that of a node over its area";
        table.reader.error(&table.path_of("scaling"), CaseCode::Unsupported, message, "omit `scaling`");
    }
    Enforcement::Penalty { pressure, pressure_at, stiffness, scaling }
}

/// A pressure as a function of the gap; `None` after an error.
fn pressure(table: Table<'_>) -> Option<Pressure> {
    let chosen = table.choose("the law of the pressure", &["exponential", "table"]);
    let law = chosen.and_then(|key| Some((key, table.table(key)?))).map(|(key, inner)| {
        let law = match key {
            "exponential" => {
                let contact_pressure = positive(&inner, "contact_pressure").required(1.0, "the pressure without a gap");
                let clearance =
                    positive(&inner, "clearance").required(1.0, "the gap at which the pressure is 1 % of that without");
                Some(Pressure::Exponential { contact_pressure, clearance })
            }
            _ => {
                let column = |key: &'static str| {
                    let number = |value, path: String| inner.reader.number(value, &format!("`{path}`"));
                    inner.list(key, number).required(Vec::new(), "a list of numbers")
                };
                let (penetration, pressure) = (column("penetration"), column("pressure"));
                let good = penetration.len() == pressure.len()
                    && !pressure.is_empty()
                    && penetration.windows(2).all(|two| two[1] > two[0])
                    && pressure[0] == 0.0
                    && pressure.windows(2).all(|two| two[1] >= two[0]);
                if !good {
                    let message = "the table needs ascending penetrations, and for each a pressure that begins with 0 and does not fall";
                    let help = "for instance penetration = [0, 0.1], pressure = [0, 50]";
                    inner.reader.error(inner.path(), CaseCode::OutOfRange, message, help);
                }
                good.then_some(Pressure::Table { penetration, pressure })
            }
        };
        inner.finish();
        law
    });
    table.finish();
    law.flatten()
}

fn lagrange(table: &Table<'_>) -> Enforcement {
    let factor = positive(table, "complementarity_parameter").optional();
    let stiffness = stiffness(table);
    if factor.is_some() && stiffness.is_some() {
        table.reader.error(
            &table.path_of("complementarity_parameter"),
            CaseCode::ChooseOne,
            "`stiffness` already gives the complementarity parameters, in units",
            "keep one of the two; neither changes the solution",
        );
    }
    let complementarity_parameter = stiffness.is_none().then(|| factor.unwrap_or(DEFAULT_COMPLEMENTARITY));
    Enforcement::Lagrange { complementarity_parameter, stiffness, scaling: penalty_scaling(table) }
}

/// Relative tolerances above this are probably a mistake; for Newton's method they are an error.
const LOOSE_TOLERANCE: f64 = 1e-2;

fn augmented(table: &Table<'_>) -> Enforcement {
    let tolerance = positive(table, "tolerance").or(1e-8);
    let scalings = [("relative", ToleranceScaling::Relative), ("absolute", ToleranceScaling::Absolute)];
    let tolerance_scaling = table.word("tolerance_scaling", &scalings).or(ToleranceScaling::Relative);
    if tolerance > LOOSE_TOLERANCE && tolerance_scaling == ToleranceScaling::Relative {
        table.reader.warning(
            &table.path_of("tolerance"),
            CaseCode::LooseTolerance,
            format!("contact conditions may be violated by {tolerance:?} of the largest traction"),
            format!("1e-8 is the default; above {LOOSE_TOLERANCE} results depend on the iteration"),
        );
    }
    Enforcement::Augmented {
        stiffness: stiffness(table),
        scaling: penalty_scaling(table),
        tolerance,
        tolerance_scaling,
        max_uzawa: table.integer("max_uzawa").count(CaseCode::OutOfRange, 1).or(200),
        acceleration: table.integer("acceleration").count(CaseCode::OutOfRange, 0).or(8),
    }
}

fn penalty_scaling(table: &Table<'_>) -> StiffnessScaling {
    table
        .word(
            "scaling",
            &[
                ("area", StiffnessScaling::Area),
                ("reference_area", StiffnessScaling::ReferenceArea),
                ("weighted", StiffnessScaling::Weighted),
            ],
        )
        .or(StiffnessScaling::Area)
}

fn positive<'t, 'a>(table: &'t Table<'a>, key: &'static str) -> Field<'t, 'a, f64> {
    table.number(key).positive(CaseCode::OutOfRange)
}

/// One number for both directions, or `{ normal = …, tangential = … }`.
fn stiffness(table: &Table<'_>) -> Option<Stiffness> {
    if table.value("stiffness")?.get_ref().is_table() {
        let inner = table.table("stiffness")?;
        let normal = positive(&inner, "normal").required(1.0, "the normal stiffness");
        let tangential = positive(&inner, "tangential").or(normal);
        inner.finish();
        return Some(Stiffness { normal, tangential });
    }
    let both = positive(table, "stiffness").optional()?;
    Some(Stiffness { normal: both, tangential: both })
}
