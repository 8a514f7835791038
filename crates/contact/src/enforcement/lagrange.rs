//! Complementarity of the Lagrange multiplier method, in projected form.
//!
//! ```text
//! C = ζ − P(ζ_n − c_n g̃, ζ_τ + c_t ũ_τ),    P(p, t) = (max(0, p), Coulomb return map of t at p)
//! ```
//!
//! with g̃ replaced by g̃ + k ζ_n at partly covered nodes ([`NodeMeasures::compliance`]). C has the
//! same roots as (25), (26), the same active sets and the same adjoint, and Newton's method
//! converges more often. In the paper's product form the tangential rows are `max(μ p, ‖t‖)` times
//! the ones here.
//!
//! If slip along a tangent direction is prescribed ([`Freedom`]), P projects t onto the other
//! direction. If the prescribed slip is zero, the multiplier component along it is zero; otherwise
//! ζ_τ = μ p ũ_τ/‖ũ_τ‖.

use super::tangential::tangential;
use super::{Freedom, NodeMeasures, Stiffness};
use crate::ContactStatus;
use crate::friction::Friction;
use nalgebra::{Matrix3, Matrix3x2, Vector3};

/// Complementarity function of one node and its partial derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Complementarity {
    /// The set that the node belongs to.
    pub status: ContactStatus,
    /// C = (C_n, C_ξ, C_η). \[F/L²\]
    pub value: Vector3<f64>,
    /// ∂C/∂ζ.
    pub by_multiplier: Matrix3<f64>,
    /// ∂C/∂g̃. \[F/L⁵\]
    pub by_gap: Vector3<f64>,
    /// ∂C/∂ũ_τ. \[F/L⁵\]
    pub by_slip: Matrix3x2<f64>,
    /// ∂C/∂A at given c_n/A, c_t/A; zero except at partly covered nodes. \[F/L⁴\]
    pub by_area: Vector3<f64>,
    /// ∂C/∂μ. \[F/L²\]
    pub by_friction: Vector3<f64>,
    /// ∂C/∂τ_max.
    pub by_shear_limit: Vector3<f64>,
    /// ∂C/∂a of the direction a of prescribed slip, [`Freedom::SlipAcross`]; zero
    /// elsewhere. \[F/L²\]
    pub by_direction: Matrix3x2<f64>,
    /// ∂C/∂ln s with the stiffness s of a partly covered node; zero elsewhere. \[F/L²\]
    pub by_edge_stiffness: Vector3<f64>,
}

impl Complementarity {
    /// C = ζ of an open node.
    pub(super) fn open(multiplier: Vector3<f64>) -> Self {
        Self {
            status: ContactStatus::Inactive,
            value: multiplier,
            by_multiplier: Matrix3::identity(),
            by_gap: Vector3::zeros(),
            by_slip: Matrix3x2::zeros(),
            by_area: Vector3::zeros(),
            by_friction: Vector3::zeros(),
            by_shear_limit: Vector3::zeros(),
            by_direction: Matrix3x2::zeros(),
            by_edge_stiffness: Vector3::zeros(),
        }
    }
}

