//! Tables that are written row by row.

use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use super::{OutputError, write_atomically};
use slipstick_model::optimize::Entry;

/// A value of a table.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// A number, written with enough digits to be read back exactly.
    Float(f64),
    /// A whole number.
    Integer(i64),
    /// Text; quoted if necessary.
    Text(String),
    /// An empty cell.
    Empty,
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Float(value)
    }
}

impl From<usize> for Cell {
    /// Numbers above `i64::MAX` become text.
    fn from(value: usize) -> Self {
        i64::try_from(value).map_or_else(|_| Self::Text(value.to_string()), Self::Integer)
    }
}

impl From<&str> for Cell {
    fn from(value: &str) -> Self {
        Self::Text(value.to_owned())
    }
}

impl From<Entry> for Cell {
    fn from(entry: Entry) -> Self {
        match entry {
            Entry::Count(count) => count.into(),
            Entry::Number(number) => number.into(),
            Entry::Missing => Self::Empty,
        }
    }
}

impl<T: Into<Self>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Empty, Into::into)
    }
}

/// A CSV table (RFC 4180, lines end with a line feed) that is being written.
///
/// Each row is written at once, so that a simultaneous reader finds complete lines.
#[derive(Debug)]
pub struct Csv {
    path: PathBuf,
    columns: Vec<String>,
    file: File,
}

impl Csv {
    /// A new table with this header; an existing file is replaced.
    ///
    /// # Errors
    ///
    /// [`OutputError::Io`].
    pub fn create(path: &Path, columns: &[&str]) -> Result<Self, OutputError> {
        let header = header(columns);
        write_atomically(path, |writer| writer.write_all(header.as_bytes()))?;
        Self::open(path, columns)
    }

    /// Continues a table after its first `rows` rows; later rows, and an incomplete last line, are
    /// dropped.
    ///
    /// A run that continues from an earlier state thus replaces the rows that were written after
    /// that state. If the file does not exist and `rows` is 0, it is created, as by
    /// [`Csv::create`].
    ///
    /// # Errors
    ///
    /// [`OutputError::OtherTable`] if the header differs or rows are missing; [`OutputError::Io`].
    pub fn resume(path: &Path, columns: &[&str], rows: usize) -> Result<Self, OutputError> {
        if rows == 0 && !path.exists() {
            return Self::create(path, columns);
        }
        let other = |reason: String| OutputError::OtherTable { path: path.to_owned(), reason };
        if !path.exists() {
            return Err(other(format!("is missing; it should have {rows} rows")));
        }
        let bytes = fs::read(path).map_err(OutputError::io("read", path))?;
        let text = String::from_utf8(bytes).map_err(|_| other("is not text".to_owned()))?;
        let header = header(columns);
        let Some(body) = text.strip_prefix(&header) else {
            return Err(other("has different columns".to_owned()));
        };
        let end = row_ends(body).nth(rows.wrapping_sub(1));
        let kept = match (rows, end) {
            (0, _) => "",
            (_, Some(end)) => &body[..end],
            (_, None) => {
                let found = row_ends(body).count();
                return Err(other(format!("has {found} complete rows, not {rows}")));
            }
        };
        if kept.len() < body.len() {
            write_atomically(path, |writer| {
                writer.write_all(header.as_bytes())?;
                writer.write_all(kept.as_bytes())
            })?;
        }
        Self::open(path, columns)
    }

    fn open(path: &Path, columns: &[&str]) -> Result<Self, OutputError> {
        let file = OpenOptions::new().append(true).open(path).map_err(OutputError::io("open", path))?;
        let columns = columns.iter().map(|&column| column.to_owned()).collect();
        Ok(Self { path: path.to_owned(), columns, file })
    }

    /// Appends a row.
    ///
    /// # Errors
    ///
    /// [`OutputError::Columns`], [`OutputError::NotFinite`] (its entry is the column),
    /// [`OutputError::Io`]; nothing is written in the first two cases.
    pub fn row(&mut self, cells: &[Cell]) -> Result<(), OutputError> {
        let line = self.line(cells)?;
        self.file.write_all(line.as_bytes()).map_err(OutputError::io("write", &self.path))
    }

    /// A row as written to the file, with its line feed.
    ///
    /// # Errors
    ///
    /// [`OutputError::Columns`], [`OutputError::NotFinite`].
    pub(crate) fn line(&self, cells: &[Cell]) -> Result<String, OutputError> {
        if cells.len() != self.columns.len() {
            let (expected, found) = (self.columns.len(), cells.len());
            return Err(OutputError::Columns { path: self.path.clone(), expected, found });
        }
        let mut line = String::new();
        for (entry, cell) in cells.iter().enumerate() {
            if entry > 0 {
                line.push(',');
            }
            match cell {
                Cell::Float(value) if !value.is_finite() => {
                    let name = self.columns[entry].clone();
                    return Err(OutputError::NotFinite { name, entry, value: *value });
                }
                // The debug format is the shortest one that reads back as the same number; it uses
                // an exponent if plain digits would be long.
                Cell::Float(value) => line.push_str(&format!("{value:?}")),
                Cell::Integer(value) => line.push_str(&value.to_string()),
                Cell::Text(text) => line.push_str(&quoted(text)),
                Cell::Empty => {}
            }
        }
        line.push('\n');
        Ok(line)
    }
}

fn header(columns: &[&str]) -> String {
    let names: Vec<String> = columns.iter().map(|name| quoted(name)).collect();
    names.join(",") + "\n"
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

/// Ends of the rows: after each line feed outside quotes.
fn row_ends(text: &str) -> impl Iterator<Item = usize> {
    let mut quoted = false;
    text.bytes().enumerate().filter_map(move |(i, byte)| {
        quoted ^= byte == b'"';
        (byte == b'\n' && !quoted).then_some(i + 1)
    })
}
