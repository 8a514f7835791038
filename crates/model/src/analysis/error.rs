//! Why an analysis fails, or a response is refused.

use slipstick_design::quantity::WrongDerivative;
use slipstick_path::{MarchFailure, StateError, SweepError};

/// Why an analysis failed.
#[derive(Debug, thiserror::Error)]
pub enum AnalysisError {
    /// The march failed beyond retry.
    #[error(transparent)]
    March(#[from] Box<MarchFailure>),
    /// The adjoint failed.
    #[error(transparent)]
    Sweep(#[from] SweepError),
    /// A converged state could not be evaluated, or elements are inverted at new reference positions.
    #[error(transparent)]
    State(#[from] StateError),
    /// A quantity of the objective or of a constraint has no finite value.
    #[error(
        "the quantity `{name}` has no finite value at load step {step}; a gap has none where no part of the slave \
         surface faces the master: choose other load steps, or a larger `search_radius`"
    )]
    Infinite {
        /// Its name.
        name: String,
        /// Load step, counted through all load cases.
        step: usize,
    },
    /// The analysis of an eroded or a dilated design failed.
    #[error("{design} design: {source}")]
    Realisation {
        /// Which one.
        design: &'static str,
        /// Why.
        source: Box<AnalysisError>,
    },
    /// Nodes cannot move, or there are no derivatives with respect to their positions.
    #[error("no derivatives with respect to the positions of nodes exist with these: {what}")]
    Positions {
        /// What there is in the problem.
        what: String,
    },
    /// The path was cancelled before its end.
    #[error("the path ends after {steps} of {all} load steps: the objective has no gradient there")]
    Unfinished {
        /// Steps that are complete.
        steps: usize,
        /// Steps of the load path.
        all: usize,
    },
}

impl AnalysisError {
    /// The failed march, if a march failed.
    pub fn march(&self) -> Option<&MarchFailure> {
        match self {
            Self::March(failure) => Some(failure),
            Self::Realisation { source, .. } => source.march(),
            _ => None,
        }
    }
}

/// Why a response is rejected.
#[derive(Debug, thiserror::Error)]
pub enum ResponseRefused {
    /// Its derivative is not the derivative of its value.
    #[error(transparent)]
    Derivative(#[from] WrongDerivative),
    /// It observes no step of the load path: it would always be zero.
    #[error("response `{name}` observes none of the {steps} load steps; give each of its terms at least one of them")]
    NoSteps {
        /// The response's name.
        name: String,
        /// Steps of the load path.
        steps: usize,
    },
}
