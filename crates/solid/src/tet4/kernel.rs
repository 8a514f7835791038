//! The integrals over a batch, generic over the instruction set: a register holds a few elements.

use super::{Batch, LANES};
use crate::block::State;
use crate::heat::Power;
use crate::interpolation::ElementScaling;
use crate::law::{Local, Stress, with_stress};
use crate::registers::{
    AtPoints, Matrices, Matrix, array, contract, invert, load, load_matrix, product, store, store_matrix,
};
use pulp::Simd;

const ZERO: Matrices = [[[0.0; LANES]; 3]; 3];
const ONES: AtPoints = [1.0; LANES];
const IDENTITY: Matrices =
    [[ONES, [0.0; LANES], [0.0; LANES]], [[0.0; LANES], ONES, [0.0; LANES]], [[0.0; LANES], [0.0; LANES], ONES]];

/// State of a batch and intermediate results; its memory is reused for the next batch.
pub(crate) struct Work {
    /// ∂u/∂X.
    displacement: Matrices,
    /// F at γ u, F⁻¹ as `[B][a]`, and J.
    gradient: Matrices,
    inverse: Matrices,
    determinant: AtPoints,
    gamma: AtPoints,
    /// V s μ.
    modulus: AtPoints,
    /// Whether some γ is not 1.
    interpolated: bool,
    /// V P (∂ξ/∂X)ᵀ as `[a][β]`: the forces of all corners except the first.
    forces: Matrices,
    /// Changes of these under a displacement b of corner β + 1, as `[b][β]`.
    moduli: [[Matrices; 3]; 3],
}

/// Weights of the finite-strain part and of linear elasticity, for one element.
type Weights = fn(f64) -> [f64; 2];

/// Weights in the force, and in its derivatives.
const OF_FORCE: Weights = |gamma| [gamma, 1.0 - gamma * gamma];
const OF_TANGENT: Weights = |gamma| [gamma * gamma, 1.0 - gamma * gamma];

impl Work {
    pub fn new() -> Self {
        Self {
            displacement: ZERO,
            gradient: ZERO,
            inverse: ZERO,
            determinant: ONES,
            gamma: ONES,
            modulus: [0.0; LANES],
            interpolated: false,
            forces: ZERO,
            moduli: [[ZERO; 3]; 3],
        }
    }

    /// Evaluates the deformation at a state, without thermal expansion. The caller checks which elements are
    /// admissible.
    #[inline(always)]
    fn deform<S: Simd>(&mut self, simd: S, batch: &Batch, state: State<'_>, power: Power, law: &impl Stress) {
        self.modulus = [0.0; LANES];
        self.gamma = ONES;
        for (lane, &number) in batch.numbers().iter().enumerate() {
            let ElementScaling { factor, gamma, .. } =
                state.scaling(number as usize, batch.section, power).effective(law.small_strains());
            self.modulus[lane] = factor * batch.volumes[lane] * law.shear_modulus();
            self.gamma[lane] = gamma;
        }
        self.interpolated = self.gamma != ONES;
        self.displacement = field_gradient(simd, batch, state.d);
        if state.heat.is_some() {
            for (lane, &number) in batch.numbers().iter().enumerate() {
                let h = self.displacement.map(|row| row.map(|entry| entry[lane]));
                let h = state.without_expansion(h, number as usize, batch.section);
                (0..9).for_each(|n| self.displacement[n / 3][n % 3][lane] = h[n / 3][n % 3]);
            }
        }
        for v in 0..LANES / S::F64_LANES {
            let gamma = load::<S>(&self.gamma, v);
            let mut f = array(|a, b| simd.mul_f64s(gamma, load::<S>(&self.displacement[a][b], v)));
            for a in 0..3 {
                f[a][a] = simd.add_f64s(f[a][a], simd.splat_f64s(1.0));
            }
            let (inverse, j) = invert(simd, &f);
            store_matrix::<S>(&mut self.gradient, v, &f);
            store_matrix::<S>(&mut self.inverse, v, &inverse);
            store::<S>(&mut self.determinant, v, j);
        }
    }

    /// Whether J of an element is positive and finite.
    #[inline(always)]
    pub fn is_admissible(&self, lane: usize) -> bool {
        let j = self.determinant[lane];
        j >= f64::MIN_POSITIVE && j.is_finite()
    }

