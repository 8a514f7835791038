//! Contact pairs and their enforcement.

use schemars::JsonSchema;
use serde::{Serialize, Serializer};
use slipstick_contact::enforcement::soft::PressureLaw;
use slipstick_model::model::{FrictionPoint, OffsetPoint};

use super::Case;

pub use slipstick_contact::enforcement::StiffnessScaling;
pub use slipstick_contact::kinematics::MultiplierShape;

/// A contact pair.
#[derive(Debug, Clone, PartialEq, JsonSchema)]
pub struct Contact {
    /// The surface that carries the multipliers and over which contact integrals are taken.
    pub slave: String,
    /// The other surface.
    pub master: String,
    /// Whether they stay as they are named. A case that has been read has `as_given`.
    pub sides: Sides,
    /// Coefficient of friction μ ≥ 0; 0 for tied surfaces.
    pub friction: f64,
    /// Factors on it along the load path: waypoints, linear in between, and constant before the first and after the
    /// last; without any, 1.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub friction_path: Vec<FrictionPoint>,
    /// Whether the surfaces are tied: they neither separate nor slide.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub tied: bool,
    /// Largest shear stress that friction transmits; `None`: no bound. \[F/L²\]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shear_limit: Option<f64>,
    /// Distance by which the surfaces touch before their meshes do: waypoints, linear in between,
    /// from 0 at t = 0 if the first is later, and constant after the last.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub offset: Vec<OffsetPoint>,
    /// Pseudo-times from and to which the surfaces interact.
    #[serde(skip_serializing_if = "Contact::always")]
    pub active: [f64; 2],
    /// Shape functions of the multipliers; `None`: standard ones, the mean of standard and dual ones
    /// where the slave is a curved surface of few facets, and dual ones at tapers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub multiplier_shape: Option<MultiplierShape>,
    /// Integration points on each triangle of a mortar segment: 1, 3, 6, 7 or 12.
    pub cell_rule: usize,
    /// Distance within which facets are paired \[L\]; `None`: chosen from facet sizes and the
    /// motion of a step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub search_radius: Option<f64>,
    /// Angle between neighbouring slave facets above which the edge between them is
    /// sharp. \[degrees\]
    pub feature_angle: f64,
    /// Fraction of the area around a slave node that the master must cover for the node's contact
    /// condition to be rigid.
    pub edge_cover: f64,
    /// The surfaces between which the gap is measured.
    pub surfaces: Surfaces,
    /// Gaps and penetrations in the mesh that count as closed, or as a given gap; `None`: none do.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adjust: Option<Adjust>,
    /// The direction of contact forces where the slave surface meets an edge of its body; `None`: that of
    /// the master where a flat slave surface ends at an edge, unless the bodies lie on each other in the
    /// mesh, where the slave is a curved surface of few facets, and at edges on inclined curved surfaces;
    /// otherwise averaged normals.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub normals: Option<Normals>,
    /// How the contact conditions are enforced.
    pub enforcement: Enforcement,
}

impl Case {
    /// Whether all pairs with this slave surface are ties: such a surface has no friction.
    pub fn is_tie(&self, slave: &str) -> bool {
        let mut pairs = self.contacts.iter().filter(|pair| pair.slave == slave).peekable();
        pairs.peek().is_some() && pairs.all(|pair| pair.tied)
    }

    /// The pairs that pictures of contact show: those whose surfaces may separate or slide; if there are
    /// none, the ties.
    pub fn shown_contacts(&self) -> impl Iterator<Item = &Contact> {
        let ties = self.contacts.iter().all(|pair| pair.tied);
        self.contacts.iter().filter(move |pair| pair.tied == ties)
    }
}

