//! The equations of a load step and their derivatives: [`StepProblem`] for the contact model.

use super::enforcement::UPDATE_STIFFNESS;
use super::law::LawWeights;
use super::pattern::Coupling;
use super::{ContactModel, Method, inverted, node};
use nalgebra::Vector3;
use rayon::prelude::*;
use slipstick_contact::enforcement::{Freedom, covered};
use slipstick_contact::kinematics::PreviousRow;
use slipstick_linalg::BlockMatrix;
use slipstick_path::{Held, Phase, PreviousPullBack, Scales, StateError, StepProblem, StepState, UzawaOptions};

/// ε and c over the bodies' own stiffness in the attempts to rescue a step of the Lagrange method.
const RESCUE_FACTORS: [f64; 3] = [UPDATE_STIFFNESS, 0.1 * UPDATE_STIFFNESS, 10.0 * UPDATE_STIFFNESS];

/// Uzawa's iteration that rescues a step of the Lagrange method.
const RESCUE: UzawaOptions = UzawaOptions { tolerance: 1e-8, max_iterations: 64, memory: 8 };

/// Nodes whose gap is below this fraction of their facet size have a place in the pattern before they touch.
const NEAR: f64 = 0.1;

/// Prescribed penetrations below this part of the facet size are rounding.
const CLOSED: f64 = 1e-6;

impl ContactModel {
    /// Brings kinematics and slip to the displacements in `y`; nothing is done where they are there already.
    pub(super) fn evaluate(&mut self, y: &[f64], with_gradient: bool) -> Result<(), StateError> {
        let d = &y[..self.displacement_count()];
        if fits(&self.evaluated, d, with_gradient) {
            return Ok(());
        }
        self.evaluated = None;
        let begin = self.timings.begin();
        let x = self.positions(y);
        if !fits(&self.kinematics_at, d, with_gradient) {
            self.kinematics_at = None;
            Self::kinematics_of(&mut self.interfaces, &x, with_gradient, &mut self.kinematics)?;
            self.kinematics_at = Some((d.to_vec(), with_gradient));
        }
        let fixed = self.prescribed.fixed();
        self.steps
            .par_iter_mut()
            .zip(&self.kinematics)
            .zip(&self.previous_rows)
            .zip(&self.own)
            .filter(|(_, own)| **own)
            .for_each(|(((step, now), previous), _)| step.evaluate(now, previous, &x, fixed, with_gradient));
        self.timings.end(Phase::Contact, begin);
        self.evaluated = Some((d.to_vec(), with_gradient));
        self.starting = self.at_start && self.start.as_deref() == Some(d);
        Ok(())
    }

    /// Previous rows and kinematics at displacements `d`.
    fn evaluate_previous(&mut self, d: &[f64], for_adjoint: bool) -> Result<(), StateError> {
        // the march was at this state last; the sweep comes to the state that it left to, and keeps it for `evaluate`
        if !fits(&self.previous_at, d, for_adjoint) {
            std::mem::swap(&mut self.kinematics, &mut self.previous_kinematics);
            std::mem::swap(&mut self.kinematics_at, &mut self.previous_at);
        }
        if !fits(&self.previous_at, d, for_adjoint) {
            self.previous_at = None;
            let x = self.positions(d);
            Self::kinematics_of(&mut self.interfaces, &x, for_adjoint, &mut self.previous_kinematics)?;
            self.previous_at = Some((d.to_vec(), for_adjoint));
        }
        self.previous_rows = self.previous_kinematics.iter().map(PreviousRow::from).collect();
        Ok(())
    }
}

/// Whether kinematics at a place serve for displacements `d`.
fn fits(at: &Option<(Vec<f64>, bool)>, d: &[f64], with_gradient: bool) -> bool {
    at.as_ref().is_some_and(|(at, gradient)| at == d && (*gradient || !with_gradient))
}

