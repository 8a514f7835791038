//! One value of a table while it is read and checked.

use super::CaseCode;
use super::document::Table;

/// A value of a table: absent, wrong (and reported), or read.
///
/// After an error, [`Field::or`] or [`Field::required`] returns a placeholder, so that reading
/// continues and finds more errors.
#[must_use]
pub(crate) struct Field<'t, 'a, T> {
    table: &'t Table<'a>,
    key: &'static str,
    value: Option<T>,
}

impl<'t, 'a, T> Field<'t, 'a, T> {
    pub(crate) fn new(table: &'t Table<'a>, key: &'static str, value: Option<T>) -> Self {
        Self { table, key, value }
    }

    /// Reports `code` if the value does not pass the test; `message` follows the key.
    pub(crate) fn check(mut self, code: CaseCode, test: impl FnOnce(&T) -> bool, message: &str, help: &str) -> Self {
        if let Some(value) = &self.value
            && !test(value)
        {
            let message = format!("`{}` {message}", self.key);
            self.table.reader.error(&self.table.path_of(self.key), code, message, help);
            self.value = None;
        }
        self
    }

    pub(crate) fn map<U>(self, meaning: impl FnOnce(T) -> U) -> Field<'t, 'a, U> {
        Field::new(self.table, self.key, self.value.map(meaning))
    }

    /// The value, or the default if it is absent.
    pub(crate) fn or(self, default: T) -> T {
        self.value.unwrap_or(default)
    }

    /// The value if it is given.
    pub(crate) fn optional(self) -> Option<T> {
        self.value
    }

    /// The value; its absence is an error.
    pub(crate) fn required(self, stand_in: T, help: &str) -> T {
        self.table.require(self.key, help);
        self.value.unwrap_or(stand_in)
    }
}

impl<'t, 'a> Field<'t, 'a, f64> {
    pub(crate) fn positive(self, code: CaseCode) -> Self {
        self.check(code, |&value| value > 0.0, "must be greater than zero", "").check(
            CaseCode::OutOfRange,
            |&value| value >= LEAST_NUMBER,
            &format!("must be at least {LEAST_NUMBER:e}"),
            "use other units",
        )
    }
}

impl<'t, 'a> Field<'t, 'a, i64> {
    /// A whole number from `least` up to a bound that no realistic case reaches.
    pub(crate) fn count(self, code: CaseCode, least: i64) -> Field<'t, 'a, usize> {
        let message = format!("must be a whole number from {least} to {LARGEST_COUNT}");
        self.check(code, |n| (least..=LARGEST_COUNT).contains(n), &message, "").map(|n| n as usize)
    }
}

impl<'t, 'a> Field<'t, 'a, [i64; 3]> {
    /// Three counts, each with its own minimum.
    pub(crate) fn counts(self, code: CaseCode, least: [i64; 3]) -> Field<'t, 'a, [usize; 3]> {
        let message = format!("must be whole numbers, at least {least:?}");
        let in_range =
            |counts: &[i64; 3]| counts.iter().zip(least).all(|(n, least)| (least..=LARGEST_COUNT).contains(n));
        self.check(code, in_range, &message, "").map(|counts| counts.map(|n| n as usize))
    }
}

/// Products of a few numbers of at least this size, and their squares, do not underflow to zero.
const LEAST_NUMBER: f64 = 1e-50;

/// Keeps sums and products of a few counts within 64 bits, and catches typos.
const LARGEST_COUNT: i64 = 1_000_000;