/// A tied pair is written without the keys that the reader refuses there.
impl Serialize for Contact {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Written<'a> {
            slave: &'a str,
            master: &'a str,
            #[serde(flatten)]
            sliding: Option<Sliding<'a>>,
            #[serde(skip_serializing_if = "std::ops::Not::not")]
            tied: bool,
            #[serde(skip_serializing_if = "Contact::always")]
            active: [f64; 2],
            #[serde(skip_serializing_if = "Option::is_none")]
            multiplier_shape: Option<MultiplierShape>,
            cell_rule: usize,
            #[serde(skip_serializing_if = "Option::is_none")]
            search_radius: Option<f64>,
            enforcement: &'a Enforcement,
        }
        #[derive(Serialize)]
        struct Sliding<'a> {
            friction: f64,
            #[serde(skip_serializing_if = "<[_]>::is_empty")]
            friction_path: &'a [FrictionPoint],
            #[serde(skip_serializing_if = "Option::is_none")]
            shear_limit: Option<f64>,
            #[serde(skip_serializing_if = "<[_]>::is_empty")]
            offset: &'a [OffsetPoint],
            feature_angle: f64,
            edge_cover: f64,
            surfaces: Surfaces,
            #[serde(skip_serializing_if = "Option::is_none")]
            adjust: Option<&'a Adjust>,
            #[serde(skip_serializing_if = "Option::is_none")]
            normals: Option<Normals>,
        }
        let sliding = Sliding {
            friction: self.friction,
            friction_path: &self.friction_path,
            shear_limit: self.shear_limit,
            offset: &self.offset,
            feature_angle: self.feature_angle,
            edge_cover: self.edge_cover,
            surfaces: self.surfaces,
            adjust: self.adjust.as_ref(),
            normals: self.normals,
        };
        Written {
            slave: &self.slave,
            master: &self.master,
            sliding: (!self.tied).then_some(sliding),
            tied: self.tied,
            active: self.active,
            multiplier_shape: self.multiplier_shape,
            cell_rule: self.cell_rule,
            search_radius: self.search_radius,
            enforcement: &self.enforcement,
        }
        .serialize(serializer)
    }
}

/// The slave nodes whose gaps in the mesh count as another gap, without stress.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Adjust {
    /// Those with a gap or penetration of at most this distance count as touching. \[L\]
    Distance(f64),
    /// Which gaps change, and the gap that these nodes get; at least one of the keys.
    Chosen {
        /// The largest gap or penetration that changes; `None`: any that is found. \[L\]
        #[serde(skip_serializing_if = "Option::is_none")]
        distance: Option<f64>,
        /// The node set; `None`: all slave nodes.
        #[serde(skip_serializing_if = "Option::is_none")]
        nodes: Option<String>,
        /// The gap that they get, 0 by default; negative: a penetration. \[L\]
        #[schemars(default)]
        gap: f64,
    },
}

impl Adjust {
    /// The largest gap or penetration that changes; infinite if any does. \[L\]
    pub fn distance(&self) -> f64 {
        match *self {
            Self::Distance(distance) => distance,
            Self::Chosen { distance, .. } => distance.unwrap_or(f64::INFINITY),
        }
    }

    /// The node set whose nodes are chosen; `None`: all slave nodes.
    pub fn nodes(&self) -> Option<&str> {
        match self {
            Self::Chosen { nodes, .. } => nodes.as_deref(),
            Self::Distance(_) => None,
        }
    }

    /// The gap that the nodes get; negative: a penetration. \[L\]
    pub fn gap(&self) -> f64 {
        match *self {
            Self::Distance(_) => 0.0,
            Self::Chosen { gap, .. } => gap,
        }
    }
}

/// Which of the two surfaces of a pair is the slave.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sides {
    /// As the keys say.
    AsGiven,
    /// As the keys say, unless contact would be missed: where the facets of a flat slave are larger than those of a convex
    /// master, and where the master, but not the slave, ends at an edge on an inclined surface.
    #[default]
    Corrected,
    /// The one with smaller facets; of similar ones the convex one on a surface that is not, then the softer one.
    Chosen,
}

/// The surfaces between which the gap of a contact pair is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Surfaces {
    /// The smooth surfaces for which the facets stand: spheres, cylinders, cones and tori through
    /// all nodes of a patch, or surfaces with averaged normals.
    #[default]
    Smooth,
    /// The facets themselves.
    Faceted,
}

/// The normals of slave nodes at edges of their body, and where facets meet at more than 10°;
/// elsewhere, normals are averaged over the facets around the node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Normals {
    /// Those of the master, within the normal cone of the edge.
    Touched,
    /// Those of the slave facets around the node; at a sharp edge within the slave surface, those of
    /// the master.
    Averaged,
}

impl Contact {
    /// Default of [`feature_angle`](Self::feature_angle).
    pub const FEATURE_ANGLE: f64 = 45.0;
    /// Default of [`edge_cover`](Self::edge_cover).
    pub const EDGE_COVER: f64 = 0.5;
    /// Default of [`active`](Self::active): the whole load path.
    pub const ALWAYS: [f64; 2] = [0.0, 1.0];

    fn always(active: &[f64; 2]) -> bool {
        *active == Self::ALWAYS
    }
}

/// Numbers of points of the triangle rules that `cell_rule` may name; exact to degree 1, 2, 4,
/// 5, 6.
pub const CELL_RULES: [usize; 5] = [1, 3, 6, 7, 12];

