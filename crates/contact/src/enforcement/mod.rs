//! Enforcement of the contact conditions at a slave node: Lagrange multipliers, or a regularised traction
//! (penalty and augmented Lagrangian).
//!
//! All quantities are the node's own: multiplier components ζ = (ζ_n, ζ_ξ, ζ_η) in its frame, weighted gap g̃, slip
//! increment ũ_τ and tributary area A.

pub mod lagrange;
pub mod regularised;

use nalgebra::Vector2;

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
