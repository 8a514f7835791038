//! Allows only one process at a time to write to a run's directory.

use std::fs::{File, TryLockError};
use std::io;
use std::path::Path;

use super::RunError;

/// The file whose lock shows that a process is writing to the directory.
pub(super) const NAME: &str = "run.lock";

/// The right to write to a run's directory, until it is dropped.
///
/// The operating system holds the lock, so it is released when the process ends, however it ends,
/// and a leftover file blocks nobody. The file is never removed, because another process might be
/// about to lock it.
#[derive(Debug)]
pub(super) struct Lock {
    _file: File,
}

impl Lock {
    /// Takes the lock of a directory.
    ///
    /// # Errors
    /// [`RunError::Locked`] if another process, or another holder in this one, has it;
    /// [`RunError::Directory`] if the operating system refuses for another reason.
    pub fn take(directory: &Path) -> Result<Self, RunError> {
        let refused = |error: io::Error| RunError::cannot_write(directory, &error);
        let file = File::options().create(true).append(true).open(directory.join(NAME)).map_err(refused)?;
        match file.try_lock() {
            Ok(()) => Ok(Self { _file: file }),
            Err(TryLockError::WouldBlock) => Err(RunError::Locked { directory: directory.to_owned() }),
            // Some file systems have no locks; on those, the user has to be careful.
            Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => Ok(Self { _file: file }),
            Err(TryLockError::Error(error)) => Err(refused(error)),
        }
    }

    /// Whether a process has the lock of a directory; false where this cannot be known.
    pub fn is_taken(directory: &Path) -> bool {
        let file = File::options().append(true).open(directory.join(NAME));
        file.is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock)))
    }
}
