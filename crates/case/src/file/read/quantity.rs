//! Quantities (`[[quantity]]`), objective (`[objective]`) and constraints (`[[constraint]]`).

use super::super::CaseCode;
use super::super::document::Table;
use super::super::names::Names;
use super::super::reader::suggestion_or_list;
use super::super::resolved::{
    Combination, Constraint, Contact, CurveToFollow, ForceComponent, ForceWord, GapWord, Objective, ObjectiveKind,
    ObservedSteps, OverLoadCases, PressureWord, Quantity, QuantityKind, QuantityTerm, VectorComponent, VectorWord,
};

/// What the tables refer to.
pub(super) struct Known<'a> {
    pub names: &'a Names,
    pub contacts: &'a [Contact],
    pub steps: usize,
}

/// The axes and the norm.
const VECTOR: &[(&str, VectorWord)] =
    &[("x", VectorWord::X), ("y", VectorWord::Y), ("z", VectorWord::Z), ("norm", VectorWord::Norm)];

const FORCE: &[(&str, ForceWord)] = &[
    ("x", ForceWord::X),
    ("y", ForceWord::Y),
    ("z", ForceWord::Z),
    ("norm", ForceWord::Norm),
    ("normal", ForceWord::Normal),
    ("tangential", ForceWord::Tangential),
    ("nodal", ForceWord::Nodal),
];

pub(super) fn quantities(root: &Table<'_>, known: &Known<'_>) -> Vec<Quantity> {
    let mut quantities: Vec<Quantity> = Vec::new();
    for table in root.tables("quantity") {
        let name = super::common::name(&table);
        if quantities.iter().any(|other| other.name == name) && !name.is_empty() {
            let message = format!("two quantities are called `{name}`");
            table.reader.error(&table.path_of("name"), CaseCode::DuplicateName, message, "give each a different name");
        }
        let kind = table.choose("what the quantity measures", QuantityKind::KEYS);
        let kind = kind.and_then(|key| Some((key, table.table(key)?))).and_then(|(key, inner)| {
            let kind = kind_of(key, &inner, known);
            inner.finish();
            kind
        });
        table.finish();
        // after an error, a placeholder with the name, so that no reference to it is an error too
        quantities.push(Quantity { name, kind: kind.unwrap_or(QuantityKind::Compliance {}) });
    }
    quantities
}

