//! The coarse space: Galerkin product and its factors.

use super::Nodes;
use super::aggregates::{Aggregates, MODES};
use super::transfer::{Side, Supports, Transfer};
use super::vertices::Vertices;
use crate::csr::{CsrMatrix, CsrPattern};
use crate::multifrontal::{MultifrontalFactorization, MultifrontalSolver};
use crate::solver::{Factorization, FactorizationError, LinearSolver, Precision};
use rayon::prelude::*;
use std::sync::Arc;

/// Damping of the block-Jacobi step that smooths the motions. Values between 0.35 and 0.66 change
/// the number of iterations by at most two.
const DAMPING: f64 = 0.5;

/// Pivot of the scaled coarse matrix below which a coarse motion counts as free.
const FREE: f64 = 1e-12;

/// Pivots of the scaled coarse matrix below which single precision is not enough. The smallest ones of
/// blocks with solid and void are 0.004 to 0.05.
const WEAK: f64 = 1e-4;

/// Solves in the span of a few motions: x = P (Rᵀ A P)⁻¹ Rᵀ b.
///
/// The displacements in P and R are the same. Multipliers follow from them: they react to a
/// violation of their contact conditions with the stiffness of the slave node, whose displacements
/// are condensed as if its neighbours were fixed. The coarse matrix therefore takes contact into
/// account, even where contact alone holds a body. In R, the multipliers are those of the
/// transposed matrix.
#[derive(Debug)]
pub(super) struct Coarse {
    motions: Transfer,
    /// The motions R that weight the equations, computed with the transposed matrix.
    weights: Transfer,
    /// Supports of the weights and of the motions.
    supports: [Supports; 2],
    /// First coarse unknown of each aggregate, then their total number.
    starts: Vec<usize>,
    factors: MultifrontalFactorization,
    /// Number of block additions in the Galerkin product.
    additions: f64,
}

/// The displacements of the coarse motions. They remain useful for a matrix that differs only near
/// contact; the multipliers and the coarse matrix are then computed from the new matrix.
#[derive(Debug)]
pub(super) struct Displacements {
    transfer: Transfer,
    /// First coarse unknown of each aggregate, then their total number.
    starts: Vec<usize>,
}

impl Displacements {
    /// Rigid motions of aggregates, smoothed except at slave nodes.
    pub fn new(a: &CsrMatrix, vertices: &Vertices, nodes: &Nodes) -> Self {
        let aggregates = Aggregates::new(a, vertices, nodes);
        let multiplier = multipliers(a, nodes);
        let smoothed = |v: usize| !vertices.is_long(v) && !vertices.members(v).iter().any(|&i| multiplier(i));
        let count = aggregates.modes.len();
        let tentative = Transfer::tentative(&aggregates);
        let transfer = tentative.relax(a, Side::Rows, vertices, count, &smoothed, &|_| true, DAMPING);
        let mut starts = vec![0];
        aggregates.modes.iter().for_each(|&count| starts.push(starts[starts.len() - 1] + count as usize));
        Self { transfer, starts }
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        transfer_bytes(&self.transfer)
    }
}

/// Whether an unknown is a multiplier.
fn multipliers<'a>(a: &'a CsrMatrix, nodes: &Nodes) -> impl Fn(u32) -> bool + Sync + use<'a> {
    let displacement_rows = 3 * nodes.coordinates.len() as u32;
    let origins = a.pattern.origins();
    move |i| origins[i as usize] >= displacement_rows
}

fn transfer_bytes(transfer: &Transfer) -> usize {
    transfer.blocks() * (8 * MODES + 12)
}

impl Coarse {
    /// # Errors
    /// [`FactorizationError::Singular`] if some motions are free; it names an unknown of the coarse
    /// matrix.
    pub fn new(
        a: &CsrMatrix,
        vertices: &Vertices,
        nodes: &Nodes,
        displacements: &Displacements,
    ) -> Result<Self, FactorizationError> {
        let multiplier = multipliers(a, nodes);
        let is_slave = |v: usize| vertices.members(v).iter().any(|&i| multiplier(i));
        let starts = displacements.starts.clone();
        let count = starts.len() - 1;
        let step = |side| displacements.transfer.relax(a, side, vertices, count, &is_slave, &multiplier, 1.0);
        let (motions, weights) = (step(Side::Rows), step(Side::Columns));
        let supports = [weights.supports(count), motions.supports(count)];
        let matrix = galerkin(a, vertices, &weights, &supports[0], &motions, &starts);
        let factors = factorize(&matrix)?;
        let additions = a.values.len() as f64 * motions.blocks() as f64 / a.n().max(1) as f64;
        Ok(Self { motions, weights, supports, starts, factors, additions })
    }

