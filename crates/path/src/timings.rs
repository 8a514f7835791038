//! The time spent in each part of an analysis, by a clock that the caller provides.

use std::ops::{Add, Sub};

/// A part of the work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Internal force and tangent of the solids.
    Solid,
    /// Mortar kinematics, contact forces and their linearization.
    Contact,
    /// Sparsity pattern, elimination order and structure of the factors.
    Analysis,
    /// Numerical factorizations, with their test.
    Factor,
    /// Verified solves, and the copy of the free part of the matrix.
    Solve,
    /// Derivatives with respect to design and previous state, in the adjoint.
    PullBack,
}

impl Phase {
    /// All phases, in the order in which they occur.
    pub const ALL: [Self; 6] = [Self::Solid, Self::Contact, Self::Analysis, Self::Factor, Self::Solve, Self::PullBack];

    /// Name in tables and records.
    pub fn name(self) -> &'static str {
        match self {
            Self::Solid => "solid",
            Self::Contact => "contact",
            Self::Analysis => "analysis",
            Self::Factor => "factor",
            Self::Solve => "solve",
            Self::PullBack => "pull_back",
        }
    }
}

/// Time by phase. Without a clock nothing is measured. Results never depend on it.
///
/// ```
/// use slipstick_path::{Phase, Timings};
/// let mut timings = Timings::with_clock(|| 7.0);   // a stopped clock
/// let begin = timings.begin();
/// timings.end(Phase::Solid, begin);
/// assert_eq!((timings.seconds(Phase::Solid), timings.calls(Phase::Solid), timings.calls(Phase::Factor)), (0.0, 1, 0));
/// ```
#[derive(Debug, Clone, Copy, Default)]
pub struct Timings {
    clock: Option<fn() -> f64>,
    seconds: [f64; Phase::ALL.len()],
    calls: [usize; Phase::ALL.len()],
}

impl Timings {
    /// Measures with `clock`: seconds from any origin, of time or of work.
    pub fn with_clock(clock: fn() -> f64) -> Self {
        Self { clock: Some(clock), ..Self::default() }
    }

    /// With the same clock, from zero.
    pub fn restarted(&self) -> Self {
        Self { clock: self.clock, ..Self::default() }
    }

    /// Reads the clock, if there is one.
    pub fn begin(&self) -> Option<f64> {
        self.clock.map(|now| now())
    }

    /// Counts the time since `begin` as spent in `phase`, in one call.
    pub fn end(&mut self, phase: Phase, begin: Option<f64>) {
        if let (Some(begin), Some(now)) = (begin, self.begin()) {
            self.seconds[phase as usize] += now - begin;
            self.calls[phase as usize] += 1;
        }
    }

    /// Time spent in a phase. \[s\]
    pub fn seconds(&self, phase: Phase) -> f64 {
        self.seconds[phase as usize]
    }

    /// How many times the phase was entered.
    pub fn calls(&self, phase: Phase) -> usize {
        self.calls[phase as usize]
    }

    /// Time spent in all phases. \[s\]
    pub fn total(&self) -> f64 {
        self.seconds.iter().sum()
    }
}

impl Add for Timings {
    type Output = Self;

    fn add(mut self, other: Self) -> Self {
        for phase in Phase::ALL {
            self.seconds[phase as usize] += other.seconds[phase as usize];
            self.calls[phase as usize] += other.calls[phase as usize];
        }
        self
    }
}

/// The time spent since an earlier reading of the same timings.
impl Sub for Timings {
    type Output = Self;

    fn sub(mut self, earlier: Self) -> Self {
        for phase in Phase::ALL {
            self.seconds[phase as usize] -= earlier.seconds[phase as usize];
            self.calls[phase as usize] -= earlier.calls[phase as usize];
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_measured_without_a_clock() {
        let mut timings = Timings::default();
        let begin = timings.begin();
        timings.end(Phase::Solve, begin);
        assert_eq!((begin, timings.calls(Phase::Solve), timings.total()), (None, 0, 0.0));
    }

    /// By hand, with a clock that advances by a second at each reading: each call takes one second.
    #[test]
    fn seconds_are_those_of_the_clock() {
        thread_local!(static NOW: std::cell::Cell<f64> = const { std::cell::Cell::new(40.0) });
        let mut timings = Timings::with_clock(|| NOW.replace(NOW.get() + 1.0));
        for phase in [Phase::Solid, Phase::Factor, Phase::Solid] {
            let begin = timings.begin();
            timings.end(phase, begin);
        }
        let seconds = |timings: &Timings| Phase::ALL.map(|p| timings.seconds(p));
        assert_eq!((seconds(&timings), timings.total()), ([2.0, 0.0, 0.0, 1.0, 0.0, 0.0], 3.0));
        assert_eq!(seconds(&(timings + timings)), [4.0, 0.0, 0.0, 2.0, 0.0, 0.0]);
        assert_eq!(seconds(&(timings + timings - timings)), [2.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    }

    #[test]
    fn sums_and_differences_are_by_phase() {
        let mut timings = Timings::with_clock(|| 7.0);
        for phase in [Phase::Solid, Phase::Factor, Phase::Solid] {
            let begin = timings.begin();
            timings.end(phase, begin);
        }
        let twice = timings + timings;
        assert_eq!(Phase::ALL.map(|p| twice.calls(p)), [4, 0, 0, 2, 0, 0]);
        let back = twice - timings;
        assert_eq!(Phase::ALL.map(|p| back.calls(p)), Phase::ALL.map(|p| timings.calls(p)));
        assert!(back.total() >= 0.0 && back.seconds(Phase::Contact) == 0.0);
    }
}
