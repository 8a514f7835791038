//! The equations of a load step and their derivatives: [`StepProblem`] for a design.

pub(in crate::equations) mod assembly;
pub(in crate::equations) mod evaluated;
pub mod pattern;
pub(in crate::equations) mod pull_back;

use crate::equations::evaluated::{ContactState, Kinematics, Step, Workspace};
use crate::equations::law::NodeLaw;
use crate::equations::pattern::Coupling;
use crate::equations::terms::TermState;
use crate::equations::{Design, Method, inverted, node};
use slipstick_contact::enforcement::{Freedom, covered};
use slipstick_linalg::BlockMatrix;
use slipstick_path::{
    Adjoint, Attempt, DependentUnknowns, Evaluated, Held, HeldMotions, HoldFreeMotions, Inputs, Iteration, LoadTime,
    Phase, Scales, Span, StateError, StepProblem, StepState, Unknowns, Wanted,
};
use slipstick_solid::SolidStep;
use std::borrow::Cow;
use std::sync::Arc;

/// Nodes whose gap is below this fraction of their facet size get entries in the sparsity pattern
/// before contact.
const NEAR: f64 = 0.1;

/// Prescribed penetrations below this fraction of the facet size are round-off.
const CLOSED: f64 = 1e-6;

impl StepProblem for Design {
    type Geometry = Arc<Kinematics>;
    type Step = Step;
    type State = ContactState;
    type Workspace = Workspace;

    fn unknowns(&self) -> &Unknowns {
        &self.model.unknowns
    }

    fn prescribe(&self, time: LoadTime, y: &mut [f64]) {
        self.model.prescribed.apply(time, y);
    }

    fn load_factors(&self, time: LoadTime) -> Vec<f64> {
        let mut factors = self.model.loads.factors(time);
        factors.extend(self.model.temperatures.factors(time));
        factors.extend(self.model.bolts.factors(time));
        factors.extend(self.model.prescribed.levels(time.t));
        factors
    }

    fn geometry(&self, y: &[f64], wanted: Wanted, workspace: &mut Workspace) -> Result<Arc<Kinematics>, StateError> {
        let begin = workspace.timings.begin();
        let result = self.model.kinematics(&self.model.placed(y), &[], wanted.derivatives(), workspace);
        workspace.timings.end(Phase::Contact, begin);
        self.model.share.agree(result)
    }

    fn begin(
        &self,
        previous: &StepState,
        geometry: &Arc<Kinematics>,
        span: Span,
        workspace: &mut Workspace,
    ) -> Result<Step, StateError> {
        self.model.share.check_same(&previous.unknowns)?;
        workspace.pattern.begin_step();
        let rate = self.model.rate(&previous.unknowns, span);
        let rotations = self.model.dependent.rigid.rotations(&previous.unknowns).collect();
        let kept = self.model.bolts.kept(&previous.unknowns, span);
        let demands = self.model.demands(&previous.unknowns, span);
        Ok(Step { rate, kept, demands, rotations, ..Step::new(&self.model, geometry.clone(), previous, span.end()) })
    }

    /// R, and below it C if the method has multipliers. Paper: (18), (27), (35), (44).
    fn evaluate(
        &self,
        step: &Step,
        y: &[f64],
        geometry: Option<&Arc<Kinematics>>,
        iteration: Iteration,
        wanted: Wanted,
        workspace: &mut Workspace,
    ) -> Result<Evaluated<Self>, StateError> {
        let model = &*self.model;
        let y = &*model.placed(y);
        let split = model.displacement_count();
        let mut internal = Vec::new();
        let mut result = Ok(());
        if wanted.residual() {
            let begin = workspace.timings.begin();
            internal.resize(split, 0.0);
            result = model.solid.internal_force(&y[..split], self.solid_at(step), &mut internal).map_err(inverted);
            let state = TermState { design: self, time: step.time, y, step: None };
            state.add_forces(true, &mut internal);
            workspace.timings.end(Phase::Solid, begin);
        }
        let begin = workspace.timings.begin();
        // rows of the same positions, but with the pressure at the points of another time, if the pairs have one
        let offsets = model.point_offsets(step.time, iteration.at_start);
        let known = geometry
            .filter(|known| known.with_gradient || !wanted.derivatives())
            .filter(|known| offsets.is_empty() || known.offsets == offsets);
        let kinematics = result.and_then(|()| match known {
            Some(known) => Ok(known.clone()),
            None => model.kinematics(y, &offsets, wanted.derivatives(), workspace),
        });
        let contact = kinematics.map(|kinematics| self.contact(step, y, kinematics, iteration, &model.own));
        workspace.timings.end(Phase::Contact, begin);
        let mut contact = model.share.agree(contact)?;
        if step.anchor.is_some() {
            contact.free = model.free_motions(step, y, &contact, true);
        }
        let mut status: Vec<_> = (0..model.slaves.len()).map(|j| contact.status(j)).collect();
        let mut residual = Vec::new();
        let mut squares = 0.0;
        if wanted.residual() {
            residual = self.residual(step, y, &internal, &contact, &mut squares);
            model.dependent.gather(y, &mut residual);
        }
        model.share.join(&mut [&mut internal, &mut residual, std::slice::from_mut(&mut squares)], &mut status);
        let scales = self.scales(step, y, &internal, squares.sqrt());
        contact.internal = internal;
        let (unknowns, geometry) = (y.to_vec(), contact.kinematics.clone());
        Ok(Evaluated { unknowns, residual, scales, active_set: status, geometry, state: contact })
    }

