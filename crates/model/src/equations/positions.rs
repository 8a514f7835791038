//! Reference positions X as an input: a model with nodes elsewhere, and derivatives with respect to X.
//!
//! What never changes is the topology: elements, facets, unknowns, the order of sums. The solids' reference
//! geometry follows X, and so do the centres of prescribed rotations' arms. Contact and pressure loads depend on X
//! only through x = X + d, so their derivatives with respect to X are those with respect to the displacements of the
//! state and of the state before. As for the density, the start design keeps what it determined: the areas and sizes
//! of facets by which stiffnesses and the cover of nodes are measured.
//!
//! Tests: `every_input_is_pulled_back` (tests/suite/inputs.rs), tests/suite/positions.rs.

use crate::equations::evaluated::Step;
use crate::equations::law::NodeLaw;
use crate::equations::{ContactModel, Design, Method, inverted, node};
use nalgebra::Vector3;
use slipstick_contact::kinematics::NodeKinematics;
use slipstick_path::{Adjoint, Evaluated, Inputs, StateError};
use slipstick_solid::SolidAdjoint;
use std::sync::Arc;

impl ContactModel {
    /// What keeps the model from having derivatives with respect to reference positions, in words; empty: nothing.
    pub fn fixes_positions(&self) -> Vec<String> {
        let mut out = Vec::new();
        let mut note = |has: bool, what: &str| out.extend(has.then(|| what.to_owned()));
        note(!self.dependent.is_empty(), "rigid bodies and linear equations");
        note(self.loads.depend_on_positions(), "tractions, forces on surfaces, and loads on mass");
        note(!self.springs.is_empty(), "springs");
        note(!self.bolts.list().is_empty(), "bolts");
        note(!self.viscosity.is_none(), "viscous forces");
        note(!self.prescribed.temporary().is_empty(), "supports that begin or end");
        note(self.may_move_freely(), "bodies that contact alone holds");
        let special = |pair: &crate::equations::ModelInterface| {
            pair.is_bonded()
                || pair.interface.heights().iter().any(|side| !side.is_empty())
                || pair.adjusted.iter().any(|&gap| gap != 0.0)
                || pair.interface.has_closed_gaps()
                || !pair.offset.is_empty()
        };
        let pairs = "contact pairs that are tied, adjusted, offset, or smoothed by true surfaces";
        note(self.interfaces.iter().any(special), pairs);
        out
    }

    /// Reference positions X of the nodes, three entries each. \[L\]
    pub fn reference_positions(&self) -> &[f64] {
        &self.coordinates
    }

    /// The same model with nodes at other reference positions X, three entries each.
    ///
    /// # Errors
    /// If elements have a non-positive Jacobian there, on any rank.
    ///
    /// # Panics
    /// If there are not three entries for each node, or if [something](Self::fixes_positions) keeps it from moving.
    pub fn at_positions(&self, x: &[f64]) -> Result<Self, StateError> {
        assert_eq!(self.fixes_positions(), Vec::<String>::new(), "a model without derivatives by positions");
        assert_eq!(x.len(), self.coordinates.len(), "three entries for each node");
        let solid = self.solid.at_positions(x.as_chunks::<3>().0).map_err(inverted);
        let solid = Arc::new(self.share.agree(solid)?);
        let prescribed = self.prescribed.at_positions(x);
        Ok(Self { solid, prescribed, coordinates: x.to_vec(), ..self.clone() })
    }
}

impl Design {
    /// The same densities with nodes at other reference positions, [`ContactModel::at_positions`].
    ///
    /// # Errors
    /// If elements have a non-positive Jacobian there.
    pub fn at_positions(&self, x: &[f64]) -> Result<Self, StateError> {
        Ok(Self::new(Arc::new(self.model.at_positions(x)?), self.density()))
    }

    /// Adds (∂F/∂X)ᵀ λ + (∂G/∂X)ᵀ η + (∂ŷ/∂X)ᵀ μ.
    pub(in crate::equations) fn pull_back_positions(
        &self,
        step: &Step,
        at: &Evaluated<Self>,
        adjoint: &Adjoint<'_>,
        out: &mut [f64],
    ) -> Result<(), StateError> {
        let &Adjoint { lambda, eta, mu } = adjoint;
        let (model, split) = (&*self.model, self.model.displacement_count());
        let d = &at.unknowns[..split];
        model.share.add(out, |out| {
            let weights = SolidAdjoint { forces: &lambda[..split], history: &eta[model.history.solid.clone()] };
            model.solid.pull_back_positions(d, self.solid_at(step), weights, out).map_err(inverted)?;
            model.add_from_contact(out, |out| self.add_contact_by_positions(step, at, (lambda, eta), out));
            Ok(())
        })?;
        // R contains minus the external force
        let weights: Vec<f64> = lambda[..split].iter().map(|l| -l).collect();
        self.pull_back_external_force(d, step.time, &weights, out);
        model.prescribed.pull_back_positions(step.time, mu, out);
        Ok(())
    }

