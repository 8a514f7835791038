//! Named quantities, and the objective and constraints that are made of them.

use schemars::JsonSchema;
use serde::Serialize;

use super::{BoxRegion, Dimension};
pub use slipstick_design::{ObservedSteps, OverLoadCases};

/// A number that every state of the load path has: a column of `quantities.csv`, and what
/// objective and constraints are made of.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Quantity {
    /// Unique name.
    pub name: String,
    /// What it measures.
    #[serde(flatten)]
    pub kind: QuantityKind,
}

/// What a quantity measures.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum QuantityKind {
    /// Force that supports and prescribed motions exert on a set. \[F\]
    Reaction {
        /// Surface or node set.
        set: String,
        /// Component or norm.
        component: VectorComponent,
    },
    /// Moment of these forces about an axis, at the current positions. \[F L\]
    Moment {
        /// Surface or node set.
        set: String,
        /// A point on the axis. \[L\]
        point: [f64; 3],
        /// Direction of the axis; its length does not matter.
        direction: [f64; 3],
    },
    /// Contact force on the slave of a pair. \[F\]
    ContactForce {
        /// Slave surface of the pair.
        slave: String,
        /// Component or norm of the resultant, or a sum over the nodes.
        component: ForceComponent,
        /// Surface or node set; only slave nodes in it count. `None`: all.
        #[serde(skip_serializing_if = "Option::is_none")]
        within: Option<String>,
    },
    /// Pressure between the surfaces of a pair. \[F/L²\]
    ContactPressure {
        /// Slave surface of the pair.
        slave: String,
        /// The number that the nodal pressures become.
        measure: PressureWord,
        /// Exponent p of the peak, factor k of the minimum: the larger, the closer to the extreme
        /// value. 0 for the other measures.
        #[serde(skip_serializing_if = "is_unused")]
        sharpness: f64,
        /// Surface or node set; only slave nodes in it count. `None`: all.
        #[serde(skip_serializing_if = "Option::is_none")]
        within: Option<String>,
    },
    /// Share of the slave surface of a pair that carries the contact force, from 0 to 1.
    ContactShare {
        /// Slave surface of the pair.
        slave: String,
        /// Surface or node set; only slave nodes in it count. `None`: all.
        #[serde(skip_serializing_if = "Option::is_none")]
        within: Option<String>,
    },
    /// Gap between the surfaces of a pair, positive where open. \[L\]
    Gap {
        /// Slave surface of the pair.
        slave: String,
        /// The number that the nodal gaps become.
        measure: GapWord,
        /// Factor k of the minimum: the larger, the closer to the smallest gap. 0 for the mean.
        #[serde(skip_serializing_if = "is_unused")]
        sharpness: f64,
        /// Surface or node set; only slave nodes in it count. `None`: all.
        #[serde(skip_serializing_if = "Option::is_none")]
        within: Option<String>,
    },
    /// Work that friction has dissipated between the surfaces of a pair. \[F L\]
    FrictionWork {
        /// Slave surface of the pair.
        slave: String,
        /// Surface or node set; only slave nodes in it count. `None`: all.
        #[serde(skip_serializing_if = "Option::is_none")]
        within: Option<String>,
    },
    /// Work that loads, supports and prescribed motions do on the bodies. \[F L\]
    ExternalWork {
        /// Surface or node set; only the work at its nodes counts. `None`: all.
        #[serde(skip_serializing_if = "Option::is_none")]
        set: Option<String>,
    },
    /// Mean displacement of a set: over the reference area of a surface, over the nodes of a set.
    /// \[L\]
    Displacement {
        /// Surface or node set.
        set: String,
        /// Component or norm.
        component: VectorComponent,
        /// Surface or node set whose mean displacement is subtracted.
        #[serde(skip_serializing_if = "Option::is_none")]
        relative_to: Option<String>,
    },
    /// Elastic energy. \[F L\]
    StrainEnergy {
        /// The body; `None`: all.
        #[serde(skip_serializing_if = "Option::is_none")]
        body: Option<String>,
    },
    /// Largest von Mises stress of the material: the p-norm over the Gauss points, relaxed for
    /// intermediate densities. \[F/L²\]
    Stress {
        /// The body; `None`: all.
        #[serde(skip_serializing_if = "Option::is_none")]
        body: Option<String>,
        /// Only elements whose centroid lies in one of these boxes count; empty: all.
        within: Vec<BoxRegion>,
        /// Exponent p of the norm: the larger, the closer to the largest stress.
        sharpness: f64,
    },
    /// Largest equivalent plastic strain: the p-norm over the Gauss points, relaxed for intermediate densities.
    PlasticStrain {
        /// The body; `None`: all.
        #[serde(skip_serializing_if = "Option::is_none")]
        body: Option<String>,
        /// Only elements whose centroid lies in one of these boxes count; empty: all.
        within: Vec<BoxRegion>,
        /// Exponent p of the norm: the larger, the closer to the largest strain.
        sharpness: f64,
    },
    /// Work of the loads on the displacements, f_ext · d. \[F L\]
    Compliance {},
    /// Volume of the material in the reference configuration, Σ φ_e V_e. \[L³\]
    Volume {
        /// The body; `None`: all.
        #[serde(skip_serializing_if = "Option::is_none")]
        body: Option<String>,
    },
    /// Mass of the material, ρ Σ φ_e V_e. \[M\]
    Mass {
        /// The body; `None`: all.
        #[serde(skip_serializing_if = "Option::is_none")]
        body: Option<String>,
        /// ρ of the solid material. \[M/L³\]
        mass_density: f64,
    },
}

