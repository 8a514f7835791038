//! The loops of the element integrals, generic over the instruction set.
//!
//! A register holds a few Gauss points while strains and stresses are computed, and a few corners while they are
//! integrated. All functions are inlined into a caller that is compiled for the instruction set found at run time
//! ([`pulp::Arch`]).

use super::geometry::{AtPoints, PARENT_BY_CORNER, PARENT_BY_POINT, POINTS, ReferenceGeometry, pair};
use super::power::inverse_power;
use crate::material::NeoHooke;
use pulp::Simd;

/// A 3×3 matrix at each Gauss point.
type Matrices = [[AtPoints; 3]; 3];
/// A 3×3 matrix at as many points as a register holds.
type Matrix<S> = [[<S as Simd>::f64s; 3]; 3];

/// F, F⁻¹ and J at the Gauss points.
pub(super) struct Deformation {
    pub gradient: Matrices,
    /// As `[B][a]`.
    inverse: Matrices,
    pub determinant: AtPoints,
}

/// Intermediate results of one element. Their memory serves for the next element again: clearing it every time would
/// take a noticeable part of the time.
pub(crate) struct Scratch {
    deformation: Deformation,
    /// Stresses, or gradients of the parent coordinates.
    matrices: Matrices,
    /// Spatial gradients times the weight of the point, as `[point][a][i]`.
    weighted: [[[f64; 8]; 3]; POINTS],
    /// Spatial gradients g_ia, as `[point][3 i + a]`.
    gradients: [[f64; 24]; POINTS],
    /// Sums over the points, see [`sum_over_points`].
    sums: [[f64; 24]; 3],
}

impl Scratch {
    pub fn new() -> Self {
        Self {
            deformation: Deformation::new(),
            matrices: [[[0.0; POINTS]; 3]; 3],
            weighted: [[[0.0; 8]; 3]; POINTS],
            gradients: [[0.0; 24]; POINTS],
            sums: [[0.0; 24]; 3],
        }
    }
}

impl Deformation {
    pub fn new() -> Self {
        let zero = [[[0.0; POINTS]; 3]; 3];
        Self { gradient: zero, inverse: zero, determinant: [0.0; POINTS] }
    }

    /// Evaluates at corner displacements `d`. Whether the element is admissible is up to the caller.
    #[inline(always)]
    pub fn evaluate<S: Simd>(&mut self, simd: S, at: &ReferenceGeometry, d: &[[f64; 3]; 8]) {
        for v in 0..POINTS / S::F64_LANES {
            let mut f = displacement_gradient(simd, at, d, v);
            for a in 0..3 {
                f[a][a] = simd.add_f64s(f[a][a], simd.splat_f64s(1.0));
            }
            let (inverse, j) = invert(simd, &f);
            store_matrix::<S>(&mut self.gradient, v, &f);
            store_matrix::<S>(&mut self.inverse, v, &inverse);
            store::<S>(&mut self.determinant, v, j);
        }
    }

    /// Whether J is positive and finite at all points. NaN is not.
    #[inline(always)]
    pub fn is_admissible(&self) -> bool {
        let mut admissible = true;
        for j in self.determinant {
            admissible &= j >= f64::MIN_POSITIVE && j.is_finite();
        }
        admissible
    }
}

/// Internal force at stiffness `factor` times that of the material, or `None` if the element is inverted or its force
/// not finite.
#[inline(always)]
pub(crate) fn internal_force<S: Simd>(
    simd: S,
    scratch: &mut Scratch,
    material: &NeoHooke,
    at: &ReferenceGeometry,
    factor: f64,
    d: &[[f64; 3]; 8],
) -> Option<[[f64; 3]; 8]> {
    let deformation = &mut scratch.deformation;
    deformation.evaluate(simd, at, d);
    if !deformation.is_admissible() {
        return None;
    }
    let volumetric = inverse_power(simd, &deformation.determinant, material.exponent());
    let modulus = simd.splat_f64s(factor * material.modulus());
    let stress = &mut scratch.matrices;
    for v in 0..POINTS / S::F64_LANES {
        let scale = simd.mul_f64s(modulus, load::<S>(&at.weights, v));
        let volumetric = load::<S>(&volumetric, v);
        let p = array(|a, b| {
            let (f, inverse) = (load::<S>(&deformation.gradient[a][b], v), load::<S>(&deformation.inverse[b][a], v));
            simd.mul_f64s(scale, simd.negate_mul_add_e_f64s(volumetric, inverse, f))
        });
        store_matrix::<S>(stress, v, &to_parent(simd, at, &p, v));
    }
    finite(integrate(simd, stress))
}

