//! Coarse motions: displacements, which matrices share, and multipliers, which each has of its own.

use super::Nodes;
use super::aggregates::{Aggregates, MODES};
use super::transfer::{Rows, Side, Supports, Transfer};
use super::vertices::Vertices;
use crate::csr::CsrMatrix;
use rayon::prelude::*;
use std::sync::Arc;

/// Damping of the block-Jacobi step that smooths the motions. Values between 0.35 and 0.66 change
/// the number of iterations by at most two.
const DAMPING: f64 = 0.5;

/// The displacements of the coarse motions. They remain useful for a matrix that differs only near
/// contact.
#[derive(Debug)]
pub(super) struct Displacements {
    transfer: Transfer,
    supports: Supports,
    /// First coarse unknown of each aggregate, then their total number.
    pub starts: Vec<usize>,
}

impl Displacements {
    /// Rigid motions of aggregates, smoothed except at slave nodes.
    pub fn new(a: &CsrMatrix, vertices: &Vertices, nodes: &Nodes) -> Self {
        let aggregates = Aggregates::new(a, vertices, nodes);
        let is_slave = slaves(a, vertices, nodes);
        let smoothed = |v: usize| !vertices.is_long(v) && !is_slave(v);
        let count = aggregates.modes.len();
        let tentative = Transfer::tentative(&aggregates);
        let transfer = tentative.relax(a, Side::Rows, vertices, count, &smoothed, &|_| true, DAMPING).without_zeros();
        let mut starts = vec![0];
        aggregates.modes.iter().for_each(|&count| starts.push(starts[starts.len() - 1] + count as usize));
        Self { supports: transfer.supports(count), transfer, starts }
    }

    /// The unknown that a coarse unknown moves most.
    pub fn most_moved_by(&self, coarse: usize) -> usize {
        let aggregate = self.starts.partition_point(|&start| start <= coarse) - 1;
        let size = |motion: &[f64; MODES]| motion[coarse - self.starts[aggregate]].abs();
        let moved = self.transfer.of(&self.supports, aggregate);
        moved.max_by(|(_, a), (_, b)| size(a).total_cmp(&size(b))).map_or(0, |(i, _)| i as usize)
    }

    /// Number of aggregates.
    pub fn aggregates(&self) -> usize {
        self.starts.len() - 1
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        self.transfer.bytes() + self.supports.bytes()
    }
}

/// The motions of a matrix or of its transpose. Multipliers react to a violation of their contact
/// conditions with the stiffness of the slave node, whose displacements are condensed as if its
/// neighbours were fixed.
#[derive(Debug)]
pub(super) struct Motions {
    displacements: Arc<Displacements>,
    multipliers: Transfer,
    /// Supports of the multipliers.
    supports: Supports,
}

impl Motions {
    pub fn new(
        a: &CsrMatrix,
        side: Side,
        vertices: &Vertices,
        nodes: &Nodes,
        displacements: &Arc<Displacements>,
    ) -> Self {
        let count = displacements.aggregates();
        let (is_slave, multiplier) = (slaves(a, vertices, nodes), multipliers(a, nodes));
        let multipliers = displacements.transfer.relax(a, side, vertices, count, &is_slave, &multiplier, 1.0);
        Self { displacements: displacements.clone(), supports: multipliers.supports(count), multipliers }
    }

    /// The motions in the support of an aggregate: unknown, and what it moves with each.
    pub fn of(&self, aggregate: usize) -> impl Iterator<Item = (u32, &[f64; MODES])> {
        let Displacements { transfer, supports, .. } = &*self.displacements;
        transfer.of(supports, aggregate).chain(self.multipliers.of(&self.supports, aggregate))
    }

    /// `coarse = Pᵀ fine`; the coarse vector has [`MODES`] entries per aggregate.
    pub fn restrict(&self, fine: &[f64], coarse: &mut [[f64; MODES]]) {
        coarse.par_iter_mut().with_min_len(16).enumerate().for_each(|(aggregate, sums)| {
            *sums = [0.0; MODES];
            self.of(aggregate).for_each(|(i, motion)| {
                sums.iter_mut().zip(motion).for_each(|(sum, m)| *sum += m * fine[i as usize]);
            });
        });
    }

    /// `fine += P coarse`.
    pub fn prolong(&self, coarse: &[[f64; MODES]], fine: &mut [f64]) {
        fine.par_iter_mut().with_min_len(4096).enumerate().for_each(|(i, value)| {
            for (aggregate, motion) in self.row(i) {
                *value += motion.iter().zip(&coarse[aggregate as usize]).map(|(m, c)| m * c).sum::<f64>();
            }
        });
    }

    /// Number of stored blocks.
    pub fn blocks(&self) -> usize {
        self.displacements.transfer.blocks() + self.multipliers.blocks()
    }

    /// Memory in bytes, without the displacements.
    pub fn bytes(&self) -> usize {
        self.multipliers.bytes() + self.supports.bytes()
    }
}

impl Rows for Motions {
    fn row(&self, i: usize) -> impl ExactSizeIterator<Item = (u32, &[f64; MODES])> {
        // an unknown is a displacement or a multiplier
        let row = self.displacements.transfer.row(i);
        if row.len() > 0 { row } else { self.multipliers.row(i) }
    }
}

/// Whether an unknown is a multiplier.
pub(super) fn multipliers<'a>(a: &'a CsrMatrix, nodes: &'a Nodes) -> impl Fn(u32) -> bool + Sync + use<'a> {
    |i| nodes.is_multiplier(a.pattern.origins()[i as usize])
}

/// Whether a vertex is a slave node with multipliers.
fn slaves<'a>(a: &'a CsrMatrix, vertices: &'a Vertices, nodes: &'a Nodes) -> impl Fn(usize) -> bool + Sync + use<'a> {
    let multiplier = multipliers(a, nodes);
    move |v| vertices.members(v).iter().any(|&i| multiplier(i))
}
