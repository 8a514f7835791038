//! Forms: the values of a text with their places, and texts in which one value has changed or is gone.

use std::ops::Range;

use serde_json::{Value, json};
use slipstick::case::{Override, override_case};
use slipstick_service::failure::{Failure, Outcome};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The values of a text: `[{ path, kind, text, from, to, removable }]`, tables before their entries. `from` and `to` are
/// line and column, as in diagnostics. `null` if the text is not TOML. Values of keys that need quotes are left out.
/// What [`without`] cannot remove is not removable: tables with a header, dotted keys, entries of a list.
pub fn values(text: &str) -> Value {
    let Ok(root) = DeTable::parse(text) else { return Value::Null };
    let places = Places::of(text);
    let mut all = Vec::new();
    for (key, value) in root.get_ref() {
        if is_bare(key.get_ref()) {
            let place = Place { key: key.span(), value: value.span(), inline: false };
            gather(text, &places, key.get_ref(), Some(&place), value, &mut all);
        }
    }
    all.into()
}

/// Adds a value and those in it; a key has a place, an entry of a list has none.
fn gather(
    text: &str,
    places: &Places,
    path: &str,
    place: Option<&Place>,
    value: &Spanned<DeValue<'_>>,
    all: &mut Vec<Value>,
) {
    let span = value.span();
    let raw = text.get(span.clone()).unwrap_or_default();
    let (kind, shown) = match value.get_ref() {
        DeValue::String(word) => ("string", word.to_string()),
        DeValue::Integer(_) | DeValue::Float(_) => ("number", raw.to_owned()),
        DeValue::Boolean(_) => ("boolean", raw.to_owned()),
        DeValue::Datetime(_) => ("date", raw.to_owned()),
        DeValue::Array(_) => ("list", raw.to_owned()),
        DeValue::Table(_) => ("table", String::new()),
    };
    let (from, to) = (places.at(text, span.start), places.at(text, span.end));
    let removable = place.is_some_and(|place| place.inline || lines(text, place).is_some());
    all.push(json!({ "path": path, "kind": kind, "text": shown, "from": from, "to": to, "removable": removable }));
    match value.get_ref() {
        DeValue::Table(entries) => {
            let bare = entries.iter().filter(|(key, _)| is_bare(key.get_ref()));
            let inline = raw.starts_with('{');
            for (key, value) in bare {
                let place = Place { key: key.span(), value: value.span(), inline };
                gather(text, places, &format!("{path}.{}", key.get_ref()), Some(&place), value, all);
            }
        }
        DeValue::Array(entries) => {
            let tables = entries.iter().enumerate().filter(|(_, entry)| entry.get_ref().is_table());
            tables.for_each(|(number, entry)| gather(text, places, &format!("{path}[{number}]"), None, entry, all));
        }
        _ => {}
    }
}

/// Whether a key needs no quotes; others, as `"a.b"`, would make wrong paths.
fn is_bare(key: &str) -> bool {
    !key.is_empty() && key.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'-')
}

/// The starts of the lines.
struct Places(Vec<usize>);

impl Places {
    fn of(text: &str) -> Self {
        Self(std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect())
    }

    /// Line and column, both from 1, columns in characters.
    fn at(&self, text: &str, offset: usize) -> [usize; 2] {
        let line = self.0.partition_point(|&start| start <= offset);
        let before = text.get(self.0[line - 1]..offset).unwrap_or_default();
        [line, 1 + before.chars().count()]
    }
}

/// The text with one value changed or added, and everything else as it was.
///
/// # Errors
/// [`Failure::Input`] if the path leads nowhere, or the value is not TOML.
pub fn with_value(text: &str, path: &str, value: &str) -> Outcome<String> {
    let wrong = |error: slipstick::case::OverrideError| Failure::input(error.to_string(), error.cure());
    if DeTable::parse(text).is_err() {
        return Err(Failure::input("the text is not TOML", "correct its first error in the text, and try again"));
    }
    let change: Override = format!("{path}={value}").parse().map_err(wrong)?;
    override_case(text, "the text", &[change]).map_err(wrong)
}

