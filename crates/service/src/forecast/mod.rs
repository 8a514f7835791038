//! Forecasts what a run needs of a machine: memory and operations.

mod building;
mod factors;
mod peak;

use serde::Serialize;
use slipstick::build::Problem;
use slipstick::case::{Case, Contact, Enforcement, LinearSolverChoice};
use slipstick::path::StateError;

pub use building::bytes_to_build;
pub use peak::RankMemory;

use factors::{Factorization, factorization};

/// What a run needs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Forecast {
    /// Free unknowns of a step.
    pub unknowns: usize,
    /// Predicted memory of the largest factorization. \[bytes\]
    pub factor_bytes: f64,
    /// Whether this memory is that of a GPU, which `peak_bytes` and `kept_bytes` do not contain.
    pub factors_on_gpu: bool,
    /// Number of load steps whose factors fit into `adjoint.memory` and are reused for the
    /// gradient, if no step is cut back. It is 0 for the plain Uzawa iteration, whose inner solves
    /// are of other systems.
    pub steps_with_factors: usize,
    /// Predicted peak memory of a run. \[bytes\]
    pub peak_bytes: f64,
    /// The part of `peak_bytes` for factors kept for the gradient, at most: contact spreads as far as
    /// where the bodies are pressed together undeformed. \[bytes\]
    pub kept_bytes: f64,
    /// Floating-point operations of the first factorization.
    pub factor_operations: f64,
    /// Whether the factors are those of a preconditioner, with which solves iterate.
    pub iterative: bool,
    /// Data from which memory on several ranks is predicted.
    pub on_ranks: RankMemory,
}

/// Forecasts what a run of a built problem needs on so many ranks.
///
/// On several ranks, each knows only its part of the contact. They predict from the first tangent:
/// what is predicted from later contact takes evaluations of all ranks at once, and how many
/// depends on the contact that is found.
///
/// # Errors
/// If the reference configuration cannot be evaluated.
pub fn forecast(case: &Case, problem: &mut Problem, ranks: usize) -> Result<Forecast, StateError> {
    let keeps = problem.analysis.objective.is_some() && case.adjoint.memory.0 > 0;
    let poses = match (ranks, keeps) {
        (1, true) => factors::POSES,
        (1, false) => 1,
        _ => 0,
    };
    let Factorization {
        unknowns,
        bytes: factor_bytes,
        kept_bytes: each_kept,
        operations: factor_operations,
        matrix_bytes,
        contact_bytes,
        spreads,
        iterative,
        on_ranks,
    } = factorization(case, problem, poses)?;
    let contact_zone = on_ranks.contact_zone && case.solver.linear == LinearSolverChoice::Petsc;
    // the factors of a contact zone are not reused
    let steps_with_factors = if contact_zone { 0 } else { steps_with_factors(case, problem, each_kept) };
    let factors_on_gpu = case.solver.linear == LinearSolverChoice::Cudss;
    let factors = if factors_on_gpu { 0.0 } else { factor_bytes };
    let working = if iterative { peak::iterations(unknowns) } else { peak::FRONTS * factors };
    let (matrix, kept) = (matrix_bytes, steps_with_factors);
    let each_kept = if factors_on_gpu { 0.0 } else { each_kept };
    let systems = peak::Systems {
        factors,
        each_kept,
        working,
        on_ranks,
        matrix,
        contact: peak::contact(contact_bytes, spreads),
        kept,
    };
    let (peak_bytes, kept_bytes) = peak::peak(case, problem, &systems);
    let on_ranks = RankMemory::of(case, problem, &systems, unknowns);
    Ok(Forecast {
        unknowns,
        factor_bytes,
        factors_on_gpu,
        steps_with_factors,
        peak_bytes,
        kept_bytes,
        factor_operations,
        iterative,
        on_ranks,
    })
}

/// Number of steps whose factors can be kept for the gradient within the memory that the case
/// allows.
fn steps_with_factors(case: &Case, problem: &Problem, factor_bytes: f64) -> usize {
    let plain = |c: &Contact| matches!(c.enforcement, Enforcement::Augmented { acceleration: 0, .. });
    if problem.analysis.objective.is_none() || case.contacts.iter().any(plain) || factor_bytes <= 0.0 {
        return 0;
    }
    ((case.adjoint.memory.0 as f64 / factor_bytes) as usize).min(case.steps())
}
