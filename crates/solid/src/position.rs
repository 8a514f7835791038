//! Derivatives of forces and histories with respect to the reference positions of nodes, for elements of any
//! type and law.
//!
//! At fixed displacements u, a change δX of the nodes, with L = ∂δX/∂X, changes
//!
//! ```text
//! δw = w tr L      δH = −H L      H = ∂u/∂X
//! ```
//!
//! and, through these, E(u) = Σ w Ψ(F̄). With f = ∂E/∂u, the derivative of λ · f is that of ∂E/∂X along λ: all
//! kinematics below are [dual numbers](Dual) whose slopes belong to u + ελ. With the tensors Z_q = w ∂Ψ/∂F̄_q
//!
//! ```text
//! ∂E/∂X_k = Σ_q [ w Ψ G_qk − H_qᵀ T_q G_qk ],      T_q = ∂(Σ_p Z_p : F̄_p)/∂F_q
//! ```
//!
//! where T = Z without F̄. F̄ replaces t = J (or tr H, in linear elasticity) by Θ_q = m_q · c, its projection onto
//! the modes m: c = M⁻¹ Σ w m t with M = Σ w m mᵀ. With weights b_q of Θ_q, v = M⁻¹ Σ b m and v_q = v · m_q,
//!
//! ```text
//! δ(Σ b Θ) = Σ_q [ w v_q δt_q + v_q (t − Θ)_q δw_q + (b_q c − w v_q c + w (t − Θ)_q v) · δm_q ]
//! ```
//!
//! The modes are 1 and, in hex27, X itself: their change is δX at the point. Thermal expansion and the interpolation
//! of the energy enter as in [`crate::heat`] and [`crate::interpolation`].
//!
//! Test: `forces_and_histories_by_positions` (tests/suite/positions.rs).

use crate::block::{State, visit};
use crate::dual::Dual;
use crate::evaluations::Evaluation;
use crate::heat::Power;
use crate::inelastic::{PointElement, by_deformation};
use crate::interpolation::ElementScaling;
use crate::law::{Material, Real, determinant, inverse};
use crate::memory::SolidAdjoint;
use crate::model::{InvertedElements, SolidModel, SolidStep, refuse};
use crate::quadratic::hex27_values;
use crate::section::Formulation;
use std::array::from_fn;

/// A number at u + ελ: its value at u and its derivative along λ.
type Along = Dual<f64>;
type Tensor = [[Along; 3]; 3];

fn along(value: f64, slope: f64) -> Along {
    Dual { value, slopes: [slope] }
}

impl SolidModel {
    /// Adds the transposed derivatives of λ · f + η · h′ with respect to the reference positions of the nodes at
    /// fixed displacements, three entries per node. An empty list of η means zero.
    ///
    /// # Errors
    /// [`InvertedElements`]; `out` is then unspecified.
    pub fn pull_back_positions(
        &self,
        d: &[f64],
        step: SolidStep<'_>,
        adjoint: SolidAdjoint<'_>,
        out: &mut [f64],
    ) -> Result<(), InvertedElements> {
        self.counter.count(Evaluation::PullBack);
        let (terms, mut rejected) = (self.terms(self.state(d, step)), Vec::new());
        for (block, (term, state)) in self.blocks.iter().flat_map(|block| terms.each().map(move |of| (block, of))) {
            if !term.has(&**block) {
                continue;
            }
            let places: Vec<usize> = (0..block.places()).collect();
            let of = |&place: &usize| {
                let element = block.points(place).filter(|element| !state.skips(element.number))?;
                Some((element.number, element.nodes.clone(), pull_back(&element, state, &self.coordinates, adjoint)))
            };
            visit(&places, of, |_, found| {
                let Some((number, nodes, derivatives)) = found else { return };
                let finite = derivatives.filter(|of| of.as_flattened().iter().all(|x| x.is_finite()));
                let Some(derivatives) = finite else { return rejected.push(number) };
                for (&node, derivative) in nodes.iter().zip(derivatives) {
                    (0..3).for_each(|c| out[3 * node as usize + c] += derivative[c]);
                }
            });
        }
        refuse(rejected)
    }
}

/// One of the two energies of an element.
#[derive(Clone, Copy, PartialEq)]
enum Energy {
    /// Ψ at F = 1 + γH.
    Finite { gamma: f64 },
    /// Ψ_L at H.
    Linear,
}