fn kind_of(key: &str, table: &Table<'_>, known: &Known<'_>) -> Option<QuantityKind> {
    let set = || {
        let set = table.string("set").required(String::new(), "a surface or node set, for instance \"plate_ymin\"");
        known.names.check_set(table.reader, &table.path_of("set"), &set);
        set
    };
    let optional_set = |key: &'static str| {
        let set = table.string(key).optional()?;
        known.names.check_set(table.reader, &table.path_of(key), &set);
        Some(set)
    };
    let slave = || slave(table, known.contacts);
    let body = || {
        let body = table.string("body").optional()?;
        known.names.check_body(table.reader, &table.path_of("body"), &body);
        Some(body)
    };
    let sharpness = |default: f64| {
        let at_least_one = |&p: &f64| p >= 1.0;
        let sharpness = table.number("sharpness");
        sharpness.check(CaseCode::OutOfRange, at_least_one, "must be at least 1", "8 to 30 are usual").or(default)
    };
    let sharpness_of = |smooth: bool, smooth_measures: &str, default: f64| {
        if !smooth && table.has("sharpness") {
            let message = "`sharpness` has no effect on this measure";
            let help = format!("remove it, or choose the measure {smooth_measures}");
            table.reader.error(&table.path_of("sharpness"), CaseCode::ChooseOne, message, help);
        }
        if smooth { sharpness(default) } else { 0.0 * sharpness(default) }
    };
    Some(match key {
        "reaction" => QuantityKind::Reaction { set: set(), component: vector_component(table) },
        "moment" => QuantityKind::Moment {
            set: set(),
            point: table.vector("point").required([0.0; 3], "a point on the axis"),
            direction: super::common::direction(table, "direction"),
        },
        "contact_force" => QuantityKind::ContactForce {
            slave: slave(),
            component: component(table, FORCE).map_or(ForceComponent::Word(ForceWord::Norm), |chosen| match chosen {
                Chosen::Word(word) => ForceComponent::Word(word),
                Chosen::Direction(direction) => ForceComponent::Direction(direction),
            }),
            within: optional_set("within"),
        },
        "contact_pressure" => {
            let words = [
                ("peak", PressureWord::Peak),
                ("mean", PressureWord::Mean),
                ("spread", PressureWord::Spread),
                ("minimum", PressureWord::Minimum),
            ];
            let measure = table.word("measure", &words);
            let measure = measure.required(PressureWord::Peak, "\"peak\", \"mean\", \"spread\" or \"minimum\"");
            let smooth = matches!(measure, PressureWord::Peak | PressureWord::Minimum);
            QuantityKind::ContactPressure {
                slave: slave(),
                measure,
                sharpness: sharpness_of(smooth, "\"peak\" or \"minimum\"", 12.0),
                within: optional_set("within"),
            }
        }
        "contact_share" => QuantityKind::ContactShare { slave: slave(), within: optional_set("within") },
        "gap" => {
            let measure = table.word("measure", &[("mean", GapWord::Mean), ("minimum", GapWord::Minimum)]);
            let measure = measure.required(GapWord::Minimum, "\"mean\" or \"minimum\"");
            QuantityKind::Gap {
                slave: slave(),
                measure,
                sharpness: sharpness_of(measure == GapWord::Minimum, "\"minimum\"", 50.0),
                within: optional_set("within"),
            }
        }
        "friction_work" => QuantityKind::FrictionWork { slave: slave(), within: optional_set("within") },
        "external_work" => QuantityKind::ExternalWork { set: optional_set("set") },
        "displacement" => QuantityKind::Displacement {
            set: set(),
            component: vector_component(table),
            relative_to: optional_set("relative_to"),
        },
        "strain_energy" => QuantityKind::StrainEnergy { body: body() },
        "stress" => QuantityKind::Stress {
            body: body(),
            within: super::common::boxes(table, "within"),
            sharpness: sharpness(12.0),
        },
        "plastic_strain" => QuantityKind::PlasticStrain {
            body: body(),
            within: super::common::boxes(table, "within"),
            sharpness: sharpness(12.0),
        },
        "compliance" => QuantityKind::Compliance {},
        "volume" => QuantityKind::Volume { body: body() },
        "mass" => {
            let mass_density = table.number("mass_density");
            let positive = |&rho: &f64| rho > 0.0;
            let mass_density =
                mass_density.check(CaseCode::OutOfRange, positive, "must be positive", "such as 1.01e-6 [kg/mm³]");
            QuantityKind::Mass {
                body: body(),
                mass_density: mass_density.required(1.0, "mass per volume of the solid material"),
            }
        }
        _ => return None,
    })
}

/// The slave surface of a pair.
pub(super) fn slave(table: &Table<'_>, contacts: &[Contact]) -> String {
    let slaves: Vec<&str> = contacts.iter().map(|contact| contact.slave.as_str()).collect();
    let slave = table.string("slave").required(String::new(), "the slave surface of a [[contact]]");
    let readable = slaves.iter().all(|slave| !slave.is_empty());
    if !slave.is_empty() && readable && !slaves.contains(&slave.as_str()) {
        let message = format!("`{slave}` is not the slave of a contact pair");
        let help = if slaves.is_empty() {
            "add a [[contact]] with this slave".into()
        } else {
            suggestion_or_list(&slave, &slaves)
        };
        table.reader.error(&table.path_of("slave"), CaseCode::UnknownSet, message, help);
    }
    slave
}

/// A word, or a direction.
enum Chosen<T> {
    Word(T),
    Direction([f64; 3]),
}

fn vector_component(table: &Table<'_>) -> VectorComponent {
    match component(table, VECTOR) {
        Some(Chosen::Direction(direction)) => VectorComponent::Direction(direction),
        Some(Chosen::Word(word)) => VectorComponent::Word(word),
        None => VectorComponent::Word(VectorWord::Norm),
    }
}

/// The required key `component`; `None` after an error.
fn component<T: Copy>(table: &Table<'_>, words: &[(&'static str, T)]) -> Option<Chosen<T>> {
    let names: Vec<&str> = words.iter().map(|(name, _)| *name).collect();
    table.require("component", &format!("one of {}, or a direction [x, y, z]", names.join(", ")));
    let value = table.value("component")?;
    if value.get_ref().as_array().is_some() {
        let direction = super::common::direction(table, "component");
        return Some(Chosen::Direction(direction));
    }
    table.word("component", words).optional().map(Chosen::Word)
}

