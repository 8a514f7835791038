//! The contact problem of a load path, and what is done with it.
//!
//! [`model`] is the one place where meshes, solids, contact and the load path meet. [`analysis`] marches the path of a
//! [`problem::Problem`] and differentiates the objective, [`verify`] compares gradients with differences, and [`optimize`]
//! changes the design. [`words`] has counts and numbers in readable form.

pub mod analysis;
pub mod model;
pub mod optimize;
pub mod problem;
pub mod verify;
pub mod words;
