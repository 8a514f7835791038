//! A direct solver on NVIDIA GPUs, with [cuDSS](https://docs.nvidia.com/cuda/cudss/).
//!
//! A [`Device`] represents a GPU with the two libraries that the solver calls: the CUDA driver and
//! cuDSS 1.x. Both are loaded at run time, so that building needs neither, nor a GPU.
//! [`CudssBackend`] makes solvers whose factors stay in the memory of the device; each solve sends
//! a right-hand side there and fetches the solution. The same factors solve with the matrix and
//! with its transpose.
//!
//! The matrix is equilibrated as for the multifrontal solver of `slipstick-linalg`. Factors are in
//! single precision, or in double precision where single is not sufficient. cuDSS exchanges pivots
//! only within a supernode and replaces those that are too small, so its factors can belong to a
//! nearby matrix. Therefore all factors are tested, and all solutions are verified by
//! [`solve_verified`](slipstick_linalg::solve_verified) like those of any other solver.

mod device;
mod dissection;
mod error;
mod factors;
mod library;
mod solver;

pub use device::Device;
pub use error::CudssError;
pub use solver::{CudssBackend, CudssSolver};
