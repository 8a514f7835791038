//! The JSON schema of case files: its types and words are checked against the reader; its required
//! keys come from the reader, and some are checked against the documentation.

use serde_json::{Value, json};
use slipstick_case::file::{CaseCode, TEMPLATES, parse_case, schema};

/// `docs/case.schema.json` matches the current types.
#[test]
fn the_schema_in_the_documentation_is_fresh() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/case.schema.json");
    let committed = std::fs::read_to_string(path).expect("docs/case.schema.json");
    assert!(
        committed == format!("{:#}\n", schema()),
        "docs/case.schema.json is stale: cargo run --release -- schema --force --out docs/case.schema.json"
    );
}

/// Whether a schema accepts a value, to the extent needed for the schema of case files (JSON Schema
/// 2020-12).
pub fn accepts(root: &Value, schema: &Value, value: &Value) -> bool {
    let all = |list: &str, test: &dyn Fn(&Value) -> bool| schema[list].as_array().is_none_or(|l| l.iter().all(test));
    let count = |list: &str| schema[list].as_array().map(|l| l.iter().filter(|s| accepts(root, s, value)).count());
    let is = |name: &Value| match name.as_str() {
        Some("object") => value.is_object(),
        Some("array") => value.is_array(),
        Some("string") => value.is_string(),
        Some("number") => value.is_number(),
        Some("integer") => value.is_i64() || value.is_u64(),
        Some("boolean") => value.is_boolean(),
        Some("null") => value.is_null(),
        other => panic!("type {other:?}"),
    };
    let typed = match &schema["type"] {
        Value::Null => true,
        Value::Array(names) => names.iter().any(is),
        name => is(name),
    };
    let reference = schema["$ref"].as_str().is_none_or(|name| {
        let target = root.pointer(name.trim_start_matches('#')).unwrap_or_else(|| panic!("{name}"));
        accepts(root, target, value)
    });
    let keys = value.as_object().is_none_or(|object| {
        let known = schema["properties"].as_object();
        let closed = schema["additionalProperties"] == false;
        object.iter().all(|(key, inner)| match known.and_then(|known| known.get(key)) {
            Some(property) => accepts(root, property, inner),
            None => !closed,
        })
    });
    let long = |limit: &str, fits: &dyn Fn(usize, usize) -> bool| {
        let (limit, length) = (schema[limit].as_u64(), value.as_array().map(Vec::len));
        limit.zip(length).is_none_or(|(limit, length)| fits(length, limit as usize))
    };
    let items = value
        .as_array()
        .is_none_or(|list| schema["items"].is_null() || list.iter().all(|item| accepts(root, &schema["items"], item)));
    typed
        && reference
        && keys
        && items
        && long("minItems", &|n, least| n >= least)
        && long("maxItems", &|n, most| n <= most)
        && all("required", &|key| value.as_object().is_none_or(|o| o.contains_key(key.as_str().unwrap_or_default())))
        && count("oneOf").is_none_or(|fitting| fitting == 1)
        && count("anyOf").is_none_or(|fitting| fitting > 0)
        && schema["enum"].as_array().is_none_or(|words| words.contains(value))
        && (schema["const"].is_null() || schema["const"] == *value)
}

/// Paths of all keys in all tables of a case.
fn keys(value: &Value, path: String, found: &mut Vec<String>) {
    match value {
        Value::Object(object) => {
            for (key, inner) in object {
                let path = format!("{path}/{key}");
                found.push(path.clone());
                keys(inner, path, found);
            }
        }
        Value::Array(list) => list.iter().enumerate().for_each(|(i, inner)| keys(inner, format!("{path}/{i}"), found)),
        _ => {}
    }
}

/// Whether the reader misses or does not know a key.
fn misread(case: &Value) -> bool {
    let text = toml::to_string(case).expect("TOML");
    let codes = [CaseCode::MissingKey, CaseCode::ChooseOne, CaseCode::UnknownKey, CaseCode::WrongType];
    parse_case(&text, "case.toml").is_err_and(|e| e.diagnostics().iter().any(|d| codes.contains(&d.code())))
}

/// Keys of a design that no template has.
const SHAPED: &str = "density_filter = { radius = 0.5 }
overhang = { direction = '-z' }
symmetry = [
    { normal = 'x', at = 2 },
    { normal = [1, 0, 0], through = [2, 0, 0] },
    { axis = 'y', through = [2, 0, 0.5], folds = 2 },
    { axis = [0, 1, 0], through = [2, 0, 0.5], folds = 2, body = 'cuboid' },
]
extrude = 'z'
pattern = [{ step = [2, 0, 0], count = 2, body = 'cuboid' }]
passive_solid = [
    { min = [0, 0, 0], max = [1, 1, 1] },
    { start = [0, 0, 0], end = [1, 1, 1], radius = 0.5 },
    { axis = 'x', through = [0, 0, 0], radius = 0.5 },
    { centre = [0, 0, 0], radius = 0.5 },
]
passive_void = [
    { surface = 'cuboid_ymax', within = 0.1 },
    { set = 'cuboid_ymax', within = 0.1 },
    { body = 'cube' },
]
[optimizer]
iterations = 9
schedule = { filter_radius = [[0, 1.0]], volume_fraction = [[3, 0.5]] }
";

