//! Errors of writing results.

use std::io;
use std::path::{Path, PathBuf};

/// An error of writing results; the message contains the file or field, and the cure.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The operating system reports an error.
    #[error("cannot {action} {}: {source}", .path.display())]
    Io {
        /// `write`, `read`, …
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// A file that was not written by this program, or is incomplete.
    #[error("{} {reason}", .path.display())]
    NotRead {
        /// The file.
        path: PathBuf,
        /// The difference.
        reason: String,
    },
    /// A field whose number of values does not match the mesh.
    #[error("field `{name}` has {found} values; {components} components on {items} {what} need {}", components * items)]
    Length {
        /// The field.
        name: String,
        /// Components per item.
        components: usize,
        /// `points` or `cells`.
        what: &'static str,
        /// Their number in the mesh.
        items: usize,
        /// The number of values that were given.
        found: usize,
    },
    /// Two fields with the same name on the points or on the cells.
    #[error("there is already a field `{name}` on the {what}: use a different name")]
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
        /// Number of nodes.
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
    /// A row that does not match the table's header.
    #[error("a row of {found} values does not match the {expected} columns of {}", .path.display())]
    Columns {
        /// The table.
        path: PathBuf,
        /// Columns of the header.
        expected: usize,
        /// Values of the row.
        found: usize,
    },
    /// A file of several steps that do not belong together, or of too few or too many.
    #[error("{} {reason}", .path.display())]
    Series {
        /// The file.
        path: PathBuf,
        /// The difference.
        reason: String,
    },
    /// An existing table that cannot be continued.
    #[error("{} {reason}", .path.display())]
    OtherTable {
        /// The table.
        path: PathBuf,
        /// The difference.
        reason: String,
    },
}

impl OutputError {
    /// For `map_err`: the action and the file.
    pub(crate) fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { action, path, source }
    }

    /// What helps against an error of the operating system.
    pub fn cure(&self) -> String {
        match self {
            Self::Io { action: "write", path, source } if source.kind() == io::ErrorKind::NotFound => {
                let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
                let folder = folder.unwrap_or(Path::new(".")).display();
                format!("create the folder {folder} first, or name a file in an existing folder")
            }
            Self::Io { source, .. } if source.kind() == io::ErrorKind::NotFound => {
                "check the name, or restore the file".into()
            }
            _ => "check the permission to write there and the free space".into(),
        }
    }
}
