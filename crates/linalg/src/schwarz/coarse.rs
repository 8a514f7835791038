//! The coarse space: solves in the span of the coarse motions, x = P (Rᵀ A P)⁻¹ Rᵀ b.

use super::aggregates::MODES;
use super::galerkin::{Galerkin, Kept};
use super::motions::{Displacements, Motions};
use super::transfer::Side;
use super::vertices::Vertices;
use super::{NAME, Nodes};
use crate::csr::CsrMatrix;
use crate::multifrontal::{MultifrontalFactorization, MultifrontalSolver};
use crate::solver::{Factorization, FactorizationError, Precision};
use crate::symbolic::Symbolic;
use std::sync::Arc;

/// Pivot of the scaled coarse matrix below which a coarse motion counts as free.
const FREE: f64 = 1e-12;

/// Pivots of the scaled coarse matrix below which single precision is not enough. The smallest ones of
/// blocks with solid and void are 0.004 to 0.05.
const WEAK: f64 = 1e-4;

/// The motions P and R of a matrix, and the factors of the coarse matrix Rᵀ A P.
///
/// The displacements in P and R are the same; the multipliers in R are those of the transposed matrix.
/// The coarse matrix therefore takes contact into account, even where contact alone holds a body.
#[derive(Debug)]
pub(super) struct Coarse {
    displacements: Arc<Displacements>,
    motions: Motions,
    /// The motions R that weight the equations.
    weights: Motions,
    factors: MultifrontalFactorization,
    /// Number of block additions in the Galerkin product.
    additions: f64,
}

impl Coarse {
    /// Also returns what the coarse space of the next matrix may use.
    ///
    /// # Errors
    /// [`FactorizationError::Singular`] if some motions are free; it names the unknown that they move
    /// most.
    pub fn new(
        a: &CsrMatrix,
        vertices: &Vertices,
        nodes: &Nodes,
        displacements: &Arc<Displacements>,
        kept: Option<Kept>,
        near: &[bool],
    ) -> Result<(Self, Kept), FactorizationError> {
        let step = |side| Motions::new(a, side, vertices, nodes, displacements);
        let (motions, weights) = (step(Side::Rows), step(Side::Columns));
        let Galerkin { matrix, kept, treated } =
            Galerkin::new(a, vertices, displacements, [&weights, &motions], kept, near)?;
        let factors = factorize(&kept.symbolic, &matrix).map_err(|error| match error {
            FactorizationError::Singular { unknown, pivot } => {
                FactorizationError::Singular { unknown: displacements.most_moved_by(unknown), pivot }
            }
            error => FactorizationError::Backend { solver: NAME, n: a.n(), reason: format!("coarse matrix: {error}") },
        })?;
        let additions = treated * a.values.len() as f64 * motions.blocks() as f64 / a.n().max(1) as f64;
        Ok((Self { displacements: displacements.clone(), motions, weights, factors, additions }, kept))
    }

    /// `x += P (Rᵀ A P)⁻¹ Rᵀ b`, or its transpose, for right-hand sides of n entries.
    pub fn solve(&self, transpose: bool, n: usize, rhs: &[f64], x: &mut [f64]) {
        let (aggregates, starts) = (self.displacements.aggregates(), &self.displacements.starts);
        let n = n.max(1);
        let mut blocks = vec![[0.0; MODES]; aggregates];
        let (down, up) = if transpose { (&self.motions, &self.weights) } else { (&self.weights, &self.motions) };
        let mut packed = Vec::with_capacity(rhs.len() / n * starts[aggregates]);
        for rhs in rhs.chunks_exact(n) {
            down.restrict(rhs, &mut blocks);
            for (block, range) in blocks.iter().zip(starts.windows(2)) {
                packed.extend(&block[..range[1] - range[0]]);
            }
        }
        if transpose {
            self.factors.solve_transpose_many(&mut packed);
        } else {
            self.factors.solve_many(&mut packed);
        }
        for (packed, x) in packed.chunks_exact(starts[aggregates].max(1)).zip(x.chunks_exact_mut(n)) {
            for (block, range) in blocks.iter_mut().zip(starts.windows(2)) {
                block[..range[1] - range[0]].copy_from_slice(&packed[range[0]..range[1]]);
                block[range[1] - range[0]..].fill(0.0);
            }
            up.prolong(&blocks, x);
        }
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        self.factors.bytes() + self.motions.bytes() + self.weights.bytes() + self.displacements.bytes()
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
fn factorize(symbolic: &Symbolic, matrix: &CsrMatrix) -> Result<MultifrontalFactorization, FactorizationError> {
    let mut solver = MultifrontalSolver::new(Precision::F32);
    if let Ok(factors) = solver.factorize_matrix(symbolic, matrix)
        && factors.statistics().smallest_pivot > WEAK
    {
        return Ok(factors);
    }
    let factors = solver.in_precision(Precision::F64).factorize_matrix(symbolic, matrix)?;
    let facts = factors.statistics();
    if facts.smallest_pivot < FREE {
        return Err(FactorizationError::Singular { unknown: facts.weakest_unknown, pivot: facts.smallest_pivot });
    }
    Ok(factors)
}