    /// Forces of the corners of an element; NaN if it is inverted.
    #[inline(always)]
    pub fn forces(&self, lane: usize) -> [[f64; 3]; 4] {
        let mut out = [[0.0; 3]; 4];
        for beta in 0..3 {
            for a in 0..3 {
                let force = if self.is_admissible(lane) { self.forces[a][beta][lane] } else { f64::NAN };
                out[beta + 1][a] = force;
                out[0][a] -= force;
            }
        }
        out
    }

    /// Tangent of an element: block (i, k) at `[4 i + k]`, row-major 3×3.
    #[inline(always)]
    pub fn tangent(&self, lane: usize) -> [[f64; 9]; 16] {
        let mut out = [[0.0; 9]; 16];
        for k in 1..4 {
            for i in 1..4 {
                for a in 0..3 {
                    for b in 0..3 {
                        // only one half of the symmetric tangent is stored
                        let entry = match a <= b {
                            true => self.moduli[b][k - 1][a][i - 1][lane],
                            false => self.moduli[a][i - 1][b][k - 1][lane],
                        };
                        out[4 * i + k][3 * a + b] = entry;
                        out[k][3 * a + b] -= entry;
                    }
                }
            }
            for a in 0..3 {
                for b in 0..3 {
                    out[4 * k][3 * b + a] = out[k][3 * a + b];
                    out[0][3 * a + b] -= out[k][3 * a + b];
                }
            }
        }
        out
    }

    /// Internal forces at displacements `d`.
    #[inline(always)]
    pub fn internal_force<S: Simd>(&mut self, simd: S, batch: &Batch, state: State<'_>) {
        let material = &state.sections[batch.section].material;
        with_stress!(S, material, law => self.force_of(simd, &law, batch, state))
    }

    #[inline(always)]
    fn force_of<S: Simd>(&mut self, simd: S, law: &impl Stress, batch: &Batch, state: State<'_>) {
        self.deform(simd, batch, state, Power::Force, law);
        let volumetric = law.volumetric(simd, &self.determinant);
        let rest = if self.interpolated { law.volumetric(simd, &ONES) } else { ONES };
        let [finite, linear] = self.weights(OF_FORCE);
        for v in 0..LANES / S::F64_LANES {
            let local = self.local(&volumetric, v);
            let p = law.stress(simd, &local, &law.prepare(simd, &local));
            let mut p = scaled(simd, load::<S>(&finite, v), p);
            if self.interpolated {
                let change = load_matrix::<S>(&self.displacement, v);
                let q = change_at_rest(simd, law, &rest, &change, v);
                p = sum(simd, &p, &scaled(simd, load::<S>(&linear, v), q));
            }
            store_matrix::<S>(&mut self.forces, v, &to_parent(simd, batch, &p, v));
        }
    }

    /// Product of the tangent at displacements `d` with `direction`, instead of the forces.
    #[inline(always)]
    pub fn tangent_product<S: Simd>(&mut self, simd: S, batch: &Batch, state: State<'_>, direction: &[f64]) {
        let material = &state.sections[batch.section].material;
        with_stress!(S, material, law => self.product_of(simd, &law, batch, state, direction))
    }

    #[inline(always)]
    fn product_of<S: Simd>(&mut self, simd: S, law: &impl Stress, batch: &Batch, state: State<'_>, direction: &[f64]) {
        self.deform(simd, batch, state, Power::Tangent, law);
        let change = field_gradient(simd, batch, direction);
        let moduli = Moduli::new(simd, law, self);
        for v in 0..LANES / S::F64_LANES {
            let moduli = moduli.at(simd, law, self.local(&moduli.volumetric, v));
            let p = moduli.stress_change(simd, law, &load_matrix::<S>(&change, v));
            let q = to_parent(simd, batch, &p, v);
            store_matrix::<S>(&mut self.forces, v, &q);
        }
    }

    /// Tangents at displacements `d`.
    #[inline(always)]
    pub fn tangents<S: Simd>(&mut self, simd: S, batch: &Batch, state: State<'_>) {
        let material = &state.sections[batch.section].material;
        with_stress!(S, material, law => self.tangents_of(simd, &law, batch, state))
    }

