//! Bonded surfaces: gap and slip vanish, and the traction is whatever that takes, tension included.
//!
//! ```text
//! C = ζ − (ζ_n − c_n g̃, ζ_τ + c_t P ũ_τ)        P projects onto the directions that are not prescribed, Freedom
//! ```
//!
//! Components that prescribed displacements determine have the multiplier zero: C = ζ there.

use super::lagrange::Complementarity;
use super::regularised::Traction;
use super::{Freedom, NodeMeasures, Stiffness};
use crate::friction::Status;
use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector3};

/// C of one bonded node and its partial derivatives. The rows and the frame of a bonded node never
/// change, so nothing is differentiated with respect to its area or a direction.
///
/// Test: `bonds_match_finite_differences`.
pub fn bond(multiplier: Vector3<f64>, at: &NodeMeasures, stiffness: &Stiffness) -> Complementarity {
    let mut out = Complementarity::open(multiplier);
    let traction = bonded_traction(multiplier, at, stiffness);
    out.status = traction.status;
    out.value -= traction.value;
    out.by_multiplier -= traction.by_multiplier;
    out.by_gap -= traction.by_gap;
    out.by_slip -= traction.by_slip;
    out
}

/// The traction of one bonded node around the multiplier ẑ, where Uzawa's iteration rescues a step.
pub fn bonded_traction(multiplier: Vector3<f64>, at: &NodeMeasures, stiffness: &Stiffness) -> Traction {
    let mut out = Traction::open();
    if !at.covered() || at.freedom == Freedom::None {
        return out;
    }
    let divisor = stiffness.scaling.divisor(at);
    let (normal, along) = (stiffness.normal / divisor, stiffness.tangential / divisor);
    let free = match at.freedom {
        Freedom::Full => Matrix2::identity(),
        Freedom::SlipAcross { direction, .. } => Matrix2::identity() - direction * direction.transpose(),
        Freedom::Gap { .. } | Freedom::None => Matrix2::zeros(),
    };
    let tangential = free * (multiplier.fixed_rows::<2>(1) + along * at.slip);
    out.status = Status::Stick;
    out.value = Vector3::new(multiplier[0] - normal * at.gap, tangential[0], tangential[1]);
    out.by_multiplier = Matrix3::zeros();
    out.by_multiplier[(0, 0)] = 1.0;
    out.by_multiplier.fixed_view_mut::<2, 2>(1, 1).copy_from(&free);
    out.by_gap[0] = -normal;
    out.by_slip = Matrix3x2::zeros();
    out.by_slip.fixed_rows_mut::<2>(1).copy_from(&(along * free));
    out
}

#[cfg(test)]
mod tests {
    use super::super::StiffnessScaling;
    use super::*;
    use nalgebra::Vector2;

    /// In tension and compression, and with prescribed components.
    #[test]
    fn bonds_match_finite_differences() {
        let c = Stiffness { normal: 40.0, tangential: 25.0, scaling: StiffnessScaling::Area };
        let across = Freedom::SlipAcross { direction: Vector2::new(0.8, 0.6), driven: false };
        for freedom in [Freedom::Full, across, Freedom::Gap { driven: false }, Freedom::None] {
            for gap in [-0.1, 0.2] {
                let at = NodeMeasures {
                    gap,
                    slip: Vector2::new(0.3, -0.2),
                    area: 0.7,
                    reference_area: 1.0,
                    edge_stiffness: f64::INFINITY,
                    edge_cover: 0.5,
                    freedom,
                };
                let z = Vector3::new(-0.5, 0.4, 0.1);
                let base = bond(z, &at, &c);
                assert_eq!(base.status == Status::Stick, freedom != Freedom::None);
                let h = 1e-6;
                let check = |of: &dyn Fn(f64) -> Vector3<f64>, exact: Vector3<f64>| {
                    assert!(((of(h) - of(-h)) / (2.0 * h) - exact).norm() < 1e-8, "{freedom:?}");
                };
                for i in 0..3 {
                    let moved = |h: f64| z + h * Vector3::from_fn(|k, _| f64::from(k == i));
                    check(&|h| bond(moved(h), &at, &c).value, base.by_multiplier.column(i).into());
                }
                check(&|h| bond(z, &NodeMeasures { gap: gap + h, ..at }, &c).value, base.by_gap);
                for a in 0..2 {
                    let slip = |h: f64| at.slip + h * Vector2::from_fn(|k, _| f64::from(k == a));
                    let of = |h: f64| bond(z, &NodeMeasures { slip: slip(h), ..at }, &c).value;
                    check(&of, base.by_slip.column(a).into());
                }
            }
        }
    }

    /// A root has neither gap nor slip, and any multiplier.
    #[test]
    fn a_bond_without_gap_and_slip_carries_any_traction() {
        let at = NodeMeasures {
            gap: 0.0,
            slip: Vector2::zeros(),
            area: 0.7,
            reference_area: 1.0,
            edge_stiffness: f64::INFINITY,
            edge_cover: 0.5,
            freedom: Freedom::Full,
        };
        let c = Stiffness { normal: 40.0, tangential: 25.0, scaling: StiffnessScaling::Area };
        for z in [Vector3::new(-3.0, 1.0, 2.0), Vector3::new(5.0, -4.0, 0.0)] {
            assert_eq!(bond(z, &at, &c).value, Vector3::zeros());
        }
    }
}
