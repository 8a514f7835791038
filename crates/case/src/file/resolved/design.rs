//! Design, objective and optimizer.

use schemars::JsonSchema;
use serde::Serialize;

use super::{
    Combination, CurveToFollow, DesignSymmetry, Direction, ObservedSteps, OverLoadCases, Overhang, Pattern,
    QuantityTerm, Region,
};
pub use slipstick_design::{MmaParameters, Schedule, Steps};
use slipstick_solid::Interpolation;
pub use slipstick_solid::{EnergyInterpolation, Simp};

/// The design: one density in \[0, 1\] per element of the design bodies. Paper: section 4.
///
/// Without filters of the densities and a projection, the densities are themselves the variables of
/// the optimizer.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Design {
    /// The bodies to be designed; at least one.
    pub bodies: Vec<String>,
    /// Initial density, 0 < φ ≤ 1.
    pub initial: f64,
    /// Bound V on the mean density of the design bodies (87), 0 < V ≤ 1; required for an
    /// optimization.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume_fraction: Option<f64>,
    /// Stiffness as a function of density.
    pub simp: Simp,
    /// Poisson's ratio of elements of density 0, with the shear modulus that their density gives them; `None`: that
    /// of the solid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub void_poisson_ratio: Option<f64>,
    /// With a Poisson's ratio of the void: power with which the bulk modulus rises from that of the void to that of
    /// the solid, relative to the shear modulus, ≥ 1.
    #[serde(skip_serializing_if = "is_default_bulk")]
    pub bulk_p: f64,
    /// Power with which the yield stress rises with the density, ≥ 1; `None`: that of the stiffness.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub yield_p: Option<f64>,
    /// Power with which the mass of an element, on which loads act, falls with its density, ≥ 1; with 1, it
    /// is that of the material.
    #[serde(skip_serializing_if = "is_one")]
    pub mass_p: f64,
    /// Linear elasticity for elements with very low density; `None`: finite strains everywhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy_interpolation: Option<EnergyInterpolation>,
    /// Filter of the gradient; `None`: no filter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensitivity_filter: Option<SensitivityFilter>,
    /// Densities as weighted means of the variables around an element; `None`: no filter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density_filter: Option<DensityFilter>,
    /// Projection of the variables, after the density filter; `None`: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub projection: Option<Projection>,
    /// Thickness of the thinnest member and the narrowest gap, > 0: an optimization improves the
    /// worst of an eroded, the nominal and a dilated design. The radius of the density filter follows
    /// from it, and the threshold of the projection is 0.5; `None`: only the nominal design. \[L\]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub minimum_thickness: Option<f64>,
    /// Printability, after the projection; `None`: densities are not restricted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub overhang: Option<Overhang>,
    /// Motions that map the design onto itself.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub symmetry: Vec<DesignSymmetry>,
    /// The density of each body is constant along this direction; `None`: it may vary.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extrude: Option<Direction>,
    /// Cells that the design repeats.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pattern: Vec<Pattern>,
    /// Elements whose centroid lies in one of these regions keep density 1.
    pub passive_solid: Vec<Region>,
    /// Elements whose centroid lies in one of these regions keep density 0.
    pub passive_void: Vec<Region>,
}

/// Sensitivity filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct SensitivityFilter {
    /// Radius, > 0. \[L\]
    pub radius: f64,
}

/// Density filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct DensityFilter {
    /// Radius, > 0. \[L\]
    pub radius: f64,
    /// What the filter sees beyond the faces of the design bodies.
    pub boundary: FilterBoundary,
}

impl DensityFilter {
    /// Radius of the filter over the thickness of the thinnest plate that it leaves, if the
    /// thresholds of the eroded and the dilated design are 0.75 and 0.25: a plate that just vanishes
    /// when eroded is 0.8819 radii thick, as the integrals of the cone show. A bar, or a wall in a
    /// mesh of one layer, is thicker. Test: `thickness_of_a_plate`.
    pub const RADIUS_OVER_THICKNESS: f64 = 1.134;

    /// The filter for a minimum thickness, with the default boundary.
    pub fn for_thickness(thickness: f64) -> Self {
        Self { radius: Self::RADIUS_OVER_THICKNESS * thickness, boundary: FilterBoundary::Truncated }
    }
}

/// What a density filter sees beyond the faces of the design bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FilterBoundary {
    /// Nothing: the mean is over the elements that exist.
    Truncated,
    /// Void beyond free faces: those without contact, support, prescribed motion, load or symmetry
    /// plane.
    Void,
}

/// Smooth threshold that pushes densities to 0 or 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Projection {
    /// Sharpness β > 0.
    pub sharpness: f64,
    /// Threshold η in \[0, 1\].
    pub threshold: f64,
}

impl Projection {
    /// β = 8 and η = 0.5.
    pub const DEFAULT: Self = Self { sharpness: 8.0, threshold: 0.5 };

