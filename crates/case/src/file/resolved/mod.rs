//! The contents of a case file: every value checked, every default filled in.
//!
//! The field names are those of the case file, so a [`Case`] written as TOML is itself a complete
//! case file; the same names appear in a run's JSON record. Any consistent system of units
//! works: \[L\] length, \[F\] force.

mod bodies;
mod bolt;
mod bounds;
mod contact;
mod coupling;
mod design;
mod equation;
mod load_case;
mod memory;
mod mesh_file;
mod motion;
mod promise;
mod quantity;
mod sets;
mod shaping;
mod spring;
mod units;

pub use bodies::*;
pub use bolt::*;
pub use bounds::*;
pub use contact::*;
pub use coupling::*;
pub use design::*;
pub use equation::*;
pub use load_case::*;
pub use memory::*;
pub use mesh_file::*;
pub use motion::*;
pub use promise::*;
pub use quantity::*;
pub use sets::*;
pub use shaping::*;
pub use spring::*;
pub use units::*;

use schemars::JsonSchema;
use serde::Serialize;

/// One case: bodies, contact, supports and motion, and, for an optimization, design, objective and
/// optimizer.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Case {
    /// A title for the reader; may be empty.
    pub title: String,
    /// Names of the units.
    #[serde(skip_serializing_if = "Units::is_empty")]
    pub units: Units,
    /// The bodies, in the order of the file; the mesh numbers their elements in this order. At
    /// least one.
    #[serde(rename = "body")]
    pub bodies: Vec<Body>,
    /// Surfaces that the case defines, in addition to those of the bodies.
    #[serde(rename = "surface")]
    pub surfaces: Vec<SurfaceSet>,
    /// Node sets that the case defines, in addition to the surfaces of the bodies.
    #[serde(rename = "set")]
    pub sets: Vec<NodeSet>,
    /// Symmetry planes, each normal to a different axis.
    #[serde(rename = "symmetry", skip_serializing_if = "Vec::is_empty")]
    pub symmetries: Vec<Symmetry>,
    /// Contact pairs.
    #[serde(rename = "contact")]
    pub contacts: Vec<Contact>,
    /// Load cases; empty: a single one with weight 1.
    #[serde(rename = "load_case", skip_serializing_if = "Vec::is_empty")]
    pub load_cases: Vec<LoadCase>,
    /// Supports and prescribed motions.
    pub dirichlet: Vec<Dirichlet>,
    /// Loads on surfaces, rigid bodies and mass.
    #[serde(rename = "load", skip_serializing_if = "Vec::is_empty")]
    pub loads: Vec<Load>,
    /// Springs.
    #[serde(rename = "spring", skip_serializing_if = "Vec::is_empty")]
    pub springs: Vec<Spring>,
    /// Points that belong to no body.
    #[serde(rename = "point", skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<Point>,
    /// Linear equations among displacements.
    #[serde(rename = "equation", skip_serializing_if = "Vec::is_empty")]
    pub equations: Vec<Equation>,
    /// Couplings of faces to reference points.
    #[serde(rename = "coupling", skip_serializing_if = "Vec::is_empty")]
    pub couplings: Vec<Coupling>,
    /// Bodies that are cut and pulled together.
    #[serde(rename = "bolt", skip_serializing_if = "Vec::is_empty")]
    pub bolts: Vec<Bolt>,
    /// Changes of temperature.
    #[serde(rename = "temperature", skip_serializing_if = "Vec::is_empty")]
    pub temperatures: Vec<Temperature>,
    /// Pseudo-time steps and Newton's tolerances.
    pub load_path: LoadPath,
    /// The design; `None`: the case is only for a forward analysis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub design: Option<Design>,
    /// Quantities that the case names.
    #[serde(rename = "quantity", skip_serializing_if = "Vec::is_empty")]
    pub quantities: Vec<Quantity>,
    /// The objective θ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub objective: Option<Objective>,
    /// Bounds on quantities.
    #[serde(rename = "constraint", skip_serializing_if = "Vec::is_empty")]
    pub constraints: Vec<Constraint>,
    /// Values that a design promised, for comparison with those of its part.
    #[serde(rename = "promise", skip_serializing_if = "Vec::is_empty")]
    pub promises: Vec<Promise>,
    /// The optimizer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub optimizer: Option<Optimizer>,
    /// What a run writes, and where.
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

    /// Description of θ; `None` without an objective.
    pub fn objective_in_words(&self) -> Option<String> {
        self.objective.as_ref().map(|Objective { kind, load_cases }| {
            let about = kind.about();
            match load_cases {
                _ if self.load_cases.is_empty() => about,
                OverLoadCases::Sum => format!("{about} of each load case, times its weight"),
                OverLoadCases::Mean => format!("{about}: the weighted mean of the load cases"),
                OverLoadCases::MeanPlusDeviations(factor) => {
                    format!("{about}: the weighted mean of the load cases plus {factor} standard deviations")
                }
                OverLoadCases::Worst => format!("{about}: the worst of the load cases, times their weights"),
            }
        })
    }

    /// The dimension of θ; `None` without an objective, or for quantities of different dimensions.
    pub fn objective_dimension(&self) -> Option<Dimension> {
        let of = |name: &str| self.quantities.iter().find(|q| q.name == name).map(|q| q.kind.dimension());
        match &self.objective.as_ref()?.kind {
            ObjectiveKind::ContactForce { .. } => Some(Dimension::FORCE),
            ObjectiveKind::Compliance { .. } => Some(Dimension::WORK),
            ObjectiveKind::Minimise(of_terms) | ObjectiveKind::Maximise(of_terms) => {
                let mut dimensions = of_terms.sum.iter().map(|term| of(&term.quantity));
                let first = dimensions.next()??;
                dimensions.all(|dimension| dimension == Some(first)).then_some(first)
            }
            ObjectiveKind::Follow(_) => Some(Dimension::NONE),
        }
    }

    /// Names of the load cases, in order; empty if there is only one load path.
    pub fn load_case_names(&self) -> Vec<String> {
        self.load_cases.iter().map(|load_case| load_case.name.clone()).collect()
    }
}

