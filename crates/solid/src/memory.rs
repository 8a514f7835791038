//! Elements with memory in a model: their history, and the transposed derivatives through it.

use crate::block::{PullBack, Weights};
use crate::evaluations::Evaluation;
use crate::inelastic::{ByState, Inelastic, PointElement};
use crate::interpolation::ElementScaling;
use crate::model::{InvertedElements, SolidModel, SolidStep, refuse};
use crate::stress::STRESS_POINTS;
use std::collections::BTreeSet;

/// Adjoint variables of the bodies' equations in a step: λ of the forces, η of the history.
#[derive(Debug, Clone, Copy)]
pub struct SolidAdjoint<'a> {
    /// λ, three entries per node.
    pub forces: &'a [f64],
    /// η, [`SolidModel::history`] entries.
    pub history: &'a [f64],
}

/// Weights of the energies of elements: one per element, or empty.
#[derive(Debug, Clone, Copy)]
pub struct EnergyWeights<'a> {
    /// Of the elastic energies.
    pub elastic: &'a [f64],
    /// Of the plastic work.
    pub plastic: &'a [f64],
}

impl SolidModel {
    /// The elements with memory.
    fn memory(&self) -> impl Iterator<Item = &Inelastic> {
        self.blocks.iter().filter_map(|block| block.memory())
    }

    /// Memory that the reference geometry of the elements with memory takes. \[bytes\]
    pub fn reference_bytes(&self) -> f64 {
        let of = |element: &PointElement| {
            let (points, nodes) = (element.points() as f64, element.nodes.len() as f64);
            let averages = if element.average.is_some() { points * points } else { 0.0 };
            8.0 * (3.0 * points * nodes + averages)
        };
        self.memory().flat_map(|block| &block.elements).map(of).sum()
    }

    /// The history at the end of a step. Entries of other ranks remain.
    ///
    /// # Errors
    /// [`InvertedElements`].
    pub fn update_history(&self, d: &[f64], step: SolidStep<'_>, out: &mut [f64]) -> Result<(), InvertedElements> {
        self.counter.count(Evaluation::History);
        let state = self.state(d, step);
        refuse(self.memory().flat_map(|block| block.update(state, out)).collect())
    }

    /// Adds (∂h′/∂d)ᵀ η.
    ///
    /// # Errors
    /// [`InvertedElements`].
    pub fn pull_back_current(
        &self,
        d: &[f64],
        step: SolidStep<'_>,
        eta: &[f64],
        out: &mut [f64],
    ) -> Result<(), InvertedElements> {
        let weights = Weights { forces: None, history: Some(eta) };
        let mut into = PullBack { displacements: Some(out), ..PullBack::default() };
        self.pull_back(self.state(d, step), weights, &mut into)
    }

    /// A list like the history, with the entries of each element times its weight.
    pub fn weighted_history(&self, history: &[f64], weights: &[f64]) -> Vec<f64> {
        let mut out = history.to_vec();
        for element in self.memory().flat_map(|block| &block.elements) {
            let entries = (0..element.points()).flat_map(|q| element.entries(q));
            entries.for_each(|entry| out[entry] *= weights[element.number()]);
        }
        out
    }

    /// Adds (∂f/∂h)ᵀ λ + (∂h′/∂h)ᵀ η for the history h at the start of the step.
    ///
    /// # Errors
    /// [`InvertedElements`].
    pub fn pull_back_previous(
        &self,
        d: &[f64],
        step: SolidStep<'_>,
        adjoint: SolidAdjoint<'_>,
        out: &mut [f64],
    ) -> Result<(), InvertedElements> {
        let weights = Weights { forces: Some(adjoint.forces), history: Some(adjoint.history) };
        let mut into = PullBack { history: Some(out), ..PullBack::default() };
        self.pull_back(self.state(d, step), weights, &mut into)
    }

    /// Adds (∂h′/∂φ)ᵀ η of every element, given the slopes of the scalings.
    ///
    /// # Errors
    /// [`InvertedElements`].
    pub fn pull_back_history_density(
        &self,
        d: &[f64],
        step: SolidStep<'_>,
        slopes: &[ElementScaling],
        eta: &[f64],
        out: &mut [f64],
    ) -> Result<(), InvertedElements> {
        let weights = Weights { forces: None, history: Some(eta) };
        let mut into = PullBack { density: Some((slopes, out)), ..PullBack::default() };
        self.pull_back(self.state(d, step), weights, &mut into)
    }

    /// Points whose plastic strain grows between two histories, each with a node of its element.
    pub fn flowing(&self, before: &[f64], after: &[f64]) -> BTreeSet<(usize, u32)> {
        let grows = |entries: std::ops::Range<usize>| {
            let last = entries.end - 1;
            after.get(last).is_some_and(|now| *now > before.get(last).copied().unwrap_or(0.0))
        };
        let of = |element: &PointElement| -> Vec<(usize, u32)> {
            let points = (0..element.points()).filter(|&q| grows(element.entries(q)));
            points.map(|q| (element.first + q, element.nodes[0])).collect()
        };
        self.memory().flat_map(|block| &block.elements).flat_map(of).collect()
    }

    /// Equivalent plastic strain at the stress points of every element, [`STRESS_POINTS`] each; 0 for
    /// elements without memory and those of other ranks. In 27-node hexahedra with memory, these points
    /// are the outermost of the 27 integration points.
    pub fn plastic_strains(&self, history: &[f64]) -> Vec<[f64; STRESS_POINTS]> {
        let mut out = vec![[0.0; STRESS_POINTS]; self.elements()];
        self.memory().for_each(|block| block.write_plastic_strains(history, &mut out));
        out
    }

    /// Adds the derivatives of Σ w α over all points with respect to the history.
    pub fn pull_back_plastic_strains(&self, weights: &[f64], history: &mut [f64]) {
        self.memory().for_each(|block| block.pull_back_plastic_strains(weights, history));
    }

    /// Adds the derivatives of weighted energies of elements with memory with respect to displacements,
    /// history and densities.
    pub fn pull_back_inelastic_energies(
        &self,
        d: &[f64],
        step: SolidStep<'_>,
        weights: EnergyWeights<'_>,
        (displacements, history): (&mut [f64], &mut [f64]),
        density: (&[ElementScaling], &mut [f64]),
    ) {
        self.counter.count(Evaluation::PullBack);
        let (state, weights) = (self.state(d, step), [weights.elastic, weights.plastic]);
        let mut into = ByState { displacements, history, density };
        self.memory().for_each(|block| block.pull_back_energies(state, weights, &mut into));
    }
}
