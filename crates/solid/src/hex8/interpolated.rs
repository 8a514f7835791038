//! Element integrals with interpolated energy.
//!
//! With stiffness factor s and share γ, and K(0) d the force of linear elasticity:
//!
//! ```text
//! f = s [ γ f(γd) + (1 − γ²) K(0) d ],     K = s [ γ² K(γd) + (1 − γ²) K(0) ]
//! ```
//!
//! With γ = 1 these are the plain integrals, at the same cost.

use super::geometry::{ReferenceGeometry, pair};
use super::integrate::Corners;
use super::kernel::{self, REST, Scratch};
use crate::interpolation::ElementScaling;
use crate::section::Section;
use pulp::Simd;

/// Internal force; `None` if the finite-strain part is inverted or the force is not finite.
#[inline(always)]
pub(crate) fn internal_force<S: Simd>(
    simd: S,
    scratch: &mut Scratch,
    section: &Section,
    at: &ReferenceGeometry,
    scaling: ElementScaling,
    d: &Corners,
) -> Option<Corners> {
    let ElementScaling { factor, gamma, .. } = scaling;
    if gamma == 1.0 {
        return kernel::internal_force(simd, scratch, section, at, factor, d);
    }
    let linear = factor * (1.0 - gamma * gamma);
    let linear = kernel::tangent_product(simd, scratch, section, at, linear, &REST, d)?;
    if gamma == 0.0 {
        return Some(linear);
    }
    let finite = kernel::internal_force(simd, scratch, section, at, factor * gamma, &scaled(d, gamma))?;
    Some(sum(finite, &linear))
}

/// Product of the tangent with corner displacements `direction`; `None` as for [`internal_force`].
#[inline(always)]
pub(crate) fn tangent_product<S: Simd>(
    simd: S,
    scratch: &mut Scratch,
    section: &Section,
    at: &ReferenceGeometry,
    scaling: ElementScaling,
    d: &Corners,
    direction: &Corners,
) -> Option<Corners> {
    let ElementScaling { factor, gamma, .. } = scaling;
    if gamma == 1.0 {
        return kernel::tangent_product(simd, scratch, section, at, factor, d, direction);
    }
    let square = gamma * gamma;
    let linear = kernel::tangent_product(simd, scratch, section, at, factor * (1.0 - square), &REST, direction)?;
    if gamma == 0.0 {
        return Some(linear);
    }
    let finite = kernel::tangent_product(simd, scratch, section, at, factor * square, &scaled(d, gamma), direction)?;
    Some(sum(finite, &linear))
}

/// Tangent: calls `add` with i, k and blocks of the pairs of corners i ≤ k, whose sum is the
/// tangent. `None`, without any call, if the finite-strain part is inverted.
#[inline(always)]
pub(crate) fn tangent<S: Simd>(
    simd: S,
    scratch: &mut Scratch,
    section: &Section,
    at: &ReferenceGeometry,
    scaling: ElementScaling,
    d: &Corners,
    mut add: impl FnMut(usize, usize, [f64; 9]),
) -> Option<()> {
    let ElementScaling { factor, gamma, .. } = scaling;
    // the finite-strain part first: if it is inverted, nothing is added
    let square = gamma * gamma;
    let finite = (gamma != 0.0).then(|| (factor * square, if gamma == 1.0 { *d } else { scaled(d, gamma) }));
    let linear = (gamma != 1.0).then_some((factor * (1.0 - square), REST));
    for (factor, d) in finite.into_iter().chain(linear) {
        kernel::tangent(simd, scratch, section, at, factor, &d)?;
        for i in 0..8 {
            for k in i..8 {
                add(i, k, scratch.tangent[pair(i, k)]);
            }
        }
    }
    Some(())
}

/// λ · ∂f/∂φ, where `slope` is the derivative of the scaling with respect to the density φ. \[F L\]
/// for λ in \[L\].
///
/// ```text
/// ∂f/∂s = f/s,     ∂f/∂γ = s [ f(γd) + γ K(γd) d − 2γ K(0) d ]
/// ```
///
/// Paper: (88), (89). Tests: `kernels_agree_with_the_reference_element`,
/// `interpolated_pull_back_matches_differences`.
#[inline(always)]
pub(crate) fn pull_back<S: Simd>(
    simd: S,
    scratch: &mut Scratch,
    section: &Section,
    at: &ReferenceGeometry,
    [scaling, slope]: [ElementScaling; 2],
    d: &Corners,
    lambda: &Corners,
) -> Option<f64> {
    let ElementScaling { factor, gamma, .. } = scaling;
    if gamma == 1.0 && slope.gamma == 0.0 {
        let force = kernel::internal_force(simd, scratch, section, at, 1.0, d)?;
        return Some(slope.factor * dot(&force, lambda));
    }
    let at_scaled = scaled(d, gamma);
    let force = dot(&kernel::internal_force(simd, scratch, section, at, 1.0, &at_scaled)?, lambda);
    let finite = dot(&kernel::tangent_product(simd, scratch, section, at, 1.0, &at_scaled, d)?, lambda);
    let linear = dot(&kernel::tangent_product(simd, scratch, section, at, 1.0, &REST, d)?, lambda);
    let by_factor = gamma * force + (1.0 - gamma * gamma) * linear;
    let by_gamma = factor * (force + gamma * (finite - 2.0 * linear));
    Some(slope.factor * by_factor + slope.gamma * by_gamma)
}

/// Displacements relative to the first corner, scaled: a translation, however large, causes no
/// round-off.
#[inline(always)]
fn scaled(d: &Corners, gamma: f64) -> Corners {
    let mut out = REST;
    for i in 1..8 {
        for a in 0..3 {
            out[i][a] = gamma * (d[i][a] - d[0][a]);
        }
    }
    out
}

#[inline(always)]
fn dot(a: &Corners, b: &Corners) -> f64 {
    let mut sum = 0.0;
    for (a, b) in a.as_flattened().iter().zip(b.as_flattened()) {
        sum += a * b;
    }
    sum
}

#[inline(always)]
fn sum(mut a: Corners, b: &Corners) -> Corners {
    for (a, b) in a.as_flattened_mut().iter_mut().zip(b.as_flattened()) {
        *a += b;
    }
    a
}
