//! The method of moving asymptotes, what to feed it and how to judge its result.
//!
//! [`Mma`] advances a design by one step; loops, files and stopping rules are the caller's. Source of the method and of
//! its symbols: K. Svanberg, *MMA and GCMMA – two methods for nonlinear optimization* (2007), "the notes" below, and
//! K. Svanberg, Int. J. Numer. Methods Eng. 24 (1987) 359–373.

mod dense;
mod error;
mod interior_point;
mod kkt;
mod mma;
mod parameters;
mod scaling;
mod subproblem;

#[cfg(test)]
mod tests;

pub use error::MmaError;
pub use kkt::{KktResidual, kkt_residual};
pub use mma::{Mma, MmaStep};
pub use parameters::MmaParameters;
pub use scaling::Scaling;
