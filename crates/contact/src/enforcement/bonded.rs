//! Bonded surfaces: gap and slip vanish, and the traction is whatever that takes, tension included.
//!
//! ```text
//! C = ζ − (ζ_n − c_n (g̃ + k ζ_n), ζ_τ + c_t P (ũ_τ − k ζ_τ))        P projects onto the directions that are not prescribed, Freedom
//! ```
//!
//! k > 0 at partly covered nodes ([`NodeMeasures::compliance`]): a rigid bond over a sliver would need a
//! finite force on hardly any area, with any multiplier. Components that prescribed displacements
//! determine have the multiplier zero: C = ζ there.

use super::lagrange::Complementarity;
use super::regularised::Traction;
use super::{Freedom, NodeMeasures, Stiffness};
use crate::ContactStatus;
use nalgebra::{Matrix2, Vector2, Vector3};

/// C of one bonded node and its partial derivatives. The rows and the frame of a bonded node never
/// change, so nothing is differentiated with respect to its area or a direction.
///
/// Tests: `bonds_match_finite_differences`, `ties_over_slivers`.
pub fn bond(multiplier: Vector3<f64>, at: &NodeMeasures, stiffness: &Stiffness) -> Complementarity {
    let mut out = Complementarity::open(multiplier);
    let Some((normal, along, free)) = conditions(at, stiffness) else { return out };
    let compliance = at.compliance().0;
    let tangential: Vector2<f64> = multiplier.fixed_rows::<2>(1).into();
    out.status = ContactStatus::Stick;
    out.value[0] = normal * (at.gap + compliance * multiplier[0]);
    out.by_gap[0] = normal;
    out.by_multiplier[(0, 0)] = normal * compliance;
    // k ∝ 1/s
    out.by_edge_stiffness[0] = -normal * compliance * multiplier[0];
    let slip = along * (at.slip - compliance * tangential);
    out.value.fixed_rows_mut::<2>(1).copy_from(&(tangential - free * (tangential + slip)));
    out.by_slip.fixed_rows_mut::<2>(1).copy_from(&(-along * free));
    let by_tangential = Matrix2::identity() - (1.0 - along * compliance) * free;
    out.by_multiplier.fixed_view_mut::<2, 2>(1, 1).copy_from(&by_tangential);
    out.by_edge_stiffness.fixed_rows_mut::<2>(1).copy_from(&(-along * compliance * (free * tangential)));
    out
}

/// The traction of one bonded node around the multiplier ẑ, where Uzawa's iteration rescues a step.
pub fn bonded_traction(multiplier: Vector3<f64>, at: &NodeMeasures, stiffness: &Stiffness) -> Traction {
    let mut out = Traction::open();
    let Some((normal, along, free)) = conditions(at, stiffness) else { return out };
    let compliance = at.compliance().0;
    let shares = [normal, along].map(|stiffness| 1.0 / (1.0 + stiffness * compliance));
    let tangential = shares[1] * free * (multiplier.fixed_rows::<2>(1) + along * at.slip);
    out.status = ContactStatus::Stick;
    out.value = Vector3::new(shares[0] * (multiplier[0] - normal * at.gap), tangential[0], tangential[1]);
    out.by_multiplier[(0, 0)] = shares[0];
    out.by_multiplier.fixed_view_mut::<2, 2>(1, 1).copy_from(&(shares[1] * free));
    out.by_gap[0] = -shares[0] * normal;
    out.by_slip.fixed_rows_mut::<2>(1).copy_from(&(shares[1] * along * free));
    out
}

/// c_n, c_t and P; `None` without any condition.
fn conditions(at: &NodeMeasures, stiffness: &Stiffness) -> Option<(f64, f64, Matrix2<f64>)> {
    if !at.covered() || at.freedom == Freedom::None {
        return None;
    }
    let divisor = stiffness.scaling.divisor(at);
    let free = match at.freedom {
        Freedom::Full => Matrix2::identity(),
        Freedom::SlipAcross { direction, .. } => Matrix2::identity() - direction * direction.transpose(),
        Freedom::Gap { .. } | Freedom::None => Matrix2::zeros(),
    };
    Some((stiffness.normal / divisor, stiffness.tangential / divisor, free))
}

