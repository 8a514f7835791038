//! All unknowns that follow from others: those of linear equations, then the nodes of rigid bodies.

use crate::equations::linear::LinearEquations;
use crate::equations::rigid::RigidBodies;
use slipstick_linalg::BlockMatrix;
use slipstick_path::DependentUnknowns;

/// What makes unknowns follow from others. An equation may contain the unknowns of rigid bodies, and no nodes
/// of theirs.
#[derive(Debug, Clone, Default)]
pub struct Dependent {
    pub(in crate::equations) rigid: RigidBodies,
    pub(in crate::equations) linear: LinearEquations,
}

impl DependentUnknowns for Dependent {
    fn gather(&self, y: &[f64], derivative: &mut [f64]) {
        self.pull_back(y, derivative);
    }

    fn spread(&self, y: &[f64], lambda: &mut [f64]) {
        self.linear.spread(lambda);
        self.rigid.spread(y, lambda);
    }
}

impl Dependent {
    /// Whether no unknown depends on others.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.rigid.is_empty() && self.linear.is_empty()
    }

    /// Writes the dependent displacements.
    pub fn place(&self, y: &mut [f64]) {
        self.linear.place(y);
        self.rigid.place(y);
    }

    /// Adds Tᵀ v to the entries of the unknowns on which others depend.
    pub fn gather(&self, y: &[f64], v: &mut [f64]) {
        self.rigid.gather(y, v);
        self.linear.gather(v);
    }

    /// Tᵀ v, which replaces derivatives with respect to dependent unknowns.
    pub fn pull_back(&self, y: &[f64], v: &mut [f64]) {
        self.rigid.pull_back(y, v);
        self.linear.pull_back(v);
    }

    /// Transforms a matrix ∂R/∂y to the independent unknowns at y; `forces` are R at the nodes of rigid bodies.
    pub fn carry_over(&self, y: &[f64], forces: &[f64], matrix: &mut BlockMatrix) {
        self.rigid.carry_over(y, forces, matrix);
        self.linear.carry_over(matrix);
    }

    /// Couplings in the sparsity pattern, in addition to those of the nodes.
    pub fn couple(&self, rows: &mut [Vec<u32>]) {
        self.rigid.couple(rows);
        self.linear.couple(rows);
    }

    /// Adds to a list of nodes those with the unknowns on which they depend.
    pub fn add_sources(&self, nodes: &mut Vec<u32>) {
        self.rigid.add_references(nodes);
        self.linear.add_sources(nodes);
    }

    /// For every coordinate of a point, whether it is prescribed, given the prescribed unknowns.
    pub fn point_is_fixed(&self, fixed: &[bool]) -> Vec<bool> {
        self.rigid.point_is_fixed(&self.linear.truly_fixed(fixed))
    }
}
