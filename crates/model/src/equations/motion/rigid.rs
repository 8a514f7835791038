//! Rigid bodies: the displacements of their nodes follow from six unknowns each.
//!
//! A node of a rigid body with reference point X_r has the displacement
//!
//! ```text
//! d_i = u + (R(θ) − 1) a_i,    a_i = X_i − X_r
//! ```
//!
//! with the displacement u of the reference point and the rotation vector θ; the unknowns are u and
//! L θ, with the length L of [`Rigid`]. The entries d_i of y are not solved for; they always follow
//! from u and θ, so code that reads displacements treats all bodies alike. With T = ∂d/∂(u, L θ),
//! virtual work gives the equations of the six unknowns, Tᵀ R. The matrix and all derivatives with
//! respect to y are transformed in the same way: with K = ∂R/∂d, the tangent is Tᵀ K T plus the
//! curvature Σ R_i · ∂²d_i/∂θ∂θ.
//!
//! R_i at the nodes of rigid bodies remains in the residual: it is the force of the body on its
//! surroundings, and reactions follow from it.

use crate::equations::rotation::{curvature, turn, turn_slopes};
use nalgebra::{Matrix3, Vector3};
use slipstick_linalg::BlockMatrix;
use slipstick_mesh::{Mesh, Rigid};
use slipstick_path::{DependentUnknowns, StateError};
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

/// All rigid bodies of a model.
#[derive(Debug, Clone, Default)]
pub struct RigidBodies {
    bodies: Vec<RigidBody>,
    /// Total number of nodes.
    nodes: usize,
}

#[derive(Debug, Clone)]
struct RigidBody {
    /// The node of the reference point; the next node holds the rotation.
    reference: usize,
    length: f64,
    nodes: Range<usize>,
    elements: Range<usize>,
    /// a_i.
    arms: Vec<Vector3<f64>>,
}

impl DependentUnknowns for RigidBodies {
    fn gather(&self, y: &[f64], derivative: &mut [f64]) {
        self.pull_back(y, derivative);
    }

    fn spread(&self, y: &[f64], lambda: &mut [f64]) {
        self.spread(y, lambda);
    }
}

impl RigidBodies {
    /// The rigid bodies of a mesh.
    pub fn new(mesh: &Mesh) -> Self {
        let of = |rigid: &Rigid| {
            let nodes = mesh.bodies[rigid.body].nodes.clone();
            let point = Vector3::from(mesh.nodes[rigid.reference as usize]);
            let arms = mesh.nodes[nodes.clone()].iter().map(|x| Vector3::from(*x) - point).collect();
            let elements = mesh.bodies[rigid.body].elements.clone();
            RigidBody { reference: rigid.reference as usize, length: rigid.length, nodes, elements, arms }
        };
        Self { bodies: mesh.rigid.iter().map(of).collect(), nodes: mesh.nodes.len() }
    }

