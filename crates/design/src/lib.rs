//! Design variables, filters, objectives, constraints and the optimizer.
//!
//! The crate sees element densities, element volumes and nodal forces; it knows no contact and no mesh. In the
//! order in which an optimization meets them:
//!
//! | module | holds |
//! |---|---|
//! | [`variables`] | which elements are designed, passive solid or passive void; the initial design |
//! | [`map`] | the chain from design variables to densities and its exact transpose |
//! | [`filter`] | density filter and projection (design maps), Sigmund's sensitivity filter (no design map) |
//! | [`objective`] | what is minimised, with exact partial derivatives |
//! | [`volume`] | the volume constraint |
//! | [`optimizer`] | the method of moving asymptotes, scaling, optimality residual |
//!
//! A design map changes the function that is optimized, so its gradient is pulled back exactly. The sensitivity filter
//! changes only the gradient that the optimizer sees; it comes after every gradient that a finite-difference check sees.
//!
//! All results are the same, bit for bit, for any number of threads. On several ranks, the lists of the sensitivity filter
//! and the subproblem of the optimizer, which are the large things here, are divided among them
//! ([`own_range`](slipstick_linalg::own_range)); what goes in and comes out is whole on each.

pub mod filter;
pub mod map;
pub mod objective;
pub mod optimizer;
pub mod variables;
pub mod volume;

#[cfg(test)]
#[path = "../../linalg/tests/common/thread_ranks.rs"]
mod thread_ranks;

pub use filter::{DensityFilter, FilterError, Neighbours, Projection, SensitivityFilter};
pub use map::{Chain, DesignMap, Identity, OnElements};
pub use objective::{
    Compliance, ContactForce, Measure, Objective, ObjectiveError, ObservedSteps, ReactionForce, StateDerivative,
    StateView, Weighted, WrongDerivative, check_derivatives,
};
pub use optimizer::{KktResidual, Mma, MmaError, MmaParameters, MmaStep, Scaling, kkt_residual};
pub use variables::{DesignError, DesignVariables, Passives, Role};
pub use volume::{VolumeConstraint, VolumeError};
