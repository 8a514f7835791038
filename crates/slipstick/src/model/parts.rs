//! A model of which each rank has a part: what is evaluated on all of them, and results of the whole on one.

use super::node::NodeStep;
use super::{ContactModel, ContactResults, Share};
use slipstick_path::{StateError, StepProblem, StepState};

impl ContactModel {
    /// Elements and slave nodes that this rank assembles.
    pub fn own_parts(&self) -> [usize; 2] {
        let elements = (0..self.density.len()).filter(|&element| self.share.has_element(element)).count();
        [elements, self.own.iter().filter(|own| **own).count()]
    }

    /// Contact results of all slave nodes at a state; on any rank, without the others.
    ///
    /// # Errors
    /// If the state cannot be evaluated.
    pub fn contact_results(&mut self, previous: &StepState, state: &StepState) -> Result<ContactResults, StateError> {
        if !self.share.is_part() {
            return self.own_contact_results(previous, state);
        }
        let (share, own) = (self.take_share(Share::whole()), self.own.clone());
        self.own.fill(true);
        let results = self.own_contact_results(previous, state);
        self.take_share(share);
        self.own = own;
        results
    }

    /// Contact results of the slave nodes of the share.
    fn own_contact_results(&mut self, previous: &StepState, state: &StepState) -> Result<ContactResults, StateError> {
        // they do not depend on the loads, nor on when
        self.begin_step(previous, self.time, false)?;
        self.at_start = false;
        self.evaluate(&state.unknowns, false)?;
        Ok(self.results_at(&state.unknowns, &self.positions(&state.unknowns)))
    }

    /// Takes up another share, and forgets what was evaluated of the one before.
    fn take_share(&mut self, share: Share) -> Share {
        (self.previous_at, self.kinematics_at, self.evaluated) = (None, None, None);
        self.kinematics.clear();
        self.previous_kinematics.clear();
        self.steps.fill(NodeStep::default());
        self.interfaces.iter_mut().for_each(|i| i.interface.evaluate_only(|node| share.has_node(node)));
        std::mem::replace(&mut self.share, share)
    }

    /// Brings kinematics and slip to the displacements in `y` on all ranks.
    pub(super) fn evaluate_all(&mut self, y: &[f64], with_gradient: bool) -> Result<(), StateError> {
        let result = self.evaluate(y, with_gradient);
        self.agree(result)
    }

    /// What went well on all ranks; where it did not, none keeps what it evaluated.
    pub(super) fn agree<T>(&mut self, here: Result<T, StateError>) -> Result<T, StateError> {
        let all = self.share.agree(here);
        if all.is_err() && self.share.is_part() {
            self.evaluated = None;
        }
        all
    }

    /// Adds the parts of the residual, and tells all statuses.
    pub(super) fn join_residual(&mut self, out: &mut [f64], squares: &mut f64) {
        if self.share.is_part() {
            let status = self.status.iter().zip(&self.own);
            let mut status: Vec<f64> = status.map(|(&s, &own)| if own { f64::from(s) } else { 0.0 }).collect();
            self.share.sum(&mut [&mut self.internal, out, &mut status, std::slice::from_mut(squares)]);
            self.status.iter_mut().zip(status).for_each(|(to, status)| *to = status as u8);
        }
    }
}
