//! The TOML document as a tree of tables that knows the place of each value.
//!
//! A [`Table`] returns its values one by one, checks their types and records their places in the
//! [`SourceMap`](super::SourceMap). After an error it continues with a placeholder, so that all
//! errors of a file are found at once. Keys that were never requested are unknown
//! ([`Table::finish`]).

use std::cell::RefCell;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::CaseCode;
use super::field::Field;
use super::reader::{Reader, nearest, sharing_a_word, suggestion_or_list};

/// A table of the document at a path.
pub(crate) struct Table<'a> {
    pub(crate) reader: &'a Reader,
    table: &'a DeTable<'a>,
    path: String,
    known: RefCell<Vec<&'static str>>,
    missing: RefCell<Vec<Missing>>,
}

/// One of these keys is required and none is present.
struct Missing {
    keys: Vec<&'static str>,
    code: CaseCode,
    message: String,
    help: String,
}

impl<'a> Table<'a> {
    pub(crate) fn new(reader: &'a Reader, table: &'a DeTable<'a>, path: String) -> Self {
        Self { reader, table, path, known: RefCell::default(), missing: RefCell::default() }
    }

    /// Whether another key of this table is probably a misspelt `key`.
    pub(crate) fn has_misspelt(&self, key: &str) -> bool {
        !self.has(key) && self.table.keys().any(|typed| nearest(typed.get_ref(), &[key]).is_some())
    }

    /// Requires a key. If it is missing, [`Table::finish`] reports it unless an unknown key
    /// explains it.
    pub(crate) fn require(&self, key: &'static str, help: &str) {
        self.reader.require(&self.path, &[key]);
        if self.has(key) {
            return;
        }
        let table = if self.path.is_empty() { "the case file" } else { &self.path };
        self.missing.borrow_mut().push(Missing {
            keys: vec![key],
            code: CaseCode::MissingKey,
            message: format!("{table} needs the key `{key}`"),
            help: help.to_owned(),
        });
    }

