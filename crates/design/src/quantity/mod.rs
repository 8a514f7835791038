//! Objectives as functions of the states of the load path.
//!
//! An [`Objective`] is evaluated once per user load step that it observes; the caller sums over the steps. It receives
//! the displacements, the internal and the external forces of the whole model, and returns explicit partial derivatives
//! with respect to all three. The caller applies the chain rule, (92)–(98) of the paper, by multiplying with the
//! derivatives of the forces.

mod check;
mod compliance;
mod contact_force;
mod reaction_force;
mod weighted;

pub use check::{WrongDerivative, check_derivatives};
pub use compliance::Compliance;
pub use contact_force::ContactForce;
pub use reaction_force::ReactionForce;
pub use weighted::Weighted;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;
use thiserror::Error;

/// Why an objective cannot be built.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ObjectiveError {
    /// The objective would always be zero.
    #[error("the objective observes no node; give it a surface or node set that is not empty")]
    NoNodes,
    /// A node that the mesh does not have.
    #[error("the objective lists node {node}, but the mesh has nodes 0 to {last}", last = node_count.saturating_sub(1))]
    NodeOutOfRange {
        /// The node, from 0.
        node: u32,
        /// Number of nodes of the mesh.
        node_count: usize,
    },
    /// A node would count twice.
    #[error("the objective lists node {node} twice; list each node once")]
    DuplicateNode {
        /// The node, from 0.
        node: u32,
    },
    /// The regularisation is negative, infinite or not a number.
    #[error("regularisation {value} is not a finite force ≥ 0")]
    Regularisation {
        /// The given value. \[F\]
        value: f64,
    },
    /// The direction is the zero vector or not finite.
    #[error("direction [{}, {}, {}] is not a finite, nonzero vector", direction[0], direction[1], direction[2])]
    Direction {
        /// The given value.
        direction: [f64; 3],
    },
    /// A step that the load path does not have.
    #[error("the objective observes step {step}, but the load path has steps 1 to {steps}")]
    StepOutOfRange {
        /// The step, from 1.
        step: usize,
        /// Number of user load steps.
        steps: usize,
    },
    /// A step would count twice.
    #[error("the objective observes step {step} twice; list each step once")]
    DuplicateStep {
        /// The step, from 1.
        step: usize,
    },
    /// The objective would always be zero.
    #[error("the objective observes no step; use \"last\", \"all\" or a list of steps from 1")]
    NoSteps,
}

/// The state at the end of a user load step.
#[derive(Clone, Copy, Debug)]
pub struct StateView<'a> {
    /// User load step, from 1.
    pub step: usize,
    /// Number of user load steps.
    pub steps: usize,
    /// Pseudo-time at the end of the step.
    pub time: f64,
    /// Nodal displacements `d`, entry `3·node + component`. \[L\]
    pub displacement: &'a [f64],
    /// Nodal internal forces `f_int(d, φ)`, entry `3·node + component`. \[F\]
    pub internal_force: &'a [f64],
    /// Nodal forces of the loads `f_ext(d, t)`, entry `3·node + component`. \[F\]
    pub external_force: &'a [f64],
}

/// Explicit partial derivatives of an objective; implementations add to the existing values.
#[derive(Debug)]
pub struct StateDerivative<'a> {
    /// `∂θ_s/∂d` at fixed forces, entry `3·node + component`.
    pub displacement: &'a mut [f64],
    /// `∂θ_s/∂f_int` at fixed displacement, entry `3·node + component`.
    pub internal_force: &'a mut [f64],
    /// `∂θ_s/∂f_ext` at fixed displacement, entry `3·node + component`.
    pub external_force: &'a mut [f64],
}

/// A function of the states of the load path, to be minimised: `θ = Σ_s θ_s` over the observed steps `s`.
///
/// A state that is not finite gives a value that is not finite, never a finite number.
pub trait Objective: Send + Sync {
    /// Short name for reports, in snake case.
    fn name(&self) -> &str;

    /// Whether step `step` (from 1) of `steps` contributes. Other steps may need no adjoint solve.
    fn observes(&self, step: usize, steps: usize) -> bool;

    /// `θ_s` of an observed step.
    fn value(&self, state: &StateView) -> f64;

