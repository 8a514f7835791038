//! Collects the places of values, and their errors, while a document is read.

use std::cell::RefCell;
use std::ops::Range;

use toml::Spanned;
use toml::de::DeValue;

use super::document::Table;
use super::{CaseCode, CaseDiagnostic, Severity, SourceMap};

/// Products of a few numbers of at most this size, and their squares, are finite.
const LARGEST_NUMBER: f64 = 1e50;

/// Collects places, diagnostics and requirements while a document is read.
pub(crate) struct Reader {
    map: RefCell<SourceMap>,
    diagnostics: RefCell<Vec<CaseDiagnostic>>,
    requirements: RefCell<Vec<Requirement>>,
}

/// A table must have at least one of these keys, whether the document has it or not. The schema
/// follows from it.
pub(crate) struct Requirement {
    /// Path of the table.
    pub(crate) path: String,
    /// One key if it is required, otherwise the alternatives.
    pub(crate) keys: Vec<&'static str>,
}

impl Reader {
    pub(crate) fn new(text: &str, file_name: &str) -> Self {
        Self {
            map: RefCell::new(SourceMap::new(text, file_name)),
            diagnostics: RefCell::default(),
            requirements: RefCell::default(),
        }
    }

    /// The text of the file.
    pub(super) fn text(&self) -> String {
        self.map.borrow().text().to_owned()
    }

    pub(crate) fn into_requirements(self) -> Vec<Requirement> {
        self.requirements.into_inner()
    }

    /// Records that the table at `path` must have at least one of `keys`.
    pub(crate) fn require(&self, path: &str, keys: &[&'static str]) {
        self.requirements.borrow_mut().push(Requirement { path: path.to_owned(), keys: keys.to_vec() });
    }

    pub(crate) fn into_parts(self) -> (SourceMap, Vec<CaseDiagnostic>) {
        (self.map.into_inner(), self.diagnostics.into_inner())
    }

    /// Records the place of the value that `path` names.
    pub(crate) fn note(&self, path: &str, span: Range<usize>) {
        self.map.borrow_mut().insert(path.to_owned(), span);
    }

    /// Whether the file contains a value, valid or not.
    pub(crate) fn contains(&self, path: &str) -> bool {
        self.map.borrow().contains(path)
    }

    pub(crate) fn error_at(
        &self,
        span: Range<usize>,
        code: CaseCode,
        message: impl Into<String>,
        help: impl Into<String>,
    ) {
        let map = self.map.borrow();
        let diagnostic = map.diagnostic_at(Severity::Error, span, code, message, help);
        self.diagnostics.borrow_mut().push(diagnostic);
    }

    pub(crate) fn error(&self, path: &str, code: CaseCode, message: impl Into<String>, help: impl Into<String>) {
        let span = self.map.borrow().span(path);
        self.error_at(span, code, message, help);
    }

    pub(crate) fn warning(&self, path: &str, code: CaseCode, message: impl Into<String>, help: impl Into<String>) {
        let diagnostic = self.map.borrow().warning(path, code, message, help);
        self.diagnostics.borrow_mut().push(diagnostic);
    }

    pub(crate) fn wrong_type(&self, value: &Spanned<DeValue<'_>>, what: &str, expected: &str) {
        let found = type_name(value.get_ref());
        self.error_at(value.span(), CaseCode::WrongType, format!("{what} must be {expected}, not {found}"), "");
    }

    /// A finite number; integers are allowed.
    pub(crate) fn number(&self, value: &Spanned<DeValue<'_>>, what: &str) -> Option<f64> {
        let parsed = match value.get_ref() {
            DeValue::Float(float) => float.as_str().parse().ok(),
            DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str().parse().ok(),
            DeValue::Integer(_) => integer_value(value.get_ref()).map(|integer| integer as f64),
            _ => None,
        };
        match parsed {
            Some(number) if f64::abs(number) <= LARGEST_NUMBER => Some(number),
            Some(number) if f64::is_finite(number) => {
                let message = format!("{what} must not exceed {LARGEST_NUMBER:e} in magnitude, but is {number:e}");
                self.error_at(value.span(), CaseCode::OutOfRange, message, "use other units");
                None
            }
            Some(number) => {
                self.error_at(
                    value.span(),
                    CaseCode::NotFinite,
                    format!("{what} must be a finite number, not {number}"),
                    "",
                );
                None
            }
            None => {
                self.wrong_type(value, what, "a number");
                None
            }
        }
    }

    pub(crate) fn integer(&self, value: &Spanned<DeValue<'_>>, what: &str) -> Option<i64> {
        let integer = integer_value(value.get_ref());
        match value.get_ref() {
            _ if integer.is_some() => {}
            DeValue::Integer(_) => {
                let message = format!("{what} does not fit in 64 bits");
                self.error_at(value.span(), CaseCode::OutOfRange, message, "");
            }
            DeValue::Float(_) => {
                let message = format!("{what} must be a whole number");
                let help = "write it without a decimal point or exponent";
                self.error_at(value.span(), CaseCode::WrongType, message, help);
            }
            _ => self.wrong_type(value, what, "a whole number"),
        }
        integer
    }

    pub(crate) fn string(&self, value: &Spanned<DeValue<'_>>, what: &str) -> Option<String> {
        let string = value.get_ref().as_str();
        if string.is_none() {
            self.wrong_type(value, what, "a string in quotes");
        }
        string.map(str::to_owned)
    }

    pub(crate) fn boolean(&self, value: &Spanned<DeValue<'_>>, what: &str) -> Option<bool> {
        let boolean = value.get_ref().as_bool();
        if boolean.is_none() {
            self.wrong_type(value, what, "true or false");
        }
        boolean
    }

    /// Exactly three values.
    pub(crate) fn three<T: Copy>(
        &self,
        value: &Spanned<DeValue<'_>>,
        what: &str,
        one: impl Fn(&Spanned<DeValue<'_>>, &str) -> Option<T>,
    ) -> Option<[T; 3]> {
        let Some(array) = value.get_ref().as_array() else {
            self.wrong_type(value, what, "a list of three numbers");
            return None;
        };
        // Check each entry, so that every wrong one is reported.
        let entries: Vec<Option<T>> = array.iter().map(|entry| one(entry, what)).collect();
        if entries.len() != 3 {
            let message = format!("{what} must be three numbers, not {}", entries.len());
            self.error_at(value.span(), CaseCode::WrongType, message, "one per direction: [x, y, z]");
            return None;
        }
        let complete: Option<Vec<T>> = entries.into_iter().collect();
        complete.and_then(|values| values.try_into().ok())
    }

    /// A table of the document.
    pub(crate) fn table<'a>(&'a self, value: &'a Spanned<DeValue<'a>>, path: String) -> Option<Table<'a>> {
        self.note(&path, value.span());
        match value.get_ref().as_table() {
            Some(table) => Some(Table::new(self, table, path)),
            None => {
                self.wrong_type(value, &format!("`{path}`"), "a table { … }");
                None
            }
        }
    }
}

