//! What was typed: the TOML document as a tree of tables that knows the place of each value.
//!
//! A [`Table`] hands out its values one by one, each with its type checked, notes their places in the
//! [`SourceMap`](super::SourceMap) and goes on after an error with a stand-in, so that all errors of a file are found at once.
//! Keys that nobody asked for are unknown ([`Table::finish`]).

use std::cell::RefCell;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::CaseCode;
use super::field::Field;
use super::reader::{Reader, nearest, sharing_a_word, suggestion_or_list};

/// A table of the document at a path.
pub(super) struct Table<'a> {
    pub(super) reader: &'a Reader,
    table: &'a DeTable<'a>,
    path: String,
    known: RefCell<Vec<&'static str>>,
    missing: RefCell<Vec<Missing>>,
}

/// One of these keys is needed and none is there.
struct Missing {
    keys: Vec<&'static str>,
    code: CaseCode,
    message: String,
    help: String,
}

impl<'a> Table<'a> {
    pub(super) fn new(reader: &'a Reader, table: &'a DeTable<'a>, path: String) -> Self {
        Self { reader, table, path, known: RefCell::default(), missing: RefCell::default() }
    }

    /// Whether another key of this table is probably `key`, misspelt.
    pub(super) fn has_misspelt(&self, key: &str) -> bool {
        !self.has(key) && self.table.keys().any(|typed| nearest(typed.get_ref(), &[key]).is_some())
    }

    /// Notes that a key is needed and absent; reported by [`Table::finish`], where no unknown key explains it.
    pub(super) fn note_missing(&self, key: &'static str, help: &str) {
        let table = if self.path.is_empty() { "the case file" } else { &self.path };
        self.missing.borrow_mut().push(Missing {
            keys: vec![key],
            code: CaseCode::MissingKey,
            message: format!("{table} needs the key `{key}`"),
            help: help.to_owned(),
        });
    }

    /// Notes that one of several keys is needed and all are absent; reported by [`Table::finish`].
    pub(super) fn note_missing_one_of(&self, keys: &'static [&'static str], message: &str) {
        self.missing.borrow_mut().push(Missing {
            keys: keys.to_vec(),
            code: CaseCode::MissingKey,
            message: message.to_owned(),
            help: format!("give one or more of: {}", keys.join(", ")),
        });
    }

    /// The path of this table; empty for the whole document.
    pub(super) fn path(&self) -> &str {
        &self.path
    }

    /// The path of a key of this table.
    pub(super) fn path_of(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }

    /// The value of a key, its place noted, the key known from now on.
    fn get(&self, key: &'static str) -> Option<&'a Spanned<DeValue<'a>>> {
        self.known.borrow_mut().push(key);
        let value = self.table.get(key)?;
        self.reader.note(&self.path_of(key), value.span());
        Some(value)
    }

    pub(super) fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    fn field<T>(
        &self,
        key: &'static str,
        read: impl FnOnce(&'a Spanned<DeValue<'a>>, &str) -> Option<T>,
    ) -> Field<'_, 'a, T> {
        let value = self.get(key);
        let read = value.and_then(|value| read(value, &format!("`{key}`")));
        Field::new(self, key, value.is_some(), read)
    }

    pub(super) fn number(&self, key: &'static str) -> Field<'_, 'a, f64> {
        self.field(key, |value, what| self.reader.number(value, what))
    }

    pub(super) fn integer(&self, key: &'static str) -> Field<'_, 'a, i64> {
        self.field(key, |value, what| self.reader.integer(value, what))
    }

    pub(super) fn string(&self, key: &'static str) -> Field<'_, 'a, String> {
        self.field(key, |value, what| self.reader.string(value, what))
    }

    pub(super) fn boolean(&self, key: &'static str) -> Field<'_, 'a, bool> {
        self.field(key, |value, what| self.reader.boolean(value, what))
    }

    pub(super) fn vector(&self, key: &'static str) -> Field<'_, 'a, [f64; 3]> {
        self.field(key, |value, what| self.reader.three(value, what, |entry, what| self.reader.number(entry, what)))
    }

    pub(super) fn integers(&self, key: &'static str) -> Field<'_, 'a, [i64; 3]> {
        self.field(key, |value, what| self.reader.three(value, what, |entry, what| self.reader.integer(entry, what)))
    }

    /// One word out of several, as what it means.
    pub(super) fn word<T: Copy>(&self, key: &'static str, words: &[(&'static str, T)]) -> Field<'_, 'a, T> {
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

    /// A list, each entry read by `read` (which is given its path); entries that cannot be read are left out, and a
    /// list of such entries alone is as wrong as they are.
    pub(super) fn list<T>(
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

    /// The raw value of a key, for those that can be of several types.
    pub(super) fn value(&self, key: &'static str) -> Option<&'a Spanned<DeValue<'a>>> {
        self.get(key)
    }

    /// A table within this one; a value of another type is reported and left out.
    pub(super) fn table(&self, key: &'static str) -> Option<Table<'a>> {
        let value = self.get(key)?;
        self.reader.table(value, self.path_of(key))
    }

    /// The tables of a `[[key]]`; none where the key is absent.
    pub(super) fn tables(&self, key: &'static str) -> Vec<Table<'a>> {
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
                    format!("there can be several `{key}`, so that it must be a list of tables"),
                    format!("write [[{key}]] for each of them"),
                );
                vec![Table::new(self.reader, table, format!("{path}[0]"))]
            }
            _ => {
                self.reader.wrong_type(value, &format!("`{key}`"), &format!("tables [[{key}]]"));
                Vec::new()
            }
        }
    }

    /// The one key of several that is given; none or more than one is an error.
    pub(super) fn choose(&self, what: &str, keys: &'static [&'static str]) -> Option<&'static str> {
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
                format!("{what} is given {} times: {}", given.len(), given.join(", ")),
                "keep one of them",
            );
        }
        None
    }

    /// Reports every key that was not asked for, and every needed one that is absent, but one mistake once: where an
    /// unknown key is probably the absent one under a wrong name, the unknown key alone is reported.
    pub(super) fn finish(self) {
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

/// Pairs unknown keys with needed ones that are absent: what to say of each unknown key that is probably an absent one under
/// a wrong name, and the absent keys that no unknown one explains. Each unknown key explains one.
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
    // one key too many and one too few: the name is wrong, or it says what is absent beside
    let mut free = meant.iter_mut().filter(|meant| meant.is_none());
    if let (Some(only), None, [_]) = (free.next(), free.next(), &rest[..])
        && let Some(Missing { code, message, help, .. }) = rest.pop()
    {
        // of a choice, the list of what there is says all
        *only = Some(if code == CaseCode::ChooseOne { help } else { format!("{message}: {help}") });
    }
    (meant, rest)
}
