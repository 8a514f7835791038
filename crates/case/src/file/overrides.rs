//! Replaces values of a case file before it is read.
//!
//! The replacement changes the text and keeps its comments and order, so that the case that was run
//! can be saved as a case file.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;
use toml_edit::{DocumentMut, InlineTable, Item, TableLike, Value};

use slipstick_model::words::counted;

/// A value to set in a case file: `contact[0].friction = 0.1`.
///
/// Keys are joined by dots; entries of a list are counted from 0, as in `contact[0]` or
/// `contact.0`, and `contact[*]` stands for all entries. The value is TOML; a bare word is a string. Keys that the file does not have are
/// added; entries of lists are not.
///
/// ```
/// use slipstick_case::file::{Override, override_case};
///
/// let friction: Override = "contact[0].friction = 0.1".parse().unwrap();
/// let text = "[[contact]]\nfriction = 0.3   # of steel\n";
/// assert_eq!(override_case(text, "case.toml", &[friction]).unwrap(), "[[contact]]\nfriction = 0.1   # of steel\n");
/// ```
#[derive(Debug, Clone)]
pub struct Override {
    text: String,
    path: Vec<Segment>,
    value: Value,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Segment {
    Key(String),
    Entry(usize),
    /// Every entry of a list.
    All,
}

/// Why a value cannot be set in a case file.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum OverrideError {
    /// It is not `KEY=VALUE`.
    #[error("`{text}` is not of the form KEY=VALUE: {reason}")]
    Syntax {
        /// As typed.
        text: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The key path does not exist in the file and cannot be added.
    #[error("{file}: cannot set `{text}`: {reason}")]
    Place {
        /// As typed.
        text: String,
        /// The case file.
        file: String,
        /// What is wrong, and at which place in the file.
        reason: String,
    },
}

impl OverrideError {
    /// The remedy.
    pub fn cure(&self) -> &'static str {
        match self {
            Self::Syntax { .. } => "examples: contact[0].friction=0.1, objective.contact_force.steps=all",
            Self::Place { .. } => {
                "docs/case_file.md lists all keys; entries of lists are counted from 0, and [*] means all"
            }
        }
    }
}

impl fmt::Display for Override {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl FromStr for Override {
    type Err = OverrideError;

