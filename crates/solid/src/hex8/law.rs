//! Materials in registers: stress and its change, both over the shear modulus.

use super::full;
use super::geometry::{AtPoints, POINTS, ReferenceGeometry};
use super::kernel::Scratch;
use super::power::inverse_power;
use super::registers::{Corners, Matrices, Matrix, array, load, load_matrix, product, transpose};
use crate::material::{NeoHooke, StVenantKirchhoff};
use pulp::Simd;

/// Deformation at the points of register `v`, read where it is needed.
#[derive(Clone, Copy)]
pub(crate) struct Local<'a> {
    /// F.
    pub gradient: &'a Matrices,
    /// F⁻¹, as `[B][a]`.
    pub inverse: &'a Matrices,
    /// What [`Law::volumetric`] returned.
    pub volumetric: &'a AtPoints,
    pub v: usize,
}

impl Local<'_> {
    #[inline(always)]
    pub fn gradient<S: Simd>(&self, a: usize, b: usize) -> S::f64s {
        load::<S>(&self.gradient[a][b], self.v)
    }

    #[inline(always)]
    pub fn inverse<S: Simd>(&self, b: usize, a: usize) -> S::f64s {
        load::<S>(&self.inverse[b][a], self.v)
    }
}

/// A hyperelastic law as the kernels use it.
///
/// Tests: `force_is_the_gradient_of_the_energy`, `tangent_is_the_derivative_of_the_force`.
pub(crate) trait Law: Copy {
    /// The shear modulus μ of the small-strain limit, the unit of the stresses below. \[F/L²\]
    fn shear_modulus(&self) -> f64;

    /// What the stress needs of J > 0 at all points.
    fn volumetric<S: Simd>(&self, simd: S, determinant: &AtPoints) -> AtPoints;

    /// P/μ.
    fn stress<S: Simd>(&self, simd: S, at: &Local<'_>) -> Matrix<S>;

    /// Derivative of P/μ in the direction `change` of F.
    fn stress_change<S: Simd>(&self, simd: S, at: &Local<'_>, change: &Matrix<S>) -> Matrix<S>;

    /// Tangent of a fully integrated element, see [`super::kernel::tangent`]. To be overridden where the law allows better
    /// than the moduli at each point.
    #[inline(always)]
    fn tangent<S: Simd>(
        &self,
        simd: S,
        scratch: &mut Scratch,
        at: &ReferenceGeometry,
        factor: f64,
        d: &Corners,
        add: impl FnMut(usize, usize, [f64; 9]),
    ) -> Option<()> {
        full::tangent(simd, scratch, self, at, factor, d, add)
    }
}

impl Law for NeoHooke {
    #[inline(always)]
    fn shear_modulus(&self) -> f64 {
        self.modulus()
    }

    /// J^(−2β).
    #[inline(always)]
    fn volumetric<S: Simd>(&self, simd: S, determinant: &AtPoints) -> AtPoints {
        inverse_power(simd, determinant, self.exponent())
    }

    /// F − J^(−2β) F⁻ᵀ.
    #[inline(always)]
    fn stress<S: Simd>(&self, simd: S, at: &Local<'_>) -> Matrix<S> {
        let volumetric = load::<S>(at.volumetric, at.v);
        array(|a, b| simd.negate_mul_add_e_f64s(volumetric, at.inverse::<S>(b, a), at.gradient::<S>(a, b)))
    }

    /// With A = F⁻¹ dF: dF + J^(−2β) (2β tr(A) F⁻ᵀ + (A F⁻¹)ᵀ).
    #[inline(always)]
    fn stress_change<S: Simd>(&self, simd: S, at: &Local<'_>, change: &Matrix<S>) -> Matrix<S> {
        let (inverse, volumetric) = (load_matrix::<S>(at.inverse, at.v), load::<S>(at.volumetric, at.v));
        let relative = product(simd, &inverse, change);
        let trace = simd.add_f64s(simd.add_f64s(relative[0][0], relative[1][1]), relative[2][2]);
        let dilation = simd.mul_f64s(simd.splat_f64s(self.exponent()), trace);
        let transposed = product(simd, &relative, &inverse);
        array(|a, b| {
            let volume = simd.mul_add_e_f64s(dilation, inverse[b][a], transposed[b][a]);
            simd.mul_add_e_f64s(volumetric, volume, change[a][b])
        })
    }

    #[inline(always)]
    fn tangent<S: Simd>(
        &self,
        simd: S,
        scratch: &mut Scratch,
        at: &ReferenceGeometry,
        factor: f64,
        d: &Corners,
        add: impl FnMut(usize, usize, [f64; 9]),
    ) -> Option<()> {
        full::neo_hooke_tangent(simd, scratch, self, at, factor, d, add)
    }
}

impl Law for StVenantKirchhoff {
    #[inline(always)]
    fn shear_modulus(&self) -> f64 {
        Self::shear_modulus(self)
    }

    #[inline(always)]
    fn volumetric<S: Simd>(&self, _: S, _: &AtPoints) -> AtPoints {
        [0.0; POINTS]
    }

    /// F S/μ.
    #[inline(always)]
    fn stress<S: Simd>(&self, simd: S, at: &Local<'_>) -> Matrix<S> {
        product(simd, &load_matrix::<S>(at.gradient, at.v), &second_stress(simd, self, at))
    }

    /// (dF S + F dS)/μ, where 2 dE = FᵀdF + (FᵀdF)ᵀ.
    #[inline(always)]
    fn stress_change<S: Simd>(&self, simd: S, at: &Local<'_>, change: &Matrix<S>) -> Matrix<S> {
        let gradient = load_matrix::<S>(at.gradient, at.v);
        let half = product(simd, &transpose::<S>(&gradient), change);
        let doubled = array(|a, b| simd.add_f64s(half[a][b], half[b][a]));
        let second = hooke(simd, self, doubled);
        let geometric = product(simd, change, &second_stress(simd, self, at));
        let material = product(simd, &gradient, &second);
        array(|a, b| simd.add_f64s(geometric[a][b], material[a][b]))
    }
}

/// S/μ.
#[inline(always)]
fn second_stress<S: Simd>(simd: S, law: &StVenantKirchhoff, at: &Local<'_>) -> Matrix<S> {
    let gradient = load_matrix::<S>(at.gradient, at.v);
    let mut doubled = product(simd, &transpose::<S>(&gradient), &gradient);
    for a in 0..3 {
        doubled[a][a] = simd.sub_f64s(doubled[a][a], simd.splat_f64s(1.0));
    }
    hooke(simd, law, doubled)
}

/// Stress over μ of twice a strain, `doubled`: λ/(2μ) tr(2E) 1 + 2E.
#[inline(always)]
fn hooke<S: Simd>(simd: S, law: &StVenantKirchhoff, mut doubled: Matrix<S>) -> Matrix<S> {
    let trace = simd.add_f64s(simd.add_f64s(doubled[0][0], doubled[1][1]), doubled[2][2]);
    let pressure = simd.mul_f64s(simd.splat_f64s(0.5 * law.lame_ratio()), trace);
    for a in 0..3 {
        doubled[a][a] = simd.add_f64s(doubled[a][a], pressure);
    }
    doubled
}
