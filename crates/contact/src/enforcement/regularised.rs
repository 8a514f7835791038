//! Regularized contact traction: the penalty method, and the augmented Lagrangian around given
//! multipliers.
//!
//! ```text
//! ζ_n = max(0, ẑ_n − ε_n g̃),    trial = ẑ_τ + ε_τ ũ_τ,    ζ_τ = return map (stick: trial, slip: μ ζ_n trial/‖trial‖)
//! ```
//!
//! At a partly covered node the augmented Lagrangian has ζ_n = max(0, ẑ_n − ε_n (g̃ + k ζ_n)),
//! [`NodeMeasures::compliance`]. The penalty method, which is compliant in any case, uses ẑ = (0,
//! h) with the history h of the last step; the augmented Lagrangian iterates ẑ ← ζ.

use super::soft::PressureLaw;
use super::tangential::tangential;
use super::{Freedom, NodeMeasures, Stiffness, StiffnessScaling};
use crate::ContactStatus;
use crate::friction::Friction;
use nalgebra::{Matrix3, Matrix3x2, Vector3};

/// Traction of one node and its partial derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Traction {
    /// The set that the node belongs to.
    pub status: ContactStatus,
    /// ζ = (ζ_n, ζ_ξ, ζ_η), minus the slave traction. \[F/L²\]
    pub value: Vector3<f64>,
    /// ∂ζ/∂g̃.
    pub by_gap: Vector3<f64>,
    /// ∂ζ/∂ũ_τ.
    pub by_slip: Matrix3x2<f64>,
    /// ∂ζ/∂A (zero unless the stiffness multiplies measures divided by it).
    pub by_area: Vector3<f64>,
    /// ∂ζ/∂P of the load of a pressure at the integration points. \[1/L²\]
    pub by_load: Vector3<f64>,
    /// ∂ζ/∂μ. \[F/L²\]
    pub by_friction: Vector3<f64>,
    /// ∂ζ/∂τ_max.
    pub by_shear_limit: Vector3<f64>,
    /// ∂ζ/∂ln ε, of ε_n and ε_τ together. \[F/L²\]
    pub by_stiffness: Vector3<f64>,
    /// ∂ζ/∂ẑ; its last two columns are ∂ζ/∂h for the penalty method.
    pub by_multiplier: Matrix3<f64>,
    /// ∂ζ/∂a of the direction a of prescribed slip, [`Freedom::SlipAcross`]; zero
    /// elsewhere. \[F/L²\]
    pub by_direction: Matrix3x2<f64>,
}

impl Traction {
    /// No traction.
    pub(super) fn open() -> Self {
        Self {
            status: ContactStatus::Inactive,
            value: Vector3::zeros(),
            by_gap: Vector3::zeros(),
            by_slip: Matrix3x2::zeros(),
            by_area: Vector3::zeros(),
            by_load: Vector3::zeros(),
            by_friction: Vector3::zeros(),
            by_shear_limit: Vector3::zeros(),
            by_stiffness: Vector3::zeros(),
            by_multiplier: Matrix3::zeros(),
            by_direction: Matrix3x2::zeros(),
        }
    }
}

/// The pressure of a node and its partial derivatives.
#[derive(Debug, Clone, Copy)]
struct Pressure {
    value: f64,
    by_gap: f64,
    by_area: f64,
    by_load: f64,
    by_stiffness: f64,
    by_multiplier: f64,
}