    /// Requires at least one of several keys. If all are missing, [`Table::finish`] reports it.
    pub(crate) fn require_one_of(&self, keys: &'static [&'static str], message: &str) {
        self.reader.require(&self.path, keys);
        if keys.iter().any(|key| self.has(key)) {
            return;
        }
        self.missing.borrow_mut().push(Missing {
            keys: keys.to_vec(),
            code: CaseCode::MissingKey,
            message: message.to_owned(),
            help: format!("give one or more of: {}", keys.join(", ")),
        });
    }

    /// The path of this table; empty for the whole document.
    pub(crate) fn path(&self) -> &str {
        &self.path
    }

    /// The path of a key of this table.
    pub(crate) fn path_of(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }

    /// The value of a key; records its place, and marks the key as known.
    fn get(&self, key: &'static str) -> Option<&'a Spanned<DeValue<'a>>> {
        self.known.borrow_mut().push(key);
        let value = self.table.get(key)?;
        self.reader.note(&self.path_of(key), value.span());
        Some(value)
    }

    pub(crate) fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    fn field<T>(
        &self,
        key: &'static str,
        read: impl FnOnce(&'a Spanned<DeValue<'a>>, &str) -> Option<T>,
    ) -> Field<'_, 'a, T> {
        Field::new(self, key, self.get(key).and_then(|value| read(value, &format!("`{key}`"))))
    }

    pub(crate) fn number(&self, key: &'static str) -> Field<'_, 'a, f64> {
        self.field(key, |value, what| self.reader.number(value, what))
    }

    pub(crate) fn integer(&self, key: &'static str) -> Field<'_, 'a, i64> {
        self.field(key, |value, what| self.reader.integer(value, what))
    }

    pub(crate) fn string(&self, key: &'static str) -> Field<'_, 'a, String> {
        self.field(key, |value, what| self.reader.string(value, what))
    }

    pub(crate) fn boolean(&self, key: &'static str) -> Field<'_, 'a, bool> {
        self.field(key, |value, what| self.reader.boolean(value, what))
    }

    pub(crate) fn vector(&self, key: &'static str) -> Field<'_, 'a, [f64; 3]> {
        self.field(key, |value, what| self.reader.three(value, what, |entry, what| self.reader.number(entry, what)))
    }

    pub(crate) fn integers(&self, key: &'static str) -> Field<'_, 'a, [i64; 3]> {
        self.field(key, |value, what| self.reader.three(value, what, |entry, what| self.reader.integer(entry, what)))
    }

    /// One of several words, converted to its meaning.
    pub(crate) fn word<T: Copy>(&self, key: &'static str, words: &[(&'static str, T)]) -> Field<'_, 'a, T> {
        self.field(key, |value, what| {
            let word = self.reader.string(value, what)?;
            let found = words.iter().find(|(name, _)| *name == word);
            if found.is_none() {
                let names: Vec<&str> = words.iter().map(|&(name, _)| name).collect();
                self.reader.error_at(
                    value.span(),
                    CaseCode::UnknownWord,
                    format!("{what} cannot be `{word}`"),
                    suggestion_or_list(&word, &names),
                );
            }
            found.map(|&(_, meaning)| meaning)
        })
    }

    /// A list, each entry read by `read` (which receives its path). Entries that cannot be read are
    /// skipped; if none can be read, the list counts as unreadable too.
    pub(crate) fn list<T>(
        &self,
        key: &'static str,
        read: impl Fn(&'a Spanned<DeValue<'a>>, String) -> Option<T>,
    ) -> Field<'_, 'a, Vec<T>> {
        self.field(key, |value, what| {
            let Some(array) = value.get_ref().as_array() else {
                self.reader.wrong_type(value, what, "a list [ … ]");
                return None;
            };
            let path = self.path_of(key);
            let entry = |(i, entry): (usize, &'a Spanned<DeValue<'a>>)| {
                let path = format!("{path}[{i}]");
                self.reader.note(&path, entry.span());
                read(entry, path)
            };
            let entries: Vec<T> = array.iter().enumerate().filter_map(entry).collect();
            (array.is_empty() || !entries.is_empty()).then_some(entries)
        })
    }

    /// The raw value of a key, for keys that accept several types.
    pub(crate) fn value(&self, key: &'static str) -> Option<&'a Spanned<DeValue<'a>>> {
        self.get(key)
    }

    /// A table within this one; a value of another type is reported and ignored.
    pub(crate) fn table(&self, key: &'static str) -> Option<Table<'a>> {
        let value = self.get(key)?;
        self.reader.table(value, self.path_of(key))
    }

    /// The tables of a `[[key]]`; empty if the key is absent.
    pub(crate) fn tables(&self, key: &'static str) -> Vec<Table<'a>> {
        let Some(value) = self.get(key) else {
            return Vec::new();
        };
        let path = self.path_of(key);
        match value.get_ref() {
            DeValue::Array(array) => {
                let table = |(i, entry)| self.reader.table(entry, format!("{path}[{i}]"));
                array.iter().enumerate().filter_map(table).collect()
            }
            DeValue::Table(table) => {
                self.reader.error_at(
                    value.span(),
                    CaseCode::WrongType,
                    format!("`{key}` must be a list of tables, since there can be several"),
                    format!("write [[{}]] for each of them", without_indices(&path)),
                );
                vec![Table::new(self.reader, table, format!("{path}[0]"))]
            }
            _ => {
                self.reader.wrong_type(value, &format!("`{key}`"), &format!("tables [[{key}]]"));
                Vec::new()
            }
        }
    }

    /// The only one of several keys that is given; none or more than one is an error.
    pub(crate) fn choose(&self, what: &str, keys: &'static [&'static str]) -> Option<&'static str> {
        self.known.borrow_mut().extend(keys);
        let given: Vec<&'static str> = keys.iter().copied().filter(|key| self.has(key)).collect();
        if let [one] = given[..] {
            return Some(one);
        }
        if given.is_empty() {
            self.missing.borrow_mut().push(Missing {
                keys: keys.to_vec(),
                code: CaseCode::ChooseOne,
                message: format!("{what} is missing"),
                help: format!("give one of: {}", keys.join(", ")),
            });
        } else {
            self.get(given[1]);
            self.reader.error(
                &self.path_of(given[1]),
                CaseCode::ChooseOne,
                format!("{what} is given more than once: {}", given.join(", ")),
                "keep one of them",
            );
        }
        None
    }

    /// Reports every unknown key and every missing required key, but each mistake only once: if an
    /// unknown key is probably a missing one under a wrong name, only the unknown key is reported.
    pub(crate) fn finish(self) {
        let mut known = self.known.into_inner();
        let mut seen = Vec::new();
        known.retain(|key| {
            !seen.contains(key) && {
                seen.push(*key);
                true
            }
        });
        let names = self.table.keys().map(|key| (key.get_ref().as_ref(), key.span()));
        let unknown: Vec<(&str, _)> = names.filter(|(name, _)| !known.contains(name)).collect();
        let place = if self.path.is_empty() { "at the top level" } else { &format!("in {}", self.path) };
        let (meant, absent) = explained(&unknown, self.missing.into_inner());
        for ((name, span), meant) in unknown.into_iter().zip(meant) {
            let help = meant.unwrap_or_else(|| suggestion_or_list(name, &known));
            self.reader.error_at(span, CaseCode::UnknownKey, format!("unknown key `{name}` {place}"), help);
        }
        for Missing { code, message, help, .. } in absent {
            self.reader.error(&self.path, code, message, help);
        }
    }
}

/// Pairs unknown keys with missing ones. Returns the help for each unknown key that is probably a
/// missing one under a wrong name, and the missing keys that no unknown key explains. Each unknown
/// key explains one missing key.
fn explained<S>(unknown: &[(&str, S)], missing: Vec<Missing>) -> (Vec<Option<String>>, Vec<Missing>) {
    let mut meant: Vec<Option<String>> = unknown.iter().map(|_| None).collect();
    let mut rest = missing;
    let misspelt: fn(&str, &[&'static str]) -> Option<&'static str> = |name, keys| {
        let near = nearest(name, keys)?;
        keys.iter().copied().find(|key| *key == near)
    };
    for like in [misspelt, sharing_a_word] {
        rest.retain(|missing| {
            let free = (0..unknown.len()).filter(|&k| meant[k].is_none());
            let found = free.filter_map(|k| Some((k, like(unknown[k].0, &missing.keys)?))).next();
            if let Some((k, key)) = found {
                meant[k] = Some(format!("did you mean `{key}`?"));
            }
            found.is_none()
        });
    }
    // one unknown and one missing key: either the name is wrong, or one message covers both
    // mistakes
    let mut free = meant.iter_mut().filter(|meant| meant.is_none());
    if let (Some(only), None, [_]) = (free.next(), free.next(), &rest[..])
        && let Some(Missing { code, message, help, .. }) = rest.pop()
    {
        // for a choice, the list of alternatives is sufficient
        *only = Some(if code == CaseCode::ChooseOne { help } else { format!("{message}: {help}") });
    }
    (meant, rest)
}

/// A path as the heading of a table: `load_case[0].pairs` is `load_case.pairs`.
fn without_indices(path: &str) -> String {
    path.split('[').map(|part| part.split_once(']').map_or(part, |(_, rest)| rest)).collect()
}
