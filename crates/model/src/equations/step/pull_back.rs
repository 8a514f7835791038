//! Derivatives of a step's equations and history with respect to its inputs, for the adjoint.

use crate::equations::evaluated::Step;
use crate::equations::law::LawWeights;
use crate::equations::terms::TermState;
use crate::equations::{Design, Method, inverted, node};
use nalgebra::Vector3;
use slipstick_contact::kinematics::NodeKinematics;
use slipstick_path::{Adjoint, Evaluated, Inputs, StateError};
use slipstick_solid::SolidAdjoint;

impl Design {
    /// Adds (∂G/∂y)ᵀ η.
    pub(in crate::equations) fn pull_back_current(
        &self,
        step: &Step,
        at: &Evaluated<Self>,
        eta: &[f64],
        out: &mut [f64],
    ) -> Result<(), StateError> {
        let (model, split) = (&*self.model, self.model.displacement_count());
        self.model.share.add(out, |out| {
            if model.has_memory() {
                let (d, solid) = (&at.unknowns[..split], self.solid_at(step));
                let eta = &eta[model.history.solid.clone()];
                model.solid.pull_back_current(d, solid, eta, &mut out[..split]).map_err(inverted)?;
            }
            self.model.add_from_contact(out, |out| {
                for (j, now, node) in
                    at.state.nodes_here().filter(|(j, ..)| self.model.method_of(*j) == Method::Penalty)
                {
                    let weight = Vector3::new(0.0, eta[2 * j], eta[2 * j + 1]);
                    node::add_traction_pull_back(now, &node.step, &node.law.traction(), &weight, out);
                }
            });
            Ok(())
        })
    }

    /// The previous state enters through its mortar row in ũ_τ, (66), at nodes that this row hardly
    /// covers also through its positions, and through the history of the penalty method.
    ///
    /// * Multipliers: R and the normal rows of C do not depend on it (62), (63), (67), (85); stick
    ///   and slip rows do (64), (65). The same holds for the augmented Lagrangian, whose equations
    ///   at convergence are identical.
    /// * Penalty: R depends on it through the tangential traction (71), (72), in stick (73), (74)
    ///   and in slip (75)–(77). The paper propagates ∂t_τ/∂d in (74); here the history has its own
    ///   adjoint η instead.
    ///
    /// Paper: (62)–(67), (71)–(77), (85). Test: `every_input_is_pulled_back`
    /// (tests/suite/inputs.rs).
    pub(in crate::equations) fn pull_back_previous(
        &self,
        step: &Step,
        at: &Evaluated<Self>,
        &Adjoint { lambda, eta, .. }: &Adjoint<'_>,
        into: &mut Inputs,
    ) {
        let model = &*self.model;
        let (previous, history) = (vec![0.0; into.previous.len()], vec![0.0; into.history.len()]);
        let mut out = Inputs { previous, history, ..Inputs::default() };
        let x = model.contact_positions(&at.unknowns);
        let mapped = model.contact_vector(lambda);
        for (j, now, node) in at.state.nodes_here() {
            let weights = self.law_weights(j, now, &node.law, &mapped, &eta[model.history.contact.clone()]);
            self.pull_back_law_previous(step, j, now, &x, &weights, &mut out);
        }
        model.pull_to_nodes(&mut out.previous);
        let state = TermState::of(self, step, &at.unknowns, &at.state.free);
        model.terms().iter().for_each(|term| term.pull_back_previous(state, lambda, &mut out.previous));
        if model.has_memory() {
            let (split, solid) = (model.displacement_count(), model.history.solid.clone());
            let adjoint = SolidAdjoint { forces: &lambda[..split], history: &eta[solid.clone()] };
            let before = self.solid_at(step);
            let result =
                model.solid.pull_back_previous(&at.unknowns[..split], before, adjoint, &mut out.history[solid]);
            result.expect("the state has been evaluated with these displacements");
        }
        model.share.sum(&mut [&mut out.previous, &mut out.history]);
        add(&mut into.previous, &out.previous);
        add(&mut into.history, &out.history);
    }

    /// The density enters only through the internal force, the history of elements with memory and the loads on
    /// mass: neither contact nor C depends on it.
    ///
    /// Paper: (88)–(90). Test: `every_input_is_pulled_back`
    /// (tests/suite/inputs.rs).
    pub(in crate::equations) fn pull_back_design(
        &self,
        step: &Step,
        at: &Evaluated<Self>,
        &Adjoint { lambda, eta, .. }: &Adjoint<'_>,
        out: &mut [f64],
    ) -> Result<(), StateError> {
        let (model, split) = (&*self.model, self.model.displacement_count());
        let (d, solid) = (&at.unknowns[..split], self.solid_at(step));
        self.pull_back_own_density(d, solid, &lambda[..split], out)?;
        let state = TermState::of(self, step, d, &at.state.free);
        model.terms().iter().for_each(|term| term.pull_back_density(state, &lambda[..split], out));
        if !model.has_memory() {
            return Ok(());
        }
        let eta = &eta[model.history.solid.clone()];
        let slopes = self.scaling_slopes();
        model.share.add(out, |out| model.solid.pull_back_history_density(d, solid, slopes, eta, out).map_err(inverted))
    }

    /// Adds (∂F/∂p)ᵀ λ + (∂G/∂p)ᵀ η + (∂ŷ/∂p)ᵀ μ.
    pub(in crate::equations) fn pull_back_parameters(
        &self,
        step: &Step,
        at: &Evaluated<Self>,
        adjoint: &Adjoint<'_>,
        out: &mut [f64],
    ) -> Result<(), StateError> {
        let &Adjoint { lambda, eta, mu } = adjoint;
        let split = self.model.displacement_count();
        let d = &at.unknowns[..split];
        self.model.share.add(out, |out| {
            self.pull_back_contact(step, &at.state, lambda, eta, out);
            self.pull_back_own_solid_parameters((d, step.time), self.solid_at(step), lambda, eta, out)
        })?;
        self.model.pull_back_bolts(step, d, |bolt| lambda[bolt.unknown as usize], out);
        self.model.pull_back_supports(step, d, |support| lambda[support.unknown as usize], out);
        self.pull_back_amplitudes(d, step.time, &lambda[..split], mu, out);
        Ok(())
    }

    /// Adds the derivatives through slip and history of node j with respect to the previous state.
    pub(in crate::equations) fn pull_back_law_previous(
        &self,
        step: &Step,
        j: usize,
        now: &NodeKinematics,
        x: &[f64],
        &LawWeights { by_slip, by_history, .. }: &LawWeights,
        out: &mut Inputs,
    ) {
        if let Some(by_history) = by_history {
            out.history[2 * j..][..2].iter_mut().zip(&by_history).for_each(|(to, from)| *to += from);
        }
        // the rows of a bond do not depend on a state
        let bonded = self.model.pair(&self.model.slaves[j]).is_bonded();
        if (by_slip[0] != 0.0 || by_slip[1] != 0.0) && !bonded {
            let before = &step.previous.nodes[j];
            now.add_previous_slip_gradient(before, &step.rows[j], [x, &step.positions], by_slip, &mut out.previous);
        }
    }
}

fn add(to: &mut [f64], from: &[f64]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to += from);
}
