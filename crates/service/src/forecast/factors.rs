//! Predicts the factors of a load step from the pattern of its tangent.

use slipstick::analysis::Analysis;
use slipstick::build::Problem;
use slipstick::case::{Case, LinearSolverChoice};
use slipstick::linalg::{Automatic, CsrPattern, EliminationTree, Reduction, SchwarzSolver};
use slipstick::mesh::Mesh;
use slipstick::path::{Held, Iteration, StateError, StepProblem, Wanted};

use super::peak::{Factors, ON_GPU};

/// Predictions for a factorization.
pub(super) struct Factorization {
    /// Free unknowns.
    pub unknowns: usize,
    /// Memory of the factors. \[bytes\]
    pub bytes: f64,
    /// Floating-point operations.
    pub operations: f64,
    /// Memory of the tangent. \[bytes\]
    pub matrix_bytes: f64,
    /// Memory of the mortar rows. \[bytes\]
    pub contact_bytes: f64,
    /// Whether the factors are a preconditioner.
    pub iterative: bool,
    /// What ranks factorize.
    pub on_ranks: Factors,
}

/// Predicts the factorization of the first tangent, from its pattern.
///
/// # Errors
/// If the reference configuration cannot be evaluated.
pub(super) fn factorization(case: &Case, problem: &mut Problem) -> Result<Factorization, StateError> {
    let Analysis { design, workspace, .. } = &mut problem.analysis;
    let rest = design.model().rest();
    let wanted = Wanted::Derivatives;
    let geometry = design.geometry(&rest.unknowns, wanted, workspace)?;
    let step = design.begin(&rest, &geometry, [0.0, 1.0].into(), workspace)?;
    let iteration = Iteration { at_start: true, ..Iteration::default() };
    let at = design.evaluate(&step, &rest.unknowns, Some(&geometry), iteration, wanted, workspace)?;
    let matrix = design.tangent(&step, &at, workspace)?;
    let contact_bytes = geometry.bytes() as f64;
    let (fixed, groups) = (design.unknowns().fixed(Held::None), &design.unknowns().groups);
    let reduction = Reduction::new(matrix.pattern(), fixed, groups);
    let matrix_bytes = 72.0 * matrix.pattern().blocks() as f64 + 12.0 * reduction.pattern().entries() as f64;
    let pattern = reduction.pattern();
    let unknowns = reduction.free();
    let of = |(bytes, operations), iterative, on_ranks| Factorization {
        unknowns,
        bytes,
        operations,
        matrix_bytes,
        contact_bytes,
        iterative,
        on_ranks,
    };
    if case.solver.linear == LinearSolverChoice::Schwarz {
        // several ranks, whose direct factors are larger, are not possible
        let (bytes, operations) = SchwarzSolver::predict(pattern);
        return Ok(of((bytes, operations), true, Factors::direct(bytes)));
    }
    if case.solver.linear == LinearSolverChoice::Cudss {
        let tree = EliminationTree::new(pattern, None);
        let (entries, operations) = tree.map_or((0.0, 0.0), |tree| tree.size());
        // in single precision
        let bytes = 4.0 * entries + ON_GPU * pattern.entries() as f64;
        let on_ranks = Factors::direct(8.0 * entries);
        return Ok(of((bytes, operations), false, on_ranks));
    }
    let zone = contact_zone(case, &problem.mesh, pattern);
    if let (LinearSolverChoice::Petsc, Some((bytes, operations))) = (case.solver.linear, zone) {
        let on_ranks = Factors { bytes, contact_zone: true };
        return Ok(of((bytes, operations), true, on_ranks));
    }
    let forecast = Automatic::forecast(pattern);
    let double = 8.0 * forecast.direct_entries;
    let (bytes, operations, iterative) = match case.solver.linear {
        LinearSolverChoice::Auto => (forecast.bytes, forecast.operations, forecast.iterative),
        LinearSolverChoice::Direct => (0.5 * double, forecast.direct_operations, false),
        _ => (double, forecast.direct_operations, false),
    };
    let on_ranks = zone.map_or(Factors::direct(double), |(bytes, _)| Factors { bytes, contact_zone: true });
    Ok(Factorization { unknowns, bytes, operations, matrix_bytes, contact_bytes, iterative, on_ranks })
}

/// Memory of the contact-zone preconditioner and operations of its factorization, if the case uses it.
#[cfg(feature = "petsc")]
fn contact_zone(case: &Case, mesh: &Mesh, pattern: &CsrPattern) -> Option<(f64, f64)> {
    let slaves: Vec<&str> = case.contacts.iter().map(|contact| contact.slave.as_str()).collect();
    let used = case.solver.petsc_preconditioner == slipstick::case::PetscPreconditioner::ContactZone;
    used.then(|| slipstick::machine::contact_zone(mesh, &slaves).predict(pattern)).flatten()
}

#[cfg(not(feature = "petsc"))]
fn contact_zone(_: &Case, _: &Mesh, _: &CsrPattern) -> Option<(f64, f64)> {
    None
}
