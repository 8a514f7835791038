//! MPI and PETSc in this process.

use crate::error::PetscError;
use crate::ffi::{self, RawSession};
use crate::rehearsal::rehearse;
use slipstick_linalg::{Ranks, Traffic, largest_or_nan};
use std::ffi::{CStr, CString, c_char, c_int};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

/// MPI and PETSc, from their start until the last copy of this value, and everything made with it,
/// is dropped.
///
/// A process can have only one session in its lifetime. It provides the [`Ranks`] of a parallel
/// run; without `mpirun`, there is one rank.
#[derive(Debug, Clone)]
pub struct Session(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    raw: Raw,
    rank: usize,
    size: usize,
    size_here: usize,
    calls_made: AtomicU64,
    bytes_sent: AtomicU64,
}

impl Inner {
    /// Counts a call and the bytes that this rank has sent to others in it.
    fn count(&self, bytes: usize) {
        self.calls_made.fetch_add(1, Ordering::Relaxed);
        self.bytes_sent.fetch_add(bytes as u64, Ordering::Relaxed);
    }
}

/// The pointer of the shim, which may be used only while holding the lock.
#[derive(Debug)]
struct Raw(Mutex<*mut RawSession>);

// SAFETY: MPI is initialized with MPI_THREAD_SERIALIZED: any thread may call it, one at a time,
// which the lock ensures. PETSc keeps no per-thread state.
unsafe impl Send for Raw {}
// SAFETY: as above.
unsafe impl Sync for Raw {}

/// The right to call the shim.
pub(crate) type Calls<'a> = MutexGuard<'a, *mut RawSession>;

impl Session {
    /// Starts PETSc, and MPI unless the process has already started it. PETSc reads no file and
    /// handles no signal.
    ///
    /// # Errors
    /// [`PetscError::Start`], also for a second start.
    pub fn start() -> Result<Self, PetscError> {
        let mut raw = std::ptr::null_mut();
        // SAFETY: `raw` outlives the call; on success it is a session that `Drop` ends.
        let code = unsafe { ffi::ss_start(&mut raw) };
        if code != 0 || raw.is_null() {
            return Err(PetscError::Start { code });
        }
        // SAFETY: the session was just made.
        let (rank, size, here) = unsafe { (ffi::ss_rank(raw), ffi::ss_size(raw), ffi::ss_size_here(raw)) };
        let number = |value: i32| usize::try_from(value).unwrap_or(0);
        let (rank, size, size_here) = (number(rank), number(size).max(1), number(here).max(1));
        let (calls_made, bytes_sent) = (AtomicU64::new(0), AtomicU64::new(0));
        Ok(Self(Arc::new(Inner { raw: Raw(Mutex::new(raw)), rank, size, size_here, calls_made, bytes_sent })))
    }

    /// Number of ranks on the machine of this rank.
    pub fn size_here(&self) -> usize {
        self.0.size_here
    }

    /// Sets options of the linear solver as PETSc writes them, without the solver's prefix:
    /// `-mat_mumps_icntl_14 60`.
    ///
    /// # Errors
    /// [`PetscError`] if they cannot be read.
    pub fn set_options(&self, options: &str) -> Result<(), PetscError> {
        let options = CString::new(options).map_err(|_| PetscError::Options)?;
        let calls = self.calls();
        // SAFETY: a live session and a string that outlives the call.
        let code = unsafe { ffi::ss_options(*calls, options.as_ptr()) };
        check(&calls, "reading options", code)
    }

    /// Sets a user's options and solves a small system with them, so that errors in them are found
    /// at once.
    ///
    /// # Errors
    /// [`PetscError`] if they cannot be read, do not solve the system, or are not used by the
    /// solver.
    pub fn try_options(&self, options: &str, contact_zone: bool) -> Result<(), PetscError> {
        self.set_options(options)?;
        rehearse(self, options, contact_zone)
    }

    /// The names, with a dash, of the given options that nothing has used on any rank.
    pub(crate) fn unused(&self, options: &str) -> Result<Vec<String>, PetscError> {
        let mut text = [0 as c_char; 4096];
        let calls = self.calls();
        // SAFETY: a live session; the shim writes a terminated string of at most this many
        // characters.
        let code = unsafe { ffi::ss_unused(*calls, text.as_mut_ptr(), text.len() as i64) };
        let checked = check(&calls, "looking for unused options", code);
        drop(calls);
        if self.any(checked.is_err()) {
            return checked.map(|()| Vec::new());
        }
        // SAFETY: the shim has ended it within its length.
        let here = unsafe { CStr::from_ptr(text.as_ptr()) }.to_string_lossy();
        // options of a system that only some ranks solve are used only by those
        let all: Vec<String> = self.gather(here.as_bytes()).iter().map(|t| String::from_utf8_lossy(t).into()).collect();
        let everywhere = |name: &&str| all.iter().all(|text| text.lines().any(|line| line == *name));
        let given = |name: &&str| options.split_whitespace().any(|word| word.strip_prefix('-') == Some(name));
        Ok(here.lines().filter(given).filter(everywhere).map(|name| format!("-{name}")).collect())
    }

    /// Whether all ranks call this within `patience`; at the end of a program, whether they all
    /// reach it.
    pub fn meet(&self, patience: Duration) -> bool {
        let calls = self.calls();
        // SAFETY: a live session.
        self.0.size == 1 || unsafe { ffi::ss_meet(*calls, patience.as_secs_f64()) != 0 }
    }