/// How the contact conditions are enforced.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Enforcement {
    /// Lagrange multipliers and semi-smooth Newton. Paper: section 2.3.
    Lagrange {
        /// Unit-free factor f of the complementarity parameters c_n = f·E/(h A) and c_t = 2.5 c_n.
        /// The solution does not depend on them. `None`: `stiffness` gives them.
        #[serde(skip_serializing_if = "Option::is_none")]
        complementarity_parameter: Option<f64>,
        /// c_n and c_t in units; `None`: from `complementarity_parameter`.
        #[serde(skip_serializing_if = "Option::is_none")]
        stiffness: Option<Stiffness>,
        /// What c_n and c_t multiply.
        scaling: StiffnessScaling,
    },
    /// Penalty. Paper: section 2.4.
    Penalty {
        /// The pressure as a function of the gap; `None`: in proportion to the penetration. With it,
        /// `stiffness` is that of sticking.
        #[serde(skip_serializing_if = "Option::is_none")]
        pressure: Option<Pressure>,
        /// Where the pressure follows from the gap.
        #[serde(skip_serializing_if = "PressureAt::is_nodes")]
        pressure_at: PressureAt,
        /// Stiffness; `None`: chosen from the bodies' moduli and element sizes.
        #[serde(skip_serializing_if = "Option::is_none")]
        stiffness: Option<Stiffness>,
        /// What the stiffness multiplies.
        scaling: StiffnessScaling,
    },
    /// Augmented Lagrangian, Uzawa's iteration. Paper: section 2.5.
    Augmented {
        /// Stiffness; `None`: chosen from the bodies' moduli and element sizes.
        #[serde(skip_serializing_if = "Option::is_none")]
        stiffness: Option<Stiffness>,
        /// What the stiffness multiplies.
        scaling: StiffnessScaling,
        /// Tolerance of the nodal contact conditions (the paper's ε_ALM).
        tolerance: f64,
        /// What the tolerance is relative to.
        tolerance_scaling: ToleranceScaling,
        /// Maximum number of Uzawa iterations in a load step.
        max_uzawa: usize,
        /// Number of previous multiplier updates that Anderson acceleration uses; 0: the plain
        /// iteration of the paper, without second-order updates.
        acceleration: usize,
    },
}

impl Enforcement {
    /// Whether the pressure follows from the gap at each integration point.
    pub fn is_at_points(&self) -> bool {
        matches!(self, Self::Penalty { pressure_at: PressureAt::Points, .. })
    }

    /// The pressure as a function of the gap, if it is not in proportion to the penetration.
    pub fn pressure_law(&self) -> Option<PressureLaw> {
        let Self::Penalty { pressure: Some(law), .. } = self else { return None };
        Some(match law {
            &Pressure::Exponential { contact_pressure, clearance } => {
                PressureLaw::Exponential { contact_pressure, clearance }
            }
            Pressure::Table { penetration, pressure } => {
                PressureLaw::Table(penetration.iter().zip(pressure).map(|(&at, &p)| [at, p]).collect())
            }
        })
    }
}

/// Where the pressure of the penalty method follows from the gap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PressureAt {
    /// At the slave nodes, from their mean gaps.
    #[default]
    Nodes,
    /// At each integration point, from its own gap.
    Points,
}

impl PressureAt {
    fn is_nodes(&self) -> bool {
        *self == Self::Nodes
    }
}

/// Pressures that do not grow in proportion to the penetration.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Pressure {
    /// Grows by the same factor over equal distances, p₀ 100^(−g/c₀), also across a gap.
    Exponential {
        /// The pressure p₀ > 0 without a gap. \[F/L²\]
        contact_pressure: f64,
        /// The gap c₀ > 0 at which the pressure is 1 % of p₀. \[L\]
        clearance: f64,
    },
    /// Linear between points, of which the first has no pressure, and constant after the last.
    Table {
        /// Ascending; negative: gaps. \[L\]
        penetration: Vec<f64>,
        /// The pressure at each penetration, from 0, not descending. \[F/L²\]
        pressure: Vec<f64>,
    },
}

/// Penalty stiffness ε, or complementarity parameters c.
///
/// \[F/L³\] with [`StiffnessScaling::Area`] and [`StiffnessScaling::ReferenceArea`], \[F/L⁵\] with
/// [`StiffnessScaling::Weighted`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Stiffness {
    /// ε_n or c_n > 0.
    pub normal: f64,
    /// ε_τ or c_t > 0.
    pub tangential: f64,
}

/// What the augmented Lagrangian's tolerance is relative to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ToleranceScaling {
    /// Relative to the largest contact traction: unit-free.
    Relative,
    /// Absolute: the bound applies to the conditions themselves, as in the paper.
    Absolute,
}
