//! Elements of any type whose law has memory: force, tangent, new history and their transposed
//! derivatives.
//!
//! The law is evaluated in dual numbers ([`crate::law::memory`]), one point at a time. `points.rs` holds
//! what does not depend on the law.

mod build;
mod points;
mod state;

pub(crate) use build::Reference;
pub(crate) use state::ByState;
pub use state::Energies;

use crate::clusters::Clusters;
use crate::dual::Dual;
use crate::interpolation::ElementScaling;
use crate::law::memory::Inelastic as _;
use crate::law::{HISTORY, Material, with_memory};
use crate::section::Section;
pub(crate) use points::PointElement;
use points::{Deformed, Tensor};
use rayon::prelude::*;
use slipstick_linalg::BlockPattern;
use std::array::from_fn;

/// All elements with memory, or those of this rank.
#[derive(Debug, Clone, Default)]
pub(crate) struct Inelastic {
    /// In the order of `clusters`.
    pub elements: Vec<PointElement>,
    clusters: Option<Clusters>,
    /// Number of points of all elements of the mesh with memory, on all ranks.
    points: usize,
}

/// What the elements' equations depend on besides displacements.
#[derive(Clone, Copy)]
pub(crate) struct Given<'a> {
    pub sections: &'a [Section],
    pub scalings: &'a [ElementScaling],
    /// At the start of the step; empty: at rest.
    pub history: &'a [f64],
}

/// Weights of the equations of elements with memory: λ for the forces, η for the new history.
#[derive(Clone, Copy)]
pub(crate) struct Weights<'a> {
    pub forces: Option<&'a [f64]>,
    pub history: Option<&'a [f64]>,
}

/// Transposed derivatives, all of them added.
pub(crate) struct PullBack<'a> {
    /// With respect to displacements: that of the new history only. The derivative of the forces is the
    /// tangent.
    pub displacements: Option<&'a mut [f64]>,
    /// With respect to the previous history.
    pub history: Option<&'a mut [f64]>,
    /// With respect to the densities, through slopes of the scalings.
    pub density: Option<(&'a [ElementScaling], &'a mut [f64])>,
}

/// Directions of the derivatives: F̄, the previous history, the strength.
const DIRECTIONS: usize = 9 + HISTORY + 1;

impl<'a> Given<'a> {
    fn of(&self, element: &PointElement) -> (&'a Material, ElementScaling) {
        (&self.sections[element.section as usize].material, self.scalings[element.number as usize])
    }

    fn history(&self, element: &PointElement, q: usize) -> [f64; HISTORY] {
        self.history.get(element.entries(q)).map_or([0.0; HISTORY], |of| from_fn(|i| of[i]))
    }
}

/// The derivatives of s Λ : P + η · h′ at one point, with the factor s of the stiffness.
struct Slopes {
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
        by_f: from_fn(|a| from_fn(|b| sum[3 * a + b])),
        by_history: from_fn(|i| sum[9 + i]),
        by_strength: sum[9 + HISTORY],
        by_factor,
    }
}

impl Inelastic {
    /// Length of the history.
    pub fn history(&self) -> usize {
        HISTORY * self.points
    }

