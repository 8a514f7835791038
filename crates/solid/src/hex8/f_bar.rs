//! Elements with averaged volume change: F̄ = (θ/J)^(1/3) F, where θ = ∫J dV/V is the element's
//! mean of J.
//!
//! The energy is ∫Ψ(F̄) dV, and the force its gradient. With κ = (θ/J)^(1/3), P̄ = P(F̄) and t =
//! P̄:F̄/3 at a point:
//!
//! ```text
//! P_eff = κ P̄ + (p J − t) F⁻ᵀ,     p = Σ w t/(V θ),     f_ia = Σ w P_eff,aB G_iB
//! ```
//!
//! so that κ P̄ − t F⁻ᵀ is the deviatoric part of P̄, and p the mean of the volumetric part. In the
//! direction dF, with τ = F⁻ᵀ:dF, η = dθ/θ and x = (η − τ)/3:
//!
//! ```text
//! dF̄    = κ (dF + x F),        dt = (dP̄:F̄ + P̄:dF̄)/3,        dp = Σ w dt/(V θ) − p η
//! dP_eff = κ (x P̄ + dP̄) + (p J τ − dt) F⁻ᵀ + (t − p J) (F⁻¹ dF F⁻¹)ᵀ + dp J F⁻ᵀ
//! ```
//!
//! With e = ∂ln θ/∂d, h = ∂f/∂ln θ at fixed F and p, and q = Σ w (∂t/∂ln θ − t), the tangent is the
//! one at fixed θ and p, plus h eᵀ + e hᵀ + q e eᵀ. It is symmetric.
//!
//! References: de Souza Neto, Perić, Dutko, Owen, Int. J. Solids Struct. 33 (1996) 3277–3296, for
//! F̄, but with J at the centre and without a potential; Simo, Taylor, Pister, Comput. Methods
//! Appl. Mech. Engrg. 51 (1985) 177–208, for θ; Moran, Ortiz, Shih, Int. J. Numer. Methods Engrg.
//! 29 (1990) 483–514.

use super::geometry::ReferenceGeometry;
use super::integrate::{Corners, displacement_gradient, finite, integrate, to_parent};
use super::kernel::{Deformation, Scratch};
use super::moduli::{Blocks, to_pairs};
use crate::law::{Local, Stress};
use crate::power::inverse_power;
use crate::registers::{
    AtPoints, Matrices, Matrix, POINTS, array, contract, load, load_matrix, product, store, store_matrix,
};
use pulp::Simd;

/// Element mean θ and the quantities at the Gauss points that depend on it.
pub(super) struct Mean {
    /// Vθ. \[L³\]
    volume: f64,
    /// κ.
    ratio: AtPoints,
    /// F̄ and F̄⁻¹.
    gradient: Matrices,
    inverse: Matrices,
    /// θ.
    determinant: AtPoints,
    /// [`Stress::volumetric`] at θ.
    volumetric: AtPoints,
    /// P̄/μ.
    stress: Matrices,
    /// t/μ.
    work: AtPoints,
    /// p/μ.
    pressure: f64,
}

/// The part of [`Deformation`] and [`Mean`] for one register.
struct At<'a, S: Simd, L: Stress> {
    bar: Local<'a>,
    prepared: L::Prepared<S>,
    gradient: Matrix<S>,
    inverse: Matrix<S>,
    ratio: S::f64s,
    stress: Matrix<S>,
    work: S::f64s,
    /// p J/μ.
    pressure: S::f64s,
}

impl Mean {
    pub fn new() -> Self {
        Self {
            volume: 0.0,
            ratio: [0.0; POINTS],
            gradient: [[[0.0; POINTS]; 3]; 3],
            inverse: [[[0.0; POINTS]; 3]; 3],
            determinant: [0.0; POINTS],
            volumetric: [0.0; POINTS],
            stress: [[[0.0; POINTS]; 3]; 3],
            work: [0.0; POINTS],
            pressure: 0.0,
        }
    }

    /// Evaluates the stresses at an admissible deformation.
    #[inline(always)]
    fn evaluate<S: Simd>(&mut self, simd: S, law: &impl Stress, at: &ReferenceGeometry, deformation: &Deformation) {
        self.volume = sum(&at.weights, &deformation.determinant);
        let theta = self.volume / at.volume();
        self.ratio = inverse_power(simd, &deformation.determinant.map(|j| j / theta), 1.0 / 3.0);
        self.determinant = [theta; POINTS];
        self.volumetric = law.volumetric(simd, &self.determinant);
        for v in 0..POINTS / S::F64_LANES {
            let ratio = load::<S>(&self.ratio, v);
            let reciprocal = simd.div_f64s(simd.splat_f64s(1.0), ratio);
            let gradient = array(|a, b| simd.mul_f64s(ratio, load::<S>(&deformation.gradient[a][b], v)));
            let inverse = array(|b, a| simd.mul_f64s(reciprocal, load::<S>(&deformation.inverse[b][a], v)));
            store_matrix::<S>(&mut self.gradient, v, &gradient);
            store_matrix::<S>(&mut self.inverse, v, &inverse);
            let local = self.local(v);
            let stress = law.stress(simd, &local, &law.prepare(simd, &local));
            let work = contract(simd, &stress, &gradient);
            store_matrix::<S>(&mut self.stress, v, &stress);
            store::<S>(&mut self.work, v, simd.mul_f64s(simd.splat_f64s(1.0 / 3.0), work));
        }
        self.pressure = sum(&at.weights, &self.work) / self.volume;
    }