/// The derivatives at the nodes of an element; `None` if it is inverted.
fn pull_back(
    element: &PointElement,
    state: State<'_>,
    coordinates: &[f64],
    adjoint: SolidAdjoint<'_>,
) -> Option<Vec<[f64; 3]>> {
    let (number, section) = (element.number(), element.section as usize);
    let material = &state.sections[section].material;
    let has_memory = material.kind().has_memory();
    let mut out = vec![[0.0; 3]; element.nodes.len()];
    let at = |v: &[f64], node: u32, c: usize| v[3 * node as usize + c];
    let eta = adjoint.history.get(element.entries(0).start..element.entries(element.points()).start);
    let eta = eta.filter(|_| has_memory).unwrap_or_default();
    let moves = element.nodes.iter().any(|&node| (0..3).any(|c| at(adjoint.forces, node, c) != 0.0));
    if !moves && eta.iter().all(|&eta| eta == 0.0) {
        return Some(out);
    }
    let first = element.nodes[0];
    let from_first = |v: &[f64], node: u32, c: usize| at(v, node, c) - at(v, first, c);
    let gradient = |gradients: &Vec<[f64; 3]>| -> Tensor {
        let mut h = [[Along::from(0.0); 3]; 3];
        for (&node, g) in element.nodes.iter().zip(gradients) {
            for a in 0..3 {
                let u = along(from_first(state.d, node, a), from_first(adjoint.forces, node, a));
                (0..3).for_each(|b| h[a][b] = h[a][b] + u * g[b].into());
            }
        }
        h
    };
    let gradients: Vec<Tensor> = element.gradients.iter().map(gradient).collect();
    let (expansion, slope) = (state.stretch(number) - 1.0, state.by_displacement(number, section));
    let strained = |h: &Tensor| -> Tensor {
        from_fn(|a| from_fn(|b| Along::from(slope) * (h[a][b] - if a == b { expansion.into() } else { 0.0.into() })))
    };
    let strains: Vec<Tensor> = gradients.iter().map(strained).collect();
    let scaling = state.scaling(number, section, Power::Energy);
    let small = material.small_strains();
    let ElementScaling { factor, gamma, strength, .. } = scaling.effective(small);
    let linear = 1.0 - gamma * gamma;
    let modes = (state.sections[section].formulation == Formulation::FBar).then(|| Modes::new(element, coordinates));
    for (energy, share) in [(Energy::Finite { gamma }, f64::from(gamma != 0.0)), (Energy::Linear, linear)] {
        if share == 0.0 {
            continue;
        }
        let by_gradient = if let Energy::Finite { gamma } = energy { gamma * slope } else { slope };
        let kinematics = Kinematics::new(element, &strains, energy, modes.as_ref())?;
        let tensor = |(q, x): (usize, &Tensor)| -> Tensor {
            let weight = share * factor * element.weights[q];
            if !has_memory || energy == Energy::Linear {
                return stress(material, x, energy).map(|row| row.map(|p| Along::from(weight) * p));
            }
            let by_stress = x.map(|row| row.map(|x| element.weights[q] * x.slopes[0]));
            let eta = from_fn(|i| eta.get(element.entries(q).start - element.entries(0).start + i).map_or(0.0, |x| *x));
            let f = x.map(|row| row.map(|x| x.value));
            let (p, slopes) =
                by_deformation(material, strength, &f, &state.history_of(element, q), (factor, &by_stress), &eta);
            from_fn(|a| from_fn(|b| along(weight * p[a][b], slopes[a][b])))
        };
        let tensors: Vec<Tensor> = kinematics.averaged.iter().enumerate().map(tensor).collect();
        let (by_strain, by_weight, by_mode) = kinematics.pull_back(element, modes.as_ref(), &tensors);
        for (q, g) in element.gradients.iter().enumerate() {
            for (k, out) in out.iter_mut().enumerate() {
                // T G
                let traction: [Along; 3] = from_fn(|a| sum(|b| by_strain[q][a][b] * g[k][b].into()));
                for c in 0..3 {
                    let of_gradient = sum(|a| gradients[q][a][c] * traction[a]).slopes[0];
                    out[c] += by_weight[q] * g[k][c] - by_gradient * of_gradient;
                }
            }
        }
        for (value, by_mode) in hex27_values().iter().zip(by_mode) {
            for (out, value) in out.iter_mut().zip(value) {
                (0..3).for_each(|c| out[c] += value * by_mode[c]);
            }
        }
    }
    Some(out)
}

