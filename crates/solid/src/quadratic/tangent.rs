//! The tangent of a second-order element: stress changes of unit gradients, and the sums over points and
//! modes.

use super::cell::{Cell, Corners, Table};
use super::kernel::{Integrate, Scratch, ZERO, bar_stress_change, prepare, registers, store_scaled};
use crate::law::{AnyLaw, Stress};
use crate::registers::{AtPoints, POINTS, array, load, load_matrix, product, store, store_matrix};
use pulp::{Simd, WithSimd};

/// Tangent: calls `add` with i, k and the block of every pair of nodes i ≤ k. Returns `None`,
/// without calling `add`, if the element is inverted.
#[inline(always)]
pub(super) fn tangent<S: Simd, const N: usize, const B: usize, const P: usize, const M: usize>(
    simd: S,
    table: &Table<N, B, P>,
    scratch: &mut Scratch<N, B, P>,
    law: AnyLaw<'_>,
    bar: bool,
    cell: &Cell<N, B, M>,
    factor: f64,
    d: &Corners<N>,
    mut add: impl FnMut(usize, usize, [f64; 9]),
) -> Option<()> {
    let rest = [[0.0; 3]; N];
    let d = if law.small_strains() { &rest } else { d };
    prepare(simd, table, scratch, law, bar, cell, d)?;
    let modulus = factor * law.shear_modulus();
    let zero = simd.splat_f64s(0.0);
    for (b, v) in registers::<S>(table.points()) {
        let scale = simd.mul_f64s(simd.splat_f64s(modulus), load::<S>(&cell.weights[b], v));
        let prepared = law.prepare(simd, &scratch.local(bar, b, v));
        for c in 0..3 {
            for beta in 0..3 {
                let mut change = [[zero; 3]; 3];
                for e in 0..3 {
                    change[c][e] = load::<S>(&cell.inverse[b][beta][e], v);
                }
                let p = if bar {
                    bar_stress_change(simd, scratch, (law, &prepared), (b, v), &change, zero).0
                } else {
                    law.stress_change(simd, &scratch.local(false, b, v), &prepared, &change)
                };
                let p = array(|a, e| simd.mul_f64s(scale, p[a][e]));
                let p = product(simd, &p, &array(|e, alpha| load::<S>(&cell.inverse[b][alpha][e], v)));
                for a in 0..=c {
                    for alpha in 0..3 {
                        store::<S>(&mut scratch.moduli[b][c][beta][a][alpha], v, p[a][alpha]);
                    }
                }
            }
        }
    }
    for c in 0..3 {
        for a in 0..=c {
            simd.vectorize(Multiply { table, scratch: &mut *scratch, a, c });
        }
    }
    if bar {
        add_modes(simd, table, scratch, law, cell, modulus);
    }
    for i in 0..N {
        for k in i..N {
            let mut block = [0.0; 9];
            for a in 0..3 {
                for c in 0..3 {
                    let blocks = &scratch.blocks;
                    block[3 * a + c] = if a <= c { blocks[3 * a + c][i][k] } else { blocks[3 * c + a][k][i] };
                }
            }
            add(i, k, block);
        }
    }
    Some(())
}

/// Number of rows i that share the memory loads of one pass.
const ROWS: usize = 4;

/// K_ia,kc = Σ_p Σ_αβ ∂N_i/∂ξ_α moduli ∂N_k/∂ξ_β.
struct Multiply<'a, const N: usize, const B: usize, const P: usize> {
    table: &'a Table<N, B, P>,
    scratch: &'a mut Scratch<N, B, P>,
    a: usize,
    c: usize,
}

impl<const N: usize, const B: usize, const P: usize> WithSimd for Multiply<'_, N, B, P> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { table, scratch, a, c } = self;
        let Scratch { moduli, rows, blocks, .. } = scratch;
        for (p, gradients) in table.by_point.iter().enumerate() {
            let moduli = &moduli[p / POINTS][c];
            for alpha in 0..3 {
                let [m0, m1, m2] = [0, 1, 2].map(|beta| simd.splat_f64s(moduli[beta][a][alpha][p % POINTS]));
                let row = S::as_mut_simd_f64s(&mut rows[p][alpha]).0;
                let [g0, g1, g2] = [0, 1, 2].map(|beta| S::as_simd_f64s(&gradients[beta]).0);
                for v in 0..P / S::F64_LANES {
                    let sum = simd.mul_f64s(m0, g0[v]);
                    let sum = simd.mul_add_e_f64s(m1, g1[v], sum);
                    row[v] = simd.mul_add_e_f64s(m2, g2[v], sum);
                }
            }
        }
        let block = &mut blocks[3 * a + c];
        let width = P / S::F64_LANES;
        for first in (0..N).step_by(ROWS) {
            // below the diagonal, blocks with a = c are not used
            let start = if a == c { first / S::F64_LANES } else { 0 };
            for v in (start / 2 * 2..width).step_by(2).filter(|v| v * S::F64_LANES < N) {
                let mut sums = [[simd.splat_f64s(0.0); 2]; ROWS];
                for (p, gradients) in table.by_point.iter().enumerate() {
                    for alpha in 0..3 {
                        let row = S::as_simd_f64s(&rows[p][alpha]).0;
                        let (left, right) = (row[v], row[v + 1]);
                        for r in 0..ROWS {
                            // beyond the last node, gradients are zero
                            let gradient = simd.splat_f64s(gradients[alpha][first + r]);
                            sums[r][0] = simd.mul_add_e_f64s(gradient, left, sums[r][0]);
                            sums[r][1] = simd.mul_add_e_f64s(gradient, right, sums[r][1]);
                        }
                    }
                }
                for r in 0..ROWS.min(N - first) {
                    let to = S::as_mut_simd_f64s(&mut block[first + r]).0;
                    (to[v], to[v + 1]) = (sums[r][0], sums[r][1]);
                }
            }
        }
    }
}

