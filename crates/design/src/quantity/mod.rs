//! Quantities: numbers computed from a state of the load path, with exact derivatives.
//!
//! Everything that can be printed, plotted, minimized or bounded is a [`Quantity`]. It has a value
//! at every state, and a pull-back: its partial derivatives with respect to the [data](StateView)
//! of the state that it can read. The caller applies the chain rule, (92)–(98) of the paper, so a
//! quantity knows neither equations nor meshes nor solvers.
//!
//! | quantity | of | dimension | file |
//! |---|---|---|---|
//! | [`Reaction`], [`Moment`] | prescribed displacements | F, F L | `reaction.rs` |
//! | [`ContactForce`] | slave nodes: sum of the norms of their forces | F | `contact_force.rs` |
//! | [`ContactResultant`] | a contact pair: component, norm, normal and tangential part | F | `contact_resultant.rs` |
//! | [`ContactPressure`] | a contact pair: peak, mean, spread, minimum | F/L² | `contact_pressure.rs` |
//! | [`ContactShare`], [`Gap`] | a contact pair | –, L | `contact_share.rs`, `gap.rs` |
//! | [`FrictionWork`] | a contact pair | F L | `friction_work.rs` |
//! | [`Displacement`] | nodes: component or norm of their mean | L | `displacement.rs` |
//! | [`StrainEnergy`] | elements | F L | `strain_energy.rs` |
//! | [`Stress`] | elements: largest von Mises stress | F/L² | `stress.rs` |
//! | [`PlasticStrain`] | elements: largest equivalent plastic strain | – | `plastic_strain.rs` |
//! | [`Compliance`] | loads | F L | `compliance.rs` |
//! | [`ExternalWork`] | loads and supports | F L | `external_work.rs` |
//! | [`Volume`] | elements | L³ | `volume.rs` |
//!
//! A [`Response`](crate::Response) turns quantities into an objective or a constraint: at which
//! steps, with which weights.

mod check;
mod compliance;
mod contact_force;
mod contact_pressure;
mod contact_resultant;
mod contact_share;
mod dimension;
mod displacement;
mod element_data;
mod external_work;
mod extreme;
mod friction_work;
mod gap;
mod patch;
mod plastic_strain;
mod reaction;
mod relaxed;
mod smooth;
mod strain_energy;
mod stress;
mod view;
mod volume;

pub use check::{WrongDerivative, check_derivatives};
pub use compliance::Compliance;
pub use contact_force::ContactForce;
pub use contact_pressure::{ContactPressure, PressureMeasure};
pub use contact_resultant::{ContactResultant, ForcePart};
pub use contact_share::ContactShare;
pub use dimension::Dimension;
pub use displacement::Displacement;
pub use element_data::{ElementData, ElementList};
pub use external_work::ExternalWork;
pub use extreme::{Extreme, extreme_of};
pub use friction_work::{FrictionStep, FrictionWork};
pub use gap::{Gap, GapMeasure};
pub use patch::Patch;
pub use plastic_strain::PlasticStrain;
pub use reaction::{Moment, Reaction};
pub use relaxed::STRESS_POINTS;
pub use strain_energy::StrainEnergy;
pub use stress::Stress;
pub use view::{ContactDerivative, ContactNode, PreviousDerivative, PreviousView, StateDerivative, StateView};
pub use volume::Volume;

use std::sync::Arc;
use thiserror::Error;

/// Why a quantity or a response cannot be built.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum QuantityError {
    /// The quantity would always be zero.
    #[error("the quantity observes no node; give it a surface or node set that is not empty")]
    NoNodes,
    /// A node that the mesh does not have.
    #[error("the quantity lists node {node}, but the mesh has nodes 0 to {last}", last = node_count.saturating_sub(1))]
    NodeOutOfRange {
        /// The node, from 0.
        node: u32,
        /// Number of nodes of the mesh.
        node_count: usize,
    },
    /// A node would count twice.
    #[error("the quantity lists node {node} twice; list each node once")]
    DuplicateNode {
        /// The node, from 0.
        node: u32,
    },
    /// The regularization is negative, infinite or not a number.
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
    /// The quantity would always be zero.
    #[error("the quantity observes no element; give it a body or region that is not empty")]
    NoElements,
    /// An exponent out of its range.
    #[error("{value} is not a finite exponent of at least 1, or a finite factor above 0")]
    Exponent {
        /// The given value.
        value: f64,
    },
    /// A modulus out of its range.
    #[error("the modulus of the softer body is {value}, which is not a finite number above 0")]
    Modulus {
        /// The given value.
        value: f64,
    },
    /// A weight of a node out of its range.
    #[error("the weight of node {node} is {value}, which is not a finite number above 0")]
    NodeWeight {
        /// The node, from 0.
        node: u32,
        /// The given value.
        value: f64,
    },
    /// A step that the load path does not have.
    #[error("the quantity is observed at step {step}, but the load path has steps 1 to {steps}")]
    StepOutOfRange {
        /// The step, from 1.
        step: usize,
        /// Number of user load steps.
        steps: usize,
    },
    /// A step would count twice.
    #[error("the quantity is observed at step {step} twice; list each step once")]
    DuplicateStep {
        /// The step, from 1.
        step: usize,
    },
    /// The quantity would always be zero.
    #[error("the quantity is observed at no step; use \"last\", \"all\" or a list of steps from 1")]
    NoSteps,
}

