//! What a case file means: every value checked, every default filled in.
//!
//! The field names are those of the case file, so a [`Case`] written out as TOML (or looked at in a run's JSON
//! record) is itself a complete case file. Units are the user's own, only consistent: \[L\] length, \[F\] force.

mod bodies;
mod contact;
mod design;
mod memory;
mod mesh_file;
mod motion;
mod sets;
mod units;

pub use bodies::*;
pub use contact::*;
pub use design::*;
pub use memory::*;
pub use mesh_file::*;
pub use motion::*;
pub use sets::*;
pub use units::*;

use schemars::JsonSchema;
use serde::Serialize;

/// One case: bodies, contact, supports and motion, and, for an optimization, design, objective and optimizer.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Case {
    /// A line for people; may be empty.
    pub title: String,
    /// What the units are called.
    #[serde(skip_serializing_if = "Units::is_empty")]
    pub units: Units,
    /// The bodies, in the order of the file; the mesh numbers their elements in this order. At least one.
    #[serde(rename = "body")]
    pub bodies: Vec<Body>,
    /// Surfaces that the user selects, besides those that come with the bodies.
    #[serde(rename = "surface")]
    pub surfaces: Vec<SurfaceSet>,
    /// Node sets that the user selects, besides the surfaces that come with the bodies.
    #[serde(rename = "set")]
    pub sets: Vec<NodeSet>,
    /// Symmetry planes, each across another axis.
    #[serde(rename = "symmetry", skip_serializing_if = "Vec::is_empty")]
    pub symmetries: Vec<Symmetry>,
    /// Contact pairs.
    #[serde(rename = "contact")]
    pub contacts: Vec<Contact>,
    /// Load cases; empty: one, of weight 1.
    #[serde(rename = "load_case", skip_serializing_if = "Vec::is_empty")]
    pub load_cases: Vec<LoadCase>,
    /// Supports and prescribed motions.
    pub dirichlet: Vec<Dirichlet>,
    /// Loads on surfaces.
    #[serde(rename = "load", skip_serializing_if = "Vec::is_empty")]
    pub loads: Vec<Load>,
    /// Pseudo-time steps and Newton's tolerances.
    pub load_path: LoadPath,
    /// The design; `None` where the case is for a forward analysis only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub design: Option<Design>,
    /// The objective θ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub objective: Option<Objective>,
    /// The optimizer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub optimizer: Option<Optimizer>,
    /// What a run writes.
    pub output: Output,
    /// Linear solver and threads.
    pub solver: Solver,
    /// How the gradient is computed.
    pub adjoint: Adjoint,
}

impl Case {
    /// Load steps of all load cases together.
    pub fn steps(&self) -> usize {
        self.load_cases.len().max(1) * self.load_path.steps
    }

    /// What θ is, in words for people; `None` without an objective.
    pub fn objective_in_words(&self) -> Option<String> {
        let weighted = if self.load_cases.is_empty() { "" } else { " of each load case, times its weight" };
        self.objective.as_ref().map(|objective| format!("{}{weighted}", objective.about()))
    }

    /// Names of the load cases, in their order; none where there is but the one load path.
    pub fn load_case_names(&self) -> Vec<String> {
        self.load_cases.iter().map(|load_case| load_case.name.clone()).collect()
    }
}

/// What a run writes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Output {
    /// Directory, relative to the case file; `None`: the program's choice.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub directory: Option<String>,
    /// Fields are written every so many optimization iterations, and after the last.
    pub every: usize,
    /// Whether designs and load steps are written in pieces too, one for each rank of MPI.
    pub pieces: bool,
}

/// Linear solver and threads. Results do not depend on the number of threads.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Solver {
    /// The factorization.
    pub linear: LinearSolverChoice,
    /// Options of PETSc's solver, as PETSc writes them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub petsc_options: Option<String>,
    /// What PETSc makes of a tangent.
    pub petsc_preconditioner: PetscPreconditioner,
    /// Threads; `None`: as many as the machine has.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threads: Option<usize>,
}

/// The factorization.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LinearSolverChoice {
    /// Multifrontal, falling back on faer's; PETSc on several ranks.
    Auto,
    /// Multifrontal LU.
    Multifrontal,
    /// faer's supernodal sparse LU.
    Faer,
    /// PETSc, with MUMPS unless options say otherwise, in a build with the feature `petsc`.
    Petsc,
}

/// What PETSc makes of a tangent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PetscPreconditioner {
    /// Factors of all of it.
    #[default]
    Direct,
    /// Factors of the contact zone and multigrid on the bodies, in an iteration.
    ContactZone,
}

/// How the gradient is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Adjoint {
    /// For factors that the load path leaves for the gradient; where they do not fit they are made again.
    pub memory: Memory,
}
