//! The integrals over one second-order element, for any law and formulation, generic over the
//! instruction set.
//!
//! F̄ = (θ/J)^(1/3) F, where θ is the projection of J onto the element's modes. These are functions
//! φ_m that are orthonormal under the element's quadrature: constant in tetrahedra, linear in
//! hexahedra. With the stress P̄ = P(F̄), t = P̄:F̄/3 and the projection Π[x] = Σ_m φ_m Σ_q w_q
//! φ_m(q) x_q:
//!
//! ```text
//! θ = Π[J]      p = Π[t/θ]      P_eff = κ P̄ + (p J − t) F⁻ᵀ      κ = (θ/J)^(1/3)
//! dF̄ = κ (dF + x F)      x = (η − τ)/3      τ = F⁻ᵀ:dF      η = Π[J τ]/θ      dp = Π[(dt − t η)/θ]
//! dP_eff = κ (x P̄ + dP̄) + (p J τ − dt) F⁻ᵀ + (t − p J) (F⁻¹ dF F⁻¹)ᵀ + dp J F⁻ᵀ
//! ```
//!
//! With b_m = ∂θ_m/∂d, h_m = ∂f/∂θ_m at fixed F and p, and c_mn = Σ w φ_m φ_n ∂(t/θ)/∂θ, the
//! tangent is that at fixed θ and p, plus Σ_m (h_m b_mᵀ + b_m h_mᵀ) + Σ_mn c_mn b_m b_nᵀ. With one
//! constant mode, this is the F̄ of hex8 (`hex8/f_bar.rs`).

use super::cell::{Cell, Corners, Table};
use crate::law::{AnyLaw, Local, Stress};
use crate::power::inverse_power;
use crate::registers::{
    AtPoints, Matrices, Matrix, POINTS, array, contract, invert, load, load_matrix, product, store, store_matrix,
};
use pulp::{Simd, WithSimd};

pub(super) const ZERO: Matrices = [[[0.0; POINTS]; 3]; 3];

/// Memory for intermediate results, reused for the next element.
pub(crate) struct Scratch<const N: usize, const B: usize, const P: usize> {
    pub(super) gradient: [Matrices; B],
    pub(super) inverse: [Matrices; B],
    pub(super) determinant: [AtPoints; B],
    /// [`Stress::volumetric`] at J, or at θ.
    pub(super) volumetric: [AtPoints; B],
    /// Stresses, integrated with the gradients in the parent element.
    pub(super) matrices: [Matrices; B],
    /// ∂v/∂X of a direction v.
    pub(super) changes: [Matrices; B],
    pub(super) bar: Bar<B>,
    /// Σ_BD ∂ξ_α/∂X_B (∂P_aB/∂F_bD) ∂ξ_β/∂X_D times the weight, as `[b][β][a][α]`, a ≤ b.
    pub(super) moduli: [[[[[AtPoints; 3]; 3]; 3]; 3]; B],
    /// Moduli times gradients of the shape functions, as `[point][α][k]`.
    pub(super) rows: Vec<[[f64; P]; 3]>,
    /// K_ia,kb as `[a][b][i][k]`; only entries with a ≤ b, and k ≥ i if a = b, are used.
    pub(super) blocks: Vec<[[f64; P]; N]>,
}

pub(super) struct Bar<const B: usize> {
    pub(super) theta: [AtPoints; B],
    pub(super) ratio: [AtPoints; B],
    pub(super) gradient: [Matrices; B],
    pub(super) inverse: [Matrices; B],
    /// P̄/μ, t/μ and p/μ.
    pub(super) stress: [Matrices; B],
    pub(super) work: [AtPoints; B],
    pub(super) pressure: [AtPoints; B],
}

impl<const N: usize, const B: usize, const P: usize> Scratch<N, B, P> {
    pub fn new() -> Box<Self> {
        let one = [[1.0; POINTS]; B];
        let bar = Bar {
            theta: one,
            ratio: one,
            gradient: [ZERO; B],
            inverse: [ZERO; B],
            stress: [ZERO; B],
            work: [[0.0; POINTS]; B],
            pressure: [[0.0; POINTS]; B],
        };
        Box::new(Self {
            gradient: [ZERO; B],
            inverse: [ZERO; B],
            determinant: one,
            volumetric: one,
            matrices: [ZERO; B],
            changes: [ZERO; B],
            bar,
            moduli: [[[[[[0.0; POINTS]; 3]; 3]; 3]; 3]; B],
            rows: vec![[[0.0; P]; 3]; POINTS * B],
            blocks: vec![[[0.0; P]; N]; 9],
        })
    }