/// Adds Σ_m (h_m b_mᵀ + b_m h_mᵀ) + Σ_mn c_mn b_m b_nᵀ.
#[inline(always)]
fn add_modes<S: Simd, const N: usize, const B: usize, const P: usize, const M: usize>(
    simd: S,
    table: &Table<N, B, P>,
    scratch: &mut Scratch<N, B, P>,
    law: AnyLaw<'_>,
    cell: &Cell<N, B, M>,
    modulus: f64,
) {
    let zero = simd.splat_f64s(0.0);
    let (mut by_theta, mut curvature) = ([ZERO; B], [[0.0; POINTS]; B]);
    for (b, v) in registers::<S>(table.points()) {
        let theta = load::<S>(&scratch.bar.theta[b], v);
        let eta = simd.div_f64s(simd.splat_f64s(1.0), theta);
        let prepared = law.prepare(simd, &scratch.local(true, b, v));
        let (p, dt) = bar_stress_change(simd, scratch, (law, &prepared), (b, v), &[[zero; 3]; 3], eta);
        let work = simd.mul_f64s(load::<S>(&scratch.bar.work[b], v), eta);
        store::<S>(&mut curvature[b], v, simd.mul_f64s(simd.sub_f64s(dt, work), eta));
        store_matrix::<S>(&mut by_theta[b], v, &p);
    }
    let (mut b_m, mut h_m) = ([[[0.0; 3]; N]; M], [[[0.0; 3]; N]; M]);
    for m in 0..M {
        for (b, v) in registers::<S>(table.points()) {
            let mode = load::<S>(&cell.modes[m][b], v);
            let j = simd.mul_f64s(mode, load::<S>(&scratch.determinant[b], v));
            let inverse = load_matrix::<S>(&scratch.inverse[b], v);
            let p = array(|a, c| simd.mul_f64s(j, inverse[c][a]));
            store_scaled(simd, &mut scratch.matrices, cell, 1.0, (b, v), &p);
        }
        b_m[m] = simd.vectorize(Integrate { table, q: &scratch.matrices });
        for (b, v) in registers::<S>(table.points()) {
            let mode = load::<S>(&cell.modes[m][b], v);
            let p = load_matrix::<S>(&by_theta[b], v);
            let p = array(|a, c| simd.mul_f64s(mode, p[a][c]));
            store_scaled(simd, &mut scratch.matrices, cell, modulus, (b, v), &p);
        }
        h_m[m] = simd.vectorize(Integrate { table, q: &scratch.matrices });
    }
    simd.vectorize(AddProducts { table, cell, blocks: &mut scratch.blocks, b_m, h_m, modulus, curvature });
}

/// The sums over the modes.
struct AddProducts<'a, const N: usize, const B: usize, const P: usize, const M: usize> {
    table: &'a Table<N, B, P>,
    cell: &'a Cell<N, B, M>,
    blocks: &'a mut [[[f64; P]; N]],
    b_m: [Corners<N>; M],
    h_m: [Corners<N>; M],
    modulus: f64,
    /// ∂(t/θ)/∂θ divided by μ.
    curvature: [AtPoints; B],
}

impl<const N: usize, const B: usize, const P: usize, const M: usize> WithSimd for AddProducts<'_, N, B, P, M> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { table, cell, blocks, b_m, h_m, modulus, curvature } = self;
        for m in 0..M {
            let mut g = h_m[m];
            for n in 0..M {
                let of = |(b, p): (usize, usize)| {
                    cell.weights[b][p] * cell.modes[m][b][p] * cell.modes[n][b][p] * curvature[b][p]
                };
                let c_mn = modulus * (0..table.points()).map(|p| of((p / POINTS, p % POINTS))).sum::<f64>();
                for i in 0..N {
                    for a in 0..3 {
                        g[i][a] += c_mn * b_m[n][i][a];
                    }
                }
            }
            for c in 0..3 {
                let (mut b_c, mut h_c) = ([0.0; P], [0.0; P]);
                for k in 0..N {
                    (b_c[k], h_c[k]) = (b_m[m][k][c], h_m[m][k][c]);
                }
                for a in 0..=c {
                    for (i, row) in blocks[3 * a + c].iter_mut().enumerate() {
                        let (by_b, by_h) = (simd.splat_f64s(g[i][a]), simd.splat_f64s(b_m[m][i][a]));
                        let row = S::as_mut_simd_f64s(row).0;
                        let (b_c, h_c) = (S::as_simd_f64s(&b_c).0, S::as_simd_f64s(&h_c).0);
                        for v in 0..P / S::F64_LANES {
                            row[v] = simd.mul_add_e_f64s(by_b, b_c[v], row[v]);
                            row[v] = simd.mul_add_e_f64s(by_h, h_c[v], row[v]);
                        }
                    }
                }
            }
        }
    }
}