/// A number computed from a state of the load path.
///
/// A state that is not finite gives a value that is not finite, never a finite number.
pub trait Quantity: Send + Sync {
    /// Name for reports and error messages.
    fn name(&self) -> &str;

    /// Powers of force and length.
    fn dimension(&self) -> Dimension;

    /// What the quantity reads besides displacements, internal forces and forces of loads.
    fn reads(&self) -> Reads {
        Reads::default()
    }

    /// Whether the value depends on reference positions by more than the state, through areas, volumes or arms that the
    /// quantity took from the mesh. There is then no derivative with respect to reference positions.
    fn depends_on_mesh(&self) -> bool {
        false
    }

    /// The value at a state.
    fn value(&self, state: &StateView) -> f64;

    /// Adds `weight` times the partial derivatives of [`value`](Self::value) at `state` to `to`.
    fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative);

    /// Whether [`value`](Self::value) is an increment: the quantity at a load step is then the sum
    /// of the values at all (sub-)steps since the start of the load case.
    fn accumulates(&self) -> bool {
        false
    }

    /// Whether the quantity vanishes, except for round-off, where contact is open.
    fn needs_contact(&self) -> bool {
        false
    }

    /// The largest or smallest value itself, if this quantity is a smooth measure of it; only its
    /// values may be used.
    fn extreme(&self) -> Option<Arc<dyn Quantity>> {
        None
    }

    /// The slave nodes of which it combines the largest or smallest pressures, if it does.
    fn combines_pressures_of(&self) -> Option<&Patch> {
        None
    }

    /// Whether the value depends on the state, and not only on the densities.
    fn depends_on_state(&self) -> bool {
        true
    }
}

/// Data of a state that are computed only for quantities that read them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reads {
    /// [`StateView::reaction`].
    pub reaction: bool,
    /// [`StateView::contact`].
    pub contact: bool,
    /// [`StateView::elements`].
    pub elements: ElementData<bool>,
    /// [`StateView::previous`].
    pub previous: bool,
}

impl Reads {
    /// What either reads.
    pub fn or(self, other: Self) -> Self {
        let mut elements = self.elements;
        elements.each_mut().into_iter().zip(other.elements.each()).for_each(|(to, read)| *to |= read);
        Self {
            reaction: self.reaction || other.reaction,
            contact: self.contact || other.contact,
            elements,
            previous: self.previous || other.previous,
        }
    }
}

/// How a vector is reduced to one number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VectorMeasure {
    /// Its component along a unit vector.
    Along([f64; 3]),
    /// Its norm, which has no derivative where it is zero; it counts as constant there.
    Norm,
}

impl VectorMeasure {
    /// The component along a direction of any length.
    ///
    /// # Errors
    /// If the direction is the zero vector or not finite.
    pub fn along(direction: [f64; 3]) -> Result<Self, QuantityError> {
        let length = norm(direction);
        if !length.is_normal() {
            return Err(QuantityError::Direction { direction });
        }
        Ok(Self::Along(direction.map(|component| component / length)))
    }

    /// The number that a vector is reduced to.
    pub fn of(self, vector: [f64; 3]) -> f64 {
        match self {
            Self::Along(direction) => dot(direction, vector),
            Self::Norm => norm(vector),
        }
    }

    /// Its derivative with respect to the vector.
    pub fn slope(self, vector: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Along(direction) => direction,
            Self::Norm => match norm(vector) {
                0.0 => [0.0; 3],
                length => vector.map(|component| component / length),
            },
        }
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn norm(a: [f64; 3]) -> f64 {
    a[0].hypot(a[1]).hypot(a[2])
}

/// The entries of a node in a vector with three entries per node.
fn at_node(values: &[f64], node: u32) -> [f64; 3] {
    let at = 3 * node as usize;
    [values[at], values[at + 1], values[at + 2]]
}

fn add_at_node(to: &mut [f64], node: u32, weight: f64, vector: [f64; 3]) {
    for (to, component) in to[3 * node as usize..][..3].iter_mut().zip(vector) {
        *to += weight * component;
    }
}

fn check_nodes(nodes: &[u32], node_count: usize) -> Result<(), QuantityError> {
    if nodes.is_empty() {
        return Err(QuantityError::NoNodes);
    }
    let mut sorted = nodes.to_vec();
    sorted.sort_unstable();
    if let Some(&node) = sorted.last().filter(|&&node| node as usize >= node_count) {
        return Err(QuantityError::NodeOutOfRange { node, node_count });
    }
    match sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(QuantityError::DuplicateNode { node: pair[0] }),
        None => Ok(()),
    }
}