    #[inline(always)]
    pub(super) fn local(&self, bar: bool, b: usize, v: usize) -> Local<'_> {
        let (gradient, inverse, determinant) = match bar {
            true => (&self.bar.gradient[b], &self.bar.inverse[b], &self.bar.theta[b]),
            false => (&self.gradient[b], &self.inverse[b], &self.determinant[b]),
        };
        Local { gradient, inverse, determinant, volumetric: &self.volumetric[b], v }
    }
}

/// Blocks and registers that hold points of the element.
#[inline(always)]
pub(super) fn registers<S: Simd>(points: usize) -> impl Iterator<Item = (usize, usize)> {
    let per_block = POINTS / S::F64_LANES;
    (0..points.div_ceil(S::F64_LANES)).map(move |r| (r / per_block, r % per_block))
}

/// ∂u_a/∂X_B at all points, as `[a][B]`. The first node's displacement is subtracted, so even a
/// large translation causes no round-off in the strains.
///
/// This and the other parts that do not depend on the law are compiled once for all laws.
struct Gradients<'a, const N: usize, const B: usize, const P: usize, const M: usize> {
    table: &'a Table<N, B, P>,
    cell: &'a Cell<N, B, M>,
    d: &'a Corners<N>,
    out: &'a mut [Matrices; B],
}

impl<const N: usize, const B: usize, const P: usize, const M: usize> WithSimd for Gradients<'_, N, B, P, M> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { table, cell, d, out } = self;
        for (b, v) in registers::<S>(table.points()) {
            let mut parent = [[simd.splat_f64s(0.0); 3]; 3];
            for (d_i, gradients) in d.iter().zip(&table.by_node[b]).skip(1) {
                for a in 0..3 {
                    let d = simd.splat_f64s(d_i[a] - d[0][a]);
                    for beta in 0..3 {
                        let gradient = load::<S>(&gradients[beta], v);
                        parent[a][beta] = simd.mul_add_e_f64s(d, gradient, parent[a][beta]);
                    }
                }
            }
            let h = product(simd, &parent, &array(|beta, c| load::<S>(&cell.inverse[b][beta][c], v)));
            store_matrix::<S>(&mut out[b], v, &h);
        }
    }
}

/// Stress times `modulus` and weight, the input of [`integrate`].
#[inline(always)]
pub(super) fn store_scaled<S: Simd, const N: usize, const B: usize, const M: usize>(
    simd: S,
    to: &mut [Matrices; B],
    cell: &Cell<N, B, M>,
    modulus: f64,
    (b, v): (usize, usize),
    p: &Matrix<S>,
) {
    let scale = simd.mul_f64s(simd.splat_f64s(modulus), load::<S>(&cell.weights[b], v));
    let p = array(|a, c| simd.mul_f64s(scale, p[a][c]));
    let q = product(simd, &p, &array(|c, beta| load::<S>(&cell.inverse[b][beta][c], v)));
    store_matrix::<S>(&mut to[b], v, &q);
}

/// f_ia = Σ_p Σ_β Q_aβ ∂N_i/∂ξ_β.
pub(super) struct Integrate<'a, const N: usize, const B: usize, const P: usize> {
    pub(super) table: &'a Table<N, B, P>,
    pub(super) q: &'a [Matrices; B],
}