fn integer_value(value: &DeValue<'_>) -> Option<i64> {
    let integer = value.as_integer()?;
    i64::from_str_radix(integer.as_str(), integer.radix()).ok()
}

fn type_name(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) => "a whole number",
        DeValue::Float(_) => "a number with a decimal point or exponent",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a table",
    }
}

/// "did you mean …?" if a candidate is close, otherwise the list of all.
pub(crate) fn suggestion_or_list(name: &str, candidates: &[impl AsRef<str>]) -> String {
    if let Some(near) = nearest(name, candidates) {
        return format!("did you mean `{near}`?");
    }
    let names: Vec<&str> = candidates.iter().map(AsRef::as_ref).collect();
    if names.is_empty() { String::new() } else { format!("available: {}", names.join(", ")) }
}

/// The candidate nearest to `name`, if only a few letters differ.
pub(crate) fn nearest<'c>(name: &str, candidates: &'c [impl AsRef<str>]) -> Option<&'c str> {
    let length = name.chars().count();
    // a single letter could be changed to anything
    let allowed = (length / 3).max(1).min(length.saturating_sub(1));
    candidates
        .iter()
        .map(|c| (strsim::damerau_levenshtein(&name.to_lowercase(), c.as_ref()), c.as_ref()))
        .filter(|&(distance, _)| distance <= allowed)
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, candidate)| candidate)
}

/// The first candidate that shares a word with `name`, such as `friction` for
/// `friction_coefficient`.
pub(crate) fn sharing_a_word(name: &str, candidates: &[&'static str]) -> Option<&'static str> {
    let name = name.to_lowercase();
    let words: Vec<&str> = name.split(['_', '-']).filter(|word| word.len() > 2).collect();
    candidates.iter().copied().find(|candidate| candidate.split('_').any(|word| words.contains(&word)))
}
