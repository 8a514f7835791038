//! A problem with its solver and buffers.

use crate::linear::LinearSystem;
use crate::problem::StepProblem;

/// A problem, the solver of its linear systems and the buffers that the march and the sweep use.
pub struct Solver<'a, P: StepProblem> {
    /// The problem.
    pub problem: &'a P,
    /// The linear systems.
    pub linear: &'a mut LinearSystem,
    /// The problem's buffers.
    pub workspace: &'a mut P::Workspace,
}
