//! The volumetric energy of rubber laws.
//!
//! These laws split the energy into a deviatoric part, which depends on J^(−1/3) F, and a
//! volumetric part:
//!
//! ```text
//! U(J) = K/4 (J² − 1 − 2 ln J),   U″(1) = K,   P = K/2 (J² − 1) F⁻ᵀ
//! ```
//!
//! U grows without bound both for J → 0 and for J → ∞, and it is convex in J, so it does not
//! destabilise the law. K/2 (J − 1)², which other programs use, stays finite as J → 0. For small
//! changes of volume, both agree.
//!
//! Reference: Simo, Taylor, Comput. Methods Appl. Mech. Engrg. 85 (1991) 273–310.

use super::{Local, Real, determinant};
use crate::registers::{Matrix, array, load};
use pulp::Simd;

/// J^(−2/3) and U.
pub(super) fn energy<T: Real>(bulk: f64, f: &[[T; 3]; 3]) -> (T, T) {
    let ln_j = determinant(f).ln();
    let square = (T::from(2.0) * ln_j).exp_m1();
    let change = (T::from(-2.0 / 3.0) * ln_j).exp_m1() + T::from(1.0);
    (change, T::from(0.25 * bulk) * (square - T::from(2.0) * ln_j))
}

/// Volumetric pressure and stiffness, divided by the shear modulus.
#[derive(Clone, Copy)]
pub(super) struct Volume<S: Simd> {
    /// K/2 (J² − 1).
    pressure: S::f64s,
    /// K J².
    stiffness: S::f64s,
}

impl<S: Simd> Volume<S> {
    /// `bulk` is K divided by the shear modulus.
    #[inline(always)]
    pub fn new(simd: S, at: &Local<'_>, bulk: f64) -> Self {
        let j = load::<S>(at.determinant, at.v);
        let one = simd.splat_f64s(1.0);
        // (J − 1)(J + 1) avoids the round-off of J² − 1 near J = 1
        let difference = simd.mul_f64s(simd.sub_f64s(j, one), simd.add_f64s(j, one));
        let pressure = simd.mul_f64s(simd.splat_f64s(0.5 * bulk), difference);
        Self { pressure, stiffness: simd.mul_f64s(simd.splat_f64s(bulk), simd.mul_f64s(j, j)) }
    }

    /// Adds the pressure to a stress.
    #[inline(always)]
    pub fn add_stress(&self, simd: S, at: &Local<'_>, stress: &Matrix<S>) -> Matrix<S> {
        array(|a, b| simd.mul_add_e_f64s(self.pressure, at.inverse::<S>(b, a), stress[a][b]))
    }

    /// Adds its change, K J² tr(A) F⁻ᵀ − K/2 (J² − 1) (A F⁻¹)ᵀ with A = F⁻¹ dF, to a stress, given
    /// tr A and A F⁻¹.
    #[inline(always)]
    pub fn add_change(
        &self,
        simd: S,
        inverse: &Matrix<S>,
        trace: S::f64s,
        turned: &Matrix<S>,
        stress: &Matrix<S>,
    ) -> Matrix<S> {
        let dilation = simd.mul_f64s(self.stiffness, trace);
        array(|a, b| {
            let sum = simd.mul_add_e_f64s(dilation, inverse[b][a], stress[a][b]);
            simd.negate_mul_add_e_f64s(self.pressure, turned[b][a], sum)
        })
    }
}
