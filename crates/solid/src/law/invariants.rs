//! Stresses of rubber laws whose energy depends on the invariants of the deviatoric deformation.
//!
//! Let v = J^(−2/3), I₁ = tr C, I₂ = (I₁² − tr C²)/2 and C = FᵀF, and let W₁ and W₂ be the
//! derivatives of the energy with respect to Ī₁ = v I₁ and Ī₂ = v² I₂. Then
//!
//! ```text
//! P   = 2 W₁ v A₁ + 2 W₂ v² A₂ + pressure F⁻ᵀ
//! A₁  = F − I₁/3 F⁻ᵀ,    dĪ₁ = 2 v A₁:dF
//! A₂  = I₁ F − F C − 2 I₂/3 F⁻ᵀ
//! d(v A₁)  = v [dF − dI₁/3 F⁻ᵀ + I₁/3 (A F⁻¹)ᵀ − 2/3 tr(A) A₁],   A = F⁻¹ dF,  dI₁ = 2 F:dF
//! d(v² A₂) = v² [I₁ dF + dI₁ F − d(F C) − 2/3 dI₂ F⁻ᵀ + 2 I₂/3 (A F⁻¹)ᵀ − 4/3 tr(A) A₂]
//! ```
//!
//! with dI₂ = I₁ dI₁ − 2 F C:dF. W₁ may depend on Ī₁, with the slope W₁₁.

use super::volume::Volume;
use super::{Local, Real};
use crate::power::inverse_power;
use crate::registers::{AtPoints, Matrix, array, contract, load, load_matrix, product, transpose};
use pulp::Simd;

/// v = J^(−2/3).
#[inline(always)]
pub(super) fn change_of_shape<S: Simd>(simd: S, determinant: &AtPoints) -> AtPoints {
    inverse_power(simd, determinant, 2.0 / 3.0)
}

/// I₁ and I₂ at F.
pub(super) fn trace_and_second<T: Real>(f: &[[T; 3]; 3]) -> [T; 2] {
    let zero = T::from(0.0);
    let c = |a: usize, b: usize| (0..3).fold(zero, |sum, k| sum + f[k][a] * f[k][b]);
    let trace = c(0, 0) + c(1, 1) + c(2, 2);
    let minor = |a: usize, b: usize| c(a, a) * c(b, b) - c(a, b) * c(a, b);
    [trace, minor(0, 1) + minor(1, 2) + minor(2, 0)]
}

/// Derivatives of the energy with respect to the invariants, divided by the shear modulus.
#[derive(Clone, Copy)]
pub(crate) struct Slopes<S: Simd> {
    /// W₁.
    pub first: S::f64s,
    /// W₂; `None`: zero.
    pub second: Option<S::f64s>,
    /// W₁₁; `None`: zero.
    pub curvature: Option<S::f64s>,
}

/// Intermediate results shared by the stresses at the points of a register.
#[derive(Clone, Copy)]
pub(crate) struct Invariants<S: Simd> {
    volume: Volume<S>,
    /// I₁/3 and 2 I₂/3.
    parts: [S::f64s; 2],
    /// 2 W₁ v, 2 W₂ v² and 4 W₁₁ v².
    first: S::f64s,
    second: Option<S::f64s>,
    curvature: Option<S::f64s>,
}

impl<S: Simd> Invariants<S> {
    /// `volume` is relative to the shear modulus; `slopes` returns the slopes at Ī₁ − 3.
    #[inline(always)]
    pub fn new(simd: S, at: &Local<'_>, volume: Volume<S>, slopes: impl FnOnce(S::f64s) -> Slopes<S>) -> Self {
        let v = load::<S>(at.volumetric, at.v);
        let f = load_matrix::<S>(at.gradient, at.v);
        let trace = contract(simd, &f, &f);
        let Slopes { first, second, curvature } = slopes(simd.sub_f64s(simd.mul_f64s(v, trace), simd.splat_f64s(3.0)));
        let twice = |x: S::f64s| simd.add_f64s(x, x);
        let square = simd.mul_f64s(v, v);
        let two_thirds = match second {
            Some(_) => {
                let c = product(simd, &transpose::<S>(&f), &f);
                let minor =
                    |a: usize, b: usize| simd.negate_mul_add_e_f64s(c[a][b], c[a][b], simd.mul_f64s(c[a][a], c[b][b]));
                let sum = simd.add_f64s(simd.add_f64s(minor(0, 1), minor(1, 2)), minor(2, 0));
                simd.mul_f64s(simd.splat_f64s(2.0 / 3.0), sum)
            }
            None => simd.splat_f64s(0.0),
        };
        Self {
            volume,
            parts: [simd.mul_f64s(simd.splat_f64s(1.0 / 3.0), trace), two_thirds],
            first: simd.mul_f64s(twice(first), v),
            second: second.map(|w| simd.mul_f64s(twice(w), square)),
            curvature: curvature.map(|w| simd.mul_f64s(simd.mul_f64s(simd.splat_f64s(4.0), w), square)),
        }
    }