    /// Adds a force on the nodes of each element to `nodes`; returns the elements without one.
    fn add(&self, nodes: &mut [[f64; 3]], of: impl Fn(&PointElement) -> Option<Vec<[f64; 3]>> + Sync) -> Vec<u32> {
        let Some(clusters) = &self.clusters else { return Vec::new() };
        clusters.assemble(nodes, |cluster, target, rejected| {
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

    /// Adds internal forces; returns the inverted elements.
    pub fn add_forces(&self, given: Given<'_>, d: &[f64], nodes: &mut [[f64; 3]]) -> Vec<u32> {
        self.add(nodes, |element| {
            let at = element.deformed(d)?;
            Some(element.forces(&at, &stresses(element, &at, given)))
        })
    }

    /// Adds products of the tangent with a direction; returns the inverted elements.
    pub fn add_products(&self, given: Given<'_>, d: &[f64], v: &[f64], nodes: &mut [[f64; 3]]) -> Vec<u32> {
        self.add(nodes, |element| {
            let along: Vec<f64> =
                element.nodes.iter().flat_map(|&n| from_fn::<f64, 3, _>(|c| v[3 * n as usize + c])).collect();
            if along.iter().all(|&v| v == 0.0) {
                return Some(Vec::new());
            }
            let tangent = tangent(element, given, d)?;
            let products: Vec<f64> =
                tangent.chunks_exact(along.len()).map(|row| row.iter().zip(&along).map(|(k, v)| k * v).sum()).collect();
            Some(products.as_chunks::<3>().0.to_vec())
        })
    }

    /// Positions of the blocks of each element in a pattern.
    pub fn positions(&self, pattern: &BlockPattern) -> Vec<Vec<u32>> {
        let of = |element: &PointElement| {
            let place = |i: u32, k: u32| pattern.find(i as usize, k as usize).expect("pattern holds all element pairs");
            let nodes = &element.nodes;
            nodes.iter().flat_map(|&i| nodes.iter().map(move |&k| place(i, k) as u32)).collect()
        };
        self.elements.par_iter().map(of).collect()
    }

    /// Adds tangents; returns the inverted elements.
    pub fn add_tangents(
        &self,
        given: Given<'_>,
        d: &[f64],
        positions: &[Vec<u32>],
        values: &mut [[f64; 9]],
    ) -> Vec<u32> {
        let Some(clusters) = &self.clusters else { return Vec::new() };
        clusters.assemble(values, |cluster, target, rejected| {
            for (element, positions) in self.elements[cluster.clone()].iter().zip(&positions[cluster]) {
                let Some(tangent) = tangent(element, given, d) else {
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

    /// Writes the history at the end of the step; entries of other ranks remain. Returns the inverted
    /// elements.
    pub fn update(&self, given: Given<'_>, d: &[f64], out: &mut [f64]) -> Vec<u32> {
        let of = |element: &PointElement| {
            let at = element.deformed(d)?;
            let (material, scaling) = given.of(element);
            let of = |(q, f): (usize, &Tensor)| {
                with_memory!(material, law => law.update(f, &given.history(element, q), scaling.strength)).1
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

    /// Adds the transposed derivatives of λ · f + η · h′; returns the inverted elements.
    pub fn pull_back(&self, given: Given<'_>, d: &[f64], weights: Weights<'_>, into: PullBack<'_>) -> Vec<u32> {
        let slope_of = into.density.as_ref().map(|(slopes, _)| *slopes);
        let of = |element: &PointElement| {
            let at = element.deformed(d)?;
            let (material, scaling) = given.of(element);
            let changes = weights.forces.map(|lambda| element.change(&at, lambda));
            let mut tensors = Vec::with_capacity(element.points());
            let mut by_history = Vec::with_capacity(element.points());
            let mut by_density = 0.0;
            for (q, f) in at.bar.iter().enumerate() {
                let weight = element.weights[q];
                let by_stress =
                    changes.as_ref().map_or([[0.0; 3]; 3], |changes| changes[q].map(|row| row.map(|x| weight * x)));
                let by_stress = (scaling.factor, &by_stress);
                let eta: [f64; HISTORY] = weights.history.map_or([0.0; HISTORY], |eta| {
                    let eta = &eta[element.entries(q)];
                    from_fn(|i| eta[i])
                });
                let slopes = slopes(material, scaling.strength, f, &given.history(element, q), by_stress, &eta);
                tensors.push(slopes.by_f);
                by_history.push(slopes.by_history);
                if let Some(slope) = slope_of.map(|of| of[element.number as usize]) {
                    by_density += slope.factor * slopes.by_factor + slope.strength * slopes.by_strength;
                }
            }
            // the derivative of the force with respect to displacements is the tangent's
            let forces = weights.forces.is_none().then(|| element.forces(&at, &tensors));
            Some((forces, by_history, by_density))
        };
        let found: Vec<_> = self.elements.par_iter().map(of).collect();
        let mut rejected = Vec::new();
        let PullBack { mut displacements, mut history, mut density } = into;
        for (element, found) in self.elements.iter().zip(found) {
            let Some((forces, by_history, by_density)) = found else {
                rejected.push(element.number);
                continue;
            };
            if let (Some(out), Some(forces)) = (&mut displacements, &forces) {
                for (&node, force) in element.nodes.iter().zip(forces) {
                    (0..3).for_each(|c| out[3 * node as usize + c] += force[c]);
                }
            }
            if let Some(out) = &mut history {
                for (q, values) in by_history.iter().enumerate() {
                    out[element.entries(q)].iter_mut().zip(values).for_each(|(to, from)| *to += from);
                }
            }
            if let Some((_, out)) = &mut density {
                out[element.number as usize] += by_density;
            }
        }
        rejected
    }
}

/// Weight times P at every point, scaled by the density.
fn stresses(element: &PointElement, at: &Deformed, given: Given<'_>) -> Vec<Tensor> {
    let (material, scaling) = given.of(element);
    let of = |(q, f): (usize, &Tensor)| {
        let p = with_memory!(material, law => law.update(f, &given.history(element, q), scaling.strength)).0;
        p.map(|row| row.map(|x| scaling.factor * element.weights[q] * x))
    };
    at.bar.iter().enumerate().map(of).collect()
}

/// The tangent of an element; `None` if it is inverted.
fn tangent(element: &PointElement, given: Given<'_>, d: &[f64]) -> Option<Vec<f64>> {
    let at = element.deformed(d)?;
    let (material, scaling) = given.of(element);
    let (mut tensors, mut moduli) = (Vec::new(), Vec::new());
    for (q, f) in at.bar.iter().enumerate() {
        let unit = |k: usize| from_fn(|l| f64::from(k == l));
        let f: [[Dual<f64, 9>; 3]; 3] = from_fn(|a| from_fn(|b| Dual { value: f[a][b], slopes: unit(3 * a + b) }));
        let previous = given.history(element, q).map(Dual::from);
        let p = with_memory!(material, law => law.update(&f, &previous, scaling.strength.into())).0;
        let weight = scaling.factor * element.weights[q];
        tensors.push(p.map(|row| row.map(|x| weight * x.value)));
        moduli.push(from_fn(|row| p[row / 3][row % 3].slopes.map(|slope| weight * slope)));
    }
    let out = element.tangent(&at, &tensors, &moduli);
    out.iter().all(|k| k.is_finite()).then_some(out)
}