impl<const N: usize, const B: usize, const P: usize> WithSimd for Integrate<'_, N, B, P> {
    type Output = Corners<N>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Corners<N> {
        let mut out = [[0.0; P]; 3];
        for v in 0..P / S::F64_LANES {
            let mut sums = [[simd.splat_f64s(0.0); 3]; 3];
            for (p, gradients) in self.table.by_point.iter().enumerate() {
                let q = &self.q[p / POINTS];
                for beta in 0..3 {
                    let gradient = S::as_simd_f64s(&gradients[beta]).0[v];
                    for a in 0..3 {
                        let q = simd.splat_f64s(q[a][beta][p % POINTS]);
                        sums[a][beta] = simd.mul_add_e_f64s(q, gradient, sums[a][beta]);
                    }
                }
            }
            for a in 0..3 {
                S::as_mut_simd_f64s(&mut out[a]).0[v] =
                    simd.add_f64s(simd.add_f64s(sums[a][0], sums[a][1]), sums[a][2]);
            }
        }
        std::array::from_fn(|i| [out[0][i], out[1][i], out[2][i]])
    }
}

/// F, F⁻¹ and J from ∂u/∂X in `gradient`.
struct Deform<'a, const N: usize, const B: usize, const P: usize> {
    points: usize,
    scratch: &'a mut Scratch<N, B, P>,
}

impl<const N: usize, const B: usize, const P: usize> WithSimd for Deform<'_, N, B, P> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { points, scratch } = self;
        for (b, v) in registers::<S>(points) {
            let mut f = load_matrix::<S>(&scratch.gradient[b], v);
            for a in 0..3 {
                f[a][a] = simd.add_f64s(f[a][a], simd.splat_f64s(1.0));
            }
            let (inverse, j) = invert(simd, &f);
            store_matrix::<S>(&mut scratch.gradient[b], v, &f);
            store_matrix::<S>(&mut scratch.inverse[b], v, &inverse);
            store::<S>(&mut scratch.determinant[b], v, j);
        }
    }
}

/// The deformation; `None` if J is not positive and finite.
pub(super) fn deform<S: Simd, const N: usize, const B: usize, const P: usize, const M: usize>(
    simd: S,
    table: &Table<N, B, P>,
    scratch: &mut Scratch<N, B, P>,
    cell: &Cell<N, B, M>,
    d: &Corners<N>,
) -> Option<()> {
    simd.vectorize(Gradients { table, cell, d, out: &mut scratch.gradient });
    simd.vectorize(Deform { points: table.points(), scratch: &mut *scratch });
    admissible(&scratch.determinant).then_some(())
}

pub(super) fn admissible(values: &[AtPoints]) -> bool {
    values.as_flattened().iter().all(|&j| j >= f64::MIN_POSITIVE && j.is_finite())
}

/// The deformation; with F̄, also the averaged deformation and its stress.
#[inline(always)]
pub(super) fn prepare<S: Simd, const N: usize, const B: usize, const P: usize, const M: usize>(
    simd: S,
    table: &Table<N, B, P>,
    scratch: &mut Scratch<N, B, P>,
    law: AnyLaw<'_>,
    bar: bool,
    cell: &Cell<N, B, M>,
    d: &Corners<N>,
) -> Option<()> {
    deform(simd, table, scratch, cell, d)?;
    if !bar {
        for b in 0..B {
            scratch.volumetric[b] = law.volumetric(simd, &scratch.determinant[b]);
        }
        return Some(());
    }
    scratch.bar.theta = cell.project(&scratch.determinant);
    if !admissible(&scratch.bar.theta) {
        return None;
    }
    for b in 0..B {
        let mut relative = [1.0; POINTS];
        for p in 0..POINTS {
            relative[p] = scratch.determinant[b][p] / scratch.bar.theta[b][p];
        }
        scratch.bar.ratio[b] = inverse_power(simd, &relative, 1.0 / 3.0);
        scratch.volumetric[b] = law.volumetric(simd, &scratch.bar.theta[b]);
    }
    for (b, v) in registers::<S>(table.points()) {
        let ratio = load::<S>(&scratch.bar.ratio[b], v);
        let reciprocal = simd.div_f64s(simd.splat_f64s(1.0), ratio);
        let gradient = array(|a, c| simd.mul_f64s(ratio, load::<S>(&scratch.gradient[b][a][c], v)));
        let inverse = array(|c, a| simd.mul_f64s(reciprocal, load::<S>(&scratch.inverse[b][c][a], v)));
        store_matrix::<S>(&mut scratch.bar.gradient[b], v, &gradient);
        store_matrix::<S>(&mut scratch.bar.inverse[b], v, &inverse);
        let local = scratch.local(true, b, v);
        let stress = law.stress(simd, &local, &law.prepare(simd, &local));
        let work = simd.mul_f64s(simd.splat_f64s(1.0 / 3.0), contract(simd, &stress, &gradient));
        store_matrix::<S>(&mut scratch.bar.stress[b], v, &stress);
        store::<S>(&mut scratch.bar.work[b], v, work);
    }
    let Bar { theta, work, .. } = &scratch.bar;
    let relative = std::array::from_fn(|b| std::array::from_fn(|p| work[b][p] / theta[b][p]));
    scratch.bar.pressure = cell.project(&relative);
    Some(())
}

