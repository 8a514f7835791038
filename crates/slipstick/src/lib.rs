//! Topology optimization of bodies in three-dimensional finite-deformation frictional mortar
//! contact.
//!
//! ```text
//! case ──build──▶ problem ──analysis──▶ objective, gradient ──optimize──▶ design ──run, report, export──▶ files
//! ```
//!
//! This crate re-exports what users of the library need. [`case`](mod@case) reads a case file,
//! [`build`](mod@build) makes the mesh and the [`model`](mod@model) from it, [`check`](mod@check)
//! inspects them, [`analysis`] computes the load path and its derivatives, [`optimize`] changes the
//! design, [`drive`](mod@drive) runs an optimization to its end and records it, and [`verify`]
//! compares gradients with finite differences. [`output`] writes result files, [`run`] manages the
//! directory of a run, [`render`] draws pictures, [`export`] extracts surfaces of designs, and
//! [`report`] writes web pages about runs. At a lower level, [`path`] contains the march and the
//! adjoint sweep for any [`StepProblem`](path::StepProblem), and [`mesh`], [`solid`], [`contact`],
//! [`design`] and [`linalg`] contain the parts from which problems are built.

pub mod build;
pub mod drive;
pub mod machine;

pub use slipstick_case::{check, file as case};
pub use slipstick_model::{
    analysis, coarse_friction, crushed, imbalance, losses, model, optimize, overlaps, pieces, problem, quantities,
    releases, rough_pressure, verify, void_contact, words,
};
pub use slipstick_results::{output, run};
pub use slipstick_views::{charts, deck, export, part, picture, render, report, step};

pub use slipstick_contact as contact;
pub use slipstick_design as design;
pub use slipstick_linalg as linalg;
pub use slipstick_mesh as mesh;
pub use slipstick_meshio as meshio;
pub use slipstick_path as path;
pub use slipstick_ranks as ranks;
pub use slipstick_solid as solid;

/// cuDSS: devices with which matrices are factorized.
#[cfg(feature = "cudss")]
pub use slipstick_cudss as cudss;
/// PETSc and MPI: sessions with which problems are built.
#[cfg(feature = "petsc")]
pub use slipstick_petsc as petsc;
