//! A resolved case, written as TOML, is a case file with the same meaning: for the cases of the
//! repository and for cases that together have every key.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde_json::Value;
use slipstick_case::file::{Resolved, TEMPLATES, parse_case, parse_case_with, schema};

use crate::schema::accepts;

/// Writes the resolved case, reads it again, and returns its text; both texts are identical.
fn written(resolved: &Resolved, again: impl Fn(&str) -> Resolved, name: &str) -> String {
    let text = toml::to_string_pretty(&resolved.case).unwrap_or_else(|error| panic!("{name}: {error}"));
    let second = again(&text);
    assert!(second.case == resolved.case, "{name} is another case after a round trip\n{text}");
    assert_eq!(toml::to_string_pretty(&second.case).expect("writable"), text, "{name}");
    text
}

/// All TOML files in a folder and below.
fn toml_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            toml_files(&path, found);
        } else if path.extension().is_some_and(|end| end == "toml") {
            found.push(path);
        }
    }
}

#[test]
fn cases_of_the_repository_are_the_same_after_a_round_trip() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut files = Vec::new();
    for folder in ["cases", "docs", "fuzz/corpus", "crates/case/src/file/templates"] {
        toml_files(&root.join(folder), &mut files);
    }
    files.sort_unstable();
    let mut cases = 0;
    for file in files {
        let text = std::fs::read_to_string(&file).unwrap_or_default();
        let beside = |name: &str| std::fs::read(file.with_file_name(name));
        let read = |text: &str| parse_case_with(text, "case.toml", &beside);
        // studies, and inputs of the reader's tests that are wrong
        let Ok(resolved) = read(&text) else { continue };
        let name = file.display().to_string();
        written(&resolved, |text| read(text).unwrap_or_else(|errors| panic!("{name}: {errors}\n{text}")), &name);
        cases += 1;
    }
    assert!(cases >= 35, "{cases}");
}

/// Keys that no case here has: of cases with mesh files, which the other test reads, and of cases with decks.
const OF_FILES: [&str; 10] = [
    ".deck",
    ".deck.file",
    ".deck.ignore",
    "Body.mesh",
    "MeshFile.file",
    "MeshFile.first_order",
    "MeshFile.part",
    "MeshFile.scale",
    "MeshFile.sha256",
    "Region.part",
];

/// The cases in `tests/data/keys` together have every key of the schema.
#[test]
fn every_key_is_the_same_after_a_round_trip() {
    let schema = schema();
    let mut seen: BTreeSet<String> = OF_FILES.map(str::to_owned).into();
    let mut see = |text: &str, name: &str| {
        let read =
            |text: &str| parse_case(text, "case.toml").unwrap_or_else(|errors| panic!("{name}: {errors}\n{text}"));
        let resolved = written(&read(text), read, name);
        for text in [text, &resolved] {
            let table: toml::Table = text.parse().expect("TOML");
            let value = serde_json::to_value(table).expect("JSON");
            assert!(accepts(&schema, &schema, &value), "the schema refuses {name}\n{text}");
            mark(&schema, &schema, "", &value, &mut seen);
        }
    };
    TEMPLATES.iter().for_each(|template| see(template.text, template.name));
    let mut files = Vec::new();
    toml_files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/keys"), &mut files);
    for file in files {
        see(&std::fs::read_to_string(&file).expect("readable"), &file.display().to_string());
    }
    let mut all = BTreeSet::new();
    keys(&schema, "", &mut all);
    let missing: Vec<_> = all.difference(&seen).collect();
    assert!(all.len() > 250 && missing.is_empty(), "{} keys; no case has {missing:#?}", all.len());
}

/// All keys of a schema, each with the definition to which it belongs.
fn keys(schema: &Value, of: &str, found: &mut BTreeSet<String>) {
    for (name, definition) in schema["$defs"].as_object().into_iter().flatten() {
        keys(definition, name, found);
    }
    for (key, inner) in schema["properties"].as_object().into_iter().flatten() {
        found.insert(format!("{of}.{key}"));
        keys(inner, &format!("{of}.{key}"), found);
    }
    for list in ["oneOf", "anyOf", "allOf"] {
        schema[list].as_array().into_iter().flatten().for_each(|inner| keys(inner, of, found));
    }
    if schema["items"].is_object() {
        keys(&schema["items"], of, found);
    }
}

/// The keys of a schema that a value uses.
fn mark(root: &Value, schema: &Value, of: &str, value: &Value, seen: &mut BTreeSet<String>) {
    if let Some(name) = schema["$ref"].as_str() {
        let target = root.pointer(name.trim_start_matches('#')).expect("a definition");
        mark(root, target, name.rsplit('/').next().unwrap_or_default(), value, seen);
    }
    for (key, inner) in schema["properties"].as_object().into_iter().flatten() {
        if let Some(used) = value.get(key) {
            seen.insert(format!("{of}.{key}"));
            mark(root, inner, &format!("{of}.{key}"), used, seen);
        }
    }
    for list in ["oneOf", "anyOf", "allOf"] {
        let fitting = schema[list].as_array().into_iter().flatten().filter(|inner| accepts(root, inner, value));
        fitting.for_each(|inner| mark(root, inner, of, value, seen));
    }
    if schema["items"].is_object() {
        value.as_array().into_iter().flatten().for_each(|item| mark(root, &schema["items"], of, item, seen));
    }
}
