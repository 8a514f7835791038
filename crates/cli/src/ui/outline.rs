//! What a case consists of, as a tree: the page's list of bodies, contacts, supports and so on.

use serde_json::{Map, Value, json};
use slipstick::case::{CaseCode, Resolved, Severity};

/// Headings, and keys of the case.
const GROUPS: &[(&str, &str)] = &[
    ("Bodies", "body"),
    ("Surfaces", "surface"),
    ("Node sets", "set"),
    ("Symmetry", "symmetry"),
    ("Contacts", "contact"),
    ("Supports and motions", "dirichlet"),
    ("Loads", "load"),
    ("Springs", "spring"),
    ("Points", "point"),
    ("Equations", "equation"),
    ("Couplings", "coupling"),
    ("Bolts", "bolt"),
    ("Temperatures", "temperature"),
    ("Load cases", "load_case"),
    ("Load path", "load_path"),
    ("Design", "design"),
    ("Quantities", "quantity"),
    ("Objective", "objective"),
    ("Constraints", "constraint"),
    ("Optimizer", "optimizer"),
];

/// Keys whose values name a surface or a node set.
const NAMES_OF_SETS: &[&str] = &["slave", "master", "set", "surface"];

/// Settings of methods, which have defaults that suit most cases.
const SETTINGS: &[&str] = &[
    "cell_rule",
    "edge_cover",
    "feature_angle",
    "multiplier_shape",
    "element",
    "order",
    "max_cutbacks",
    "max_newton_iterations",
    "start_values",
    "tolerance",
    "relative",
];

/// Most characters of a description.
const LONGEST: usize = 90;

/// The tree of a case: `[{ title, items: [{ name, text, path, line, marks }] }]`. Lines are those of the file, 0 for
/// what is not in it; marks are surfaces and sets.
pub fn outline(resolved: &Resolved) -> Value {
    let case = serde_json::to_value(&resolved.case).unwrap_or_default();
    let map = &resolved.source_map;
    let line = |path: &str| match resolved.deck.is_some() || map.span(path) == (0..0) {
        // lines of the tables that a deck was translated to are not in the file
        true => 0,
        false => map.diagnostic(Severity::Warning, path, CaseCode::Mesh, "", "").line(),
    };
    let mut groups = Vec::new();
    for (title, key) in GROUPS {
        let entries: Vec<(String, &Value)> = match &case[key] {
            Value::Array(all) => all.iter().enumerate().map(|(k, entry)| (format!("{key}[{k}]"), entry)).collect(),
            Value::Null => Vec::new(),
            entry => vec![((*key).to_owned(), entry)],
        };
        let item = |(path, entry): &(String, &Value)| {
            let marks = marks(entry);
            let text = match *key {
                "objective" => resolved.case.objective_in_words().unwrap_or_default(),
                _ => entry.as_object().map_or(String::new(), |of| description(of, key)),
            };
            json!({ "name": name(entry, &marks), "text": text, "path": path, "line": line(path), "marks": marks })
        };
        let items: Vec<Value> = entries.iter().map(item).collect();
        if !items.is_empty() {
            groups.push(json!({ "title": title, "items": items }));
        }
    }
    groups.into()
}

/// Surfaces and sets that an entry names, at any depth.
pub fn marks(entry: &Value) -> Vec<String> {
    let mut found = Vec::new();
    gather(entry, &mut found);
    found
}

fn gather(entry: &Value, found: &mut Vec<String>) {
    match entry {
        Value::Object(fields) => {
            for name in NAMES_OF_SETS.iter().filter_map(|key| fields.get(*key)?.as_str()) {
                if !found.iter().any(|known| known == name) {
                    found.push(name.to_owned());
                }
            }
            fields.values().for_each(|value| gather(value, found));
        }
        Value::Array(all) => all.iter().for_each(|value| gather(value, found)),
        _ => {}
    }
}

fn name(entry: &Value, marks: &[String]) -> String {
    let of = |key: &str| entry[key].as_str();
    match (of("name"), of("slave"), of("master")) {
        (Some(name), ..) => name.to_owned(),
        (_, Some(slave), Some(master)) => format!("{slave} on {master}"),
        _ => marks.first().cloned().unwrap_or_default(),
    }
}

/// Numbers and words of an entry; of its tables, the keys.
fn description(entry: &Map<String, Value>, group: &str) -> String {
    let mut parts = Vec::new();
    for (key, value) in entry {
        if key == "name" || NAMES_OF_SETS.contains(&key.as_str()) || SETTINGS.contains(&key.as_str()) {
            continue;
        }
        match value {
            Value::Bool(true) => parts.push(key.clone()),
            Value::Number(number) => parts.push(format!("{key} {}", short(number.as_f64().unwrap_or(0.0)))),
            Value::String(word) if !word.is_empty() => parts.push(format!("{key} {word}")),
            Value::Array(all) if !all.is_empty() && all.iter().all(Value::is_string) => {
                parts.push(all.iter().filter_map(Value::as_str).collect::<Vec<_>>().join(" "));
            }
            Value::Object(inner) => match inner.keys().next() {
                Some(first) if inner.len() == 1 && group != "design" => parts.push(first.clone()),
                Some(_) => parts.push(key.clone()),
                None => {}
            },
            _ => {}
        }
    }
    let text = parts.join(", ").replace('_', " ");
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}

fn short(value: f64) -> String {
    slipstick::words::quantity(value)
}
