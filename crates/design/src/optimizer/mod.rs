//! The method of moving asymptotes, with or without monotone progress, the scaling of its input and
//! the assessment of its result.
//!
//! [`Mma`] advances a design by one step; [`Gcmma`] also judges whether a step was short enough,
//! and shortens it if not. The caller provides loops, files and stopping criteria; [`Optimizer`] is
//! either method. Source of the methods and of their symbols: K. Svanberg, *MMA and GCMMA – two
//! methods for nonlinear optimization* (2007), "the notes" below; K. Svanberg, Int. J. Numer.
//! Methods Eng. 24 (1987) 359–373; K. Svanberg, SIAM J. Optim. 12 (2002) 555–573.

mod dense;
mod dual_ascent;
mod error;
mod functions;
mod gcmma;
mod interior_point;
mod kkt;
mod method;
mod mma;
mod opposed;
mod parameters;
mod scaling;
mod subproblem;

#[cfg(test)]
mod tests;

pub use error::MmaError;
pub use functions::Functions;
pub use gcmma::{Gcmma, Judgement};
pub use kkt::{KktResidual, kkt_residual};
pub use method::{Method, Optimizer};
pub use mma::{Mma, MmaStep};
pub use parameters::MmaParameters;
pub use scaling::Scaling;
