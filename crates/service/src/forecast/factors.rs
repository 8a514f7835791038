//! Predicts the factors of load steps from the patterns of their tangents.

use slipstick::analysis::Analysis;
use slipstick::build::Problem;
use slipstick::case::{Case, LinearSolverChoice};
use slipstick::linalg::{Automatic, CsrPattern, EliminationTree, Reduction, SchwarzSolver};
use slipstick::mesh::Mesh;
use slipstick::model::ContactState;
use slipstick::path::{Held, Iteration, StateError, StepProblem, Wanted};

use super::peak::{Factors, ON_GPU};

/// Predictions for the largest factorization along the load path.
pub(super) struct Factorization {
    /// Free unknowns.
    pub unknowns: usize,
    /// Memory of the factors. \[bytes\]
    pub bytes: f64,
    /// The same in the mean over the load path, at most. \[bytes\]
    pub kept_bytes: f64,
    /// Floating-point operations of the first one.
    pub operations: f64,
    /// Memory of the first tangent. \[bytes\]
    pub matrix_bytes: f64,
    /// Memory of the mortar rows with their derivatives. \[bytes\]
    pub contact_bytes: f64,
    /// Whether later poses have more contact than the start.
    pub spreads: bool,
    /// Whether the factors are a preconditioner.
    pub iterative: bool,
    /// What ranks factorize.
    pub on_ranks: Factors,
}

/// Poses along the load path at which contact is sought, at most.
pub(super) const POSES: usize = 4;

/// Predicts the factorizations of the load path from the patterns of tangents.
///
/// Contact spreads along the path, and each slave node in contact couples the nodes of two bodies. So
/// factors and mortar rows are those of later pseudo-times, with each body moved, undeformed, by the
/// mean of its prescribed displacements, and slave bodies back by half of the largest overlap: according
/// to Hertz, paraboloids that are pressed together touch in half of the area in which they would overlap.
/// Bodies that bend touch in less, so this is a bound. Contact is sought at this many `poses`, which are
/// equally spaced in pseudo-time; without any, the first tangent is taken.
///
/// # Errors
/// If the reference configuration cannot be evaluated.
pub(super) fn factorization(case: &Case, problem: &mut Problem, poses: usize) -> Result<Factorization, StateError> {
    let rest = problem.analysis.model().rest().unknowns;
    let start = tangent(problem, &rest)?;
    let first = sized(case, problem, &start);
    if poses == 0 || case.contacts.is_empty() {
        return Ok(first);
    }
    // one tangent at a time, as in a run
    let least = start.entries();
    drop(start);
    let count = case.steps().min(poses);
    let poses: Vec<Vec<f64>> = (1..=count).map(|k| pose(problem, &rest, k as f64 / count as f64)).collect();
    // undeformed bodies may overlap too far for an evaluation
    let entries = |y: &Vec<f64>| Some((pressed(problem, y).ok()?.entries().saturating_sub(least), y.clone()));
    let later: Vec<(usize, Vec<f64>)> = poses.iter().filter_map(entries).collect();
    let Some((grown, fullest)) = later.iter().max_by_key(|(grown, _)| *grown).filter(|(grown, _)| *grown > 0) else {
        return Ok(first);
    };
    let fullest = pressed(problem, fullest)?;
    let last = sized(case, problem, &fullest);
    let mean = later.iter().map(|(of, _)| *of as f64).sum::<f64>() / (later.len() * grown) as f64;
    Ok(Factorization {
        bytes: last.bytes.max(first.bytes),
        kept_bytes: first.bytes + mean * (last.bytes - first.bytes).max(0.0),
        contact_bytes: last.contact_bytes.max(first.contact_bytes),
        spreads: true,
        ..first
    })
}

/// The tangent at these unknowns, with slave bodies moved back by half of their overlap.
fn pressed(problem: &mut Problem, y: &[f64]) -> Result<Tangent, StateError> {
    let found = tangent(problem, y)?;
    if found.overlaps.iter().all(|overlap| *overlap == [0.0; 3]) {
        return Ok(found);
    }
    let mut back = y.to_vec();
    for (body, overlap) in problem.mesh.bodies.iter().zip(&found.overlaps) {
        for n in body.nodes.clone() {
            (0..3).for_each(|c| back[3 * n + c] -= 0.5 * overlap[c]);
        }
    }
    tangent(problem, &back)
}

/// The unknowns with each body moved by the mean displacement that is prescribed for its nodes.
fn pose(problem: &Problem, rest: &[f64], time: f64) -> Vec<f64> {
    let design = &problem.analysis.design;
    let mut y = rest.to_vec();
    design.prescribe(time.into(), &mut y);
    let fixed = design.unknowns().fixed(Held::None);
    for body in &problem.mesh.bodies {
        for c in 0..3 {
            let dofs = || body.nodes.clone().map(|n| 3 * n + c);
            let (mut sum, mut count) = (0.0, 0.0);
            for dof in dofs().filter(|&dof| fixed[dof] || y[dof] != rest[dof]) {
                sum += y[dof] - rest[dof];
                count += 1.0;
            }
            let mean = if count > 0.0 { sum / count } else { 0.0 };
            dofs().for_each(|dof| y[dof] = rest[dof] + mean);
        }
    }
    y
}