/// What is minimised, maximised or followed.
pub(super) fn objective(root: &Table<'_>, quantities: &[Quantity], known: &Known<'_>) -> Option<Objective> {
    let table = root.table("objective")?;
    let chosen = table.choose("the objective", &["contact_force", "compliance", "minimise", "maximise", "follow"]);
    let load_cases = over_load_cases(&table);
    let objective = chosen.and_then(|key| Some((key, table.table(key)?))).map(|(key, inner)| {
        let kind = match key {
            "contact_force" => ObjectiveKind::ContactForce { steps: observed_steps(&inner, known.steps) },
            "compliance" => ObjectiveKind::Compliance { steps: observed_steps(&inner, known.steps) },
            "minimise" => ObjectiveKind::Minimise(combination(&inner, quantities, known.steps)),
            "maximise" => ObjectiveKind::Maximise(combination(&inner, quantities, known.steps)),
            _ => ObjectiveKind::Follow(curve(&inner, quantities)),
        };
        inner.finish();
        Objective { kind, load_cases }
    });
    if chosen == Some("compliance") && !root.has("load") && !root.has_misspelt("load") {
        table.reader.error(
            "objective.compliance",
            CaseCode::ChooseOne,
            "the objective is the work of loads, but the case has none",
            "add a [[load]], or use contact_force if displacements are prescribed",
        );
    }
    if chosen == Some("contact_force")
        && known.contacts.is_empty()
        && !root.has("contact")
        && !root.has_misspelt("contact")
    {
        table.reader.error(
            "objective.contact_force",
            CaseCode::NoContact,
            "the objective is a sum of contact forces, but the case has no contact",
            "add a [[contact]] with slave, master and friction",
        );
    }
    table.finish();
    objective
}

/// `"sum"`, `"mean"`, `"worst"` or `{ mean_plus_deviations = k }`.
fn over_load_cases(table: &Table<'_>) -> OverLoadCases {
    const WORDS: &[(&str, OverLoadCases)] =
        &[("sum", OverLoadCases::Sum), ("mean", OverLoadCases::Mean), ("worst", OverLoadCases::Worst)];
    let given = table.value("load_cases");
    if given.is_none_or(|value| value.get_ref().as_table().is_none()) {
        return table.word("load_cases", WORDS).or(OverLoadCases::Sum);
    }
    let Some(inner) = table.table("load_cases") else { return OverLoadCases::Sum };
    let positive = inner.number("mean_plus_deviations").positive(CaseCode::OutOfRange);
    let factor = positive.required(1.0, "the number of standard deviations, for instance 2.0");
    inner.finish();
    OverLoadCases::MeanPlusDeviations(factor)
}

fn combination(table: &Table<'_>, quantities: &[Quantity], steps: usize) -> Combination {
    let sum = match table.choose("the quantity", &["quantity", "sum"]) {
        Some("sum") => {
            let terms = table.tables("sum").into_iter().map(|term| {
                let quantity = reference(&term, quantities);
                let not_zero = |&weight: &f64| weight != 0.0;
                let weight = term.number("weight");
                let weight = weight.check(CaseCode::OutOfRange, not_zero, "must not be 0", "omit the quantity").or(1.0);
                term.finish();
                QuantityTerm { quantity, weight }
            });
            let terms: Vec<QuantityTerm> = terms.collect();
            if terms.is_empty() {
                let help = "for instance sum = [{ quantity = \"force\", weight = 1.0 }]";
                table.reader.error(&table.path_of("sum"), CaseCode::Empty, "the sum has no term", help);
            }
            terms
        }
        Some(_) => vec![QuantityTerm { quantity: reference(table, quantities), weight: 1.0 }],
        None => Vec::new(),
    };
    let steps = observed_steps(table, steps);
    let worst = table.boolean("worst").or(false);
    Combination { sum, steps, worst }
}