/// What a run writes, and where.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Output {
    /// Directory, relative to the case file; `None`: the program chooses it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub directory: Option<String>,
    /// Number of optimization iterations between written fields and load paths; the last iteration is
    /// always written.
    pub every: usize,
    /// Whether designs and load steps are also written in pieces, one for each MPI rank.
    pub pieces: bool,
    /// Whether the load path is also written as one file, `path.vtkhdf`, in a build with the feature
    /// `vtkhdf`.
    pub vtkhdf: bool,
}

/// Linear solver and threads. Results do not depend on the number of threads.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Solver {
    /// The factorization.
    pub linear: LinearSolverChoice,
    /// Options of PETSc's solver, in PETSc's notation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub petsc_options: Option<String>,
    /// PETSc's preconditioner for the tangent.
    pub petsc_preconditioner: PetscPreconditioner,
    /// Number of threads; `None`: all cores of the machine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threads: Option<usize>,
}

/// The factorization.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LinearSolverChoice {
    /// `Direct`, or `Schwarz` where it is predicted to be far cheaper; PETSc on several ranks.
    Auto,
    /// Multifrontal LU in single precision, with double precision and `strict` as fallbacks.
    Direct,
    /// Multifrontal LU.
    Multifrontal,
    /// Multifrontal LU with strict pivoting.
    Strict,
    /// Iterations with a two-level Schwarz preconditioner, for large problems; the solvers of `Direct`
    /// as a fallback.
    Schwarz,
    /// PETSc, with MUMPS unless options say otherwise, in a build with the feature `petsc`.
    Petsc,
    /// cuDSS on an NVIDIA GPU, in a build with the feature `cudss`.
    Cudss,
}

/// PETSc's preconditioner for the tangent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PetscPreconditioner {
    /// Factors of the whole matrix.
    #[default]
    Direct,
    /// Factors of the contact zone and multigrid on the bodies, as an iterative method.
    ContactZone,
}

/// How the gradient is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Adjoint {
    /// Memory for what the load path keeps for the gradient: histories first, which are computed again if
    /// they do not fit, then factors; matrices whose factors do not fit are factorized again.
    pub memory: Memory,
}
