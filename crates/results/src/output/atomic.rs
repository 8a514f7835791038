//! Atomic writing of files: a file appears complete or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::OutputError;

/// Writes a temporary file in the same folder and renames it when it is complete and on disk.
///
/// A reader, even one that reads during the writing or after a crash, finds the old file or the new
/// one, never a part. Two simultaneous writers of the same file must be different processes.
///
/// # Errors
///
/// [`OutputError::Io`]; the temporary file is then removed.
pub fn write_atomically(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), OutputError> {
    let (target, file) = AtomicFile::create(path)?;
    let mut writer = BufWriter::with_capacity(1 << 16, file);
    let written = write(&mut writer).and_then(|()| writer.into_inner().map_err(io::IntoInnerError::into_error));
    target.complete(&written.map_err(OutputError::io("write", path))?)
}

/// A file that is written over a longer time and appears under its name when it is complete
/// ([`write_atomically`]). Dropped before, it leaves nothing behind.
#[derive(Debug)]
pub(super) struct AtomicFile {
    path: PathBuf,
    temporary: PathBuf,
    complete: bool,
}

impl AtomicFile {
    /// The temporary file, open for writing.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub(super) fn create(path: &Path) -> Result<(Self, File), OutputError> {
        let target = Self { path: path.to_owned(), temporary: temporary_name(path), complete: false };
        let file = File::create(&target.temporary).map_err(OutputError::io("write", path))?;
        Ok((target, file))
    }

    /// The final name.
    #[cfg(feature = "vtkhdf")]
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Waits until the file is on disk and gives it its name.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub(super) fn complete(mut self, file: &File) -> Result<(), OutputError> {
        let renamed = file.sync_all().and_then(|()| fs::rename(&self.temporary, &self.path));
        self.complete = renamed.is_ok();
        renamed.map_err(OutputError::io("write", &self.path))
    }
}

impl Drop for AtomicFile {
    fn drop(&mut self) {
        if !self.complete {
            // Where this fails, an error of writing was reported before.
            let _ = fs::remove_file(&self.temporary);
        }
    }
}

/// The final name of a temporary file, if this is one; a process that was killed leaves such files
/// behind.
pub(crate) fn whole_name(temporary: &str) -> Option<&str> {
    let (name, process) = temporary.strip_suffix(".tmp")?.rsplit_once('.')?;
    (!name.is_empty() && !process.is_empty() && process.bytes().all(|byte| byte.is_ascii_digit())).then_some(name)
}

fn temporary_name(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.tmp", std::process::id()));
    path.with_file_name(name)
}
