//! Enforcement of the contact conditions at a slave node: Lagrange multipliers, or a regularised traction
//! (penalty and augmented Lagrangian).
//!
//! All quantities are the node's own: multiplier components ζ = (ζ_n, ζ_ξ, ζ_η) in its frame, weighted gap g̃, slip
//! increment ũ_τ and tributary area A.

pub mod lagrange;
pub mod regularised;

use nalgebra::Vector2;

/// What a stiffness multiplies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StiffnessScaling {
    /// Gap and slip divided by the node's tributary area: in F/L³, independent of the mesh.
    #[default]
    Area,
    /// The weighted gap and slip themselves, as in the paper: in F/L⁵.
    Weighted,
}

impl StiffnessScaling {
    /// What weighted measures are divided by, at a node of the given tributary area > 0.
    pub fn divisor(self, area: f64) -> f64 {
        match self {
            Self::Area => area,
            Self::Weighted => 1.0,
        }
    }
}

/// A stiffness for each direction with its meaning: the regularised methods' ε_n and ε_τ, which the solution depends on
/// (penalty) or not (augmented Lagrangian), and the c_n and c_t of the complementarity functions, which steer the
/// iteration only.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stiffness {
    /// ε_n or c_n.
    pub normal: f64,
    /// ε_τ or c_t.
    pub tangential: f64,
    /// What they multiply.
    pub scaling: StiffnessScaling,
}

impl Stiffness {
    /// The same, `factor` times as stiff.
    pub fn times(self, factor: f64) -> Self {
        Self { normal: factor * self.normal, tangential: factor * self.tangential, ..self }
    }
}

/// The geometric measures of one slave node that enter its contact law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodeMeasures {
    /// Weighted gap g̃, ≥ 0 open. \[L³\]
    pub gap: f64,
    /// Slip increment ũ_τ. \[L³\]
    pub slip: Vector2<f64>,
    /// Tributary area of the overlap, Σ_k D_jk. \[L²\]
    pub area: f64,
    /// Area of the slave surface around the node in the reference configuration: what counts as a sliver. \[L²\]
    pub reference_area: f64,
}

impl NodeMeasures {
    /// Overlaps below this fraction of the reference area carry no contact condition.
    pub const SLIVER: f64 = 1e-9;

    /// Whether enough of the other surface lies opposite for a contact condition.
    pub fn covered(&self) -> bool {
        self.area > Self::SLIVER * self.reference_area
    }
}