    /// Paper: the matrix of (36), and of (45). Test: `tangent_matches_finite_differences`
    /// (tests/suite/derivatives.rs).
    fn tangent<'w>(
        &self,
        step: &Step,
        at: &Evaluated<Self>,
        workspace: &'w mut Workspace,
    ) -> Result<&'w BlockMatrix, StateError> {
        let model = &*self.model;
        let (split, y) = (model.displacement_count(), &at.unknowns);
        let begin = workspace.timings.begin();
        let supports: Vec<Cow<'_, [u32]>> = at.state.nodes.iter().map(|node| model.support_of(node.as_ref())).collect();
        let couplings = at.state.nodes.iter().enumerate().map(|(j, node)| match node {
            Some(node) => {
                let measures = &node.measures;
                let near = measures.covered() && measures.gap < NEAR * model.slaves[j].size * measures.area;
                Coupling { support: &supports[j], needed: node.law.contributes(), near }
            }
            None => Coupling { support: &[], needed: false, near: false },
        });
        let cliques = model.holding_couplings(&at.state.free);
        let (pattern, grown) = model.pattern.covering(couplings, &cliques, &mut workspace.pattern);
        if grown || workspace.matrix.is_none() {
            workspace.scatter = Some(model.solid.scatter(&pattern));
            workspace.matrix = Some(BlockMatrix::new(pattern));
        }
        workspace.timings.end(Phase::Analysis, begin);
        let begin = workspace.timings.begin();
        let Workspace { scatter, matrix, .. } = workspace;
        let (scatter, matrix) = (scatter.as_ref().expect("made above"), matrix.as_mut().expect("made above"));
        matrix.set_zero();
        let result = model.solid.add_tangent(&y[..split], self.solid_at(step), scatter, matrix).map_err(inverted);
        let state = TermState::of(self, step, y, &at.state.free);
        model.terms().iter().for_each(|term| term.add_tangent(state, matrix));
        workspace.timings.end(Phase::Solid, begin);
        let begin = workspace.timings.begin();
        let matrix = workspace.matrix.as_mut().expect("made above");
        if result.is_ok() {
            assembly::add_tangent(model, &at.state, matrix);
            self.carry_over(step, at, matrix);
        }
        workspace.timings.end(Phase::Contact, begin);
        model.share.agree(result)?;
        Ok(workspace.matrix.as_ref().expect("made above"))
    }

    fn dependent(&self) -> Option<&dyn DependentUnknowns> {
        (!self.model.dependent.is_empty()).then_some(&self.model.dependent)
    }

    fn free_motions(&self) -> Option<&dyn HoldFreeMotions<Self>> {
        self.model.may_move_freely().then_some(self)
    }

    /// A node that faced the other surface and no longer does must not lie far behind that
    /// surface's former position; otherwise it has passed through undetected. We check this with
    /// the previous row at the current positions.
    ///
    /// Nor may prescribed displacements by themselves push a node into the other surface: no
    /// multiplier could push it out again.
    fn finish(&self, step: &Step, at: &Evaluated<Self>) -> Result<Vec<f64>, StateError> {
        let model = &*self.model;
        model.check_held(step, at)?;
        model.dependent.rigid.check_turns(&step.rotations, &at.unknowns, model.prescribed.fixed())?;
        let x = model.contact_positions(&at.unknowns);
        let mut worst: Option<(f64, u32, f64)> = None;
        let mut pushed: Option<(f64, u32)> = None;
        for (j, now, node) in at.state.nodes_here() {
            let (before, slave, measures) = (&step.previous.nodes[j], &model.slaves[j], &node.measures);
            let pair = model.pair(slave);
            let reach = pair.interface.reach();
            let lost = !measures.covered() && node.step.active && !pair.is_bonded();
            if lost && covered(before.area, slave.area) {
                let depth = node.step.offset - before.gap_at(&x) / before.area;
                if depth > reach && worst.is_none_or(|(deepest, ..)| depth > deepest) {
                    worst = Some((depth, before.node, reach));
                }
            }
            let depth = -measures.gap / measures.area;
            let prescribed = measures.covered() && measures.freedom == Freedom::None && depth > CLOSED * slave.size;
            if prescribed && pushed.is_none_or(|(deepest, _)| depth > deepest) {
                pushed = Some((depth, now.node));
            }
        }
        model.share.agree(match (worst, pushed) {
            (Some((depth, node, reach)), _) => Err(StateError::PassedThrough { node, depth, reach }),
            (None, Some((depth, node))) => Err(StateError::PrescribedPenetration { node, depth }),
            (None, None) => Ok(()),
        })?;
        let mut history = vec![0.0; model.unknowns.history];
        if !history.is_empty() {
            for (j, _, node) in at.state.nodes_here().filter(|(j, ..)| model.method_of(*j) == Method::Penalty) {
                history[2 * j..][..2].copy_from_slice(&node.law.value().as_slice()[1..]);
            }
            let split = model.displacement_count();
            let solid = &mut history[model.history.solid.clone()];
            let result = model.solid.update_history(&at.unknowns[..split], self.solid_at(step), solid);
            model.share.agree(result.map_err(inverted))?;
            model.share.sum(&mut [&mut history]);
        }
        Ok(history)
    }

    fn pull_back(
        &self,
        step: &Step,
        at: &Evaluated<Self>,
        adjoint: &Adjoint<'_>,
        into: &mut Inputs,
    ) -> Result<(), StateError> {
        if !into.unknowns.is_empty() {
            self.pull_back_current(step, at, adjoint.eta, &mut into.unknowns)?;
        }
        if !into.previous.is_empty() {
            self.pull_back_previous(step, at, adjoint, into);
        }
        if !into.density.is_empty() {
            self.pull_back_design(step, at, adjoint, &mut into.density)?;
        }
        if !into.parameters.is_empty() {
            self.pull_back_parameters(step, at, adjoint, &mut into.parameters)?;
        }
        if !into.position.is_empty() {
            self.pull_back_positions(step, at, adjoint, &mut into.position)?;
        }
        Ok(())
    }

    fn method(&self, attempt: Attempt) -> Option<slipstick_path::Method> {
        self.solution(attempt)
    }

    fn update_multipliers(&self, step: &Step, at: &Evaluated<Self>) -> Result<(Vec<f64>, f64), StateError> {
        let model = &*self.model;
        let settings = &at.state.settings;
        let rescue = settings.held() == Held::All;
        let absolute = !rescue && model.uzawa.is_some_and(|uzawa| uzawa.absolute);
        let split = model.displacement_count();
        let mut y = at.unknowns.clone();
        if model.share.is_part() {
            // the sum provides the multipliers of the other ranks
            (0..model.slaves.len()).filter(|&j| !model.own[j]).for_each(|j| y[split + 3 * j..][..3].fill(0.0));
        }
        let mut change: f64 = 0.0;
        let mut largest = model.floors.multiplier / (model.slaves.len() as f64).sqrt();
        for (j, _, node) in at.state.nodes_here() {
            // the augmented Lagrangian's multipliers are compared even after a solve that held none
            if model.method_of(j) != Method::Augmented && !self.is_held(j, settings.held()) {
                continue;
            }
            let before = model.multiplier(&at.unknowns, j);
            let now = self.regularised(step, j, &node.measures, before, settings).value;
            // normal and tangential conditions are checked separately
            let mut difference = (now[0] - before[0]).abs().max((now[1] - before[1]).hypot(now[2] - before[2]));
            if absolute {
                let epsilon = self.augmentation(j, settings);
                let divisor = epsilon.scaling.divisor(&node.measures);
                difference *= divisor / epsilon.normal.min(epsilon.tangential);
            }
            change = change.max(difference);
            largest = largest.max(now.norm());
            y[split + 3 * j..][..3].copy_from_slice(now.as_slice());
        }
        model.share.sum(&mut [&mut y[split..]]);
        let (change, largest) = (model.share.largest(change), model.share.largest(largest));
        Ok((y, if absolute { change } else { change / largest }))
    }
}