    /// A₁.
    #[inline(always)]
    fn first(&self, simd: S, f: &Matrix<S>, inverse: &Matrix<S>) -> Matrix<S> {
        array(
            #[inline(always)]
            |a, b| simd.negate_mul_add_e_f64s(self.parts[0], inverse[b][a], f[a][b]),
        )
    }

    /// A₂, given I₁ and F C.
    #[inline(always)]
    fn second(&self, simd: S, trace: S::f64s, f: &Matrix<S>, fc: &Matrix<S>, inverse: &Matrix<S>) -> Matrix<S> {
        array(
            #[inline(always)]
            |a, b| {
                let shape = simd.sub_f64s(simd.mul_f64s(trace, f[a][b]), fc[a][b]);
                simd.negate_mul_add_e_f64s(self.parts[1], inverse[b][a], shape)
            },
        )
    }

    /// P divided by the shear modulus.
    #[inline(always)]
    pub fn stress(&self, simd: S, at: &Local<'_>) -> Matrix<S> {
        let (f, inverse) = (load_matrix::<S>(at.gradient, at.v), load_matrix::<S>(at.inverse, at.v));
        let shape = self.first(simd, &f, &inverse);
        let mut p = array(
            #[inline(always)]
            |a, b| simd.mul_f64s(self.first, shape[a][b]),
        );
        if let Some(second) = self.second {
            let c = product(simd, &transpose::<S>(&f), &f);
            let trace = simd.add_f64s(simd.add_f64s(c[0][0], c[1][1]), c[2][2]);
            let shape = self.second(simd, trace, &f, &product(simd, &f, &c), &inverse);
            p = array(
                #[inline(always)]
                |a, b| simd.mul_add_e_f64s(second, shape[a][b], p[a][b]),
            );
        }
        self.volume.add_stress(simd, at, &p)
    }

    /// dP divided by the shear modulus.
    #[inline(always)]
    pub fn stress_change(&self, simd: S, at: &Local<'_>, change: &Matrix<S>) -> Matrix<S> {
        let (f, inverse) = (load_matrix::<S>(at.gradient, at.v), load_matrix::<S>(at.inverse, at.v));
        let relative = product(simd, &inverse, change);
        let trace = simd.add_f64s(simd.add_f64s(relative[0][0], relative[1][1]), relative[2][2]);
        let turned = product(simd, &relative, &inverse);
        let two_thirds = simd.splat_f64s(2.0 / 3.0);
        let shape = self.first(simd, &f, &inverse);
        // dI₁/3 and 2/3 tr A
        let half = contract(simd, &f, change);
        let (growth, shrinkage) = (simd.mul_f64s(two_thirds, half), simd.mul_f64s(two_thirds, trace));
        let mut p: Matrix<S> = array(
            #[inline(always)]
            |a, b| {
                let sum = simd.negate_mul_add_e_f64s(growth, inverse[b][a], change[a][b]);
                let sum = simd.mul_add_e_f64s(self.parts[0], turned[b][a], sum);
                simd.mul_f64s(self.first, simd.negate_mul_add_e_f64s(shrinkage, shape[a][b], sum))
            },
        );
        if let Some(curvature) = self.curvature {
            let along = simd.mul_f64s(curvature, contract(simd, &shape, change));
            p = array(
                #[inline(always)]
                |a, b| simd.mul_add_e_f64s(along, shape[a][b], p[a][b]),
            );
        }
        if let Some(second) = self.second {
            let c = product(simd, &transpose::<S>(&f), &f);
            let first = simd.add_f64s(simd.add_f64s(c[0][0], c[1][1]), c[2][2]);
            let fc = product(simd, &f, &c);
            let shape = self.second(simd, first, &f, &fc, &inverse);
            let twice = simd.add_f64s(half, half);
            // dI₂ and d(F C)
            let of_second = simd.negate_mul_add_e_f64s(
                simd.splat_f64s(2.0),
                contract(simd, &fc, change),
                simd.mul_f64s(first, twice),
            );
            let crossed = product(simd, &transpose::<S>(&f), change);
            let of_c: Matrix<S> = array(
                #[inline(always)]
                |a, b| simd.add_f64s(crossed[a][b], crossed[b][a]),
            );
            let (moved, stretched) = (product(simd, change, &c), product(simd, &f, &of_c));
            let growth = simd.mul_f64s(two_thirds, of_second);
            let shrinkage = simd.add_f64s(shrinkage, shrinkage);
            p = array(
                #[inline(always)]
                |a, b| {
                    let sum = simd.mul_add_e_f64s(twice, f[a][b], simd.mul_f64s(first, change[a][b]));
                    let sum = simd.sub_f64s(simd.sub_f64s(sum, moved[a][b]), stretched[a][b]);
                    let sum = simd.negate_mul_add_e_f64s(growth, inverse[b][a], sum);
                    let sum = simd.mul_add_e_f64s(self.parts[1], turned[b][a], sum);
                    let sum = simd.negate_mul_add_e_f64s(shrinkage, shape[a][b], sum);
                    simd.mul_add_e_f64s(second, sum, p[a][b])
                },
            );
        }
        self.volume.add_change(simd, &inverse, trace, &turned, &p)
    }
}