    /// Adds the partial derivatives of [`Objective::value`] at `state` to `derivative`.
    fn derivative(&self, state: &StateView, derivative: &mut StateDerivative);

    /// The kind of quantity, which is used to distinguish a value that is only round-off from a small one. For
    /// [`Measure::Other`], no value counts as round-off.
    fn measure(&self) -> Measure {
        Measure::Other
    }
}

/// The kind of quantity of an objective.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Contact forces: zero where contact is open. \[F\]
    ContactForce,
    /// Other forces. \[F\]
    Force,
    /// Work. \[F L\]
    Work,
    /// Anything else.
    Other,
}

/// The user load steps over which an objective sums.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ObservedSteps {
    /// The last step only. Paper: (91) with `s = N`.
    #[default]
    Last,
    /// All steps. Paper: (96).
    All,
    /// The listed steps, from 1, ascending and unique.
    #[serde(untagged)]
    Only(Vec<usize>),
}

impl fmt::Display for ObservedSteps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Last => f.write_str("at the last load step"),
            Self::All => f.write_str("over all load steps"),
            Self::Only(steps) => {
                let steps: Vec<String> = steps.iter().map(usize::to_string).collect();
                write!(f, "at load step{} {}", if steps.len() == 1 { "" } else { "s" }, steps.join(", "))
            }
        }
    }
}

impl ObservedSteps {
    /// Whether step `step` (from 1) of `steps` is observed.
    pub fn contains(&self, step: usize, steps: usize) -> bool {
        match self {
            Self::Last => step == steps,
            Self::All => (1..=steps).contains(&step),
            Self::Only(list) => list.contains(&step),
        }
    }

    /// Checks the steps against the number of load steps.
    ///
    /// # Errors
    ///
    /// An empty list, a listed step outside `1..=steps`, or one that is listed twice.
    pub fn check(&self, steps: usize) -> Result<(), ObjectiveError> {
        let Self::Only(list) = self else {
            return Ok(());
        };
        if list.is_empty() {
            return Err(ObjectiveError::NoSteps);
        }
        for (position, &step) in list.iter().enumerate() {
            if !(1..=steps).contains(&step) {
                return Err(ObjectiveError::StepOutOfRange { step, steps });
            }
            if list[..position].contains(&step) {
                return Err(ObjectiveError::DuplicateStep { step });
            }
        }
        Ok(())
    }
}

fn check_nodes(nodes: &[u32], node_count: usize) -> Result<(), ObjectiveError> {
    if nodes.is_empty() {
        return Err(ObjectiveError::NoNodes);
    }
    let mut sorted = nodes.to_vec();
    sorted.sort_unstable();
    if let Some(&node) = sorted.last().filter(|&&node| node as usize >= node_count) {
        return Err(ObjectiveError::NodeOutOfRange { node, node_count });
    }
    match sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(ObjectiveError::DuplicateNode { node: pair[0] }),
        None => Ok(()),
    }
}

/// Minus the force of contact and supports on a node: internal minus external force.
fn nodal_force(state: &StateView, node: u32) -> [f64; 3] {
    std::array::from_fn(|c| {
        let at = 3 * node as usize + c;
        state.internal_force[at] - state.external_force[at]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn observed_steps() {
        let observed = |choice: &ObservedSteps| (1..=4).filter(|&step| choice.contains(step, 4)).collect::<Vec<_>>();
        assert_eq!(observed(&ObservedSteps::Last), [4]);
        assert_eq!(observed(&ObservedSteps::All), [1, 2, 3, 4]);
        assert_eq!(observed(&ObservedSteps::Only(vec![3, 1])), [1, 3]);
        assert_eq!(ObservedSteps::Only(vec![1, 5]).check(4), Err(ObjectiveError::StepOutOfRange { step: 5, steps: 4 }));
        assert_eq!(ObservedSteps::Only(vec![0]).check(4), Err(ObjectiveError::StepOutOfRange { step: 0, steps: 4 }));
        assert_eq!(ObservedSteps::Only(vec![2, 2]).check(4), Err(ObjectiveError::DuplicateStep { step: 2 }));
        assert_eq!(ObservedSteps::Only(vec![]).check(4), Err(ObjectiveError::NoSteps));
        assert_eq!(ObservedSteps::Only(vec![4, 2]).check(4), Ok(()));
    }
}
