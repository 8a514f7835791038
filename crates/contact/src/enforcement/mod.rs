//! Enforcement of the contact conditions at a slave node: Lagrange multipliers, or a regularized
//! traction (penalty and augmented Lagrangian); and bonds.
//!
//! All quantities belong to the node: multiplier components ζ = (ζ_n, ζ_ξ, ζ_η) in its frame,
//! weighted gap g̃, slip increment ũ_τ and tributary area A.

pub mod bonded;
pub mod lagrange;
pub mod regularised;
pub mod soft;
mod tangential;

use nalgebra::Vector2;
use schemars::JsonSchema;
use serde::Serialize;

/// What a stiffness multiplies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StiffnessScaling {
    /// Gap and slip divided by the node's tributary area in the current configuration: in F/L³,
    /// independent of the mesh.
    #[default]
    Area,
    /// Gap and slip divided by the whole area around the node in the reference configuration,
    /// regardless of its covered part: in F/L³. The penalty becomes softer as the surface shrinks,
    /// and as the other surface slides off it.
    ReferenceArea,
    /// The weighted gap and slip themselves, as in the paper: in F/L⁵.
    Weighted,
}

impl StiffnessScaling {
    /// The divisor of weighted measures at a covered node.
    pub fn divisor(self, at: &NodeMeasures) -> f64 {
        match self {
            Self::Area => at.area,
            Self::ReferenceArea => at.reference_area,
            Self::Weighted => 1.0,
        }
    }
}

/// A stiffness for each direction, with its scaling: ε_n and ε_τ of the regularized methods, on
/// which the solution depends (penalty) or not (augmented Lagrangian), or c_n and c_t of the
/// complementarity functions, which only affect the iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stiffness {
    /// ε_n or c_n.
    pub normal: f64,
    /// ε_τ or c_t.
    pub tangential: f64,
    /// The measures that the stiffness multiplies.
    pub scaling: StiffnessScaling,
}

impl Stiffness {
    /// The same stiffness times `factor`.
    pub fn times(self, factor: f64) -> Self {
        Self { normal: factor * self.normal, tangential: factor * self.tangential, ..self }
    }
}

/// The gaps and slip increments that the free displacements can produce, if others are prescribed
/// at the slave node and at all opposite nodes.
///
/// A contact condition on a prescribed measure does not determine the multiplier component that
/// enforces it. That component is set to the limit of the penalty method: zero if nothing slips, on
/// the friction cone if the slip is prescribed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Freedom {
    /// Gap and slip.
    #[default]
    Full,
    /// The gap, and slip perpendicular to `direction`, a unit vector in the node's tangent basis.
    /// With a closed gap, the surfaces slip along it only if `driven`.
    SlipAcross {
        /// The direction of prescribed slip.
        direction: Vector2<f64>,
        /// Whether the prescribed slip is not zero.
        driven: bool,
    },
    /// Only the gap.
    Gap {
        /// Whether the prescribed slip is not zero.
        driven: bool,
    },
    /// No gap: it is prescribed, and its multiplier is zero.
    None,
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
    /// Area of the slave surface around the node in the reference configuration, the scale for
    /// slivers. \[L²\]
    pub reference_area: f64,
    /// Stiffness s of the contact condition on a partly covered node, see [`Self::compliance`];
    /// infinite: rigid, as at other nodes. \[F/L³\]
    pub edge_stiffness: f64,
    /// Fraction χ > 0 of the reference area below which the contact condition is compliant.
    pub edge_cover: f64,
    /// Load P of the node where the pressure depends on the gap at each integration point
    /// ([`crate::kinematics::pressed`]); `None` elsewhere.
    pub load: Option<f64>,
    /// Which measures are not prescribed.
    pub freedom: Freedom,
}

impl NodeMeasures {
    /// Whether enough of the other surface lies opposite for a contact condition.
    pub fn covered(&self) -> bool {
        covered(self.area, self.reference_area)
    }

    /// k(A) and dk/dA of the contact condition at a partly covered node, g̃ + k ζ_n = 0. \[L⁵/F\]
    ///
    /// A node that the other surface begins to cover would have to close its gap with a finite
    /// force on zero area: the solution would jump as soon as the node is covered. Two rigid
    /// conditions on a partly covered facet also overconstrain the displacements of the finite
    /// elements and attract too much force to the edge (docs/edges.md). With k = κ A/s, where
    /// κ = (1 − A/(χ A_ref))² below the fraction χ of the reference area and 0 above, the node's
    /// force grows from zero with the area, like that of a penalty s.
    ///
    /// Test: `compliance_matches_finite_differences`.
    pub fn compliance(&self) -> (f64, f64) {
        let limit = self.edge_cover * self.reference_area;
        let missing = 1.0 - self.area / limit;
        if missing <= 0.0 {
            return (0.0, 0.0);
        }
        let slope = -2.0 * missing / limit;
        (
            missing * missing * self.area / self.edge_stiffness,
            (missing * missing + slope * self.area) / self.edge_stiffness,
        )
    }
}

/// Overlaps below this fraction of the reference area carry no contact condition.
const SLIVER: f64 = 1e-9;

/// Whether a tributary area of the overlap is enough for a contact condition at a node with this
/// area in the reference configuration.
pub fn covered(area: f64, reference_area: f64) -> bool {
    area > SLIVER * reference_area
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The compliance and its derivative are continuous, and zero from the bound on.
    #[test]
    fn compliance_matches_finite_differences() {
        let at = |area: f64| NodeMeasures {
            gap: 0.0,
            slip: Vector2::zeros(),
            area,
            reference_area: 2.0,
            edge_stiffness: 300.0,
            edge_cover: 0.05,
            load: None,
            freedom: Freedom::Full,
        };
        let k = |area: f64| at(area).compliance().0;
        for area in [1e-6, 0.01, 0.05, 0.0999, 0.1, 0.1001, 1.0] {
            let h = 1e-7 * area;
            let expected = (k(area + h) - k(area - h)) / (2.0 * h);
            assert!((at(area).compliance().1 - expected).abs() < 1e-6 / 300.0, "{area}");
        }
        // by hand: κ = ¼ at half of the bound
        assert!((k(0.05) - 0.25 * 0.05 / 300.0).abs() < 1e-18);
        assert_eq!(NodeMeasures { edge_stiffness: f64::INFINITY, ..at(0.05) }.compliance(), (0.0, 0.0));
    }
}
