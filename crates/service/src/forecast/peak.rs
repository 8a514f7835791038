//! Predicts the peak memory of a run.

use serde::Serialize;
use slipstick::build::Problem;
use slipstick::case::{Case, Contact, Enforcement, LinearSolverChoice, StartValues, Symmetry};

use super::building::{bytes_of_building, counts};

/// Predictions for the linear systems of a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Systems {
    /// Memory of one factorization. \[bytes\]
    pub factors: f64,
    /// The same in the mean over the load path, at most. \[bytes\]
    pub each_kept: f64,
    /// Memory that a factorization or a solve needs besides. \[bytes\]
    pub working: f64,
    /// What ranks factorize.
    pub on_ranks: Factors,
    /// Memory of the tangent, by blocks and by entries. \[bytes\]
    pub matrix: f64,
    /// Memory of [`contact`]. \[bytes\]
    pub contact: f64,
    /// Load steps that keep their factors for the gradient.
    pub kept: usize,
}

/// Factors of a matrix that is distributed over ranks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Factors {
    /// Memory of direct factors in double precision with METIS ordering, or of a contact zone with
    /// everything else that the preconditioner needs. \[bytes\]
    pub bytes: f64,
    /// Whether they are those of a contact zone.
    pub contact_zone: bool,
}

impl Factors {
    /// Factors of the whole matrix.
    pub fn direct(bytes: f64) -> Self {
        Self { bytes, contact_zone: false }
    }
}

/// The program itself on one thread, with memory that the allocator retains. Measured. \[bytes\]
const PROGRAM: f64 = 18.3e6;

/// What each further thread adds at least: freed memory that the system's allocator keeps for it. Measured with
/// `cases/clutch/coarse.toml` on two threads; more where load steps are many (docs/measurements/robustness.md). \[bytes\]
const THREAD: f64 = 7e6;

/// Memory during a factorization relative to the memory of its factors: fronts that wait for their
/// parent. Measured.
pub(super) const FRONTS: f64 = 0.35;

/// Memory of cuDSS on a GPU beside the entries of its factors, for each entry of the matrix. Measured
/// (docs/measurements/gpu.md). \[bytes\]
pub(super) const ON_GPU: f64 = 50.0;

/// Directions that iterations keep, with a product for each.
const DIRECTIONS: f64 = 30.0;

/// Working memory of an iterative solver: the vectors of a solve. \[bytes\]
pub(super) fn iterations(unknowns: usize) -> f64 {
    2.0 * DIRECTIONS * 8.0 * unknowns as f64
}

/// Copies of the tangent that exist at the same time: assembled, without prescribed unknowns,
/// scaled for the factorization, and the working space of the elimination order and the iterations.
/// Measured, without what fits into memory that fronts have left.
const MATRICES: f64 = 1.5;

/// The same on ranks, whose factors are those of MUMPS or of a contact zone. Measured.
const MATRICES_ON_RANKS: f64 = 2.5;

/// Memory of contact: rows of the previous and the current state and of the sweep, and facets with their
/// derivatives. `rows` is the memory of the mortar rows where there are most of them, if contact
/// [`spreads`](super::factors::Factorization::spreads), and otherwise that at the start, in which case
/// more overlap during the path is included. Both factors are measured. \[bytes\]
pub(super) fn contact(rows: f64, spreads: bool) -> f64 {
    rows * if spreads { 9.0 } else { 13.0 }
}

/// Peak memory of a run, and its reduction without kept factors. \[bytes\]
///
/// The parts are those that grow with the problem: memory left from building, one factorization in
/// progress, kept factors, copies of the tangent, contact, the states and the filter's lists of
/// neighbours.
/// Test: `predicted_memory_is_that_of_runs`.
pub(super) fn peak(case: &Case, problem: &Problem, systems: &Systems) -> (f64, f64) {
    let Systems { factors, each_kept, working, matrix, contact, kept, .. } = *systems;
    // Plain Uzawa iterations factorize the system with fixed multipliers, the gradient the one with
    // free multipliers, and each keeps its factors for the next time.
    let plain = |c: &Contact| matches!(c.enforcement, Enforcement::Augmented { acceleration: 0, .. });
    let second = if case.contacts.iter().any(plain) && problem.analysis.objective.is_some() { factors } else { 0.0 };
    // realizations of a design keep their matrices, load cases only while they run
    let realisations = realisations(case);
    let at_once = problem.analysis.at_once().min(if realisations > 1 { realisations } else { case.load_cases.len() });
    let at_once = at_once.max(1) as f64;
    let libraries = if case.solver.linear == LinearSolverChoice::Petsc { LIBRARIES } else { 0.0 };
    let fixed = PROGRAM
        + THREAD * (rayon::current_num_threads() - 1) as f64
        + libraries
        + bytes_of_building(counts(&problem.mesh), problem.mesh.nodes.len() as f64)
        + (MATRICES * matrix + contact) * at_once.max(realisations as f64)
        + states(case, problem)
        + (RESPONSE_WHOLE + RESPONSE_DIVIDED) * responses(problem)
        + filter(case, problem)
        + problem.analysis.model().solid().reference_bytes();
    let peak = fixed + (factors + working + second) * at_once;
    let all_kept = kept as f64 * each_kept;
    (peak + all_kept, all_kept)
}

