//! ParaView's collection of files over time.

use std::fmt::Write as _;
use std::path::Path;

use super::{OutputError, write_atomically, xml};

/// A PVD collection: files with their times.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pvd {
    entries: Vec<(f64, String)>,
}

impl Pvd {
    /// Adds a file, with its path relative to the collection and `/` between folders. A time may
    /// have several files.
    ///
    /// # Errors
    ///
    /// [`OutputError::NotFinite`] for a time that is not finite.
    pub fn add(&mut self, time: f64, file: impl Into<String>) -> Result<(), OutputError> {
        if !time.is_finite() {
            let (name, entry) = ("time".to_owned(), self.entries.len());
            return Err(OutputError::NotFinite { name, entry, value: time });
        }
        self.entries.push((time, file.into()));
        Ok(())
    }

    /// The times and files, in the order in which they were added.
    pub fn entries(&self) -> &[(f64, String)] {
        &self.entries
    }

    /// The collection as text; times are written so that they are read back exactly.
    pub fn to_xml(&self) -> String {
        let mut text = String::from(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" \
             byte_order=\"LittleEndian\">\n<Collection>\n",
        );
        let mut part = 0;
        for (i, (time, file)) in self.entries.iter().enumerate() {
            let repeated = i > 0 && self.entries[i - 1].0 == *time;
            part = if repeated { part + 1 } else { 0 };
            let file = xml(file);
            // Writing to a string cannot fail.
            let _ = writeln!(text, "<DataSet timestep=\"{time:?}\" group=\"\" part=\"{part}\" file=\"{file}\"/>");
        }
        text.push_str("</Collection>\n</VTKFile>\n");
        text
    }

    /// Writes the collection.
    ///
    /// # Errors
    ///
    /// [`OutputError::Io`].
    pub fn save(&self, path: &Path) -> Result<(), OutputError> {
        write_atomically(path, |writer| writer.write_all(self.to_xml().as_bytes()))
    }
}
