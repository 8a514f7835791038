//! Fully integrated elements: F is evaluated at each Gauss point.

use super::geometry::{PARENT_BY_POINT, ReferenceGeometry, pair};
use super::integrate::{Corners, displacement_gradient, finite, integrate, to_parent};
use super::kernel::{Deformation, Scratch};
use super::moduli;
use crate::law::{Local, Stress};
use crate::registers::{AtPoints, POINTS, array, load, product, store, store_matrix};
use pulp::Simd;

impl Deformation {
    /// The deformation at the points of register `v`.
    #[inline(always)]
    fn local<'a>(&'a self, volumetric: &'a AtPoints, v: usize) -> Local<'a> {
        Local { gradient: &self.gradient, inverse: &self.inverse, determinant: &self.determinant, volumetric, v }
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
    let deformation = &mut scratch.deformation;
    deformation.evaluate(simd, at, d);
    if !deformation.is_admissible() {
        return None;
    }
    let volumetric = law.volumetric(simd, &deformation.determinant);
    let modulus = simd.splat_f64s(factor * law.shear_modulus());
    let stress = &mut scratch.matrices;
    for v in 0..POINTS / S::F64_LANES {
        let scale = simd.mul_f64s(modulus, load::<S>(&at.weights, v));
        let local = deformation.local(&volumetric, v);
        let p = law.stress(simd, &local, &law.prepare(simd, &local));
        let p = array(|a, b| simd.mul_f64s(scale, p[a][b]));
        store_matrix::<S>(stress, v, &to_parent(simd, at, &p, v));
    }
    finite(integrate(simd, stress))
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
    let deformation = &mut scratch.deformation;
    deformation.evaluate(simd, at, d);
    if !deformation.is_admissible() {
        return None;
    }
    let volumetric = law.volumetric(simd, &deformation.determinant);
    let modulus = simd.splat_f64s(factor * law.shear_modulus());
    let stress = &mut scratch.matrices;
    for v in 0..POINTS / S::F64_LANES {
        let scale = simd.mul_f64s(modulus, load::<S>(&at.weights, v));
        let change = displacement_gradient(simd, at, direction, v);
        let local = deformation.local(&volumetric, v);
        let p = law.stress_change(simd, &local, &law.prepare(simd, &local), &change);
        let p = array(|a, b| simd.mul_f64s(scale, p[a][b]));
        store_matrix::<S>(stress, v, &to_parent(simd, at, &p, v));
    }
    finite(integrate(simd, stress))
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
    match law.volumetric_exponent() {
        Some(exponent) => by_spatial_gradients(simd, scratch, law, exponent, at, factor, d),
        None => by_moduli(simd, scratch, law, at, factor, d),
    }
}

/// The tangent for any law, from its moduli at each point.
#[inline(always)]
fn by_moduli<S: Simd>(
    simd: S,
    scratch: &mut Scratch,
    law: &impl Stress,
    at: &ReferenceGeometry,
    factor: f64,
    d: &Corners,
) -> Option<()> {
    let Scratch { deformation, further, tangent, .. } = scratch;
    let moduli = further.moduli();
    deformation.evaluate(simd, at, d);
    if !deformation.is_admissible() {
        return None;
    }
    let volumetric = law.volumetric(simd, &deformation.determinant);
    for v in 0..POINTS / S::F64_LANES {
        let local = deformation.local(&volumetric, v);
        let prepared = law.prepare(simd, &local);
        moduli.evaluate(
            simd,
            at,
            factor * law.shear_modulus(),
            v,
            #[inline(always)]
            |change| law.stress_change(simd, &local, &prepared, change),
        );
    }
    moduli.integrate(simd);
    moduli::to_pairs(&moduli.blocks, tangent);
    Some(())
}

/// The tangent for laws with a [`Stress::volumetric_exponent`] e, written out.
///
/// With T_ia,kb = Σ w μ v g_ia g_kb the entry (a, b) of block (i, k) is e T_ia,kb + T_ib,ka + δ_ab
/// μ ∫ G_i·G_k. The last integral does not depend on the state. The sum over points is a product of
/// matrices.
#[inline(always)]
fn by_spatial_gradients<S: Simd>(
    simd: S,
    scratch: &mut Scratch,
    law: &impl Stress,
    exponent: f64,
    at: &ReferenceGeometry,
    factor: f64,
    d: &Corners,
) -> Option<()> {
    let deformation = &mut scratch.deformation;
    deformation.evaluate(simd, at, d);
    if !deformation.is_admissible() {
        return None;
    }
    let volumetric = law.volumetric(simd, &deformation.determinant);
    let modulus = factor * law.shear_modulus();
    let mut weights = [0.0; POINTS];
    for p in 0..POINTS {
        weights[p] = modulus * at.weights[p] * volumetric[p];
    }
    spatial_gradients(simd, scratch, at, &weights);
    for i in 0..8 {
        for tile in i / S::F64_LANES..8 / S::F64_LANES {
            sum_over_points(simd, scratch, i, tile);
            let Scratch { sums: [t0, t1, t2], tangent, .. } = &mut *scratch;
            let first = tile * S::F64_LANES;
            let (t0, t1, t2) = (t0.as_chunks::<3>().0, t1.as_chunks::<3>().0, t2.as_chunks::<3>().0);
            for lane in i.saturating_sub(first)..S::F64_LANES {
                let (k, t0, t1, t2) = (first + lane, t0[lane], t1[lane], t2[lane]);
                let l = modulus * at.laplacian[pair(i, k)];
                tangent[pair(i, k)] = [
                    exponent * t0[0] + t0[0] + l,
                    exponent * t0[1] + t1[0],
                    exponent * t0[2] + t2[0],
                    exponent * t1[0] + t0[1],
                    exponent * t1[1] + t1[1] + l,
                    exponent * t1[2] + t2[1],
                    exponent * t2[0] + t0[2],
                    exponent * t2[1] + t1[2],
                    exponent * t2[2] + t2[2] + l,
                ];
            }
        }
    }
    Some(())
}

/// T_ia,kb = Σ_p weighted[p][a][i] gradients[p][3 k + b] for one corner i and as many corners k as
/// a register has lanes, as `[a][3 lane + b]`.
#[inline(always)]
fn sum_over_points<S: Simd>(simd: S, scratch: &mut Scratch, i: usize, tile: usize) {
    let mut sums = [[simd.splat_f64s(0.0); 3]; 3];
    for p in 0..POINTS {
        let gradients = S::as_simd_f64s(&scratch.gradients[p]).0;
        for a in 0..3 {
            let weighted = simd.splat_f64s(scratch.weighted[p][a][i]);
            for c in 0..3 {
                sums[a][c] = simd.mul_add_e_f64s(weighted, gradients[3 * tile + c], sums[a][c]);
            }
        }
    }
    for a in 0..3 {
        S::as_mut_simd_f64s(&mut scratch.sums[a]).0[..3].copy_from_slice(&sums[a]);
    }
}

/// g_ia = ∂N_i/∂x_a at each point, into `scratch`.
#[inline(always)]
fn spatial_gradients<S: Simd>(simd: S, scratch: &mut Scratch, at: &ReferenceGeometry, weights: &AtPoints) {
    // ∂ξ_β/∂x_a
    let inverse = &mut scratch.matrices;
    for v in 0..POINTS / S::F64_LANES {
        let parent = array(|beta, b| load::<S>(&at.inverse[beta][b], v));
        let material = array(|b, a| load::<S>(&scratch.deformation.inverse[b][a], v));
        store_matrix::<S>(inverse, v, &product(simd, &parent, &material));
    }
    for p in 0..POINTS {
        let weight = simd.splat_f64s(weights[p]);
        let mut rows = [[0.0; 8]; 3];
        for v in 0..8 / S::F64_LANES {
            for a in 0..3 {
                let parent = |beta: usize| load::<S>(&PARENT_BY_POINT[p][beta], v);
                let entry = |beta: usize| simd.splat_f64s(inverse[beta][a][p]);
                let sum = simd.mul_f64s(entry(0), parent(0));
                let sum = simd.mul_add_e_f64s(entry(1), parent(1), sum);
                let sum = simd.mul_add_e_f64s(entry(2), parent(2), sum);
                store::<S>(&mut rows[a], v, sum);
                store::<S>(&mut scratch.weighted[p][a], v, simd.mul_f64s(weight, sum));
            }
        }
        for i in 0..8 {
            for a in 0..3 {
                scratch.gradients[p][3 * i + a] = rows[a][i];
            }
        }
    }
}