/// The pattern of a tangent without its prescribed unknowns, and the memory of the data from which it is assembled.
struct Tangent {
    reduction: Reduction,
    blocks: usize,
    contact_bytes: f64,
    /// For each body, the largest overlap of its slave nodes along their mean normal. \[L\]
    overlaps: Vec<[f64; 3]>,
}

impl Tangent {
    fn entries(&self) -> usize {
        self.reduction.pattern().entries()
    }
}

/// The tangent of a step from rest, at these unknowns.
fn tangent(problem: &mut Problem, y: &[f64]) -> Result<Tangent, StateError> {
    let Analysis { design, workspace, .. } = &mut problem.analysis;
    workspace.forget();
    let rest = design.model().rest();
    let wanted = Wanted::Derivatives;
    let geometry = design.geometry(&rest.unknowns, wanted, workspace)?;
    let step = design.begin(&rest, &geometry, [0.0, 1.0].into(), workspace)?;
    let geometry = if y == rest.unknowns { geometry } else { design.geometry(y, wanted, workspace)? };
    let iteration = Iteration { at_start: true, ..Iteration::default() };
    let at = design.evaluate(&step, y, Some(&geometry), iteration, wanted, workspace)?;
    let overlaps = overlaps(&problem.mesh, &design.model().slave_nodes(), &at.state);
    let matrix = design.tangent(&step, &at, workspace)?;
    let (fixed, groups) = (design.unknowns().fixed(Held::None), &design.unknowns().groups);
    let reduction = Reduction::new(matrix.pattern(), fixed, groups);
    Ok(Tangent { reduction, blocks: matrix.pattern().blocks(), contact_bytes: geometry.bytes() as f64, overlaps })
}

fn overlaps(mesh: &Mesh, slaves: &[u32], state: &ContactState) -> Vec<[f64; 3]> {
    let mut overlaps = vec![[0.0; 3]; mesh.bodies.len()];
    for (body, overlap) in mesh.bodies.iter().zip(&mut overlaps) {
        let (mut largest, mut sum, mut along) = (0.0, 0.0, [0.0; 3]);
        for (j, _) in (0..).zip(slaves).filter(|(_, n)| body.nodes.contains(&(**n as usize))) {
            let (Some(of), Some(normal)) = (state.measures(j), state.direction(j, 0)) else { continue };
            if of.covered() && of.gap < 0.0 {
                let depth = -of.gap / of.area;
                largest = f64::max(largest, depth);
                sum += depth;
                (0..3).for_each(|c| along[c] += depth * normal[c]);
            }
        }
        if sum > 0.0 {
            *overlap = along.map(|c| largest * c / sum);
        }
    }
    overlaps
}

/// The factors of a tangent with the solver of the case.
fn sized(case: &Case, problem: &Problem, tangent: &Tangent) -> Factorization {
    let Tangent { reduction, blocks, contact_bytes, .. } = tangent;
    let pattern = reduction.pattern();
    let of = |(bytes, operations), iterative, on_ranks| Factorization {
        unknowns: reduction.free(),
        bytes,
        kept_bytes: bytes,
        operations,
        matrix_bytes: 72.0 * *blocks as f64 + 12.0 * pattern.entries() as f64,
        contact_bytes: *contact_bytes,
        spreads: false,
        iterative,
        on_ranks,
    };
    if case.solver.linear == LinearSolverChoice::Schwarz {
        // several ranks, whose direct factors are larger, are not possible
        let (bytes, operations) = SchwarzSolver::predict(pattern);
        return of((bytes, operations), true, Factors::direct(bytes));
    }
    if case.solver.linear == LinearSolverChoice::Cudss {
        let tree = EliminationTree::new(pattern, None);
        let (entries, operations) = tree.map_or((0.0, 0.0), |tree| tree.size());
        // in single precision
        let bytes = 4.0 * entries + ON_GPU * pattern.entries() as f64;
        return of((bytes, operations), false, Factors::direct(8.0 * entries));
    }
    let zone = contact_zone(case, &problem.mesh, pattern);
    if let (LinearSolverChoice::Petsc, Some((bytes, operations))) = (case.solver.linear, zone) {
        return of((bytes, operations), true, Factors { bytes, contact_zone: true });
    }
    let forecast = Automatic::forecast(pattern);
    let double = 8.0 * forecast.direct_entries;
    let (bytes, operations, iterative) = match case.solver.linear {
        LinearSolverChoice::Auto => (forecast.bytes, forecast.operations, forecast.iterative),
        LinearSolverChoice::Direct => (0.5 * double, forecast.direct_operations, false),
        _ => (double, forecast.direct_operations, false),
    };
    let on_ranks = zone.map_or(Factors::direct(double), |(bytes, _)| Factors { bytes, contact_zone: true });
    of((bytes, operations), iterative, on_ranks)
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
