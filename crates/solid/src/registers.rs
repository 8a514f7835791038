//! Numbers at eight points, a few per register, and 3×3 matrices of them, for computations of laws
//! and elements. All functions are inlined into a caller that is compiled for the instruction set
//! detected at run time.

use pulp::{Simd, WithSimd};

/// Number of Gauss points, or of tetrahedra, that are computed at once.
pub const POINTS: usize = 8;
/// One number per point.
pub(crate) type AtPoints = [f64; POINTS];
/// A 3×3 matrix at each point.
pub(crate) type Matrices = [[AtPoints; 3]; 3];
/// A 3×3 matrix at as many points as a register holds.
pub(crate) type Matrix<S> = [[<S as Simd>::f64s; 3]; 3];

/// Runs an operation that is compiled once for an instruction set, instead of within each caller.
#[inline(never)]
pub(crate) fn once<S: Simd, T: WithSimd>(simd: S, operation: T) -> T::Output {
    simd.vectorize(operation)
}

/// Inverse and determinant; the inverse is meaningless if the determinant vanishes.
#[inline(always)]
pub(crate) fn invert<S: Simd>(simd: S, m: &Matrix<S>) -> (Matrix<S>, S::f64s) {
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
pub(crate) fn product<S: Simd>(simd: S, a: &Matrix<S>, b: &Matrix<S>) -> Matrix<S> {
    array(|i, k| {
        let sum = simd.mul_f64s(a[i][0], b[0][k]);
        let sum = simd.mul_add_e_f64s(a[i][1], b[1][k], sum);
        simd.mul_add_e_f64s(a[i][2], b[2][k], sum)
    })
}

#[inline(always)]
pub(crate) fn array<T>(entry: impl Fn(usize, usize) -> T) -> [[T; 3]; 3] {
    [
        [entry(0, 0), entry(0, 1), entry(0, 2)],
        [entry(1, 0), entry(1, 1), entry(1, 2)],
        [entry(2, 0), entry(2, 1), entry(2, 2)],
    ]
}

/// Register `v` of eight numbers.
#[inline(always)]
pub(crate) fn load<S: Simd>(from: &[f64; 8], v: usize) -> S::f64s {
    S::as_simd_f64s(from).0[v]
}

#[inline(always)]
pub(crate) fn store<S: Simd>(to: &mut [f64; 8], v: usize, values: S::f64s) {
    S::as_mut_simd_f64s(to).0[v] = values;
}

#[inline(always)]
pub(crate) fn store_matrix<S: Simd>(to: &mut Matrices, v: usize, values: &Matrix<S>) {
    for a in 0..3 {
        for b in 0..3 {
            store::<S>(&mut to[a][b], v, values[a][b]);
        }
    }
}

/// The matrix at the points of register `v`.
#[inline(always)]
pub(crate) fn load_matrix<S: Simd>(from: &Matrices, v: usize) -> Matrix<S> {
    array(|a, b| load::<S>(&from[a][b], v))
}

/// Σ_ab A_ab B_ab.
#[inline(always)]
pub(crate) fn contract<S: Simd>(simd: S, a: &Matrix<S>, b: &Matrix<S>) -> S::f64s {
    let mut sum = simd.mul_f64s(a[0][0], b[0][0]);
    for n in 1..9 {
        sum = simd.mul_add_e_f64s(a[n / 3][n % 3], b[n / 3][n % 3], sum);
    }
    sum
}

#[inline(always)]
pub(crate) fn transpose<S: Simd>(a: &Matrix<S>) -> Matrix<S> {
    array(|i, k| a[k][i])
}
