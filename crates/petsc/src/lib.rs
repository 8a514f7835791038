//! Linear solvers on several ranks, with [PETSc](https://petsc.org) over MPI.
//!
//! A [`Session`] represents MPI and PETSc, which a process can start only once. It is the
//! [`Ranks`](slipstick_linalg::Ranks) of a parallel run: sums, decisions and messages between
//! ranks. [`PetscBackend`] makes [`PetscSolver`]s, which factorize matrices that are the sum of the
//! ranks' parts, by default with MUMPS; with a [`ContactZone`], they factorize only the part near
//! the contact and iterate.
//!
//! PETSc is called through a shim in C (`src/shim.c`), so that nothing has to be assumed about how
//! PETSc and MPI were built. Calls from different threads are serialized. Some packages of PETSc
//! cannot solve with the transpose and do not report this: every solver is tested for it before it
//! is used, and all solutions are verified by [`solve_verified`](slipstick_linalg::solve_verified)
//! like those of any other solver.
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
