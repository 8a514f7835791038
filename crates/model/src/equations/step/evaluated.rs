//! The fixed data of a load step, and the contact data of an evaluation of its equations.

use crate::equations::law::{IterationSettings, LawWeights, NUDGE, NodeLaw};
use crate::equations::loose::FreeMotions;
use crate::equations::node::{self, NodeStep};
use crate::equations::{ContactModel, Design, ModelInterface, SlaveData};
use nalgebra::Vector3;
use rayon::prelude::*;
use slipstick_contact::enforcement::NodeMeasures;
use slipstick_contact::enforcement::soft::Weight;
use slipstick_contact::kinematics::{NodeKinematics, PreviousRow};
use slipstick_contact::{ContactStatus, InterfaceError, InterfaceWorkspace};
use slipstick_linalg::BlockMatrix;
use slipstick_path::{Evaluated, Iteration, LoadTime, StateError, StepState, Timings};
use slipstick_solid::model::Scatter;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use crate::equations::pattern::PatternInUse;
use crate::equations::supports::Demand;
use crate::equations::viscosity::Rate;

/// Mortar rows and frames of all slave nodes at some positions.
#[derive(Debug, Default)]
pub struct Kinematics {
    /// In the order of [`ContactModel::slave_nodes`]; empty for nodes of other ranks.
    pub nodes: Vec<NodeKinematics>,
    /// Whether gradients were computed.
    pub with_gradient: bool,
    /// The offsets at which pressures at the integration points were computed, `ContactModel::point_offsets`.
    pub offsets: Vec<f64>,
}

impl Kinematics {
    /// Memory of all rows. \[bytes\]
    pub fn bytes(&self) -> usize {
        self.nodes.iter().map(NodeKinematics::bytes).sum()
    }
}

/// What has been computed before of a state and the one before it.
#[derive(Debug, Default)]
pub(crate) struct Known<'a> {
    /// Kinematics of the state before.
    pub previous: Option<Arc<Kinematics>>,
    /// Kinematics of the state.
    pub now: Option<Arc<Kinematics>>,
    /// f_int of the state. \[F\]
    pub internal: Option<&'a [f64]>,
}

impl<'a> Known<'a> {
    /// With the march's evaluation of the state, if that is at hand.
    pub fn of(previous: Option<Arc<Kinematics>>, now: Option<&'a Evaluated<Design>>) -> Self {
        let internal = now.map(|now| &now.state.internal[..]).filter(|internal| !internal.is_empty());
        Self { previous, now: now.map(|now| now.state.kinematics.clone()), internal }
    }
}

/// The fixed data of a load step.
#[derive(Debug)]
pub struct Step {
    /// Kinematics of the previous state.
    pub(in crate::equations) previous: Arc<Kinematics>,
    /// Mortar rows of the previous state.
    pub(in crate::equations) rows: Vec<PreviousRow>,
    /// Positions of the points of the contact surfaces in the previous state. \[L\]
    pub(in crate::equations) positions: Vec<f64>,
    /// History of the previous state.
    pub(in crate::equations) history: Vec<f64>,
    /// When it ends, and the stretches of thermal expansion there.
    pub(in crate::equations) time: LoadTime,
    pub(in crate::equations) stretches: Vec<f64>,
    /// What the viscous forces are measured from.
    pub(in crate::equations) rate: Rate,
    /// The distance that each bolt keeps; `None` for those that are tightened. \[L\]
    pub(in crate::equations) kept: Vec<Option<f64>>,
    /// What supports that begin or end demand.
    pub(in crate::equations) demands: Vec<Demand>,
    /// Rotation vectors of the rigid bodies before the step. \[rad\]
    pub(in crate::equations) rotations: Vec<Vector3<f64>>,
    /// Displacements before the step, if it holds free motions.
    pub(in crate::equations) anchor: Option<Vec<f64>>,
}

