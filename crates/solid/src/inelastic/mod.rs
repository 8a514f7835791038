//! Elements of any type whose law has memory: force, tangent, new history and their transposed
//! derivatives.
//!
//! The law is evaluated in dual numbers ([`crate::law::memory`]), one point at a time. `points.rs` holds
//! what does not depend on the law.

mod build;
mod interpolated;
mod points;
mod state;

pub(crate) use build::{Reference, block, history};
pub(crate) use state::ByState;
pub use state::Energies;

use crate::assembly::find_pairs;
use crate::block::{ElementBlock, PullBack, State, StressSlopes, VisitStresses, Weights, visit, write};
use crate::clusters::Clusters;
use crate::dual::Dual;
use crate::heat::Power;
use crate::interpolation::ElementScaling;
use crate::law::memory::Inelastic as _;
use crate::law::{HISTORY, Material, with_memory};
use crate::section::Section;
use crate::stress;
use interpolated::{Linear, contract};
pub(crate) use points::PointElement;
use points::{Deformed, Tensor};
use rayon::prelude::*;
use slipstick_linalg::BlockPattern;
use std::array::from_fn;
use std::borrow::Cow;
use std::sync::Arc;

/// All elements with memory, or those of this rank.
#[derive(Debug)]
pub(crate) struct Inelastic {
    /// In the order of `clusters`.
    pub elements: Vec<PointElement>,
    clusters: Clusters,
    /// Number of the first position of each element, and of all.
    pairs: Vec<usize>,
}

/// Directions of the derivatives: F̄, the previous history, the strength.
const DIRECTIONS: usize = 9 + HISTORY + 1;

impl<'a> State<'a> {
    fn law(&self, element: &PointElement, power: Power) -> (&'a Material, ElementScaling) {
        let section = element.section as usize;
        (&self.sections[section].material, self.scaling(element.number(), section, power))
    }

    /// A slope of a scaling, for an integral over an element.
    fn slope(&self, slope: ElementScaling, element: &PointElement, power: Power) -> ElementScaling {
        self.scaled(slope, element.number(), element.section as usize, power)
    }

    /// F̄ without thermal expansion, at the fraction γ of the displacements; `None` if J ≤ 0 at a point.
    fn deformed(&self, element: &PointElement) -> Option<Deformed> {
        element.deformed(self.d, self.stretch(element.number()), self.gamma(element))
    }

    fn gamma(&self, element: &PointElement) -> f64 {
        self.scalings[element.number()].gamma
    }

    /// The history of point q at the start of the step.
    pub fn history_of(&self, element: &PointElement, q: usize) -> [f64; HISTORY] {
        self.history.get(element.entries(q)).map_or([0.0; HISTORY], |of| from_fn(|i| of[i]))
    }
}

/// The derivatives of s Λ : P + η · h′ at one point, with the factor s of the stiffness.
struct Slopes {
    /// P.
    stress: Tensor,
    by_f: Tensor,
    by_history: [f64; HISTORY],
    by_strength: f64,
    /// The derivative with respect to s, Λ : P.
    by_factor: f64,
}

fn slopes(
    material: &Material,
    strength: f64,
    f: &Tensor,
    previous: &[f64; HISTORY],
    (factor, by_stress): (f64, &Tensor),
    eta: &[f64; HISTORY],
) -> Slopes {
    let unit = |value: f64, k: usize| Dual::<f64, DIRECTIONS> { value, slopes: from_fn(|l| f64::from(k == l)) };
    let f = from_fn(|a| from_fn(|b| unit(f[a][b], 3 * a + b)));
    let previous = from_fn(|i| unit(previous[i], 9 + i));
    let strength = unit(strength, 9 + HISTORY);
    let (p, h) = with_memory!(material, law => law.update(&f, &previous, strength));
    let mut sum = [0.0; DIRECTIONS];
    let mut add = |x: &Dual<f64, DIRECTIONS>, weight: f64| {
        if weight != 0.0 {
            sum.iter_mut().zip(&x.slopes).for_each(|(sum, slope)| *sum += weight * slope);
        }
    };
    let mut by_factor = 0.0;
    for (p, weight) in p.as_flattened().iter().zip(by_stress.as_flattened()) {
        by_factor += weight * p.value;
        add(p, factor * weight);
    }
    h.iter().zip(eta).for_each(|(h, weight)| add(h, *weight));
    Slopes {
        stress: p.map(|row| row.map(|p| p.value)),
        by_f: from_fn(|a| from_fn(|b| sum[3 * a + b])),
        by_history: from_fn(|i| sum[9 + i]),
        by_strength: sum[9 + HISTORY],
        by_factor,
    }
}