#[cfg(test)]
mod tests {
    use super::super::StiffnessScaling;
    use super::*;

    /// In tension and compression, with prescribed components, and partly covered.
    #[test]
    fn bonds_match_finite_differences() {
        let c = Stiffness { normal: 40.0, tangential: 25.0, scaling: StiffnessScaling::Area };
        let across = Freedom::SlipAcross { direction: Vector2::new(0.8, 0.6), driven: false };
        let freedoms = [Freedom::Full, across, Freedom::Gap { driven: false }, Freedom::None];
        for (freedom, reference_area) in freedoms.into_iter().flat_map(|freedom| [(freedom, 1.0), (freedom, 4.0)]) {
            for gap in [-0.1, 0.2] {
                let at = NodeMeasures {
                    gap,
                    slip: Vector2::new(0.3, -0.2),
                    area: 0.7,
                    reference_area,
                    edge_stiffness: 3.0,
                    edge_cover: 0.5,
                    load: None,
                    freedom,
                };
                assert_eq!(at.compliance().0 > 0.0, reference_area > 1.0);
                let z = Vector3::new(-0.5, 0.4, 0.1);
                let base = bond(z, &at, &c);
                assert_eq!(base.status == ContactStatus::Stick, freedom != Freedom::None);
                let h = 1e-6;
                let check = |of: &dyn Fn(f64) -> Vector3<f64>, exact: Vector3<f64>| {
                    assert!(((of(h) - of(-h)) / (2.0 * h) - exact).norm() < 1e-8, "{freedom:?}");
                };
                let (around, traction) = (&c, bonded_traction(z, &at, &c));
                for i in 0..3 {
                    let moved = |h: f64| z + h * Vector3::from_fn(|k, _| f64::from(k == i));
                    check(&|h| bond(moved(h), &at, &c).value, base.by_multiplier.column(i).into());
                    check(&|h| bonded_traction(moved(h), &at, around).value, traction.by_multiplier.column(i).into());
                }
                let gap = |h: f64| NodeMeasures { gap: gap + h, ..at };
                check(&|h| bond(z, &gap(h), &c).value, base.by_gap);
                check(&|h| bonded_traction(z, &gap(h), around).value, traction.by_gap);
                let edge = |h: f64| NodeMeasures { edge_stiffness: at.edge_stiffness * h.exp(), ..at };
                check(&|h| bond(z, &edge(h), &c).value, base.by_edge_stiffness);
                for a in 0..2 {
                    let slip = |h: f64| at.slip + h * Vector2::from_fn(|k, _| f64::from(k == a));
                    let of = |h: f64| NodeMeasures { slip: slip(h), ..at };
                    check(&|h| bond(z, &of(h), &c).value, base.by_slip.column(a).into());
                    check(&|h| bonded_traction(z, &of(h), around).value, traction.by_slip.column(a).into());
                }
                // both have the same roots: the traction around ζ is ζ
                if freedom != Freedom::None {
                    let root =
                        z - base.by_multiplier.try_inverse().map_or(Vector3::zeros(), |inverse| inverse * base.value);
                    let again = bonded_traction(root, &at, around).value;
                    assert!(reference_area == 1.0 || (again - root).norm() < 1e-12, "{freedom:?}");
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
            load: None,
            freedom: Freedom::Full,
        };
        let c = Stiffness { normal: 40.0, tangential: 25.0, scaling: StiffnessScaling::Area };
        for z in [Vector3::new(-3.0, 1.0, 2.0), Vector3::new(5.0, -4.0, 0.0)] {
            assert_eq!(bond(z, &at, &c).value, Vector3::zeros());
        }
    }
}
