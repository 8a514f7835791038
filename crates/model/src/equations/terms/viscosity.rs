//! Viscous forces that let a path continue through instabilities, such as the snap of a curved
//! strip.
//!
//! ```text
//! R_i = … + c V_i (d_i − d_i,n−1)/Δt       at free displacements i, with the volume V_i around the node
//! ```
//!
//! The velocity is a derivative with respect to pseudo-time. While bodies follow their supports, it
//! is of the order of the supports' velocity; during a snap, only the viscosity limits it. Viscous
//! forces do not depend on the density and do not act at displacements that are prescribed, be it for a part of
//! the path, so reactions keep their meaning.

use crate::equations::ContactModel;
use crate::equations::terms::{ForceTerm, TermState};
use slipstick_linalg::BlockMatrix;
use slipstick_mesh::Mesh;
use slipstick_path::Span;

/// The viscosity of all displacement unknowns.
#[derive(Debug, Clone, Default)]
pub struct Viscosity {
    /// c V_i for each displacement unknown; zero at prescribed ones. Empty without viscosity.
    /// \[F/L\]
    damping: Vec<f64>,
}

impl Viscosity {
    /// Viscosity `coefficient` c ≥ 0 \[F/L⁴\] of a mesh; `fixed` marks the displacements that are prescribed at some time.
    pub fn new(coefficient: f64, mesh: &Mesh, fixed: &[bool]) -> Self {
        if coefficient == 0.0 {
            return Self::default();
        }
        let mut volumes = vec![0.0; mesh.nodes.len()];
        for (element, volume) in mesh.elements.iter().zip(mesh.element_volumes()) {
            let nodes = element.nodes();
            nodes.iter().for_each(|&node| volumes[node as usize] += volume / nodes.len() as f64);
        }
        let of = |(i, &fixed): (usize, &bool)| if fixed { 0.0 } else { coefficient * volumes[i / 3] };
        Self { damping: fixed.iter().enumerate().map(of).collect() }
    }

    /// Whether there is no viscosity.
    pub fn is_none(&self) -> bool {
        self.damping.is_empty()
    }

    /// Work that the viscous forces take from the bodies in a step of length `span` from
    /// displacements `before` to `now`. \[F L\]
    pub fn work(&self, before: &[f64], now: &[f64], span: f64) -> f64 {
        self.damping.iter().zip(before.iter().zip(now)).map(|(c, (a, b))| c * (b - a) * (b - a)).sum::<f64>() / span
    }
}

/// The state from which the viscous forces of a step are measured.
#[derive(Debug, Default)]
pub(in crate::equations) struct Rate {
    /// Displacements before the step; empty without viscosity.
    before: Vec<f64>,
    /// Length of the step in pseudo-time.
    span: f64,
}

impl ContactModel {
    pub(in crate::equations) fn rate(&self, before: &[f64], span: Span) -> Rate {
        if self.viscosity.is_none() {
            return Rate::default();
        }
        Rate { before: before[..self.displacement_count()].to_vec(), span: span.duration() }
    }
}

impl Viscosity {
    /// Displacement unknowns of this rank, each with its damping divided by the length of the step, and its value
    /// before the step.
    fn damped<'a>(&'a self, at: TermState<'a>) -> impl Iterator<Item = (usize, f64, f64)> + 'a {
        let rate = at.step.filter(|_| !self.is_none()).map(|(step, _)| &step.rate);
        let all = rate.into_iter().flat_map(|rate| {
            let damping = self.damping.iter().zip(&rate.before).enumerate();
            damping.map(|(i, (c, before))| (i, c / rate.span, *before))
        });
        all.filter(move |(i, ..)| at.model().share.has_node((i / 3) as u32))
    }
}

impl ForceTerm for Viscosity {
    fn add_force(&self, at: TermState<'_>, out: &mut [f64]) {
        self.damped(at).for_each(|(i, c, before)| out[i] += c * (at.y[i] - before));
    }

    fn add_tangent(&self, at: TermState<'_>, matrix: &mut BlockMatrix) {
        let mut blocks = vec![[0.0; 9]; self.damping.len() / 3];
        self.damped(at).for_each(|(i, c, _)| blocks[i / 3][4 * (i % 3)] = c);
        let filled = blocks.iter().enumerate().filter(|(_, block)| **block != [0.0; 9]);
        filled.for_each(|(node, block)| matrix.add(node, node, block));
    }

    fn pull_back_previous(&self, at: TermState<'_>, lambda: &[f64], out: &mut [f64]) {
        self.damped(at).for_each(|(i, c, _)| out[i] -= c * lambda[i]);
    }
}