/// Data from which [`of_each`](Self::of_each) predicts the peak memory of each rank.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RankMemory {
    /// Memory of reference geometry, tangent, path and the filter's lists, which is distributed
    /// over the ranks; and memory left from building. \[bytes\]
    divided: f64,
    /// Memory of the mesh, the state of a step and the program, which is replicated on each
    /// rank. \[bytes\]
    whole: f64,
    /// Memory of factors in double precision with METIS ordering, or of the contact-zone
    /// preconditioner. \[bytes\]
    factors: f64,
    /// Whether `factors` are those of that preconditioner.
    contact_zone: bool,
    /// Maximum memory of kept factors on a rank. \[bytes\]
    keeps: f64,
    /// Load steps.
    steps: usize,
}

/// The program itself in each process. Measured. \[bytes\]
const PROGRAM_ON_RANKS: f64 = 13e6;

/// Memory of MPI and PETSc in a process. Measured by `docs/measure/cluster/undivided.sh`. \[bytes\]
const LIBRARIES: f64 = 55e6;

/// Memory that is not distributed, as a number of vectors of all unknowns. Measured by
/// `docs/measure/cluster/undivided.sh`.
const VECTORS: f64 = 30.0;

/// Memory of MUMPS relative to the memory of the factors with METIS ordering: working space, and
/// PORD's ordering. Measured on one to four ranks.
const MUMPS: f64 = 1.7;

/// Increase of the total for each doubling of the number of ranks. Measured.
const MORE_ON_TWICE_THE_RANKS: f64 = 0.1;

/// Increase of the total memory of the contact-zone preconditioner on several ranks: PETSc's matrices
/// have two parts there. Measured by `docs/measure/cluster/zone.sh`.
const ZONE_ON_SEVERAL: f64 = 0.5;

impl RankMemory {
    pub(super) fn of(case: &Case, problem: &Problem, systems: &Systems, unknowns: usize) -> Self {
        let building = bytes_of_building(counts(&problem.mesh), problem.mesh.nodes.len() as f64);
        Self {
            divided: building
                + MATRICES_ON_RANKS * systems.matrix
                + states(case, problem)
                + RESPONSE_DIVIDED * responses(problem)
                + filter(case, problem),
            whole: PROGRAM_ON_RANKS + LIBRARIES + VECTORS * 8.0 * unknowns as f64 + RESPONSE_WHOLE * responses(problem),
            factors: systems.on_ranks.bytes,
            contact_zone: systems.on_ranks.contact_zone,
            keeps: if problem.analysis.objective.is_some() { for_factors(case, problem) } else { 0.0 },
            steps: case.steps(),
        }
    }

    /// Memory of each of this many ranks, without kept factors. Accurate to within a third for the
    /// runs of `docs/measure/cluster/model.sh` and `docs/measure/cluster/zone.sh`. \[bytes\]
    pub fn of_each(&self, ranks: usize) -> f64 {
        self.whole + self.divided / ranks.max(1) as f64 + self.factors(ranks)
    }

    /// Memory of the factors on each rank.
    fn factors(&self, ranks: usize) -> f64 {
        let count = ranks.max(1) as f64;
        if self.contact_zone {
            let several = if ranks > 1 { ZONE_ON_SEVERAL } else { 0.0 };
            return (1.0 + several) * self.factors / count;
        }
        MUMPS * (1.0 + MORE_ON_TWICE_THE_RANKS * count.log2()) * self.factors / count
    }

    /// Maximum additional memory on each rank for factors that are kept for the gradient. \[bytes\]
    pub fn kept(&self, ranks: usize) -> f64 {
        if self.contact_zone {
            return 0.0;
        }
        let factors = self.factors(ranks);
        let fit = (self.keeps / factors).floor().min(self.steps as f64);
        (fit - 1.0).max(0.0) * factors
    }
}

/// Vectors of all unknowns that the sweep holds in full for each response, by counting: its adjoint,
/// four earlier solutions, and right-hand side, residual, pull-backs and solution of a step.
const RESPONSE_WHOLE: f64 = 10.0;

