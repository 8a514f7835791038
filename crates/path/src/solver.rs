//! A problem with what solving it takes.

use crate::linear::LinearSystem;
use crate::problem::StepProblem;

/// A problem, the solver of its linear systems and the buffers that both lend to the march and the sweep.
pub struct Solver<'a, P: StepProblem> {
    /// The problem.
    pub problem: &'a P,
    /// The linear systems.
    pub linear: &'a mut LinearSystem,
    /// The problem's buffers.
    pub workspace: &'a mut P::Workspace,
}