/// P at a point, and the derivative of s Λ : P + η · h′ with respect to F̄.
pub(crate) fn by_deformation(
    material: &Material,
    strength: f64,
    f: &Tensor,
    previous: &[f64; HISTORY],
    by_stress: (f64, &Tensor),
    eta: &[f64; HISTORY],
) -> (Tensor, Tensor) {
    let slopes = slopes(material, strength, f, previous, by_stress, eta);
    (slopes.stress, slopes.by_f)
}

impl Inelastic {
    /// Adds a force on the nodes of each element to `nodes`; returns the elements without one.
    fn add(&self, nodes: &mut [[f64; 3]], of: impl Fn(&PointElement) -> Option<Vec<[f64; 3]>> + Sync) -> Vec<u32> {
        self.clusters.assemble(nodes, |cluster, target, rejected| {
            for element in &self.elements[cluster] {
                let forces = of(element).filter(|forces| forces.as_flattened().iter().all(|f| f.is_finite()));
                let Some(forces) = forces else {
                    rejected.push(element.number);
                    continue;
                };
                for (&node, force) in element.nodes.iter().zip(forces) {
                    // SAFETY: a node of the element.
                    let to = unsafe { target.at(node as usize) };
                    (0..3).for_each(|c| to[c] += force[c]);
                }
            }
        })
    }

    /// Writes the history at the end of the step; entries of other ranks remain. Returns the inverted
    /// elements.
    pub fn update(&self, state: State<'_>, out: &mut [f64]) -> Vec<u32> {
        let of = |element: &PointElement| {
            let at = state.deformed(element)?;
            let (material, scaling) = state.law(element, Power::Force);
            let of = |(q, f): (usize, &Tensor)| {
                with_memory!(material, law => law.update(f, &state.history_of(element, q), scaling.strength)).1
            };
            Some(at.bar.iter().enumerate().map(of).collect::<Vec<_>>())
        };
        let found: Vec<_> = self.elements.par_iter().map(of).collect();
        let mut rejected = Vec::new();
        for (element, found) in self.elements.iter().zip(found) {
            let finite = |points: &Vec<[f64; HISTORY]>| points.as_flattened().iter().all(|x| x.is_finite());
            let Some(points) = found.filter(finite) else {
                rejected.push(element.number);
                continue;
            };
            for (q, values) in points.iter().enumerate() {
                out[element.entries(q)].copy_from_slice(values);
            }
        }
        rejected
    }
}

impl ElementBlock for Inelastic {
    fn positions(&self, pattern: &BlockPattern) -> Vec<u32> {
        let mut out = vec![0; self.pairs.last().copied().unwrap_or(0)];
        for (element, pairs) in self.elements.iter().zip(self.pairs.windows(2)) {
            find_pairs(pattern, &element.nodes, &mut out[pairs[0]..pairs[1]]);
        }
        out
    }

    fn add_forces(&self, state: State<'_>, direction: Option<&[f64]>, nodes: &mut [[f64; 3]]) -> Vec<u32> {
        self.add(nodes, |element| match direction {
            None => forces(element, state),
            Some(v) => {
                let along = element.gather(v).into_flattened();
                if along.iter().all(|&v| v == 0.0) {
                    return Some(Vec::new());
                }
                let tangent = tangent(element, state)?;
                let rows = tangent.chunks_exact(along.len());
                let products: Vec<f64> = rows.map(|row| row.iter().zip(&along).map(|(k, v)| k * v).sum()).collect();
                Some(products.as_chunks::<3>().0.to_vec())
            }
        })
    }

