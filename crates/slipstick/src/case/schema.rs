//! The JSON schema of case files, for completion and hints in editors.

use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};

use super::Case;

/// Keys that have no default, by the definition that they belong to. Variants of an enum are told by their key.
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

/// Keys of which a table needs at least one.
const CONDITIONS: &[(&str, &[&str])] = &[
    ("SurfaceSet", &["boxes", "normal", "within"]),
    ("NodeSet", &["boxes", "plane", "cylinder", "nearest"]),
    ("Design", &["initial", "volume_fraction"]),
];

/// The JSON schema (draft 2020-12) of case files, made from the types that a case file becomes. It knows keys, types and
/// words; what else must hold is told by [`parse_case`](super::parse_case).
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

/// Makes tables take the keys that they have and no others, of which only those without default are required.
fn close(name: &str, schema: &mut Value) {
    let Value::Object(object) = schema else { return };
    one_line(object);
    for list in ["oneOf", "anyOf"] {
        for variant in object.get_mut(list).and_then(Value::as_array_mut).into_iter().flatten() {
            close("", variant);
        }
    }
    // A variant is a table of one key, which must be there.
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

/// Descriptions as plain text: without the marks of documentation and its line breaks.
fn one_line(object: &mut Map<String, Value>) {
    if let Some(Value::String(text)) = object.get_mut("description") {
        *text = text.split_whitespace().collect::<Vec<_>>().join(" ").replace("\\[", "[").replace("\\]", "]");
    }
}

/// The shapes of a body as keys beside its others, of which exactly one is there.
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