/// Evaluates the traction of one node around the multiplier ẑ.
///
/// Paper: (37)–(41) and (46)–(50) with the signs of docs/method/contact.md, section 4. Test:
/// `traction_matches_finite_differences`.
pub fn traction(multiplier: Vector3<f64>, at: &NodeMeasures, friction: Friction, stiffness: &Stiffness) -> Traction {
    if !at.covered() || at.freedom == Freedom::None {
        return Traction::open();
    }
    let normal = stiffness.normal / stiffness.scaling.divisor(at);
    let (compliance, compliance_slope) = at.compliance();
    // ∂ζ_n/∂ẑ_n
    let share = 1.0 / (1.0 + normal * compliance);
    let value = share * (multiplier[0] - normal * at.gap);
    let softening = (at.gap + compliance * value) * area_slope(at, stiffness.scaling) - compliance_slope * value;
    let pressure = Pressure {
        value,
        by_gap: -normal * share,
        by_area: normal * share * softening,
        by_load: 0.0,
        by_stiffness: -normal * share * (at.gap + compliance * value),
        by_multiplier: share,
    };
    with_friction(pressure, multiplier, at, friction, stiffness)
}

/// Evaluates the traction of one node whose pressure follows a law of its mean gap, the gap divided by the
/// area of the scaling; only sticking has a stiffness, and [`by_stiffness`](Traction::by_stiffness) is that of sticking.
///
/// Test: `soft_traction_matches_finite_differences`.
pub fn soft_traction(
    history: Vector3<f64>,
    at: &NodeMeasures,
    friction: Friction,
    stiffness: &Stiffness,
    law: &PressureLaw,
) -> Traction {
    if !at.covered() || at.freedom == Freedom::None {
        return Traction::open();
    }
    let divisor = stiffness.scaling.divisor(at);
    let gap = at.gap / divisor;
    let (value, slope) = law.at(gap);
    let pressure = Pressure {
        value,
        by_gap: slope / divisor,
        by_area: -slope * gap * area_slope(at, stiffness.scaling),
        by_load: 0.0,
        by_stiffness: 0.0,
        by_multiplier: 0.0,
    };
    with_friction(pressure, history, at, friction, stiffness)
}

/// Evaluates the traction of one node whose pressure depends on the gap at each integration point: the mean
/// pressure κ P/A of its load P. κ is ε_n if `proportional`, otherwise 1 ([`PressureLaw::Proportional`]).
///
/// Test: `pressed_traction_matches_finite_differences`.
pub fn pressed_traction(
    history: Vector3<f64>,
    at: &NodeMeasures,
    friction: Friction,
    stiffness: &Stiffness,
    (load, proportional): (f64, bool),
) -> Traction {
    if !at.covered() {
        return Traction::open();
    }
    let factor = if proportional { stiffness.normal } else { 1.0 };
    let value = factor * load / at.area;
    let pressure = Pressure {
        value,
        by_gap: 0.0,
        by_area: -value / at.area,
        by_load: factor / at.area,
        by_stiffness: if proportional { value } else { 0.0 },
        by_multiplier: 0.0,
    };
    with_friction(pressure, history, at, friction, stiffness)
}

/// The derivative of the logarithm of a scaling's divisor with respect to the node's area.
fn area_slope(at: &NodeMeasures, scaling: StiffnessScaling) -> f64 {
    match scaling {
        StiffnessScaling::Area => 1.0 / at.area,
        StiffnessScaling::ReferenceArea | StiffnessScaling::Weighted => 0.0,
    }
}