impl Step {
    pub(in crate::equations) fn new(
        model: &ContactModel,
        previous: Arc<Kinematics>,
        state: &StepState,
        time: LoadTime,
    ) -> Self {
        // bonded surfaces do not slip from step to step: their displacements are measured from rest
        let of = |(now, slave): (&NodeKinematics, &SlaveData)| match model.pair(slave).is_bonded() {
            true => PreviousRow::default(),
            false => PreviousRow::of(now, slave.area),
        };
        let rows = previous.nodes.iter().zip(&model.slaves).map(of).collect();
        Self {
            previous,
            rows,
            positions: model.contact_positions(&state.unknowns),
            history: state.history.clone(),
            time,
            stretches: model.stretches(time),
            rate: Rate::default(),
            kept: Vec::new(),
            demands: Vec::new(),
            rotations: Vec::new(),
            anchor: None,
        }
    }

    /// Kinematics of the state before the step.
    pub(crate) fn previous(&self) -> &Arc<Kinematics> {
        &self.previous
    }

    /// History of the elements with memory at the start of the step.
    pub(in crate::equations) fn solid_history(&self, model: &ContactModel) -> &[f64] {
        &self.history[model.history.solid.clone()]
    }

    /// Tangential traction of the penalty method at node j, at the end of the previous step.
    pub(in crate::equations) fn previous_traction(&self, j: usize) -> Vector3<f64> {
        Vector3::new(0.0, self.history[2 * j], self.history[2 * j + 1])
    }
}

/// A slave node at a state: measures against the previous step, and its law.
#[derive(Debug)]
pub struct NodeState {
    pub(in crate::equations) step: NodeStep,
    pub(in crate::equations) measures: NodeMeasures,
    pub(in crate::equations) law: NodeLaw,
}

/// The contact at a state, and the internal force there.
#[derive(Debug)]
pub struct ContactState {
    /// f_int, if the residual was wanted; otherwise empty. \[F\]
    pub(in crate::equations) internal: Vec<f64>,
    pub(in crate::equations) kinematics: Arc<Kinematics>,
    /// Slave nodes, in the order of [`ContactModel::slave_nodes`]; `None` for those of other ranks.
    pub(in crate::equations) nodes: Vec<Option<NodeState>>,
    pub(in crate::equations) settings: IterationSettings,
    /// The free motions, if the step holds them.
    pub(in crate::equations) free: FreeMotions,
}

impl ContactState {
    pub(crate) fn kinematics(&self) -> &Arc<Kinematics> {
        &self.kinematics
    }

    /// Slave nodes of this rank: number, kinematics, state.
    pub(in crate::equations) fn nodes_here(&self) -> impl Iterator<Item = (usize, &NodeKinematics, &NodeState)> {
        let nodes = self.nodes.iter().zip(&self.kinematics.nodes).enumerate();
        nodes.filter_map(|(j, (node, now))| node.as_ref().map(|node| (j, now, node)))
    }

    /// Measures of slave node j; `None` for nodes of other ranks.
    pub fn measures(&self, j: usize) -> Option<&NodeMeasures> {
        self.nodes.get(j)?.as_ref().map(|node| &node.measures)
    }

    /// Status of slave node j; open for nodes of other ranks.
    pub fn status(&self, j: usize) -> ContactStatus {
        self.nodes.get(j).and_then(Option::as_ref).map_or(ContactStatus::Inactive, |node| node.law.status())
    }

    /// The master nodes opposite to slave node j.
    pub fn opposite(&self, j: usize) -> &[u32] {
        self.kinematics.nodes.get(j).map_or(&[], |now| &now.support[now.ring..])
    }

    /// Direction of a multiplier component of slave node j.
    pub fn direction(&self, j: usize, component: usize) -> Option<[f64; 3]> {
        self.kinematics.nodes.get(j).map(|now| now.frame.vector(component).into())
    }
}

/// Buffers that evaluations reuse. No result depends on their contents.
#[derive(Default)]
pub struct Workspace {
    interfaces: Vec<InterfaceWorkspace>,
    /// Previously used kinematics. The memory of those with no other owner is reused.
    kinematics: Vec<Arc<Kinematics>>,
    pub(in crate::equations) pattern: PatternInUse,
    pub(in crate::equations) scatter: Option<Scatter>,
    pub(in crate::equations) matrix: Option<BlockMatrix>,
    /// Time spent on solids and contact, if it is measured.
    pub timings: Timings,
}

impl std::fmt::Debug for Workspace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Workspace").field("interfaces", &self.interfaces.len()).finish_non_exhaustive()
    }
}

