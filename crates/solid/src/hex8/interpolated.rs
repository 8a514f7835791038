//! Element integrals with interpolated energy.
//!
//! With stiffness factor s and share γ, and K(0) d the force of linear elasticity:
//!
//! ```text
//! f = s [ γ f(γd) + (1 − γ²) K(0) d ],     K = s [ γ² K(γd) + (1 − γ²) K(0) ]
//! ```
//!
//! With γ = 1 these are the plain integrals, at the same cost. The other case is compiled
//! separately.

use super::geometry::ReferenceGeometry;
use super::integrate::Corners;
use super::kernel::{self, REST, Scratch};
use crate::interpolation::ElementScaling;
use crate::section::Section;
use pulp::{Simd, WithSimd};

/// Internal force; `None` if the finite-strain part is inverted or the force is not finite.
#[inline(always)]
pub(crate) fn internal_force<S: Simd, R>(
    simd: S,
    scratch: &mut Scratch,
    section: &Section,
    at: &ReferenceGeometry,
    scaling: ElementScaling,
    d: &Corners,
    then: impl FnOnce(&Corners) -> R,
) -> Option<R> {
    if scaling.gamma == 1.0 {
        kernel::internal_force(simd, scratch, section, at, scaling.factor, d, then)
    } else {
        simd.vectorize(Force { scratch, section, at, scaling, d }).map(|force| then(&force))
    }
}

/// Product of the tangent with corner displacements `direction`; `None` as for [`internal_force`].
#[inline(always)]
pub(crate) fn tangent_product<S: Simd, R>(
    simd: S,
    scratch: &mut Scratch,
    section: &Section,
    at: &ReferenceGeometry,
    scaling: ElementScaling,
    d: &Corners,
    direction: &Corners,
    then: impl FnOnce(&Corners) -> R,
) -> Option<R> {
    if scaling.gamma == 1.0 {
        kernel::tangent_product(simd, scratch, section, at, scaling.factor, d, direction, then)
    } else {
        simd.vectorize(Product { scratch, section, at, scaling, d, direction }).map(|force| then(&force))
    }
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
    add: impl FnMut(usize, usize, [f64; 9]),
) -> Option<()> {
    if scaling.gamma == 1.0 {
        kernel::tangent(simd, scratch, section, at, scaling.factor, d, add)
    } else {
        simd.vectorize(Tangent { scratch, section, at, scaling, d, add })
    }
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
    if scaling.gamma == 1.0 && slope.gamma == 0.0 {
        kernel::internal_force(simd, scratch, section, at, 1.0, d, |force| slope.factor * dot(force, lambda))
    } else {
        simd.vectorize(PullBack { scratch, section, at, scaling, slope, d, lambda })
    }
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

struct Force<'a> {
    scratch: &'a mut Scratch,
    section: &'a Section,
    at: &'a ReferenceGeometry,
    scaling: ElementScaling,
    d: &'a Corners,
}

impl WithSimd for Force<'_> {
    type Output = Option<Corners>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { scratch, section, at, scaling: ElementScaling { factor, gamma }, d } = self;
        let linear = factor * (1.0 - gamma * gamma);
        let linear = kernel::tangent_product(simd, scratch, section, at, linear, &REST, d, |f| *f)?;
        if gamma == 0.0 {
            return Some(linear);
        }
        kernel::internal_force(simd, scratch, section, at, factor * gamma, &scaled(d, gamma), |f| sum(*f, &linear))
    }
}

struct Product<'a> {
    scratch: &'a mut Scratch,
    section: &'a Section,
    at: &'a ReferenceGeometry,
    scaling: ElementScaling,
    d: &'a Corners,
    direction: &'a Corners,
}

impl WithSimd for Product<'_> {
    type Output = Option<Corners>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { scratch, section, at, scaling: ElementScaling { factor, gamma }, d, direction } = self;
        let square = gamma * gamma;
        let linear =
            kernel::tangent_product(simd, scratch, section, at, factor * (1.0 - square), &REST, direction, |f| *f)?;
        if gamma == 0.0 {
            return Some(linear);
        }
        let d = scaled(d, gamma);
        kernel::tangent_product(simd, scratch, section, at, factor * square, &d, direction, |f| sum(*f, &linear))
    }
}

struct Tangent<'a, A> {
    scratch: &'a mut Scratch,
    section: &'a Section,
    at: &'a ReferenceGeometry,
    scaling: ElementScaling,
    d: &'a Corners,
    add: A,
}

impl<A: FnMut(usize, usize, [f64; 9])> WithSimd for Tangent<'_, A> {
    type Output = Option<()>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { scratch, section, at, scaling: ElementScaling { factor, gamma }, d, mut add } = self;
        let square = gamma * gamma;
        // the finite-strain part first: if it is inverted, nothing is added
        if gamma != 0.0 {
            kernel::tangent(simd, scratch, section, at, factor * square, &scaled(d, gamma), &mut add)?;
        }
        kernel::tangent(simd, scratch, section, at, factor * (1.0 - square), &REST, add)
    }
}

struct PullBack<'a> {
    scratch: &'a mut Scratch,
    section: &'a Section,
    at: &'a ReferenceGeometry,
    scaling: ElementScaling,
    slope: ElementScaling,
    d: &'a Corners,
    lambda: &'a Corners,
}

impl WithSimd for PullBack<'_> {
    type Output = Option<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { scratch, section, at, scaling: ElementScaling { factor, gamma }, slope, d, lambda } = self;
        let at_scaled = scaled(d, gamma);
        let with_lambda = |force: &Corners| dot(force, lambda);
        let force = kernel::internal_force(simd, scratch, section, at, 1.0, &at_scaled, with_lambda)?;
        let finite = kernel::tangent_product(simd, scratch, section, at, 1.0, &at_scaled, d, with_lambda)?;
        let linear = kernel::tangent_product(simd, scratch, section, at, 1.0, &REST, d, with_lambda)?;
        let by_factor = gamma * force + (1.0 - gamma * gamma) * linear;
        let by_gamma = factor * (force + gamma * (finite - 2.0 * linear));
        Some(slope.factor * by_factor + slope.gamma * by_gamma)
    }
}