fn sum(of: impl Fn(usize) -> Along) -> Along {
    of(0) + of(1) + of(2)
}

fn contract(x: &Tensor, y: &Tensor) -> Along {
    sum(|a| sum(|b| x[a][b] * y[a][b]))
}

/// ∂Ψ/∂F or ∂Ψ_L/∂H of a law without memory.
fn stress(material: &Material, x: &Tensor, energy: Energy) -> Tensor {
    let unit = |k: usize| from_fn(|l| if k == l { 1.0.into() } else { 0.0.into() });
    let x: [[Dual<Along, 9>; 3]; 3] = from_fn(|a| from_fn(|b| Dual { value: x[a][b], slopes: unit(3 * a + b) }));
    let energy = match energy {
        Energy::Finite { .. } => material.energy(&x),
        Energy::Linear => material.small_strain_energy(&x),
    };
    from_fn(|a| from_fn(|b| energy.slopes[3 * a + b]))
}

/// The functions onto which F̄ projects.
struct Modes {
    /// m_q.
    at: Vec<Vec<f64>>,
    /// M⁻¹.
    inverse: Vec<Vec<f64>>,
}

impl Modes {
    fn new(element: &PointElement, coordinates: &[f64]) -> Self {
        let x =
            |node: u32, c: usize| coordinates[3 * node as usize + c] - coordinates[3 * element.nodes[0] as usize + c];
        let place = |q: usize, c: usize| -> f64 {
            element.nodes.iter().zip(&hex27_values()[q]).map(|(&node, value)| value * x(node, c)).sum()
        };
        let linear = element.nodes.len() == 27;
        let of = |q: usize| if linear { vec![1.0, place(q, 0), place(q, 1), place(q, 2)] } else { vec![1.0] };
        let at: Vec<Vec<f64>> = (0..element.points()).map(of).collect();
        let n = at[0].len();
        let product = |i: usize, j: usize| at.iter().zip(&element.weights).map(|(m, w)| w * m[i] * m[j]).sum::<f64>();
        // Gauss and Jordan, of a positive definite matrix
        let mut rows: Vec<Vec<f64>> = (0..n)
            .map(|i| (0..n).map(|j| product(i, j)).chain((0..n).map(|j| f64::from(u8::from(i == j)))).collect())
            .collect();
        for i in 0..n {
            let pivot: Vec<f64> = rows[i].iter().map(|x| x / rows[i][i]).collect();
            for (j, row) in rows.iter_mut().enumerate() {
                let share = row[i];
                (0..2 * n).for_each(|k| row[k] = if i == j { pivot[k] } else { row[k] - share * pivot[k] });
            }
        }
        Self { at, inverse: rows.into_iter().map(|row| row[n..].to_vec()).collect() }
    }

    /// M⁻¹ Σ x_q m_q.
    fn coefficients(&self, x: impl Iterator<Item = Along>) -> Vec<Along> {
        let mut sums = vec![Along::from(0.0); self.inverse.len()];
        for (m, x) in self.at.iter().zip(x) {
            sums.iter_mut().zip(m).for_each(|(sum, m)| *sum = *sum + x * (*m).into());
        }
        self.inverse.iter().map(|row| product(&sums, row)).collect()
    }
}

fn product(x: &[Along], y: &[f64]) -> Along {
    x.iter().zip(y).fold(Along::from(0.0), |sum, (x, y)| sum + *x * (*y).into())
}

/// The deformation at the points of an element.
struct Kinematics {
    /// F̄ or H̄.
    averaged: Vec<Tensor>,
    /// Of F̄; `None` without.
    bar: Option<Bar>,
}

/// What replaces F by F̄, or H by H̄.
struct Bar {
    energy: Energy,
    /// t, and ∂t/∂F.
    t: Vec<Along>,
    slopes: Vec<Tensor>,
    /// Θ, and its coefficients c.
    theta: Vec<Along>,
    c: Vec<Along>,
}

impl Bar {
    /// (Θ/J)^(1/3).
    fn ratio(&self, q: usize) -> Along {
        let one = Along::from(1.0);
        (Along::from(1.0 / 3.0) * (self.theta[q] / self.t[q]).ln()).exp_m1() + one
    }
}

