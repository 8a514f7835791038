//! Tests of the public functions, over all solvers.

mod chain;
#[path = "../common/mod.rs"]
mod common;
mod elimination;
mod factorization;
mod layout;
mod robustness;
mod schwarz;
#[path = "../supernodal/mod.rs"]
mod supernodal;
mod symmetric;
mod verified;
