//! The method of moving asymptotes, the scaling of its input and the assessment of its result.
//!
//! [`Mma`] advances a design by one step; the caller provides loops, files and stopping criteria.
//! Source of the method and of its symbols: K. Svanberg, *MMA and GCMMA – two methods for nonlinear
//! optimization* (2007), "the notes" below, and K. Svanberg, Int. J. Numer. Methods Eng. 24 (1987)
//! 359–373.

mod dense;
mod error;
mod functions;
mod interior_point;
mod kkt;
mod mma;
mod parameters;
mod scaling;
mod subproblem;

#[cfg(test)]
mod tests;

pub use error::MmaError;
pub use functions::Functions;
pub use kkt::{KktResidual, kkt_residual};
pub use mma::{Mma, MmaStep};
pub use parameters::MmaParameters;
pub use scaling::Scaling;