/// Force of a finite-strain law whose stiffness is `factor` times that of the material; `None` if
/// the element is inverted or its force is not finite.
#[inline(always)]
pub(super) fn internal_force<S: Simd, const N: usize, const B: usize, const P: usize, const M: usize>(
    simd: S,
    table: &Table<N, B, P>,
    scratch: &mut Scratch<N, B, P>,
    law: AnyLaw<'_>,
    bar: bool,
    cell: &Cell<N, B, M>,
    factor: f64,
    d: &Corners<N>,
) -> Option<Corners<N>> {
    prepare(simd, table, scratch, law, bar, cell, d)?;
    let modulus = factor * law.shear_modulus();
    for (b, v) in registers::<S>(table.points()) {
        let p = if bar {
            let Bar { ratio, stress, work, pressure, .. } = &scratch.bar;
            let volumetric = simd.sub_f64s(
                simd.mul_f64s(load::<S>(&pressure[b], v), load::<S>(&scratch.determinant[b], v)),
                load::<S>(&work[b], v),
            );
            let ratio = load::<S>(&ratio[b], v);
            array(|a, c| {
                let shape = simd.mul_f64s(ratio, load::<S>(&stress[b][a][c], v));
                simd.mul_add_e_f64s(volumetric, load::<S>(&scratch.inverse[b][c][a], v), shape)
            })
        } else {
            let local = scratch.local(false, b, v);
            law.stress(simd, &local, &law.prepare(simd, &local))
        };
        store_scaled(simd, &mut scratch.matrices, cell, modulus, (b, v), &p);
    }
    finite(simd.vectorize(Integrate { table, q: &scratch.matrices }))
}

fn finite<const N: usize>(force: Corners<N>) -> Option<Corners<N>> {
    force.as_flattened().iter().all(|f| f.is_finite()).then_some(force)
}

/// dP_eff/μ at fixed p, and dt/μ, in the direction of dF = `change` and η = `dilation`.
#[inline(always)]
pub(super) fn bar_stress_change<'a, S: Simd, const N: usize, const B: usize, const P: usize>(
    simd: S,
    scratch: &Scratch<N, B, P>,
    (law, prepared): (AnyLaw<'a>, &<AnyLaw<'a> as Stress>::Prepared<S>),
    (b, v): (usize, usize),
    change: &Matrix<S>,
    dilation: S::f64s,
) -> (Matrix<S>, S::f64s) {
    let third = simd.splat_f64s(1.0 / 3.0);
    let inverse = load_matrix::<S>(&scratch.inverse[b], v);
    let gradient = load_matrix::<S>(&scratch.gradient[b], v);
    let (ratio, work) = (load::<S>(&scratch.bar.ratio[b], v), load::<S>(&scratch.bar.work[b], v));
    let pressure = simd.mul_f64s(load::<S>(&scratch.bar.pressure[b], v), load::<S>(&scratch.determinant[b], v));
    let mean = load_matrix::<S>(&scratch.bar.stress[b], v);
    let relative = product(simd, &inverse, change);
    let trace = simd.add_f64s(simd.add_f64s(relative[0][0], relative[1][1]), relative[2][2]);
    let turned = product(simd, &relative, &inverse);
    let x = simd.mul_f64s(third, simd.sub_f64s(dilation, trace));
    let bar: Matrix<S> = array(|a, c| simd.mul_f64s(ratio, simd.mul_add_e_f64s(x, gradient[a][c], change[a][c])));
    let local = scratch.local(true, b, v);
    let stress = law.stress_change(simd, &local, prepared, &bar);
    let change_of_work =
        simd.add_f64s(contract(simd, &stress, &load_matrix::<S>(local.gradient, v)), contract(simd, &mean, &bar));
    let change_of_work = simd.mul_f64s(third, change_of_work);
    let by_inverse = simd.sub_f64s(simd.mul_f64s(pressure, trace), change_of_work);
    let by_turned = simd.sub_f64s(work, pressure);
    let out = array(|a, c| {
        let shape = simd.mul_f64s(ratio, simd.mul_add_e_f64s(x, mean[a][c], stress[a][c]));
        let volume = simd.mul_add_e_f64s(by_inverse, inverse[c][a], shape);
        simd.mul_add_e_f64s(by_turned, turned[c][a], volume)
    });
    (out, change_of_work)
}

