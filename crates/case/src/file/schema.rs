//! The JSON schema of case files, for completion and checks in editors.

use std::collections::BTreeMap;

use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};

use super::Case;
use super::parse::requirements;
use super::reader::Requirement;

/// The JSON schema (draft 2020-12) of case files, generated from the types of
/// [`Case`](super::Case). It covers keys, types, allowed words and keys that the reader requires;
/// [`parse_case`](super::parse_case) checks everything else.
pub fn schema() -> Value {
    let generator = SchemaSettings::draft2020_12().into_generator();
    let mut schema = generator.into_root_schema_for::<Case>().to_value();
    let root = json!({ "title": "slipstick case file" });
    if let (Value::Object(schema), Value::Object(root)) = (&mut schema, root) {
        schema.extend(root);
        one_line(schema);
    }
    close(&mut schema);
    schema["properties"]["deck"] = json!({
        "description": "A deck of Abaqus or CalculiX from which the case takes further tables.",
        "type": "object",
        "properties": {
            "file": { "description": "Path of the deck, relative to the case file.", "type": "string" },
            "ignore": {
                "description": "Keywords of the deck that are left out although they may change the physics.",
                "type": "array",
                "items": { "type": "string" },
            },
        },
        "required": ["file"],
        "additionalProperties": false,
    });
    if let Some(definitions) = schema.pointer_mut("/$defs").and_then(Value::as_object_mut) {
        definitions.values_mut().for_each(close);
        for of_one_kind in ["Body", "Load", "Objective", "Quantity", "Spring"] {
            definitions.get_mut(of_one_kind).into_iter().for_each(one_kind);
        }
    }
    let mut tables = BTreeMap::new();
    find_tables(&schema, "", &mut Vec::new(), &mut tables);
    for (pointer, path) in &tables {
        require(schema.pointer_mut(pointer), path);
    }
    // A deck has bodies and load steps.
    let required = schema.as_object_mut().and_then(|root| root.remove("required")).unwrap_or_default();
    schema["anyOf"] = json!([{ "required": required }, { "required": ["deck"] }]);
    if let Some(definitions) = schema.pointer_mut("/$defs").and_then(Value::as_object_mut) {
        // Rigid bodies have no material, tied surfaces no friction.
        for (table, key, instead) in [("Body", "material", "rigid"), ("Contact", "friction", "tied")] {
            definitions.get_mut(table).into_iter().for_each(|table| either(table, key, instead));
        }
        // Loads on mass have no surface.
        if let Some(load) = definitions.get_mut("Load") {
            either(load, "surface", "gravity");
            load["anyOf"].as_array_mut().into_iter().for_each(|ways| ways.push(json!({ "required": ["centrifugal"] })));
        }
        // A union of surfaces has neither body nor conditions.
        if let Some(surface) = definitions.get_mut("SurfaceSet").and_then(Value::as_object_mut) {
            let of_body = surface.remove("anyOf").unwrap_or_default();
            let keys = of_body.as_array().into_iter().flatten().map(|one| &one["required"][0]);
            let mut ways: Vec<Value> = keys.map(|key| json!({ "required": ["body", key] })).collect();
            ways.push(json!({ "required": ["of"] }));
            surface.insert("anyOf".into(), ways.into());
            let required = surface.get_mut("required").and_then(Value::as_array_mut);
            required.into_iter().for_each(|required| required.retain(|key| key != "body"));
        }
        // A single quantity is a sum of one term.
        if let Some(combination) = definitions.get_mut("Combination") {
            let about = "Name of the quantity, instead of `sum`.";
            combination["properties"]["quantity"] = json!({ "type": "string", "description": about });
            either(combination, "sum", "quantity");
        }
        // A single number applies to both directions.
        if let Some(stiffness) = definitions.get_mut("Stiffness") {
            let table = stiffness.take();
            *stiffness = json!({ "anyOf": [{ "type": "number" }, table] });
        }
        // A single number is an offset throughout.
        if let Some(offset) = definitions.get_mut("Contact").and_then(|pair| pair.pointer_mut("/properties/offset")) {
            let description = offset.get("description").cloned();
            let waypoints = offset.take();
            *offset = json!({ "anyOf": [{ "type": "number" }, waypoints], "description": description });
        }
    }
    schema
}

