//! What can go wrong on the path, in types that name the place.

use crate::newton::IterationRecord;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// A trial state at which the equations cannot be evaluated. It is a failed Newton step, never a number that travels on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, thiserror::Error)]
pub enum StateError {
    /// Elements with J ≤ 0 at a Gauss point.
    #[error("{} inverted element{} (first: {})", elements.len(), if elements.len() == 1 { "" } else { "s" }, elements[0])]
    InvertedElements {
        /// Element numbers, ascending, not empty.
        elements: Vec<u32>,
    },
    /// The slave surface is folded so that no averaged normal exists.
    #[error("the slave surface is folded at node {node}")]
    FoldedSurface {
        /// Global node number.
        node: u32,
    },
    /// A contact facet is so distorted that its projection on the other surface is folded.
    #[error("the contact facet of nodes {nodes:?} is folded")]
    FoldedFacet {
        /// Global node numbers of the facet.
        nodes: Vec<u32>,
    },
    /// Surfaces moved through each other further than contact is searched for, in one (sub-)step.
    #[error("slave node {node} moved {depth:.3e} through the other surface, beyond the search radius {reach:.3e}")]
    PassedThrough {
        /// Global node number of the deepest.
        node: u32,
        /// How far it lies behind where the other surface would be.
        depth: f64,
        /// The search radius.
        reach: f64,
    },
    /// Prescribed displacements push a slave node into the other surface, and no free displacement can close the gap.
    #[error("prescribed displacements push slave node {node} into the other surface by {depth:.3e}")]
    PrescribedPenetration {
        /// Global node number of the deepest.
        node: u32,
        /// How deep it lies, by its weighted gap over its area.
        depth: f64,
    },
    /// A residual or an increment is NaN or infinite.
    #[error("{quantity} is not finite")]
    NotFinite {
        /// What.
        quantity: Cow<'static, str>,
        /// First such unknown.
        index: usize,
    },
    /// The ranks of a parallel run have different numbers where they must have the same.
    #[error("the ranks have come to different states; their machines or libraries may not be the same")]
    RanksDisagree,
}

impl StateError {
    /// Whether what is prescribed is at fault, so that no other way to the same load step mends it.
    pub fn is_prescribed(&self) -> bool {
        matches!(self, Self::PrescribedPenetration { .. })
    }
}

/// Why the iteration of one (sub-)step failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StepFailureKind {
    /// No state there.
    #[error(transparent)]
    State(#[from] StateError),
    /// The tangent is singular: something can move freely, or conditions contradict each other.
    #[error("the tangent is singular (relative pivot {pivot:.1e})")]
    Singular {
        /// An unknown that nothing determines, of all unknowns of a step.
        unknown: usize,
        /// Best pivot left, relative to its scaled row.
        pivot: f64,
    },
    /// The linear system could not be solved.
    #[error("linear solver: {0}")]
    Linear(String),
    /// Residual or increments above tolerance after the last allowed iteration.
    #[error("no convergence in {iterations} Newton iterations{}", changing_nodes(changing.len()))]
    TooManyIterations {
        /// Iterations made.
        iterations: usize,
        /// Positions (in the order of the slave nodes) whose status still changed in the last ones.
        changing: Vec<u32>,
    },
    /// The residual grows without bound.
    #[error("the residual diverges")]
    Diverged,
    /// The active set repeats itself.
    #[error("the active set cycles at {} slave node{}", nodes.len(), if nodes.len() == 1 { "" } else { "s" })]
    Cycling {
        /// Positions (in the order of the slave nodes) whose status changes.
        nodes: Vec<u32>,
    },
    /// Uzawa's iteration did not reach its tolerance.
    #[error("{iterations} Uzawa iterations left a violation of {violation:.2e}, above {tolerance:.2e}")]
    Uzawa {
        /// Iterations made.
        iterations: usize,
        /// Remaining relative violation of the contact conditions.
        violation: f64,
        /// What was asked for.
        tolerance: f64,
    },
}

fn changing_nodes(count: usize) -> String {
    match count {
        0 => String::new(),
        1 => ": 1 slave node still changes between stick, slip and open".into(),
        _ => format!(": {count} slave nodes still change between stick, slip and open"),
    }
}

/// A failed attempt at a (sub-)step, with its iterations.
#[derive(Debug, Clone, PartialEq)]
pub struct StepFailure {
    /// Why.
    pub kind: StepFailureKind,
    /// The iterations before it failed.
    pub iterations: Vec<IterationRecord>,
    /// The last iterate.
    pub iterate: Vec<f64>,
    /// Whether it is the state at which the step starts.
    pub at_start: bool,
}

/// The march failed beyond retry and cut-back. What was computed is in `path`.
#[derive(Debug, Clone)]
pub struct MarchFailure {
    /// The user's step (1-based) in which it failed.
    pub step: usize,
    /// Start and end of the smallest increment tried, in pseudo-time.
    pub increment: (f64, f64),
    /// Every failed attempt in that step: its target time, and why it failed.
    pub attempts: Vec<(f64, StepFailureKind)>,
    /// The last failing iterate, for a picture of it.
    pub iterate: Vec<f64>,
    /// Whether it is the state at which the step starts.
    pub at_start: bool,
    /// The iterations that led there.
    pub iterations: Vec<IterationRecord>,
    /// Newton iterations of all failed attempts, also of those on the way to the states that converged.
    pub failed_iterations: usize,
    /// Everything that converged before.
    pub path: crate::Path,
}

impl std::fmt::Display for MarchFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (from, to) = self.increment;
        let last = self.attempts.last().map(|a| a.1.to_string()).unwrap_or_default();
        write!(
            f,
            "load step {} failed: {last}; {} attempts down to the increment t = {from:.6} … {to:.6}; t = {:.6} was reached",
            self.step,
            self.attempts.len(),
            self.path.states.last().map_or(0.0, |s| s.time),
        )
    }
}

impl std::error::Error for MarchFailure {}