impl StepProblem for ContactModel {
    fn unknowns(&self) -> usize {
        3 * self.block_rows()
    }

    fn displacements(&self) -> usize {
        self.displacement_count()
    }

    fn history_length(&self) -> usize {
        self.tangential_history()
    }

    fn designs(&self) -> usize {
        self.solid.elements()
    }

    fn fixed(&self) -> &[bool] {
        self.fixed.of(self.held)
    }

    fn groups(&self) -> &[u32] {
        &self.groups
    }

    fn prescribe(&self, time: f64, y: &mut [f64]) {
        self.prescribed.apply(time, y);
    }

    fn load_factors(&self, time: f64) -> Vec<f64> {
        self.loads.factors(time)
    }

    fn begin_step(&mut self, previous: &StepState, time: f64, for_adjoint: bool) -> Result<(), StateError> {
        self.time = time;
        let begin = self.timings.begin();
        let d = &previous.unknowns[..self.displacement_count()];
        let result = self.evaluate_previous(d, for_adjoint);
        self.timings.end(Phase::Contact, begin);
        self.agree(result)?;
        self.share.check_same(&previous.unknowns)?;
        self.previous_history.clone_from(&previous.history);
        self.start = (!for_adjoint).then(|| previous.unknowns[..self.displacement_count()].to_vec());
        self.at_start = !for_adjoint;
        self.evaluated = None;
        self.pattern.begin_step();
        Ok(())
    }

    /// R, and below it C where the method has multipliers. Paper: (18), (27), (35), (44).
    fn residual(&mut self, y: &[f64], out: &mut [f64]) -> Result<(), StateError> {
        let split = self.displacement_count();
        let begin = self.timings.begin();
        let solid = self.solid.internal_force(&y[..split], &self.scalings, &mut self.internal).map_err(inverted);
        self.timings.end(Phase::Solid, begin);
        let result = solid.and_then(|()| self.evaluate(y, self.foresee));
        self.agree(result)?;
        out[..split].copy_from_slice(&self.internal);
        if !self.loads.is_empty() && self.share.has_rest() {
            self.loads.add_residual(self.time, &self.positions(y), &mut out[..split]);
        }
        out[split..].fill(0.0);
        let mut squares = 0.0;
        for j in 0..self.slaves.len() {
            if !self.own[j] {
                continue;
            }
            let acting = self.acting(y, j);
            self.status[j] = acting.status as u8;
            squares += acting.value.norm_squared();
            node::add_force(&self.kinematics[j], &acting.value, &mut out[..split]);
            if self.has_complementarity(j) {
                let c = self.complementarity_of(j, self.multiplier(y, j));
                out[split + 3 * j..][..3].copy_from_slice(c.value.as_slice());
            }
        }
        self.join_residual(out, &mut squares);
        self.traction_norm = squares.sqrt();
        Ok(())
    }