    fn add_tangents(&self, state: State<'_>, positions: &[u32], values: &mut [[f64; 9]]) -> Vec<u32> {
        assert_eq!(positions.len(), self.pairs[self.elements.len()], "the scatter belongs to a different model");
        self.clusters.assemble(values, |cluster, target, rejected| {
            for e in cluster {
                let (element, positions) = (&self.elements[e], &positions[self.pairs[e]..self.pairs[e + 1]]);
                let Some(tangent) = tangent(element, state) else {
                    rejected.push(element.number);
                    continue;
                };
                let n = element.nodes.len();
                for (pair, &position) in positions.iter().enumerate() {
                    // SAFETY: the positions are those of pairs of the element's nodes.
                    let to = unsafe { target.at(position as usize) };
                    let (i, k) = (pair / n, pair % n);
                    for (a, row) in to.as_chunks_mut::<3>().0.iter_mut().enumerate() {
                        let from = &tangent[(3 * i + a) * 3 * n + 3 * k..][..3];
                        row.iter_mut().zip(from).for_each(|(to, from)| *to += from);
                    }
                }
            }
        })
    }

    fn pull_back(&self, state: State<'_>, weights: Weights<'_>, into: &mut PullBack<'_>) -> Vec<u32> {
        let slope_of = into.density.as_ref().map(|(slopes, _)| *slopes);
        let of = |element: &PointElement| {
            let at = state.deformed(element)?;
            let (material, scaling) = state.law(element, Power::Force);
            let gamma = scaling.gamma;
            let lambda = weights.forces.map(|lambda| element.gather(lambda));
            let changes = lambda.as_ref().map(|lambda| element.change(&at, lambda));
            let mut tensors = Vec::with_capacity(element.points());
            let mut by_history = Vec::with_capacity(element.points());
            let mut stresses = Vec::with_capacity(element.points());
            let mut by_density = 0.0;
            for (q, f) in at.bar.iter().enumerate() {
                let weight = element.weights[q] * gamma;
                let by_stress =
                    changes.as_ref().map_or([[0.0; 3]; 3], |changes| changes[q].map(|row| row.map(|x| weight * x)));
                let by_stress = (scaling.factor, &by_stress);
                let eta: [f64; HISTORY] = weights.history.map_or([0.0; HISTORY], |eta| {
                    let eta = &eta[element.entries(q)];
                    from_fn(|i| eta[i])
                });
                let slopes = slopes(material, scaling.strength, f, &state.history_of(element, q), by_stress, &eta);
                tensors.push(slopes.by_f);
                stresses.push(slopes.stress.map(|row| row.map(|x| element.weights[q] * x)));
                by_history.push(slopes.by_history);
                if let Some(slope) = slope_of.map(|of| of[element.number as usize]) {
                    let slope = state.slope(slope, element, Power::Force);
                    by_density += slope.factor * slopes.by_factor + slope.strength * slopes.by_strength;
                }
            }
            let slope = slope_of.map(|of| state.slope(of[element.number as usize], element, Power::Force));
            if let Some(slope) = slope.filter(|slope| gamma != 1.0 || slope.gamma != 0.0) {
                // what the energy's interpolation adds
                let v = element.unexpanded(state);
                let mut by_gamma = element.along(&at, &tensors, &v);
                if let (Some(lambda), Some(changes)) = (&lambda, &changes) {
                    let linear = Linear::of(element, state)?.product(lambda);
                    by_density += slope.factor * (1.0 - gamma * gamma) * linear;
                    let force: f64 = stresses.iter().zip(changes).map(|(p, change)| contract(p, change)).sum();
                    let curvature = element.curvature(&at, &stresses, lambda, &v);
                    by_gamma += scaling.factor * (force + gamma * (curvature - 2.0 * linear));
                }
                by_density += slope.gamma * by_gamma;
            }
            // the derivative of the force with respect to displacements is the tangent's
            let forces = weights.forces.is_none().then(|| element.forces(&at, &tensors));
            Some((forces, by_history, by_density))
        };
        let found: Vec<_> = self.elements.par_iter().map(of).collect();
        let mut rejected = Vec::new();
        let PullBack { displacements, history, density } = into;
        for (element, found) in self.elements.iter().zip(found) {
            let Some((forces, by_history, by_density)) = found else {
                rejected.push(element.number);
                continue;
            };
            if let (Some(out), Some(forces)) = (&mut *displacements, &forces) {
                let factor = state.gamma(element) * state.by_displacement(element.number(), element.section as usize);
                for (&node, force) in element.nodes.iter().zip(forces) {
                    (0..3).for_each(|c| out[3 * node as usize + c] += factor * force[c]);
                }
            }
            if let Some(out) = history {
                for (q, values) in by_history.iter().enumerate() {
                    out[element.entries(q)].iter_mut().zip(values).for_each(|(to, from)| *to += from);
                }
            }
            if let Some((_, out)) = density {
                out[element.number as usize] += by_density;
            }
        }
        rejected
    }

