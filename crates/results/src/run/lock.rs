//! Allows only one process at a time to write to a run's directory.

use std::fs::{File, TryLockError};
use std::io;
use std::path::Path;
use std::time::Duration;

use super::RunError;

/// The file whose lock shows that a process is writing to the directory.
pub(super) const NAME: &str = "run.lock";

/// How long, and how often, a lock is tried: [`Lock::is_taken`] of another process holds it for a moment.
const TRIES: usize = 20;
const PAUSE: Duration = Duration::from_millis(5);

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
    ///
    /// Test: `one_who_only_looks_keeps_nobody_out`.
    pub fn take(directory: &Path) -> Result<Self, RunError> {
        let refused = |error: io::Error| RunError::cannot_write(directory, &error);
        let file = File::options().create(true).append(true).open(directory.join(NAME)).map_err(refused)?;
        let mut tried = file.try_lock();
        for _ in 1..TRIES {
            if !matches!(tried, Err(TryLockError::WouldBlock)) {
                break;
            }
            std::thread::sleep(PAUSE);
            tried = file.try_lock();
        }
        match tried {
            Ok(()) => Ok(Self { _file: file }),
            Err(TryLockError::WouldBlock) => Err(RunError::Locked { directory: directory.to_owned() }),
            // Some file systems have no locks; on those, the user has to be careful.
            Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => Ok(Self { _file: file }),
            Err(TryLockError::Error(error)) => Err(refused(error)),
        }
    }

    /// Whether a process has the lock of a directory; false where this cannot be known.
    pub fn is_taken(directory: &Path) -> bool {
        // a shared lock takes a file that is open for reading where locks are emulated (NFS)
        let file = File::options().read(true).append(true).open(directory.join(NAME));
        // those who only look share it
        file.is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicBool, Ordering};

    #[test]
    fn one_who_only_looks_keeps_nobody_out() {
        let place = tempfile::tempdir().expect("a folder");
        drop(Lock::take(place.path()).expect("free"));
        let ended = AtomicBool::new(false);
        std::thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| {
                    while !ended.load(Ordering::SeqCst) {
                        Lock::is_taken(place.path());
                        std::thread::sleep(Duration::from_micros(200));
                    }
                });
            }
            let taken = (0..100).filter(|_| Lock::take(place.path()).is_ok()).count();
            ended.store(true, Ordering::SeqCst);
            assert_eq!(taken, 100);
        });
        let held = Lock::take(place.path()).expect("free");
        assert!(Lock::is_taken(place.path()));
        assert!(matches!(Lock::take(place.path()), Err(RunError::Locked { .. })));
        drop(held);
        assert!(!Lock::is_taken(place.path()));
    }
}