    #[inline(always)]
    fn tangents_of<S: Simd>(&mut self, simd: S, law: &impl Stress, batch: &Batch, state: State<'_>) {
        self.deform(simd, batch, state, Power::Tangent, law);
        let moduli = Moduli::new(simd, law, self);
        let Self { gradient, inverse, determinant, moduli: blocks, .. } = self;
        for v in 0..LANES / S::F64_LANES {
            let local = Local { gradient, inverse, determinant, volumetric: &moduli.volumetric, v };
            let moduli = moduli.at(simd, law, local);
            for b in 0..3 {
                for beta in 0..3 {
                    let mut change = [[simd.splat_f64s(0.0); 3]; 3];
                    for d in 0..3 {
                        change[b][d] = load::<S>(&batch.inverse[beta][d], v);
                    }
                    let p = moduli.stress_change(simd, law, &change);
                    let q = to_parent(simd, batch, &p, v);
                    store_matrix::<S>(&mut blocks[b][beta], v, &q);
                }
            }
        }
    }

    #[inline(always)]
    fn local<'a>(&'a self, volumetric: &'a AtPoints, v: usize) -> Local<'a> {
        Local { gradient: &self.gradient, inverse: &self.inverse, determinant: &self.determinant, volumetric, v }
    }

    /// V s μ times the two weights.
    #[inline(always)]
    fn weights(&self, weights: Weights) -> [AtPoints; 2] {
        let mut out = [[0.0; LANES]; 2];
        for lane in 0..LANES {
            let [finite, linear] = weights(self.gamma[lane]);
            out[0][lane] = self.modulus[lane] * finite;
            out[1][lane] = self.modulus[lane] * linear;
        }
        out
    }
}

/// Additional data, besides the deformation, for the derivative of the stresses.
struct Moduli {
    interpolated: bool,
    volumetric: AtPoints,
    volumetric_at_rest: AtPoints,
    weights: [AtPoints; 2],
}

impl Moduli {
    #[inline(always)]
    fn new<S: Simd>(simd: S, law: &impl Stress, work: &Work) -> Self {
        Self {
            interpolated: work.interpolated,
            volumetric: law.volumetric(simd, &work.determinant),
            volumetric_at_rest: if work.interpolated { law.volumetric(simd, &ONES) } else { ONES },
            weights: work.weights(OF_TANGENT),
        }
    }

    /// What the changes of stress in the elements of register `v` share.
    #[inline(always)]
    fn at<'a, S: Simd, L: Stress>(&'a self, simd: S, law: &L, local: Local<'a>) -> ModuliAt<'a, S, L> {
        let [finite, linear] = &self.weights;
        let v = local.v;
        let rest = at_rest(&self.volumetric_at_rest, v);
        let prepared = law.prepare(simd, &local);
        let linear =
            if self.interpolated { Some((rest, law.prepare(simd, &rest), load::<S>(linear, v))) } else { None };
        ModuliAt { local, prepared, finite: load::<S>(finite, v), linear }
    }
}

/// [`Moduli`] of one register.
struct ModuliAt<'a, S: Simd, L: Stress> {
    local: Local<'a>,
    prepared: L::Prepared<S>,
    /// V s μ γ².
    finite: S::f64s,
    /// With interpolated energy, the state at rest and V s μ (1 − γ²).
    linear: Option<(Local<'a>, L::Prepared<S>, S::f64s)>,
}

impl<S: Simd, L: Stress> ModuliAt<'_, S, L> {
    /// Change of V P under a change of ∂u/∂X.
    #[inline(always)]
    fn stress_change(&self, simd: S, law: &L, change: &Matrix<S>) -> Matrix<S> {
        let p = law.stress_change(simd, &self.local, &self.prepared, change);
        let p = scaled(simd, self.finite, p);
        let Some((rest, prepared, weight)) = &self.linear else {
            return p;
        };
        let q = law.stress_change(simd, rest, prepared, change);
        sum(simd, &p, &scaled(simd, *weight, q))
    }
}

/// λ · ∂f/∂φ of the elements, where `slopes` holds the derivatives of the scalings with respect to
/// the densities; see [`crate::hex8::interpolated::pull_back`]. NaN for inverted elements.
///
/// Test: `interpolated_pull_back_matches_differences` (tests/suite/assembly.rs).
#[inline(always)]
pub(crate) fn pull_back<S: Simd>(
    simd: S,
    work: &mut Work,
    batch: &Batch,
    state: State<'_>,
    slopes: &[ElementScaling],
    adjoint: &[f64],
) -> AtPoints {
    let material = &state.sections[batch.section].material;
    with_stress!(S, material, law => pull_back_of(simd, work, &law, batch, state, slopes, adjoint))
}