    /// Paper: the matrix of (36), and of (45). Test: `tangent_matches_finite_differences` (tests/derivatives.rs).
    fn tangent(&mut self, y: &[f64]) -> Result<&BlockMatrix, StateError> {
        let split = self.displacement_count();
        self.evaluate_all(y, true)?;
        let wants: Vec<(bool, bool)> = (0..self.slaves.len())
            .map(|j| {
                if !self.own[j] {
                    return (false, false);
                }
                let at = self.measures(j);
                (self.contributes(y, j), at.covered() && at.gap < NEAR * self.slaves[j].size * at.area)
            })
            .collect();
        let couplings = self.steps.iter().zip(&wants);
        let couplings = couplings.map(|(s, &(needed, near))| Coupling { support: &s.support, needed, near });
        let begin = self.timings.begin();
        let (pattern, grown) = self.pattern.covering(couplings);
        if grown || self.matrix.is_none() {
            self.scatter = Some(self.solid.scatter(&pattern));
            self.matrix = Some(BlockMatrix::new(pattern));
        }
        self.timings.end(Phase::Analysis, begin);
        let mut matrix = self.matrix.take().expect("made above");
        let begin = self.timings.begin();
        matrix.set_zero();
        let scatter = self.scatter.as_ref().expect("made with the matrix");
        let result = self.solid.add_tangent(&y[..split], &self.scalings, scatter, &mut matrix).map_err(inverted);
        if !self.loads.is_empty() && self.share.has_rest() {
            self.loads.add_tangent(self.time, &self.positions(y), &mut matrix);
        }
        self.timings.end(Phase::Solid, begin);
        let begin = self.timings.begin();
        if result.is_ok() {
            for j in (0..self.slaves.len()).filter(|&j| self.own[j]) {
                let (now, step, row) = (&self.kinematics[j], &self.steps[j], split / 3 + j);
                if !self.contributes(y, j) {
                    if self.method_of(j).has_multipliers() {
                        matrix.add(row, row, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
                    }
                    continue;
                }
                node::add_force_tangent(now, step, &self.acting(y, j), &mut matrix);
                if self.has_complementarity(j) {
                    let c = self.complementarity_of(j, self.multiplier(y, j));
                    node::add_multiplier_column(now, row, &mut matrix);
                    node::add_complementarity_row(now, step, &c, row, &mut matrix);
                }
            }
        }
        self.timings.end(Phase::Contact, begin);
        self.matrix = Some(matrix);
        // the branch at the start matters to the first tangent only; what follows sees the measures as they are
        if self.starting {
            self.at_start = false;
            self.evaluated = None;
        }
        self.agree(result)?;
        Ok(self.matrix.as_ref().expect("put back above"))
    }

    fn scales(&self) -> Scales {
        let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let displacement = self.evaluated.as_ref().map_or(0.0, |(d, _)| norm(d));
        let position =
            self.evaluated.as_ref().map_or_else(|| norm(&self.coordinates), |(d, _)| norm(&self.positions(d)));
        Scales {
            force: norm(&self.internal).max(self.floors.force),
            displacement: displacement.max(self.floors.displacement),
            multiplier: self.traction_norm.max(self.floors.multiplier),
            position,
        }
    }

    fn active_set(&self) -> &[u8] {
        &self.status
    }

    /// A node that was opposite to the other surface and is no more must not lie deep behind where that surface was: it
    /// would have passed through unnoticed. The previous row at the current positions tells.
    ///
    /// Nor may prescribed displacements alone push a node into the other surface: no multiplier can close that gap.
    fn accept(&mut self, y: &[f64]) -> Result<(), StateError> {
        self.evaluate_all(y, false)?;
        let x = self.positions(y);
        let mut worst: Option<(f64, u32, f64)> = None;
        for (j, before) in self.previous_kinematics.iter().enumerate().filter(|(j, _)| self.own[*j]) {
            let reach = self.interfaces[self.slaves[j].interface as usize].interface.reach();
            if self.measures(j).covered() || !covered(before.area, self.slaves[j].area) {
                continue;
            }
            let depth = -before.gap_at(&x) / before.area;
            if depth > reach && worst.is_none_or(|(deepest, ..)| depth > deepest) {
                worst = Some((depth, before.node, reach));
            }
        }
        let mut pushed: Option<(f64, u32)> = None;
        for j in (0..self.slaves.len()).filter(|&j| self.own[j]) {
            let at = self.measures(j);
            let depth = -at.gap / at.area;
            let prescribed = at.covered() && at.freedom == Freedom::None && depth > CLOSED * self.slaves[j].size;
            if prescribed && pushed.is_none_or(|(deepest, _)| depth > deepest) {
                pushed = Some((depth, self.kinematics[j].node));
            }
        }
        self.share.agree(match (worst, pushed) {
            (Some((depth, node, reach)), _) => Err(StateError::PassedThrough { node, depth, reach }),
            (None, Some((depth, node))) => Err(StateError::PrescribedPenetration { node, depth }),
            (None, None) => Ok(()),
        })
    }

    fn advance_history(&mut self, y: &[f64], out: &mut Vec<f64>) -> Result<(), StateError> {
        out.clear();
        if !self.has(Method::Penalty) {
            return Ok(());
        }
        self.evaluate_all(y, false)?;
        for j in 0..self.slaves.len() {
            let own = self.own[j] && self.method_of(j) == Method::Penalty;
            let tangential = if own { self.acting(y, j).value } else { Vector3::zeros() };
            out.extend([tangential[1], tangential[2]]);
        }
        self.share.sum(&mut [&mut *out]);
        Ok(())
    }

    fn pull_back_current(&mut self, y: &[f64], eta: &[f64], out: &mut [f64]) -> Result<(), StateError> {
        self.evaluate_all(y, true)?;
        self.share.add(out, |out| {
            for j in (0..self.slaves.len()).filter(|&j| self.own[j] && self.method_of(j) == Method::Penalty) {
                let weight = Vector3::new(0.0, eta[2 * j], eta[2 * j + 1]);
                let acting = self.acting(y, j);
                node::add_traction_pull_back(&self.kinematics[j], &self.steps[j], &acting, &weight, out);
            }
            Ok(())
        })
    }

    /// The previous state enters through its mortar row in ũ_τ, (66), and its area in the share of friction, and through
    /// the history of the penalty method.
    ///
    /// * Multipliers: R and the normal rows of C do not see it (62), (63), (67), (85); stick and slip rows do (64), (65).
    ///   So with the augmented Lagrangian, whose equations at convergence are these.
    /// * Penalty: R sees it through the tangential traction (71), (72), in stick (73), (74) and in slip (75)–(77). Where
    ///   the paper carries ∂t_τ/∂d on in (74), the history has its own adjoint η.
    ///
    /// Paper: (62)–(67), (71)–(77), (85). Test: `previous_pull_back_matches_finite_differences` (tests/derivatives.rs).
    fn pull_back_previous(
        &mut self,
        y: &[f64],
        lambda: &[f64],
        eta: &[f64],
        out: &mut PreviousPullBack,
    ) -> Result<(), StateError> {
        self.evaluate_all(y, true)?;
        let begin = self.timings.begin();
        out.unknowns.clear();
        out.unknowns.resize(self.unknowns(), 0.0);
        out.history.clear();
        out.history.resize(self.history_length(), 0.0);
        let x = self.positions(y);
        for j in (0..self.slaves.len()).filter(|&j| self.own[j]) {
            let now = &self.kinematics[j];
            let LawWeights { by_slip, by_friction, by_history, .. } = self.law_weights(j, y, lambda, eta);
            if let Some(by_history) = by_history {
                out.history[2 * j..][..2].copy_from_slice(by_history.as_slice());
            }
            let previous = &self.previous_kinematics[j];
            if by_slip[0] != 0.0 || by_slip[1] != 0.0 {
                previous.add_previous_slip_gradient(&now.frame, &x, by_slip, &mut out.unknowns);
            }
            let by_area = by_friction * self.friction(j).1;
            if by_area != 0.0 {
                previous.add_area_gradient(by_area, &mut out.unknowns);
            }
        }
        self.share.sum(&mut [&mut out.unknowns, &mut out.history]);
        self.timings.end(Phase::PullBack, begin);
        Ok(())
    }

    /// Through the internal force alone: contact knows no density, and C has no part in it.
    ///
    /// Paper: (88)–(90). Test: `current_and_design_pull_back_match_finite_differences` (tests/derivatives.rs).
    fn pull_back_design(&mut self, y: &[f64], lambda: &[f64], out: &mut [f64]) -> Result<(), StateError> {
        let begin = self.timings.begin();
        let split = self.displacement_count();
        self.pull_back_density(&y[..split], &lambda[..split], out)?;
        self.timings.end(Phase::PullBack, begin);
        Ok(())
    }

    fn parameters(&self) -> usize {
        self.parameter_names().len()
    }

    fn pull_back_parameters(
        &mut self,
        y: &[f64],
        time: f64,
        lambda: &[f64],
        eta: &[f64],
        by_prescribed: &[f64],
        out: &mut [f64],
    ) -> Result<(), StateError> {
        self.evaluate_all(y, true)?;
        let begin = self.timings.begin();
        self.share.add(out, |out| {
            self.pull_back_friction(y, lambda, eta, out);
            self.pull_back_stiffness(y, lambda, eta, out);
            self.pull_back_own_moduli(&y[..self.displacement_count()], lambda, out)
        })?;
        self.pull_back_amplitudes(y, time, lambda, by_prescribed, out);
        self.timings.end(Phase::PullBack, begin);
        Ok(())
    }

    fn vary_iteration(&mut self, attempt: usize) -> bool {
        (self.variation, self.onward, self.rescue) = (1.0, 1.0, None);
        if attempt > 0 {
            // the retry starts where the step does
            self.at_start = self.start.is_some();
            self.evaluated = None;
        }
        let (lagrange, others) = (self.has(Method::Lagrange), self.has(Method::Penalty) || self.has(Method::Augmented));
        match attempt {
            0 => true,
            1 => {
                self.variation = if lagrange { 10.0 } else { 1.0 };
                self.onward = if others { -1.0 } else { 1.0 };
                lagrange || others
            }
            2 => {
                self.variation = if lagrange { 0.1 } else { 1.0 };
                lagrange
            }
            _ => false,
        }
    }

    fn uzawa(&self) -> Option<UzawaOptions> {
        self.uzawa.map(|uzawa| uzawa.options)
    }

    fn foresee_tangent(&mut self, likely: bool) {
        self.foresee = likely;
    }

    fn rescue(&mut self, attempt: usize) -> Option<UzawaOptions> {
        let factor = RESCUE_FACTORS.get(attempt).filter(|_| self.has(Method::Lagrange));
        self.rescue = factor.copied();
        factor.map(|_| RESCUE)
    }

    fn hold_multipliers(&mut self, held: Held) {
        self.held = held;
        // another iteration, which may begin where the step does
        self.at_start = self.start.is_some();
        self.evaluated = None;
    }

    fn update_multipliers(&mut self, y: &mut [f64]) -> Result<f64, StateError> {
        self.evaluate_all(y, false)?;
        let absolute = self.held != Held::All && self.uzawa.is_some_and(|uzawa| uzawa.absolute);
        let split = self.displacement_count();
        let (mut change, mut largest): (f64, f64) = (0.0, self.floors.multiplier / (self.slaves.len() as f64).sqrt());
        for j in 0..self.slaves.len() {
            if !self.own[j] {
                y[split + 3 * j..][..3].fill(0.0);
                continue;
            }
            // after a solve for all of them, the method's own multipliers are looked at: nothing is held then
            if self.method_of(j) != Method::Augmented && !self.is_held(j) {
                continue;
            }
            let before = self.multiplier(y, j);
            let now = self.regularised_of(j, before).value;
            // normal and tangential conditions each for itself
            let mut difference = (now[0] - before[0]).abs().max((now[1] - before[1]).hypot(now[2] - before[2]));
            if absolute {
                let epsilon = self.augmentation(j);
                let divisor = epsilon.scaling.divisor(&self.measures(j));
                difference *= divisor / epsilon.normal.min(epsilon.tangential);
            }
            change = change.max(difference);
            largest = largest.max(now.norm());
            y[split + 3 * j..][..3].copy_from_slice(now.as_slice());
        }
        self.share.sum(&mut [&mut y[split..]]);
        let (change, largest) = (self.share.largest(change), self.share.largest(largest));
        Ok(if absolute { change } else { change / largest })
    }
}
