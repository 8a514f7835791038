//! Contact geometry: from node positions to mortar rows, nodal frames, gap and slip, with all
//! derivatives.
//!
//! In reading order: [`clip`] (overlap of two projected facets), [`cell_rule`] (quadrature on its
//! triangles), `inverse_map` (from the plane back to a facet), [`facet_pair`] (D and M of one
//! pair), [`height`] (the true surface above a facet), `plane` (the auxiliary plane of a slave facet), [`coupling`] (one slave facet with all
//! its masters, dual shapes), [`frame`] (nodal normal and tangents), [`cone`] (the normal at an edge), [`rows`] (everything collected
//! per slave node), [`pressed`] (rows weighted by the pressure at the integration points), `node_gaps` (initial gaps that it does not count), [`slip`] (the slip increment of a node).

pub mod cell_rule;
pub mod clip;
pub mod cone;
pub mod coupling;
pub mod facet_pair;
pub mod frame;
pub mod height;
mod inverse_map;
pub(crate) mod node_gaps;
mod plane;
pub mod pressed;
mod pressed_pair;
pub mod rows;
pub mod slip;

pub use cell_rule::CellRule;
pub use coupling::MultiplierShape;
pub use rows::NodeKinematics;
pub use slip::PreviousRow;