fn curve(table: &Table<'_>, quantities: &[Quantity]) -> CurveToFollow {
    let quantity = reference(table, quantities);
    let reader = table.reader;
    let point = |value: &_, path: String| -> Option<[f64; 2]> {
        let value: &toml::Spanned<toml::de::DeValue<'_>> = value;
        match value.get_ref().as_array() {
            Some(pair) if pair.len() == 2 => Some([
                reader.number(&pair[0], &format!("`{path}[0]`"))?,
                reader.number(&pair[1], &format!("`{path}[1]`"))?,
            ]),
            _ => {
                reader.wrong_type(value, &format!("`{path}`"), "a point [t, value]");
                None
            }
        }
    };
    let points = table.list("points", point).required(Vec::new(), "points [[t, value], …] with 0 < t ≤ 1");
    let mut before = 0.0;
    for (i, [t, _]) in points.iter().enumerate() {
        if !(*t > before && *t <= 1.0) {
            let message = format!("pseudo-time {t} is not above {before}, or beyond 1");
            let path = format!("{}[{i}]", table.path_of("points"));
            reader.error(&path, CaseCode::OutOfRange, message, "list the points in the order of their times in (0, 1]");
            break;
        }
        before = *t;
    }
    if !points.is_empty() && points.iter().all(|point| point[1] == 0.0) {
        let help = "the distance is relative to the largest value; for a quantity that should vanish, minimise it";
        reader.error(&table.path_of("points"), CaseCode::Empty, "all values of the curve are 0", help);
    }
    CurveToFollow { quantity, points }
}

pub(super) fn constraints(root: &Table<'_>, quantities: &[Quantity], steps: usize) -> Vec<Constraint> {
    let mut constraints: Vec<Constraint> = Vec::new();
    for table in root.tables("constraint") {
        let quantity = reference(&table, quantities);
        let steps = observed_steps(&table, steps);
        table.require_one_of(&["max", "min"], "the constraint has no bound");
        let max = table.number("max").optional();
        let min = table.number("min").optional();
        if let (Some(max), Some(min)) = (max, min)
            && min > max
        {
            let message = format!("no value is at least {min} and at most {max}");
            table.reader.error(&table.path_of("min"), CaseCode::OutOfRange, message, "swap `min` and `max`");
        }
        let corrected = table.boolean("corrected").or(true);
        table.finish();
        constraints.push(Constraint { quantity, steps, max, min, corrected });
    }
    constraints
}

/// The name of a quantity, in `quantity`.
fn reference(table: &Table<'_>, quantities: &[Quantity]) -> String {
    let name = table.string("quantity").required(String::new(), "the name of a [[quantity]]");
    let names: Vec<&str> = quantities.iter().map(|quantity| quantity.name.as_str()).collect();
    // a name that is missing may be one that cannot be read, or was used twice
    let unsure = |(i, known): (usize, &&str)| known.is_empty() || names[..i].contains(known);
    let readable = !names.iter().enumerate().any(unsure);
    if !name.is_empty() && readable && !names.contains(&name.as_str()) {
        let help = if names.is_empty() {
            "add a [[quantity]] with this name".into()
        } else {
            suggestion_or_list(&name, &names)
        };
        let message = format!("there is no quantity called `{name}`");
        table.reader.error(&table.path_of("quantity"), CaseCode::UnknownSet, message, help);
    }
    name
}

/// `"last"`, `"all"` or a list of steps.
fn observed_steps(table: &Table<'_>, steps: usize) -> ObservedSteps {
    let Some(value) = table.value("steps") else {
        return ObservedSteps::Last;
    };
    let reader = table.reader;
    match value.get_ref().as_str() {
        Some("last") => return ObservedSteps::Last,
        Some("all") => return ObservedSteps::All,
        Some(word) => {
            let help = suggestion_or_list(word, &["last", "all"]);
            let message = format!("`steps` cannot be `{word}`");
            reader.error_at(value.span(), CaseCode::UnknownWord, message, help);
            return ObservedSteps::Last;
        }
        None => {}
    }
    let one = |value, path: String| {
        let step = reader.integer(value, "a load step")?;
        if step < 1 || step > steps as i64 {
            let message = format!("there is no load step {step}");
            let help = format!("load steps are numbered 1 to {steps}");
            reader.error(&path, CaseCode::Steps, message, help);
            return None;
        }
        Some(step as usize)
    };
    let increasing = |list: &Vec<usize>| list.windows(2).all(|pair| pair[0] < pair[1]);
    let list = table
        .list("steps", one)
        .check(CaseCode::Empty, |list| !list.is_empty(), "lists no load step", "")
        .check(CaseCode::Steps, increasing, "must increase", "list each load step once, in order")
        .or(Vec::new());
    ObservedSteps::Only(list)
}
