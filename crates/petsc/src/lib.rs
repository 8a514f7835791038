//! Linear solvers on several ranks, by [PETSc](https://petsc.org) over MPI.
//!
//! A [`Session`] stands for MPI and PETSc, which a process starts once. It is the [`Ranks`](slipstick_linalg::Ranks) of a
//! parallel run: sums, decisions and messages between ranks. [`PetscBackend`] makes [`PetscSolver`]s, which factorize
//! matrices that are the sum of the ranks' parts, by default with MUMPS; with a [`ContactZone`] they factorize only what is
//! near the contact and iterate.
//!
//! PETSc is called through a shim in C (`src/shim.c`), so that nothing is guessed of how PETSc and MPI were built. Calls
//! of all threads go one after the other. Some packages of PETSc cannot solve with the transpose and do not say so:
//! every solver proves that it can, before it is used, and all solutions are verified by
//! [`solve_verified`](slipstick_linalg::solve_verified) like those of any other solver.
//!
//! The crate is empty without its feature `petsc`, which needs both libraries.
#![cfg_attr(not(feature = "petsc"), allow(rustdoc::broken_intra_doc_links))]

#[cfg(feature = "petsc")]
mod contact_zone;
#[cfg(feature = "petsc")]
mod error;
#[cfg(feature = "petsc")]
mod factors;
#[cfg(feature = "petsc")]
mod ffi;
#[cfg(feature = "petsc")]
mod rehearsal;
#[cfg(feature = "petsc")]
mod session;
#[cfg(feature = "petsc")]
mod solver;

#[cfg(feature = "petsc")]
pub use contact_zone::ContactZone;
#[cfg(feature = "petsc")]
pub use error::PetscError;
#[cfg(feature = "petsc")]
pub use session::Session;
#[cfg(feature = "petsc")]
pub use solver::{PetscBackend, PetscSolver};
