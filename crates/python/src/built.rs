//! A built problem, with which one thread at a time computes.

use std::ops::{Deref, DerefMut};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread::ThreadId;
use std::time::{Duration, Instant};

use pyo3::prelude::*;
use slipstick::build::Problem;
use slipstick::case::Resolved;
use slipstick::design::quantity::Quantity;

use crate::errors::Error;
use crate::interrupt::PAUSE;

/// The part of a problem that computations modify. No result depends on earlier calls.
pub(crate) struct Built {
    problem: Mutex<Problem>,
    /// The thread that computes.
    owner: Mutex<Option<ThreadId>>,
    /// The quantities that were added to those of the case.
    added: Mutex<Vec<Arc<dyn Quantity>>>,
    pub(crate) case: Arc<Resolved>,
}

/// A problem that this thread computes with.
pub(crate) struct Held<'a> {
    problem: MutexGuard<'a, Problem>,
    owner: &'a Mutex<Option<ThreadId>>,
}

impl Built {
    /// The problem of a case.
    pub(crate) fn new(problem: Problem, case: Arc<Resolved>) -> Self {
        Self { problem: Mutex::new(problem), owner: Mutex::new(None), added: Mutex::default(), case }
    }

    /// The quantities that were added to those of the case.
    pub(crate) fn added(&self) -> MutexGuard<'_, Vec<Arc<dyn Quantity>>> {
        self.added.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The problem, once no other thread computes with it. A thread that waits here must not hold
    /// the interpreter, which the computing one needs.
    ///
    /// # Errors
    /// If this thread computes with it already, in a callback, or if an earlier call has panicked;
    /// [`Error::Python`] for Ctrl-C.
    pub(crate) fn lock(&self) -> Result<Held<'_>, Error> {
        let this = std::thread::current().id();
        let mut asked = Instant::now();
        loop {
            let problem = match self.problem.try_lock() {
                Ok(problem) => problem,
                // a panic may leave settings of the failed call behind
                Err(TryLockError::Poisoned(_)) => {
                    let cure = "build the problem again from its case";
                    return Err(Error::input("an earlier call has failed inside slipstick", cure));
                }
                Err(TryLockError::WouldBlock) if *owner(&self.owner) == Some(this) => {
                    let cure = "build another problem from the case, and use that one";
                    return Err(Error::input("the problem is computing, and its callbacks cannot use it", cure));
                }
                Err(TryLockError::WouldBlock) => {
                    std::thread::sleep(Duration::from_millis(2));
                    if asked.elapsed() >= PAUSE {
                        Python::attach(|py| py.check_signals())?;
                        asked = Instant::now();
                    }
                    continue;
                }
            };
            *owner(&self.owner) = Some(this);
            return Ok(Held { problem, owner: &self.owner });
        }
    }
}

fn owner(of: &Mutex<Option<ThreadId>>) -> MutexGuard<'_, Option<ThreadId>> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Drop for Held<'_> {
    fn drop(&mut self) {
        *owner(self.owner) = None;
    }
}

impl Deref for Held<'_> {
    type Target = Problem;

    fn deref(&self) -> &Problem {
        &self.problem
    }
}

impl DerefMut for Held<'_> {
    fn deref_mut(&mut self) -> &mut Problem {
        &mut self.problem
    }
}