/// Templates and a case with the keys of [`SHAPED`], with and without their defaults, each with one
/// key omitted, misspelt, or of a different type: schema and reader agree.
#[test]
fn schema_and_reader_agree() {
    struct Text<'a> {
        name: &'a str,
        text: &'a str,
    }
    let schema = schema();
    let mut tried = 0;
    let template = |name: &str| TEMPLATES.iter().find(|template| template.name == name).expect("a template").text;
    let shaped = template("cube-on-cuboid").replace("initial = 0.5\n", &format!("volume_fraction = 0.5\n{SHAPED}"));
    let shaped = shaped.replace("simp = { p = 3.0, min = 0.0 }\n", "");
    let templates = TEMPLATES.iter().map(|template| Text { name: template.name, text: template.text });
    for template in templates.chain([Text { name: "shaped", text: &shaped }]) {
        let typed: toml::Table = template.text.parse().expect("TOML");
        let resolved = parse_case(template.text, template.name).unwrap_or_else(|e| panic!("{e}")).case;
        for case in [serde_json::to_value(typed), serde_json::to_value(resolved)] {
            let case = case.expect("JSON");
            assert!(accepts(&schema, &schema, &case) && !misread(&case), "{}", template.name);
            let mut paths = Vec::new();
            keys(&case, String::new(), &mut paths);
            for path in paths {
                let (table, key) = path.rsplit_once('/').expect("a key");
                let changed = |change: &dyn Fn(&mut serde_json::Map<String, Value>)| {
                    let mut changed = case.clone();
                    change(changed.pointer_mut(table).and_then(Value::as_object_mut).expect("a table"));
                    (accepts(&schema, &schema, &changed), misread(&changed))
                };
                let without = changed(&|table| drop(table.remove(key)));
                // An [optimizer] requires the volume fraction, unless constraints bound something else: a
                // condition that the schema leaves to the reader.
                let bounded = case["constraint"].as_array().is_some_and(|all| !all.is_empty());
                if path == "/design/volume_fraction" && !bounded {
                    assert!(without.1, "{}: without {path}", template.name);
                } else {
                    assert_ne!(without.0, without.1, "{}: without {path}", template.name);
                }
                let misspelt = changed(&|table| {
                    let value = table.remove(key).expect("there");
                    table.insert(format!("{key}x"), value);
                });
                assert_eq!(misspelt, (false, true), "{}: {path}x", template.name);
                let other =
                    if case.pointer(&path).is_some_and(Value::is_boolean) { "true".into() } else { Value::Bool(true) };
                let retyped = changed(&|table| drop(table.insert(key.into(), other.clone())));
                assert_eq!(retyped, (false, true), "{}: {path} = {other}", template.name);
                tried += 3;
            }
        }
    }
    assert!(tried > 500, "{tried}");
}

/// Required keys as `docs/case_file.md` states them.
#[test]
fn required_keys() {
    let schema = schema();
    let required = |pointer: &str| schema.pointer(pointer).and_then(|table| table["required"].as_array()).cloned();
    for (table, keys) in [
        ("/anyOf/0", &["body", "load_path"][..]),
        ("/anyOf/1", &["deck"]),
        ("/$defs/Body", &["name"]),
        ("/$defs/Contact", &["slave", "master"]),
        ("/$defs/SurfaceSet", &["name"]),
        ("/$defs/Symmetry", &["normal"]),
        ("/$defs/LoadCase", &["name"]),
        ("/$defs/AmplitudePoint", &["t", "factor"]),
        ("/$defs/Temperature", &["change"]),
        ("/$defs/Optimizer", &["iterations"]),
    ] {
        let mut found = required(table).unwrap_or_else(|| panic!("{table} requires nothing"));
        found.sort_by_key(|key| keys.iter().position(|known| key == known));
        assert_eq!(found, keys, "{table}");
    }
    for (table, key, instead) in
        [("Body", "material", "rigid"), ("Contact", "friction", "tied"), ("Combination", "sum", "quantity")]
    {
        let either = json!([{ "required": [key] }, { "required": [instead] }]);
        assert_eq!(schema["$defs"][table]["anyOf"], either, "{table}");
    }
    // loads on mass have no surface
    let load = ["surface", "gravity", "centrifugal"].map(|key| json!({ "required": [key] }));
    assert_eq!(schema["$defs"]["Load"]["anyOf"], json!(load));
    assert!(!schema.to_string().contains("\"default\":"), "the defaults of a case are those of its reader");
}
