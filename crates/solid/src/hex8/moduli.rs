//! Tangents of any law from its moduli: the changes of stress under the nine unit changes of F at
//! each Gauss point.

use super::geometry::{PARENT_BY_POINT, ReferenceGeometry, pair};
use super::integrate::to_parent;
use super::kernel::Pairs;
use crate::registers::{AtPoints, Matrix, POINTS, array, load, store};
use pulp::Simd;

/// K_ia,kb of one element as `[a][b][i][k]`; only entries with a ≤ b are used.
pub(super) type Blocks = [[[[f64; 8]; 8]; 3]; 3];

/// Moduli and the resulting tangent.
pub(super) struct Moduli {
    /// Σ_BD ∂ξ_α/∂X_B (∂P_aB/∂F_bD) ∂ξ_β/∂X_D times the weight, as `[b][β][a][α]`; only entries
    /// with a ≤ b are used.
    by_gradient: [[[[AtPoints; 3]; 3]; 3]; 3],
    pub blocks: Blocks,
}

impl Moduli {
    pub fn new() -> Self {
        Self { by_gradient: [[[[[0.0; POINTS]; 3]; 3]; 3]; 3], blocks: [[[[0.0; 8]; 8]; 3]; 3] }
    }

    /// Evaluates at the points of register `v`; `stress_change` gives dP/`modulus` for dF.
    #[inline(always)]
    pub fn evaluate<S: Simd>(
        &mut self,
        simd: S,
        at: &ReferenceGeometry,
        modulus: f64,
        v: usize,
        stress_change: impl Fn(&Matrix<S>) -> Matrix<S>,
    ) {
        let scale = simd.mul_f64s(simd.splat_f64s(modulus), load::<S>(&at.weights, v));
        let zero = simd.splat_f64s(0.0);
        for b in 0..3 {
            for beta in 0..3 {
                let mut change = [[zero; 3]; 3];
                for d in 0..3 {
                    change[b][d] = load::<S>(&at.inverse[beta][d], v);
                }
                let p = stress_change(&change);
                let p = array(|a, d| simd.mul_f64s(scale, p[a][d]));
                let p = to_parent(simd, at, &p, v);
                for a in 0..=b {
                    for alpha in 0..3 {
                        store::<S>(&mut self.by_gradient[b][beta][a][alpha], v, p[a][alpha]);
                    }
                }
            }
        }
    }

    /// K_ia,kb = Σ_p Σ_αβ ∂N_i/∂ξ_α moduli ∂N_k/∂ξ_β, for a ≤ b: the tangent is symmetric.
    #[inline(always)]
    pub fn integrate<S: Simd>(&mut self, simd: S) {
        for b in 0..3 {
            for a in 0..=b {
                for v in 0..8 / S::F64_LANES {
                    let mut sums = [simd.splat_f64s(0.0); 8];
                    for p in 0..POINTS {
                        let mut rows = [simd.splat_f64s(0.0); 3];
                        for beta in 0..3 {
                            let gradient = load::<S>(&PARENT_BY_POINT[p][beta], v);
                            for alpha in 0..3 {
                                let modulus = simd.splat_f64s(self.by_gradient[b][beta][a][alpha][p]);
                                rows[alpha] = simd.mul_add_e_f64s(modulus, gradient, rows[alpha]);
                            }
                        }
                        for i in 0..8 {
                            for alpha in 0..3 {
                                let gradient = simd.splat_f64s(PARENT_BY_POINT[p][alpha][i]);
                                sums[i] = simd.mul_add_e_f64s(gradient, rows[alpha], sums[i]);
                            }
                        }
                    }
                    for i in 0..8 {
                        store::<S>(&mut self.blocks[a][b][i], v, sums[i]);
                    }
                }
            }
        }
    }
}

/// The row-major 3×3 block of every pair of corners.
#[inline(always)]
pub(super) fn to_pairs(blocks: &Blocks, out: &mut Pairs) {
    for i in 0..8 {
        for k in i..8 {
            let block = &mut out[pair(i, k)];
            for a in 0..3 {
                for b in 0..3 {
                    block[3 * a + b] = if a <= b { blocks[a][b][i][k] } else { blocks[b][a][k][i] };
                }
            }
        }
    }
}
