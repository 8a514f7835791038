//! The contact problem of a load path, with its analysis, verification and optimization.
//!
//! [`equations`] is the only place where meshes, solids, contact and the load path meet. [`analysis`]
//! marches the path of a [`problem::Problem`] and differentiates the objective, [`quantities`]
//! lists the reactions, contact forces and energies along a path, [`verify`] compares gradients
//! with differences, [`overlaps`] finds bodies that overlap without a contact force, and [`optimize`]
//! changes the design. [`words`] formats counts and numbers for
//! display.

pub mod analysis;
pub mod coarse_friction;
pub mod crushed;
pub mod equations;
pub mod imbalance;
pub mod losses;
pub mod optimize;
pub mod overlaps;
pub mod pieces;
pub mod problem;
pub mod quantities;
pub mod releases;
pub mod rough_pressure;
mod side_by_side;
pub mod verify;
pub mod void_contact;
pub mod words;

pub use equations as model;
