//! Failures of states and steps, with types that name the place.

use crate::iterations::IterationRecord;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// A trial state at which the equations cannot be evaluated. It makes a Newton step fail and never
/// produces a number.
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
    /// A contact facet is so distorted that its projection onto the other surface is folded.
    #[error("the contact facet of nodes {nodes:?} is folded")]
    FoldedFacet {
        /// Global node numbers of the facet.
        nodes: Vec<u32>,
    },
    /// Surfaces moved through each other by more than the search radius in one (sub-)step.
    #[error("slave node {node} moved {depth:.3e} through the other surface, beyond the search radius {reach:.3e}")]
    PassedThrough {
        /// Global number of the deepest node.
        node: u32,
        /// Distance behind the expected position of the other surface.
        depth: f64,
        /// The search radius.
        reach: f64,
    },
    /// A free rigid body turned so far in one (sub-)step that the sense of the rotation is in doubt.
    #[error("a rigid body turned by {degrees:.0} degrees in one step, which is more than a quarter turn")]
    TurnedTooFar {
        /// Global number of the node at its reference point.
        node: u32,
        /// Norm of the change of the rotation vector.
        degrees: f64,
    },
    /// Prescribed displacements push a slave node into the other surface, and no free displacement
    /// can close the gap.
    #[error("prescribed displacements push slave node {node} into the other surface by {depth:.3e}")]
    PrescribedPenetration {
        /// Global number of the deepest node.
        node: u32,
        /// Its depth, from the weighted gap over the area.
        depth: f64,
    },
    /// A load moves a body along a motion that neither supports nor contact restrain.
    #[error(
        "nothing holds body `{body}` against its load {motion}: {}",
        if *slides { "no support, no contact ahead, and friction is at its limit" } else { "no support, and no contact ahead" }
    )]
    Unheld {
        /// Name of the body.
        body: String,
        /// The motion, such as `along −y`.
        motion: String,
        /// An unknown that this motion changes.
        unknown: usize,
        /// Whether friction acts at nodes that slide.
        slides: bool,
    },
    /// A residual or an increment is NaN or infinite.
    #[error("{quantity} is not finite")]
    NotFinite {
        /// The quantity.
        quantity: Cow<'static, str>,
        /// Index of its first entry that is not finite.
        index: usize,
    },
    /// The ranks of a parallel run have different numbers although they should agree.
    #[error("the ranks have reached different states; their machines or libraries may differ")]
    RanksDisagree,
}

impl StateError {
    /// Whether the prescribed data are at fault, so that no other attempt at the same increment can
    /// succeed.
    pub fn is_prescribed(&self) -> bool {
        matches!(self, Self::PrescribedPenetration { .. } | Self::Unheld { .. })
    }
}

/// The reason why the iteration of one (sub-)step failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StepFailureKind {
    /// The equations cannot be evaluated.
    #[error(transparent)]
    State(#[from] StateError),
    /// The tangent is singular: something can move freely, or conditions contradict each other.
    #[error("the tangent is singular (relative pivot {pivot:.1e})")]
    Singular {
        /// An undetermined unknown, among all unknowns of a step.
        unknown: usize,
        /// Best remaining pivot, relative to its scaled row.
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
        /// Positions (in the order of the slave nodes) whose status still changed in the last
        /// iterations.
        changing: Vec<u32>,
    },
    /// The first increment from a prediction is longer than the way from the last state to it: the last state is
    /// the better start.
    #[error("the first increment leads farther than the prediction")]
    Mispredicted,
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
        /// The required tolerance.
        tolerance: f64,
    },
    /// Stopped from outside ([`LinearSystem::set_interrupt`](crate::LinearSystem::set_interrupt)).
    #[error("interrupted")]
    Interrupted,
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
    /// The reason.
    pub kind: StepFailureKind,
    /// The iterations before the failure.
    pub iterations: Vec<IterationRecord>,
    /// The last iterate.
    pub iterate: Vec<f64>,
    /// Whether it is the state at which the step starts.
    pub at_start: bool,
}
