//! What can go wrong when results are written.

use std::io;
use std::path::{Path, PathBuf};

/// An error of writing results: names the file or field, and the cure.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The operating system refuses.
    #[error("cannot {action} {}: {source}", .path.display())]
    Io {
        /// `write`, `read`, …
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A file that is not one that was written here, or only a part of it.
    #[error("{} {reason}", .path.display())]
    NotRead {
        /// The file.
        path: PathBuf,
        /// In what it differs.
        reason: String,
    },
    /// A field whose number of values does not fit the mesh.
    #[error("field `{name}` has {found} values; {components} components on {items} {what} need {}", components * items)]
    Length {
        /// The field.
        name: String,
        /// Components per item.
        components: usize,
        /// `points` or `cells`.
        what: &'static str,
        /// How many of them the mesh has.
        items: usize,
        /// How many values were given.
        found: usize,
    },
    /// Two fields of one name on the points or on the cells.
    #[error("there is a field `{name}` on the {what} already: give it another name")]
    DuplicateField {
        /// The field.
        name: String,
        /// `points` or `cells`.
        what: &'static str,
    },
    /// A cell with a node that does not exist.
    #[error("cell {element} has node {node}, but there are {nodes} nodes (numbers count from 0)")]
    NodeOutOfRange {
        /// The cell.
        element: usize,
        /// Its node.
        node: u32,
        /// How many nodes there are.
        nodes: usize,
    },
    /// A value that is infinite or not a number.
    #[error("`{name}` is {value} at entry {entry} (counted from 0): results must be finite")]
    NotFinite {
        /// The field or column.
        name: String,
        /// Position in its values.
        entry: usize,
        /// The value.
        value: f64,
    },
    /// A row that does not fit the table's header.
    #[error("a row of {found} values does not fit the {expected} columns of {}", .path.display())]
    Columns {
        /// The table.
        path: PathBuf,
        /// Columns of the header.
        expected: usize,
        /// Values of the row.
        found: usize,
    },
    /// An existing table that is not the one to go on with.
    #[error("{} {reason}", .path.display())]
    OtherTable {
        /// The table.
        path: PathBuf,
        /// In what it differs.
        reason: String,
    },
}

impl OutputError {
    /// For `map_err`: what was done to which file.
    pub(super) fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { action, path, source }
    }
}