    #[inline(always)]
    fn local(&self, v: usize) -> Local<'_> {
        let Self { gradient, inverse, determinant, volumetric, .. } = self;
        Local { gradient, inverse, determinant, volumetric, v }
    }

    #[inline(always)]
    fn at<S: Simd, L: Stress>(&self, simd: S, law: &L, deformation: &Deformation, v: usize) -> At<'_, S, L> {
        At {
            bar: self.local(v),
            prepared: law.prepare(simd, &self.local(v)),
            gradient: load_matrix::<S>(&deformation.gradient, v),
            inverse: load_matrix::<S>(&deformation.inverse, v),
            ratio: load::<S>(&self.ratio, v),
            stress: load_matrix::<S>(&self.stress, v),
            work: load::<S>(&self.work, v),
            pressure: simd.mul_f64s(simd.splat_f64s(self.pressure), load::<S>(&deformation.determinant, v)),
        }
    }
}

impl<S: Simd, L: Stress> At<'_, S, L> {
    /// P_eff/μ.
    #[inline(always)]
    fn stress(&self, simd: S) -> Matrix<S> {
        let volumetric = simd.sub_f64s(self.pressure, self.work);
        array(|a, b| {
            let shape = simd.mul_f64s(self.ratio, self.stress[a][b]);
            simd.mul_add_e_f64s(volumetric, self.inverse[b][a], shape)
        })
    }

    /// dP_eff/μ at fixed p, and dt/μ, in the direction of dF = `change` and η = `dilation`.
    #[inline(always)]
    fn stress_change(&self, simd: S, law: &L, change: &Matrix<S>, dilation: S::f64s) -> (Matrix<S>, S::f64s) {
        let third = simd.splat_f64s(1.0 / 3.0);
        let relative = product(simd, &self.inverse, change);
        let trace = simd.add_f64s(simd.add_f64s(relative[0][0], relative[1][1]), relative[2][2]);
        let turned = product(simd, &relative, &self.inverse);
        let x = simd.mul_f64s(third, simd.sub_f64s(dilation, trace));
        let bar: Matrix<S> =
            array(|a, b| simd.mul_f64s(self.ratio, simd.mul_add_e_f64s(x, self.gradient[a][b], change[a][b])));
        let stress = law.stress_change(simd, &self.bar, &self.prepared, &bar);
        let work = simd.add_f64s(
            contract(simd, &stress, &load_matrix::<S>(self.bar.gradient, self.bar.v)),
            contract(simd, &self.stress, &bar),
        );
        let work = simd.mul_f64s(third, work);
        let by_inverse = simd.sub_f64s(simd.mul_f64s(self.pressure, trace), work);
        let by_turned = simd.sub_f64s(self.work, self.pressure);
        let out = array(|a, b| {
            let shape = simd.mul_f64s(self.ratio, simd.mul_add_e_f64s(x, self.stress[a][b], stress[a][b]));
            let volume = simd.mul_add_e_f64s(by_inverse, self.inverse[b][a], shape);
            simd.mul_add_e_f64s(by_turned, turned[b][a], volume)
        });
        (out, work)
    }
}

/// See [`super::kernel::internal_force`].
#[inline(always)]
pub(super) fn internal_force<S: Simd>(
    simd: S,
    scratch: &mut Scratch,
    law: &impl Stress,
    at: &ReferenceGeometry,
    factor: f64,
    d: &Corners,
) -> Option<Corners> {
    let Scratch { deformation, matrices, further, .. } = scratch;
    let mean = further.mean();
    deformation.evaluate(simd, at, d);
    if !deformation.is_admissible() {
        return None;
    }
    mean.evaluate(simd, law, at, deformation);
    let modulus = factor * law.shear_modulus();
    for v in 0..POINTS / S::F64_LANES {
        let p = mean.at(simd, law, deformation, v).stress(simd);
        store_scaled(simd, matrices, at, modulus, v, &p);
    }
    finite(integrate(simd, matrices))
}