    /// `x += P (Rᵀ A P)⁻¹ Rᵀ b`, or its transpose.
    pub fn solve(&self, transpose: bool, rhs: &[f64], x: &mut [f64]) {
        let aggregates = self.starts.len() - 1;
        let mut blocks = vec![[0.0; MODES]; aggregates];
        let (down, up) = if transpose { (&self.motions, &self.weights) } else { (&self.weights, &self.motions) };
        down.restrict(&self.supports[usize::from(transpose)], rhs, &mut blocks);
        let mut packed = vec![0.0; self.starts[aggregates]];
        for (block, range) in blocks.iter().zip(self.starts.windows(2)) {
            packed[range[0]..range[1]].copy_from_slice(&block[..range[1] - range[0]]);
        }
        if transpose {
            self.factors.solve_transpose(&mut packed);
        } else {
            self.factors.solve(&mut packed);
        }
        for (block, range) in blocks.iter_mut().zip(self.starts.windows(2)) {
            block[..range[1] - range[0]].copy_from_slice(&packed[range[0]..range[1]]);
            block[range[1] - range[0]..].fill(0.0);
        }
        up.prolong(&blocks, x);
    }

    pub fn bytes(&self) -> usize {
        self.factors.bytes() + transfer_bytes(&self.motions) + transfer_bytes(&self.weights)
    }

    pub fn factors(&self) -> &MultifrontalFactorization {
        &self.factors
    }

    /// Cost of the Galerkin product: each block addition reads and writes one block.
    pub fn product_cost(&self) -> f64 {
        16.0 * MODES as f64 * self.additions
    }
}

/// Factors of the coarse matrix, in single precision unless some motions are weakly supported.
fn factorize(matrix: &CsrMatrix) -> Result<MultifrontalFactorization, FactorizationError> {
    let mut solver = MultifrontalSolver::new(Precision::F32);
    let symbolic = solver.analyse(&matrix.pattern)?;
    if let Ok(factors) = solver.factorize_matrix(&symbolic, matrix)
        && factors.statistics().smallest_pivot > WEAK
    {
        return Ok(factors);
    }
    let factors = solver.in_precision(Precision::F64).factorize_matrix(&symbolic, matrix)?;
    let facts = factors.statistics();
    if facts.smallest_pivot < FREE {
        return Err(FactorizationError::Singular { unknown: facts.weakest_unknown, pivot: facts.smallest_pivot });
    }
    Ok(factors)
}

/// Rᵀ A P.
fn galerkin(
    a: &CsrMatrix,
    vertices: &Vertices,
    weights: &Transfer,
    supports: &Supports,
    motions: &Transfer,
    starts: &[usize],
) -> CsrMatrix {
    let aggregates = starts.len() - 1;
    let patches = motions.products(a, Side::Rows, vertices, aggregates, &|_| true, &|_| true);
    type Row = (Vec<u32>, Vec<[[f64; MODES]; MODES]>);
    let row = |slots: &mut Vec<u32>, index: usize| -> Row {
        let (mut reached, mut blocks): Row = Default::default();
        // of the aggregates that the patch of the last vertex reaches
        let (mut last, mut places) = (usize::MAX, Vec::new());
        for (i, weight) in weights.of(supports, index) {
            let v = vertices.of[i as usize] as usize;
            let k = vertices.members(v).partition_point(|&j| j < i);
            let patch = patches[v].as_ref().expect("all vertices have one");
            if v != last {
                last = v;
                places.clear();
                places.extend(patch.reached.iter().map(|&aggregate| {
                    let slot = &mut slots[aggregate as usize];
                    if *slot == u32::MAX {
                        *slot = reached.len() as u32;
                        reached.push(aggregate);
                        blocks.push([[0.0; MODES]; MODES]);
                    }
                    *slot as usize
                }));
            }
            for (&place, product) in places.iter().zip(patch.row(k)) {
                let block = &mut blocks[place];
                for r in 0..MODES {
                    (0..MODES).for_each(|c| block[r][c] += weight[r] * product[c]);
                }
            }
        }
        reached.iter().for_each(|&aggregate| slots[aggregate as usize] = u32::MAX);
        (reached, blocks)
    };
    let rows: Vec<Row> = (0..aggregates).into_par_iter().map_init(|| vec![u32::MAX; aggregates], row).collect();
    let (mut offsets, mut columns, mut values, mut groups) = (vec![0], Vec::new(), Vec::new(), Vec::new());
    for (index, (reached, blocks)) in rows.iter().enumerate() {
        let mut order: Vec<usize> = (0..reached.len()).collect();
        order.sort_unstable_by_key(|&k| reached[k]);
        for mode in 0..starts[index + 1] - starts[index] {
            for &k in &order {
                let first = starts[reached[k] as usize];
                let count = starts[reached[k] as usize + 1] - first;
                columns.extend((first..first + count).map(|column| column as u32));
                values.extend_from_slice(&blocks[k][mode][..count]);
            }
            offsets.push(columns.len());
            groups.push(index as u32);
        }
    }
    let pattern = CsrPattern::new(offsets, columns, groups, Vec::new()).expect("columns ascend");
    CsrMatrix { pattern: Arc::new(pattern), values }
}
