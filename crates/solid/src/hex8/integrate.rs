//! Conversion between corners and Gauss points. All functions are inlined into a caller that is
//! compiled for the instruction set detected at run time.

use super::geometry::{PARENT_BY_CORNER, PARENT_BY_POINT, ReferenceGeometry};
use crate::registers::{Matrices, Matrix, POINTS, array, load, product, store};
use pulp::Simd;

/// Corner vectors of an element.
pub(crate) type Corners = [[f64; 3]; 8];

/// ∂u_a/∂X_B at the points of register `v`, as `[a][B]`.
///
/// The first corner's displacement is subtracted: a translation, however large, causes no round-off
/// in the strains.
#[inline(always)]
pub(crate) fn displacement_gradient<S: Simd>(simd: S, at: &ReferenceGeometry, d: &Corners, v: usize) -> Matrix<S> {
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

/// P (∂ξ/∂X)ᵀ, as `[a][β]`, which is integrated with the gradients in the parent cube.
#[inline(always)]
pub(crate) fn to_parent<S: Simd>(simd: S, at: &ReferenceGeometry, p: &Matrix<S>, v: usize) -> Matrix<S> {
    product(simd, p, &array(|b, beta| load::<S>(&at.inverse[beta][b], v)))
}

/// f_ia = Σ_p Σ_β Q_aβ ∂N_i/∂ξ_β.
#[inline(always)]
pub(crate) fn integrate<S: Simd>(simd: S, q: &Matrices) -> Corners {
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

/// The force, unless an entry is not a number.
#[inline(always)]
pub(crate) fn finite(force: Corners) -> Option<Corners> {
    let mut finite = true;
    for f in force.as_flattened() {
        finite &= f.is_finite();
    }
    finite.then_some(force)
}