/// Product of the tangent at stiffness `factor` times that of the material with corner displacements `v`; `None` as
/// for [`internal_force`].
///
/// With A = F⁻¹ ∇v: dP = 2c (∇v + J^(−2β) (2β tr(A) F⁻ᵀ + (A F⁻¹)ᵀ)).
#[inline(always)]
pub(crate) fn tangent_product<S: Simd>(
    simd: S,
    scratch: &mut Scratch,
    material: &NeoHooke,
    at: &ReferenceGeometry,
    factor: f64,
    d: &[[f64; 3]; 8],
    direction: &[[f64; 3]; 8],
) -> Option<[[f64; 3]; 8]> {
    let deformation = &mut scratch.deformation;
    deformation.evaluate(simd, at, d);
    if !deformation.is_admissible() {
        return None;
    }
    let volumetric = inverse_power(simd, &deformation.determinant, material.exponent());
    let modulus = simd.splat_f64s(factor * material.modulus());
    let exponent = simd.splat_f64s(material.exponent());
    let stress = &mut scratch.matrices;
    for v in 0..POINTS / S::F64_LANES {
        let scale = simd.mul_f64s(modulus, load::<S>(&at.weights, v));
        let volumetric = load::<S>(&volumetric, v);
        let inverse: Matrix<S> = array(|b, a| load::<S>(&deformation.inverse[b][a], v));
        let change = displacement_gradient(simd, at, direction, v);
        let relative = product(simd, &inverse, &change);
        let trace = simd.add_f64s(simd.add_f64s(relative[0][0], relative[1][1]), relative[2][2]);
        let dilation = simd.mul_f64s(exponent, trace);
        let transposed = product(simd, &relative, &inverse);
        let p = array(|a, b| {
            let volume = simd.mul_add_e_f64s(dilation, inverse[b][a], transposed[b][a]);
            simd.mul_f64s(scale, simd.mul_add_e_f64s(volumetric, volume, change[a][b]))
        });
        store_matrix::<S>(stress, v, &to_parent(simd, at, &p, v));
    }
    finite(integrate(simd, stress))
}

/// Tangent at stiffness `factor` times that of the material: calls `add` with i, k and the row-major 3×3 block of every
/// pair of corners i ≤ k. `None`, and no call, if the element is inverted.
///
/// With T_ia,kb = Σ w 2c J^(−2β) g_ia g_kb the entry (a, b) of block (i, k) is 2β T_ia,kb + T_ib,ka + δ_ab 2c ∫ G_i·G_k.
/// The last integral does not depend on the state. The sum over points is a product of matrices.
#[inline(always)]
pub(crate) fn tangent<S: Simd>(
    simd: S,
    scratch: &mut Scratch,
    material: &NeoHooke,
    at: &ReferenceGeometry,
    factor: f64,
    d: &[[f64; 3]; 8],
    mut add: impl FnMut(usize, usize, [f64; 9]),
) -> Option<()> {
    let deformation = &mut scratch.deformation;
    deformation.evaluate(simd, at, d);
    if !deformation.is_admissible() {
        return None;
    }
    let volumetric = inverse_power(simd, &deformation.determinant, material.exponent());
    let (modulus, exponent) = (factor * material.modulus(), material.exponent());
    let mut weights = [0.0; POINTS];
    for p in 0..POINTS {
        weights[p] = modulus * at.weights[p] * volumetric[p];
    }
    spatial_gradients(simd, scratch, at, &weights);
    for i in 0..8 {
        for tile in i / S::F64_LANES..8 / S::F64_LANES {
            sum_over_points(simd, scratch, i, tile);
            let [t0, t1, t2] = &scratch.sums;
            let first = tile * S::F64_LANES;
            let (t0, t1, t2) = (t0.as_chunks::<3>().0, t1.as_chunks::<3>().0, t2.as_chunks::<3>().0);
            for lane in i.saturating_sub(first)..S::F64_LANES {
                let (k, t0, t1, t2) = (first + lane, t0[lane], t1[lane], t2[lane]);
                let l = modulus * at.laplacian[pair(i, k)];
                add(
                    i,
                    k,
                    [
                        exponent * t0[0] + t0[0] + l,
                        exponent * t0[1] + t1[0],
                        exponent * t0[2] + t2[0],
                        exponent * t1[0] + t0[1],
                        exponent * t1[1] + t1[1] + l,
                        exponent * t1[2] + t2[1],
                        exponent * t2[0] + t0[2],
                        exponent * t2[1] + t1[2],
                        exponent * t2[2] + t2[2] + l,
                    ],
                );
            }
        }
    }
    Some(())
}

/// T_ia,kb = Σ_p weighted[p][a][i] gradients[p][3 k + b] of one corner i and as many corners k as a register has lanes,
/// as `[a][3 lane + b]`.
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