/// The text without one key and its value, and everything else as it was: its line, or its entry of an inline table.
///
/// # Errors
/// [`Failure::Input`] if there is no such key, or it shares its line with something else.
pub fn without(text: &str, path: &str) -> Outcome<String> {
    let cure = "remove the key from the text";
    let missing = || Failure::input(format!("the text has no value {path}"), cure);
    let root = DeTable::parse(text).map_err(|_| missing())?;
    let place = place(text, root.get_ref(), path).ok_or_else(missing)?;
    let cut = if place.inline { Some(entry(text, &place)) } else { lines(text, &place) };
    let tried = cut.map(|cut| [&text[..cut.start], &text[cut.end..]].concat());
    let inner = |of: &str| of.strip_prefix(path).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']));
    let outer = |of: &str| path.strip_prefix(of).is_some_and(|rest| rest.starts_with(['.', '[']));
    let others = |text: &str| -> Option<Vec<[String; 3]>> {
        let all = values(text);
        let of = |one: &Value| ["path", "kind", "text"].map(|key| one[key].as_str().unwrap_or_default().to_owned());
        Some(all.as_array()?.iter().map(of).filter(|[of, ..]| !inner(of) && !outer(of)).collect())
    };
    match tried {
        Some(tried) if others(&tried).is_some() && others(&tried) == others(text) => Ok(tried),
        _ => Err(Failure::input(format!("{path} cannot be removed without changing other values"), cure)),
    }
}

/// Where a key and its value are, and whether they are in an inline table.
struct Place {
    key: Range<usize>,
    value: Range<usize>,
    inline: bool,
}

fn place(text: &str, root: &DeTable<'_>, path: &str) -> Option<Place> {
    let (mut table, mut inline, mut found) = (root, false, None);
    let mut segments = path.split('.').peekable();
    while let Some(segment) = segments.next() {
        let (key, entry) = match segment.split_once('[') {
            Some((key, number)) => (key, Some(number.strip_suffix(']')?.parse::<usize>().ok()?)),
            None => (segment, None),
        };
        let (name, value) = table.iter().find(|(name, _)| name.get_ref() == key)?;
        if segments.peek().is_none() {
            found = entry.is_none().then(|| Place { key: name.span(), value: value.span(), inline });
            break;
        }
        let inner = match entry {
            Some(number) => value.get_ref().as_array()?.get(number)?,
            None => value,
        };
        inline = text.get(inner.span())?.starts_with('{');
        table = inner.get_ref().as_table()?;
    }
    found
}

/// The lines of a key and its value, if nothing but a comment is beside them.
fn lines(text: &str, place: &Place) -> Option<Range<usize>> {
    let start = text[..place.key.start].rfind('\n').map_or(0, |at| at + 1);
    let end = text[place.value.end..].find('\n').map_or(text.len(), |at| place.value.end + at + 1);
    let after = text[place.value.end..end].trim();
    let alone = text[start..place.key.start].trim().is_empty() && (after.is_empty() || after.starts_with('#'));
    alone.then_some(start..end)
}

