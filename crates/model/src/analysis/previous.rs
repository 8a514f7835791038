//! What quantities see of the state before.

use std::sync::Arc;

use slipstick_design::quantity::Reads;
use slipstick_linalg::Ranks;
use slipstick_path::{LoadTime, Path, StateError, StepState};

use super::chain::StateData;
use crate::equations::{Design, Kinematics, Known};

/// What quantities can see of the state at the start of a (sub-)step.
#[derive(Default)]
pub(crate) struct PreviousData {
    pub(super) time: LoadTime,
    /// Whether nothing has happened there: no deformation, no contact.
    pub(super) rest: bool,
    pub(super) displacement: Vec<f64>,
    pub(super) external: Vec<f64>,
    pub(super) reaction: Vec<f64>,
    /// Of the slave nodes, zero at open ones and at rest.
    pub(super) multiplier: Vec<[f64; 3]>,
    /// Of contact, if they were computed.
    pub(crate) kinematics: Option<Arc<Kinematics>>,
}

impl PreviousData {
    /// At the state of a path with this index. All ranks call it and receive the same.
    pub(super) fn of(design: &Design, path: &Path, index: usize, ranks: &dyn Ranks) -> Result<Self, StateError> {
        let (at, state) = (&path.states[index], path.state(index, ranks));
        if at.rest {
            return Ok(Self::at_rest(design, at.time, &state));
        }
        let reads = Reads { reaction: true, contact: true, ..Reads::default() };
        let known = Known::default();
        Ok(StateData::of(design, reads, at.time, (&path.state(index - 1, ranks), &state), known)?.into_previous(&state))
    }

    /// At a state of rest, where the reactions balance the loads on prescribed unknowns.
    pub(crate) fn at_rest(design: &Design, time: LoadTime, state: &StepState) -> Self {
        let model = design.model();
        let none = vec![0.0; model.prescribed().fixed().len()];
        let displacement = state.unknowns[..none.len()].to_vec();
        let mut external = none.clone();
        design.external_force(&displacement, time, &mut external);
        let reaction = model.reactions(time.t, &none, &external, &none);
        let multiplier = vec![[0.0; 3]; model.slave_areas().count()];
        Self { time, rest: true, displacement, external, reaction, multiplier, kinematics: None }
    }

    /// With the kinematics of contact.
    pub(crate) fn with(self, kinematics: Option<Arc<Kinematics>>) -> Self {
        Self { kinematics, ..self }
    }
}
