//! Block-sparse matrices, direct solvers and a preconditioner for large problems, all with transposed
//! solves.
//!
//! The tangent of a load step is assembled into a [`BlockMatrix`] of 3×3 blocks: one block row per
//! mesh node, followed by one per contact-multiplier node. A [`Reduction`] removes the prescribed
//! unknowns and yields a scalar [`CsrMatrix`]. A [`LinearSolver`] analyses its pattern, which gives
//! a [`Symbolic`] value, and factorizes it with that; the [`Factorization`] solves with the matrix
//! *and* with its transpose, since the adjoint of every step needs the latter, and reports its
//! [`Cost`]. [`solve_verified`] measures the true residual of every solution and improves it by
//! preconditioned GMRES, so a factorization in single precision, or of a nearby matrix, is also
//! sufficient.
//!
//! Solvers: [`MultifrontalSolver`] (the default: nested dissection by METIS, or minimum degree
//! without the feature `metis`, threshold pivoting with delayed pivots, single or double
//! precision; with strict pivoting, it is the last resort), [`SchwarzSolver`] (a preconditioner for
//! large problems) and [`RobustSolver`], which tries these, or any others, in sequence. [`Automatic`] chooses between
//! direct factors and iterations by predicted cost.
//!
//! ```
//! use slipstick_linalg::{
//!     BlockMatrix, BlockPattern, LinearSolver, Reduction, RobustSolver, SolverChoice, solve_verified,
//! };
//! use std::sync::Arc;
//!
//! // Two nodes joined by a spring of stiffness 2 in every direction; the first node is held.
//! let pattern = Arc::new(BlockPattern::from_rows(&[vec![0, 1], vec![0, 1]]));
//! let spring = |k: f64| [k, 0.0, 0.0, 0.0, k, 0.0, 0.0, 0.0, k];
//! let mut tangent = BlockMatrix::new(Arc::clone(&pattern));
//! for (i, j, k) in [(0, 0, 2.0), (0, 1, -2.0), (1, 0, -2.0), (1, 1, 2.0)] {
//!     tangent.add(i, j, &spring(k));
//! }
//! let reduction = Reduction::new(&pattern, &[true, true, true, false, false, false], &[0, 1]);
//! let matrix = reduction.reduce(&tangent);
//! let factors = RobustSolver::new(SolverChoice::Auto).analyse_and_factorize(&matrix)?;
//! let mut x = vec![0.0; reduction.free()];
//! solve_verified(&matrix, factors.as_ref(), false, &[1.0, 0.0, -4.0], &mut x, 1e-10)?;
//! assert_eq!(x, [0.5, 0.0, -2.0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Several processes can share matrices and vectors: [`Ranks`] is their communication, [`Layout`]
//! the distribution of unknowns, and [`Summed`] the matrix whose parts they hold.
//!
//! Results do not depend on the number of threads, bit for bit: every parallel loop works on tiles
//! whose bounds depend only on the matrix, and sums run in a fixed order.

mod basis;
pub mod block;
pub mod csr;
pub mod identity;
pub mod layout;
#[cfg(feature = "metis")]
mod metis;
pub mod multifrontal;
pub mod operator;
pub mod reduce;
pub mod robust;
pub mod scaling;
pub mod schwarz;
pub mod solver;
pub mod span;
pub mod symbolic;
mod vectors;
pub mod verified;

pub use block::{BlockMatrix, BlockPattern};
pub use csr::{CsrMatrix, CsrPattern, PatternError};
pub use identity::PatternId;
pub use layout::Layout;
#[cfg(feature = "metis")]
pub use metis::partition_graph;
pub use multifrontal::{EliminationTree, MultifrontalFactorization, MultifrontalSolver};
pub use operator::{Operator, Summed};
pub use reduce::Reduction;
pub use robust::{Link, RobustSolver, SolverChoice, test_on};
pub use scaling::Scaling;
pub use schwarz::{Automatic, Forecast, Nodes, Schwarz, SchwarzSolver};
pub use slipstick_ranks::{Alone, Ranks, Traffic, largest_or_nan, own_range};
pub use solver::{
    Backend, Cost, FactorPart, Factorization, FactorizationError, LinearSolver, Pivot, Precision, Transposed,
};
pub use span::best_in_spans;
pub use symbolic::Symbolic;
pub use verified::{
    Alternative, SolveError, SolveOptions, SolveReport, solve_from, solve_many_from, solve_verified, solve_with,
};
