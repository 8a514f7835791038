//! How much memory a run takes at its peak, before it runs.

use crate::build::Problem;
use crate::case::{Case, Contact, Enforcement, StartValues};

use serde::Serialize;

use super::{bytes_of_building, counts, entry_bytes};

/// What is predicted of the linear systems of a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Systems {
    /// Of one factorization. \[bytes\]
    pub factors: f64,
    /// Of the tangent, by blocks and by entries. \[bytes\]
    pub matrix: f64,
    /// Load steps that keep their factors for the gradient.
    pub kept: usize,
}

/// The program itself, with its threads and what the allocator holds back. Measured. \[bytes\]
const PROGRAM: f64 = 13e6;

/// Memory of a factorization while it is made, over that of its factors: fronts that wait for their parent. Measured.
const FRONTS: f64 = 0.5;

/// Copies of the tangent that live at once: assembled, without prescribed unknowns, scaled for the factorization, and the
/// working space of elimination order and iterations. Measured.
const MATRICES: f64 = 2.5;

/// Peak memory of a run, and how much less it would be without kept factors. \[bytes\]
///
/// The parts are those that grow: what building leaves, one factorization in progress, kept factors, the tangent's copies,
/// the states and the filter's lists of neighbours. Of the steps' kept factors the last are those in use. Test: `predicted_memory_is_that_of_runs`.
pub(super) fn peak(case: &Case, problem: &Problem, systems: &Systems) -> (f64, f64) {
    let Systems { factors, matrix, kept } = *systems;
    // Plain Uzawa iterations factorize the system with held multipliers, the gradient that with free ones, and each leaves
    // its factors for the next time.
    let plain = |c: &Contact| matches!(c.enforcement, Enforcement::Augmented { acceleration: 0, .. });
    let second = if case.contacts.iter().any(plain) && problem.analysis.objective.is_some() { factors } else { 0.0 };
    let fixed = PROGRAM
        + bytes_of_building(counts(&problem.mesh), problem.mesh.nodes.len() as f64)
        + MATRICES * matrix
        + states(case, problem)
        + filter(case, problem);
    let peak = fixed + (1.0 + FRONTS) * factors + second;
    let all_kept = kept.saturating_sub(1) as f64 * factors;
    (peak + all_kept, all_kept)
}

/// What a rank of several has at the peak of a run: see [`of_each`](Self::of_each).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RankMemory {
    /// Of reference geometry, tangent, path and the filter's lists, of which each rank has a part; and what building leaves.
    /// \[bytes\]
    divided: f64,
    /// Of mesh, the state of a step and program, which each rank has whole. \[bytes\]
    whole: f64,
    /// Of factors in double precision, in the order of METIS. \[bytes\]
    factors: f64,
    /// Most that a rank keeps of factors for the gradient. \[bytes\]
    keeps: f64,
    /// Load steps.
    steps: usize,
}

/// MPI and PETSc in a process. Measured by `docs/cluster/undivided.sh`. \[bytes\]
const LIBRARIES: f64 = 55e6;

/// Memory that is not divided, in vectors of all unknowns. Measured by `docs/cluster/undivided.sh`.
const VECTORS: f64 = 30.0;

/// Memory of MUMPS over that of the factors in the order of METIS: working space, and PORD's order. Measured on one to four ranks.
const MUMPS: f64 = 1.7;

/// How much more that is in all for each doubling of the ranks. Measured.
const MORE_ON_TWICE_THE_RANKS: f64 = 0.1;

impl RankMemory {
    pub(super) fn of(case: &Case, problem: &Problem, systems: &Systems, unknowns: usize) -> Self {
        let building = bytes_of_building(counts(&problem.mesh), problem.mesh.nodes.len() as f64);
        Self {
            divided: building + MATRICES * systems.matrix + states(case, problem) + filter(case, problem),
            whole: PROGRAM + LIBRARIES + VECTORS * 8.0 * unknowns as f64,
            factors: 8.0 / entry_bytes(case) * systems.factors,
            keeps: if problem.analysis.objective.is_some() { problem.analysis.march.factor_memory as f64 } else { 0.0 },
            steps: case.steps(),
        }
    }

    /// Of each of so many ranks, with MUMPS and without kept factors. Within a third of the runs of `docs/cluster/model.sh`.
    /// \[bytes\]
    pub fn of_each(&self, ranks: usize) -> f64 {
        self.whole + self.divided / ranks.max(1) as f64 + self.factors(ranks)
    }

    /// Of factors that MUMPS makes, on each rank.
    fn factors(&self, ranks: usize) -> f64 {
        let count = ranks.max(1) as f64;
        MUMPS * (1.0 + MORE_ON_TWICE_THE_RANKS * count.log2()) * self.factors / count
    }

    /// What factors that are kept for the gradient add on each rank, at most. \[bytes\]
    pub fn kept(&self, ranks: usize) -> f64 {
        let factors = self.factors(ranks);
        let fit = (self.keeps / factors).floor().min(self.steps as f64);
        (fit - 1.0).max(0.0) * factors
    }
}

/// States of the path and of start values.
fn states(case: &Case, problem: &Problem) -> f64 {
    let steps = case.steps();
    let (mesh, model) = (&problem.mesh, problem.analysis.model());
    let displacements = 3.0 * mesh.nodes.len() as f64;
    // Multipliers, and as much again for history and statuses.
    let state = 8.0 * (displacements + 9.0 * model.slave_nodes().len() as f64);
    // The previous design's path in single precision, and that of the present one when it takes its place.
    let follows = case.optimizer.is_some() && case.load_path.start_values == StartValues::PreviousDesign;
    let copies = if follows { 2.0 } else { 1.0 };
    (steps + 1) as f64 * copies * state
}

/// Elements whose neighbours are counted for all.
const SAMPLES: usize = 100;

/// Lists of the sensitivity filter: a number and a weight for each pair within the radius.
fn filter(case: &Case, problem: &Problem) -> f64 {
    let radius = case.design.as_ref().and_then(|design| design.sensitivity_filter).map(|filter| filter.radius);
    let (Some(radius), Some(variables)) = (radius.filter(|_| case.optimizer.is_some()), &problem.variables) else {
        return 0.0;
    };
    let centroids = problem.mesh.centroids();
    let centroids: Vec<[f64; 3]> = variables.domain().iter().map(|&element| centroids[element as usize]).collect();
    let stride = centroids.len().div_ceil(SAMPLES).max(1);
    let near = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>() < radius * radius;
    let samples = centroids.iter().skip(stride / 2).step_by(stride);
    let (pairs, sampled) = samples.fold((0, 0), |(pairs, sampled), centre| {
        (pairs + centroids.iter().filter(|other| near(centre, other)).count(), sampled + 1)
    });
    12.0 * pairs as f64 / f64::from(sampled.max(1)) * centroids.len() as f64
}