impl Workspace {
    /// Forgets the sparsity pattern, so that a march does not depend on earlier solves.
    pub fn forget(&mut self) {
        (self.pattern, self.scatter, self.matrix) = (PatternInUse::default(), None, None);
    }

    /// Empty buffers, with the same clock.
    pub(crate) fn another(&self) -> Self {
        Self { timings: self.timings.restarted(), ..Self::default() }
    }

    /// Kinematics to overwrite.
    fn spare(&mut self) -> Arc<Kinematics> {
        let free = self.kinematics.iter_mut().position(|kept| Arc::get_mut(kept).is_some());
        free.map_or_else(Arc::default, |free| self.kinematics.swap_remove(free))
    }
}

impl ContactModel {
    /// Mortar rows and frames of the slave nodes of this rank at displacements `d`.
    pub(in crate::equations) fn kinematics(
        &self,
        d: &[f64],
        offsets: &[f64],
        with_gradient: bool,
        workspace: &mut Workspace,
    ) -> Result<Arc<Kinematics>, StateError> {
        if workspace.interfaces.len() != self.interfaces.len() {
            let of = |model: &ModelInterface| model.interface.workspace(|node| self.share.has_node(node));
            workspace.interfaces = self.interfaces.iter().map(of).collect();
        }
        let mut spare = workspace.spare();
        let out = Arc::get_mut(&mut spare).expect("nobody else holds it");
        let result = self.kinematics_of(d, offsets, with_gradient, &mut workspace.interfaces, out);
        workspace.kinematics.push(spare.clone());
        result.map(|()| spare)
    }

    /// For each slave node, the distance by which the surfaces touch before their meshes do, where a pair has a
    /// pressure at its integration points; empty if none has. At the start of a step, all gaps are slightly smaller,
    /// so that surfaces that touch have a stiffness.
    pub(in crate::equations) fn point_offsets(&self, time: LoadTime, at_start: bool) -> Vec<f64> {
        if !self.interfaces.iter().any(|pair| pair.at_points) {
            return Vec::new();
        }
        let nudge = if at_start { NUDGE } else { 0.0 };
        // the interface itself knows the initial gaps that count as closed
        let of = |slave: &SlaveData| self.pair(slave).offset_at(time) * slave.slant + nudge * slave.size;
        self.slaves.iter().map(of).collect()
    }

    /// Distance by which the surfaces touch before their meshes do at a slave node, with the initial gap that
    /// counts as closed. \[L\]
    fn offset_of(&self, slave: &SlaveData, time: LoadTime) -> f64 {
        self.pair(slave).offset_at(time) * slave.slant + slave.adjusted
    }

    fn kinematics_of(
        &self,
        d: &[f64],
        offsets: &[f64],
        with_gradient: bool,
        workspaces: &mut [InterfaceWorkspace],
        out: &mut Kinematics,
    ) -> Result<(), StateError> {
        self.kinematics.fetch_add(1, Ordering::Relaxed);
        out.with_gradient = with_gradient;
        out.offsets.clear();
        out.offsets.extend_from_slice(offsets);
        let mut offsets = offsets;
        let (x, d) = (&self.contact_positions(d), &self.contact_vector(d));
        // each interface fills its part of the nodes and reuses their memory
        let mut rest = std::mem::take(&mut out.nodes);
        for (model, workspace) in self.interfaces.iter().zip(workspaces) {
            let count = model.interface.slave_nodes().len();
            let later = rest.split_off(count.min(rest.len()));
            let (own_offsets, later_offsets) = offsets.split_at(count.min(offsets.len()));
            offsets = later_offsets;
            if let Some(bond) = &model.bond {
                rest = bond.iter().map(|row| row.bonded(d)).collect();
                out.nodes.append(&mut rest);
                rest = later;
                continue;
            }
            let pressure =
                model.point_law().filter(|_| !own_offsets.is_empty()).map(|law| (Weight::Pressure(law), own_offsets));
            let evaluated = model.interface.evaluate_pressed(x, with_gradient, pressure, workspace, &mut rest);
            evaluated.map_err(|e| match e {
                InterfaceError::Folded { node } => StateError::FoldedSurface { node },
                InterfaceError::FoldedFacet { nodes } => StateError::FoldedFacet { nodes: nodes.to_vec() },
                other => unreachable!("interface was built: {other}"),
            })?;
            out.nodes.append(&mut rest);
            rest = later;
        }
        Ok(())
    }
}