impl Kinematics {
    fn new(element: &PointElement, strains: &[Tensor], energy: Energy, modes: Option<&Modes>) -> Option<Self> {
        let unit = |a: usize, b: usize| Along::from(f64::from(u8::from(a == b)));
        let deformed = |h: &Tensor| -> Tensor {
            match energy {
                Energy::Linear => *h,
                Energy::Finite { gamma } => from_fn(|a| from_fn(|b| unit(a, b) + Along::from(gamma) * h[a][b])),
            }
        };
        let plain: Vec<Tensor> = strains.iter().map(deformed).collect();
        let linear = energy == Energy::Linear;
        if !linear && !plain.iter().all(|f| determinant(f).value > 0.0) {
            return None;
        }
        let Some(modes) = modes else { return Some(Self { averaged: plain, bar: None }) };
        let t = plain.iter().map(|x| if linear { sum(|a| x[a][a]) } else { determinant(x) });
        let t: Vec<Along> = t.collect();
        let slope = |(x, t): (&Tensor, &Along)| -> Tensor {
            if linear {
                return from_fn(|a| from_fn(|b| unit(a, b)));
            }
            let inverse = inverse(x);
            from_fn(|a| from_fn(|b| *t * inverse[b][a]))
        };
        let slopes = plain.iter().zip(&t).map(slope).collect();
        let c = modes.coefficients(t.iter().zip(&element.weights).map(|(t, w)| *t * (*w).into()));
        let theta: Vec<Along> = modes.at.iter().map(|m| product(&c, m)).collect();
        let bar = Bar { energy, t, slopes, theta, c };
        let averaged = |(q, x): (usize, &Tensor)| -> Tensor {
            if linear {
                let shift = Along::from(1.0 / 3.0) * (bar.theta[q] - bar.t[q]);
                return from_fn(|a| from_fn(|b| x[a][b] + unit(a, b) * shift));
            }
            let ratio = bar.ratio(q);
            x.map(|row| row.map(|x| ratio * x))
        };
        Some(Self { averaged: plain.iter().enumerate().map(averaged).collect(), bar: Some(bar) })
    }

    /// Along λ: the derivatives of Σ Z : F̄ with respect to F at the points (with their values), with respect to
    /// the logarithms of the weights, those of the energy included, and with respect to the linear modes, if there
    /// are any.
    fn pull_back(
        &self,
        element: &PointElement,
        modes: Option<&Modes>,
        tensors: &[Tensor],
    ) -> (Vec<Tensor>, Vec<f64>, Vec<[f64; 3]>) {
        let power = |(z, x): (&Tensor, &Tensor)| sum(|a| sum(|b| along(z[a][b].value * x[a][b].slopes[0], 0.0))).value;
        let mut by_weight: Vec<f64> = tensors.iter().zip(&self.averaged).map(power).collect();
        let (Some(bar), Some(modes)) = (&self.bar, modes) else { return (tensors.to_vec(), by_weight, Vec::new()) };
        let (linear, third) = (bar.energy == Energy::Linear, Along::from(1.0 / 3.0));
        // S = ⅓ Z : F̄, the derivative with respect to ln Θ, or with respect to Θ in linear elasticity
        let of = |(z, x): (&Tensor, &Tensor)| third * if linear { sum(|a| z[a][a]) } else { contract(z, x) };
        let s: Vec<Along> = tensors.iter().zip(&self.averaged).map(of).collect();
        let b: Vec<Along> = s.iter().zip(&bar.theta).map(|(s, theta)| if linear { *s } else { *s / *theta }).collect();
        let v = modes.coefficients(b.iter().copied());
        let mut by_mode = Vec::new();
        let mut out = Vec::with_capacity(tensors.len());
        for (q, z) in tensors.iter().enumerate() {
            let weight = Along::from(element.weights[q]);
            let (at, rest) = (weight * product(&v, &modes.at[q]), bar.t[q] - bar.theta[q]);
            let ratio = if linear { 1.0.into() } else { bar.ratio(q) };
            // ∂ln t/∂F = (∂t/∂F)/J
            let by_t = at - if linear { s[q] } else { s[q] / bar.t[q] };
            out.push(from_fn(|i| from_fn(|j| ratio * z[i][j] + by_t * bar.slopes[q][i][j])));
            by_weight[q] += (at * rest).slopes[0];
            if modes.inverse.len() == 4 {
                let of = |c: usize| (b[q] - at) * bar.c[c + 1] + weight * rest * v[c + 1];
                by_mode.push(from_fn(|c| of(c).slopes[0]));
            }
        }
        (out, by_weight, by_mode)
    }
}