/// The traction with the tangential part that belongs to a pressure; none if the surfaces are open.
fn with_friction(
    pressure: Pressure,
    multiplier: Vector3<f64>,
    at: &NodeMeasures,
    friction: Friction,
    stiffness: &Stiffness,
) -> Traction {
    let mut out = Traction::open();
    if pressure.value <= 0.0 {
        return out;
    }
    let area_slope = area_slope(at, stiffness.scaling);
    let tangential_stiffness = stiffness.tangential / stiffness.scaling.divisor(at);
    let law = tangential(pressure.value, multiplier.fixed_rows::<2>(1).into(), at, friction, tangential_stiffness);
    out.status = law.status;
    out.value = Vector3::new(pressure.value, law.traction[0], law.traction[1]);
    out.by_gap[0] = pressure.by_gap;
    out.by_multiplier[(0, 0)] = pressure.by_multiplier;
    out.by_area[0] = pressure.by_area;
    out.by_load[0] = pressure.by_load;
    out.by_stiffness[0] = pressure.by_stiffness;
    // k = ε_τ over the divisor
    let tangential_by_stiffness = law.by_stiffness * tangential_stiffness + law.by_pressure * pressure.by_stiffness;
    let tangential_by_area =
        law.by_pressure * pressure.by_area - law.by_stiffness * (tangential_stiffness * area_slope);
    for a in 0..2 {
        out.by_gap[1 + a] = pressure.by_gap * law.by_pressure[a];
        out.by_area[1 + a] = tangential_by_area[a];
        out.by_load[1 + a] = pressure.by_load * law.by_pressure[a];
        out.by_friction[1 + a] = law.by_friction[a];
        out.by_shear_limit[1 + a] = law.by_shear_limit[a];
        out.by_stiffness[1 + a] = tangential_by_stiffness[a];
        out.by_multiplier[(1 + a, 0)] = pressure.by_multiplier * law.by_pressure[a];
        for b in 0..2 {
            out.by_slip[(1 + a, b)] = law.by_slip[(a, b)];
            out.by_multiplier[(1 + a, 1 + b)] = law.by_multiplier[(a, b)];
            out.by_direction[(1 + a, b)] = law.by_direction[(a, b)];
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;

    #[test]
    fn traction_matches_finite_differences() {
        let of = |reference_area: f64| {
            move |gap: f64, u: [f64; 2]| NodeMeasures {
                gap,
                slip: Vector2::new(u[0], u[1]),
                area: 0.7,
                reference_area,
                edge_stiffness: 25.0,
                edge_cover: 0.05,
                load: None,
                freedom: Freedom::Full,
            }
        };
        let (at, sliver) = (of(1.0), of(30.0));
        let across = |driven: bool, u| NodeMeasures {
            freedom: Freedom::SlipAcross { direction: Vector2::new(0.8, 0.6), driven },
            ..at(-0.1, u)
        };
        for scaling in [StiffnessScaling::Area, StiffnessScaling::ReferenceArea, StiffnessScaling::Weighted] {
            let stiffness = Stiffness { normal: 30.0, tangential: 20.0, scaling };
            for (z, m, status) in [
                (Vector3::new(0.5, 0.05, 0.02), at(-0.1, [0.001, 0.004]), ContactStatus::Stick),
                (Vector3::new(0.5, 0.05, 0.02), at(-0.1, [0.2, 0.1]), ContactStatus::Slip),
                (Vector3::new(0.5, 0.05, 0.02), at(0.1, [0.2, 0.1]), ContactStatus::Inactive),
                (Vector3::new(0.5, 0.05, 0.02), sliver(-0.1, [0.001, 0.004]), ContactStatus::Stick),
                (Vector3::new(0.5, 0.05, 0.02), sliver(-0.1, [6.0, 3.0]), ContactStatus::Slip),
                (Vector3::new(0.5, 0.05, 0.02), across(false, [0.001, 0.004]), ContactStatus::Stick),
                (Vector3::new(0.5, 0.05, 0.02), across(false, [0.2, -0.1]), ContactStatus::Slip),
                (Vector3::new(0.5, 0.05, 0.02), across(true, [0.2, 0.1]), ContactStatus::Slip),
            ] {
                let law = Friction::coulomb(0.4);
                let f = |z: Vector3<f64>, m: NodeMeasures| traction(z, &m, law, &stiffness).value;
                let base = traction(z, &m, law, &stiffness);
                assert_eq!(base.status, status);
                let h = 1e-7;
                let check = |plus: Vector3<f64>, minus: Vector3<f64>, exact: Vector3<f64>| {
                    assert!(((plus - minus) / (2.0 * h) - exact).norm() < 1e-6, "{scaling:?} {status:?}");
                };
                for i in 0..3 {
                    let mut e = Vector3::zeros();
                    e[i] = h;
                    check(f(z + e, m), f(z - e, m), base.by_multiplier.column(i).into());
                }
                let gap = |d: f64| f(z, NodeMeasures { gap: m.gap + d, ..m });
                check(gap(h), gap(-h), base.by_gap);
                let area = |d: f64| f(z, NodeMeasures { area: m.area + d, ..m });
                check(area(h), area(-h), base.by_area);
                let mu = |d: f64| traction(z, &m, Friction::coulomb(0.4 + d), &stiffness).value;
                check(mu(h), mu(-h), base.by_friction);
                let epsilon = |d: f64| traction(z, &m, law, &stiffness.times(d.exp())).value;
                check(epsilon(h), epsilon(-h), base.by_stiffness);
                let limited = |d: f64| traction(z, &m, Friction { shear_limit: 0.02 + d, ..law }, &stiffness);
                check(limited(h).value, limited(-h).value, limited(0.0).by_shear_limit);
                let limited_gap = |d: f64| {
                    let m = NodeMeasures { gap: m.gap + d, ..m };
                    traction(z, &m, Friction { shear_limit: 0.02, ..law }, &stiffness).value
                };
                check(limited_gap(h), limited_gap(-h), limited(0.0).by_gap);
                for a in 0..2 {
                    if let Freedom::SlipAcross { direction, driven } = m.freedom {
                        let turned = |d: f64| {
                            let mut direction = direction;
                            direction[a] += d;
                            f(z, NodeMeasures { freedom: Freedom::SlipAcross { direction, driven }, ..m })
                        };
                        check(turned(h), turned(-h), base.by_direction.column(a).into());
                    }
                    let slip = |d: f64| {
                        let mut slip = m.slip;
                        slip[a] += d;
                        f(z, NodeMeasures { slip, ..m })
                    };
                    check(slip(h), slip(-h), base.by_slip.column(a).into());
                }
            }
        }
    }

    /// For both laws and scalings, sticking and slipping, with a history.
    #[test]
    fn soft_traction_matches_finite_differences() {
        let laws = [
            PressureLaw::Exponential { contact_pressure: 0.3, clearance: 0.2 },
            PressureLaw::Table(vec![[-0.5, 0.0], [0.0, 0.2], [0.3, 2.0]]),
        ];
        for (law, scaling) in laws
            .iter()
            .flat_map(|law| [StiffnessScaling::Area, StiffnessScaling::ReferenceArea].map(|scaling| (law, scaling)))
        {
            let stiffness = Stiffness { normal: 1.0, tangential: 20.0, scaling };
            for (slip, gap, status) in [
                ([0.001, 0.004], -0.1, ContactStatus::Stick),
                ([0.2, 0.1], -0.1, ContactStatus::Slip),
                ([0.2, 0.1], 0.05, ContactStatus::Slip),
                ([0.2, 0.1], 4.0, ContactStatus::Inactive),
            ] {
                let m = NodeMeasures {
                    gap,
                    slip: Vector2::new(slip[0], slip[1]),
                    area: 0.7,
                    reference_area: 1.0,
                    edge_stiffness: 25.0,
                    edge_cover: 0.05,
                    load: None,
                    freedom: Freedom::Full,
                };
                let z = Vector3::new(0.0, 0.02, 0.01);
                let of = |z: Vector3<f64>, m: NodeMeasures, mu: f64, factor: f64| {
                    soft_traction(z, &m, Friction::coulomb(mu), &stiffness.times(factor), law)
                };
                let base = of(z, m, 0.4, 1.0);
                assert_eq!(base.status, status, "{law:?} {scaling:?}");
                let h = 1e-7;
                let check = |name: &str, of: &dyn Fn(f64) -> Traction, exact: Vector3<f64>| {
                    let difference = (of(h).value - of(-h).value) / (2.0 * h);
                    assert!((difference - exact).norm() < 1e-6, "{name} {law:?} {scaling:?} {status:?}");
                };
                check("gap", &|d| of(z, NodeMeasures { gap: gap + d, ..m }, 0.4, 1.0), base.by_gap);
                check("area", &|d| of(z, NodeMeasures { area: 0.7 + d, ..m }, 0.4, 1.0), base.by_area);
                check("friction", &|d| of(z, m, 0.4 + d, 1.0), base.by_friction);
                check("stiffness", &|d| of(z, m, 0.4, d.exp()), base.by_stiffness);
                for a in 0..2 {
                    let slipped = |d: f64| {
                        let mut slip = m.slip;
                        slip[a] += d;
                        of(z, NodeMeasures { slip, ..m }, 0.4, 1.0)
                    };
                    check("slip", &slipped, base.by_slip.column(a).into());
                    let held = |d: f64| {
                        let mut z = z;
                        z[1 + a] += d;
                        of(z, m, 0.4, 1.0)
                    };
                    check("history", &held, base.by_multiplier.column(1 + a).into());
                }
            }
        }
    }

    /// Sticking and slipping, with a stiffness of the pressure and without.
    #[test]
    fn pressed_traction_matches_finite_differences() {
        let stiffness = Stiffness { normal: 3.0, tangential: 20.0, scaling: StiffnessScaling::Area };
        let z = Vector3::new(0.0, 0.02, 0.01);
        for (slip, status) in [([0.001, 0.004], ContactStatus::Stick), ([0.2, 0.1], ContactStatus::Slip)] {
            let m = NodeMeasures {
                gap: -0.1,
                slip: Vector2::new(slip[0], slip[1]),
                area: 0.7,
                reference_area: 1.0,
                edge_stiffness: 25.0,
                edge_cover: 0.05,
                load: None,
                freedom: Freedom::Full,
            };
            for proportional in [false, true] {
                let of = |area: f64, load: f64, factor: f64| {
                    let at = NodeMeasures { area, ..m };
                    pressed_traction(z, &at, Friction::coulomb(0.4), &stiffness.times(factor), (load, proportional))
                };
                let base = of(0.7, 0.5, 1.0);
                assert_eq!(base.status, status);
                let h = 1e-7;
                let check = |name: &str, of: &dyn Fn(f64) -> Traction, exact: Vector3<f64>| {
                    let difference = (of(h).value - of(-h).value) / (2.0 * h);
                    assert!((difference - exact).norm() < 1e-6, "{name} {status:?} {proportional}");
                };
                check("area", &|d| of(0.7 + d, 0.5, 1.0), base.by_area);
                check("load", &|d| of(0.7, 0.5 + d, 1.0), base.by_load);
                check("stiffness", &|d| of(0.7, 0.5, d.exp()), base.by_stiffness);
            }
        }
    }

    /// By definition, a node without an opposite facet carries no traction, nor does one whose gap
    /// is prescribed, however deep the penetration.
    #[test]
    fn uncovered_and_prescribed_nodes_bear_no_traction() {
        let pressed = NodeMeasures {
            gap: -0.1,
            slip: Vector2::new(0.001, 0.004),
            area: 0.7,
            reference_area: 1.0,
            edge_stiffness: 25.0,
            edge_cover: 0.05,
            load: None,
            freedom: Freedom::Full,
        };
        for scaling in [StiffnessScaling::ReferenceArea, StiffnessScaling::Weighted] {
            let stiffness = Stiffness { normal: 30.0, tangential: 20.0, scaling };
            let of =
                |at: &NodeMeasures| traction(Vector3::new(0.5, 0.05, 0.02), at, Friction::coulomb(0.4), &stiffness);
            assert_eq!(of(&pressed).status, ContactStatus::Stick);
            let uncovered = NodeMeasures { area: 0.0, ..pressed };
            for at in [uncovered, NodeMeasures { freedom: Freedom::None, ..pressed }] {
                let open = of(&at);
                assert_eq!((open.status, open.value), (ContactStatus::Inactive, Vector3::zeros()));
                assert_eq!((open.by_gap, open.by_multiplier), (Vector3::zeros(), Matrix3::zeros()));
            }
        }
    }
}