impl QuantityKind {
    /// Keys of all kinds.
    pub const KEYS: &'static [&'static str] = &[
        "reaction",
        "moment",
        "contact_force",
        "contact_pressure",
        "contact_share",
        "gap",
        "friction_work",
        "external_work",
        "displacement",
        "strain_energy",
        "stress",
        "plastic_strain",
        "compliance",
        "volume",
        "mass",
    ];

    /// The key of the kind, one of [`Self::KEYS`].
    pub fn key(&self) -> &'static str {
        match self {
            Self::Reaction { .. } => "reaction",
            Self::Moment { .. } => "moment",
            Self::ContactForce { .. } => "contact_force",
            Self::ContactPressure { .. } => "contact_pressure",
            Self::ContactShare { .. } => "contact_share",
            Self::Gap { .. } => "gap",
            Self::FrictionWork { .. } => "friction_work",
            Self::ExternalWork { .. } => "external_work",
            Self::Displacement { .. } => "displacement",
            Self::StrainEnergy { .. } => "strain_energy",
            Self::Stress { .. } => "stress",
            Self::PlasticStrain { .. } => "plastic_strain",
            Self::Compliance {} => "compliance",
            Self::Volume { .. } => "volume",
            Self::Mass { .. } => "mass",
        }
    }

    /// Whether it depends on the state, and not only on the densities.
    pub fn depends_on_state(&self) -> bool {
        !matches!(self, Self::Volume { .. } | Self::Mass { .. })
    }

    /// The dimension of its values.
    pub fn dimension(&self) -> Dimension {
        match self {
            Self::Reaction { .. } | Self::ContactForce { .. } => Dimension::FORCE,
            Self::Moment { .. }
            | Self::FrictionWork { .. }
            | Self::ExternalWork { .. }
            | Self::StrainEnergy { .. }
            | Self::Compliance {} => Dimension::WORK,
            Self::ContactPressure { measure: PressureWord::Spread, .. } | Self::ContactShare { .. } => Dimension::NONE,
            Self::PlasticStrain { .. } => Dimension::NONE,
            Self::ContactPressure { .. } | Self::Stress { .. } => Dimension::STRESS,
            Self::Gap { .. } | Self::Displacement { .. } => Dimension::LENGTH,
            Self::Volume { .. } => Dimension::VOLUME,
            Self::Mass { .. } => Dimension::MASS,
        }
    }
}

/// A component of a vector, or its norm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum VectorComponent {
    /// An axis or the norm.
    Word(VectorWord),
    /// The component along a direction, whose length does not matter.
    Direction([f64; 3]),
}

/// An axis or the norm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum VectorWord {
    /// Along x.
    X,
    /// Along y.
    Y,
    /// Along z.
    Z,
    /// The norm.
    Norm,
}

/// How contact forces are reduced to one number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum ForceComponent {
    /// An axis, the norm, or a sum over the nodes.
    Word(ForceWord),
    /// The component along a direction, whose length does not matter.
    Direction([f64; 3]),
}

/// An axis, the norm, or a sum over the nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForceWord {
    /// Component of the resultant along x.
    X,
    /// Component of the resultant along y.
    Y,
    /// Component of the resultant along z.
    Z,
    /// Norm of the resultant.
    Norm,
    /// Sum of the normal forces.
    Normal,
    /// Sum of the magnitudes of the friction forces.
    Tangential,
    /// Sum of the magnitudes of the nodal forces, the paper's objective (91).
    Nodal,
}

/// How nodal pressures are reduced to one number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PressureWord {
    /// p-norm of the nodal pressures, not below the largest.
    Peak,
    /// Mean over the area that faces the master.
    Mean,
    /// Standard deviation over that area, divided by the mean.
    Spread,
    /// Smooth minimum of the nodal pressures, between the smallest and the mean.
    Minimum,
}

/// How nodal gaps are reduced to one number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GapWord {
    /// Mean over the area that faces the master.
    Mean,
    /// Smooth minimum of the nodal gaps, not above the smallest.
    Minimum,
}

/// A quantity with a weight.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct QuantityTerm {
    /// Name of a `[[quantity]]`.
    pub quantity: String,
    /// Its factor.
    pub weight: f64,
}

/// A weighted sum of quantities over load steps, or the worst of them.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Combination {
    /// The quantities with their weights.
    pub sum: Vec<QuantityTerm>,
    /// The load steps in which they count.
    pub steps: ObservedSteps,
    /// Instead of the sum, the worst of all quantities and steps: the largest if minimised, the
    /// smallest if maximised.
    pub worst: bool,
}

/// Points that a quantity should pass through.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CurveToFollow {
    /// Name of a `[[quantity]]`.
    pub quantity: String,
    /// Pseudo-time and value of each point, with ascending times above 0.
    pub points: Vec<[f64; 2]>,
}

/// A bound on a quantity.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Constraint {
    /// Name of a `[[quantity]]`.
    pub quantity: String,
    /// The load steps at which it holds.
    pub steps: ObservedSteps,
    /// Bound from above, in units of the quantity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// Bound from below, in units of the quantity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// Whether the bound holds for the extreme itself where a smooth measure (`minimum`, `peak`,
    /// `stress`) errs on the unsafe side; `false`: for the smooth measure.
    #[serde(skip_serializing_if = "is_true")]
    pub corrected: bool,
}

fn is_true(value: &bool) -> bool {
    *value
}

/// Whether a measure has no sharpness.
fn is_unused(sharpness: &f64) -> bool {
    *sharpness == 0.0
}