impl Design {
    /// The contact at `y` in a step, with known kinematics: each node's law is evaluated once,
    /// here.
    pub(in crate::equations) fn contact(
        &self,
        step: &Step,
        y: &[f64],
        kinematics: Arc<Kinematics>,
        iteration: Iteration,
        own: &[bool],
    ) -> ContactState {
        let model = &*self.model;
        let (x, fixed) = (model.contact_positions(y), model.contact_fixed());
        let settings = self.iteration_settings(iteration);
        let of = |(j, (now, previous)): (usize, (&NodeKinematics, &PreviousRow))| {
            own[j].then(|| {
                let slave = &model.slaves[j];
                let pair = model.pair(slave);
                let mut at = NodeStep::of(pair.is_active(step.time), model.offset_of(slave, step.time));
                at.evaluate(now, previous, [&x, &step.positions], fixed, kinematics.with_gradient);
                let measures = at.measures(now, &model.start.settings[j]);
                let law = self.law(step, j, &measures, y, &settings);
                NodeState { step: at, measures, law }
            })
        };
        let nodes = kinematics.nodes.par_iter().zip(&step.rows).enumerate().map(of).collect();
        ContactState { internal: Vec::new(), kinematics, nodes, settings, free: FreeMotions::default() }
    }

    /// The contact of all slave nodes at unknowns `y` after a previous state; any rank may call it
    /// without the others. `time`: that of `y`; `at_start`: it is the start of a step.
    ///
    /// # Errors
    /// If one of the two states cannot be evaluated.
    pub fn contact_at(
        &self,
        previous: &StepState,
        y: &[f64],
        time: LoadTime,
        at_start: bool,
    ) -> Result<ContactState, StateError> {
        self.contact_with(previous, y, (time, at_start), Known::default())
    }

    /// As [`contact_at`](Self::contact_at), with the kinematics that are known.
    pub(crate) fn contact_with(
        &self,
        previous: &StepState,
        y: &[f64],
        (time, at_start): (LoadTime, bool),
        known: Known<'_>,
    ) -> Result<ContactState, StateError> {
        let model = &*self.model;
        let mut workspaces: Vec<_> = model.interfaces.iter().map(|i| i.interface.workspace(|_| true)).collect();
        let offsets = model.point_offsets(time, at_start);
        let mut at = |known: Option<Arc<Kinematics>>, y: &[f64], offsets: &[f64]| {
            // those of a march on several ranks lack the nodes of the other ranks
            let fits = |known: &Arc<Kinematics>| offsets.is_empty() || known.offsets == offsets;
            if let Some(known) = known.filter(|known| !model.share.is_part() && fits(known)) {
                return Ok(known);
            }
            let mut out = Kinematics::default();
            model
                .kinematics_of(&y[..model.displacement_count()], offsets, false, &mut workspaces, &mut out)
                .map(|()| Arc::new(out))
        };
        let before = at(known.previous, &previous.unknowns, &[])?;
        let same = previous.unknowns == y && offsets.is_empty();
        let now = if same { before.clone() } else { at(known.now, y, &offsets)? };
        let step = Step::new(model, before, previous, time);
        let iteration = Iteration { at_start, ..Iteration::default() };
        Ok(self.contact(&step, y, now, iteration, &vec![true; model.slaves.len()]))
    }

    /// How λᵀF + ηᵀG depends on slip, friction and history of node j; `lambda` is
    /// [mapped](ContactModel::contact_vector).
    pub(in crate::equations) fn law_weights(
        &self,
        j: usize,
        now: &NodeKinematics,
        law: &NodeLaw,
        lambda: &[f64],
        eta: &[f64],
    ) -> LawWeights {
        match law {
            NodeLaw::Multiplier { .. } => LawWeights::of(law, self.model.multiplier(lambda, j), Vector3::zeros()),
            NodeLaw::Regularised(_) => {
                let mut weight = node::relative_adjoint(now, lambda);
                weight[1] += eta[2 * j];
                weight[2] += eta[2 * j + 1];
                LawWeights::of(law, Vector3::zeros(), weight)
            }
        }
    }
}