/// Evaluates C for one node.
///
/// `stiffness` contains c_n and c_t > 0. Neither the solution nor the adjoint depends on them, so
/// they are not differentiated, nor is the area by which they may be divided. Uncovered nodes are
/// inactive: C = ζ.
///
/// Paper: (21), (23) in the form of (25), (26), on the sets (31)–(35); `by_slip` is the factor that
/// (64), (65) multiply. Tests: `complementarity_matches_finite_differences`,
/// `roots_do_not_depend_on_the_parameter`.
pub fn complementarity(
    multiplier: Vector3<f64>,
    at: &NodeMeasures,
    friction: Friction,
    stiffness: &Stiffness,
) -> Complementarity {
    let inactive = Complementarity::open(multiplier);
    if !at.covered() || at.freedom == Freedom::None {
        return inactive;
    }
    let divisor = stiffness.scaling.divisor(at);
    let (normal, along) = (stiffness.normal / divisor, stiffness.tangential / divisor);
    let (compliance, compliance_slope) = at.compliance();
    let gap = at.gap + compliance * multiplier[0];
    let pressure = multiplier[0] - normal * gap;
    if pressure <= 0.0 {
        return inactive;
    }
    let law = tangential(pressure, multiplier.fixed_rows::<2>(1).into(), at, friction, along);
    let mut out = inactive;
    out.status = law.status;
    // ζ_n − (ζ_n − c_n g)
    out.value[0] = normal * gap;
    out.by_multiplier[(0, 0)] = normal * compliance;
    out.by_gap[0] = normal;
    out.by_area[0] = normal * compliance_slope * multiplier[0];
    // k ∝ 1/s
    out.by_edge_stiffness[0] = -normal * compliance * multiplier[0];
    for a in 0..2 {
        out.value[1 + a] = multiplier[1 + a] - law.traction[a];
        out.by_friction[1 + a] = -law.by_friction[a];
        out.by_shear_limit[1 + a] = -law.by_shear_limit[a];
        out.by_multiplier[(1 + a, 0)] = -law.by_pressure[a] * (1.0 - normal * compliance);
        out.by_area[1 + a] = law.by_pressure[a] * out.by_area[0];
        out.by_edge_stiffness[1 + a] = law.by_pressure[a] * out.by_edge_stiffness[0];
        out.by_gap[1 + a] = normal * law.by_pressure[a];
        for b in 0..2 {
            out.by_multiplier[(1 + a, 1 + b)] -= law.by_multiplier[(a, b)];
            out.by_slip[(1 + a, b)] = -law.by_slip[(a, b)];
            out.by_direction[(1 + a, b)] = -law.by_direction[(a, b)];
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::StiffnessScaling;
    use super::*;
    use nalgebra::Vector2;

    const C: Stiffness = Stiffness { normal: 40.0, tangential: 25.0, scaling: StiffnessScaling::Weighted };

    #[test]
    fn complementarity_matches_finite_differences() {
        let measures = |gap, u: [f64; 2], reference_area| NodeMeasures {
            gap,
            slip: Vector2::new(u[0], u[1]),
            area: 1.0,
            reference_area,
            edge_stiffness: 50.0,
            edge_cover: 0.05,
            load: None,
            freedom: Freedom::Full,
        };
        let across = |driven: bool, u| NodeMeasures {
            freedom: Freedom::SlipAcross { direction: Vector2::new(0.8, 0.6), driven },
            ..measures(-0.01, u, 1.0)
        };
        let fixed = |driven: bool| NodeMeasures { freedom: Freedom::Gap { driven }, ..across(driven, [0.001, 0.002]) };
        let cases = [
            (Vector3::new(2.0, 0.3, -0.1), measures(-0.01, [0.001, 0.002], 1.0), ContactStatus::Stick),
            (Vector3::new(2.0, 0.3, -0.1), measures(-0.01, [0.02, -0.03], 1.0), ContactStatus::Slip),
            (Vector3::new(0.1, 0.3, -0.1), measures(0.05, [0.02, -0.03], 1.0), ContactStatus::Inactive),
            // slivers
            (Vector3::new(2.0, 0.3, -0.1), measures(-0.01, [0.001, 0.002], 50.0), ContactStatus::Stick),
            (Vector3::new(2.0, 0.3, -0.1), measures(-0.04, [0.02, -0.03], 50.0), ContactStatus::Slip),
            // the prescribed slip is zero, or it is not
            (Vector3::new(2.0, 0.3, -0.1), across(false, [0.001, 0.002]), ContactStatus::Stick),
            (Vector3::new(2.0, 0.3, -0.1), across(false, [0.02, -0.03]), ContactStatus::Slip),
            (Vector3::new(2.0, 0.3, -0.1), across(true, [0.001, 0.002]), ContactStatus::Slip),
            (Vector3::new(2.0, 0.3, -0.1), fixed(false), ContactStatus::Stick),
            (Vector3::new(2.0, 0.3, -0.1), fixed(true), ContactStatus::Slip),
        ];
        let (coulomb, limited) = (Friction::coulomb(0.3), Friction { coefficient: 0.3, shear_limit: 0.4 });
        for ((z, at, status), law) in cases.into_iter().flat_map(|case| [(case, coulomb), (case, limited)]) {
            let c = |z: Vector3<f64>, at: NodeMeasures| complementarity(z, &at, law, &C);
            let base = c(z, at);
            assert_eq!(base.status, status);
            let h = 1e-7;
            for i in 0..3 {
                let mut e = Vector3::zeros();
                e[i] = h;
                let fd = (c(z + e, at).value - c(z - e, at).value) / (2.0 * h);
                assert!((fd - base.by_multiplier.column(i)).norm() < 1e-7);
            }
            let gap = |d: f64| c(z, NodeMeasures { gap: at.gap + d, ..at }).value;
            assert!(((gap(h) - gap(-h)) / (2.0 * h) - base.by_gap).norm() < 1e-6);
            let area = |d: f64| c(z, NodeMeasures { area: at.area + d, ..at }).value;
            assert!(((area(h) - area(-h)) / (2.0 * h) - base.by_area).norm() < 1e-6);
            let edge = |d: f64| c(z, NodeMeasures { edge_stiffness: at.edge_stiffness * d.exp(), ..at }).value;
            assert!(((edge(h) - edge(-h)) / (2.0 * h) - base.by_edge_stiffness).norm() < 1e-6);
            let mu = |d: f64| complementarity(z, &at, Friction { coefficient: law.coefficient + d, ..law }, &C).value;
            assert!(((mu(h) - mu(-h)) / (2.0 * h) - base.by_friction).norm() < 1e-6);
            let shear =
                |d: f64| complementarity(z, &at, Friction { shear_limit: law.shear_limit + d, ..law }, &C).value;
            assert!(((shear(h) - shear(-h)) / (2.0 * h) - base.by_shear_limit).norm() < 1e-6);
            for a in 0..2 {
                if let Freedom::SlipAcross { direction, driven } = at.freedom {
                    let turned = |d: f64| {
                        let mut direction = direction;
                        direction[a] += d;
                        c(z, NodeMeasures { freedom: Freedom::SlipAcross { direction, driven }, ..at }).value
                    };
                    assert!(((turned(h) - turned(-h)) / (2.0 * h) - base.by_direction.column(a)).norm() < 1e-6);
                }
                let slip = |d: f64| {
                    let mut slip = at.slip;
                    slip[a] += d;
                    c(z, NodeMeasures { slip, ..at }).value
                };
                assert!(((slip(h) - slip(-h)) / (2.0 * h) - base.by_slip.column(a)).norm() < 1e-5);
            }
        }
    }

    /// Without free unknowns for the slip, the multiplier is the limit of the penalty method: zero
    /// if nothing slips, and on the friction cone along a prescribed slip, however small. If the
    /// gap is prescribed, the multiplier is zero.
    #[test]
    fn multipliers_on_prescribed_slip_are_the_limit_of_penalty() {
        let at = |freedom, slip: [f64; 2]| NodeMeasures {
            gap: 0.0,
            slip: Vector2::new(slip[0], slip[1]),
            area: 1.0,
            reference_area: 1.0,
            edge_stiffness: f64::INFINITY,
            edge_cover: 0.05,
            load: None,
            freedom,
        };
        let z = Vector3::new(5.0, 0.2 * 5.0 * 0.6, 0.2 * 5.0 * 0.8);
        let across = |driven: bool| Freedom::SlipAcross { direction: Vector2::y(), driven };
        for (freedom, slip, root) in [
            (across(false), [0.0, 1e-14], Vector3::new(5.0, 0.7, 0.0)),
            (across(true), [3e-9, 4e-9], z),
            (Freedom::Gap { driven: false }, [0.0, 0.0], Vector3::new(5.0, 0.0, 0.0)),
            (Freedom::Gap { driven: true }, [3e-9, 4e-9], z),
        ] {
            let c = complementarity(root, &at(freedom, slip), Friction::coulomb(0.2), &C);
            assert!(c.value.norm() < 1e-12, "{freedom:?} {slip:?}: {}", c.value);
            // the rows determine the multiplier, except the component whose equation is the slip
            // across
            let rank = c.by_multiplier.fixed_view::<2, 2>(1, 1).rank(1e-12);
            assert_eq!(rank, if freedom == across(false) { 1 } else { 2 }, "{freedom:?} {slip:?}");
        }
        let open = complementarity(z, &at(Freedom::None, [0.0; 2]), Friction::coulomb(0.2), &C);
        assert_eq!((open.status, open.value), (ContactStatus::Inactive, z));
    }

    /// A node in contact whose multiplier satisfies the conditions is a root for any c.
    #[test]
    fn roots_do_not_depend_on_the_parameter() {
        let slipping = NodeMeasures {
            gap: 0.0,
            slip: Vector2::new(0.3, 0.4),
            area: 1.0,
            reference_area: 1.0,
            edge_stiffness: 50.0,
            edge_cover: 0.05,
            load: None,
            freedom: Freedom::Full,
        };
        for (normal, tangential) in [(1e-3, 1.0), (1.0, 1e-2), (1e5, 1e5)] {
            let c = Stiffness { normal, tangential, ..C };
            let z = Vector3::new(5.0, 0.2 * 5.0 * 0.6, 0.2 * 5.0 * 0.8);
            assert!(complementarity(z, &slipping, Friction::coulomb(0.2), &c).value.norm() < 1e-13);
        }
    }
}
