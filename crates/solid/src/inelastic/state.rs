//! What follows from a state and the history at this state: energies, stresses, plastic strains.

use super::Inelastic;
use super::interpolated::Linear;
use super::points::{PointElement, Tensor};
use crate::block::{State, StressSlopes};
use crate::dual::Dual;
use crate::heat::Power;
use crate::interpolation::ElementScaling;
use crate::law::memory::Inelastic as _;
use crate::law::{HISTORY, determinant, with_memory};
use crate::stress::STRESS_POINTS;
use std::array::from_fn;

/// Energies of an element. \[F L\]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energies {
    /// Elastic energy.
    pub elastic: f64,
    /// Work done on the history since rest, for plasticity the plastic work.
    pub plastic: f64,
}

impl Energies {
    /// Those of an element without memory; NaN if it is inverted.
    pub(crate) fn elastic(energy: Option<f64>) -> Self {
        Self { elastic: energy.unwrap_or(f64::NAN), plastic: 0.0 }
    }
}

/// Derivatives of a function of states with history.
pub(crate) struct ByState<'a> {
    pub displacements: &'a mut [f64],
    pub history: &'a mut [f64],
    /// Slopes of the scalings, and the derivatives with respect to densities.
    pub density: (&'a [ElementScaling], &'a mut [f64]),
}

/// F̄ and the history, in dual numbers.
const DIRECTIONS: usize = 9 + HISTORY;
type Varied = Dual<f64, DIRECTIONS>;

fn varied(f: &Tensor, history: &[f64; HISTORY]) -> ([[Varied; 3]; 3], [Varied; HISTORY]) {
    let unit = |value: f64, k: usize| Dual { value, slopes: from_fn(|l| f64::from(k == l)) };
    (from_fn(|a| from_fn(|b| unit(f[a][b], 3 * a + b))), from_fn(|i| unit(history[i], 9 + i)))
}

/// The points of an element that lists of stresses contain: of wedge18 and hex27, the outermost.
fn listed(element: &PointElement) -> Vec<usize> {
    match element.points() {
        9 => vec![0, 1, 2, 6, 7, 8],
        27 => vec![0, 2, 8, 6, 18, 20, 26, 24],
        points => (0..points).collect(),
    }
}

impl Inelastic {
    /// Equivalent plastic strain at the points of each element that its stresses belong to.
    pub fn write_plastic_strains(&self, history: &[f64], out: &mut [[f64; STRESS_POINTS]]) {
        for element in &self.elements {
            for (out, q) in out[element.number as usize].iter_mut().zip(listed(element)) {
                *out = history.get(element.entries(q)).map_or(0.0, |of| of[HISTORY - 1]);
            }
        }
    }

    /// Adds the derivatives of Σ w α with respect to the history.
    pub fn pull_back_plastic_strains(&self, weights: &[f64], history: &mut [f64]) {
        for element in &self.elements {
            let weights = &weights[STRESS_POINTS * element.number as usize..][..STRESS_POINTS];
            for (weight, q) in weights.iter().zip(listed(element)) {
                history[element.entries(q)][HISTORY - 1] += weight;
            }
        }
    }

    /// Adds the derivatives of Σ_e (w_e elastic energy + v_e plastic work) with respect to displacements
    /// and history, and with respect to the densities, given slopes of the scalings.
    pub fn pull_back_energies(&self, state: State<'_>, [elastic, plastic]: [&[f64]; 2], into: &mut ByState<'_>) {
        let (slopes, by_density) = &mut into.density;
        for element in &self.elements {
            let e = element.number();
            let weights = [elastic, plastic].map(|of| of.get(e).copied().unwrap_or(0.0));
            if weights == [0.0; 2] {
                continue;
            }
            let Some(at) = state.deformed(element) else { continue };
            let (material, scaling) = state.law(element, Power::Energy);
            let slope = state.slope(slopes[e], element, Power::Energy);
            let mut tensors = Vec::with_capacity(element.points());
            for (q, f) in at.bar.iter().enumerate() {
                let (f, history) = varied(f, &state.history_of(element, q));
                let energies = with_memory!(material, law => law.energies(&f, &history, scaling.strength.into()));
                let weight = element.weights[q];
                let both = Varied::from(weights[0]) * energies[0] + Varied::from(weights[1]) * energies[1];
                tensors.push(from_fn(|a| from_fn(|b| scaling.factor * weight * both.slopes[3 * a + b])));
                let out = &mut into.history[element.entries(q)];
                out.iter_mut().enumerate().for_each(|(i, out)| *out += scaling.factor * weight * both.slopes[9 + i]);
                by_density[e] += weight * slope.factor * both.value;
                if slope.strength != 0.0 {
                    // the plastic work is proportional to the strength
                    let plastic = weights[1] * energies[1].value / scaling.strength;
                    by_density[e] += weight * scaling.factor * slope.strength * plastic;
                }
            }
            let (factor, gamma) = (state.by_displacement(e, element.section as usize), scaling.gamma);
            add(element, factor * gamma, &element.forces(&at, &tensors), into.displacements);
            if gamma == 1.0 && slope.gamma == 0.0 {
                continue;
            }
            let Some(linear) = Linear::of(element, state) else { continue };
            let (share, of_linear) = (weights[0] * (1.0 - gamma * gamma), weights[0] * linear.energy());
            add(element, factor, &linear.forces(scaling.factor * share), into.displacements);
            let by_gamma = element.along(&at, &tensors, &element.unexpanded(state));
            by_density[e] += slope.factor * (1.0 - gamma * gamma) * of_linear;
            by_density[e] += slope.gamma * (by_gamma - 2.0 * gamma * scaling.factor * of_linear);
        }
    }
}