/// Further vectors that ranks share: the directions of the iteration, by counting ten iterations, and
/// what they produce. In `slipstick bench --sizes 9400 --steps 4 --responses 20`, each response adds
/// 7 vectors to the peak, because the march needs more memory than the sweep of one response.
const RESPONSE_DIVIDED: f64 = 12.0;

/// How many realizations of a design are analysed.
fn realisations(case: &Case) -> usize {
    let three = case.design.as_ref().is_some_and(|design| design.minimum_thickness.is_some());
    if three && case.optimizer.is_some() { 3 } else { 1 }
}

/// Memory of one vector of all unknowns for each constraint and each further part of the objective,
/// which the sweep treats besides the objective.
fn responses(problem: &Problem) -> f64 {
    let model = problem.analysis.model();
    let unknowns = 3.0 * (problem.mesh.nodes.len() + model.slave_nodes().len()) as f64;
    let parts = problem.analysis.objective.as_ref().and_then(|of| of.worst_of()).map_or(1, |cases| cases.len());
    (problem.analysis.constraints.len() + parts - 1) as f64 * 8.0 * unknowns
}

/// A point and its mirror images across symmetry planes.
fn images(point: &[f64; 3], planes: &[Symmetry]) -> Vec<[f64; 3]> {
    planes.iter().fold(vec![*point], |mut images, plane| {
        let mirrored = |image: &[f64; 3]| {
            let mut mirrored = *image;
            mirrored[plane.normal.index()] = 2.0 * plane.at - image[plane.normal.index()];
            mirrored
        };
        let of_all: Vec<[f64; 3]> = images.iter().map(mirrored).collect();
        images.extend(of_all);
        images
    })
}

/// States of the path, and start values.
fn states(case: &Case, problem: &Problem) -> f64 {
    let steps = case.steps();
    let (mesh, model) = (&problem.mesh, problem.analysis.model());
    let displacements = 3.0 * mesh.nodes.len() as f64;
    // Multipliers, and the same amount for the history of contact and statuses.
    let state = 8.0 * (displacements + 9.0 * model.slave_nodes().len() as f64);
    // The previous design's path in single precision, and the path of the current design that
    // replaces it.
    let follows = case.optimizer.is_some() && case.load_path.start_values == StartValues::PreviousDesign;
    let copies = if follows { 2.0 } else { 1.0 };
    ((steps + 1) as f64 * copies * state + histories(case, problem)) * realisations(case) as f64
}

/// The histories of elements with memory that the path keeps.
fn histories(case: &Case, problem: &Problem) -> f64 {
    let all = (case.steps() + 1) as f64 * 8.0 * problem.analysis.model().solid().history() as f64;
    all.min(problem.analysis.march.memory as f64)
}

/// Memory that is left for factors.
fn for_factors(case: &Case, problem: &Problem) -> f64 {
    problem.analysis.march.memory as f64 - histories(case, problem)
}

/// Number of sample elements from which the number of neighbours is estimated.
const SAMPLES: usize = 100;

/// Lists of a filter: a number and a weight for each pair within the radius, mirror images across
/// symmetry planes included.
fn filter(case: &Case, problem: &Problem) -> f64 {
    let design = case.design.as_ref();
    let sensitivities = design.and_then(|design| design.sensitivity_filter).filter(|_| case.optimizer.is_some());
    let densities = design.and_then(|design| design.density_filter).map(|filter| filter.radius);
    let Some(radius) = densities.or(sensitivities.map(|filter| filter.radius)) else { return 0.0 };
    let schedule = case.optimizer.iter().flat_map(|optimizer| optimizer.schedule.filter_radius.entries());
    let radii = std::iter::once(radius).chain(schedule.map(|entry| entry.1));
    radii.map(|radius| filter_of_radius(case, problem, radius)).sum()
}

fn filter_of_radius(case: &Case, problem: &Problem, radius: f64) -> f64 {
    let Some(variables) = problem.variables() else { return 0.0 };
    let centroids = problem.mesh.centroids();
    let centroids: Vec<[f64; 3]> = variables.domain().iter().map(|&element| centroids[element as usize]).collect();
    let stride = centroids.len().div_ceil(SAMPLES).max(1);
    let near = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>() < radius * radius;
    let samples = centroids.iter().skip(stride / 2).step_by(stride);
    let (pairs, sampled) = samples.fold((0, 0), |(pairs, sampled), centre| {
        // an image of the other element is as near as the other element is to an image of this one
        let images = images(centre, &case.symmetries);
        let count = |image: &[f64; 3]| centroids.iter().filter(|other| near(image, other)).count();
        (pairs + images.iter().map(count).sum::<usize>(), sampled + 1)
    });
    12.0 * pairs as f64 / f64::from(sampled.max(1)) * centroids.len() as f64
}