#[inline(always)]
fn pull_back_of<S: Simd>(
    simd: S,
    work: &mut Work,
    law: &impl Stress,
    batch: &Batch,
    state: State<'_>,
    slopes: &[ElementScaling],
    adjoint: &[f64],
) -> AtPoints {
    work.deform(simd, batch, state, Power::Force, law);
    let lambda = field_gradient(simd, batch, adjoint);
    let volumetric = law.volumetric(simd, &work.determinant);
    let rest = law.volumetric(simd, &ONES);
    // λ times the force at γ d, K(γ d) d and K(0) d, over V μ
    let [mut force, mut finite, mut linear] = [[0.0; LANES]; 3];
    for v in 0..LANES / S::F64_LANES {
        let (lambda, change) = (load_matrix::<S>(&lambda, v), load_matrix::<S>(&work.displacement, v));
        let local = work.local(&volumetric, v);
        let prepared = law.prepare(simd, &local);
        store::<S>(&mut force, v, contract(simd, &law.stress(simd, &local, &prepared), &lambda));
        let p = law.stress_change(simd, &local, &prepared, &change);
        store::<S>(&mut finite, v, contract(simd, &p, &lambda));
        let q = change_at_rest(simd, law, &rest, &change, v);
        store::<S>(&mut linear, v, contract(simd, &q, &lambda));
    }
    let mut out = [0.0; LANES];
    for (lane, &number) in batch.numbers().iter().enumerate() {
        let [ElementScaling { factor, gamma, .. }, slope] =
            [state.scalings, slopes].map(|of| of[number as usize].effective(law.small_strains()));
        let by_factor = gamma * force[lane] + (1.0 - gamma * gamma) * linear[lane];
        let by_gamma = factor * (force[lane] + gamma * (finite[lane] - 2.0 * linear[lane]));
        let expanded = state.power(number as usize, batch.section, Power::Force);
        let modulus = expanded * batch.volumes[lane] * law.shear_modulus();
        let product = modulus * (slope.factor * by_factor + slope.gamma * by_gamma);
        out[lane] = if work.is_admissible(lane) { product } else { f64::NAN };
    }
    out
}

/// ∂v_a/∂X_B of a nodal field; its value at the first corner is subtracted, so that a translation
/// causes no round-off.
#[inline(always)]
fn field_gradient<S: Simd>(simd: S, batch: &Batch, field: &[f64]) -> Matrices {
    let mut parent = ZERO;
    for lane in 0..batch.numbers().len() {
        let corner = |i: usize| -> &[f64] { &field[3 * batch.nodes[lane][i] as usize..][..3] };
        let first = corner(0);
        for beta in 0..3 {
            let other = corner(beta + 1);
            for a in 0..3 {
                parent[a][beta][lane] = other[a] - first[a];
            }
        }
    }
    let mut out = ZERO;
    for v in 0..LANES / S::F64_LANES {
        let gradient = product(simd, &load_matrix::<S>(&parent, v), &load_matrix::<S>(&batch.inverse, v));
        store_matrix::<S>(&mut out, v, &gradient);
    }
    out
}

#[inline(always)]
fn at_rest(volumetric: &AtPoints, v: usize) -> Local<'_> {
    Local { gradient: &IDENTITY, inverse: &IDENTITY, determinant: &ONES, volumetric, v }
}

/// Derivative of P/μ at rest.
#[inline(always)]
fn change_at_rest<S: Simd>(simd: S, law: &impl Stress, rest: &AtPoints, change: &Matrix<S>, v: usize) -> Matrix<S> {
    let local = at_rest(rest, v);
    law.stress_change(simd, &local, &law.prepare(simd, &local), change)
}

/// P (∂ξ/∂X)ᵀ, as `[a][β]`.
#[inline(always)]
fn to_parent<S: Simd>(simd: S, batch: &Batch, p: &Matrix<S>, v: usize) -> Matrix<S> {
    product(simd, p, &array(|b, beta| load::<S>(&batch.inverse[beta][b], v)))
}

#[inline(always)]
fn scaled<S: Simd>(simd: S, factor: S::f64s, p: Matrix<S>) -> Matrix<S> {
    array(|a, b| simd.mul_f64s(factor, p[a][b]))
}

#[inline(always)]
fn sum<S: Simd>(simd: S, p: &Matrix<S>, q: &Matrix<S>) -> Matrix<S> {
    array(|a, b| simd.add_f64s(p[a][b], q[a][b]))
}