impl PointElement {
    /// NaN if the element is inverted.
    pub fn energies(&self, state: State<'_>) -> Energies {
        let Some(at) = state.deformed(self) else { return Energies { elastic: f64::NAN, plastic: f64::NAN } };
        let (material, scaling) = state.law(self, Power::Energy);
        let mut sum = Energies::default();
        for (q, f) in at.bar.iter().enumerate() {
            let history = state.history_of(self, q);
            let [elastic, plastic] = with_memory!(material, law => law.energies(f, &history, scaling.strength));
            let weight = scaling.factor * self.weights[q];
            sum.elastic += weight * elastic;
            sum.plastic += weight * plastic;
        }
        let ElementScaling { factor, gamma, .. } = scaling;
        if gamma != 1.0 {
            let linear = Linear::of(self, state).map_or(f64::NAN, |linear| linear.energy());
            sum.elastic += factor * (1.0 - gamma * gamma) * linear;
        }
        sum
    }

    /// Cauchy stresses of the solid material at the listed points; NaN if the element is inverted.
    pub fn stresses(&self, state: State<'_>) -> [Tensor; STRESS_POINTS] {
        let mut out = [[[f64::NAN; 3]; 3]; STRESS_POINTS];
        let Some(at) = state.deformed(self) else { return out };
        out = [[[0.0; 3]; 3]; STRESS_POINTS];
        let (material, _) = state.law(self, Power::Energy);
        for (out, q) in out.iter_mut().zip(listed(self)) {
            let (f, history) = (&at.bar[q], state.history_of(self, q));
            let j = determinant(f);
            *out = with_memory!(material, law => law.kirchhoff(f, &history)).map(|row| row.map(|x| x / j));
        }
        out
    }

    /// Adds the derivatives of Σ w σ_v over the listed points.
    pub fn pull_back_stresses(&self, state: State<'_>, weights: &[f64], into: &mut StressSlopes<'_>) {
        let Some(at) = state.deformed(self) else { return };
        let (material, _) = state.law(self, Power::Energy);
        let mut tensors = vec![[[0.0; 3]; 3]; self.points()];
        for (weight, q) in weights.iter().zip(listed(self)).filter(|(weight, _)| **weight != 0.0) {
            let (f, history) = varied(&at.bar[q], &state.history_of(self, q));
            let j = determinant(&f);
            let tau = with_memory!(material, law => law.kirchhoff(&f, &history));
            let mean = Dual::from(1.0 / 3.0) * (tau[0][0] + tau[1][1] + tau[2][2]);
            let entry = |n: usize| if n.is_multiple_of(4) { tau[n / 3][n % 3] - mean } else { tau[n / 3][n % 3] };
            let square = (0..9).fold(Varied::from(0.0), |sum, n| sum + entry(n) * entry(n));
            let size = (1.5 * square.value).sqrt();
            if size == 0.0 {
                continue;
            }
            // d√(3/2 x)/J
            let slope =
                |k: usize| 0.75 * square.slopes[k] / (size * j.value) - size * j.slopes[k] / (j.value * j.value);
            tensors[q] = from_fn(|a| from_fn(|b| weight * slope(3 * a + b)));
            let out = &mut into.history[self.entries(q)];
            out.iter_mut().enumerate().for_each(|(i, out)| *out += weight * slope(9 + i));
        }
        let factor = state.gamma(self) * state.by_displacement(self.number(), self.section as usize);
        let varies = into.density.0[self.number()].gamma != 0.0;
        let by_gamma = if varies { self.along(&at, &tensors, &self.unexpanded(state)) } else { 0.0 };
        into.add(self.number(), &self.nodes, (factor, &self.forces(&at, &tensors)), by_gamma);
    }

    /// Smallest J over the points, without F̄; −∞ if it is not a number.
    pub fn smallest_determinant(&self, d: &[f64]) -> f64 {
        let smallest = |least: f64, j: f64| if j.is_nan() { f64::NEG_INFINITY } else { least.min(j) };
        self.determinants(d).fold(f64::INFINITY, smallest)
    }
}

fn add(element: &PointElement, factor: f64, forces: &[[f64; 3]], out: &mut [f64]) {
    for (&node, force) in element.nodes.iter().zip(forces) {
        (0..3).for_each(|c| out[3 * node as usize + c] += factor * force[c]);
    }
}
