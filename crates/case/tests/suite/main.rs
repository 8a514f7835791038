//! Tests of case files, in one program: what is read, refused, built and foreseen.
//! `cargo test --release -p slipstick-case --test suite case_bad::` runs those of one module.

mod case_bad;
mod case_good;
mod closing;
mod picking;
mod round_trip;
mod schema;
mod sides;

use std::sync::Arc;

use slipstick_case::construct::{BuildError, Platform, Problem, build_on};
use slipstick_case::file::{Case, Solver};
use slipstick_linalg::{Alone, Ranks, SolverChoice};
use slipstick_mesh::Mesh;
use slipstick_path::LinearSystem;

/// One rank, with a direct solver whatever the case asks for.
struct Direct;

impl Platform for Direct {
    fn ranks(&self) -> Arc<dyn Ranks> {
        Arc::new(Alone)
    }

    fn linear(&self, _: &Solver, _: &[u32], _: &Mesh, _: &[&str]) -> Result<LinearSystem, BuildError> {
        Ok(LinearSystem::new(SolverChoice::Auto))
    }
}

/// The problem of a case.
fn build(case: &Case) -> Result<Problem, BuildError> {
    build_on(case, &Direct)
}