    /// Ends the program on all ranks at once, wherever they are, with this exit code.
    pub fn abort(&self, code: i32) -> ! {
        let calls = self.calls();
        // SAFETY: a live session.
        unsafe { ffi::ss_abort(*calls, code) };
        std::process::exit(code)
    }

    /// The right to call the shim.
    pub(crate) fn calls(&self) -> Calls<'_> {
        self.0.raw.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

/// Converts an error code of the shim.
pub(crate) fn check(calls: &Calls<'_>, call: &'static str, code: c_int) -> Result<(), PetscError> {
    if code == 0 {
        return Ok(());
    }
    let mut text = [0 as c_char; 1024];
    // SAFETY: a live session; the shim writes a terminated string of at most this many characters.
    let message = unsafe {
        ffi::ss_message(**calls, text.as_mut_ptr(), text.len() as i64);
        CStr::from_ptr(text.as_ptr()).to_string_lossy().into_owned()
    };
    Err(PetscError::Call { call, code, message })
}

impl Drop for Inner {
    fn drop(&mut self) {
        let raw = self.raw.0.get_mut().unwrap_or_else(|poisoned| poisoned.into_inner());
        // SAFETY: this is the last owner, and no object made by the session remains.
        unsafe { ffi::ss_end(*raw) };
    }
}

impl Ranks for Session {
    fn rank(&self) -> usize {
        self.0.rank
    }

    fn size(&self) -> usize {
        self.0.size
    }

    fn sum(&self, values: &mut [f64]) {
        let calls = self.calls();
        // SAFETY: a live session; the shim reads and writes this many numbers.
        unsafe { ffi::ss_sum(*calls, values.as_mut_ptr(), values.len() as i64) };
        // this rank's terms of the others' sums are sent first, then its own sums to all others
        self.0.count(2 * 8 * values.len() * (self.0.size - 1) / self.0.size);
    }

    fn any(&self, here: bool) -> bool {
        let calls = self.calls();
        // SAFETY: a live session.
        let any = unsafe { ffi::ss_any(*calls, i32::from(here)) != 0 };
        self.0.count(4 * usize::from(self.0.size > 1));
        any
    }

    fn gather(&self, message: &[u8]) -> Vec<Vec<u8>> {
        let mut lengths = vec![0_i64; self.0.size];
        let calls = self.calls();
        // SAFETY: a live session; there is a place for the length of every rank.
        unsafe { ffi::ss_gather_lengths(*calls, message.len() as i64, lengths.as_mut_ptr()) };
        let mut all = vec![0_u8; lengths.iter().sum::<i64>() as usize];
        // SAFETY: a live session; `message` has the stated length, and `all` has room for all
        // messages.
        unsafe { ffi::ss_gather(*calls, message.as_ptr().cast(), lengths.as_ptr(), all.as_mut_ptr().cast()) };
        self.0.count((message.len() + 8) * (self.0.size - 1));
        let mut rest = all.as_slice();
        lengths
            .iter()
            .map(|&length| {
                let (here, tail) = rest.split_at(length as usize);
                rest = tail;
                here.to_vec()
            })
            .collect()
    }

    fn exchange(&self, values: &[f64], to: &[usize], from: &[usize]) -> Vec<f64> {
        let size = self.0.size;
        let fits = to.len() == size && from.len() == size && values.len() == to.iter().sum::<usize>();
        assert!(fits, "there is a count of values to and from every rank");
        let mut all = vec![0.0; from.iter().sum()];
        let [to, from] = [to, from].map(|counts| counts.iter().map(|&count| count as i64).collect::<Vec<i64>>());
        let calls = self.calls();
        // SAFETY: a live session; both lists have a count for every rank, and both arrays have as
        // many numbers as these state.
        unsafe { ffi::ss_exchange(*calls, values.as_ptr(), to.as_ptr(), all.as_mut_ptr(), from.as_ptr()) };
        self.0.count(8 * values.len());
        all
    }

    fn join(&self, values: &[f64]) -> Vec<f64> {
        let mut lengths = vec![0_i64; self.0.size];
        let calls = self.calls();
        // SAFETY: a live session; there is a place for the length of every rank.
        unsafe { ffi::ss_gather_lengths(*calls, size_of_val(values) as i64, lengths.as_mut_ptr()) };
        let mut all = vec![0.0_f64; (lengths.iter().sum::<i64>() as usize).div_ceil(size_of::<f64>())];
        // SAFETY: a live session; `values` has the stated number of bytes, `all` has room for all
        // of them, and any bytes form a valid number.
        unsafe { ffi::ss_gather(*calls, values.as_ptr().cast(), lengths.as_ptr(), all.as_mut_ptr().cast()) };
        self.0.count((size_of_val(values) + 8) * (self.0.size - 1));
        all
    }

    fn largest(&self, here: f64) -> f64 {
        let mut all = vec![0_i64; self.0.size];
        let calls = self.calls();
        // SAFETY: a live session; there is a place for the number of every rank.
        unsafe { ffi::ss_gather_lengths(*calls, here.to_bits() as i64, all.as_mut_ptr()) };
        self.0.count(8 * (self.0.size - 1));
        largest_or_nan(all.into_iter().map(|bits| f64::from_bits(bits as u64)))
    }

    fn traffic(&self) -> Traffic {
        let read = |count: &AtomicU64| count.load(Ordering::Relaxed);
        Traffic { calls: read(&self.0.calls_made), bytes: read(&self.0.bytes_sent) }
    }
}