/// Product of the tangent with nodal displacements `direction`; `None` as for [`internal_force`].
#[inline(always)]
pub(super) fn tangent_product<S: Simd, const N: usize, const B: usize, const P: usize, const M: usize>(
    simd: S,
    table: &Table<N, B, P>,
    scratch: &mut Scratch<N, B, P>,
    law: AnyLaw<'_>,
    bar: bool,
    cell: &Cell<N, B, M>,
    factor: f64,
    d: &Corners<N>,
    direction: &Corners<N>,
) -> Option<Corners<N>> {
    let rest = [[0.0; 3]; N];
    let d = if law.small_strains() { &rest } else { d };
    prepare(simd, table, scratch, law, bar, cell, d)?;
    let modulus = factor * law.shear_modulus();
    simd.vectorize(Gradients { table, cell, d: direction, out: &mut scratch.changes });
    if !bar {
        for (b, v) in registers::<S>(table.points()) {
            let change = load_matrix::<S>(&scratch.changes[b], v);
            let local = scratch.local(false, b, v);
            let p = law.stress_change(simd, &local, &law.prepare(simd, &local), &change);
            store_scaled(simd, &mut scratch.matrices, cell, modulus, (b, v), &p);
        }
        return finite(simd.vectorize(Integrate { table, q: &scratch.matrices }));
    }
    let mut dilation = [[0.0; POINTS]; B];
    for (b, v) in registers::<S>(table.points()) {
        let change = load_matrix::<S>(&scratch.changes[b], v);
        let inverse = load_matrix::<S>(&scratch.inverse[b], v);
        let trace = contract(simd, &array(|a, c| inverse[c][a]), &change);
        store::<S>(&mut dilation[b], v, simd.mul_f64s(trace, load::<S>(&scratch.determinant[b], v)));
    }
    let mut dilation = cell.project(&dilation);
    let mut relative = [[0.0; POINTS]; B];
    for (b, v) in registers::<S>(table.points()) {
        let theta = load::<S>(&scratch.bar.theta[b], v);
        let eta = simd.div_f64s(load::<S>(&dilation[b], v), theta);
        let change = load_matrix::<S>(&scratch.changes[b], v);
        let prepared = law.prepare(simd, &scratch.local(true, b, v));
        let (p, dt) = bar_stress_change(simd, scratch, (law, &prepared), (b, v), &change, eta);
        let work = simd.mul_f64s(load::<S>(&scratch.bar.work[b], v), eta);
        store::<S>(&mut relative[b], v, simd.div_f64s(simd.sub_f64s(dt, work), theta));
        store_matrix::<S>(&mut scratch.matrices[b], v, &p);
    }
    dilation = cell.project(&relative);
    for (b, v) in registers::<S>(table.points()) {
        let j = simd.mul_f64s(load::<S>(&dilation[b], v), load::<S>(&scratch.determinant[b], v));
        let (p, inverse) = (load_matrix::<S>(&scratch.matrices[b], v), load_matrix::<S>(&scratch.inverse[b], v));
        let p = array(|a, c| simd.mul_add_e_f64s(j, inverse[c][a], p[a][c]));
        store_scaled(simd, &mut scratch.matrices, cell, modulus, (b, v), &p);
    }
    finite(simd.vectorize(Integrate { table, q: &scratch.matrices }))
}
