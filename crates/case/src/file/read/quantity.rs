//! Quantities (`[[quantity]]`), objective (`[objective]`) and constraints (`[[constraint]]`).

use super::super::CaseCode;
use super::super::document::Table;
use super::super::reader::suggestion_or_list;
use super::super::resolved::{
    Combination, Constraint, CurveToFollow, Objective, ObjectiveKind, ObservedSteps, OverLoadCases, Quantity,
    QuantityKind, QuantityTerm,
};
use crate::quantity::{Known, Reading};

pub(super) fn quantities(root: &Table<'_>, known: &Known<'_>) -> Vec<Quantity> {
    let mut quantities: Vec<Quantity> = Vec::new();
    for table in root.tables("quantity") {
        let name = super::common::name(&table);
        if quantities.iter().any(|other| other.name == name) && !name.is_empty() {
            let message = format!("two quantities are called `{name}`");
            table.reader.error(&table.path_of("name"), CaseCode::DuplicateName, message, "give each a different name");
        }
        let label = table.string("label").optional().filter(|label| !label.is_empty());
        let kind = table.choose("what the quantity measures", QuantityKind::KEYS);
        let kind = kind.and_then(|key| Some((key, table.table(key)?))).and_then(|(key, inner)| {
            let kind = QuantityKind::read(key, &Reading { table: &inner, known });
            inner.finish();
            kind
        });
        table.finish();
        // after an error, a placeholder with the name, so that no reference to it is an error too
        quantities.push(Quantity { name, label, kind: kind.unwrap_or(QuantityKind::PLACEHOLDER) });
    }
    quantities
}

/// What is minimized, maximized or followed.
pub(super) fn objective(
    root: &Table<'_>,
    quantities: &[Quantity],
    known: &Known<'_>,
    steps: usize,
) -> Option<Objective> {
    let table = root.table("objective")?;
    let chosen = table.choose("the objective", &["contact_force", "compliance", "minimise", "maximise", "follow"]);
    let load_cases = over_load_cases(&table);
    let objective = chosen.and_then(|key| Some((key, table.table(key)?))).map(|(key, inner)| {
        let kind = match key {
            "contact_force" => ObjectiveKind::ContactForce { steps: observed_steps(&inner, steps) },
            "compliance" => ObjectiveKind::Compliance { steps: observed_steps(&inner, steps) },
            "minimise" => ObjectiveKind::Minimise(combination(&inner, quantities, steps)),
            "maximise" => ObjectiveKind::Maximise(combination(&inner, quantities, steps)),
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
        && known.slaves.is_empty()
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
pub(super) fn observed_steps(table: &Table<'_>, steps: usize) -> ObservedSteps {
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
