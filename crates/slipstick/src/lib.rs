//! Topology optimization of bodies in three-dimensional finite-deformation frictional mortar contact.
//!
//! This crate is the facade over the method's crates: [`case`] reads and checks a case file, [`output`] writes
//! result files, [`render`] draws pictures of them, [`run`] keeps the directory of a run.

pub mod analysis;
pub mod build;
pub mod case;
pub mod check;
pub mod model;
pub mod optimize;
pub mod output;
pub mod render;
pub mod run;
pub mod verify;
