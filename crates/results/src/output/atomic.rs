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
    let temporary = temporary_name(path);
    let result = write_and_sync(&temporary, write).and_then(|()| fs::rename(&temporary, path));
    if result.is_err() {
        // Report the first error; if the temporary file cannot be removed, that is a consequence.
        let _ = fs::remove_file(&temporary);
    }
    result.map_err(OutputError::io("write", path))
}

fn write_and_sync(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut writer = BufWriter::with_capacity(1 << 16, File::create(path)?);
    write(&mut writer)?;
    writer.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
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
