//! The JSON schema of case files, for completion and checks in editors.

use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};

use super::Case;

/// Keys without a default, by the definition that they belong to. Variants of an enum are identified by their key.
const REQUIRED: &[(&str, &[&str])] = &[
    ("Case", &["body", "load_path"]),
    ("Body", &["name", "material"]),
    ("box", &["min", "max", "elements"]),
    ("half_ball", &["radius", "elements"]),
    ("hollow_cylinder", &["inner_radius", "outer_radius", "height", "elements"]),
    ("half_ring", &["inner_radius", "outer_radius", "width", "elements"]),
    ("MeshFile", &["file"]),
    ("ElasticConstants", &["youngs_modulus", "poisson_ratio"]),
    ("Rotate", &["axis", "degrees"]),
    ("BoxRegion", &["min", "max"]),
    ("SurfaceSet", &["name", "body"]),
    ("NormalCone", &["direction"]),
    ("NodeSet", &["name"]),
    ("Plane", &["point", "normal"]),
    ("Cylinder", &["start", "end", "radius"]),
    ("Contact", &["slave", "master", "friction"]),
    ("Stiffness", &["normal"]),
    ("Dirichlet", &["set"]),
    ("Waypoint", &["t"]),
    ("RotationAxis", &["point", "direction"]),
    ("LoadPath", &["steps"]),
    ("Design", &["bodies"]),
    ("SensitivityFilter", &["radius"]),
    ("Optimizer", &["iterations"]),
];

/// Keys of which a table must have at least one.
const CONDITIONS: &[(&str, &[&str])] = &[
    ("SurfaceSet", &["boxes", "normal", "within"]),
    ("NodeSet", &["boxes", "plane", "cylinder", "nearest"]),
    ("Design", &["initial", "volume_fraction"]),
];

/// The JSON schema (draft 2020-12) of case files, generated from the types of [`Case`](super::Case). It covers keys,
/// types and allowed words; [`parse_case`](super::parse_case) checks everything else.
pub fn schema() -> Value {
    let generator = SchemaSettings::draft2020_12().into_generator();
    let mut schema = generator.into_root_schema_for::<Case>().to_value();
    let root = json!({ "title": "slipstick case file" });
    if let (Value::Object(schema), Value::Object(root)) = (&mut schema, root) {
        schema.extend(root);
        one_line(schema);
    }
    close("Case", &mut schema);
    if let Some(definitions) = schema.pointer_mut("/$defs").and_then(Value::as_object_mut) {
        for (name, definition) in definitions.iter_mut() {
            close(name, definition);
        }
        if let Some(body) = definitions.get_mut("Body") {
            one_shape(body);
        }
        // One number serves both directions.
        if let Some(stiffness) = definitions.get_mut("Stiffness") {
            let table = stiffness.take();
            *stiffness = json!({ "anyOf": [{ "type": "number" }, table] });
        }
    }
    schema
}

/// Restricts tables to their known keys; only those without a default are required.
fn close(name: &str, schema: &mut Value) {
    let Value::Object(object) = schema else { return };
    one_line(object);
    for list in ["oneOf", "anyOf"] {
        for variant in object.get_mut(list).and_then(Value::as_array_mut).into_iter().flatten() {
            close("", variant);
        }
    }
    // A variant is a table with exactly one key, which is required.
    let variant = name.is_empty();
    let Some(Value::Object(properties)) = object.get_mut("properties") else { return };
    for (key, property) in properties.iter_mut() {
        match property {
            Value::Object(inner) if inner.contains_key("properties") => close(key, property),
            Value::Object(inner) => one_line(inner),
            _ => {}
        }
    }
    object.insert("additionalProperties".into(), false.into());
    if !variant {
        let required = REQUIRED.iter().find(|(of, _)| *of == name).map_or(&[][..], |(_, keys)| keys);
        if required.is_empty() {
            object.remove("required");
        } else {
            object.insert("required".into(), json!(required));
        }
        if let Some((_, keys)) = CONDITIONS.iter().find(|(of, _)| *of == name) {
            let one = keys.iter().map(|key| json!({ "required": [key] })).collect::<Vec<_>>();
            object.insert("anyOf".into(), one.into());
        }
    }
}

/// Descriptions as plain text: without rustdoc markup and line breaks.
fn one_line(object: &mut Map<String, Value>) {
    if let Some(Value::String(text)) = object.get_mut("description") {
        *text = text.split_whitespace().collect::<Vec<_>>().join(" ").replace("\\[", "[").replace("\\]", "]");
    }
}

/// The shapes of a body as keys next to its other keys; exactly one of them must be present.
fn one_shape(body: &mut Value) {
    let Some(Value::Array(shapes)) = body.as_object_mut().and_then(|body| body.remove("oneOf")) else { return };
    let mut keys = Vec::new();
    for mut shape in shapes {
        let about = shape.get("description").cloned();
        let Some(Value::Object(properties)) = shape.get_mut("properties").map(Value::take) else { continue };
        for (key, mut property) in properties {
            if let (Some(about), Value::Object(property)) = (&about, &mut property) {
                property.entry("description").or_insert(about.clone());
            }
            keys.push(json!({ "required": [key] }));
            body["properties"][&key] = property;
        }
    }
    body["oneOf"] = keys.into();
}
