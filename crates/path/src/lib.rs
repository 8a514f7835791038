//! The load path and its adjoint, for any enforcement method.
//!
//! A load step n has unknowns y_n (displacements, and multipliers if the method has them) and an
//! explicit, node-local history h_n:
//!
//! ```text
//! F_n(y_n; y_{n−1}, h_{n−1}, φ) = 0,        h_n = G_n(y_n; y_{n−1}, h_{n−1})
//! ```
//!
//! [`march()`] solves the steps forward by Newton's method (with Uzawa's iteration around it if the
//! problem requests it). It starts from a predicted state, or from the last state with the
//! prescribed increment applied through the tangent; after a failure it cuts back and retries.
//! [`sweep()`] runs backward through the same states, accepted sub-steps included:
//!
//! ```text
//! for n = N … 1
//!   η_n = ∂θ/∂h_n + (∂F_{n+1}/∂h_n)ᵀ λ_{n+1} + (∂G_{n+1}/∂h_n)ᵀ η_{n+1}
//!   K_nᵀ λ_n = −[ ∂θ/∂y_n + (∂G_n/∂y_n)ᵀ η_n + (∂F_{n+1}/∂y_n)ᵀ λ_{n+1} + (∂G_{n+1}/∂y_n)ᵀ η_{n+1} ]
//!   dθ/dφ += (∂F_n/∂φ)ᵀ λ_n
//!   dθ/dp += (∂F_n/∂p)ᵀ λ_n + (∂G_n/∂p)ᵀ η_n + (∂ŷ_n/∂p)ᵀ dθ/dŷ_n      ŷ: prescribed unknowns
//! ```
//!
//! Prescribed unknowns are removed after transposition: their λ is zero. Paper: §3, (53)–(61), in
//! the form that is exact for every method. The crate does not depend on any enforcement method,
//! does no I/O and reads no clock except one that the caller provides ([`Timings`]).

mod attempt;
mod continuation;
pub mod differences;
mod divided;
pub mod equations;
mod failure;
mod free;
mod history;
mod inputs;
mod iterations;
mod ladder;
mod linear;
mod march;
mod newton;
#[cfg(test)]
mod pressed;
mod problem;
mod reuse;
pub mod slider;
mod solver;
#[cfg(test)]
mod spring;
mod start;
mod store;
mod sweep;
#[cfg(test)]
mod tests;
mod thinning;
mod time;
mod timings;
mod unknowns;
mod uzawa;

pub use failure::{StateError, StepFailure, StepFailureKind};
pub use history::{Evaluator, HistoryUpdate};
pub use inputs::Inputs;
pub use iterations::{IterationRecord, StepReport, still_falls};
pub use ladder::{FailedAttempt, Rung};
pub use linear::{Interrupt, LinearSystem, SolveCounts, SolveTolerance};
pub use march::{
    LoadPath, MOST_CUTBACKS, MarchEvent, MarchFailure, MarchObserver, MarchOptions, Remedy, Silent, march,
};
pub use newton::{NewtonOptions, Tolerance, Tolerances};
pub use problem::{
    Adjoint, Attempt, DependentUnknowns, Evaluated, HeldMotions, HoldFreeMotions, Iteration, Method, Scales,
    StepProblem, UzawaOptions, Wanted,
};
pub use slipstick_status::ContactStatus;
pub use solver::Solver;
pub use start::{Guide, GuideError, StartValues};
pub use store::{Path, PathState};
pub use sweep::{Explicit, Observed, PathGradient, PathResponses, SweepError, SweepOptions, sweep, sweep_states};
pub use time::{LoadTime, Span};
pub use timings::{Phase, Timings};
pub use unknowns::{Held, StepState, Unknowns};
