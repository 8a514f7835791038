//! Design variables, filters, quantities, responses and the optimizer.
//!
//! The crate works with element densities, element volumes and nodal forces; it does not depend on
//! contact or meshes. In the order in which an optimization uses them:
//!
//! | module | contents |
//! |---|---|
//! | [`values`] | densities and derivatives over elements, design domain and variables, as different types |
//! | [`variables`] | which elements are designed, passive solid or passive void; the initial design |
//! | [`ties`] | elements that share a variable: symmetric, repeated and extruded designs |
//! | [`map`] | maps of densities, chains of them, and their exact transposes |
//! | [`density_map`] | the chain from the design variables to the densities of all elements |
//! | [`filter`] | density filter, projection and overhang filter (design maps), Sigmund's sensitivity filter (not a design map) |
//! | [`quantity`] | numbers computed from a state, with exact partial derivatives |
//! | [`response`] | sums, maxima and curves of quantities over the load path: objectives and constraints |
//! | [`volume`] | the volume constraint |
//! | [`schedule`] | parameters that change over the iterations |
//! | [`optimizer`] | the method of moving asymptotes (MMA, GCMMA), scaling, optimality residual |
//!
//! A design map changes the function that is optimized, so its gradient is pulled back exactly. The
//! sensitivity filter changes only the gradient that the optimizer sees; it is applied after any
//! gradient that is compared with finite differences.
//!
//! All results are the same, bit for bit, for any number of threads. On several ranks, the largest
//! data of this crate, the lists of the filters and the subproblem of the optimizer, are
//! distributed ([`own_range`](slipstick_ranks::own_range)); inputs and outputs are replicated on
//! each rank.

pub mod density_map;
pub mod filter;
pub mod map;
pub mod optimizer;
pub mod quantity;
pub mod response;
pub mod schedule;
pub mod ties;
pub mod values;
pub mod variables;
pub mod volume;

pub use density_map::DensityMap;
pub use filter::{
    DensityFilter, FilterError, Neighbours, OverhangFilter, PrintedBox, Projection, SensitivityFilter, Triangle,
};
pub use map::{Chain, DesignMap, MapParameter, OnElements};
pub use optimizer::{
    Functions, Gcmma, Judgement, KktResidual, Method, Mma, MmaError, MmaParameters, MmaStep, Optimizer, Scaling,
    kkt_residual,
};
pub use quantity::{Dimension, Quantity, QuantityError, Reads, StateDerivative, StateView, VectorMeasure, extreme_of};
pub use response::{Bound, Constraint, Curve, ObservedSteps, OverLoadCases, Reduction, Response, Term};
pub use schedule::{Schedule, Steps};
pub use slipstick_status::ContactStatus;
pub use ties::{Motion, Places, TieError, Ties};
pub use values::{DomainValues, ElementValues, VariableValues};
pub use variables::{DesignError, DesignVariables, Means, Passives, Role};
pub use volume::{VolumeConstraint, VolumeError};
