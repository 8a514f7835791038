//! The terms of the equations: the law of each slave node, loads, springs, temperatures, viscous forces.

pub(in crate::equations) mod enforcement;
pub(in crate::equations) mod law;
pub(in crate::equations) mod loads;
pub mod node;
pub(in crate::equations) mod springs;
pub(in crate::equations) mod temperature;
pub(in crate::equations) mod viscosity;
