//! Topology optimization of bodies in three-dimensional finite-deformation frictional mortar contact.
//!
//! This crate is the facade over the method's crates: [`case`] reads a case file, [`build`] makes mesh and [`model`] of
//! it, [`check`] looks at them, [`analysis`] marches the path and differentiates it, [`optimize`] changes the design,
//! [`verify`] compares gradients with differences. [`output`] writes result files, [`run`] keeps them in the directory of a
//! run, [`render`] draws pictures, [`export`] makes surfaces of designs,
//! [`report`] web pages of runs.

pub mod analysis;
pub mod build;
pub mod case;
pub mod check;
pub mod export;
pub mod machine;
pub mod model;
pub mod optimize;
pub mod output;
pub mod render;
pub mod report;
pub mod run;
pub mod verify;
pub mod words;

/// PETSc and MPI: sessions to build problems on.
#[cfg(feature = "petsc")]
pub use slipstick_petsc as petsc;