/// Restricts tables to their known keys and leaves it to [`require`] which of them are required.
/// Only a variant of an enum requires its key: it is a table with exactly one.
fn close(schema: &mut Value) {
    let Value::Object(object) = schema else { return };
    one_line(object);
    for list in ["oneOf", "anyOf"] {
        for variant in object.get_mut(list).and_then(Value::as_array_mut).into_iter().flatten() {
            let key = variant.get("required").cloned();
            close(variant);
            if let (Some(key), Value::Object(variant)) = (key, variant) {
                variant.insert("required".into(), key);
            }
        }
    }
    let Some(Value::Object(properties)) = object.get_mut("properties") else { return };
    for property in properties.values_mut() {
        match property {
            Value::Object(inner) if inner.contains_key("properties") => close(property),
            Value::Object(inner) => one_line(inner),
            _ => {}
        }
        // the reader defines the defaults, not the type
        if let Value::Object(property) = property {
            property.remove("default");
        }
    }
    object.insert("additionalProperties".into(), false.into());
    object.remove("required");
}

/// One step from a table of a case file to a table within it: the key, and whether it is a list
/// `[[key]]`.
type Step = (String, bool);

/// Finds the tables that a schema describes: the place of each in the schema, and one path to it in
/// a case file.
fn find_tables(root: &Value, pointer: &str, path: &mut Vec<Step>, found: &mut BTreeMap<String, Vec<Step>>) {
    let Some(Value::Object(schema)) = root.pointer(pointer) else { return };
    if let Some(name) = schema.get("$ref").and_then(Value::as_str) {
        find_tables(root, name.trim_start_matches('#'), path, found);
    }
    for list in ["oneOf", "anyOf"] {
        for i in 0..schema.get(list).and_then(Value::as_array).map_or(0, Vec::len) {
            find_tables(root, &format!("{pointer}/{list}/{i}"), path, found);
        }
    }
    let Some(properties) = schema.get("properties").and_then(Value::as_object) else { return };
    if found.contains_key(pointer) {
        return;
    }
    found.insert(pointer.to_owned(), path.clone());
    for (key, property) in properties {
        let list = property.get("items").is_some();
        path.push((key.clone(), list));
        let inner = format!("{pointer}/properties/{key}");
        find_tables(root, &if list { inner + "/items" } else { inner }, path, found);
        path.pop();
    }
}

/// Adds the keys that the reader requires in the table at `path`. To find them, it reads a case
/// file that contains only this table, empty.
fn require(table: Option<&mut Value>, path: &[Step]) {
    let Some(Value::Object(table)) = table else { return };
    let mut text = String::new();
    for (key, list) in path.iter().rev() {
        text = if *list { format!("{key} = [{{ {text} }}]") } else { format!("{key} = {{ {text} }}") };
    }
    let place = path.iter().map(|(key, list)| if *list { format!("{key}[0]") } else { key.clone() });
    let place = place.collect::<Vec<_>>().join(".");
    for Requirement { keys, .. } in requirements(&text).into_iter().filter(|r| r.path == place) {
        if let [key] = keys[..] {
            let required = table.entry("required").or_insert_with(|| json!([]));
            if let Some(required) = required.as_array_mut()
                && !required.contains(&key.into())
            {
                required.push(key.into());
            }
        } else {
            let one = keys.iter().map(|key| json!({ "required": [key] })).collect::<Vec<_>>();
            let former = table.insert("anyOf".into(), one.into());
            debug_assert!(former.is_none(), "two conditions on {place}");
        }
    }
}

/// Requires one of two keys where the first was required.
fn either(table: &mut Value, key: &str, instead: &str) {
    if let Some(required) = table.get_mut("required").and_then(Value::as_array_mut) {
        required.retain(|required| required != key);
    }
    table["anyOf"] = json!([{ "required": [key] }, { "required": [instead] }]);
}

/// Descriptions as plain text: the first paragraph, without rustdoc markup, line breaks and Rust's `None`.
fn one_line(object: &mut Map<String, Value>) {
    if let Some(Value::String(text)) = object.get_mut("description") {
        let first = text.split("\n\n").next().unwrap_or_default();
        let line = first.split_whitespace().collect::<Vec<_>>().join(" ");
        let plain = line.replace("[`", "`").replace("`]", "`").replace("\\[", "[").replace("\\]", "]");
        *text = plain.replace("`None`:", "without it:");
    }
}

/// The kinds of a table, such as the shapes of a body, as keys next to its other keys; exactly one of
/// them must be present.
fn one_kind(table: &mut Value) {
    let Some(Value::Array(kinds)) = table.as_object_mut().and_then(|table| table.remove("oneOf")) else { return };
    let mut keys = Vec::new();
    for mut kind in kinds {
        let about = kind.get("description").cloned();
        let Some(Value::Object(properties)) = kind.get_mut("properties").map(Value::take) else { continue };
        for (key, mut property) in properties {
            if let (Some(about), Value::Object(property)) = (&about, &mut property) {
                property.entry("description").or_insert(about.clone());
            }
            keys.push(json!({ "required": [key] }));
            table["properties"][&key] = property;
        }
    }
    table["oneOf"] = keys.into();
}