/// ∂u_a/∂X_B at the points of register `v`, as `[a][B]`.
///
/// The first corner's displacement is subtracted: a translation, however large, leaves no round-off in the strains.
#[inline(always)]
fn displacement_gradient<S: Simd>(simd: S, at: &ReferenceGeometry, d: &[[f64; 3]; 8], v: usize) -> Matrix<S> {
    let mut parent = [[simd.splat_f64s(0.0); 3]; 3];
    for i in 1..8 {
        for a in 0..3 {
            let d = simd.splat_f64s(d[i][a] - d[0][a]);
            for beta in 0..3 {
                let gradient = load::<S>(&PARENT_BY_CORNER[i][beta], v);
                parent[a][beta] = simd.mul_add_e_f64s(d, gradient, parent[a][beta]);
            }
        }
    }
    product(simd, &parent, &array(|beta, b| load::<S>(&at.inverse[beta][b], v)))
}

/// P (∂ξ/∂X)ᵀ, as `[a][β]`: what integrates with the gradients in the parent cube.
#[inline(always)]
fn to_parent<S: Simd>(simd: S, at: &ReferenceGeometry, p: &Matrix<S>, v: usize) -> Matrix<S> {
    product(simd, p, &array(|b, beta| load::<S>(&at.inverse[beta][b], v)))
}

/// f_ia = Σ_p Σ_β Q_aβ ∂N_i/∂ξ_β.
#[inline(always)]
fn integrate<S: Simd>(simd: S, q: &Matrices) -> [[f64; 3]; 8] {
    let mut out = [[0.0; 8]; 3];
    for v in 0..8 / S::F64_LANES {
        // One sum per term: nine independent chains of operations.
        let mut sums = [[simd.splat_f64s(0.0); 3]; 3];
        for p in 0..POINTS {
            for beta in 0..3 {
                let gradient = load::<S>(&PARENT_BY_POINT[p][beta], v);
                for a in 0..3 {
                    sums[a][beta] = simd.mul_add_e_f64s(simd.splat_f64s(q[a][beta][p]), gradient, sums[a][beta]);
                }
            }
        }
        for a in 0..3 {
            store::<S>(&mut out[a], v, simd.add_f64s(simd.add_f64s(sums[a][0], sums[a][1]), sums[a][2]));
        }
    }
    let mut force = [[0.0; 3]; 8];
    for i in 0..8 {
        force[i] = [out[0][i], out[1][i], out[2][i]];
    }
    force
}

/// Inverse and determinant; the inverse is meaningless where the determinant vanishes.
#[inline(always)]
fn invert<S: Simd>(simd: S, m: &Matrix<S>) -> (Matrix<S>, S::f64s) {
    let cofactors: Matrix<S> = array(|a, b| {
        let (a1, a2, b1, b2) = ((a + 1) % 3, (a + 2) % 3, (b + 1) % 3, (b + 2) % 3);
        simd.negate_mul_add_e_f64s(m[a1][b2], m[a2][b1], simd.mul_f64s(m[a1][b1], m[a2][b2]))
    });
    let det = simd.mul_f64s(m[0][0], cofactors[0][0]);
    let det = simd.mul_add_e_f64s(m[0][1], cofactors[0][1], det);
    let det = simd.mul_add_e_f64s(m[0][2], cofactors[0][2], det);
    let reciprocal = simd.div_f64s(simd.splat_f64s(1.0), det);
    (array(|a, b| simd.mul_f64s(cofactors[b][a], reciprocal)), det)
}

/// A B.
#[inline(always)]
fn product<S: Simd>(simd: S, a: &Matrix<S>, b: &Matrix<S>) -> Matrix<S> {
    array(|i, k| {
        let sum = simd.mul_f64s(a[i][0], b[0][k]);
        let sum = simd.mul_add_e_f64s(a[i][1], b[1][k], sum);
        simd.mul_add_e_f64s(a[i][2], b[2][k], sum)
    })
}

#[inline(always)]
fn array<T>(entry: impl Fn(usize, usize) -> T) -> [[T; 3]; 3] {
    [
        [entry(0, 0), entry(0, 1), entry(0, 2)],
        [entry(1, 0), entry(1, 1), entry(1, 2)],
        [entry(2, 0), entry(2, 1), entry(2, 2)],
    ]
}

/// Register `v` of eight numbers.
#[inline(always)]
pub(super) fn load<S: Simd>(from: &[f64; 8], v: usize) -> S::f64s {
    S::as_simd_f64s(from).0[v]
}

#[inline(always)]
pub(super) fn store<S: Simd>(to: &mut [f64; 8], v: usize, values: S::f64s) {
    S::as_mut_simd_f64s(to).0[v] = values;
}

#[inline(always)]
fn store_matrix<S: Simd>(to: &mut Matrices, v: usize, values: &Matrix<S>) {
    for a in 0..3 {
        for b in 0..3 {
            store::<S>(&mut to[a][b], v, values[a][b]);
        }
    }
}

#[inline(always)]
fn finite(force: [[f64; 3]; 8]) -> Option<[[f64; 3]; 8]> {
    let mut finite = true;
    for f in force.as_flattened() {
        finite &= f.is_finite();
    }
    finite.then_some(force)
}