    fn from_str(text: &str) -> Result<Self, OverrideError> {
        let wrong = |reason: &str| OverrideError::Syntax { text: text.to_owned(), reason: reason.to_owned() };
        let (key, value) = text.split_once('=').ok_or_else(|| wrong("there is no `=`"))?;
        let path = path(key.trim()).ok_or_else(|| wrong("the key does not have the form contact[0].friction"))?;
        let value = value.trim();
        let bare = !value.is_empty() && value.chars().all(is_bare);
        let value = match value.parse::<Value>() {
            Ok(value) => value,
            Err(_) if bare => value.into(),
            Err(error) => return Err(wrong(&format!("the value is not TOML, {}", error.message()))),
        };
        Ok(Self { text: text.to_owned(), path, value })
    }
}

fn is_bare(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_' || c == '-'
}

/// The keys and numbers of `contact[0].friction`; the first is a key.
fn path(key: &str) -> Option<Vec<Segment>> {
    let mut path = Vec::new();
    for part in key.split('.') {
        let (name, mut rest) = part.split_at(part.find('[').unwrap_or(part.len()));
        if name.is_empty() || !name.chars().all(is_bare) {
            return None;
        }
        path.push(match name.parse() {
            Ok(number) => Segment::Entry(number),
            Err(_) => Segment::Key(name.to_owned()),
        });
        while !rest.is_empty() {
            let (number, after) = rest.strip_prefix('[')?.split_once(']')?;
            path.push(match number {
                "*" => Segment::All,
                number => Segment::Entry(number.parse().ok()?),
            });
            rest = after;
        }
    }
    matches!(path.first(), Some(Segment::Key(_))).then_some(path)
}

/// The text of a case file with values replaced, in the given order; `file_name` only appears in
/// messages. A text that is not TOML is returned unchanged, because
/// [`parse_case`](super::parse_case) reports its errors.
///
/// # Errors
///
/// [`OverrideError::Place`].
pub fn override_case(text: &str, file_name: &str, overrides: &[Override]) -> Result<String, OverrideError> {
    if overrides.is_empty() {
        return Ok(text.to_owned());
    }
    let Ok(mut document) = text.parse::<DocumentMut>() else { return Ok(text.to_owned()) };
    for one in overrides {
        let put = put_in_table(document.as_table_mut(), "the case", &one.path, &one.value);
        let place = |reason| OverrideError::Place { text: one.text.clone(), file: file_name.to_owned(), reason };
        put.map_err(place)?;
    }
    Ok(document.to_string())
}

/// Sets a value in a table. `name` is how messages refer to the table; the error gives the reason.
fn put_in_table(table: &mut dyn TableLike, name: &str, path: &[Segment], value: &Value) -> Result<(), String> {
    let (key, rest) = match path {
        [Segment::Key(key), rest @ ..] => (key, rest),
        [Segment::Entry(number), ..] => return Err(format!("{name} is not a list and has no entry {number}")),
        [Segment::All, ..] => return Err(not_a_list(name)),
        [] => return Err(format!("{name} is a table of a list; set its keys one by one")),
    };
    let name = if name == "the case" { key.clone() } else { format!("{name}.{key}") };
    let Some(item) = table.get_mut(key) else {
        let new = nested(rest, value).ok_or_else(|| format!("there is no list {name}"))?;
        table.insert(key, Item::Value(new));
        return Ok(());
    };
    match (item, rest) {
        (Item::Value(old), _) => put_in_value(old, &name, rest, value),
        (item, []) => {
            *item = Item::Value(value.clone());
            Ok(())
        }
        (Item::ArrayOfTables(tables), [Segment::Entry(number), rest @ ..]) => {
            let count = tables.len();
            let entry = tables.get_mut(*number).ok_or_else(|| no_entry(&name, *number, count))?;
            put_in_table(entry, &format!("{name}[{number}]"), rest, value)
        }
        (Item::ArrayOfTables(tables), [Segment::All, rest @ ..]) => {
            let mut entries = tables.iter_mut().enumerate();
            entries.try_for_each(|(number, entry)| put_in_table(entry, &format!("{name}[{number}]"), rest, value))
        }
        (item, _) => match item.as_table_like_mut() {
            Some(table) => put_in_table(table, &name, rest, value),
            None => Err(format!("{name} is a list; select an entry, for instance {name}[0]")),
        },
    }
}

/// Sets a value within another one, or replaces it.
fn put_in_value(old: &mut Value, name: &str, path: &[Segment], value: &Value) -> Result<(), String> {
    match (old, path) {
        (old, []) => {
            let mut new = value.clone();
            *new.decor_mut() = old.decor().clone();
            *old = new;
            Ok(())
        }
        (Value::Array(entries), [Segment::Entry(number), rest @ ..]) => {
            let count = entries.len();
            let entry = entries.get_mut(*number).ok_or_else(|| no_entry(name, *number, count))?;
            put_in_value(entry, &format!("{name}[{number}]"), rest, value)
        }
        (Value::Array(entries), [Segment::All, rest @ ..]) => {
            let mut entries = entries.iter_mut().enumerate();
            entries.try_for_each(|(number, entry)| put_in_value(entry, &format!("{name}[{number}]"), rest, value))
        }
        (Value::InlineTable(table), path) => put_in_table(table, name, path, value),
        (Value::Array(_), _) => Err(format!("{name} is a list; select an entry, for instance {name}[0]")),
        (_, [Segment::Key(key), ..]) => Err(format!("{name} is not a table and has no `{key}`")),
        (_, [Segment::Entry(number), ..]) => Err(format!("{name} is not a list and has no entry {number}")),
        (_, [Segment::All, ..]) => Err(not_a_list(name)),
    }
}

fn not_a_list(name: &str) -> String {
    format!("{name} is not a list; leave out `[*]`")
}

fn no_entry(name: &str, number: usize, count: usize) -> String {
    format!("there is no {name}[{number}]; {name} has {}, numbered from 0", counted(count, "entry"))
}

/// A value within tables that do not exist yet; `None` if `path` asks for an entry of a list.
fn nested(path: &[Segment], value: &Value) -> Option<Value> {
    path.iter().rev().try_fold(value.clone(), |inner, segment| match segment {
        Segment::Key(key) => Some(Value::InlineTable(InlineTable::from_iter([(key.as_str(), inner)]))),
        Segment::Entry(_) | Segment::All => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const CASE: &str = "title = 'a' # first\n[[contact]]\nfriction = 0.3\nenforcement = { lagrange = {} }\n\n\
                        [[dirichlet]]\nmotion = [\n    { t = 1, u = [0, 1, 2] }, # moved\n]\n[load_path]\nsteps = 10\n";

    fn changed(text: &str) -> Result<String, OverrideError> {
        override_case(CASE, "case.toml", &[text.parse()?])
    }

    /// The old value is replaced; everything else is unchanged.
    #[test]
    fn values_are_replaced_in_place() {
        for (text, old, new) in [
            ("contact[0].friction=0.1", "friction = 0.3", "friction = 0.1"),
            ("contact.0.friction = 0.1", "friction = 0.3", "friction = 0.1"),
            ("title=b-2", "'a' #", "\"b-2\" #"),
            ("dirichlet[0].motion[0].u[1]=-1.5", "[0, 1, 2]", "[0, -1.5, 2]"),
            (
                "contact[0].enforcement={ penalty = { stiffness = 5 } }",
                "{ lagrange = {} }",
                "{ penalty = { stiffness = 5 } }",
            ),
            ("load_path.steps=4", "steps = 10", "steps = 4"),
        ] {
            assert_eq!(changed(text).expect(text), CASE.replace(old, new), "{text}");
        }
    }

    /// `[*]` sets a value in every entry of a list, whichever way the list is written.
    #[test]
    fn all_entries_of_a_list_are_set() {
        let text = "[[contact]]\nfriction = 0.3\n[[contact]]\nslave = 'a'\n[body]\nu = [[1, 2], [3, 4]]\n";
        let set = |one: &str| override_case(text, "c", &[one.parse().expect(one)]).expect(one);
        let read = |one: &str| set(one).parse::<toml::Table>().expect("TOML");
        let frictions = read("contact[*].friction=0.1")["contact"].as_array().expect("a list").clone();
        assert!(frictions.len() == 2 && frictions.iter().all(|pair| pair["friction"].as_float() == Some(0.1)));
        assert_eq!(set("body.u[*][1]=7"), text.replace("2]", "7]").replace("4]", "7]"));
    }

    /// Missing keys are added; the expected meaning is that of TOML's own parser.
    #[test]
    fn what_is_missing_is_added() {
        let read = |text: &str| changed(text).expect(text).parse::<toml::Table>().expect("TOML");
        let with = |text: &str, added: &str| format!("{added}\n{CASE}").parse::<toml::Table>().expect(text);
        for (text, same) in
            [("solver.threads=2", "solver.threads = 2"), ("adjoint.memory='0'", "adjoint = { memory = '0' }")]
        {
            assert_eq!(read(text), with(text, same));
        }
        assert_eq!(
            read("load_path.tolerance.relative=1e-6")["load_path"]["tolerance"]["relative"].as_float(),
            Some(1e-6)
        );
        assert_eq!(read("contact[0].cell_rule=3")["contact"][0]["cell_rule"].as_integer(), Some(3));
        let deep = read("contact[0].enforcement.lagrange.complementarity_parameter=2");
        assert_eq!(deep["contact"][0]["enforcement"]["lagrange"]["complementarity_parameter"].as_integer(), Some(2));
    }

    #[test]
    fn what_does_not_fit_is_told() {
        for (text, told) in [
            ("friction", "no `=`"),
            ("=1", "the form contact[0].friction"),
            ("contact[x].friction=1", "not have the form"),
            ("[0]=1", "not have the form"),
            ("title=a b", "not TOML"),
            ("contact[2].friction=1", "contact has 1 entry"),
            ("contact.friction=1", "select an entry, for instance contact[0]"),
            ("contact[0]=1", "contact[0] is a table of a list"),
            ("contact[0].friction.x=1", "contact[0].friction is not a table"),
            ("title[1]=1", "title is not a list"),
            ("body[0].name=1", "there is no list body"),
            ("dirichlet[0].motion[3].t=1", "has 1 entry"),
            ("load_path[0]=1", "load_path is not a list"),
            ("load_path[*]=1", "leave out `[*]`"),
            ("title[*]=1", "leave out `[*]`"),
            ("load[*].amplitude=1", "there is no list load"),
        ] {
            let error = changed(text).expect_err(text);
            assert!(error.to_string().contains(told), "{text}: {error}");
            assert!(error.to_string().contains(&format!("`{text}`")) && !error.cure().is_empty());
        }
        assert_eq!(override_case("a = [", "f", &["title=a".parse().expect("right")]), Ok("a = [".into()));
    }
}