    /// Adds λᵀ ∂f/∂X of internal forces at a state, as quantities see them.
    pub(crate) fn pull_back_internal_force_by_positions(
        &self,
        step: &Step,
        d: &[f64],
        lambda: &[f64],
        out: &mut [f64],
    ) -> Result<(), StateError> {
        let weights = SolidAdjoint { forces: lambda, history: &[] };
        self.model.share.add(out, |out| {
            self.model.solid.pull_back_positions(d, self.solid_at(step), weights, out).map_err(inverted)
        })
    }

    /// Adds the derivatives of contact with respect to the points of its surfaces, which move by δX in this state and
    /// in the one before.
    fn add_contact_by_positions(
        &self,
        step: &Step,
        at: &Evaluated<Self>,
        (lambda, eta): (&[f64], &[f64]),
        out: &mut [f64],
    ) {
        let model = &*self.model;
        let eta = &eta[model.history.contact.clone()];
        let mapped = model.contact_vector(lambda);
        let x = model.contact_positions(&at.unknowns);
        let (previous, history) = (vec![0.0; lambda.len()], vec![0.0; model.unknowns.history]);
        let mut before = Inputs { previous, history, ..Inputs::default() };
        for (j, now, node) in at.state.nodes_here() {
            let weights = self.law_weights(j, now, &node.law, &mapped, eta);
            self.pull_back_law_previous(step, j, now, &x, &weights, &mut before);
            if model.method_of(j) == Method::Penalty {
                let weight = Vector3::new(0.0, eta[2 * j], eta[2 * j + 1]);
                node::add_traction_pull_back(now, &node.step, &node.law.traction(), &weight, out);
            }
            if !node.law.contributes() {
                continue;
            }
            let traction = node.law.traction();
            add_force_pull_back(now, &node.step, &traction, &mapped, out);
            if let NodeLaw::Multiplier { equation, .. } = &node.law {
                let weight = model.multiplier(&mapped, j);
                let rows = node::condition_slopes(now, &node.step, equation);
                add_row(&node.step, |t| (0..3).map(|b| weight[b] * rows[b][t]).sum(), out);
            }
        }
        out.iter_mut().zip(&before.previous).for_each(|(to, from)| *to += from);
    }
}

/// Adds λᵀ ∂f/∂x of a node's contact forces f_s = b_js z over the step's support.
fn add_force_pull_back(
    now: &NodeKinematics,
    step: &node::NodeStep,
    traction: &node::NodeTraction,
    lambda: &[f64],
    out: &mut [f64],
) {
    let (own, columns) = (3 * now.support.len(), 3 * step.support.len());
    let z = now.frame.to_global(&traction.value);
    let at = |node: u32| Vector3::from_column_slice(&lambda[3 * node as usize..][..3]);
    // Σ_s b_js λ_s, and λ_s · z
    let (coefficients, gradients) = now.force_row();
    let relative: Vector3<f64> = now.support.iter().zip(coefficients).map(|(&s, b)| at(s) * *b).sum();
    let works: Vec<f64> = now.support.iter().map(|&s| at(s).dot(&z)).collect();
    let slope = node::traction_slope(now, step, traction);
    let entry = |t: usize| {
        let of_traction: f64 = (0..3).map(|c| relative[c] * slope[c * columns + t]).sum();
        let of_row = |(s, work): (usize, &f64)| gradients[s * own + t] * work;
        of_traction + if t < own { works.iter().enumerate().map(of_row).sum() } else { 0.0 }
    };
    add_row(step, entry, out);
}

/// Adds a row over the step's support.
fn add_row(step: &node::NodeStep, entry: impl Fn(usize) -> f64, out: &mut [f64]) {
    for (t, &node) in step.support.iter().enumerate() {
        (0..3).for_each(|c| out[3 * node as usize + c] += entry(3 * t + c));
    }
}