    /// Whether the model has no rigid bodies.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.bodies.is_empty()
    }

    /// Whether an element belongs to a rigid body.
    pub fn has_element(&self, element: usize) -> bool {
        self.bodies.iter().any(|body| body.elements.contains(&element))
    }

    /// Nodes of rigid bodies.
    pub fn nodes(&self) -> impl Iterator<Item = usize> {
        self.bodies.iter().flat_map(|body| body.nodes.clone())
    }

    /// Nodes that hold the unknowns of rigid bodies.
    pub fn references(&self) -> impl Iterator<Item = usize> {
        self.bodies.iter().flat_map(|body| [body.reference, body.reference + 1])
    }

    /// The displacement unknowns that `dof` represents. For a translation of a rigid body, these
    /// are those of its nodes and reference point; for a rotation, none; otherwise, `dof` itself.
    pub fn moved_by(&self, dof: u32) -> Vec<u32> {
        let (node, c) = (dof as usize / 3, dof % 3);
        match self.bodies.iter().find(|body| (body.reference..=body.reference + 1).contains(&node)) {
            Some(body) if node == body.reference => {
                body.nodes.clone().chain([node]).map(|node| 3 * node as u32 + c).collect()
            }
            Some(_) => Vec::new(),
            None => vec![dof],
        }
    }

    /// For every coordinate, whether it is prescribed, given the prescribed unknowns. A coordinate
    /// of a point of a rigid body is prescribed if neither the translation along its axis nor a
    /// rotation can move the point along that axis.
    pub fn point_is_fixed(&self, fixed: &[bool]) -> Vec<bool> {
        let mut out = fixed.to_vec();
        for body in &self.bodies {
            let held =
                |c: usize| fixed[3 * body.reference + c] && (0..3).all(|r| r == c || fixed[3 * body.reference + 3 + r]);
            for node in body.nodes.clone() {
                (0..3).for_each(|c| out[3 * node + c] = held(c));
            }
        }
        out
    }

    /// Couplings in the sparsity pattern, in addition to those of the nodes: the unknowns of a body
    /// couple with each other and with everything its nodes couple with.
    pub fn couple(&self, rows: &mut [Vec<u32>]) {
        for body in &self.bodies {
            let unknowns = [body.reference as u32, body.reference as u32 + 1];
            let mut around: Vec<u32> = unknowns.to_vec();
            for node in body.nodes.clone() {
                around.push(node as u32);
                around.extend_from_slice(&rows[node]);
                rows[node].extend(unknowns);
            }
            around.sort_unstable();
            around.dedup();
            unknowns.iter().for_each(|&row| rows[row as usize].clone_from(&around));
        }
    }

    /// Adds to a list of nodes the nodes with the unknowns of the rigid bodies among them.
    pub fn add_references(&self, nodes: &mut Vec<u32>) {
        for body in &self.bodies {
            if nodes.iter().any(|&node| body.nodes.contains(&(node as usize))) {
                nodes.extend([body.reference as u32, body.reference as u32 + 1]);
            }
        }
        nodes.sort_unstable();
        nodes.dedup();
    }

    /// Rotation vector at y of the body with this reference point. \[rad\]
    pub fn rotation(&self, reference: u32, y: &[f64]) -> Option<[f64; 3]> {
        let body = self.bodies.iter().find(|body| body.reference == reference as usize)?;
        Some(body.pose(y).1.into())
    }

    /// Rotation vectors of all rigid bodies at y. \[rad\]
    pub(in crate::equations) fn rotations(&self, y: &[f64]) -> impl Iterator<Item = Vector3<f64>> {
        self.bodies.iter().map(|body| body.pose(y).1)
    }

    /// Checks that no body that is free to rotate has turned by more than a quarter turn since the
    /// rotation vectors were `before`. Where friction alone turns a body, the equations of a step
    /// have more solutions about half a turn or a full turn away.
    ///
    /// # Errors
    /// [`StateError::TurnedTooFar`].
    pub(in crate::equations) fn check_turns(
        &self,
        before: &[Vector3<f64>],
        y: &[f64],
        fixed: &[bool],
    ) -> Result<(), StateError> {
        for ((body, before), now) in self.bodies.iter().zip(before).zip(self.rotations(y)) {
            let free = fixed[3 * body.reference + 3..][..3].contains(&false);
            let turn = (now - before).norm();
            if free && turn > FRAC_PI_2 {
                return Err(StateError::TurnedTooFar { node: body.reference as u32, degrees: turn.to_degrees() });
            }
        }
        Ok(())
    }

    /// Writes the displacements of the nodes of rigid bodies, computed from the bodies' unknowns.
    pub fn place(&self, y: &mut [f64]) {
        for body in &self.bodies {
            let (u, theta) = body.pose(y);
            let turn = turn(&theta);
            for (node, arm) in body.nodes.clone().zip(&body.arms) {
                y[3 * node..][..3].copy_from_slice((u + turn * arm).as_slice());
            }
        }
    }

    /// Adds T v to the entries of the nodes of rigid bodies, for a change v of the unknowns at y.
    ///
    /// Test: `spread_and_gather_are_those_of_the_motion`.
    pub fn spread(&self, y: &[f64], v: &mut [f64]) {
        for body in &self.bodies {
            let slopes = body.slopes(y);
            let [u, theta] = [0, 1].map(|k| vector(v, body.reference + k));
            let turn = slopes[0] * theta[0] + slopes[1] * theta[1] + slopes[2] * theta[2];
            for (node, arm) in body.nodes.clone().zip(&body.arms) {
                add(v, node, &(u + turn * arm));
            }
        }
    }

    /// Adds Tᵀ v to the entries of the unknowns of rigid bodies.
    pub fn gather(&self, y: &[f64], v: &mut [f64]) {
        for body in &self.bodies {
            let (mut force, mut products) = (Vector3::zeros(), Matrix3::zeros());
            for (node, arm) in body.nodes.clone().zip(&body.arms) {
                force += vector(v, node);
                products += arm * vector(v, node).transpose();
            }
            let slopes = body.slopes(y);
            add(v, body.reference, &force);
            add(v, body.reference + 1, &Vector3::from(slopes.map(|slope| (slope * products).trace())));
        }
    }

    /// Tᵀ v, which replaces derivatives with respect to the nodes of rigid bodies.
    pub fn pull_back(&self, y: &[f64], v: &mut [f64]) {
        self.gather(y, v);
        self.nodes().for_each(|node| v[3 * node..][..3].fill(0.0));
    }

    /// Transforms a matrix ∂R/∂y, in which the d_i are independent, to the unknowns of rigid bodies
    /// at y. `forces` are R at their nodes; the rows of these nodes remain, and their columns
    /// become zero.
    pub fn carry_over(&self, y: &[f64], forces: &[f64], matrix: &mut BlockMatrix) {
        if self.is_empty() {
            return;
        }
        let mut owner = vec![None; self.nodes];
        for (b, body) in self.bodies.iter().enumerate() {
            let slopes = body.slopes(y);
            for (node, arm) in body.nodes.clone().zip(&body.arms) {
                owner[node] = Some((b, Matrix3::from_columns(&slopes.map(|slope| slope * arm))));
            }
        }
        let pattern = matrix.pattern().clone();
        for row in 0..pattern.rows() {
            for (position, &column) in pattern.row_range(row).zip(pattern.row(row)) {
                let Some((b, by_rotation)) = owner.get(column as usize).copied().flatten() else { continue };
                let block = std::mem::take(&mut matrix.values_mut()[position]);
                if block == [0.0; 9] {
                    continue;
                }
                let reference = self.bodies[b].reference;
                matrix.add(row, reference, &block);
                matrix.add(row, reference + 1, &array(&(Matrix3::from_row_slice(&block) * by_rotation)));
            }
        }
        for (row, owner) in owner.iter().enumerate() {
            let Some((b, by_rotation)) = owner else { continue };
            let reference = self.bodies[*b].reference;
            for (position, &column) in pattern.row_range(row).zip(pattern.row(row)) {
                let block = matrix.values()[position];
                if block == [0.0; 9] {
                    continue;
                }
                matrix.add(reference, column as usize, &block);
                let turned = by_rotation.transpose() * Matrix3::from_row_slice(&block);
                matrix.add(reference + 1, column as usize, &array(&turned));
            }
        }
        for body in &self.bodies {
            let mut products = Matrix3::zeros();
            for (node, arm) in body.nodes.clone().zip(&body.arms) {
                products += arm * vector(forces, node).transpose();
            }
            let scale = 1.0 / (body.length * body.length);
            let curvature = curvature(&body.pose(y).1, &products) * scale;
            matrix.add(body.reference + 1, body.reference + 1, &array(&curvature));
        }
    }
}