    /// How an optimization of so many updates gets to the default sharpness: it begins with 1 and doubles
    /// after 30, 45 and 60 % of the updates, as in Wang, Lazarov and Sigmund, Struct. Multidiscip. Optim. 43
    /// (2011) 767–784, who double it at regular intervals. With fewer than ten updates, it does not change.
    pub fn continuation(iterations: usize) -> Steps {
        if iterations < 10 {
            return Steps::default();
        }
        let doubled = [30, 45, 60].map(|percent| (percent * iterations + 50) / 100);
        let entries = [0].into_iter().chain(doubled).zip([1.0, 2.0, 4.0, Self::DEFAULT.sharpness]);
        Steps::new(entries.collect()).unwrap_or_default()
    }
}

/// What is minimized.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Objective {
    /// In each load case.
    #[serde(flatten)]
    pub kind: ObjectiveKind,
    /// How the values of several load cases become one.
    #[serde(skip_serializing_if = "is_sum")]
    pub load_cases: OverLoadCases,
}

fn is_sum(over: &OverLoadCases) -> bool {
    *over == OverLoadCases::Sum
}

/// What is minimized in each load case.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ObjectiveKind {
    /// Minus the sum of the norms of the slave nodes' contact forces, friction included. This is
    /// not their resultant: forces in different directions do not cancel. Paper: (91), (96).
    ContactForce {
        /// The load steps in which it is evaluated.
        steps: ObservedSteps,
    },
    /// Work of the loads on the displacements, f_ext · d.
    Compliance {
        /// The load steps in which it is evaluated.
        steps: ObservedSteps,
    },
    /// A sum of quantities, or the largest of them, is made small.
    Minimise(Combination),
    /// A sum of quantities, or the smallest of them, is made large: θ is its negative.
    Maximise(Combination),
    /// A quantity is brought close to a curve over pseudo-time: θ is the root mean square distance
    /// at its points, relative to the largest of their values.
    Follow(CurveToFollow),
}

impl ObjectiveKind {
    /// Description of θ:
    /// `minus the sum of the magnitudes of the nodal contact forces, …, at the last load step`.
    pub fn about(&self) -> String {
        let (what, steps) = match self {
            Self::ContactForce { steps } => (
                "minus the sum of the magnitudes of the nodal contact forces, friction included (not their resultant)"
                    .to_owned(),
                steps,
            ),
            Self::Compliance { steps } => ("the work of the loads on the displacements".to_owned(), steps),
            Self::Minimise(combination) => (combination.about("", "largest"), &combination.steps),
            Self::Maximise(combination) => (combination.about("minus ", "smallest"), &combination.steps),
            Self::Follow(CurveToFollow { quantity, points }) => {
                return format!("the distance of `{quantity}` from a curve through {} points", points.len());
            }
        };
        format!("{what}, {steps}")
    }
}

impl Combination {
    fn about(&self, sign: &str, worst: &str) -> String {
        let term = |QuantityTerm { quantity, weight }: &QuantityTerm| match *weight {
            1.0 => format!("`{quantity}`"),
            weight => format!("{weight} × `{quantity}`"),
        };
        let terms: Vec<String> = self.sum.iter().map(term).collect();
        match (self.worst, &terms[..]) {
            (true, _) => format!("{sign}the {worst} of {}", terms.join(", ")),
            (false, [one]) => format!("{sign}{one}"),
            (false, _) => format!("{sign}({})", terms.join(" + ")),
        }
    }
}

/// A version of Svanberg's method of moving asymptotes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OptimizerMethod {
    /// One march and one sweep per iteration.
    Mma,
    /// Further marches until the approximations are conservative; the objective then decreases
    /// monotonically.
    Gcmma,
}

/// The optimizer and when it stops.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Optimizer {
    /// Which method chooses the next design.
    pub method: OptimizerMethod,
    /// Most inner iterations of a design iteration, each of them a march; for `gcmma` only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inner_iterations: Option<usize>,
    /// Parameters of the method of moving asymptotes, for either method.
    pub mma: MmaParameters,
    /// With `mma`: whether updates that leave the bounds or raise the objective are made again as in
    /// GCMMA, and the next ones made so.
    pub adaptive: bool,
    /// Maximum number of iterations.
    pub iterations: usize,
    /// The optimizer stops when no variable changes by more than this in an iteration and the other
    /// criteria are met; without any criterion, it runs all iterations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// The optimizer stops when the optimality residual is at most this and the other criteria are
    /// met.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub optimality: Option<f64>,
    /// The optimizer stops when the share of intermediate densities is at most this and the other
    /// criteria are met.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub discreteness: Option<f64>,
    /// Parameters that change over the iterations; the criteria for stopping apply after the last
    /// change.
    #[serde(skip_serializing_if = "Schedule::is_empty")]
    pub schedule: Schedule,
}

fn is_one(power: &f64) -> bool {
    *power == 1.0
}

fn is_default_bulk(power: &f64) -> bool {
    *power == Interpolation::BULK
}