    fn write_volumes(&self, out: &mut [f64]) {
        self.elements.iter().for_each(|e| out[e.number as usize] = e.weights.iter().sum());
    }

    fn write_energies(&self, state: State<'_>, out: &mut [Energies]) {
        write(&self.elements, |element| element.energies(state), PointElement::number, out);
    }

    fn write_determinants(&self, d: &[f64], out: &mut [f64]) {
        write(&self.elements, |element| element.smallest_determinant(d), PointElement::number, out);
    }

    fn visit_stresses(&self, state: State<'_>, to: &mut VisitStresses<'_>) {
        visit(&self.elements, |element| element.stresses(state), |element, stresses| to(element.number(), &stresses));
    }

    fn pull_back_stresses(&self, state: State<'_>, weights: &stress::Weights<'_>, into: &mut StressSlopes<'_>) {
        for element in &self.elements {
            if let Some(own) = weights.of(element.number()) {
                element.pull_back_stresses(state, own, into);
            }
        }
    }

    fn memory(&self) -> Option<&Inelastic> {
        Some(self)
    }

    fn at_positions(&self, x: &[[f64; 3]], sections: &[Section]) -> Result<Arc<dyn ElementBlock>, Vec<u32>> {
        Ok(Arc::new(build::at_positions(self, x, sections)?))
    }

    fn places(&self) -> usize {
        self.elements.len()
    }

    fn points(&self, place: usize) -> Option<Cow<'_, PointElement>> {
        Some(Cow::Borrowed(&self.elements[place]))
    }
}

/// Weight times P at every point, scaled by the density.
fn stresses(element: &PointElement, at: &Deformed, state: State<'_>) -> Vec<Tensor> {
    let (material, scaling) = state.law(element, Power::Force);
    let of = |(q, f): (usize, &Tensor)| {
        let p = with_memory!(material, law => law.update(f, &state.history_of(element, q), scaling.strength)).0;
        p.map(|row| row.map(|x| scaling.factor * element.weights[q] * x))
    };
    at.bar.iter().enumerate().map(of).collect()
}

/// The internal forces of an element; `None` if it is inverted.
fn forces(element: &PointElement, state: State<'_>) -> Option<Vec<[f64; 3]>> {
    let at = state.deformed(element)?;
    let mut out = element.forces(&at, &stresses(element, &at, state));
    let ElementScaling { factor, gamma, .. } = state.law(element, Power::Force).1;
    if gamma != 1.0 {
        let linear = Linear::of(element, state)?.forces(factor * (1.0 - gamma * gamma));
        let both = out.as_flattened_mut().iter_mut().zip(linear.as_flattened());
        both.for_each(|(force, linear)| *force = gamma * *force + linear);
    }
    Some(out)
}

/// The tangent of an element; `None` if it is inverted.
fn tangent(element: &PointElement, state: State<'_>) -> Option<Vec<f64>> {
    let at = state.deformed(element)?;
    let (material, scaling) = state.law(element, Power::Tangent);
    let (mut tensors, mut moduli) = (Vec::new(), Vec::new());
    for (q, f) in at.bar.iter().enumerate() {
        let unit = |k: usize| from_fn(|l| f64::from(k == l));
        let f: [[Dual<f64, 9>; 3]; 3] = from_fn(|a| from_fn(|b| Dual { value: f[a][b], slopes: unit(3 * a + b) }));
        let previous = state.history_of(element, q).map(Dual::from);
        let p = with_memory!(material, law => law.update(&f, &previous, scaling.strength.into())).0;
        let weight = scaling.factor * element.weights[q];
        tensors.push(p.map(|row| row.map(|x| weight * x.value)));
        moduli.push(from_fn(|row| p[row / 3][row % 3].slopes.map(|slope| weight * slope)));
    }
    let mut out = element.tangent(&at, &tensors, &moduli);
    let gamma = scaling.gamma;
    if gamma != 1.0 {
        let linear = Linear::of(element, state)?.tangent(scaling.factor * (1.0 - gamma * gamma));
        out.iter_mut().zip(linear).for_each(|(k, linear)| *k = gamma * gamma * *k + linear);
    }
    out.iter().all(|k| k.is_finite()).then_some(out)
}