impl RigidBody {
    /// u and θ.
    fn pose(&self, y: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
        (vector(y, self.reference), vector(y, self.reference + 1) / self.length)
    }

    /// ∂R/∂(L θ_k).
    fn slopes(&self, y: &[f64]) -> [Matrix3<f64>; 3] {
        turn_slopes(&self.pose(y).1).map(|slope| slope / self.length)
    }
}

fn vector(v: &[f64], node: usize) -> Vector3<f64> {
    Vector3::from_column_slice(&v[3 * node..][..3])
}

fn add(v: &mut [f64], node: usize, by: &Vector3<f64>) {
    v[3 * node..][..3].iter_mut().zip(by).for_each(|(to, by)| *to += by);
}

/// Row by row.
fn array(m: &Matrix3<f64>) -> [f64; 9] {
    std::array::from_fn(|e| m[(e / 3, e % 3)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_mesh::{BoxShape, box_mesh};

    #[test]
    fn spread_and_gather_are_those_of_the_motion() {
        let shape = BoxShape { min: [0.0; 3], max: [1.0, 2.0, 3.0], elements: [1; 3], grading: [1.0; 3] };
        let mut mesh = box_mesh("tool", &shape).unwrap();
        mesh.make_rigid(0, [0.5, -1.0, 0.2]);
        let rigid = RigidBodies::new(&mesh);
        let count = 3 * mesh.nodes.len();
        let mut y = vec![0.0; count];
        let pose = [0.1, -0.2, 0.3, 0.9, -1.4, 0.6];
        y[count - 6..].copy_from_slice(&pose);
        let direction = [0.3, 0.8, -0.5, 0.2, 1.1, -0.7];
        let h = 1e-6;
        let at = |sign: f64| {
            let mut y = y.clone();
            y[count - 6..].iter_mut().zip(direction).for_each(|(y, v)| *y += sign * h * v);
            rigid.place(&mut y);
            y
        };
        let mut spread = vec![0.0; count];
        spread[count - 6..].copy_from_slice(&direction);
        rigid.spread(&y, &mut spread);
        for ((up, down), slope) in at(1.0).iter().zip(at(-1.0)).zip(&spread) {
            assert!(((up - down) / (2.0 * h) - slope).abs() < 1e-9);
        }
        let weights: Vec<f64> = (0..count).map(|i| ((i * 7919) % 101) as f64 / 50.0 - 1.0).collect();
        let mut gathered = weights.clone();
        rigid.pull_back(&y, &mut gathered);
        let product: f64 = weights.iter().zip(&spread).map(|(w, v)| w * v).sum();
        let along: f64 = gathered[count - 6..].iter().zip(direction).map(|(g, v)| g * v).sum();
        assert!((product - along).abs() < 1e-13 * product.abs(), "{product} {along}");
    }
}