/// An entry of an inline table with one of the commas beside it.
fn entry(text: &str, place: &Place) -> Range<usize> {
    let (before, after) = (text[..place.key.start].trim_end(), text[place.value.end..].trim_start());
    match (after.strip_prefix(','), before.strip_suffix(',')) {
        (Some(rest), _) => place.key.start..text.len() - rest.trim_start().len(),
        (None, Some(rest)) => rest.len()..place.value.end,
        (None, None) => place.key.start..place.value.end,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "title = \"Äpfel\" # ä\n[[contact]] # first\nslave = \"a\"\nfriction = 0.30\n\n[[body]]\nbox = { min = [0, 0, 0], max = [1, 1, 1] }\n";

    #[test]
    fn values_have_places() {
        let all = values(TEXT);
        let of =
            |path: &str| all.as_array().expect("a list").iter().find(|of| of["path"] == path).expect("a value").clone();
        assert_eq!(
            of("title"),
            json!({ "path": "title", "kind": "string", "text": "Äpfel", "from": [1, 9], "to": [1, 16], "removable": true })
        );
        assert_eq!(
            of("contact[0].friction"),
            json!({ "path": "contact[0].friction", "kind": "number", "text": "0.30", "from": [4, 12], "to": [4, 16], "removable": true })
        );
        assert_eq!(
            (of("body[0].box.max")["text"].as_str(), of("body[0]")["kind"].as_str()),
            (Some("[1, 1, 1]"), Some("table"))
        );
        assert!(values("a = ").is_null());
        let quoted = values("\"a.b\" = 1\nc = { \"d e\" = 2, f = 3 }\n");
        let paths: Vec<_> = quoted.as_array().expect("a list").iter().map(|of| &of["path"]).collect();
        assert_eq!(paths, ["c", "c.f"]);
    }

    #[test]
    fn one_key_is_removed_and_all_else_stays() {
        let gone = |text: &str, path: &str| without(text, path).expect("removed");
        assert_eq!(gone(TEXT, "contact[0].friction"), TEXT.replace("friction = 0.30\n", ""));
        assert_eq!(gone(TEXT, "title"), TEXT.replace("title = \"Äpfel\" # ä\n", ""));
        assert_eq!(gone(TEXT, "body[0].box.max"), TEXT.replace(", max = [1, 1, 1]", ""));
        assert_eq!(gone(TEXT, "body[0].box.min"), TEXT.replace("min = [0, 0, 0], ", ""));
        assert_eq!(gone(TEXT, "body[0].box"), TEXT.replace("box = { min = [0, 0, 0], max = [1, 1, 1] }\n", ""));
        assert_eq!(gone("a = { b = 1 }\nc = [ # rows\n 1,\n]", "a.b"), "a = {  }\nc = [ # rows\n 1,\n]");
        assert_eq!(gone("a = { b = 1 }\nc = [ # rows\n 1,\n]", "c"), "a = { b = 1 }\n");
        assert_eq!(gone("a = [{ b = 1, c = 2 }, { b = 3 }]\n", "a[0].c"), "a = [{ b = 1 }, { b = 3 }]\n");
        for path in ["contact", "contact[0]", "contact[1].friction", "contact[0].tied", "body[0].box.max[0]", "", "a.b"]
        {
            assert!(without(TEXT, path).is_err(), "{path}");
        }
        assert!(without("a.b = 1\na.c = 2\n", "a.b").is_err(), "a dotted key");
        assert!(without("a = ", "a").is_err());
    }

    #[test]
    fn what_cannot_be_removed_is_known() {
        let text = "[x]\na = 1\nb.c = 2\nd = { e = 1, f = [{ g = 1 }] } # d\n[x.y]\nz = [\n  1,\n]\n[[x.l]]\nm = 1\n";
        for text in [text, TEXT] {
            for one in values(text).as_array().expect("a list") {
                let path = one["path"].as_str().expect("a path");
                assert_eq!(one["removable"], without(text, path).is_ok(), "{path}");
            }
        }
        let all = values(text);
        let removable = all.as_array().expect("a list").iter().filter(|one| one["removable"] == true);
        let mut paths: Vec<_> = removable.map(|one| one["path"].as_str().expect("a path")).collect();
        paths.sort_unstable();
        assert_eq!(paths, ["x.a", "x.d", "x.d.e", "x.d.f", "x.d.f[0].g", "x.l[0].m", "x.y.z"]);
    }

    #[test]
    fn one_value_changes_and_all_else_stays() {
        let changed = with_value(TEXT, "contact[0].friction", "0.25").expect("changed");
        assert_eq!(changed, TEXT.replace("0.30", "0.25"));
        let added = with_value(TEXT, "contact[0].tied", "true").expect("added");
        assert_eq!(added, TEXT.replace("friction = 0.30\n", "friction = 0.30\ntied = true\n"));
        let inner = with_value(TEXT, "body[0].box.max", "[1, 1, 2]").expect("changed");
        assert_eq!(inner, TEXT.replace("[1, 1, 1]", "[1, 1, 2]"));
        let rows = "a = [ # both\n  1, # one\n  2,\n]\nb = 3\n";
        let list = values(rows)[0]["text"].as_str().expect("text").replace("2,", "4,");
        assert_eq!(with_value(rows, "a", &list).expect("changed"), rows.replace("2,", "4,"));
        for (path, value) in [("contact[7].friction", "1"), ("contact[0].friction", "1 = 2"), ("", "1"), ("a", "\"")] {
            assert!(with_value(TEXT, path, value).is_err(), "{path}");
        }
        assert!(with_value("a = ", "a", "1").is_err());
    }
}
