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
//! destabilize the law. `neo_hooke = { form = "isochoric" }` has the energy of other programs,
//!
//! ```text
//! U(J) = K/2 (J − 1)²,   P = K (J − 1) J F⁻ᵀ
//! ```
//!
//! which stays finite as J → 0. For small changes of volume, both agree.
//!
//! Reference: Simo, Taylor, Comput. Methods Appl. Mech. Engrg. 85 (1991) 273–310.

use super::{Local, Real, determinant};
use crate::registers::{Matrix, array, load};
use pulp::Simd;

/// J^(−2/3) and U.
pub(super) fn energy<T: Real>(bulk: f64, f: &[[T; 3]; 3]) -> (T, T) {
    let ln_j = determinant(f).ln();
    let square = (T::from(2.0) * ln_j).exp_m1();
    (change_of_shape(ln_j), T::from(0.25 * bulk) * (square - T::from(2.0) * ln_j))
}

/// J^(−2/3) and K/2 (J − 1)².
pub(super) fn quadratic_energy<T: Real>(bulk: f64, f: &[[T; 3]; 3]) -> (T, T) {
    let j = determinant(f);
    let growth = j - T::from(1.0);
    (change_of_shape(j.ln()), T::from(0.5 * bulk) * growth * growth)
}

fn change_of_shape<T: Real>(ln_j: T) -> T {
    (T::from(-2.0 / 3.0) * ln_j).exp_m1() + T::from(1.0)
}

/// Volumetric pressure and stiffness, divided by the shear modulus.
#[derive(Clone, Copy)]
pub(crate) struct Volume<S: Simd> {
    /// J U′, for the first U K/2 (J² − 1).
    pressure: S::f64s,
    /// Its derivative with respect to ln J, for the first U K J².
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

    /// The same for U = K/2 (J − 1)²: K (J − 1) J and K (2J − 1) J.
    #[inline(always)]
    pub fn quadratic(simd: S, at: &Local<'_>, bulk: f64) -> Self {
        let j = load::<S>(at.determinant, at.v);
        let growth = simd.sub_f64s(j, simd.splat_f64s(1.0));
        let scaled = simd.mul_f64s(simd.splat_f64s(bulk), j);
        Self { pressure: simd.mul_f64s(scaled, growth), stiffness: simd.mul_f64s(scaled, simd.add_f64s(growth, j)) }
    }

    /// The same for U = K/2 (ln J)²: K ln J and K.
    #[inline(always)]
    pub fn logarithmic(simd: S, at: &Local<'_>, bulk: f64) -> Self {
        let bulk = simd.splat_f64s(bulk);
        Self { pressure: simd.mul_f64s(bulk, load::<S>(at.volumetric, at.v)), stiffness: bulk }
    }

    /// Adds the pressure to a stress.
    #[inline(always)]
    pub fn add_stress(&self, simd: S, at: &Local<'_>, stress: &Matrix<S>) -> Matrix<S> {
        array(|a, b| simd.mul_add_e_f64s(self.pressure, at.inverse::<S>(b, a), stress[a][b]))
    }

    /// Adds its change, stiffness tr(A) F⁻ᵀ − pressure (A F⁻¹)ᵀ with A = F⁻¹ dF, to a stress, given
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