/// See [`super::kernel::tangent_product`].
#[inline(always)]
pub(super) fn tangent_product<S: Simd>(
    simd: S,
    scratch: &mut Scratch,
    law: &impl Stress,
    at: &ReferenceGeometry,
    factor: f64,
    d: &Corners,
    direction: &Corners,
) -> Option<Corners> {
    let Scratch { deformation, matrices, further, .. } = scratch;
    let mean = further.mean();
    deformation.evaluate(simd, at, d);
    if !deformation.is_admissible() {
        return None;
    }
    mean.evaluate(simd, law, at, deformation);
    let mut dilation = [0.0; POINTS];
    for v in 0..POINTS / S::F64_LANES {
        let change = displacement_gradient(simd, at, direction, v);
        let inverse = load_matrix::<S>(&deformation.inverse, v);
        let trace = contract(simd, &array(|a, b| inverse[b][a]), &change);
        store::<S>(&mut dilation, v, simd.mul_f64s(trace, load::<S>(&deformation.determinant, v)));
    }
    let eta = sum(&at.weights, &dilation) / mean.volume;
    let mut work = [0.0; POINTS];
    for v in 0..POINTS / S::F64_LANES {
        let change = displacement_gradient(simd, at, direction, v);
        let (p, dt) = mean.at(simd, law, deformation, v).stress_change(simd, law, &change, simd.splat_f64s(eta));
        store_matrix::<S>(matrices, v, &p);
        store::<S>(&mut work, v, dt);
    }
    let pressure = sum(&at.weights, &work) / mean.volume - mean.pressure * eta;
    let modulus = factor * law.shear_modulus();
    for v in 0..POINTS / S::F64_LANES {
        let j = simd.mul_f64s(simd.splat_f64s(pressure), load::<S>(&deformation.determinant, v));
        let (p, inverse) = (load_matrix::<S>(matrices, v), load_matrix::<S>(&deformation.inverse, v));
        let p = array(|a, b| simd.mul_add_e_f64s(j, inverse[b][a], p[a][b]));
        store_scaled(simd, matrices, at, modulus, v, &p);
    }
    finite(integrate(simd, matrices))
}

/// See [`super::kernel::tangent`].
#[inline(always)]
pub(super) fn tangent<S: Simd>(
    simd: S,
    scratch: &mut Scratch,
    law: &impl Stress,
    at: &ReferenceGeometry,
    factor: f64,
    d: &Corners,
) -> Option<()> {
    let Scratch { deformation, matrices, further, tangent, .. } = scratch;
    let (moduli, mean) = further.both();
    deformation.evaluate(simd, at, d);
    if !deformation.is_admissible() {
        return None;
    }
    mean.evaluate(simd, law, at, deformation);
    let modulus = factor * law.shear_modulus();
    let zero = simd.splat_f64s(0.0);
    let mut work = [0.0; POINTS];
    for v in 0..POINTS / S::F64_LANES {
        let here = mean.at(simd, law, deformation, v);
        moduli.evaluate(
            simd,
            at,
            modulus,
            v,
            #[inline(always)]
            |change| here.stress_change(simd, law, change, zero).0,
        );
        let (p, dt) = here.stress_change(simd, law, &[[zero; 3]; 3], simd.splat_f64s(1.0));
        store_scaled(simd, matrices, at, modulus, v, &p);
        store::<S>(&mut work, v, simd.sub_f64s(dt, here.work));
    }
    let h = integrate(simd, matrices);
    for v in 0..POINTS / S::F64_LANES {
        let (j, inverse) = (load::<S>(&deformation.determinant, v), load_matrix::<S>(&deformation.inverse, v));
        let p = array(|a, b| simd.mul_f64s(j, inverse[b][a]));
        store_scaled(simd, matrices, at, 1.0 / mean.volume, v, &p);
    }
    let e = integrate(simd, matrices);
    moduli.integrate(simd);
    add_products(&mut moduli.blocks, &e, &h, modulus * sum(&at.weights, &work));
    to_pairs(&moduli.blocks, tangent);
    Some(())
}

/// Adds h eᵀ + e hᵀ + q e eᵀ.
#[inline(always)]
fn add_products(blocks: &mut Blocks, e: &Corners, h: &Corners, q: f64) {
    for b in 0..3 {
        for a in 0..=b {
            for i in 0..8 {
                let (by_e, by_h) = (h[i][a] + q * e[i][a], e[i][a]);
                for k in 0..8 {
                    blocks[a][b][i][k] += by_e * e[k][b] + by_h * h[k][b];
                }
            }
        }
    }
}

/// Stress times modulus and weight, as input of [`integrate`].
#[inline(always)]
fn store_scaled<S: Simd>(simd: S, to: &mut Matrices, at: &ReferenceGeometry, modulus: f64, v: usize, p: &Matrix<S>) {
    let scale = simd.mul_f64s(simd.splat_f64s(modulus), load::<S>(&at.weights, v));
    let p = array(|a, b| simd.mul_f64s(scale, p[a][b]));
    store_matrix::<S>(to, v, &to_parent(simd, at, &p, v));
}

/// Σ w x.
#[inline(always)]
fn sum(weights: &AtPoints, x: &AtPoints) -> f64 {
    let mut sum = 0.0;
    for p in 0..POINTS {
        sum += weights[p] * x[p];
    }
    sum
}
