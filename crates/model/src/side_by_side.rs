//! Independent tasks on several threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

/// Works on the tasks 0 to `count` − 1: this thread with `own`, beginning with the first task, and
/// one more thread for each lane. While this thread has nothing left to do, it calls `wait` every
/// few milliseconds. Returns the results in the order of the tasks.
///
/// The tasks may use the pool of threads. If this thread belongs to the pool, it works for the others
/// while it waits: otherwise, if all threads of the pool waited, none would be left to work. Test:
/// `load_cases_in_a_busy_pool`.
pub(crate) fn side_by_side<L: Send, T: Send>(
    count: usize,
    lanes: &mut [L],
    mut own: impl FnMut(usize) -> T,
    of_lane: impl Fn(usize, &mut L) -> T + Sync,
    mut wait: impl FnMut(),
) -> Vec<T> {
    let next = AtomicUsize::new(lanes.len() + 1);
    let done: Mutex<Vec<(usize, T)>> = Mutex::new(Vec::new());
    let put = |task: usize, result: T| done.lock().unwrap_or_else(PoisonError::into_inner).push((task, result));
    thread::scope(|scope| {
        let (next, put, of_lane) = (&next, &put, &of_lane);
        let work = |(number, lane): (usize, &'_ mut L)| {
            let mut task = number + 1;
            while task < count {
                put(task, of_lane(task, lane));
                task = next.fetch_add(1, Ordering::Relaxed);
            }
        };
        let threads: Vec<_> = lanes.iter_mut().enumerate().map(|lane| scope.spawn(move || work(lane))).collect();
        let mut task = 0;
        while task < count {
            put(task, own(task));
            task = next.fetch_add(1, Ordering::Relaxed);
        }
        while threads.iter().any(|thread| !thread.is_finished()) {
            if rayon::yield_now() != Some(rayon::Yield::Executed) {
                wait();
                thread::sleep(Duration::from_millis(2));
            }
        }
    });
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(task, _)| *task);
    done.into_iter().map(|(_, result)| result).collect()
}

/// Why tasks end early: the caller wants to stop, or an earlier task has failed.
pub(crate) struct Stop {
    pub requested: AtomicBool,
    /// The first task that failed.
    pub failed: AtomicUsize,
}

impl Stop {
    /// No reason yet, for `count` tasks.
    pub fn new(count: usize) -> Self {
        Self { requested: AtomicBool::new(false), failed: AtomicUsize::new(count) }
    }

    /// Whether a task should end.
    pub fn concerns(&self, task: usize) -> bool {
        self.requested.load(Ordering::Relaxed) || self.failed.load(Ordering::Relaxed) < task
    }
}