impl HoldFreeMotions<Self> for Design {
    fn hold(&self, step: &mut Step, previous: &StepState, hold: bool) {
        step.anchor = hold.then(|| previous.unknowns[..self.model.displacement_count()].to_vec());
    }

    fn are_free(&self, step: &Step, at: &Evaluated<Self>, nearly: bool) -> bool {
        self.model.free_motions(step, &at.unknowns, &at.state, nearly).basis.is_some()
    }

    fn approach(&self, step: &Step, y: &[f64], workspace: &mut Workspace) -> Result<Option<Vec<f64>>, StateError> {
        self.approached(step, y, workspace)
    }

    fn left_free(&self, step: &Step, at: &Evaluated<Self>) -> HeldMotions {
        let model = &self.model;
        let free = model.motions_left_free(&at.state);
        HeldMotions { free, share: model.holding_share(step, at), work: model.holding_work(step, at) }
    }
}

impl Design {
    /// What the solids depend on in a step.
    pub(in crate::equations) fn solid_at<'a>(&'a self, step: &'a Step) -> SolidStep<'a> {
        self.solid_step(step.solid_history(&self.model), &step.stretches)
    }

    /// What the solids depend on in a step that starts with this history, or at a state, with the stretches
    /// of thermal expansion.
    pub(in crate::equations) fn solid_step<'a>(&'a self, history: &'a [f64], stretches: &'a [f64]) -> SolidStep<'a> {
        SolidStep { scalings: &self.scalings, history, stretches }
    }

    /// Carries the tangent over to the unknowns on which others depend: those of equations and rigid
    /// bodies, on whose nodes contact and other forces act.
    fn carry_over(&self, step: &Step, at: &Evaluated<Self>, matrix: &mut BlockMatrix) {
        let model = &*self.model;
        if model.dependent.rigid.is_empty() {
            return model.dependent.linear.carry_over(matrix);
        }
        let mut forces = vec![0.0; model.displacement_count()];
        let state = TermState::of(self, step, &at.unknowns, &at.state.free);
        model.terms().iter().for_each(|term| term.add_force(state, &mut forces));
        model.add_from_contact(&mut forces, |out| {
            at.state.nodes_here().for_each(|(_, now, node)| node::add_force(now, &node.law.value(), out));
        });
        model.dependent.carry_over(&at.unknowns, &forces, matrix);
    }

    /// This rank's part of F, and the sum of squares of its tractions.
    fn residual(
        &self,
        step: &Step,
        y: &[f64],
        internal: &[f64],
        contact: &ContactState,
        squares: &mut f64,
    ) -> Vec<f64> {
        let model = &*self.model;
        let split = internal.len();
        let mut out = internal.to_vec();
        TermState::of(self, step, y, &contact.free).add_forces(false, &mut out);
        out.resize(model.unknowns.count(), 0.0);
        for (j, _, node) in contact.nodes_here() {
            let value = node.law.value();
            *squares += value.norm_squared();
            if let NodeLaw::Multiplier { equation, .. } = &node.law {
                out[split + 3 * j..][..3].copy_from_slice(equation.value.as_slice());
            }
        }
        model.add_from_contact(&mut out[..split], |out| {
            contact.nodes_here().for_each(|(_, now, node)| node::add_force(now, &node.law.value(), out));
        });
        out
    }

    /// Sizes of forces, displacements, tractions and positions at `y`.
    fn scales(&self, step: &Step, y: &[f64], internal: &[f64], traction: f64) -> Scales {
        let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let floors = &self.model.floors;
        let position = norm(&self.model.positions(y));
        Scales {
            force: norm(internal).max(floors.force),
            displacement: self.model.distance_from_rest(y).max(floors.displacement),
            multiplier: traction.max(floors.multiplier),
            position,
            rigidity: floors.stiffness * position
                + self.model.bolts().rigidity(y)
                + self.model.temporary_rigidity(step, y),
        }
    }
}
